"""How the robot really moves, what it was told, and what its potentiometer says.

An integrator of its own in steps of 5 ms: commands 20 times a second from a driver who knows the
true pose, delayed, lagging motors and servo, slip as coloured noise and in bursts, a camera that
sweeps to and fro at a speed that is not quite even, and what befalls the robot from outside.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from recordings.scenario import DURATION, HALF_SWEEP, LIFTED_BY, Point, Rng, Scenario, Shift, bent

STEP = 0.005
CONTROL = 10
"""Steps between two commands."""
READING = 4
"""Steps between two readings of the potentiometer."""
COUNTS = 1023
ENDS = 0.045
"""The camera turns round so long before the potentiometer's ends, radians."""
STEEPEST = math.radians(30)
Floats = NDArray[np.float64]


@dataclass(frozen=True, slots=True, eq=False)
class Course:
    """The true motion on a grid of times, seconds from the beginning."""

    t: Floats
    x: Floats
    y: Floats
    heading: Floats
    """Not wrapped."""
    pan: Floats
    rise: Floats
    """How high the robot is held above the floor."""
    pitch: Floats
    """Of the body by rocking, and ``roll``."""
    roll: Floats
    commands: list[tuple[float, float, float]]
    """Time, speed, steering."""
    readings: list[tuple[float, float]]
    """Time and angle of the potentiometer by its nominal calibration."""
    frames: Floats
    """Moments of the pictures: the middle row's exposure."""
    shift: Shift | None
    first_motion: float


class Driver:
    """Steers along a route of random legs, or wanders; keeps off walls and people."""

    def __init__(self, scenario: Scenario, rng: Rng) -> None:
        self._scenario = scenario
        self._rng = rng
        self._goal: Point | None = None
        self._speed = 0.3
        self._pause = 0.0
        self._back = 0.0
        self._turned = 0.0
        self._wish = 0.0
        self._tick = CONTROL * STEP
        self._things = [(pole.x, pole.y, 0.4) for pole in scenario.poles]
        if scenario.person is not None:
            self._things.append((scenario.person.x, scenario.person.y, 0.6))

    def command(self, x: float, y: float, heading: float) -> Point:
        """Speed and steering, with the robot at this pose."""
        rng = self._rng
        pose = (x, y, heading)
        if self._pause > 0:
            self._pause -= self._tick
            return 0.0, 0.0
        if self._back > 0 and self._clear(pose, self._turned, -1):
            self._back -= self._tick
            return -0.15, self._turned
        self._back = 0.0
        if self._goal is None or math.dist((x, y), self._goal) < 0.35:
            arrived = self._goal is not None
            self._goal = self.leg((x, y))
            self._speed = float(rng.uniform(0.18, 0.35))
            if arrived and rng.random() < 0.3:
                self._pause = float(rng.uniform(0.5, 2.5))
                return 0.0, 0.0
        steering = self._toward(pose, self._goal)
        for choice in (steering, *(side * STEEPEST for side in (1, 0.5, 0, -0.5, -1))):
            if self._clear(pose, choice, 1):
                return self._speed, choice
        # A turn in several moves: back with the wheel turned the other way.
        self._back, self._turned = 1.5, -math.copysign(0.8 * STEEPEST, steering)
        if self._clear(pose, self._turned, -1):
            return -0.15, self._turned
        self._turned = -self._turned
        self._goal = None
        return 0.0, 0.0

    def _toward(self, pose: tuple[float, float, float], goal: Point) -> float:
        x, y, heading = pose
        off = math.remainder(math.atan2(goal[1] - y, goal[0] - x) - heading, math.tau)
        reach = max(math.dist((x, y), goal), 0.5)
        steering = math.atan(self._scenario.robot.wheelbase * 2.0 * math.sin(off) / reach)
        if abs(off) > math.pi / 2:
            steering = math.copysign(STEEPEST, off)
        if self._scenario.wanders:
            kick = 0.25 * math.sqrt(self._tick) * float(self._rng.normal())
            self._wish += -self._wish * self._tick / 1.5 + kick
            steering = 0.4 * steering + self._wish
        return min(max(steering, -STEEPEST), STEEPEST)

    def _clear(self, pose: tuple[float, float, float], steering: float, way: int) -> bool:
        """Whether nothing is in the way for the next half metre and more."""
        x, y, heading = pose
        scenario = self._scenario
        width, depth = scenario.size
        for _ in range(7):
            heading += way * 0.05 * math.tan(steering) / scenario.robot.wheelbase
            x, y = x + way * 0.1 * math.cos(heading), y + way * 0.1 * math.sin(heading)
            heading += way * 0.05 * math.tan(steering) / scenario.robot.wheelbase
            if min(x, width - x, y, depth - y) < 0.35:
                return False
            if any(math.dist((x, y), (a, b)) < c for a, b, c in self._things):
                return False
        return True

    def leg(self, start: Point) -> Point:
        """The end of a leg from ``start`` that keeps clear of everything."""
        scenario, rng = self._scenario, self._rng
        width, depth = scenario.size
        margin = scenario.margin
        goal = (width / 2, depth / 2)
        for _ in range(200):
            goal = (
                float(rng.uniform(margin, width - margin)),
                float(rng.uniform(margin, depth - margin)),
            )
            far = math.dist(start, goal)
            if 1.5 < far < 8.0 and all(
                _apart(start, goal, (a, b)) > c + 0.1 for a, b, c in self._things
            ):
                break
        return goal


