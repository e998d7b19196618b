"""The floor that a tool has swept: exactly for predictions, on a raster for the robot's tick."""

from __future__ import annotations

import math

import numpy as np
import shapely
from numpy.typing import NDArray
from shapely import MultiPolygon

from polepilot.core.geometry import Point

_SHIFT = 6
"""Fractional bits of OpenCV's drawing coordinates."""
_CHORD = 0.0003
"""How far the chords of a path's arcs may be from it, metres."""
_CORNER = 0.3
"""Where a path turns by more than this it has a corner, radians."""
_MOST_CELLS = 30_000_000
SMALLEST_PATCH = 0.01
"""A missed patch smaller than this is not worth a visit, m²."""


def swept_shape(
    path: NDArray[np.float64], tool_width: float, quad_segs: int = 16
) -> shapely.Geometry:
    """What a disc of diameter ``tool_width`` sweeps along N x 2 points.

    A rectangle per segment and a sector per corner, united: buffering the whole line overstates
    coverage. ``quad_segs``: chords per quarter of a circle.
    """
    radius = tool_width / 2
    path = path[np.r_[True, np.hypot(*np.diff(path, axis=0).T) > 1e-9]]
    path = path[few_corners(path)]
    ends = shapely.buffer(shapely.points(path[[0, -1]]), radius, quad_segs=quad_segs)
    if len(path) < 2:
        return shapely.union_all(ends)
    pieces = np.concatenate([ends, swept_pieces(path, radius, quad_segs)])
    try:
        return shapely.union_all(pieces)
    except shapely.GEOSException:  # corners nearly coincide; whole capsules have none in common
        lines = shapely.linestrings(np.stack([path[:-1], path[1:]], axis=1))
        return shapely.union_all(shapely.buffer(lines, radius, quad_segs=quad_segs))


def few_corners(path: NDArray[np.float64], error: float = _CHORD) -> NDArray[np.intp]:
    """Which points of a path stay so that its arcs are drawn with few chords, ``error`` metres
    from it at most.

    From one sharp corner to the next; so what is changed in one place changes nothing elsewhere.
    """
    if len(path) < 3:
        return np.arange(len(path))
    steps = np.diff(path, axis=0)
    directions = np.arctan2(steps[:, 1], steps[:, 0])
    turns = np.abs((np.diff(directions) + math.pi) % math.tau - math.pi)
    bounds = np.r_[0, np.flatnonzero(turns > _CORNER) + 1, len(path) - 1]
    sizes = np.diff(bounds) + 1
    places = np.repeat(bounds[:-1] - np.cumsum(sizes) + sizes, sizes) + np.arange(sizes.sum())
    stretches = np.repeat(np.arange(len(sizes)), sizes)
    lines = shapely.linestrings(np.column_stack([path[places], places]), indices=stretches)
    few = shapely.simplify(lines, error, preserve_topology=False)
    kept = np.round(shapely.get_coordinates(few, include_z=True)[:, 2]).astype(np.intp)
    return np.asarray(
        kept[np.r_[True, np.diff(kept) > 0]]
    )  # a corner ends one line and begins the next


def swept_pieces(
    path: NDArray[np.float64], radius: float, quad_segs: int = 16
) -> NDArray[np.object_]:
    """What a disc sweeps along each segment but for the half discs at the path's two ends."""
    after = np.vstack([path[2:], np.full((1, 2), np.nan)])[: len(path) - 1]
    return swept_by(np.hstack([path[:-1], path[1:], after]), radius, quad_segs)


def swept_by(
    segments: NDArray[np.float64], radius: float, quad_segs: int = 16
) -> NDArray[np.object_]:
    """What a disc sweeps along segments, without the half discs at their ends.

    ``segments``: M x 6, from where, to where, and the point after that (NaN: none). A polygon each:
    a rectangle, with the sector at the corner that follows.
    """
    if not len(segments):
        return np.zeros(0, dtype=object)
    begins, ends = segments[:, :2], segments[:, 2:4]
    steps, following = ends - begins, segments[:, 4:] - ends
    directions = np.arctan2(steps[:, 1], steps[:, 0])
    turns = np.nan_to_num(np.arctan2(following[:, 1], following[:, 0]) - directions)
    turns = (turns + math.pi) % math.tau - math.pi
    turns = np.where(np.abs(turns) > 3.1, np.copysign(math.pi, turns), turns)
    side = np.where(turns < 0, -1.0, 1.0)  # the sector is on the other side
    chords = np.ceil(np.abs(turns) / (math.pi / 2 / quad_segs) - 1e-9).astype(np.intp)
    sizes = chords + 5
    rows = np.repeat(np.arange(len(steps)), sizes)
    place = np.arange(len(rows)) - np.repeat(np.cumsum(sizes) - sizes, sizes)
    share = np.clip(place - 2, 0, chords[rows]) / np.maximum(chords[rows], 1)
    across = directions[rows] + turns[rows] * share + math.pi / 2
    last = place == sizes[rows] - 1
    whole = np.abs(turns[rows]) > 3.1  # half a disc: its middle is no corner
    middle = (place == sizes[rows] - 2) & ~whole
    last |= (place == sizes[rows] - 2) & whole
    across = np.where(last, directions[rows] + math.pi / 2, across)
    out = np.where((place == 0) | last, 1.0, -1.0) * side[rows] * radius
    out[middle] = 0.0
    coords = np.where((place < 2)[:, None], begins[rows], ends[rows])
    coords = coords + out[:, None] * np.stack([np.cos(across), np.sin(across)], axis=1)
    return np.asarray(shapely.polygons(shapely.linearrings(coords, indices=rows)))


