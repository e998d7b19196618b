"""Places of a path where it can be taken up again, and lines that are driven."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from polepilot.core.command import DriveCommand
from polepilot.core.geometry import Pose2D, wrap_angle
from polepilot.core.plan import Plan, PlanPart, Prediction
from polepilot.core.vehicle import Vehicle

Floats = NDArray[np.float64]
Gears = NDArray[np.int8]

RUN_UP = 15
"""Samples of the path that have to be free, and forward, where it is taken up again."""
AWAY = 0.20
"""Farther than this from the next piece of the path it is not simply followed again, metres."""
ACROSS = math.radians(45)
"""Nor is it where the robot points farther away from its direction than this."""


def onward(pose: Pose2D, points: Floats, places: NDArray[np.int64]) -> NDArray[np.bool_]:
    """Which places can be arrived at along the path, not against it: the next pass comes back."""
    offset = points[places] - pose.position
    along = points[np.minimum(places + 1, len(points) - 1)] - points[np.maximum(places - 1, 0)]
    result: NDArray[np.bool_] = (offset * along).sum(axis=1) > 0
    return result


def stays(good: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Where it is good, and remains so for the next 30 cm (or to the end)."""
    result = good.copy()
    for shift in range(1, min(RUN_UP, len(good))):
        result[:-shift] &= good[shift:]
    return result


def before_gear_change(points: Floats) -> int:
    """How many of the points come before the line turns back on itself."""
    steps = np.diff(points, axis=0)
    if len(steps) < 2:
        return len(points)
    back = (steps[:-1] * steps[1:]).sum(axis=1) < 0
    return int(np.argmax(back)) + 2 if back.any() else len(points)


def tangent(points: Floats, index: int) -> float:
    """Direction of the line at one of its points."""
    first, last = max(index - 1, 0), min(index + 1, len(points) - 1)
    step = points[last] - points[first]
    return math.atan2(step[1], step[0])


def pose_at(points: Floats, gears: Gears, index: int) -> Pose2D:
    """How the robot stands at one of the path's points, looking backward on a way back.

    At a change of gear as at the end of the stretch that this point belongs to.
    """
    gear = gears[index]
    first = last = index
    if index + 1 < len(points) and gears[index + 1] == gear:
        last = index + 1
    if last == index and index > 0 and gears[index - 1] == gear:
        first = index - 1
    step = points[last] - points[first]
    heading = math.atan2(step[1], step[0]) + (0.0 if gear > 0 else math.pi)
    return Pose2D(float(points[index, 0]), float(points[index, 1]), wrap_angle(heading))


def beside(pose: Pose2D, points: Floats, along: Floats, gears: Gears) -> bool:
    """Whether the path ahead (points, metres along it, gears) cannot simply be followed from here.

    It is too far away, or it goes in another direction.
    """
    if len(along) == 0:
        return False
    distances = np.hypot(*(points - pose.position).T)
    nearest = int(np.argmin(distances))
    turn = wrap_angle(pose_at(points, gears, nearest).heading - pose.heading)
    return bool(distances[nearest] > AWAY) or abs(turn) > ACROSS


def as_plan(path: Floats, gear: Gears, width: float) -> Plan:
    """A line as a plan that a tracker follows."""
    return Plan(
        mode="route",
        path=path,
        gear=gear,
        parts=(PlanPart("route", 0, len(path) - 1),),
        unreachable=(),
        predicted=Prediction(1.0, 0.0, 0.0, 0),
        tool_width=width,
        clearance=0.0,
        min_turn_radius=0.0,
    )


def braking_line(pose: Pose2D, command: DriveCommand, vehicle: Vehicle) -> Floats:
    """Where the robot gets to by this command before it can stand: five points, from here on."""
    speed = abs(command.speed)
    reach = 0.06 + speed * 0.2 + speed**2 / (2 * vehicle.max_acceleration)
    curvature = math.tan(command.steering) / vehicle.wheelbase
    way = np.sign(command.speed) * reach * np.arange(5) / 4
    turn = way * curvature / 2
    return np.column_stack(
        [
            pose.x + way * np.cos(pose.heading + turn),
            pose.y + way * np.sin(pose.heading + turn),
        ]
    )
