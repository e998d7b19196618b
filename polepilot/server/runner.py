"""The robot's own thread: ticks at a fixed rate, takes commands between ticks, publishes.

Commands are never dropped: each is executed in order (an urgent one first) or its future says why
not. Snapshots are: only the newest one is kept, and nobody who reads them can hold up a tick.
"""

from __future__ import annotations

import asyncio
import threading
import time
from collections import deque
from collections.abc import Callable, Sequence
from concurrent.futures import Future
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Protocol, TypeVar

import structlog

from polepilot.core.geometry import Pose2D
from polepilot.core.plan import Plan
from polepilot.core.robot.ports import Clock, Sighting
from polepilot.core.robot.snapshot import Snapshot
from polepilot.core.site import Site
from polepilot.server.convert import Job, Loop, Surroundings
from polepilot.server.errors import BusyError

if TYPE_CHECKING:
    from polepilot.core.robot.mission import RunSummary
    from polepilot.core.robot.recorder import Recorder

T = TypeVar("T")
PUBLISH_PERIOD = 0.05
"""Snapshots reach the screens no more often than this, seconds."""
COMMAND_TIMEOUT = 5.0
"""A command that the robot has not taken after this many seconds is withdrawn."""
MOST_FAILURES = 10
"""After this many failed ticks in a row the thread gives up."""
_WINDOW = 1000
"""Ticks over which the loop's figures are taken."""

log = structlog.get_logger("polepilot.runner")


class RobotPort(Protocol):
    """What the runner needs of the robot; all of it is called from the runner's thread only."""

    on_run_ended: Callable[[RunSummary], None] | None

    @property
    def sighting(self) -> Sighting | None:
        """The newest sighting, with its picture where there is one."""
        ...

    def step(self, now: float) -> Snapshot: ...
    def load_site(self, site: Site) -> None: ...
    def start(self, plan: Plan, run_id: int, recorder: Recorder) -> None: ...
    def pause(self) -> None: ...
    def resume(self) -> None: ...
    def end(self) -> None: ...
    def stop(self, reason: str) -> None: ...
    def clear(self) -> None: ...
    def shutdown(self, now: float) -> None: ...


class Twin(Protocol):
    """The simulated world; there is none on hardware. Time is what the robot's clock makes of it.
    All of it is called from the runner's thread only."""

    @property
    def truth(self) -> Pose2D:
        """Where the robot really is."""
        ...

    @property
    def obstacles(self) -> tuple[tuple[float, float, float], ...]:
        """Discs in the way: x, y, radius."""
        ...

    def set_obstacles(self, discs: Sequence[tuple[float, float, float]]) -> None: ...
    def place(self, pose: Pose2D) -> None: ...
    def set_site(self, site: Site, *, another: bool) -> None:
        """Change walls and poles. On ``another`` site the robot is carried to the start."""
        ...


@dataclass(frozen=True, slots=True)
class Published:
    """A snapshot with what the server knows around it."""

    snapshot: Snapshot
    around: Surroundings


class _LoopMeter:
    """Rate, lateness and busy share over the last ticks, by the wall clock: a simulated one
    moves in steps. A tick is late by what it begins later than a period after the one before."""

    def __init__(self, period: float) -> None:
        self._period = period
        self._starts: deque[float] = deque(maxlen=_WINDOW)
        self._late: deque[float] = deque(maxlen=_WINDOW)
        self._worked: deque[float] = deque(maxlen=_WINDOW)
        self._next = 0.0
        self.loop = Loop()

    def add(self, start: float, worked: float) -> None:
        if self._starts:
            self._late.append(max(0.0, start - self._starts[-1] - self._period))
        self._starts.append(start)
        self._worked.append(worked)
        if start >= self._next and len(self._starts) > 1:
            self._next = start + 0.5
            span = self._starts[-1] - self._starts[0]
            ticks = len(self._starts) - 1
            late_ones = sorted(self._late)
            self.loop = Loop(
                rate=ticks / span if span > 0 else 0.0,
                lateness_p99=late_ones[min(len(late_ones) - 1, int(0.99 * len(late_ones)))],
                busy=min(1.0, sum(self._worked) / (span + worked)) if span > 0 else 0.0,
            )


