"""Paths, and a drive of the simulated wheels over them with a pose that is always known."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
import shapely
from numpy.typing import NDArray

from polepilot.core.command import DriveCommand
from polepilot.core.control.tracker import PathTracker
from polepilot.core.geometry import Point, Pose2D
from polepilot.core.plan import Plan, PlanPart, Prediction
from polepilot.core.sim.motion import Actuation, Disturbances, Motion
from polepilot.core.vehicle import PanUnit, Vehicle

VEHICLE = Vehicle()
FULL_SPEED = 0.5


def plan_of(path: list[Point], gear: list[int] | None = None) -> Plan:
    count = len(path)
    return Plan(
        mode="route",
        path=np.asarray(path, float),
        gear=np.asarray(gear or [1] * (count - 1), np.int8),
        parts=(PlanPart("route", 0, count - 1),),
        unreachable=(),
        predicted=Prediction(1.0, 1.0, 1.0, 0),
        tool_width=0.4,
        clearance=0.2,
        min_turn_radius=0.36,
    )


def arc(center: Point, radius: float, first: float, last: float) -> list[Point]:
    """Points every 3 cm or so along a part of a circle, both ends included."""
    count = max(int(abs(last - first) * radius / 0.03), 8)
    return [
        (center[0] + radius * math.cos(a), center[1] + radius * math.sin(a))
        for a in np.linspace(first, last, count)
    ]


def rounded_square(side: float, radius: float) -> list[Point]:
    """Counter-clockwise from (radius, 0) and back to it."""
    near, far, quarter = radius, side - radius, math.pi / 2
    return [
        (near, 0.0),
        *arc((far, near), radius, -quarter, 0.0),
        *arc((far, far), radius, 0.0, quarter),
        *arc((near, far), radius, quarter, 2 * quarter),
        *arc((near, near), radius, 2 * quarter, 3 * quarter),
    ]


def actuation(command: DriveCommand) -> Actuation:
    """As the electronic differential drives the two motors (method.md, time encoder)."""
    bend = math.tan(command.steering) / VEHICLE.wheelbase * VEHICLE.track / 2
    duty = command.speed / FULL_SPEED * 1000
    return Actuation(duty * (1 - bend), duty * (1 + bend), command.steering)


@dataclass
class Drive:
    tracker: PathTracker
    motion: Motion
    positions: list[Point] = field(default_factory=list)
    progress: list[float] = field(default_factory=list)
    seconds: float = 0.0

    def deviations(self, path: NDArray[np.float64]) -> NDArray[np.float64]:
        line = shapely.LineString(path)
        result: NDArray[np.float64] = shapely.distance(line, shapely.points(self.positions))
        return result


def drive(
    plan: Plan,
    start: Pose2D,
    *,
    disturbances: Disturbances | None = None,
    seed: int = 1,
    rate: float = 20.0,
    until: Callable[[Drive], bool] = lambda _: False,
    longest: float = 120.0,
) -> Drive:
    motion = Motion(
        VEHICLE,
        PanUnit(),
        disturbances or Disturbances(),
        np.random.default_rng(seed),
        full_speed=FULL_SPEED,
        pose=start,
    )
    run = Drive(PathTracker(plan, VEHICLE), motion)
    while not run.tracker.done and not until(run) and run.seconds < longest:
        command = run.tracker.update(motion.pose, 1 / rate)
        motion.advance(1 / rate, actuation(command))
        run.seconds += 1 / rate
        run.positions.append(motion.pose.position)
        run.progress.append(run.tracker.progress)
    motion.advance(0.5, Actuation(steering=command.steering))
    return run
