"""Places that a steered wheel's path misses, visited from the path: a short way there, and back.

The way back is the same curve in the other gear, so that the path goes on as if nothing had been:
whatever leads to a place leads from it as well.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np
import shapely
from numpy.typing import NDArray
from shapely import LineString, MultiPolygon, Polygon

from polepilot.core.geometry import Point, Pose2D
from polepilot.core.plan import PlanPart
from polepilot.core.planning.curves import Curve, curve_length, drive, joined, sample
from polepilot.core.planning.offset import cleanup_strokes
from polepilot.core.planning.patches import patches_of, pieces_of, standing_place
from polepilot.core.planning.space import FreeSpace, polygons
from polepilot.core.planning.target import Target
from polepilot.core.planning.ways import way_to_line, way_to_place

Points = NDArray[np.float64]
Gears = NDArray[np.int8]
Indices = NDArray[np.intp]

_MOST_CUTS = 6
"""How often a patch is halved until one place sweeps each piece."""
_LEG = 0.16
"""Straight pieces of the path longer than this may be left in between, metres."""
_APART = 0.12
"""Poses on the path from which a way is looked for are so far apart, metres."""
_END = 0.07
"""And so far from the ends of a straight piece."""
_NEAR = 2.5
"""Poses farther from the place than this are not looked at, in turning radii."""
_MOST_POSES = 120
_LEVELS = 4
"""So many short pieces may be in a way to a place before the curve at its end."""
_MOST_VISITS = 300
_MOST_FAILURES = 25
_BESIDE = 0.03
"""Places nearer to each other than this are the same when a way is looked for, metres."""


def with_visits(
    path: Points,
    gear: Gears,
    parts: tuple[PlanPart, ...],
    target: Target,
    space: FreeSpace,
    radius: float,
    smallest: float,
    enough: float,
    missed: MultiPolygon,
    vain: Vain | None = None,
) -> tuple[Points, Gears, tuple[PlanPart, ...], MultiPolygon]:
    """The path with visits to patches that it misses, the largest first; and what it misses then.

    ``missed``: what it misses now. ``radius``: of the arcs that are driven, metres. ``smallest``:
    patches smaller than this are left, m²; and so are all others as soon as they make up less than
    ``enough``. ``vain``: where no way was found before.
    """
    patches = patches_of(missed, smallest)
    left = sum(float(patch.area) for patch in patches)
    if left <= enough:
        return path, gear, parts, missed
    visitor = _Visitor(path, gear, space, target.tool, radius, Vain() if vain is None else vain)
    for patch in sorted(patches, key=lambda p: (-float(p.area), p.bounds)):
        if left <= enough or visitor.hopeless:
            break
        visitor.reach(patch, _MOST_CUTS, smallest / 4)
        left -= float(patch.area)
    if visitor.visits:
        missed = target.still_missed(missed, *(visit.points for visit in visitor.visits))
    return *visitor.result(parts), missed


@dataclass(slots=True)
class Vain:
    """Places, and lines from one to another, to which no way was found: who looks for one a hand's
    breadth beside, or again, finds none either, and finding none takes longest."""

    ends: list[tuple[Point, Point]] = field(default_factory=list)

    def holds(self, first: Point, last: Point) -> bool:
        """Whether a line, or a place (both ends), is one of them."""
        return any(
            math.dist(first, a) < _BESIDE and math.dist(last, b) < _BESIDE for a, b in self.ends
        )

    def holds_both(self, points: Points) -> bool:
        """Whether no way to a line was found from either of its ends."""
        first, last = ((float(x), float(y)) for x, y in points[[0, -1]])
        return self.holds(first, last) and self.holds(last, first)


@dataclass(frozen=True, slots=True)
class _Visit:
    """A way from the path to a place."""

    index: int
    """Of the segment that it leaves, or at whose end it leaves."""
    share: float
    """How far along that segment, 0 to 1."""
    points: Points
    gears: Gears


class _Visitor:
    """A path while visits are added to it."""

    def __init__(
        self,
        path: Points,
        gear: Gears,
        space: FreeSpace,
        tool: float,
        radius: float,
        vain: Vain,
    ) -> None:
        self._path = path
        self._gear = gear
        self._space = space
        self._tool = tool
        self._radius = radius
        self._vain = vain
        self._poses = _poses(path, gear)
        self._sorted = np.argsort(self._poses[:, 0], kind="stable")
        self._columns = self._poses[self._sorted, 0]
        self.visits: list[_Visit] = []
        self._lines: list[LineString] = []
        self._failures = 0

    def reach(self, patch: Polygon, cuts: int, smallest: float) -> None:
        """Visits a patch: one place, else passes along it, else each of its pieces."""
        if self.hopeless:
            return
        place = standing_place(patch, self._space, self._tool / 2)
        if place is not None:
            if self._visit(place):
                return
            cuts = min(cuts, 2)  # its pieces are reached by no other ways, or hardly ever
        elif passes := cleanup_strokes(patch, self._tool, self._space, smallest):
            done = [self._pass(stroke.points) for stroke in passes]
            if all(done):
                return
            for stroke in passes:
                if not done.pop(0):
                    strip = patch.intersection(stroke.line.buffer(self._tool / 2))
                    self._divide(strip, cuts, smallest)
            return
        self._divide(patch, cuts, smallest)

    def _divide(self, patch: shapely.Geometry, cuts: int, smallest: float) -> None:
        if not cuts:
            return
        for part in polygons(patch):
            for piece in pieces_of(part, self._tool / 2):
                if piece.area >= smallest:
                    self.reach(piece, cuts - 1, smallest)

    @property
    def hopeless(self) -> bool:
        """Whether there were so many visits, or failures, that no more are tried."""
        return len(self.visits) >= _MOST_VISITS or self._failures >= _MOST_FAILURES

    def _visit(self, place: shapely.Geometry) -> bool:
        """Adds the cheapest way that is found to a place; True as well if one led there before."""
        if shapely.intersects(place, np.array(self._lines, dtype=object)).any():
            return True
        circle = shapely.maximum_inscribed_circle(place, tolerance=0.002)
        x, y = (float(value) for value in shapely.get_coordinates(circle)[0])
        if self._vain.holds((x, y), (x, y)):
            return False
        near = self._near(x, y)
        found = way_to_place(self._space, self._poses[near], self._radius, (x, y), _LEVELS)
        if found is None:
            self._vain.ends.append(((x, y), (x, y)))
        return self._added(near, found, ())

    def _pass(self, points: Points) -> bool:
        """Adds a way along a straight line, entered at whichever end that is cheaper from."""
        first, last = ((float(x), float(y)) for x, y in points[[0, -1]])
        length = math.dist(first, last)
        best: tuple[float, Indices, tuple[int, Curve], Curve] | None = None
        for a, b in ((first, last), (last, first)):
            if self._vain.holds(a, b):
                continue
            near = self._near(*a)
            found = way_to_line(self._space, self._poses[near], self._radius, a, b, _LEVELS)
            if found is None:
                self._vain.ends.append((a, b))
                continue
            cost = curve_length(found[1])
            if best is None or cost < best[0]:
                pose = Pose2D(*self._poses[near[found[0]], :3].tolist())
                for piece in found[1]:
                    pose = drive(pose, piece, self._radius)
                along = math.cos(pose.heading) * (b[0] - a[0])
                along += math.sin(pose.heading) * (b[1] - a[1])
                best = cost, near, found, (("S", math.copysign(length, along)),)
        return best is not None and self._added(*best[1:])

    def _added(self, near: Indices, found: tuple[int, Curve] | None, more: Curve) -> bool:
        """Keeps a way that was found from one of the poses ``near``, with ``more`` at its end."""
        if found is None:
            self._failures += 1
            return False
        row = self._poses[near[found[0]]]
        curve = joined((*found[1], *more))
        points, gears, _ = sample(Pose2D(*row[:3].tolist()), curve, self._radius)
        if not self._space.holds_points(points):
            return False
        self.visits.append(_Visit(int(row[3]), float(row[4]), points, gears))
        self._lines.append(LineString(points))
        return True

    def _near(self, x: float, y: float) -> NDArray[np.intp]:
        """Poses on the path from which ways to a place are looked for."""
        reach = _NEAR * self._radius
        first, last = np.searchsorted(self._columns, [x - reach, x + reach])
        some = self._sorted[first:last]
        distances = np.hypot(self._poses[some, 0] - x, self._poses[some, 1] - y)
        near = distances < reach
        some, distances = some[near], np.round(distances[near], 6)
        return np.asarray(some[np.lexsort((some, distances))[:_MOST_POSES]])

    def result(self, parts: tuple[PlanPart, ...]) -> tuple[Points, Gears, tuple[PlanPart, ...]]:
        """The path with all visits, its gears, and its parts."""
        points: list[Points] = [self._path[:1]]
        gears: list[Gears] = []
        moved = np.zeros(len(self._path), dtype=np.intp)
        count, done, here = 1, 0, (-1, 0.0)
        for visit in sorted(self.visits, key=lambda v: (v.index, v.share)):
            stop = visit.index + (visit.share >= 1.0)
            points.append(self._path[done + 1 : stop + 1])
            gears.append(self._gear[done:stop])
            moved[done + 1 : stop + 1] = count + np.arange(stop - done)
            count += stop - done
            done = stop
            spot = (visit.index, visit.share)
            if visit.share < 1.0 and spot != here:
                here = spot
                points.append(visit.points[:1])
                gears.append(self._gear[visit.index : visit.index + 1])
                count += 1
            points += [visit.points[1:], visit.points[-2::-1]]
            gears += [visit.gears, -visit.gears[::-1]]
            count += 2 * len(visit.gears)
        points.append(self._path[done + 1 :])
        gears.append(self._gear[done:])
        moved[done + 1 :] = count + np.arange(len(self._path) - done - 1)
        ends = [int(moved[part.last]) for part in parts]
        firsts = [0, *ends[:-1]]
        return (
            np.vstack(points),
            np.concatenate(gears),
            tuple(
                PlanPart(part.kind, first, last)
                for part, first, last in zip(parts, firsts, ends, strict=True)
            ),
        )


def _poses(path: Points, gear: Gears) -> Points:
    """Poses on straight pieces of the path: x, y, heading, index of the segment, share of it."""
    steps = np.diff(path, axis=0)
    lengths = np.hypot(*steps.T)
    headings = np.arctan2(steps[:, 1] * gear, steps[:, 0] * gear)
    straight = np.flatnonzero(lengths > _LEG)
    room = lengths[straight] - 2 * _END
    counts = np.maximum(1, (room / _APART).astype(np.intp))
    index = np.repeat(straight, counts)
    place = np.arange(len(index)) - np.repeat(np.cumsum(counts) - counts, counts)
    # Evenly from the one end to the other; a single one in the middle.
    at = (place / np.maximum(counts - 1, 1).repeat(counts)) * room.repeat(counts) + _END
    share = np.where(counts.repeat(counts) == 1, 0.5, at / lengths[index])
    legs = np.column_stack(
        [path[index] + share[:, None] * steps[index], headings[index], index, share]
    )
    # Where the robot turns round on a straight line, and on arcs between two equal chords.
    turn = np.abs((np.diff(headings) + math.pi) % math.tau - math.pi)
    back = (gear[:-1] != gear[1:]) & (turn < 1e-6) & (np.minimum(lengths[:-1], lengths[1:]) > _END)
    arc = (gear[:-1] == gear[1:]) & (turn > 0.02) & (turn < 0.1)
    arc &= (np.abs(lengths[:-1] - lengths[1:]) < 1e-6) & (lengths[1:] > 0.03)
    index = np.flatnonzero(back | arc)
    half = ((headings[index + 1] - headings[index] + math.pi) % math.tau - math.pi) / 2
    bends = np.column_stack([path[index + 1], headings[index] + half, index, np.ones(len(index))])
    return np.vstack([legs, bends])
