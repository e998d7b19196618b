"""Everything that the routes use, built once and opened and closed in order."""

from __future__ import annotations

import asyncio
import fcntl
import json
import os
from collections.abc import Callable
from importlib.resources import files
from pathlib import Path
from typing import IO, TYPE_CHECKING, Any, Literal

import httpx
import structlog

from polepilot.core.errors import InputError, PolepilotError
from polepilot.core.robot.ports import Clock
from polepilot.core.vehicle import RobotModel
from polepilot.server.convert import Job, plan_of
from polepilot.server.errors import BusyError
from polepilot.server.metrics import Metrics
from polepilot.server.missions import Missions
from polepilot.server.panel_feed import PanelFeed, PanelPort
from polepilot.server.pictures import Pictures
from polepilot.server.planner import Planner
from polepilot.server.precision import Precision
from polepilot.server.runner import Published, RobotPort, Runner, Twin
from polepilot.server.store import Store
from polepilot.server.stream import Hub

if TYPE_CHECKING:
    from polepilot.core.plan import Plan

Board = Literal["simulated", "host", "serial"]
TICK_RATE = 50.0
"""Ticks of the robot per second."""
_PANEL_TIMEOUT = 10.0

log = structlog.get_logger("polepilot.server")


def demo_site() -> dict[str, Any]:
    """The SITE.json that a first start begins with."""
    text = files("polepilot").joinpath("demo/workshop.json").read_text("utf-8")
    document: dict[str, Any] = json.loads(text)
    return document


class DataFolder:
    """The folder with database and logs, used by one service at a time."""

    def __init__(self, path: Path) -> None:
        """Make the folder and claim it.

        Raises:
            InputError: it cannot be written, or another service uses it.
        """
        self.path = path
        try:
            (path / "runs").mkdir(parents=True, exist_ok=True)
            self._lock: IO[str] = (path / "lock").open("w")
        except OSError as error:
            raise InputError(
                f"{path}: cannot be used as the data folder ({error.strerror}).",
                remedy="Give another one with --data.",
            ) from None
        try:
            fcntl.flock(self._lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError:
            self._lock.close()
            raise InputError(
                f"{path}: another Polepilot uses this data folder.",
                remedy="Stop it, or give another folder with --data.",
            ) from None
        # For people who look which process it is; the lock itself is the kernel's.
        self._lock.write(f"{os.getpid()}\n")
        self._lock.flush()

    def log_path(self, run_id: int) -> Path:
        """Where the MCAP file of a run is."""
        return self.path / "runs" / str(run_id) / "run.mcap"

    def release(self) -> None:
        """Let others use it. Releasing twice does nothing."""
        self._lock.close()


class Services:
    """What one running service consists of."""

    def __init__(
        self,
        *,
        robot: RobotPort,
        twin: Twin | None,
        clock: Clock,
        model: RobotModel,
        board: Board,
        folder: DataFolder,
        store: Store,
        panel: PanelPort | None = None,
        host: str = "127.0.0.1",
        port: int = 8000,
        tick_rate: float = TICK_RATE,
    ) -> None:
        """``port`` may be changed until the service listens; ``panel`` None: there is none."""
        self.name = "Polepilot"
        self.board = board
        self.model = model
        self.twin = twin
        self.host = host
        self.port = port
        self.store = store
        self.hub = Hub()
        self.pictures = Pictures()
        self.runner = Runner(robot, clock, tick_rate, twin)
        self.planner = Planner(model.vehicle)
        self.precision = Precision(model)
        self.missions = Missions(store, self.runner, self.planner, twin, folder.log_path)
        self.metrics = Metrics(self.runner, self.hub)
        self.panel_client = httpx.AsyncClient(timeout=_PANEL_TIMEOUT, trust_env=False)
        self.on_failed: Callable[[], None] = lambda: None
        """Called in the event loop when the robot's thread has given up."""
        self._folder = folder
        self._robot = robot
        self._feed = (
            None
            if panel is None
            else PanelFeed(panel, self.runner, lambda: self.missions.site, self._plan_of)
        )
        self._tasks: set[asyncio.Task[None]] = set()
        self._open = False

    @property
    def panel_port(self) -> int | None:
        """Where the 3D panel listens on this machine; None while it does not."""
        return None if self._feed is None else self._feed.port

    @property
    def failed(self) -> bool:
        """The robot's thread has given up."""
        return self.runner.failed

    def log_path(self, run_id: int) -> Path:
        """Where the MCAP file of a run is."""
        return self._folder.log_path(run_id)

    def snapshot_bytes(self) -> bytes:
        """The newest snapshot's document.

        Raises:
            BusyError: there is none yet.
        """
        published = self.runner.latest
        if published is None:
            raise BusyError("The robot has not started yet.", code="robot_not_answering")
        return self.hub.text_of(published).encode()

    async def open(self) -> None:
        """Start everything; returns when the robot ticks."""
        self._open = True
        loop = asyncio.get_running_loop()

        def publish(published: Published) -> None:
            _call_in(loop, self.hub.publish, published)

        self.runner.on_published = publish
        self.runner.on_failed = lambda: _call_in(loop, self.on_failed)
        self._robot.on_run_ended = self.missions.run_ended
        await asyncio.to_thread(self.missions.begin, demo_site())
        await asyncio.to_thread(self.runner.start)
        try:
            await self.missions.load_last_site()
        except PolepilotError as error:
            # Without a site the robot stands idle, and people can still mend the drawing.
            log.error("the last site was not loaded", error=str(error))
        self._spawn(self._warm_up())

    async def close(self) -> None:
        """Wheels first, then everything else. Closing twice does nothing."""
        if not self._open:
            return
        self._open = False
        await self.stop_robot()
        for task in list(self._tasks):
            task.cancel()
        await asyncio.gather(*self._tasks, return_exceptions=True)
        await self.stop_planning()
        await self.panel_client.aclose()
        if self._feed is not None:
            await asyncio.to_thread(self._feed.stop)
        await asyncio.to_thread(self.missions.close)
        self.store.close()
        self._folder.release()

    async def stop_robot(self) -> None:
        """Wheels still, logs closed, the robot's thread ended."""
        if not await asyncio.to_thread(self.runner.stop):
            log.error("the robot's thread did not end")

    async def stop_planning(self) -> None:
        """Answer everybody who waits for a plan or a precision map that there will be none."""
        await self.planner.close()
        await self.precision.close()

    async def _warm_up(self) -> None:
        """What nobody should have to wait for, and what the start should not wait for."""
        if self._feed is not None:
            try:
                await asyncio.to_thread(self._feed.start)
            except (OSError, RuntimeError) as error:
                log.error("the 3D panel did not start", error=str(error))
        await self.planner.warm_up()

    def _spawn(self, work: Any) -> None:
        task: asyncio.Task[None] = asyncio.create_task(work)
        self._tasks.add(task)
        task.add_done_callback(self._tasks.discard)

    def _plan_of(self, job: Job) -> Plan:
        return plan_of(self.store.plan(job.plan_id))


def _call_in(loop: asyncio.AbstractEventLoop, function: Callable[..., None], *args: Any) -> None:
    """``call_soon_threadsafe`` that does not mind a loop that has ended meanwhile."""
    try:
        loop.call_soon_threadsafe(function, *args)
    except RuntimeError:
        if not loop.is_closed():
            raise
