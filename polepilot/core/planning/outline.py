"""Outlines with few corners, inside of those that were traced by hand or by a scanner.

A wheel follows few corners better than many: each bend of a trembling line would cost it a
manoeuvre. Each side of the new outline touches the old one from inside, so that it is nowhere
outside of it.
"""

from __future__ import annotations

import numpy as np
import shapely
from numpy.typing import NDArray
from shapely import LineString, MultiPolygon, Polygon

from polepilot.core.planning.footprint import calmed
from polepilot.core.planning.space import (
    CHORD,
    MARGIN,
    FreeSpace,
    as_multi,
    footprint,
    free_poles,
    polygons,
)
from polepilot.core.site import Site

Points = NDArray[np.float64]

_TREMBLE = (0.03, 0.02, 0.015, 0.01)
"""How far corners may be from a side that stands for them, as shares of the tool's width; the
first that does not give away too much."""
_GIVEN = 0.0021
"""So much of the area at most."""
_MANY = 60
"""Outlines with fewer corners stay as they are."""
_FEWER = 0.5
"""And so do those of which more than this share of the corners would remain."""
_STRAIGHT = 0.02
"""Sides that turn by less than this meet half-way, radians."""


def wheel_outlines(
    site: Site, space: FreeSpace, wanted: MultiPolygon, tool: float
) -> tuple[list[Polygon], MultiPolygon]:
    """Outlines in the free space that a wheel can follow, and what of ``wanted`` they do not give
    up: of a trembling wall not every recess is swept."""
    mitred = [smoothed(piece, tool) for piece in _mitred(site, space)]
    traced = smoothed(space.polygon, tool)
    if traced is space.polygon or _corners([traced]) > _corners(mitred):
        return mitred, wanted
    ground = footprint(space.clearance).ground(traced)
    return [traced], as_multi(shapely.intersection(wanted, ground))


def _corners(pieces: list[Polygon]) -> int:
    return int(shapely.get_num_coordinates(pieces).sum())


def _mitred(site: Site, space: FreeSpace) -> list[Polygon]:
    """The free space with corners instead of arcs around obstacles: fewer turns for a wheel.

    It is a part of the free space; in tight places it is less than that.
    """
    radius = space.clearance + MARGIN
    floor, rest = calmed(space.floor, radius, CHORD)
    sharp = floor.buffer(-rest, join_style="mitre", mitre_limit=2.0)
    things = [LineString(wall) for wall in site.walls]
    if things:
        boxes = shapely.buffer(
            np.array(things), radius, cap_style="square", join_style="mitre", mitre_limit=2.0
        )
        sharp = sharp.difference(shapely.union_all(boxes))
    poles = free_poles(site)
    if poles:
        squares = shapely.buffer(shapely.points(poles), radius, cap_style="square")
        sharp = sharp.difference(shapely.union_all(squares))
    inside = shapely.intersection(sharp, space.polygon)
    return [piece for piece in polygons(inside) if piece.area > 1e-4]


def smoothed(polygon: Polygon, tool: float) -> Polygon:
    """A polygon inside of this one that has far fewer corners; itself where there is none."""
    rings = [polygon.exterior, *polygon.interiors]
    count = int(shapely.get_num_coordinates(polygon))
    if count < _MANY:
        return polygon
    around = polygon.buffer(1e-6)
    for share in _TREMBLE:
        lines = [
            _sides(_inside_left(ring, index == 0), share * tool) for index, ring in enumerate(rings)
        ]
        if sum(map(len, lines)) > _FEWER * count or min(map(len, lines)) < 3:
            continue
        inner = Polygon(lines[0], lines[1:])
        if inner.is_valid and inner.area >= (1 - _GIVEN) * polygon.area and around.covers(inner):
            return inner
    return polygon


def _inside_left(ring: shapely.LinearRing, outer: bool) -> Points:
    """The corners of a ring in the order in which the polygon lies to the left, the first again at
    the end; it begins at a corner that will stay."""
    points = np.asarray(ring.coords, dtype=float)[:-1, :2]
    if ring.is_ccw != outer:
        points = points[::-1]
    farthest = int(np.argmax(np.hypot(*(points - points.mean(axis=0)).T)))
    points = np.roll(points, -farthest, axis=0)
    return np.vstack([points, points[:1]])


def _sides(points: Points, tremble: float) -> Points:
    """The corners of an outline with few sides, each as far inside as its points ask for."""
    line = LineString(np.column_stack([points, np.arange(len(points))]))
    few = shapely.simplify(line, tremble, preserve_topology=False)
    knots = np.round(shapely.get_coordinates(few, include_z=True)[:, 2]).astype(np.intp)
    if len(knots) < 4:
        return np.zeros((0, 2))
    begins = points[knots[:-1]]
    along = points[knots[1:]] - begins
    along /= np.hypot(*along.T)[:, None]
    inward = np.stack([-along[:, 1], along[:, 0]], axis=1)
    side = np.repeat(np.arange(len(begins)), np.diff(knots))
    depths = ((points[:-1] - begins[side]) * inward[side]).sum(axis=1)
    depth = np.maximum.reduceat(depths, knots[:-1])
    # A corner is where a side meets the one before it.
    earlier = np.roll(np.arange(len(begins)), 1)
    cross = along[earlier, 0] * along[:, 1] - along[earlier, 1] * along[:, 0]
    flat = np.abs(cross) < _STRAIGHT
    back = begins + depth[:, None] * inward
    other = begins + depth[earlier, None] * inward[earlier]
    gap = other - back
    way = (along[earlier, 0] * gap[:, 1] - along[earlier, 1] * gap[:, 0]) / np.where(flat, 1, cross)
    middle = begins + np.maximum(depth, depth[earlier])[:, None] * inward
    return np.asarray(np.where(flat[:, None], middle, back + way[:, None] * along))
