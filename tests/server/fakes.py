"""A robot that knows its place and drives a plan along its path, without sensors or physics."""

from __future__ import annotations

import threading
import time
import warnings
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import TYPE_CHECKING, Any

import numpy as np
from shapely import MultiPolygon

from polepilot.core.errors import RefusedError
from polepilot.core.geometry import Pose2D
from polepilot.core.observation import Detection, Frame, PoseEstimate, Status
from polepilot.core.plan import Plan
from polepilot.core.robot.ports import Sighting
from polepilot.core.robot.recorder import Recorder
from polepilot.core.robot.snapshot import (
    Event,
    LinkStatus,
    Measured,
    MissionStatus,
    Snapshot,
    State,
)
from polepilot.core.site import Site
from polepilot.core.vehicle import RobotModel
from polepilot.server.clock import MonotonicClock
from polepilot.server.services import DataFolder, Services
from polepilot.server.store import Store

if TYPE_CHECKING:
    from polepilot.core.robot.mission import RunSummary

with warnings.catch_warnings():
    # It works with httpx as well as with that library's successor, which it would rather have.
    warnings.simplefilter("ignore")
    from starlette.testclient import TestClient as TestClient

SQUARE: dict[str, Any] = {
    "name": "Square",
    "boundary": [[0, 0], [6, 0], [6, 5], [0, 5]],
    "landmarks": [{"id": 1, "x": 0, "y": 1}, {"id": 2, "x": 6, "y": 4}],
    "routes": [{"name": "Line", "nodes": [[2, 1], [4, 1]]}],
    "start": [1, 1, 0],
}


class FakeRobot:
    """Follows the runner's protocol; ``calls`` is what it was told, in order."""

    def __init__(self) -> None:
        self.on_run_ended: Callable[[RunSummary], None] | None = None
        self.sighting: Sighting | None = None
        self.calls: list[str] = []
        self.threads: set[int] = set()
        self.pose = Pose2D(1.0, 1.0, 0.0)
        self.state = State.IDLE
        self.reason = ""
        self.fail_with: Exception | None = None
        self.step_takes = 0.0
        self.ended_at: float | None = None
        self.missed = MultiPolygon()
        self._run: tuple[int, Plan, Recorder, float] | None = None
        self._seq = 0
        self._now = 0.0
        self._stopped = False
        self._event = Event(1, 0.0, "hello", "info", "Grüße vom Roboter")

    def see(self, image: np.ndarray[Any, Any] | None) -> None:
        frame = None if image is None else Frame(self._now, image)
        detection = Detection(7, 3.0, 0.1, 200.0, 90.0, 220.0, 0.01, 0.001)
        self.sighting = Sighting(self._now, (detection,), frame)

    def step(self, now: float) -> Snapshot:
        self.threads.add(threading.get_ident())
        self._now = now
        self._seq += 1
        if self.step_takes:
            time.sleep(self.step_takes)
        if self.fail_with is not None:
            raise self.fail_with
        estimate = PoseEstimate(now, self.pose, np.diag([1e-4, 4e-4, 1e-4]), Status.TRACKING)
        mission = None
        if self._run is not None:
            run_id, plan, _, began = self._run
            mission = MissionStatus(
                run_id=run_id,
                mode=plan.mode,
                progress=0.5,
                travelled=1.0,
                length=plan.predicted.length,
                coverage=None if plan.mode == "route" else 0.5,
                swept_area=None,
                missed_area=None,
                elapsed=now - began,
                eta=None,
            )
        snapshot = Snapshot(
            seq=self._seq,
            stamp=now,
            state=State.STOPPED if self._stopped else self.state,
            reason=self.reason,
            estimate=None if self.state is State.IDLE else estimate,
            measured=Measured(now, self.pose),
            target=(2.0, 1.0) if mission is not None else None,
            proximity=(None, 1.2, None),
            link=LinkStatus(state="armed", age=0.01),
            mission=mission,
            events=(self._event,),
        )
        if self._run is not None:
            self._run[2].snapshot(snapshot)
            self.pose = replace_x(self.pose, 0.01)
        return snapshot

    def load_site(self, site: Site) -> None:
        self.calls.append(f"load_site {site.name}")
        self.state = State.READY

    def start(self, plan: Plan, run_id: int, recorder: Recorder) -> None:
        self.calls.append(f"start {run_id}")
        if self._stopped:
            raise RefusedError("The stop is latched.", code="estop_latched", remedy="Release it.")
        recorder.begin(self._now, Site(boundary=((0, 0), (1, 0), (1, 1))), plan)
        recorder.event(replace(self._event, stamp=self._now, code="mission_started"))
        self._run = (run_id, plan, recorder, self._now)
        self.state = State.RUNNING

    def pause(self) -> None:
        self._need("pause")
        self.state = State.PAUSED

    def resume(self) -> None:
        self._need("resume")
        self.state = State.RUNNING

    def end(self, outcome: str = "paused") -> None:
        self._need("end")
        assert self._run is not None
        run_id, plan, recorder, began = self._run
        recorder.close()
        self._run = None
        self.state = State.READY
        assert self.on_run_ended is not None
        self.on_run_ended(
            SimpleNamespace(  # type: ignore[arg-type]
                run_id=run_id,
                mode=plan.mode,
                outcome=outcome,
                reason="Ended by hand.",
                coverage=0.5 if plan.mode == "scan" else None,
                travelled=1.25,
                duration=self._now - began,
                missed=self.missed,
            )
        )

    def stop(self, reason: str) -> None:
        self.calls.append("stop")
        self._stopped = True
        self.reason = reason

    def clear(self) -> None:
        self.calls.append("clear")
        self._stopped = False
        self.reason = ""

    def shutdown(self, now: float) -> None:
        self.calls.append("shutdown")
        self.ended_at = now
        if self._run is not None:
            self.end()

    def _need(self, call: str) -> None:
        self.calls.append(call)
        if self._run is None:
            raise RefusedError("Nothing is under way.", code="no_mission")


