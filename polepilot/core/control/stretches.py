"""A planned path, cut where the gear changes and sampled for following."""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from polepilot.core.plan import Plan
from polepilot.core.vehicle import Vehicle

Floats = NDArray[np.float64]

SPACING = 0.02
"""Metres between samples."""
LATERAL_ACCELERATION = 0.25
"""Most that a curve may ask for, m/s²: the body is light and its wheels are narrow."""
DECELERATION = 0.30
"""With which speed limits are approached, m/s²."""
CREEP = 0.06
"""No limit on the way is below this speed, m/s."""
_CURVATURE_BASE = 0.08
_STEERING_SHARE = 0.7
"""Share of the servo's rate that following a curve may take; the rest is for corrections."""


@dataclass(frozen=True, slots=True, eq=False)
class Stretch:
    """A part of the path in one gear, M samples. Curvature is that of the line as it is driven."""

    gear: int
    begin: float
    """Where it starts along the whole path, metres."""
    points: Floats
    """M x 2, `map`."""
    along: Floats
    """M, metres from this stretch's start."""
    curvature: Floats
    """M, 1/m, left positive."""
    speed: Floats
    """M, m/s, not negative: the most that curves and the stop at the end allow."""

    @property
    def length(self) -> float:
        return float(self.along[-1])

    def point_at(self, along: float) -> tuple[float, float]:
        """The point there; beyond either end on the straight continuation."""
        if along > self.along[-1]:
            first, last, rest = self.points[-2], self.points[-1], along - self.along[-1]
            base = last
        elif along < 0:
            first, last, rest = self.points[0], self.points[1], along
            base = first
        else:
            return (
                float(np.interp(along, self.along, self.points[:, 0])),
                float(np.interp(along, self.along, self.points[:, 1])),
            )
        step = last - first
        base = base + step * (rest / math.hypot(step[0], step[1]))
        return float(base[0]), float(base[1])


def cut(plan: Plan, vehicle: Vehicle) -> list[Stretch]:
    """The stretches of a plan, in order; points that repeat are left out."""
    steps = np.hypot(*np.diff(plan.path, axis=0).T)
    keep = steps > 1e-6
    starts, gears = plan.path[:-1][keep], plan.gear[keep]
    ends = plan.path[1:][keep]
    if len(starts) == 0:
        return []
    edges = [0, *(np.flatnonzero(np.diff(gears)) + 1).tolist(), len(gears)]
    stretches: list[Stretch] = []
    begin = 0.0
    for first, last in pairwise(edges):
        corners = np.vstack([starts[first:last], ends[last - 1 : last]])
        stretch = _sample(corners, int(gears[first]), begin, vehicle)
        stretches.append(stretch)
        begin += stretch.length
    return stretches


def _sample(corners: Floats, gear: int, begin: float, vehicle: Vehicle) -> Stretch:
    lengths = np.hypot(*np.diff(corners, axis=0).T)
    at = np.concatenate([[0.0], np.cumsum(lengths)])
    pieces = np.maximum(np.ceil(lengths / SPACING - 1e-9).astype(int), 1)
    along = np.concatenate(
        [[0.0]]
        + [
            np.linspace(start, end, count + 1)[1:]
            for start, end, count in zip(at[:-1], at[1:], pieces, strict=True)
        ]
    )
    points = np.column_stack([np.interp(along, at, corners[:, axis]) for axis in (0, 1)])
    curvature = _curvature(points, along)
    return Stretch(gear, begin, points, along, curvature, _speed(along, curvature, vehicle))


def _curvature(points: Floats, along: Floats) -> Floats:
    """Change of direction between the chords before and after each sample, per metre.

    Chords of 8 cm: shorter ones see the corners of a planner's polyline, not its curve.
    """
    base = min(_CURVATURE_BASE, float(along[-1]) / 2)
    before = np.maximum(along - base, 0.0)
    after = np.minimum(along + base, along[-1])
    middle = (before + after) / 2

    def at(where: Floats) -> Floats:
        return np.column_stack([np.interp(where, along, points[:, axis]) for axis in (0, 1)])

    back, front = at(middle) - at(before), at(after) - at(middle)
    cross = back[:, 0] * front[:, 1] - back[:, 1] * front[:, 0]
    dot = (back * front).sum(axis=1)
    turn: Floats = np.arctan2(cross, dot)
    result: Floats = turn / ((after - before) / 2)
    return result


def _speed(along: Floats, curvature: Floats, vehicle: Vehicle) -> Floats:
    limit = np.full(len(along), vehicle.max_speed)
    bend = np.maximum(np.abs(curvature), 1e-6)
    limit = np.minimum(limit, np.sqrt(LATERAL_ACCELERATION / bend))
    steering = np.clip(
        np.arctan(curvature * vehicle.wheelbase), -vehicle.max_steering, vehicle.max_steering
    )
    gaps = np.diff(along)
    rate = np.abs(np.diff(steering)) / gaps
    allowed = _STEERING_SHARE * vehicle.steering_rate / np.maximum(rate, 1e-6)
    limit[:-1] = np.minimum(limit[:-1], allowed)
    limit[1:] = np.minimum(limit[1:], allowed)
    limit = np.maximum(limit, CREEP)
    limit[-1] = min(float(limit[-1]), CREEP)
    values, rooms = limit.tolist(), (2 * DECELERATION * gaps).tolist()
    for index in range(len(values) - 2, -1, -1):
        values[index] = min(values[index], math.sqrt(values[index + 1] ** 2 + rooms[index]))
    return np.asarray(values)
