"""What a path misses, swept by short bumps of it instead of by passes of their own.

Loops a whole tool width apart leave the tips of corners between them, and narrow strips where
they end. A bump leaves the path, touches one place from which the tool reaches the patch, and
comes back a little farther on. Corners are as sharp as they come: for radius 0 only.
"""

from __future__ import annotations

import itertools
import math
from bisect import bisect_left, bisect_right
from dataclasses import dataclass

import numpy as np
import shapely
from numpy.typing import NDArray
from shapely import LineString, Polygon

from polepilot.core.plan import PlanPart
from polepilot.core.planning.patches import patches_of, pieces_of, standing_place, strip_of
from polepilot.core.planning.space import FreeSpace, polygons
from polepilot.core.planning.swept import few_corners
from polepilot.core.planning.target import CHORD, Target

Points = NDArray[np.float64]
Shapes = NDArray[np.object_]

_LOSS = 0.0003
"""So much may be swept no more where a bump cuts across, m² for a tool of 0.4 m."""
_PITCH = 1.7
"""A path beside a strip steps aside for half of this, as a share of the tool's radius."""
_RISE = 0.9
"""From how far away such steps sweep the whole strip, as a share of the tool's radius."""
_ROUND = 8
"""Segments per quarter turn of a capsule."""
_STEP = 0.125
_DEPTHS = 16
_TURN = 0.25
"""What a tool sweeps is looked at in pieces: so long, as a share of its radius; so many from its
rim to its middle, the thinnest at the rim; at corners in sectors of this angle."""
_EDGES = 1 - np.linspace(0, 1, _DEPTHS + 1) ** 2
_OUT, _THICK = (_EDGES[:-1] + _EDGES[1:]) / 2, _EDGES[:-1] - _EDGES[1:]
_SHARP = 0.35
"""Where a path turns by less, what its inner side has twice does not matter, radians."""
_FINE = 0.001
"""How exactly patches are looked at, metres."""
_FAR = 8.0
"""Bumps farther from each other than this, in the tool's radii, do not know of each other."""
_LONGEST = 250.0
"""Along a patch longer than so many tool widths there are no bumps."""
_MOST_CUTS = 7
"""How often a patch is halved until one place sweeps each piece."""


def bumps_length(patch: Polygon, tool: float) -> float:
    """How much longer bumps along a patch make a path, about, metres."""
    radius = tool / 2
    length = float(patch.length) / 2
    width = float(patch.area) / max(length, 1e-9)
    return length / (_PITCH * radius) * 2 * (width + (1 - _RISE) * radius)


def long_for_bumps(patch: Polygon, tool: float) -> bool:
    """Whether bumps along a patch are no shorter than to drive along it and back, or too many."""
    radius = tool / 2
    length = float(patch.length) / 2
    if length > _LONGEST * tool:
        return True
    width = float(patch.area) / max(length, 1e-9)
    there_and_back = 2 * max(length - radius, 0.0) + 2 * (radius + width / 2)
    return bumps_length(patch, tool) >= there_and_back


def with_bumps(
    path: Points,
    parts: tuple[PlanPart, ...],
    target: Target,
    space: FreeSpace,
    smallest: float,
    enough: float = 0.0,
    whole_parts: bool = False,
    missed: shapely.Geometry | None = None,
) -> tuple[Points, tuple[PlanPart, ...], float]:
    """The path with bumps to those patches that it misses and that are larger than ``smallest`` m²;
    and about how much it misses then, m².

    ``missed``: what that is, if it is known already.
    ``enough``: the smallest ones are left if all of them together make up no more, m².
    ``whole_parts``: the ends of parts stay where they are.
    """
    missed = target.missed(path) if missed is None else missed
    rest, lost = np.array(polygons(missed), dtype=object), 0.0
    patches = patches_of(missed, smallest)
    for _ in range(2):  # the second time for what bumps themselves have missed
        left = sum(float(patch.area) for patch in patches)
        if left <= enough:
            break
        bumped = _Bumped(path, target, space)
        if whole_parts:
            bumped.keep([part.last for part in parts])
        for patch in sorted(patches, key=lambda p: (-float(p.area), p.bounds)):
            if left <= enough:
                break
            bumped.reach(patch.simplify(_FINE), _MOST_CUTS)
            left -= float(patch.area)
        path, parts = bumped.result(parts)
        rest = bumped.without(rest)
        lost += bumped.lost
        patches = patches_of(rest, smallest)
    return path, parts, float(shapely.area(rest).sum()) + lost


