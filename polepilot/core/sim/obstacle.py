"""Things and people on the floor that the site does not show."""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import pairwise

from polepilot.core.geometry import Point


@dataclass(frozen=True, slots=True)
class Obstacle:
    """A disc that stands, or walks along ``waypoints`` and stays at the last one."""

    x: float
    y: float
    radius: float = 0.25
    waypoints: tuple[Point, ...] = ()
    speed: float = 0.5
    """Walking speed, m/s."""
    starts: float = 0.0
    """World time at which it begins to walk, seconds."""

    def position(self, now: float) -> Point:
        """Where its centre is."""
        rest = max(now - self.starts, 0.0) * self.speed
        path = ((self.x, self.y), *self.waypoints)
        for first, last in pairwise(path):
            length = math.dist(first, last)
            if rest < length:
                share = rest / length
                return (
                    first[0] + share * (last[0] - first[0]),
                    first[1] + share * (last[1] - first[1]),
                )
            rest -= length
        return path[-1]