def _apart(a: Point, b: Point, c: Point) -> float:
    """Distance of ``c`` from the line between ``a`` and ``b``."""
    ax, ay = b[0] - a[0], b[1] - a[1]
    share = ((c[0] - a[0]) * ax + (c[1] - a[1]) * ay) / max(ax * ax + ay * ay, 1e-9)
    share = min(max(share, 0.0), 1.0)
    return math.dist(c, (a[0] + share * ax, a[1] + share * ay))


def coloured(rng: Rng, count: int, spread: float, time: float) -> Floats:
    """Noise with a memory of ``time`` seconds, by steps."""
    keep = math.exp(-STEP / time)
    kicks = rng.normal(0.0, spread * math.sqrt(1 - keep * keep), count)
    out = np.empty(count)
    value = float(rng.normal(0.0, spread))
    for index, kick in enumerate(kicks.tolist()):
        value = keep * value + kick
        out[index] = value
    return out


def _bursts(rng: Rng, count: int, share: float) -> tuple[Floats, Floats]:
    """Factors on speed (and with it on turning) and on curvature: the front slips little."""
    speed, curvature = np.ones(count), np.ones(count)
    at = float(rng.exponential(3.0))
    while share and at < DURATION:
        lasts = float(rng.uniform(0.5, 1.5))
        part = slice(int(at / STEP), int((at + lasts) / STEP))
        speed[part] -= share
        curvature[part] += 0.3 * share * rng.choice([-1, 1])
        at += lasts + float(rng.exponential(4.0))
    return speed, curvature


def _sweep(rng: Rng, scenario: Scenario, count: int) -> Floats:
    """The pan angle by steps: to and fro, with soft turns and an uneven speed."""
    uneven = (1.0 + coloured(rng, count, 0.02, 1.0)).tolist()
    angle = float(rng.uniform(-HALF_SWEEP, HALF_SWEEP))
    way = int(rng.choice([-1, 1]))
    full = scenario.robot.pan_rate
    rate = way * full
    out = np.empty(count)
    for index in range(count):
        if angle * way > HALF_SWEEP - ENDS:
            way = -way
        rate += min(max(way * full - rate, -8.0 * STEP), 8.0 * STEP)
        angle += rate * uneven[index] * STEP
        angle = min(max(angle, -HALF_SWEEP), HALF_SWEEP)
        out[index] = angle
    return out


def _shift(rng: Rng, scenario: Scenario, x: float, y: float, heading: float, at: float) -> Shift:
    """Where the robot is put, or pushed, from where it is."""
    if scenario.kind == "lifted":
        reach, turn = LIFTED_BY, float(rng.uniform(0.5, 2.5)) * int(rng.choice([-1, 1]))
        lasts, rise, stands = 0.8, 0.25, float(rng.uniform(4.0, 7.0))
    else:
        reach = float(rng.uniform(0.3, 0.6))
        turn = math.radians(float(rng.uniform(10, 40))) * int(rng.choice([-1, 1]))
        lasts, rise, stands = 0.4, 0.0, 0.0
    width, depth = scenario.size
    best = (0.0, 0.0)
    room = -math.inf
    for _ in range(60):
        way = float(rng.uniform(-math.pi, math.pi))
        dx, dy = reach * math.cos(way), reach * math.sin(way)
        ends = (x + dx, y + dy)
        least = min(ends[0], width - ends[0], ends[1], depth - ends[1])
        least = min(least, *(math.dist(ends, (pole.x, pole.y)) + 0.2 for pole in scenario.poles))
        if least > room:
            best, room = (dx, dy), least
        if least > scenario.margin:
            break
    return Shift(at, lasts, *best, turn, rise, stands)


