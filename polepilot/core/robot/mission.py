"""A plan being executed: where to drive next, what has been swept, how far it has got."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any, Literal

from shapely import MultiPolygon
from shapely.geometry import mapping

from polepilot.core.command import STAND, DriveCommand
from polepilot.core.control.avoidance import BACK_OFF_AFTER, ObstacleAvoidance
from polepilot.core.control.tracker import PathTracker
from polepilot.core.geometry import Point, Pose2D
from polepilot.core.observation import PoseEstimate
from polepilot.core.plan import Mode, Plan
from polepilot.core.planning.swept import SweptArea
from polepilot.core.robot.curves import curves_of
from polepilot.core.robot.recorder import Recorder
from polepilot.core.robot.snapshot import MissionStatus
from polepilot.core.scenery import Scenery
from polepilot.core.site import Site
from polepilot.core.vehicle import RobotModel

Outcome = Literal["done", "paused", "failed", "timeout"]

CERTAINTY = 2.0
"""So many standard deviations of the position have to fit between body and wall."""
LEAST_GAP = 0.02
"""Where a plan comes nearer to walls than this, it is the plan's business; metres."""
LOOK_TIME = 15.0
"""Seconds: two sweeps of the camera. Standing longer shows nothing new."""
SWEEP_STEP = 0.02
"""The swept area grows by strokes of at least this length, metres."""
GAP = 0.3
"""Seconds without driving after which the robot begins again from standing."""
HELD_PATIENCE = 0.6
"""So long the board may hold the robot before a wall until that counts, seconds."""
HELD_GAP = 0.5
"""A range at the limit comes and goes; so long after the last time it still counts, seconds."""
HELD_REST = 0.08
"""Metres that the board may cut off the end of a stretch: it keeps more room ahead of the body
than a plan has to."""
JUMP = 0.5
"""A pose that moves farther than this between two ticks was corrected, not driven; metres."""


@dataclass(frozen=True, slots=True, eq=False)
class RunSummary:
    """How a run ended. Areas in `map`; ``missed`` is what a next plan has to sweep."""

    run_id: int
    mode: Mode
    outcome: Outcome
    reason: str
    coverage: float | None
    travelled: float
    duration: float
    missed: MultiPolygon

    def to_json(self) -> dict[str, Any]:
        """The ``result`` message of the log."""
        return {
            "outcome": self.outcome,
            "reason": self.reason,
            "coverage": self.coverage,
            "travelled": self.travelled,
            "duration": self.duration,
            "missed": mapping(self.missed)["coordinates"],
        }


@dataclass(frozen=True, slots=True)
class Step:
    """What the mission wants in this tick, and why it stands if it does."""

    command: DriveCommand
    target: Point | None
    hold: str = ""