def replace_x(pose: Pose2D, by: float) -> Pose2D:
    return pose._replace(x=pose.x + by)


class FakeTwin:
    """A world that stays as it is put."""

    def __init__(self, robot: FakeRobot) -> None:
        self._robot = robot
        self.obstacles: tuple[tuple[float, float, float], ...] = ()
        self.sites: list[tuple[str, bool]] = []

    @property
    def truth(self) -> Pose2D:
        return self._robot.pose

    def set_obstacles(self, discs: Sequence[tuple[float, float, float]]) -> None:
        self.obstacles = tuple(discs)

    def place(self, pose: Pose2D) -> None:
        self._robot.pose = pose

    def set_site(self, site: Site, *, another: bool) -> None:
        self.sites.append((site.name, another))


def fake_services(data: Path, *, simulated: bool = True, **options: Any) -> Services:
    """Services around a fake robot, which is their attribute ``robot``."""
    folder = DataFolder(data)
    robot = FakeRobot()
    twin = FakeTwin(robot) if simulated else None
    services = Services(
        robot=robot,
        twin=twin,
        clock=MonotonicClock(),
        model=RobotModel(),
        board="simulated" if simulated else "serial",
        folder=folder,
        store=Store(folder.path / "polepilot.db"),
        **options,
    )
    services.robot = robot  # type: ignore[attr-defined]
    return services


def plan_document(mode: str = "route", x: float = 1.0) -> dict[str, Any]:
    """What is kept of a short plan; of mode scan it is to sweep a strip of 2 x 0.4 m."""
    area = [[[[x, 0.8], [x + 2, 0.8], [x + 2, 1.2], [x, 1.2]]]] if mode == "scan" else []
    return {
        "tool_width": 0.4,
        "clearance": 0.2,
        "min_turn_radius": 0.36,
        "area": area,
        "path": [[x, 1.0], [x + 1, 1.0], [x + 2, 1.0]],
        "gear": [1, 1],
        "parts": [{"kind": "loop" if mode == "scan" else "route", "first": 0, "last": 2}],
        "unreachable": [],
        "predicted": {"coverage": 1.0, "length": 2.0, "duration": 6.0, "reversals": 0},
        "nodes": [[x + 2, 1.0]] if mode == "route" else [],
        "notes": [],
        "runtime": 0.01,
    }
