"""Nested offset loops of the free space, and the strokes that sweep what loops leave."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
import shapely
from numpy.typing import NDArray
from shapely import LineString, MultiPolygon, Polygon

from polepilot.core.planning.patches import patches_of
from polepilot.core.planning.space import FreeSpace, polygons, quadrant

Points = NDArray[np.float64]

OVERLAP = 0.06
"""Neighbouring passes overlap by at least this share of the tool width."""
_MOST_CUTS = 8
"""How often a bent patch is halved before it is taken as it is."""
_COARSE = 0.0005
"""How far an outermost loop of many corners is taken inside to have fewer, m."""
_FINE = 0.005
_SLIVER = 0.004
"""What is thinner than twice this gets no pass, m."""
_THIN = 0.1
"""What loops leave in a piece is driven once, not around, if it is thinner than this share of the
tool width. A piece that is thin as a whole has an outline all the same: that is shorter."""


@dataclass(slots=True, eq=False)
class Stroke:
    """A line to be driven for what it sweeps: a closed loop, or an open clean-up pass.

    ``points``: N x 2; of a loop, counter-clockwise, the first not repeated.
    """

    points: Points
    closed: bool
    depth: int
    """0 for the outermost loops, -1 for clean-up passes."""

    @property
    def track(self) -> Points:
        """The points as they are driven: of a loop, the first again at the end."""
        return np.vstack([self.points, self.points[:1]]) if self.closed else self.points

    @property
    def line(self) -> LineString:
        return LineString(self.track)


@dataclass(slots=True, eq=False)
class Nest:
    """Nested loops, and the shapes whose outlines they are."""

    loops: list[Stroke]
    shapes: list[MultiPolygon]
    inside: list[int]
    """Inside of which of the shapes each is; -1: it is an outermost one."""

    def missed(self, area: shapely.Geometry, tool: float, quad_segs: int) -> MultiPolygon:
        """What a tool misses of an area if it is driven along all loops, to a millimetre or two.

        Between a loop and those inside of it nothing else is swept, so no pieces of tracks have to
        be united. ``quad_segs``: chords per quarter of a circle.
        """
        shapes = np.array(self.shapes, dtype=object)
        filled = shapely.buffer(shapes, tool / 2, quad_segs=quad_segs)
        hollow = shapely.buffer(shapes, -tool / 2, quad_segs=quad_segs)
        left: list[Polygon] = []
        inside = np.array(self.inside)
        order = np.argsort(inside, kind="stable")
        ends = np.searchsorted(inside[order], np.arange(-1, len(shapes)), side="right")
        for index, shape in enumerate([area, *hollow], -1):
            first, last = (0 if index < 0 else ends[index]), ends[index + 1]
            children = filled[order[first:last]]
            if not shape.is_empty:
                rest = shape.difference(shapely.union_all(children)) if len(children) else shape
                left += polygons(rest)
        return MultiPolygon(left)


def nested_loops(
    pieces: list[Polygon],
    tool_width: float,
    tolerance: float,
    closer: float = 1.0,
    overlap: float = OVERLAP,
) -> Nest:
    """The outlines of ``pieces``, and loops inside of them a little less than a tool width apart.

    ``tolerance``: how far inner loops may be from the exact offset, metres, where that saves
    vertices; the outermost ones are exact. ``closer``: loops may lie this
    many times their largest distance apart, or 0: as it fits the widest place best. ``overlap``:
    of neighbours, as a share of the tool's width; below ``OVERLAP`` loops are round about corners
    that point into the free space, which leaves nothing between them there.
    """
    if overlap < OVERLAP:
        joins: dict[str, Any] = {"join_style": "round"}
    else:
        joins = {"join_style": "mitre", "mitre_limit": 1.5}
    nest = Nest([], [], [])
    for piece in pieces:
        largest = tool_width * (1 - overlap)
        step = closer * largest if closer > 0 else _fitted_step(piece, tool_width, largest)
        level = [(piece, -1)]
        depth = 0
        while level:
            following: list[tuple[Polygon, int]] = []
            for polygon, outside in level:
                if depth == 0 or not polygon.buffer(-_THIN * tool_width / 2).is_empty:
                    driven = _driven(polygon, depth, tolerance)
                    nest.loops += _rings(driven, depth)
                    nest.shapes.append(MultiPolygon(driven))
                    nest.inside.append(outside)
                    inner = polygon.buffer(-step, quad_segs=quadrant(step, 0.0005), **joins)
                    following += [
                        (part.simplify(0.0005), len(nest.shapes) - 1)
                        for part in polygons(inner)
                        if part.area > 1e-4
                    ]
            level = [entry for entry in following if entry[0].is_valid and not entry[0].is_empty]
            depth += 1
    return nest


def _corner_count(shape: shapely.Geometry) -> int:
    return int(shapely.get_num_coordinates(shape))


def _fitted_step(piece: Polygon, tool_width: float, largest: float) -> float:
    """The distance between loops that lets them end well in the widest place of the piece."""
    widest = float(shapely.maximum_inscribed_circle(piece, tolerance=0.01).length)
    inside = widest - tool_width / 2 + 0.005
    if inside <= 0:
        return largest
    return max(0.75 * largest, inside / math.ceil(inside / largest))


def _driven(polygon: Polygon, depth: int, tolerance: float) -> list[Polygon]:
    """A polygon with fewer corners where it need not be exact."""
    if depth == 0:
        inner = polygon
        few = polygon.buffer(-_COARSE, join_style="mitre").simplify(_COARSE)
        if tolerance > _FINE and _corner_count(few) < _corner_count(polygon) / 2:
            inner = few  # a wheel follows few corners better than many
    else:
        inner = polygon.simplify(tolerance)
    return polygons(polygon if inner.is_empty or not inner.is_valid else inner)


def _rings(driven: list[Polygon], depth: int) -> list[Stroke]:
    found: list[Stroke] = []
    for part in driven:
        for ring in (part.exterior, *part.interiors):
            points = np.asarray(ring.coords, dtype=float)[:-1, :2]
            if len(points) >= 3 and ring.length > 0.02:
                found.append(Stroke(points if ring.is_ccw else points[::-1].copy(), True, depth))
    return found


def cleanup_strokes(
    missed: shapely.Geometry, tool_width: float, space: FreeSpace, smallest: float
) -> list[Stroke]:
    """Passes along the patches of ``missed`` that are larger than ``smallest`` m²."""
    strokes: list[Stroke] = []
    pending = [(patch, _MOST_CUTS) for patch in patches_of(missed, smallest, _SLIVER)]
    while pending:
        patch, cuts = pending.pop()
        box = shapely.minimum_rotated_rectangle(patch)
        if not isinstance(box, Polygon):
            continue
        corners = np.asarray(box.exterior.coords, dtype=float)
        if np.hypot(*(corners[1] - corners[0])) < np.hypot(*(corners[2] - corners[1])):
            corners = np.vstack([corners[1:], corners[1:2]])
        along, across = corners[1] - corners[0], corners[2] - corners[1]
        length, width = float(np.hypot(*along)), float(np.hypot(*across))
        if width > 0.9 * tool_width and cuts:
            if length > 1.5 * width and patch.area > 0.85 * tool_width * length:
                middle = corners[0] + across / 2  # passes side by side
                cut = Polygon([corners[0], corners[1], middle + along, middle])
            else:
                middle = (corners[0] + corners[1]) / 2
                cut = Polygon([corners[0], middle, middle + across, corners[0] + across])
            pending += [
                (part, cuts - 1)
                for half in (patch.intersection(cut), patch.difference(cut))
                for part in polygons(half)
                if part.area > smallest / 4
            ]
            continue
        strokes += _center_line(patch, corners[0], along, across, length, width, tool_width, space)
    return strokes


def _center_line(
    patch: Polygon,
    corner: Points,
    along: Points,
    across: Points,
    length: float,
    width: float,
    tool_width: float,
    space: FreeSpace,
) -> list[Stroke]:
    """The pass along the middle of a narrow patch, as far as the centre may go there."""
    inset = math.sqrt(max(tool_width**2 - width**2, 0.0)) / 2
    inset = min(0.9 * inset, length / 2 - 0.025) if length > 0.05 else 0.0
    unit = along / max(length, 1e-9)
    first = corner + across / 2 + unit * inset
    last = corner + along + across / 2 - unit * inset
    inside = shapely.intersection(LineString([first, last]), space.polygon)
    found = [
        Stroke(np.asarray(part.coords, dtype=float)[:, :2], False, -1)
        for part in shapely.get_parts(inside).tolist()
        if isinstance(part, LineString) and part.length > 0.02
    ]
    if found:
        return found
    center = patch.representative_point()
    x, y = space.nearest((float(center.x), float(center.y)))
    if math.dist((x, y), (center.x, center.y)) > tool_width / 2:
        return []  # the tool gets no nearer
    for turn in range(8):
        angle = turn * math.pi / 4
        there = np.array([[x, y], [x + 0.03 * math.cos(angle), y + 0.03 * math.sin(angle)]])
        if space.holds_points(there):
            return [Stroke(there, False, -1)]
    return []