def drive(scenario: Scenario) -> Course:
    """The whole run."""
    rng = np.random.default_rng([scenario.seed, 99])
    robot = scenario.robot
    count = round(DURATION / STEP) + 1
    driver = Driver(scenario, rng)
    slip_speed = coloured(rng, count, robot.slip, 0.4)
    slip_turn = coloured(rng, count, robot.slip, 0.4)
    sideways = coloured(rng, count, robot.skew, 0.5)
    drift = coloured(rng, count, 2 * robot.skew, 0.7)
    burst_speed, burst_turn = _bursts(rng, count, robot.bursts)
    grip = ((1 + slip_speed) * burst_speed).tolist()
    curl = ((1 + slip_turn) * burst_turn).tolist()
    aside, twist = sideways.tolist(), drift.tolist()
    pan = _sweep(rng, scenario, count)
    rocking = [coloured(rng, count, scenario.eye.rocking, 0.25) for _ in range(2)]
    shift_at = float(rng.uniform(40.0, 50.0)) if scenario.shift else math.inf
    stand = 1.0 if scenario.kind == "lifted" else 0.0

    width, depth = scenario.size
    margin = scenario.margin + 0.3
    x, y = float(rng.uniform(margin, width - margin)), float(rng.uniform(margin, depth - margin))
    heading = float(rng.uniform(-math.pi, math.pi))
    speed = steering = 0.0
    shift: Shift | None = None
    commands: list[tuple[float, float, float]] = []
    waiting: list[tuple[float, float, float]] = []
    told = (0.0, 0.0)
    rows = np.zeros((count, 5))
    keep_motor = 1 - math.exp(-STEP / robot.motor_lag)
    keep_servo = 1 - math.exp(-STEP / robot.servo_lag)
    for index in range(count):
        t = index * STEP
        rise = 0.0
        if shift is None and t >= shift_at:
            shift = _shift(rng, scenario, x, y, heading, t)
        taken = shift is not None and shift.at <= t < shift.at + shift.lasts
        if index % CONTROL == 0:
            still = t < scenario.stands or shift_at - stand - 0.3 <= t < shift_at or taken
            if shift is not None:
                still = still or shift.at <= t < shift.at + shift.lasts + shift.stands
            if scenario.kind == "push":
                still = t < scenario.stands
            wish = (0.0, 0.0) if still else driver.command(x, y, heading)
            commands.append((t, round(wish[0], 4), round(wish[1], 4)))
            waiting.append((t + robot.delay, *wish))
        while waiting and waiting[0][0] <= t:
            told = waiting.pop(0)[1:]
        speed += keep_motor * (told[0] * robot.speed_scale - speed)
        if told[0] == 0.0 and abs(speed) < 0.004:
            speed = 0.0
        turn = keep_servo * (told[1] + robot.steering_offset - steering)
        steering += min(max(turn, -robot.servo_rate * STEP), robot.servo_rate * STEP)
        over = speed * grip[index]
        curvature = math.tan(steering) / robot.wheelbase * curl[index] + twist[index]
        change = over * STEP * curvature
        middle = heading + 0.5 * change
        ahead, left = over * STEP, over * STEP * aside[index]
        x += ahead * math.cos(middle) - left * math.sin(middle)
        y += ahead * math.sin(middle) + left * math.cos(middle)
        heading += change
        if taken and shift is not None:
            share = (t - shift.at) / shift.lasts
            pace = math.sin(math.pi * share) ** 2 * 2 / shift.lasts * STEP
            x, y, heading = x + pace * shift.dx, y + pace * shift.dy, heading + pace * shift.turn
            rise = shift.rise * math.sin(math.pi * share) ** 2
        rows[index] = x, y, heading, rise, abs(over)
    times = np.arange(count) * STEP
    # Rocking comes and goes with the motion.
    shaken = np.convolve(np.minimum(rows[:, 4] / 0.2, 1.0), np.full(40, 1 / 40), "same")
    moving = np.flatnonzero(rows[:, 4] > 0.01)
    frames = np.arange(0.1, DURATION - 0.1, 1 / scenario.eye.rate)
    frames = frames + rng.uniform(-0.002, 0.002, len(frames))
    return Course(
        times,
        rows[:, 0],
        rows[:, 1],
        rows[:, 2],
        pan,
        rows[:, 3],
        rocking[0] * shaken,
        rocking[1] * shaken,
        commands,
        _readings(rng, scenario, times, pan),
        frames,
        shift,
        float(times[moving[0]]) if len(moving) else DURATION,
    )


def _readings(
    rng: Rng, scenario: Scenario, times: Floats, pan: Floats
) -> list[tuple[float, float]]:
    """Ten bits, a little noise, a bend."""
    moments = times[::READING] + rng.uniform(-0.001, 0.001, len(times[::READING]))
    moments = np.clip(moments, 0.0, DURATION)
    angles = np.interp(moments, times, pan)
    seen = angles + bent(angles, scenario.robot.bend)
    counts = (seen + HALF_SWEEP) / (2 * HALF_SWEEP) * COUNTS + rng.normal(0.0, 0.3, len(seen))
    counts = np.clip(np.rint(counts), 0, COUNTS)
    said = counts / COUNTS * 2 * HALF_SWEEP - HALF_SWEEP
    return list(zip(moments.tolist(), said.tolist(), strict=True))
