"""`polepilot calibrate drive` on a terminal: what to do, step by step, in plain words.

Nothing moves before the person has said yes to it; each motion is short, and any key stops it.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

from polepilot.commands.person import Person, agrees, choice, number
from polepilot.core.command import DriveCommand
from polepilot.core.errors import RefusedError
from polepilot.core.link.drive_fit import DriveRun, fit_drive
from polepilot.core.link.messages import Faults, Features
from polepilot.core.link.report import LinkState
from polepilot.core.link.words import BOARDS, faults_in_words
from polepilot.core.link.workbench import Motion, Workbench

if TYPE_CHECKING:
    from polepilot.core.link.calibration import DriveCalibration
    from polepilot.core.vehicle import Vehicle

_FIRST_DUTY = 300
"""Per mille: turns most geared motors, and none of them fast."""
_DUTY_STEP = 100
_MOST_DUTY = 800
_TWITCH = 0.6
"""Seconds of a wheel in the air."""
_AIM = 0.6
"""Seconds for the servo before the wheels."""
_SERVO_TRY = 1000
"""Centidegrees: enough to see which way the front wheel turns."""
_SERVO_STEP = 500
_LONGEST_RUN = 8.0
_LATE = 0.15
"""Seconds by which a motor may answer late."""
_LARGE_BAND = 0.7
"""Share of the lowest duty that turns the wheels which may move nothing."""
_TURN = math.radians(100)
"""By how much the heading changes in an arc."""


class Ended(RefusedError):
    """The person does not want to go on, or the robot is not fit for it."""

    code = "ended"


@dataclass(frozen=True, slots=True)
class Found:
    """What the guide brings home."""

    runs: tuple[DriveRun, ...]
    trim: float | None
    servo_limit: float


class Guide:
    """Leads somebody through the calibration of one robot.

    Args:
        space: free floor ahead of the start line, and to both sides, metres.
        lift: does what a person does before each run, carry the robot back to its line; for a
            simulated robot.
        hint: what the person would measure after a run; for a simulated robot.
    """

    def __init__(
        self,
        bench: Workbench,
        person: Person,
        vehicle: Vehicle,
        present: DriveCalibration,
        *,
        space: float = 2.0,
        lift: Callable[[], object] = lambda: None,
        hint: Callable[[], tuple[float, float]] | None = None,
    ) -> None:
        self._bench = bench
        self._person = person
        self._vehicle = vehicle
        self._present = present
        self._space = space
        self._lift = lift
        self._hint = hint
        self._sign = 1
        """-1: the servo is mirrored."""

    def lead(self) -> Found:
        """Through all of it.

        Raises:
            Ended: the person has had enough, or a wire is wrong.
            LinkError: the board is gone.
        """
        say = self._person.say
        say(
            "This finds out what your motors and your servo do. It takes a quarter of an hour, a "
            "tape measure,\na box that lifts the robot's wheels off the ground, and later "
            f"{self._space:g} m of free, level floor ahead and to both sides.\n"
            "Nothing moves before you say yes. While something moves, ANY KEY STOPS IT, as does "
            "Ctrl-C.\n"
        )
        self._want("Does the robot stand on the box, all wheels in the air, the motors' supply on?")
        about = self._bench.connect()
        say(f"The board answers: {BOARDS[about.board]}.")
        self._check_faults()

        say("\n1. The wheels, in the air.")
        duty = self._wheels()
        trim = self._turns(duty)

        say("\n2. The front wheel, in the air.")
        limit = self._servo()

        say(
            "\n3. On the floor. Draw a line, or lay down a tape: before each run the rear axle "
            "stands on it, the robot looks at\nright angles away from it, and its front wheel "
            f"stands straight. Ahead and to both sides {self._space:g} m have to be free."
        )
        self._want("Does the robot stand on its line, with nobody in the way?")
        runs = self._straight_runs(duty)
        runs += self._arcs(runs, trim, limit)
        say("")
        return Found(tuple(runs), trim, limit)

    # ---- in the air --------------------------------------------------------------------------

    def _wheels(self) -> int:
        """Each wheel turns, and forward; the least duty (per mille) tried at which both do."""
        least = _FIRST_DUTY
        for side, left, right in (("left", 1, 0), ("right", 0, 1)):
            duty = least
            while True:
                self._want(f"May the {side} rear wheel turn forward for a moment ({duty // 10} %)?")
                motion = self._motion(
                    lambda duty=duty, left=left, right=right: self._bench.drive(  # type: ignore[misc]
                        left * duty, right * duty, 0, _TWITCH
                    )
                )
                if motion is None:  # says nothing about the duty
                    continue
                seen = choice(
                    self._person,
                    f"Did the {side} wheel turn forward: yes, no (it stood), or other (o)?",
                    "yno",
                )
                if seen == "y":
                    break
                if seen == "o":
                    raise Ended(
                        f"The {side} wheel is wired otherwise.",
                        remedy="Swap the two wires of a motor that turns backward, or the two "
                        "motors if the other one turned; then begin again.",
                    )
                duty += _DUTY_STEP
                if duty > _MOST_DUTY:
                    raise Ended(
                        f"The {side} wheel does not turn.",
                        remedy="Check the motors' supply, the bridge and its wires.",
                    )
            least = max(least, duty)
        return least

    def _turns(self, duty: int) -> float | None:
        """Right by left speed from counted turns; None where nobody wants to count."""
        if Features.ENCODERS in self._bench.board.features:
            return None
        self._person.say(
            "Two motors are never quite alike. Stick a mark on each rear wheel, and count its "
            "turns while both run for ten\nseconds, to a quarter of a turn; you may film it. Or "
            "leave it out: then both count as alike."
        )
        if not agrees(self._person, "Shall both wheels run for ten seconds?"):
            return None
        duty = min(duty + _DUTY_STEP, _MOST_DUTY)
        motion = self._motion(lambda: self._bench.drive(duty, duty, 0, 10.0))
        if motion is None:
            return None
        left = number(self._person, "Turns of the left wheel:", 0.5, 500)
        right = number(self._person, "Turns of the right wheel:", 0.5, 500)
        if not 0.5 <= right / left <= 2:
            self._person.say(
                "  One is more than twice as fast as the other: left out as a mistake."
            )
            return None
        return right / left

    def _servo(self) -> float:
        """Which way the servo turns, and how far: the largest angle to send, rad."""
        self._want("May the front wheel steer for a moment?")
        self._motion(lambda: self._bench.drive(0, 0, _SERVO_TRY, 1.0))
        seen = choice(
            self._person,
            "Which way did the front wheel turn: left, right, or not at all (n)?",
            "lrn",
        )
        if seen == "n":
            raise Ended("The servo does not turn.", remedy="Check its supply, ground and signal.")
        self._sign = 1 if seen == "l" else -1
        limits = [self._servo_end(way) for way in (1, -1)]
        return min(limits)

    def _servo_end(self, way: int) -> float:
        """How far it turns freely to one side (the sign of what is sent), rad."""
        side = "left" if way * self._sign > 0 else "right"
        good = _SERVO_TRY
        while True:
            wanted = good + _SERVO_STEP
            if not agrees(self._person, f"May it turn to the {side} to {wanted // 100}°?"):
                break
            motion = self._motion(
                lambda wanted=wanted: self._bench.drive(0, 0, way * wanted, 1.0)  # type: ignore[misc]
            )
            if motion is None:
                break
            applied = max(abs(sample.telemetry.steering) for sample in motion.samples)
            if applied < wanted - 10:
                self._person.say(f"  The firmware lets it turn to {applied / 100:g}° and no more.")
                good = max(good, applied)
                break
            if not agrees(
                self._person, "Did it turn farther than before, without humming or touching?"
            ):
                break
            good = wanted
        return math.radians(good / 100)

    # ---- on the floor ------------------------------------------------------------------------

    def _straight_runs(self, duty: int) -> list[DriveRun]:
        """A short run to learn how fast it is, a long one, and a faster one."""
        low = min(duty + 50, _MOST_DUTY)
        runs = [self._run("straight on, for one second", low, low, 0.0, 1.0)]
        self._check_space(runs[0], low)
        first = runs[0].length / (runs[0].seconds - _LATE)
        seconds = self._seconds(first)
        runs.append(self._run("straight on again, longer", low, low, 0.0, seconds))
        high = min(2 * low, 900)
        # Nobody knows the dead band yet; the larger it is, the steeper the speed rises.
        band = _LARGE_BAND * low
        seconds = self._seconds(runs[1].length / seconds * (high - band) / (low - band))
        runs.append(self._run("straight on, faster", high, high, 0.0, seconds))
        return runs

    def _arcs(self, runs: list[DriveRun], trim: float | None, limit: float) -> list[DriveRun]:
        """To the left and to the right."""
        so_far = self._fit(runs, trim)
        so_far = replace(so_far, servo_limit=max(limit, abs(so_far.servo_center) + 0.02))
        reach = min(self._vehicle.max_steering, limit - abs(so_far.servo_center))
        arcs = []
        for side, way in (("left", 1), ("right", -1)):
            steering = way * 0.7 * reach
            speed = 0.5 * min(so_far.full_speed_left, so_far.full_speed_right)
            left, right, servo = so_far.to_drive(DriveCommand(speed, steering), self._vehicle)
            radius = self._vehicle.wheelbase / math.tan(abs(steering))
            seconds = min(_TURN * radius, 1.5 * self._space) / speed
            arcs.append(
                self._run(
                    f"in a curve to the {side}",
                    left,
                    right,
                    math.radians(servo / 100),
                    min(max(seconds, 1.0), _LONGEST_RUN),
                )
            )
        return arcs

    def _fit(self, runs: list[DriveRun], trim: float | None) -> DriveCalibration:
        present = replace(self._present, servo_scale=self._sign * abs(self._present.servo_scale))
        return fit_drive(runs, self._vehicle, present, trim=trim).calibration

    def _seconds(self, speed: float) -> float:
        """How long a run may take that ends well before the free floor does."""
        return min(max(0.75 * self._space / max(speed, 0.02), 1.0), _LONGEST_RUN)

    def _check_space(self, run: DriveRun, duty: int) -> None:
        if run.length > 0.7 * self._space:
            raise Ended(
                f"At {duty // 10} % it came {run.length:.1f} m in a second: {self._space:g} m are "
                "too little.",
                remedy="Begin again with more free floor, as --space 4.",
            )

    def _run(self, how: str, left: int, right: int, servo: float, seconds: float) -> DriveRun:
        """One run and what was measured after it; again where it was not whole."""
        ask = self._person
        while True:
            self._lift()
            self._want(f"Robot on its line, way free? May it drive {how}? (about {seconds:.1f} s)")
            odometer = self._bench.latest.telemetry.odometer
            motion = self._motion(
                lambda: self._bench.drive(
                    left, right, round(math.degrees(servo) * 100), seconds, aim=_AIM
                )
            )
            if motion is None:
                ask.say("That run does not count. Put the robot back on its line.")
                continue
            self._bench.watch(0.5)
            if self._hint is not None:
                ahead, aside = self._hint()
                ask.say(
                    f"(simulated: a tape measure says {ahead * 100:.1f} cm ahead, "
                    f"{aside * 100:+.1f} cm aside)"
                )
            ahead = number(ask, "How far ahead of the line is the rear axle now, cm:", -1000, 1000)
            aside = number(
                ask, "How far to the LEFT of its start is the middle of it, cm (right: minus):",
                -1000, 1000,
            )  # fmt: skip
            run = self._measured(motion, (left, right), servo, (ahead, aside), odometer)
            if run is not None:
                return run
            ask.say("That cannot be: the run does not count. Put the robot back on its line.")

    def _measured(
        self,
        motion: Motion,
        duties: tuple[int, int],
        servo: float,
        place: tuple[float, float],
        odometer: tuple[int, int],
    ) -> DriveRun | None:
        """The run by its numbers (centimetres); None where they are impossible."""
        from polepilot.core.errors import InputError

        areas = motion.duty_seconds()
        counts = None
        if Features.ENCODERS in self._bench.board.features:
            now = self._bench.latest.telemetry.odometer
            counts = now[0] - odometer[0], now[1] - odometer[1]
        try:
            return DriveRun(
                left=duties[0] / 1000,
                right=duties[1] / 1000,
                steering=servo,
                seconds=sum(areas) / sum(duties),
                ahead=place[0] / 100,
                aside=place[1] / 100,
                counts=counts,
            )
        except InputError:
            return None

    # ---- what all steps share ----------------------------------------------------------------

    def _want(self, question: str) -> None:
        """A yes, or the end of it."""
        if not agrees(self._person, question):
            raise Ended("Ended by you; nothing was changed.")

    def _check_faults(self) -> None:
        telemetry = self._bench.latest.telemetry
        for words in faults_in_words(telemetry.faults):
            self._person.say(f"  Note: {words}")
        if self._bench.state is LinkState.ESTOP:
            self._release()
        if Faults.LOW_BATTERY in telemetry.faults:
            self._want("A low battery makes slow motors. Go on nevertheless?")

    def _release(self) -> None:
        self._want("The board is stopped. Is all well, and shall the stop end?")
        if not self._bench.release():
            raise Ended(
                "The board stays stopped.", remedy="Release the stop button; check its wire."
            )

    def _motion(self, move: Callable[[], Motion]) -> Motion | None:
        """Something that moves, watched; None where it did not go on to its end."""
        if self._bench.state is LinkState.ESTOP:
            self._release()
        with self._person.at_the_keys() as pressed:
            motion = self._bench.watched_by(pressed, move)
        if motion.stopped:
            self._person.say(f"  Stopped: {motion.stopped}.")
            if self._bench.state is LinkState.ESTOP:
                self._release()
            return None
        if Faults.PROXIMITY_STOP in motion.faults:
            self._person.say("  Held back: something is near a proximity sensor.")
            return None
        return motion
