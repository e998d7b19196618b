"""What a path misses, swept by short bumps of it instead of by passes of their own.

Loops a whole tool width apart leave the tips of corners between them, and narrow strips where
they end. A bump leaves the path, touches one place from which the tool reaches the patch, and
comes back a little farther on. Corners are as sharp as they come: for radius 0 only.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from itertools import pairwise

import numpy as np
import shapely
from numpy.typing import NDArray
from shapely import LineString, MultiPolygon, Polygon

from polepilot.core.plan import PlanPart
from polepilot.core.planning.space import FreeSpace, polygons

Points = NDArray[np.float64]

_SLIVER = 0.002
"""What is thinner than twice this is left, metres."""
_LOSS = 0.0003
"""So much may be swept no more where a bump cuts across, m² for a tool of 0.4 m."""
_ROUND = 12
"""Segments per quarter turn of a capsule."""
_MOST_CUTS = 7
"""How often a patch is halved until one place sweeps each piece."""


def short_bumps(patch: Polygon, tool: float) -> bool:
    """Whether bumps along a patch are shorter than to drive along it and back."""
    radius = tool / 2
    length = float(patch.length) / 2
    width = float(patch.area) / max(length, 1e-9)
    pitch = np.linspace(0.4, 1.9, 16) * radius
    depth = width + radius - np.sqrt(radius**2 - pitch**2 / 4)
    bumps = float(np.min(np.ceil(length / pitch) * 2 * depth))
    return bumps < 2 * max(length - radius, 0.0) + 2 * (radius + width / 2)


def with_bumps(
    path: Points,
    parts: tuple[PlanPart, ...],
    target: MultiPolygon,
    missed: shapely.Geometry,
    space: FreeSpace,
    tool: float,
    smallest: float,
    whole_parts: bool = False,
) -> tuple[Points, tuple[PlanPart, ...]]:
    """The path with bumps to those patches of ``missed`` that are larger than ``smallest`` m².

    ``whole_parts``: the ends of parts stay where they are.
    """
    opened = missed.buffer(-_SLIVER, quad_segs=2).buffer(_SLIVER, quad_segs=2)
    patches = [patch for patch in polygons(opened) if patch.area >= smallest]
    if not patches:
        return path, parts
    bumped = _Bumped(path, target, space, tool)
    if whole_parts:
        bumped.keep([part.last for part in parts])
    for patch in sorted(patches, key=lambda p: (-float(p.area), p.bounds)):
        bumped.reach(patch, _MOST_CUTS)
    return bumped.result(parts)


class _Bumped:
    """A path while bumps are put into it."""

    def __init__(self, path: Points, target: MultiPolygon, space: FreeSpace, tool: float) -> None:
        self._path = path
        self._target = target
        self._space = space
        self._radius = tool / 2
        self._marks = np.r_[0.0, np.cumsum(np.hypot(*np.diff(path, axis=0).T))]
        self._lines = shapely.linestrings(np.stack([path[:-1], path[1:]], axis=1))
        self._tree = shapely.STRtree(self._lines)
        self._kept_marks = np.zeros(0)
        self._bumps: list[tuple[float, float, Points, LineString]] = []
        """From and to which length along the path, the place between, and the line by way of it."""

    def keep(self, indices: list[int]) -> None:
        """Bumps may not cut across these points of the path."""
        self._kept_marks = self._marks[indices]

    def reach(self, patch: Polygon, cuts: int) -> None:
        """Sweeps a patch by one bump, or by several if it is too long for one."""
        small = shapely.minimum_bounding_radius(patch) < self._radius
        place = self._place(patch) if small else None
        if place is not None:
            self._add(place)
        elif cuts:
            for piece in _pieces(patch, self._radius):
                self.reach(piece, cuts - 1)

    def _place(self, patch: Polygon) -> shapely.Geometry | None:
        """Where the tool's middle may be to sweep all of a patch; None: nowhere."""
        hull = shapely.get_coordinates(shapely.convex_hull(patch).simplify(0.001))[:-1]
        discs = shapely.buffer(shapely.points(hull), self._radius - 0.0005, quad_segs=_ROUND)
        place = shapely.intersection_all(discs)
        if not self._space.holds(place):
            place = shapely.intersection(place, self._space.polygon)
        return None if place.is_empty else place

    def _add(self, place: shapely.Geometry) -> None:
        """Puts in a bump that touches ``place``, where that costs least."""
        if (
            self._bumps
            and shapely.distance(np.array([b[3] for b in self._bumps]), place).min() == 0
        ):
            return  # an earlier bump does that
        near = self._tree.query(place, predicate="dwithin", distance=4 * self._radius)
        lengths = np.round(shapely.distance(self._lines[near], place), 6)
        for index in near[np.lexsort((near, lengths))].tolist():
            line = shapely.shortest_line(self._lines[index], place)
            if self._space.holds(line):
                break
        else:
            return
        foot, tip = shapely.get_coordinates(line)
        if math.dist(foot, tip) < 1e-6:
            return
        at = float(self._marks[index] + math.dist(self._path[index], foot))
        for reach in (1.0, 0.5, 0.25, 0.0):
            first, last = at - reach * self._radius, at + reach * self._radius
            if first < 0 or last > self._marks[-1]:
                continue
            if any(first < bump[1] and bump[0] < last for bump in self._bumps):
                continue
            if ((self._kept_marks > first) & (self._kept_marks < last)).any():
                continue
            if self._try(first, last, tip):
                return

    def _try(self, first: float, last: float, tip: Points) -> bool:
        """Puts a bump in if nothing that counts is lost by it."""
        old = self._stretch(first, last)
        new = np.vstack([old[0], tip, old[-1]])
        if not self._space.holds_points(new):
            return False
        if last - first > 1e-9:
            before = _swept([old], self._radius)
            window = before.buffer(self._radius)
            others: list[Points] = [new]
            mine = [bump for bump in self._bumps if math.dist(bump[2], tip) < 8 * self._radius]
            gone = [(first, last), *((bump[0], bump[1]) for bump in mine)]
            for index in self._tree.query(window, predicate="intersects").tolist():
                others += self._kept(index, gone)
            others += [shapely.get_coordinates(bump[3]) for bump in mine]
            lost = before.difference(_swept(others, self._radius)).intersection(self._target)
            if lost.area > _LOSS * (self._radius / 0.2) ** 2:
                return False
        self._bumps.append((first, last, tip, LineString(new)))
        return True

    def _kept(self, index: int, gone: list[tuple[float, float]]) -> list[Points]:
        """What is left of a segment of the path without some stretches of it."""
        spans = [(float(self._marks[index]), float(self._marks[index + 1]))]
        for first, last in gone:
            cut: list[tuple[float, float]] = []
            for a, b in spans:
                if first < b and a < last:
                    cut += [(a, first)] if first - a > 1e-9 else []
                    cut += [(last, b)] if b - last > 1e-9 else []
                else:
                    cut.append((a, b))
            spans = cut
        return [np.vstack([self._at(a), self._at(b)]) for a, b in spans]

    def _at(self, mark: float) -> Points:
        return np.array(
            [
                np.interp(mark, self._marks, self._path[:, 0]),
                np.interp(mark, self._marks, self._path[:, 1]),
            ]
        )

    def _stretch(self, first: float, last: float) -> Points:
        inner = self._path[(self._marks > first + 1e-9) & (self._marks < last - 1e-9)]
        return np.vstack([self._at(first), inner, self._at(last)])

    def result(self, parts: tuple[PlanPart, ...]) -> tuple[Points, tuple[PlanPart, ...]]:
        """The path with all bumps, and its parts."""
        points: list[Points] = []
        marks: list[float] = []
        at = 0
        for first, last, tip, _ in sorted(self._bumps, key=lambda bump: (bump[0], bump[1])):
            stop = int(np.searchsorted(self._marks, first - 1e-9))
            points += list(self._path[at:stop])
            marks += self._marks[at:stop].tolist()
            points += [self._at(first), tip, self._at(last)]
            marks += [first, (first + last) / 2, last]
            at = max(at, int(np.searchsorted(self._marks, last + 1e-9)))
        points += list(self._path[at:])
        marks += self._marks[at:].tolist()
        ends = np.searchsorted(np.array(marks), [self._marks[part.last] for part in parts])
        ends[-1] = len(points) - 1
        moved: list[PlanPart] = []
        for part, end in zip(parts, ends.tolist(), strict=True):
            begin = moved[-1].last if moved else 0
            if end > begin:
                moved.append(PlanPart(part.kind, begin, end))
        return np.array(points), tuple(moved)