@dataclass(frozen=True, slots=True, eq=False)
class _Bump:
    """A stretch of the path that is replaced."""

    first: float
    """From this length along the path to ``last``, metres."""
    last: float
    tips: Points
    """The places between."""
    line: LineString
    """Through all of them."""

    @property
    def legs(self) -> Points:
        """M x 4: the ends of its straight lines."""
        return _legs(shapely.get_coordinates(self.line))


class _Bumped:
    """A path while bumps are put into it."""

    def __init__(self, path: Points, target: Target, space: FreeSpace) -> None:
        self._path = path
        self._target = target
        self._space = space
        self._radius = target.tool / 2
        self._marks = np.r_[0.0, np.cumsum(np.hypot(*np.diff(path, axis=0).T))]
        self._lines = shapely.linestrings(np.stack([path[:-1], path[1:]], axis=1))
        self._tree = shapely.STRtree(self._lines)
        self._kept_marks = np.zeros(0)
        # For what it sweeps the path is taken with fewer chords.
        few = few_corners(path, CHORD) if len(path) > 2 else np.arange(len(path))
        self._few, self._few_marks = path[few], self._marks[few]
        self._few_legs = _legs(self._few)
        self._few_tree = shapely.STRtree(shapely.linestrings(self._few_legs.reshape(-1, 2, 2)))
        self._bumps: list[_Bump] = []
        self._begins: list[float] = []
        """Where they begin, in order, as lengths along the path; and the same where they end."""
        self._ends: list[float] = []
        self.lost = 0.0
        """About how much the bumps do not sweep any more, m²."""
        self._around: dict[tuple[int, int], list[_Bump]] = {}
        """Those that may be near to a square of the floor."""

    def keep(self, indices: list[int]) -> None:
        """Bumps may not cut across these points of the path."""
        self._kept_marks = self._marks[indices]

    def reach(self, patch: Polygon, cuts: int) -> None:
        """Sweeps a patch by one bump, or by several if it is too long for one."""
        place = standing_place(patch, self._space, self._radius)
        if place is not None:
            self._add(place)
        elif cuts:
            strip = strip_of(patch, _PITCH * self._radius)
            for piece in strip or pieces_of(patch, self._radius):
                if not (strip and self._step_aside(piece)):
                    self.reach(piece, cuts - 1)

    def without(self, rest: Shapes) -> Shapes:
        """What bumps leave of some patches."""
        lines = np.array([bump.line for bump in self._bumps], dtype=object)
        swept = shapely.buffer(lines, self._radius, quad_segs=_ROUND)
        of, bumps = shapely.STRtree(swept).query(rest, predicate="intersects")
        rest = rest.copy()
        for patch in np.flatnonzero(np.bincount(of)).tolist():
            # All at once: a long patch would be cut anew, in whole, for every one of them.
            rest[patch] = rest[patch].difference(shapely.union_all(swept[bumps[of == patch]]))
        return rest

    def _step_aside(self, piece: Polygon) -> bool:
        """Leads a stretch of a straight leg nearer to a piece of a strip beside it."""
        radius = self._radius
        near, _ = self._legs_near(piece, 1.5 * radius)
        middle = shapely.centroid(piece)
        lengths = np.round(shapely.distance(self._lines[near], middle), 5)
        for index in near[np.lexsort((near, lengths))][:4].tolist():
            a, b = self._path[index], self._path[index + 1]
            length = float(self._marks[index + 1] - self._marks[index])
            if length < _PITCH * radius / 2:
                continue
            along = (b - a) / length
            beside = np.array([-along[1], along[0]])
            corners = shapely.get_coordinates(piece) - a
            across = corners @ beside
            if across.mean() < 0:
                beside, across = -beside, -across
            depth = float(across.max()) - radius * _RISE
            at = float(np.ptp(corners @ along) / 2 + (corners @ along).min())
            half = _PITCH * radius / 4
            if not half <= at <= length - half or depth <= 0:
                continue
            first = float(self._marks[index]) + at - half
            last = first + 2 * half
            if self._taken(first, last):
                continue
            tips = np.vstack([a + along * (at - half), a + along * (at + half)]) + depth * beside
            left = piece.difference(LineString(tips).buffer(radius, quad_segs=_ROUND)).area
            if left < _LOSS * (radius / 0.2) ** 2 and self._try(first, last, tips, 4.0):
                return True
        return False

    def _legs_near(self, shape: shapely.Geometry, most: float) -> tuple[NDArray[np.intp], Points]:
        """Which legs of the path are no farther than ``most`` from a shape, and how far."""
        x0, y0, x1, y1 = shape.bounds
        near = self._tree.query(shapely.box(x0 - most, y0 - most, x1 + most, y1 + most))
        lengths = shapely.distance(self._lines[near], shape)
        return near[lengths <= most], lengths[lengths <= most]

    def _taken(self, first: float, last: float) -> bool:
        """Whether a stretch of the path holds another bump, or a point that stays."""
        index = bisect_left(self._begins, last)  # bumps do not overlap each other
        if index and self._ends[index - 1] > first:
            return True
        return bool(((self._kept_marks > first) & (self._kept_marks < last)).any())

    def _near(self, x: float, y: float) -> list[_Bump]:
        """The bumps whose first tip is not far from a place."""
        return self._around.get(self._square(x, y), [])

    def _square(self, x: float, y: float) -> tuple[int, int]:
        side = _FAR * self._radius
        return math.floor(x / side), math.floor(y / side)

    def _put(self, bump: _Bump) -> None:
        self._bumps.append(bump)
        at = bisect_left(self._begins, bump.first)
        self._begins.insert(at, bump.first)
        self._ends.insert(at, bump.last)
        column, row = self._square(*bump.tips[0].tolist())
        for square in itertools.product(range(column - 1, column + 2), range(row - 1, row + 2)):
            self._around.setdefault(square, []).append(bump)

    def _add(self, place: shapely.Geometry) -> None:
        """Puts in a bump that touches ``place``, where that costs least."""
        x0, y0, x1, y1 = shapely.bounds(place).tolist()
        others = [bump.line for bump in self._near((x0 + x1) / 2, (y0 + y1) / 2)]
        if others and shapely.intersects(np.array(others), place).any():
            return  # an earlier bump does that
        for reach in (1.0, 4.0):
            near, lengths = self._legs_near(place, reach * self._radius)
            lines = (
                (index, shapely.shortest_line(self._lines[index], place))
                for index in near[np.lexsort((near, np.round(lengths, 6)))].tolist()
            )
            free = next(((index, line) for index, line in lines if self._space.holds(line)), None)
            if free is not None:
                break
        else:
            return
        index, line = free
        foot, tip = shapely.get_coordinates(line)
        if math.dist(foot, tip) < 1e-6:
            return
        at = float(self._marks[index] + math.dist(self._path[index], foot))
        for reach in (1.0, 0.5, 0.25, 0.0):
            first, last = at - reach * self._radius, at + reach * self._radius
            if first < 0 or last > self._marks[-1]:
                continue
            if self._taken(first, last):
                continue
            if self._try(first, last, tip[None]):
                return

    def _try(self, first: float, last: float, tips: Points, losses: float = 1.0) -> bool:
        """Puts a bump by way of ``tips`` in if nothing that counts is lost by it."""
        old = self._stretch(first, last)
        new = np.vstack([old[0], tips, old[-1]])
        if not self._space.holds_points(new):
            return False
        most = losses * _LOSS * (self._radius / 0.2) ** 2
        line = LineString(new)
        lost = self._lost(new, first, last) if last - first > 1e-9 else 0.0
        if lost > most:
            return False
        self.lost += lost
        self._put(_Bump(first, last, tips, line))
        return True

    def _lost(self, new: Points, first: float, last: float) -> float:
        """About how much is swept no more if the path goes along ``new`` from ``first`` to
        ``last``, m²; by looking at many small pieces."""
        begin, end = np.searchsorted(self._few_marks, [first + 1e-9, last - 1e-9])
        old = np.vstack([new[0], self._few[begin:end], new[-1]])
        spots, sizes = _pieces_along(old, self._radius)
        lost = _away(spots, _legs(new), self._radius)
        if not lost.any():
            return 0.0
        spots, sizes = spots[lost], sizes[lost]
        lost = _away(spots, self._legs_around(spots, first, last), self._radius)
        if not lost.any():
            return 0.0
        return float(sizes[lost][self._target.holds(spots[lost])].sum())

    def _legs_around(self, spots: Points, first: float, last: float) -> Points:
        """M x 4: straight lines from which the tool may sweep one of the spots, if the path is not
        driven from ``first`` to ``last``; with bumps instead of what they replace."""
        low, high = spots.min(axis=0) - self._radius, spots.max(axis=0) + self._radius
        whole: list[int] = []
        kept: list[Points] = []
        for index in self._few_tree.query(shapely.box(*low, *high)).tolist():
            begin, end = self._within(index, low, high)
            at = bisect_right(self._ends, begin)
            if not (begin < last and first < end) and not (
                at < len(self._begins) and self._begins[at] < end
            ):
                whole.append(index)
                continue
            stops = [(first, last)]
            while at < len(self._begins) and self._begins[at] < end:
                stops.append((self._begins[at], self._ends[at]))
                at += 1
            for stop, go in sorted(stops):
                if begin < min(stop, end):
                    kept.append(self._part(index, begin, min(stop, end)))
                begin = max(begin, go)
            if begin < end:
                kept.append(self._part(index, begin, end))
        x, y = ((low + high) / 2).tolist()
        for bump in self._near(x, y):
            x0, y0, x1, y1 = bump.line.bounds
            if x0 < high[0] and x1 > low[0] and y0 < high[1] and y1 > low[1]:
                kept.append(bump.legs)
        return np.vstack([self._few_legs[whole], *kept])

    def _within(self, index: int, low: Points, high: Points) -> tuple[float, float]:
        """Between which lengths along the path a leg with few corners is in a box. A long one has
        bumps all along, and only those in the box matter there."""
        first, last = float(self._few_marks[index]), float(self._few_marks[index + 1])
        shares = [0.0, 1.0]
        for a, b, least, most in zip(
            *self._few[index : index + 2].tolist(), low.tolist(), high.tolist(), strict=True
        ):
            if a != b:
                begin, end = sorted(((least - a) / (b - a), (most - a) / (b - a)))
                shares = [max(shares[0], begin), min(shares[1], end)]
        begin, end = (first + share * (last - first) for share in shares)
        return begin, max(begin, end)

    def _part(self, index: int, begin: float, end: float) -> Points:
        """1 x 4: a part of a leg with few corners, between lengths along the path."""
        first, last = self._few_marks[index], self._few_marks[index + 1]
        a, b = self._few[index], self._few[index + 1]
        shares = (np.array([begin, end]) - first) / max(last - first, 1e-12)
        return np.asarray((a + shares[:, None] * (b - a)).reshape(1, 4))

    def _at(self, mark: float) -> Points:
        index = min(max(bisect_left(self._marks, mark), 1), len(self._marks) - 1)
        before, after = float(self._marks[index - 1]), float(self._marks[index])
        share = (mark - before) / (after - before) if after > before else 0.0
        a, b = self._path[index - 1], self._path[index]
        return np.asarray(a + min(max(share, 0.0), 1.0) * (b - a))

    def _stretch(self, first: float, last: float) -> Points:
        begin, end = np.searchsorted(self._marks, [first + 1e-9, last - 1e-9])
        return np.vstack([self._at(first), self._path[begin:end], self._at(last)])

    def result(self, parts: tuple[PlanPart, ...]) -> tuple[Points, tuple[PlanPart, ...]]:
        """The path with all bumps, and its parts."""
        points: list[Points] = []
        marks: list[float] = []
        at = 0
        for bump in sorted(self._bumps, key=lambda bump: (bump.first, bump.last)):
            first, last, tips = bump.first, bump.last, bump.tips
            stop = int(np.searchsorted(self._marks, first - 1e-9))
            points += list(self._path[at:stop])
            marks += self._marks[at:stop].tolist()
            points += [self._at(first), *tips, self._at(last)]
            marks += [first, *[(first + last) / 2] * len(tips), last]
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