class Mission:
    """One run of one plan. Time comes in as ``now``; only ticks that drive count as progress."""

    def __init__(
        self, run_id: int, plan: Plan, site: Site, model: RobotModel, recorder: Recorder, now: float
    ) -> None:
        self.run_id = run_id
        self.plan = plan
        self.site = site
        self.recorder = recorder
        self._started = now
        self._scenery = Scenery(site.segments())
        self._body_radius = model.vehicle.body_radius
        self._blind_since: float | None = None
        self._tracker = PathTracker(plan, model.vehicle)
        self._avoidance = ObstacleAvoidance(
            model.proximity, model.vehicle, site, curves_of(model.vehicle)
        )
        self._swept = None if plan.area.is_empty else SweptArea(plan.area, plan.tool_width)
        self._stroke_from: Point | None = None
        self._last: Pose2D | None = None
        self._driven_at = now
        self._held_since: float | None = None
        self._held_at = -math.inf
        self._travelled = 0.0

    @property
    def done(self) -> bool:
        """The whole path has been driven."""
        return self._tracker.done

    @property
    def off_route(self) -> bool:
        """Too far from the path to drive back to it unasked."""
        return self._tracker.off_route

    @property
    def off_route_reason(self) -> str:
        """Why, for a person."""
        return self._tracker.off_route_reason

    @property
    def target(self) -> Point:
        """The point being aimed at."""
        return self._tracker.target

    def drive(
        self,
        now: float,
        dt: float,
        estimate: PoseEstimate,
        proximity: tuple[float | None, float | None, float | None],
        held: bool = False,
    ) -> Step:
        """The command that follows the plan from ``estimate``, round obstacles.

        Args:
            held: the board lets no wheel turn forward, because something is too close ahead.
        """
        if now - self._driven_at > GAP:
            self.take_up()
        self._driven_at = now
        if hold := self._too_blind(now, estimate):
            return Step(STAND, self._tracker.target, hold)
        command = self._avoidance.update(now, dt, estimate, proximity, self._tracker)
        target = self._avoidance.target or self._tracker.target
        if hold := self._too_close(now, estimate.pose, command, held):
            return Step(STAND, target, hold)
        return Step(command, target, self._avoidance.reason)

    def take_up(self) -> None:
        """It goes on after standing for a while: nothing that was waited for counts any more."""
        self._blind_since = self._held_since = None
        self._tracker.take_up()
        self._avoidance.take_up()

    def _too_close(self, now: float, pose: Pose2D, command: DriveCommand, held: bool) -> str:
        """Why it waits for the board, which holds it; at the end of a stretch it does not."""
        if held:
            self._held_at = now
        if now - self._held_at > HELD_GAP or command.speed <= 0:
            self._held_since = None
            return ""
        if self._held_since is None:
            self._held_since = now
        if now - self._held_since < HELD_PATIENCE:
            return ""
        if not self._avoidance.active and self._tracker.cut_short(HELD_REST):
            self._held_since = None
            return ""
        if now - self._held_since > BACK_OFF_AFTER:
            self._avoidance.make_room(now, pose)
        self._tracker.take_up()
        return "Waiting: something stands closer ahead than the robot may drive to."

    def _too_blind(self, now: float, estimate: PoseEstimate) -> str:
        """Why it should wait for a landmark: a wall may be nearer than the pose is certain."""
        sigma = estimate.position_sigma
        gap = self._scenery.distance(estimate.pose.position) - self._body_radius
        if CERTAINTY * sigma <= max(gap, LEAST_GAP):
            self._blind_since = None
            return ""
        if self._blind_since is None:
            self._blind_since = now
        if now - self._blind_since > LOOK_TIME:
            return ""  # nothing to be seen from here: the limits on the pose decide from now on
        return (
            f"Waiting for a landmark: the position is known to {100 * sigma:.0f} cm, "
            f"and a wall is {100 * max(gap, 0.0):.0f} cm away."
        )

    def blocked_for(self, now: float) -> float:
        """Seconds that an obstacle has kept it standing."""
        held = 0.0 if self._held_since is None else now - self._held_since
        return max(held, self._avoidance.blocked_for(now))

    def forget_obstacles(self) -> None:
        """The pose was found anew: what was remembered about obstacles hangs on the old one."""
        self._avoidance.reset()

    def observe(self, pose: Pose2D) -> None:
        """Add where the robot is now to what it has swept and travelled."""
        if self._last is not None:
            moved = self._last.distance_to(pose.position)
            if moved > JUMP:
                self._stroke_from = None
            else:
                self._travelled += moved
        self._last = pose
        if self._stroke_from is None:
            self._stroke_from = pose.position
        elif pose.distance_to(self._stroke_from) >= SWEEP_STEP:
            self._sweep_to(pose.position)

    def status(self, now: float) -> MissionStatus:
        """How far it has got."""
        plan, swept = self.plan, self._swept
        progress = min(1.0, self._tracker.progress / max(plan.predicted.length, 1e-9))
        if self.done:
            progress = 1.0
        coverage = None if swept is None else swept.coverage
        area = 0.0 if swept is None else plan.area.area
        return MissionStatus(
            run_id=self.run_id,
            mode=plan.mode,
            progress=progress,
            travelled=self._travelled,
            length=plan.predicted.length,
            coverage=coverage,
            swept_area=None if coverage is None else coverage * area,
            missed_area=None if coverage is None else (1 - coverage) * area,
            elapsed=now - self._started,
            eta=(1 - progress) * plan.predicted.duration,
        )

    def summary(self, now: float, outcome: Outcome, reason: str) -> RunSummary:
        """The record of this run."""
        return RunSummary(
            run_id=self.run_id,
            mode=self.plan.mode,
            outcome=outcome,
            reason=reason,
            coverage=None if self._swept is None else self._swept.coverage,
            travelled=self._travelled,
            duration=now - self._started,
            missed=MultiPolygon() if self._swept is None else self._swept.missed(),
        )

    def _sweep_to(self, point: Point) -> None:
        if self._swept is not None and self._stroke_from is not None:
            self._swept.sweep(self._stroke_from, point)
        self._stroke_from = point