class SweptArea:
    """Which part of an area the tool has swept so far, on a grid of ``cell`` metres.

    A cell counts as swept when its middle was under the tool. Each ``sweep`` touches only the
    cells around one capsule.
    """

    def __init__(self, area: MultiPolygon, tool_width: float, cell: float = 0.02) -> None:
        import cv2  # who only plans starts sooner without it

        self.tool_width = tool_width
        x0, y0, x1, y1 = area.bounds if not area.is_empty else (0.0, 0.0, 0.0, 0.0)
        width, height = x1 - x0 + 0.1, y1 - y0 + 0.1
        self.cell = max(cell, math.sqrt(width * height / _MOST_CELLS))
        self._origin = (x0 - 0.05, y0 - 0.05)
        shape = (math.ceil(height / self.cell) + 1, math.ceil(width / self.cell) + 1)
        self._area = np.zeros(shape, np.uint8)
        for polygon in area.geoms:
            piece = np.zeros_like(self._area) if polygon.interiors else self._area
            cv2.fillPoly(piece, [self._pixels(polygon.exterior)], 1, shift=_SHIFT)
            if polygon.interiors:
                holes = [self._pixels(ring) for ring in polygon.interiors]
                cv2.fillPoly(piece, holes, 0, shift=_SHIFT)
                self._area |= piece
        self._left = self._area.copy()
        self._total = int(np.count_nonzero(self._area))
        self._missing = self._total

    @property
    def coverage(self) -> float:
        """Share of the area that was swept, 0 to 1; 1 where there is no area."""
        return 1.0 - self._missing / self._total if self._total else 1.0

    @property
    def swept_area(self) -> float:
        """Swept part of the area, m²."""
        return (self._total - self._missing) * self.cell**2

    @property
    def missed_area(self) -> float:
        """The rest, m²."""
        return self._missing * self.cell**2

    def sweep(self, a: Point, b: Point) -> None:
        """The tool has moved straight from ``a`` to ``b``."""
        radius = self.tool_width / 2
        ox, oy = self._origin
        rows, columns = self._left.shape
        left = math.floor((min(a[0], b[0]) - radius - ox) / self.cell) - 1
        right = math.ceil((max(a[0], b[0]) + radius - ox) / self.cell) + 2
        low = math.floor((min(a[1], b[1]) - radius - oy) / self.cell) - 1
        high = math.ceil((max(a[1], b[1]) + radius - oy) / self.cell) + 2
        left, right = max(left, 0), min(right, columns)
        low, high = max(low, 0), min(high, rows)
        if left >= right or low >= high:
            return
        window = self._left[low:high, left:right]
        before = int(np.count_nonzero(window))
        if not before:
            return
        x = ox + self.cell * np.arange(left, right) - a[0]
        y = oy + self.cell * np.arange(low, high)[:, None] - a[1]
        dx, dy = b[0] - a[0], b[1] - a[1]
        squared = dx * dx + dy * dy
        along = np.clip((x * dx + y * dy) / squared, 0.0, 1.0) if squared > 1e-12 else 0.0
        window[(x - along * dx) ** 2 + (y - along * dy) ** 2 <= radius * radius] = 0
        self._missing -= before - int(np.count_nonzero(window))

    def missed(self) -> MultiPolygon:
        """What is left, as patches in `map`; those under 0.01 m² are dropped."""
        edges = np.diff(np.pad(self._left, ((0, 0), (1, 1))).view(np.int8), axis=1)
        # Cells that lie beside one another in a row are one rectangle, and rectangles are united.
        # Both lists run row by row, so the n-th begin belongs to the n-th end.
        row, begin = np.nonzero(edges == 1)
        _, end = np.nonzero(edges == -1)
        ox, oy = np.asarray(self._origin) - self.cell / 2
        runs = shapely.box(
            ox + self.cell * begin,
            oy + self.cell * row,
            ox + self.cell * end,
            oy + self.cell * (row + 1),
        )
        parts = shapely.get_parts(shapely.union_all(runs)).tolist()
        return MultiPolygon([part for part in parts if part.area >= SMALLEST_PATCH])

    def _pixels(self, ring: shapely.LinearRing) -> NDArray[np.int32]:
        points = (np.asarray(ring.coords)[:, :2] - self._origin) / self.cell
        return np.asarray(np.round(points * (1 << _SHIFT)), np.int32)