def _legs(line: Points) -> Points:
    """M x 4: where each straight piece of a line begins and ends."""
    return np.hstack([line[:-1], line[1:]])


def _pieces_along(line: Points, radius: float) -> tuple[Points, Points]:
    """What a disc sweeps beside a line, in small pieces: their middles, and their areas, m²."""
    steps = np.diff(line, axis=0)
    lengths = np.hypot(*steps.T)
    some = lengths > 1e-9
    line, steps, lengths = line[:-1][some], steps[some], lengths[some]
    counts = np.ceil(lengths / (_STEP * radius)).astype(np.intp)
    rows = np.repeat(np.arange(len(steps)), counts)
    place = np.arange(len(rows)) - np.repeat(np.cumsum(counts) - counts, counts)
    feet = line[rows] + ((place + 0.5) / counts[rows])[:, None] * steps[rows]
    beside = (steps / lengths[:, None])[rows][:, ::-1] * (-1.0, 1.0)
    wide = (lengths / counts)[rows]
    out, thick = radius * _OUT, radius * _THICK
    sizes = wide[:, None] * thick
    aside = out[:, None] * beside[:, None]
    spots = np.concatenate([feet[:, None] + aside, feet[:, None] - aside])
    sizes = np.concatenate([sizes, sizes])
    if len(steps) > 1:
        headings = np.arctan2(steps[:, 1], steps[:, 0])
        turns = (np.diff(headings) + math.pi) % math.tau - math.pi
        counts = np.ceil(np.abs(turns) / _TURN).astype(np.intp)
        rows = np.repeat(np.arange(len(turns)), counts)
        place = np.arange(len(rows)) - np.repeat(np.cumsum(counts) - counts, counts)
        turn = (turns / np.maximum(counts, 1))[rows]
        across = headings[rows] + (place + 0.5) * turn - np.copysign(math.pi / 2, turn)
        corner = np.stack([np.cos(across), np.sin(across)], axis=1)
        more = line[rows + 1][:, None] + out[:, None] * corner[:, None]
        spots = np.concatenate([spots, more])
        sizes = np.concatenate([sizes, np.abs(turn)[:, None] * (out * thick)])
        if np.abs(turns).max() > _SHARP:
            # On the inner side of a corner a spot belongs to the leg that is nearest to it.
            depths = np.broadcast_to(out - 1e-6, sizes.shape).ravel()
            own = _away(spots.reshape(-1, 2), np.hstack([line, line + steps]), depths)
            return spots.reshape(-1, 2)[own], sizes.ravel()[own]
    return spots.reshape(-1, 2), sizes.ravel()


def _away(spots: Points, legs: Points, radius: float | Points) -> NDArray[np.bool_]:
    """Which of N x 2 spots are farther than ``radius``, of all or of each, from all straight lines,
    M x 4."""
    # Coordinate by coordinate: sums over pairs take numpy longer than all the rest.
    x0, y0, x1, y1 = legs.T
    dx, dy = x1 - x0, y1 - y0
    squared = np.maximum(dx * dx + dy * dy, 1e-18)
    x, y = spots[:, :1] - x0, spots[:, 1:] - y0
    share = ((x * dx + y * dy) / squared).clip(0.0, 1.0)
    x -= share * dx
    y -= share * dy
    return np.asarray((x * x + y * y).min(axis=1, initial=np.inf) > np.square(radius))
