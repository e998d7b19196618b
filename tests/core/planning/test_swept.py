"""The raster of what was swept, against exact geometry."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
import shapely
from shapely import MultiPolygon, Point, Polygon, box

from polepilot.core.planning.swept import SweptArea, swept_pieces, swept_shape

ROOM = MultiPolygon([box(0, 0, 4, 3).difference(box(1.5, 1, 2.5, 2))])


def test_against_exact_geometry() -> None:
    rng = np.random.default_rng(1)
    path = rng.uniform((0, 0), (4, 3), (12, 2))
    swept = SweptArea(ROOM, 0.4)
    assert swept.coverage == 0
    assert swept.missed_area == pytest.approx(ROOM.area, rel=0.02)
    for a, b in pairwise(path):
        swept.sweep(tuple(a), tuple(b))
    exact = swept_shape(path, 0.4).intersection(ROOM).area / ROOM.area
    assert swept.coverage == pytest.approx(exact, abs=0.01)
    assert swept.missed().area == pytest.approx(ROOM.area * (1 - exact), rel=0.06)
    assert swept.swept_area + swept.missed_area == pytest.approx(ROOM.area, rel=0.02)


def test_missed_keeps_holes_and_drops_crumbs() -> None:
    swept = SweptArea(ROOM, 0.4)
    (whole,) = swept.missed().geoms
    assert len(whole.interiors) == 1
    assert whole.area == pytest.approx(ROOM.area, rel=0.02)
    tiny = SweptArea(MultiPolygon([Point(0, 0).buffer(0.04), box(1, 1, 2, 2)]), 0.4)
    assert len(tiny.missed().geoms) == 1


@pytest.mark.parametrize("seed", range(20))
def test_missed_is_what_the_raster_says_however_ragged(seed: int) -> None:
    """Strokes at all angles leave wedges, slivers and chains of single cells."""
    rng = np.random.default_rng(seed)
    swept = SweptArea(ROOM, 0.3, cell=0.05)
    low, high = ROOM.bounds[:2], ROOM.bounds[2:]
    ends = rng.uniform(low, high, (25, 2))
    for a, b in pairwise(ends):
        swept.sweep(tuple(a), tuple(b))
    missed = swept.missed()
    assert missed.is_valid
    assert missed.area <= swept.missed_area + 1e-9
    assert missed.area == pytest.approx(swept.missed_area, rel=0.05)  # the rest are crumbs
    assert missed.area / 0.05**2 == pytest.approx(round(missed.area / 0.05**2), abs=1e-6)


def test_a_point_is_a_disc() -> None:
    swept = SweptArea(MultiPolygon([box(-1, -1, 1, 1)]), 0.4)
    swept.sweep((0, 0), (0, 0))
    assert swept.swept_area == pytest.approx(np.pi * 0.04, rel=0.02)
    swept.sweep((50, 50), (60, 60))  # elsewhere
    assert swept.swept_area == pytest.approx(np.pi * 0.04, rel=0.02)


def test_nothing_to_sweep() -> None:
    swept = SweptArea(MultiPolygon(), 0.4)
    assert swept.coverage == 1
    assert swept.missed().is_empty


def test_exact_sweep_of_a_straight_line() -> None:
    shape = swept_shape(np.array([[0.0, 0], [1, 0], [1, 0]]), 0.4)
    assert shape.area == pytest.approx(0.4 + np.pi * 0.04, rel=0.005)
    assert isinstance(shape, Polygon)


def test_a_shape_swept_is_that_of_capsules() -> None:
    rng = np.random.default_rng(3)
    path = np.cumsum(rng.normal(0, 0.2, (120, 2)), axis=0)
    path[40:44] = path[40] + np.array([[0, 0], [0.5, 0], [0.2, 0], [0.2, 0]])  # there and back
    lines = shapely.linestrings(np.stack([path[:-1], path[1:]], axis=1))
    capsules = shapely.union_all(shapely.buffer(lines, 0.2, quad_segs=32))
    swept = swept_shape(path, 0.4)
    assert swept.symmetric_difference(capsules).area < 0.002 * capsules.area
    assert shapely.is_valid(swept_pieces(path[:40], 0.2)).all()
