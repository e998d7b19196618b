"""A whole run on the simulated robot, as fast as the machine can: the `simulate` command's engine.

The robot is the same program that drives hardware; only its ports belong to a simulated world.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from polepilot.core.geometry import Point, Pose2D
from polepilot.core.observation import Status
from polepilot.core.plan import Plan
from polepilot.core.robot.eye import Eye
from polepilot.core.robot.mission import RunSummary
from polepilot.core.robot.ports import SensorPort
from polepilot.core.robot.recorder import Recorder
from polepilot.core.robot.robot import Robot, RobotSettings
from polepilot.core.robot.snapshot import MissionStatus, Snapshot, State
from polepilot.core.sim.motion import Disturbances
from polepilot.core.sim.world import World
from polepilot.core.site import Site, Start
from polepilot.core.trajectory import (
    ErrorStatistics,
    Trajectory,
    heading_errors,
    position_errors,
    write_tum,
)
from polepilot.core.vision.detector import LandmarkDetector

TICK = 0.02
"""Seconds between two steps of the robot."""
GIVE_UP_PAUSED = 5.0
"""A paused robot waits for a person; here there is none."""
GIVE_UP_LOST = 60.0
FILES = ("real.tum", "estimated.tum", "measured.tum", "target.csv", "run.mcap")
"""What a run leaves in its folder."""


@dataclass(slots=True)
class Tracks:
    """What is compared after a run: stamps and poses, one list per kind of point."""

    stamps: list[float] = field(default_factory=list)
    real: list[Pose2D] = field(default_factory=list)
    estimated_stamps: list[float] = field(default_factory=list)
    estimated: list[Pose2D] = field(default_factory=list)
    measured_stamps: list[float] = field(default_factory=list)
    measured: list[Pose2D] = field(default_factory=list)
    targets: list[tuple[float, Point]] = field(default_factory=list)

    def add(self, snapshot: Snapshot, truth: Pose2D) -> None:
        """One tick."""
        self.stamps.append(snapshot.stamp)
        self.real.append(truth)
        estimate = snapshot.estimate
        if estimate is not None and estimate.status in (Status.TRACKING, Status.DEGRADED):
            self.estimated_stamps.append(snapshot.stamp)
            self.estimated.append(estimate.pose)
        measured = snapshot.measured
        if measured is not None and (
            not self.measured_stamps or measured.stamp > self.measured_stamps[-1]
        ):
            self.measured_stamps.append(measured.stamp)
            self.measured.append(measured.pose)
        if snapshot.target is not None:
            self.targets.append((snapshot.stamp, snapshot.target))

    def write(self, folder: Path) -> None:
        """The files that the contract names."""
        write_tum(folder / "real.tum", self.stamps, self.real)
        write_tum(folder / "estimated.tum", self.estimated_stamps, self.estimated)
        write_tum(folder / "measured.tum", self.measured_stamps, self.measured)
        lines = [f"{t:.3f},{x:.4f},{y:.4f}" for t, (x, y) in self.targets]
        (folder / "target.csv").write_text("\n".join(["t,x,y", *lines]) + "\n", "ascii")

    def trajectory(self, stamps: list[float], poses: list[Pose2D]) -> Trajectory:
        return Trajectory(np.array(stamps), np.array(poses, dtype=float).reshape(-1, 3))


@dataclass(frozen=True, slots=True)
class SimulationResult:
    """How a simulated run went; metres, radians, seconds."""

    outcome: str
    reason: str
    position_error: ErrorStatistics
    heading_error: ErrorStatistics
    measured_error: ErrorStatistics
    coverage: float
    contacts: int
    simulated_s: float
    wall_s: float

    def to_json(self) -> dict[str, Any]:
        return {
            "outcome": self.outcome,
            "reason": self.reason,
            "position_error": self.position_error.to_json(),
            "heading_error": self.heading_error.to_json(),
            "measured_error": self.measured_error.to_json(),
            "coverage": self.coverage,
            "contacts": self.contacts,
            "simulated_s": self.simulated_s,
            "wall_s": self.wall_s,
        }


class Simulation:
    """One robot, one world, one plan. ``step`` it, or ``run`` it to its end."""

    def __init__(
        self, site: Site, plan: Plan, world: World, robot: Robot, recorder: Recorder
    ) -> None:
        self.world = world
        self.robot = robot
        self.tracks = Tracks()
        self.summary: RunSummary | None = None
        self.now = 0.0
        self._plan = plan
        self._recorder = recorder
        self._started = False
        self._idle_since: float | None = None
        self._last: MissionStatus | None = None
        robot.on_run_ended = self._ended
        robot.load_site(site)

    @classmethod
    def build(
        cls,
        site: Site,
        plan: Plan,
        settings: RobotSettings,
        *,
        seed: int,
        rendered: bool,
        log: Path,
        start: Start | None = None,
        disturbances: Disturbances | None = None,
    ) -> Simulation:
        """A fresh world with the robot at the start of its plan, looking as ``start`` says.

        ``disturbances`` None draws one robot of a series from the seed.
        """
        world = World(
            site,
            settings.model,
            seed=seed,
            start=_start_pose(plan, start),
            disturbances=disturbances,
            full_speed=settings.calibration.full_speed_left,
        )
        lens = settings.model.camera
        sensor: SensorPort = world.sensor
        if rendered:
            sensor = Eye(world.camera, lambda kinds: LandmarkDetector(lens, kinds))
        robot = Robot(settings, sensor, world.link)
        recorder = Recorder(log, witness=lambda: world.truth, patient=True)
        return cls(site, plan, world, robot, recorder)

    @property
    def log_error(self) -> Exception | None:
        """Why the log is incomplete, where it is."""
        return self._recorder.error

    def step(self) -> Snapshot:
        """Advance world and robot by one tick."""
        self.now += TICK
        self.world.advance(self.now)
        snapshot = self.robot.step(self.now)
        self._last = snapshot.mission or self._last
        self.tracks.add(snapshot, self.world.truth)
        if not self._started and snapshot.state is State.READY:
            self.robot.start(self._plan, 1, self._recorder)
            self._started = True
        return snapshot

    def run(
        self, duration: float, progress: Callable[[Snapshot], None] = lambda _: None
    ) -> SimulationResult:
        """Step until the mission is over, hopeless, or ``duration`` simulated seconds are."""
        began = time.monotonic()
        outcome, reason = "timeout", f"Not done after {duration:.0f} s."
        while self.now < duration:
            snapshot = self.step()
            progress(snapshot)
            if self.summary is not None:
                outcome, reason = self.summary.outcome, self.summary.reason
                break
            if stuck := self._hopeless(snapshot):
                outcome, reason = stuck
                break
        return self._result(outcome, reason, time.monotonic() - began)

    def _hopeless(self, snapshot: Snapshot) -> tuple[str, str] | None:
        """Nobody is here to help a robot that waits for a person."""
        limits = {
            State.PAUSED: GIVE_UP_PAUSED,
            State.STOPPED: GIVE_UP_PAUSED,
            State.LOST: GIVE_UP_LOST,
            State.FIXING: GIVE_UP_LOST,
        }
        if snapshot.state not in limits:
            self._idle_since = None
            return None
        if self._idle_since is None:
            self._idle_since = self.now
        if self.now - self._idle_since < limits[snapshot.state]:
            return None
        waiting = snapshot.state in (State.PAUSED, State.STOPPED)
        return ("paused" if waiting else "failed", snapshot.reason)

    def _ended(self, summary: RunSummary) -> None:
        self.summary = summary

    def _result(self, outcome: str, reason: str, wall: float) -> SimulationResult:
        mission = self.robot.mission
        if mission is not None:
            self._last = mission.status(self.now)
        self.robot.shutdown(self.now)
        if not self._started:
            self._recorder.close()
        coverage = 0.0
        if self.summary is not None and self.summary.coverage is not None:
            coverage = self.summary.coverage
        elif self._last is not None:
            # A route sweeps no area: its share that was driven stands in.
            done = self.summary is not None and self.summary.outcome == "done"
            coverage = 1.0 if done else self._last.progress
        tracks = self.tracks
        real = tracks.trajectory(tracks.stamps, tracks.real)
        estimated = tracks.trajectory(tracks.estimated_stamps, tracks.estimated)
        measured = tracks.trajectory(tracks.measured_stamps, tracks.measured)
        return SimulationResult(
            outcome=outcome,
            reason=reason,
            position_error=position_errors(real, estimated),
            heading_error=heading_errors(real, estimated),
            measured_error=position_errors(real, measured),
            coverage=coverage,
            contacts=self.world.contacts,
            simulated_s=round(self.now, 3),
            wall_s=round(wall, 3),
        )


def _start_pose(plan: Plan, start: Start | None) -> Pose2D:
    """At the plan's first point; looking as ``start`` says, else along the first segment."""
    (x0, y0), (x1, y1) = plan.path[0], plan.path[1]
    if start is not None and start.heading is not None:
        return Pose2D(float(x0), float(y0), start.heading)
    heading = np.arctan2((y1 - y0) * plan.gear[0], (x1 - x0) * plan.gear[0])
    return Pose2D(float(x0), float(y0), float(heading))
