"""Patches of floor that a path missed: where the tool stands for them, and cut to its size."""

from __future__ import annotations

import math

import numpy as np
import shapely
from numpy.typing import NDArray
from shapely import Polygon

from polepilot.core.planning.space import FreeSpace, polygons

Points = NDArray[np.float64]
Shapes = NDArray[np.object_]

SLIVER = 0.002
"""What is thinner than twice this is left, metres."""
_TIP = 0.03
"""Of a patch so much, as a share of the tool's radius, may be left along its outline."""
_ROUND = 12
"""Segments per quarter turn of a disc."""
_ANGLES = np.arange(4 * _ROUND + 1) % (4 * _ROUND) * (math.pi / 2 / _ROUND)
_CIRCLE = np.stack([np.cos(_ANGLES), np.sin(_ANGLES)], axis=1)


def patches_of(
    missed: shapely.Geometry | Shapes, smallest: float, sliver: float = SLIVER
) -> list[Polygon]:
    """The parts of at least ``smallest`` m², without what is thinner than twice ``sliver``."""
    large = [part for part in polygons(missed) if part.area >= smallest]
    thick = shapely.buffer(large, -sliver, quad_segs=2)
    opened = shapely.buffer(thick, sliver, quad_segs=2)
    return [part for part in polygons(opened) if part.area >= smallest]


def standing_place(patch: Polygon, space: FreeSpace, radius: float) -> shapely.Geometry | None:
    """Where the middle of a tool of ``radius`` may be to sweep all of a patch; None: nowhere."""
    x0, y0, x1, y1 = patch.bounds
    small = math.hypot(x1 - x0, y1 - y0) < 2 * radius
    if not small and shapely.minimum_bounding_radius(patch) >= radius:
        return None
    core = patch.buffer(-_TIP * radius, quad_segs=2)
    hull = shapely.convex_hull(patch if core.is_empty else core).simplify(0.001)
    corners = shapely.get_coordinates(hull)[:-1]
    discs = corners[:, None] + (radius - 0.0005) * _CIRCLE
    place = shapely.intersection_all(shapely.polygons(discs))
    if not space.holds(place):
        place = shapely.intersection(place, space.polygon)
    return None if place.is_empty else place


def _box(patch: Polygon) -> tuple[Points, Points, Points] | None:
    """A corner, the long side and the short side of the smallest box around a patch."""
    box = shapely.minimum_rotated_rectangle(patch)
    if not isinstance(box, Polygon):
        return None
    corners = shapely.get_coordinates(box)
    if np.hypot(*(corners[1] - corners[0])) < np.hypot(*(corners[2] - corners[1])):
        corners = np.vstack([corners[1:], corners[1:2]])
    return corners[0], corners[1] - corners[0], corners[2] - corners[1]


def _sliced(patch: Polygon, count: int) -> list[Polygon]:
    """A patch cut across its long side into pieces of equal length."""
    box = _box(patch)
    if box is None:
        return []
    corner, along, across = box
    cuts = corner + np.linspace(0, 1, count + 1)[:, None] * along
    rings = np.stack([cuts[:-1], cuts[1:], cuts[1:] + across, cuts[:-1] + across], axis=1)
    parts = shapely.intersection(patch, shapely.polygons(rings))
    return [part for part in polygons(parts) if part.area > 1e-5]


def strip_of(patch: Polygon, pitch: float) -> list[Polygon]:
    """A straight strip in pieces of about ``pitch``; empty: it is none."""
    box = _box(patch)
    if box is None:
        return []
    length, width = (float(np.hypot(*side)) for side in box[1:])
    if length < 1.2 * pitch or width > pitch or patch.area < 0.6 * length * width:
        return []
    return _sliced(patch, math.ceil(length / pitch))


def pieces_of(patch: Polygon, radius: float) -> list[Polygon]:
    """A patch cut across its longest direction, so that bumps to its pieces are short."""
    box = _box(patch)
    if box is None:
        return []
    length, width = (float(np.hypot(*side)) for side in box[1:])
    counts = np.arange(2, max(3, math.ceil(4 * length / radius)))
    half = length / counts / 2
    fits = half**2 + width**2 / 4 < (0.98 * radius) ** 2
    cost = counts * (width + radius - np.sqrt(np.maximum(radius**2 - half**2, 0.0)))
    count = int(counts[np.argmin(np.where(fits, cost, np.inf))]) if fits.any() else 2
    return _sliced(patch, count)
