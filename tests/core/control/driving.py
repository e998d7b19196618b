"""Paths, and a drive of the simulated wheels over them with a pose that is always known."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
import shapely
from numpy.typing import NDArray

from polepilot.core.command import DriveCommand
from polepilot.core.control.avoidance import ObstacleAvoidance
from polepilot.core.control.tracker import PathTracker
from polepilot.core.geometry import Point, Pose2D
from polepilot.core.observation import PoseEstimate, Status
from polepilot.core.plan import Plan, PlanPart, Prediction
from polepilot.core.robot.curves import curves_of
from polepilot.core.scenery import Scenery
from polepilot.core.sim.motion import Actuation, Disturbances, Motion
from polepilot.core.sim.obstacle import Obstacle
from polepilot.core.sim.proximity import sense
from polepilot.core.site import Site
from polepilot.core.vehicle import PanUnit, Proximity, Vehicle

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


@dataclass
class Encounter:
    """A drive among people: what came of it. Gaps are from the body, metres."""

    done: bool
    seconds: float
    end: Pose2D
    to_people: float
    to_walls: float
    reasons: list[str]
    positions: list[Point]
    stood: float
    """Seconds of standing while something was in the way."""


def meet(
    path: list[Point],
    site: Site,
    people: list[Obstacle],
    *,
    gear: list[int] | None = None,
    start: Pose2D | None = None,
    seed: int = 1,
    longest: float = 80.0,
    sigma: float = 0.0,
) -> Encounter:
    """Drive ``path`` with avoidance, sensing walls and people with the simulated rangers."""
    rng = np.random.default_rng(seed)
    if start is None:
        (x, y), (next_x, next_y) = path[0], path[1]
        start = Pose2D(x, y, math.atan2(next_y - y, next_x - x))
    motion = Motion(VEHICLE, PanUnit(), Disturbances(), rng, full_speed=FULL_SPEED, pose=start)
    tracker = PathTracker(plan_of(path, gear), VEHICLE)
    avoidance = ObstacleAvoidance(Proximity(), VEHICLE, site, curves_of(VEHICLE))
    walls = Scenery(site.segments())
    poles = [(mark.position, mark.kind.diameter / 2) for mark in site.landmarks]
    scene = walls.with_discs(poles)
    covariance = np.diag([max(sigma, 0.01) ** 2] * 2 + [max(sigma / 2, 0.005) ** 2])
    result = Encounter(False, 0.0, start, math.inf, math.inf, [], [], 0.0)
    step = 0.05
    while not tracker.done and result.seconds < longest:
        now = result.seconds
        discs = [(person.position(now), person.radius) for person in people]
        sensed = sense(motion.pose, Proximity(), scene.with_discs(discs), rng)
        left, center, right = (mm / 1000 for mm in sensed)
        error = rng.standard_normal(3) * (sigma, sigma, sigma / 2)
        pose = Pose2D(*(value + float(e) for value, e in zip(motion.pose, error, strict=True)))
        estimate = PoseEstimate(now, pose, covariance, Status.TRACKING)
        command = avoidance.update(now, step, estimate, (left, center, right), tracker)
        if avoidance.reason and avoidance.reason not in result.reasons:
            result.reasons.append(avoidance.reason)
        if avoidance.active and command.speed == 0:
            result.stood += step
        motion.advance(step, actuation(command))
        result.seconds += step
        here = motion.pose.position
        result.positions.append(here)
        result.to_walls = min(result.to_walls, walls.distance(here) - VEHICLE.body_radius)
        for center_of, radius in discs:
            gap = math.dist(here, center_of) - radius - VEHICLE.body_radius
            result.to_people = min(result.to_people, gap)
    result.done, result.end = tracker.done, motion.pose
    return result
