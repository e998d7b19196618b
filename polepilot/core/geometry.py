"""Poses and angles in the plane (REP 103): metres, radians, x forward, y left, turning left."""

from __future__ import annotations

import math
from typing import NamedTuple

Point = tuple[float, float]
"""A place in `map`, metres."""

Polyline = tuple[Point, ...]
"""Two or more places joined by straight lines. A ring does not repeat its first point."""


def wrap_angle(angle: float) -> float:
    """The same direction in (-pi, pi]."""
    wrapped = math.fmod(angle, math.tau)
    if wrapped > math.pi:
        wrapped -= math.tau
    elif wrapped <= -math.pi:
        wrapped += math.tau
    return wrapped


def angle_between(a: float, b: float) -> float:
    """How far to turn from direction ``a`` to direction ``b``, in (-pi, pi]."""
    return wrap_angle(b - a)


class Pose2D(NamedTuple):
    """Where a frame stands in another one: x, y in metres, heading in radians, in (-pi, pi]."""

    x: float
    y: float
    heading: float

    @property
    def position(self) -> Point:
        return (self.x, self.y)

    def distance_to(self, point: Point) -> float:
        """Straight distance from the origin of this pose to ``point``, metres."""
        return math.hypot(point[0] - self.x, point[1] - self.y)

    def bearing_to(self, point: Point) -> float:
        """Direction to ``point`` seen from this pose, left positive, in (-pi, pi]."""
        return wrap_angle(math.atan2(point[1] - self.y, point[0] - self.x) - self.heading)

    def compose(self, other: Pose2D) -> Pose2D:
        """``other``, given in this frame, expressed in the parent frame."""
        cos, sin = math.cos(self.heading), math.sin(self.heading)
        return Pose2D(
            self.x + cos * other.x - sin * other.y,
            self.y + sin * other.x + cos * other.y,
            wrap_angle(self.heading + other.heading),
        )

    def inverse(self) -> Pose2D:
        """The parent frame expressed in this one."""
        cos, sin = math.cos(self.heading), math.sin(self.heading)
        return Pose2D(
            -cos * self.x - sin * self.y,
            sin * self.x - cos * self.y,
            wrap_angle(-self.heading),
        )

    def to_parent(self, point: Point) -> Point:
        """A point given in this frame, in the parent frame."""
        cos, sin = math.cos(self.heading), math.sin(self.heading)
        return (
            self.x + cos * point[0] - sin * point[1],
            self.y + sin * point[0] + cos * point[1],
        )

    def to_local(self, point: Point) -> Point:
        """A point of the parent frame, in this frame."""
        cos, sin = math.cos(self.heading), math.sin(self.heading)
        dx, dy = point[0] - self.x, point[1] - self.y
        return (cos * dx + sin * dy, -sin * dx + cos * dy)

    def ahead(self, distance: float) -> Point:
        """The point ``distance`` metres straight ahead."""
        return (
            self.x + distance * math.cos(self.heading),
            self.y + distance * math.sin(self.heading),
        )