class Runner:
    """Owns the robot (and the simulated world around it) while it runs."""

    def __init__(
        self, robot: RobotPort, clock: Clock, rate: float, twin: Twin | None = None
    ) -> None:
        """``rate``: ticks per second."""
        self._robot = robot
        self._clock = clock
        self._period = 1.0 / rate
        self._twin = twin
        self._commands: deque[tuple[Callable[[RobotPort], Any], Future[Any]]] = deque()
        self._lock = threading.Lock()
        self._closed = False
        self._stopping = threading.Event()
        self._stepped = threading.Event()
        self._thread = threading.Thread(target=self._run, name="robot", daemon=True)
        self._meter = _LoopMeter(self._period)
        self._last_published = -1.0
        self.latest: Published | None = None
        self.sighting: Sighting | None = None
        self.failed = False
        self.ticks = 0
        self.failures = 0
        self.site_id: int | None = None
        """The site that the robot works on; written by commands only."""
        self.job: Job | None = None
        """The mission that it is on; written by commands only."""
        self.on_published: Callable[[Published], None] = lambda _: None
        """Called from the robot's thread; must return at once."""
        self.on_failed: Callable[[], None] = lambda: None
        """Called from the robot's thread when it gives up."""

    @property
    def clock(self) -> Clock:
        return self._clock

    def start(self) -> None:
        """Begin to tick; returns after the first tick or the thread's end."""
        self._thread.start()
        self._stepped.wait(10.0)

    def stop(self, timeout: float = 2.0) -> bool:
        """Stand still, say goodbye to the board, end the thread. False if it did not end."""
        self._stopping.set()
        if self._thread.is_alive():
            self._thread.join(timeout)
        return not self._thread.is_alive()

    def submit(self, command: Callable[[RobotPort], T], *, urgent: bool = False) -> Future[T]:
        """Have ``command`` executed between two ticks. Its future is done after the next tick, so
        that ``latest`` shows the effect by then."""
        future: Future[T] = Future()
        with self._lock:
            if self._closed or not self._thread.is_alive():
                future.set_exception(_not_answering())
            elif urgent:
                self._commands.appendleft((command, future))
            else:
                self._commands.append((command, future))
        return future

    async def call(self, command: Callable[[RobotPort], T], *, urgent: bool = False) -> T:
        """``submit`` for asyncio. An urgent command is carried out even if its asker leaves.

        Raises:
            BusyError: the robot's thread does not answer; the command will not be executed.
        """
        waiting: asyncio.Future[T] = asyncio.wrap_future(self.submit(command, urgent=urgent))
        try:
            return await asyncio.wait_for(
                asyncio.shield(waiting) if urgent else waiting, COMMAND_TIMEOUT
            )
        except TimeoutError:
            raise _not_answering() from None

    def _run(self) -> None:
        failures = 0
        due = self._clock.now()
        try:
            while not self._stopping.is_set() and failures < MOST_FAILURES:
                self._clock.wait_until(due)
                now = self._clock.now()
                began = time.perf_counter()
                failures = 0 if self._tick(now) else failures + 1
                self._meter.add(began, time.perf_counter() - began)
                # A machine that was asleep for a while does not make up for lost ticks.
                due = due + self._period if now - due < 5 * self._period else now + self._period
        finally:
            self._end(failed=failures >= MOST_FAILURES or not self._stopping.is_set())

    def _tick(self, now: float) -> bool:
        done = self._execute()
        try:
            snapshot = self._robot.step(now)
            self.sighting = self._robot.sighting
            self._publish(snapshot, now, at_once=bool(done))
        except Exception as error:
            log.error("the robot's tick failed", error=str(error), exc_info=error)
            self.failures += 1
            self._stop_wheels(error)
            return False
        finally:
            for future, result in done:
                future.set_result(result)
            self.ticks += 1
            self._stepped.set()
        return True

    def _execute(self) -> list[tuple[Future[Any], Any]]:
        done: list[tuple[Future[Any], Any]] = []
        with self._lock:
            commands = list(self._commands)
            self._commands.clear()
        for command, future in commands:
            if not future.set_running_or_notify_cancel():
                continue
            try:
                done.append((future, command(self._robot)))
            except Exception as error:  # noqa: BLE001 - goes to whoever asked
                future.set_exception(error)
        return done

    def _publish(self, snapshot: Snapshot, now: float, *, at_once: bool) -> None:
        due = now - self._last_published >= PUBLISH_PERIOD - self._period / 2
        if not (due or at_once or self.latest is None):
            return
        twin = self._twin
        around = Surroundings(
            wall=time.time(),
            loop=self._meter.loop,
            real=None if twin is None else twin.truth,
            obstacles=() if twin is None else twin.obstacles,
            site_id=self.site_id,
            job=self.job,
        )
        self.latest = Published(snapshot, around)
        if due:
            self._last_published = now
            self.on_published(self.latest)

    def _stop_wheels(self, error: Exception) -> None:
        try:
            self._robot.stop(f"internal fault: {error}")
        except Exception as second:
            log.error("the robot does not stop", error=str(second), exc_info=second)

    def _end(self, *, failed: bool) -> None:
        try:
            self._robot.shutdown(self._clock.now())
        except Exception as error:
            log.error("the robot did not shut down", error=str(error), exc_info=error)
            failed = True
        with self._lock:
            self._closed = True
            commands = list(self._commands)
            self._commands.clear()
        for _, future in commands:
            if future.set_running_or_notify_cancel():
                future.set_exception(_not_answering())
        self._stepped.set()
        if failed:
            self.failed = True
            self.on_failed()


def _not_answering() -> BusyError:
    return BusyError(
        "The robot's thread does not answer.",
        code="robot_not_answering",
        remedy="Look at the service's log, and start it again.",
    )
