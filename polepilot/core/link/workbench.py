"""One board in a person's hands: connect, look, move one output for a moment, stop.

For commands that check and calibrate a robot; the robot itself has its own loop. Everything waits
by the clock that it is given, and every motion ends by itself, by ``pressed``, or by the board's
own deadlines where this program dies.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from itertools import pairwise
from types import TracebackType

from polepilot.core.errors import LinkError, RefusedError
from polepilot.core.link.messages import Faults, HelloAck
from polepilot.core.link.protocol import HostLink
from polepilot.core.link.report import (
    LinkEvent,
    LinkEventCode,
    LinkSettings,
    LinkState,
    LinkStatistics,
    TelemetrySample,
)
from polepilot.core.robot.ports import Clock, LinkPort

TICK = 0.02
"""Seconds between two looks at the line."""
_RAMP = 0.4
"""After a motion the board has brought every duty back to zero within this, seconds."""
_ANSWER = 3.0
"""For a command to be carried out, or refused, seconds."""


@dataclass(frozen=True, slots=True)
class Motion:
    """What came of moving something for a moment."""

    samples: tuple[TelemetrySample, ...]
    stopped: str = ""
    """Why it ended early; empty where it went on to its end."""

    @property
    def faults(self) -> Faults:
        """All fault bits that were set meanwhile."""
        faults = Faults.NONE
        for sample in self.samples:
            faults |= sample.telemetry.faults
        return faults

    def duty_seconds(self) -> tuple[float, float]:
        """Applied duty (per mille) of the left and the right wheel, summed up over time."""
        left = right = 0.0
        for before, after in pairwise(self.samples):
            elapsed = after.stamp - before.stamp
            left += (before.telemetry.duty[0] + after.telemetry.duty[0]) / 2 * elapsed
            right += (before.telemetry.duty[1] + after.telemetry.duty[1]) / 2 * elapsed
        return left, right


class Workbench:
    """A session with one board, as a context: at its end the motors are off.

    An exception inside, Ctrl-C as well, becomes an emergency stop on its way out.

    Args:
        port: opened at the first look, and closed at the end.
        clock: the one that stamps the port's bytes.
    """

    def __init__(self, port: LinkPort, clock: Clock) -> None:
        self._port = port
        self._clock = clock
        self._pressed: Callable[[], bool] = lambda: False
        self._link = HostLink(replace(LinkSettings(), ping_period=0.05))
        self._generation = -1
        self._bytes = 0
        self._events: list[LinkEvent] = []
        self._samples: list[TelemetrySample] = []

    def __enter__(self) -> Workbench:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        try:
            if not isinstance(error, LinkError) and self._link.ready:
                self._link.pan(0)
                if error is not None and self._link.armed:
                    self.stop()
                else:
                    self._link.disarm()
                    self.watch(2 * TICK)
        finally:
            self._port.close()

    # ---- what is known -----------------------------------------------------------------------

    @property
    def state(self) -> LinkState:
        return self._link.state

    @property
    def board(self) -> HelloAck:
        """Who answered.

        Raises:
            LinkError: nobody has.
        """
        if self._link.board is None:
            raise LinkError("The board does not answer.", remedy="Check its cable and power.")
        return self._link.board

    @property
    def latest(self) -> TelemetrySample:
        """The newest telemetry.

        Raises:
            LinkError: there is none.
        """
        if self._link.telemetry is None:
            raise LinkError("The board sends no telemetry.", remedy="Is it the right device?")
        return self._link.telemetry

    @property
    def statistics(self) -> LinkStatistics:
        return self._link.statistics

    # ---- what can be done --------------------------------------------------------------------

    def connect(self, patience: float = 5.0) -> HelloAck:
        """The handshake; an Arduino's boot loader lets it wait for two seconds.

        Raises:
            LinkError: the port cannot be opened, nobody answers, what answers is no board of
                ours, or it speaks another version.
        """
        self._run(patience, lambda: self._link.ready or self._mismatch() is not None)
        mismatch = self._mismatch()
        if mismatch is not None:
            raise LinkError(mismatch, code="link_version")
        if not self._link.ready:
            raise self._silence()
        self._run(_ANSWER, lambda: self._link.telemetry is not None)
        return self.board

    def watch(
        self, seconds: float, until: Callable[[], bool] = lambda: False
    ) -> list[TelemetrySample]:
        """Let time pass, at most until something has happened; the telemetry of that time."""
        self._samples = []
        self._run(seconds, until)
        return list(self._samples)

    def round_trips(self, count: int, patience: float = 15.0) -> list[float]:
        """Milliseconds of ``count`` PINGs, fewer where the board does not answer."""
        trips: list[float] = []
        self._link.round_trips()

        def enough() -> bool:
            trips.extend(self._link.round_trips())
            return len(trips) >= count

        self._run(patience, enough)
        return trips[:count]

    def watched_by(self, pressed: Callable[[], bool], move: Callable[[], Motion]) -> Motion:
        """Do ``move`` while ``pressed``, asked in each tick, can stop everything."""
        self._pressed = pressed
        try:
            return move()
        finally:
            self._pressed = lambda: False

    def drive(
        self, left: int, right: int, steering: int, seconds: float, *, aim: float = 0.0
    ) -> Motion:
        """Arm, turn wheels and servo for so long, let the duties fall to zero, disarm.

        Duties in per mille, steering in centidegrees. The servo begins ``aim`` seconds before
        the wheels, and keeps its angle until ``drive`` ends.

        Raises:
            RefusedError: the board does not let itself be armed.
            LinkError: the line is lost.
        """
        self.arm()
        self._samples = []
        stopped = ""
        if aim > 0:
            stopped = self._move(aim, lambda: self._link.drive(0, 0, steering))
        if not stopped:
            stopped = self._move(seconds, lambda: self._link.drive(left, right, steering))
        if not stopped:
            stopped = self._move(_RAMP, lambda: self._link.drive(0, 0, steering))
        samples = tuple(self._samples)
        self._link.disarm()
        self._settle()
        return Motion(samples, stopped)

    def pan(self, rate: int, seconds: float) -> Motion:
        """Turn the camera for so long, ``rate`` in per mille, left positive."""
        self._samples = []
        self._link.pan(rate)
        stopped = self._move(seconds, lambda: None, armed=False)
        self._link.pan(0)
        self._run(0.3)
        return Motion(tuple(self._samples), stopped)

    def arm(self) -> None:
        """Let the wheels turn.

        Raises:
            RefusedError: a latched stop, or the board refuses.
        """
        self._events.clear()
        self._link.arm()
        self._run(_ANSWER, lambda: self._link.armed or self._refusal() is not None)
        if not self._link.armed:
            raise RefusedError(
                self._refusal() or "The board does not answer ARM.", code="not_armed"
            )

    def stop(self) -> bool:
        """Emergency stop, latched; whether the board has acknowledged it."""
        self._link.estop()
        self._run(_ANSWER, lambda: not self._link.estop_pending)
        return not self._link.estop_pending

    def release(self) -> bool:
        """End a latched stop; whether the board has done so."""
        for _ in range(3):  # the button may have been let go just now
            self._link.clear()
            self._run(_ANSWER / 3, lambda: self._link.state is LinkState.IDLE)
        return self._link.state is LinkState.IDLE

    # ---- the loop ----------------------------------------------------------------------------

    def _move(self, seconds: float, act: Callable[[], None], *, armed: bool = True) -> str:
        """Run while ``act`` is done in each tick; why it ended early."""
        ended = ""

        def over() -> bool:
            nonlocal ended
            if self._pressed():
                ended = "stopped by you"
                self.stop()
            elif self._link.state is LinkState.ESTOP:
                ended = "the stop button was pressed"
            elif armed and not self._link.armed:
                # A computer that stalled, or the cable: the next command will show.
                ended = "the board missed us and stopped by itself"
            else:
                act()
            return bool(ended)

        over()
        if not ended:
            self._run(seconds, over)
        return ended

    def _settle(self) -> None:
        """A new handshake after ``disarm``."""
        self._run(_ANSWER, lambda: self._link.ready)

    def _run(self, seconds: float, until: Callable[[], bool] = lambda: False) -> None:
        end = self._clock.now() + seconds
        while True:
            self._tick()
            if until() or self._clock.now() >= end:
                break
            self._clock.wait_until(self._clock.now() + TICK)
        self._tick()

    def _tick(self) -> None:
        chunks = self._port.read()
        now = self._clock.now()
        if self._port.generation != self._generation:
            self._generation = self._port.generation
            self._link.reset(now)
        for chunk in chunks:
            self._bytes += len(chunk.data)
            self._link.receive(chunk.data, chunk.stamp)
        self._samples += self._link.samples()
        self._port.write(self._link.poll(now))
        self._events = [*self._events, *self._link.events()][-50:]

    def _refusal(self) -> str | None:
        codes = (LinkEventCode.REFUSED, LinkEventCode.UNANSWERED)
        return next((e.message for e in self._events if e.code in codes), None)

    def _mismatch(self) -> str | None:
        code = LinkEventCode.VERSION_MISMATCH
        return next((e.message for e in self._events if e.code is code), None)

    def _silence(self) -> LinkError:
        """Nobody has answered: what the line tells about why."""
        seen = self._link.statistics
        if self._bytes == 0:
            return LinkError(
                "The port is open and silent: nothing is connected there, the board has no power, "
                "or it holds no firmware of ours.",
                remedy="See docs/hardware.md.",
                code="link_silent",
            )
        if seen.received == 0:
            return LinkError(
                f"What is connected there sends {self._bytes} bytes that are no packets: another "
                "device, or another baud rate.",
                remedy="link.baud_rate is 250000 for Arduino boards, 115200 for the PIC.",
                code="link_foreign",
            )
        return LinkError(
            "The board talks and does not answer HELLO: its receiving wire (RX) is not connected, "
            "or another program talks to it too.",
            code="link_deaf",
        )
