"""What a tool is to sweep, and what of it a path misses: tile by tile, and only where it is new.

A path is changed in many small steps, and after each of them it is asked what it misses. The
area is therefore cut into tiles; of each it is remembered which bands of a path came near and
what they left.
"""

from __future__ import annotations

import numpy as np
import shapely
from numpy.typing import NDArray
from shapely import MultiPolygon

from polepilot.core.planning.bands import Bands, bands_of
from polepilot.core.planning.footprint import Footprint
from polepilot.core.planning.space import polygons

Points = NDArray[np.float64]
Indices = NDArray[np.intp]

CHORD = 0.001
"""How exactly arcs of paths are taken, metres."""
_TILE = 10.0
"""Side of a tile in tool widths, at most; more where the area is kilometres long."""
_GRID = 1e-6
"""Corners of what is left at the edge of a tile lie on a grid so fine that neighbours fit, m."""
_RIM = 0.002
"""What is thinner than this on average is no part of a patch, metres."""
_SAME = 1e-6
"""Bands whose keys differ by less than this are the same."""
_MOST_TILES = 1000
"""So many in a row at most."""
_BESIDE = 0.001
"""Of what bands sweep beside a shape that they are taken off so much is looked at, metres."""
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
        shapely.prepare(self._tiles)
        self._low, self._high = np.hsplit(shapely.bounds(self._tiles).reshape(-1, 4), 2)
        grow = tool / 2 + 1e-6
        boxes = shapely.box(*(self._low - grow).T, *(self._high + grow).T)
        self._tree = shapely.STRtree(boxes)
        self._error = error
        self.quad_segs = Footprint(tool / 2, error).quadrant
        """Chords per quarter of the disc."""
        self._known: dict[tuple[int, bytes], shapely.Geometry] = {}
        self._asked: list[bytes] = []
        """What was asked last, and the answer: it is often asked again."""
        self._answer = self._tiles

    def missed(self, *lines: Points) -> MultiPolygon:
        """What no disc along one of the lines, each N x 2 points, sweeps.

        Rims (see ``_RIM``) are cut where tiles end.
        """
        parts, tiles = shapely.get_parts(self._left(lines), return_index=True)
        low, high = np.hsplit(shapely.bounds(parts).reshape(-1, 4), 2)
        inside = ((low > self._low[tiles] + _GRID) & (high < self._high[tiles] - _GRID)).all(axis=1)
        areal = shapely.get_type_id(parts) == _POLYGON
        # What lies at the edge of a tile may go on in the next one, if it is more than a rim.
        thick = 2 * shapely.area(parts) > _RIM * shapely.length(parts)
        edges = shapely.set_precision(parts[areal & ~inside & thick], _GRID)
        joined = shapely.disjoint_subset_union_all(edges)
        return MultiPolygon([*parts[areal & (inside | ~thick)].tolist(), *polygons(joined)])

    def still_missed(self, missed: shapely.Geometry, *lines: Points) -> MultiPolygon:
        """What of ``missed`` no disc along one of the lines sweeps either."""
        parts = np.array(polygons(missed), dtype=object)
        bands = bands_of(lines, self.tool / 2, self.quad_segs, self._error)
        found, of = shapely.STRtree(parts).query(bands.shapes, predicate="intersects")
        order = np.argsort(of, kind="stable")
        found, of = found[order], of[order]
        for near in np.split(np.arange(len(of)), np.flatnonzero(np.diff(of)) + 1):
            if len(near):
                parts[of[near[0]]] = _without(
                    parts[of[near[0]]], bands, found[near], self.quad_segs
                )
        return MultiPolygon([piece for part in parts for piece in polygons(part)])

    def missed_area(self, *lines: Points) -> float:
        """Its area, m²."""
        return float(shapely.area(self._left(lines)).sum())

    def area_in(self, shape: shapely.Geometry) -> float:
        """How much of the area a shape holds, m²."""
        near = self._tiles[self._tree.query(shape, predicate="intersects")]
        return float(shapely.area(shapely.intersection(near, shape)).sum())

    def holds(self, points: Points) -> NDArray[np.bool_]:
        """Which of N x 2 points are in the area."""
        inside = np.zeros(len(points), dtype=bool)
        for tile in self._tree.query(shapely.multipoints(points)).tolist():
            inside |= shapely.intersects_xy(self._tiles[tile], *points.T)
        return inside

    def _left(self, lines: tuple[Points, ...]) -> NDArray[np.object_]:
        """What the lines leave of each tile."""
        if not lines or not len(self._tiles):
            return self._tiles
        asked = [line.tobytes() for line in lines]
        if asked == self._asked:
            return self._answer
        bands = bands_of(lines, self.tool / 2, self.quad_segs, self._error)
        found, tiles = self._tree.query(bands.tracks, predicate="intersects")
        keys = np.floor(bands.keys_near(found, self._low[tiles], self._high[tiles]) / _SAME + 0.3)
        order = np.lexsort((*keys.T, tiles))  # the same ones in any order leave the same
        found, tiles, keys = found[order], tiles[order], keys[order]
        left = self._tiles.copy()
        for near in np.split(np.arange(len(tiles)), np.flatnonzero(np.diff(tiles)) + 1):
            if len(near):
                tile, key = int(tiles[near[0]]), keys[near].tobytes()
                if (tile, key) not in self._known:
                    self._known[tile, key] = _without(
                        self._tiles[tile], bands, found[near], self.quad_segs
                    )
                left[tile] = self._known[tile, key]
        self._asked, self._answer = asked, left
        return left


def _without(
    shape: shapely.Geometry, bands: Bands, near: Indices, quad_segs: int
) -> shapely.Geometry:
    """A shape without what is swept by some bands."""
    # What lies beside the shape is cut away first: there would be more corners to think about.
    x0, y0, x1, y1 = shape.bounds
    box = (x0 - _BESIDE, y0 - _BESIDE, x1 + _BESIDE, y1 + _BESIDE)
    try:
        swept = shapely.union_all(shapely.clip_by_rect(bands.shapes[near], *box))
        return shapely.difference(shape, swept)
    except shapely.GEOSException:  # corners nearly coincide; whole capsules have none in common
        swept = shapely.union_all(bands.capsules(near, quad_segs))
        return shapely.difference(shape, swept)


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