def _swept(lines: Iterable[Points], radius: float) -> shapely.Geometry:
    pairs = [np.vstack(pair) for line in lines for pair in pairwise(line)]
    capsules = shapely.buffer(shapely.linestrings(np.array(pairs)), radius, quad_segs=_ROUND)
    return shapely.union_all(capsules)


def _pieces(patch: Polygon, radius: float) -> list[Polygon]:
    """A patch cut across its longest direction, so that bumps to its pieces are short."""
    box = shapely.minimum_rotated_rectangle(patch)
    if not isinstance(box, Polygon):
        return []
    corners = np.asarray(box.exterior.coords, dtype=float)
    if np.hypot(*(corners[1] - corners[0])) < np.hypot(*(corners[2] - corners[1])):
        corners = np.vstack([corners[1:], corners[1:2]])
    along, across = corners[1] - corners[0], corners[2] - corners[1]
    length, width = float(np.hypot(*along)), float(np.hypot(*across))
    counts = np.arange(2, max(3, math.ceil(4 * length / radius)))
    half = length / counts / 2
    fits = half**2 + width**2 / 4 < (0.98 * radius) ** 2
    cost = counts * (width + radius - np.sqrt(np.maximum(radius**2 - half**2, 0.0)))
    count = int(counts[np.argmin(np.where(fits, cost, np.inf))]) if fits.any() else 2
    found: list[Polygon] = []
    for step in range(count):
        first, last = (corners[0] + along * share / count for share in (step, step + 1))
        strip = Polygon([first, last, last + across, first + across])
        found += [part for part in polygons(patch.intersection(strip)) if part.area > 1e-5]
    return found
