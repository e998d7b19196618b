"""What stands on a site, for questions of sight and distance: line segments and discs."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence

import numpy as np
from numpy.typing import NDArray

from polepilot.core.geometry import Point, Pose2D

Floats = NDArray[np.float64]
Disc = tuple[Point, float]
"""Centre in `map` and radius, metres."""


class Scenery:
    """Walls as segments (S of them), poles and people as discs (D), in `map`.

    All answers are exact for straight walls and round things; cost grows with S, so ask `near`
    first where many questions concern one place.
    """

    def __init__(
        self, segments: Sequence[tuple[Point, Point]] = (), discs: Sequence[Disc] = ()
    ) -> None:
        ends = np.asarray(segments, float).reshape(-1, 2, 2)
        self._init(ends[:, 0], ends[:, 1], discs)

    def _init(self, first: Floats, last: Floats, discs: Iterable[Disc]) -> None:
        self._first = first
        self._step = last - first
        square = (self._step**2).sum(axis=1)
        self._square: Floats = np.where(square > 0, square, 1.0)
        self._discs = tuple(discs)

    @property
    def discs(self) -> tuple[Disc, ...]:
        return self._discs

    def near(self, point: Point, reach: float) -> Scenery:
        """Only what lies within ``reach`` of ``point`` at least in part."""
        keep = self._to_segments(point) <= reach
        found = Scenery.__new__(Scenery)
        found._init(
            self._first[keep],
            self._first[keep] + self._step[keep],
            [disc for disc in self._discs if math.dist(point, disc[0]) - disc[1] <= reach],
        )
        return found

    def with_discs(self, discs: Sequence[Disc]) -> Scenery:
        """The same walls and discs, and more discs."""
        found = Scenery.__new__(Scenery)
        found._first, found._step, found._square = self._first, self._step, self._square
        found._discs = (*self._discs, *discs)
        return found

    def distance(self, point: Point) -> float:
        """From ``point`` to the nearest thing; 0 inside a disc, infinite where nothing stands."""
        walls = self._to_segments(point)
        nearest = float(walls.min()) if len(walls) else math.inf
        for center, radius in self._discs:
            nearest = min(nearest, max(math.dist(point, center) - radius, 0.0))
        return nearest

    def distances(self, points: Floats) -> Floats:
        """`distance` for N x 2 points, in one go; memory grows with N times S."""
        result = np.full(len(points), np.inf)
        if len(self._first):
            x = points[:, :1] - self._first[:, 0]
            y = points[:, 1:] - self._first[:, 1]
            share = np.clip((x * self._step[:, 0] + y * self._step[:, 1]) / self._square, 0.0, 1.0)
            x -= share * self._step[:, 0]
            y -= share * self._step[:, 1]
            result = np.sqrt((x * x + y * y).min(axis=1))
        for center, radius in self._discs:
            away = np.hypot(points[:, 0] - center[0], points[:, 1] - center[1]) - radius
            result = np.minimum(result, np.maximum(away, 0.0))
        return result

    def blocked(self, start: Point, end: Point) -> bool:
        """Whether anything stands on the straight line between two points."""
        dx, dy = end[0] - start[0], end[1] - start[1]
        length = math.hypot(dx, dy)
        if length == 0:
            return False
        sight = Pose2D(start[0], start[1], math.atan2(dy, dx))
        if self._rays(sight, (0.0,), length) < length:
            return True
        return any(
            _on_line(disc, start, (dx / length, dy / length), length) for disc in self._discs
        )

    def in_beam(self, origin: Pose2D, half_width: float, reach: float) -> float | None:
        """The range to the nearest thing in a beam, as an ideal sensor measures it.

        Args:
            origin: of the beam, looking along its middle.
            half_width: of the beam, radians, below pi/2.
            reach: farther things are not seen.

        Returns:
            Metres, or None where nothing stands within reach.
        """
        nearest = self._walls_in_beam(origin, half_width, reach)
        for center, radius in self._discs:
            away = origin.distance_to(center)
            if away - radius >= nearest:
                continue
            if away <= radius:
                nearest = 0.0
                continue
            off = max(abs(origin.bearing_to(center)) - half_width, 0.0)
            if off >= math.pi / 2 or away * math.sin(off) >= radius:
                continue
            # The ray at the beam's edge (or through the centre) meets the near side.
            hit = away * math.cos(off) - math.sqrt(radius**2 - (away * math.sin(off)) ** 2)
            nearest = min(nearest, hit)
        return nearest if nearest < reach else None

    def _to_segments(self, point: Point) -> Floats:
        x = point[0] - self._first[:, 0]
        y = point[1] - self._first[:, 1]
        share = np.clip((x * self._step[:, 0] + y * self._step[:, 1]) / self._square, 0.0, 1.0)
        result: Floats = np.hypot(x - share * self._step[:, 0], y - share * self._step[:, 1])
        return result

    def _walls_in_beam(self, origin: Pose2D, half_width: float, reach: float) -> float:
        if not len(self._first):
            return math.inf
        nearest = self._rays(origin, (-half_width, half_width), reach)
        # Between the edges of the beam a wall is nearest at its foot or at one of its ends.
        x = origin.x - self._first[:, 0]
        y = origin.y - self._first[:, 1]
        share = np.clip((x * self._step[:, 0] + y * self._step[:, 1]) / self._square, 0.0, 1.0)
        cos, sin = math.cos(origin.heading), math.sin(origin.heading)
        limit = math.tan(half_width)
        for at in (share, 0.0, 1.0):
            px, py = at * self._step[:, 0] - x, at * self._step[:, 1] - y
            ahead, aside = cos * px + sin * py, cos * py - sin * px
            inside = (ahead > 0) & (np.abs(aside) <= ahead * limit)
            if inside.any():
                nearest = min(nearest, float(np.hypot(px[inside], py[inside]).min()))
        return nearest

    def _rays(self, origin: Pose2D, angles: Sequence[float], reach: float) -> float:
        """The nearest wall on any of the rays at ``angles`` from the heading, metres."""
        nearest = math.inf
        x = self._first[:, 0] - origin.x
        y = self._first[:, 1] - origin.y
        for angle in angles:
            cos, sin = math.cos(origin.heading + angle), math.sin(origin.heading + angle)
            across = cos * self._step[:, 1] - sin * self._step[:, 0]
            crossing = np.abs(across) > 1e-12
            safe = np.where(crossing, across, 1.0)
            along = (x * self._step[:, 1] - y * self._step[:, 0]) / safe
            share = (x * sin - y * cos) / safe
            hit = crossing & (along >= 0) & (along < reach) & (share >= 0) & (share <= 1)
            if hit.any():
                nearest = min(nearest, float(along[hit].min()))
        return nearest


def _on_line(disc: Disc, start: Point, unit: Point, length: float) -> bool:
    (x, y), radius = disc
    along = (x - start[0]) * unit[0] + (y - start[1]) * unit[1]
    along = min(max(along, 0.0), length)
    return math.dist((start[0] + along * unit[0], start[1] + along * unit[1]), (x, y)) < radius
