"""What a tool is to sweep, and what of it a path misses: tile by tile, and only where it is new.

A path is changed in many small steps, and after each of them it is asked what it misses. The
area is therefore cut into tiles; of each it is remembered which segments of a path came near and
what they left.
"""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import shapely
from numpy.typing import NDArray
from shapely import MultiPolygon

from polepilot.core.planning.footprint import Footprint
from polepilot.core.planning.swept import few_corners, swept_by

Points = NDArray[np.float64]

CHORD = 0.001
"""How exactly arcs of paths are taken, metres."""
_TILE = 10.0
"""Side of a tile in tool widths, at most; more where the area is kilometres long."""
_GRID = 1e-6
"""Corners of what is left of a tile lie on a grid so fine that neighbours fit, metres."""
_MOST_TILES = 1000
"""So many in a row at most."""
_POLYGON = 3


class Target:
    """An area, metres, that a disc is to sweep."""

    def __init__(self, area: MultiPolygon, tool: float, error: float = CHORD) -> None:
        """``error``: how exactly arcs of paths and of the disc are taken, metres."""
        self.shape = area
        self.tool = tool
        self.area = float(area.area)
        x0, y0, x1, y1 = area.bounds
        side = max(_TILE * tool, (x1 - x0 + y1 - y0) / _MOST_TILES)
        self._tiles = np.array(_tiles(area, side), dtype=object)
        low, high = np.hsplit(shapely.bounds(self._tiles).reshape(-1, 4), 2)
        grow = tool / 2 + 1e-6
        boxes = shapely.box(*(low - grow).T, *(high + grow).T)
        self._tree = shapely.STRtree(boxes)
        self._error = error
        self._round = Footprint(tool / 2, error).quadrant
        self._known: dict[tuple[int, bytes], shapely.Geometry] = {}

    def missed(self, *lines: Points) -> shapely.Geometry:
        """What no disc along one of the lines, each N x 2 points, sweeps."""
        left = self._left(lines)
        parts = shapely.get_parts(left)
        return shapely.disjoint_subset_union_all(parts[shapely.get_type_id(parts) == _POLYGON])

    def missed_area(self, *lines: Points) -> float:
        """Its area, m²."""
        return float(shapely.area(self._left(lines)).sum())

    def area_in(self, shape: shapely.Geometry) -> float:
        """How much of the area a shape holds, m²."""
        near = self._tiles[self._tree.query(shape, predicate="intersects")]
        return float(shapely.area(shapely.intersection(near, shape)).sum())

    def _left(self, lines: tuple[Points, ...]) -> NDArray[np.object_]:
        """What the lines leave of each tile."""
        if not lines or not len(self._tiles):
            return self._tiles
        rows = np.vstack([_rows(line, self._error) for line in lines])
        rows = rows[np.lexsort(rows.T)]  # the same ones in any order leave the same
        pairs = shapely.linestrings(rows[:, :4].reshape(-1, 2, 2))
        found, tiles = self._tree.query(pairs, predicate="intersects")
        order = np.lexsort((found, tiles))
        found, tiles = found[order], tiles[order]
        bounds = np.r_[0, np.flatnonzero(np.diff(tiles)) + 1, len(tiles)].tolist()
        left = self._tiles.copy()
        new: list[tuple[tuple[int, bytes], NDArray[np.intp]]] = []
        for first, last in pairwise(bounds if len(tiles) else []):
            tile, near = int(tiles[first]), found[first:last]
            key = tile, rows[near].tobytes()
            if key in self._known:
                left[tile] = self._known[key]
            else:
                new.append((key, near))
        if not new:
            return left
        needed = np.unique(np.concatenate([near for _, near in new]))
        pieces = np.empty(len(rows), dtype=object)
        pieces[needed] = _pieces(rows[needed], self.tool / 2, self._round)
        for key, near in new:
            left[key[0]] = self._known[key] = self._without(key[0], rows[near], pieces[near])
        return left

    def _without(self, tile: int, rows: Points, pieces: NDArray[np.object_]) -> shapely.Geometry:
        """A tile without what is swept along some rows."""
        try:
            left = shapely.difference(self._tiles[tile], shapely.union_all(pieces))
        except shapely.GEOSException:  # corners nearly coincide; whole capsules have none in common
            lines = shapely.linestrings(rows[:, :4].reshape(-1, 2, 2))
            capsules = shapely.buffer(lines, self.tool / 2, quad_segs=self._round)
            left = shapely.difference(self._tiles[tile], shapely.union_all(capsules))
        return shapely.set_precision(left, _GRID)


def _rows(line: Points, error: float) -> Points:
    """A row per segment of a line: its ends and the point after it, which is NaN at the line's end.

    First a segment of no length for the disc at the beginning.
    """
    line = line[np.r_[True, np.hypot(*np.diff(line, axis=0).T) > 1e-9]]
    line = line[few_corners(line, error)]
    after = np.vstack([line[2:], np.full((1, 2), np.nan)])
    ends = np.hstack([line[[0, -1]], line[[0, -1]], np.full((2, 2), np.nan)])
    return np.vstack([ends, np.hstack([line[:-1], line[1:], after[: len(line) - 1]])])


def _pieces(rows: Points, radius: float, quad_segs: int) -> NDArray[np.object_]:
    """What is swept along each row: a disc at an end of a line, else a rectangle and a sector."""
    ends = (rows[:, :2] == rows[:, 2:4]).all(axis=1)
    pieces = np.empty(len(rows), dtype=object)
    pieces[ends] = shapely.buffer(shapely.points(rows[ends, :2]), radius, quad_segs=quad_segs)
    pieces[~ends] = swept_by(rows[~ends], radius, quad_segs)
    return pieces


def _tiles(shape: shapely.Geometry, side: float) -> list[shapely.Geometry]:
    """A shape in pieces no longer or wider than ``side``, halved again and again."""
    done: list[shapely.Geometry] = []
    pending = [shape]
    while pending:
        part = pending.pop()
        if part.is_empty or part.area <= 0:
            continue
        x0, y0, x1, y1 = part.bounds
        if max(x1 - x0, y1 - y0) <= side:
            done.append(part)
        elif x1 - x0 >= y1 - y0:
            middle = round((x0 + x1) / 2, 3)
            boxes = shapely.box([x0, middle], y0, [middle, x1], y1)
            pending += shapely.intersection(part, boxes).tolist()
        else:
            middle = round((y0 + y1) / 2, 3)
            boxes = shapely.box(x0, [y0, middle], x1, [middle, y1])
            pending += shapely.intersection(part, boxes).tolist()
    return done
