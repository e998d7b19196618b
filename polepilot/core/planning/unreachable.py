"""Floor that the robot's size keeps it out of, as polygons with a reason."""

from __future__ import annotations

import numpy as np
import shapely
import shapely.ops
from shapely import LineString, MultiPolygon, Polygon
from shapely.geometry.base import BaseGeometry

from polepilot.core.geometry import Polyline
from polepilot.core.plan import Unreachable
from polepilot.core.planning.space import FreeSpace, polygons
from polepilot.core.planning.wording import in_words

SMALLEST = 0.05
"""Smaller pieces are not mentioned, m²."""
_CRUMB = 0.01
"""What a thin wall cuts off is left out if it is smaller than this share of the whole."""
_SLIVER = 0.0006
_GRID = 1e-4
_HALVINGS = 9
"""How often the span in which the width of a passage lies is halved."""
_PLAY = 0.001
"""Passages that are narrower than the robot by less than this are as wide as the robot, m."""
_MOST_REASONS = 25
"""The largest pieces are looked into one by one; a map with more has other problems."""


def unreachable_pieces(space: FreeSpace, reachable: MultiPolygon) -> tuple[Unreachable, ...]:
    """The floor that ``reachable`` leaves, piece by piece, the largest first; rings are split."""
    walls = space.lines.buffer(0.0002) if not space.lines.is_empty else space.lines
    rest = space.floor.difference(reachable.buffer(_SLIVER))
    parts: list[tuple[Polygon, Polygon]] = []
    for large in (piece for piece in polygons(rest) if piece.area >= SMALLEST * 0.8):
        whole = _grown(large, space, reachable)
        if whole.area < SMALLEST:
            continue
        if walls.disjoint(large):
            parts.append((large, whole))
            continue
        # On both sides of a thin wall there may be parts of one that is large enough only whole.
        least = min(SMALLEST / 5, _CRUMB * large.area)
        halves = polygons(large.difference(walls))
        parts += [(p, _grown(p, space, reachable)) for p in halves if p.area >= least]
    pieces: list[tuple[Polygon, str]] = []
    passages = _Passages(space)
    for index, (_, whole) in enumerate(sorted(parts, key=lambda entry: -float(entry[0].area))):
        if index < _MOST_REASONS:
            reason = passages.reason(whole)
        else:
            reason = f"the robot needs {in_words(2 * space.clearance)} of width to get in"
        pieces += [(simple, reason) for simple in _on_grid(whole)]
    return tuple(
        Unreachable(_ring(piece), reason)
        for piece, reason in pieces
        if piece.area >= _CRUMB * SMALLEST
    )


def _grown(part: Polygon, space: FreeSpace, reachable: MultiPolygon) -> Polygon:
    """A part with what was taken of it against slivers, but nothing of what is reachable."""
    grown = _valid(part.buffer(_SLIVER, join_style="mitre"))
    floor, taken = (
        _valid(shapely.clip_by_rect(shape, *grown.bounds)) for shape in (space.floor, reachable)
    )
    left = polygons(grown.intersection(floor).difference(taken))
    return max(left or [part], key=lambda p: float(p.area))


def _valid(shape: BaseGeometry) -> BaseGeometry:
    """Areas whose rings do not cross: mitred corners may, and so may what is clipped by a box."""
    return shapely.make_valid(shape, method="structure", keep_collapsed=False)


class _Passages:
    """How wide the way to a piece is, from free spaces for smaller robots."""

    def __init__(self, space: FreeSpace) -> None:
        self._space = space
        self._levels: dict[float, list[Polygon]] = {}

    def reason(self, piece: Polygon) -> str:
        needed = 2 * self._space.clearance
        need = f"the robot needs {in_words(needed)}"
        inner = [other for other in self._space.others if other.intersects(piece)]
        if not inner:
            circle = shapely.maximum_inscribed_circle(piece, tolerance=0.01)
            width = 2 * float(circle.length)
            if width < needed:
                return _compared("only {} wide", width, needed)
            return f"too narrow to get in; {need} and a little play"
        target = max(inner, key=lambda p: float(p.area)).representative_point()
        home = self._space.polygon.representative_point()
        low, high = 0.004, self._space.clearance
        if not self._joined(low, target, home):
            return "enclosed: no opening leads there"
        for _ in range(_HALVINGS):
            middle = round((low + high) / 2, 4)
            if self._joined(middle, target, home):
                low = middle
            else:
                high = middle
        return _compared("behind a passage of {}", 2 * low, needed)

    def _joined(self, clearance: float, a: shapely.Point, b: shapely.Point) -> bool:
        """Whether a robot of that clearance gets from ``a`` to ``b``."""
        if clearance not in self._levels:
            free = self._space.floor.buffer(-clearance, quad_segs=4)
            if not self._space.lines.is_empty:
                free = free.difference(self._space.lines.buffer(clearance, quad_segs=4))
            self._levels[clearance] = polygons(free)
        return any(part.intersects(a) and part.intersects(b) for part in self._levels[clearance])


def _compared(what: str, width: float, needed: float) -> str:
    """What has a width that is not enough, and which one is needed, in words that differ."""
    need = f"the robot needs {in_words(needed)}"
    if needed - width < _PLAY:
        return f"{what.format(in_words(needed))}; {need} and a little play"
    shown = in_words(round(width, 2 if needed - width > 0.01 else 3))
    return f"{what.format(shown)}; {need}"


def _without_holes(piece: Polygon) -> list[Polygon]:
    """A polygon with holes, cut through each hole's middle until no hole is left."""
    done: list[Polygon] = []
    pending = [piece]
    while pending:
        part = pending.pop()
        if not part.interiors:
            done.append(part)
            continue
        _, y0, _, y1 = part.bounds
        x = float(Polygon(part.interiors[0]).representative_point().x)
        cut = LineString([(x, y0 - 1), (x, y1 + 1)])
        halves = polygons(shapely.ops.split(part, cut))
        if len(halves) < 2:
            done.append(Polygon(part.exterior))
            continue
        pending += halves
    return done


def _on_grid(piece: Polygon) -> list[Polygon]:
    """A polygon without holes whose corners are whole multiples of ``_GRID``.

    Rounding corner by corner would let the two sides of a slit along a wall cross.
    """
    parts = _without_holes(piece.simplify(0.0005))
    for _ in range(3):
        parts = [q for part in parts for q in polygons(shapely.set_precision(part, _GRID))]
        if not any(part.interiors for part in parts):
            break
        parts = [half for part in parts for half in _without_holes(part)]
    return parts


def _ring(piece: Polygon) -> Polyline:
    points = np.asarray(piece.exterior.coords, dtype=float)[:-1, :2]
    return tuple((round(float(x), 4), round(float(y), 4)) for x, y in points)
