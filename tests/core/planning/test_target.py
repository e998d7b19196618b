"""What a path misses of an area, tile by tile, against the same in one go."""

from __future__ import annotations

import numpy as np
import pytest
import shapely
from shapely import MultiPolygon, Point

from polepilot.core.planning.swept import swept_shape
from polepilot.core.planning.target import Target

TOOL = 0.4
AREA = MultiPolygon(
    [shapely.box(0, 0, 9, 7).difference(Point(4, 4).buffer(1)), shapely.box(9.5, 0, 11, 2)]
)


@pytest.fixture
def wild() -> np.ndarray:
    """A path with straight legs, sharp corners and a winding part."""
    rng = np.random.default_rng(5)
    turns = np.linspace(0, 12, 120)
    winding = np.stack([5 + 2 * np.cos(turns) + turns / 5, 3 + 2 * np.sin(turns)], axis=1)
    return np.vstack([rng.uniform((0, 0), (11, 7), (25, 2)), winding])


def test_missed_in_one_go_and_in_tiles(wild: np.ndarray) -> None:
    target = Target(AREA, TOOL, 0.0001)
    exact = AREA.difference(swept_shape(wild, TOOL, 32))
    missed = target.missed(wild)
    assert missed.symmetric_difference(exact).area < 0.0003 * exact.area
    assert target.missed_area(wild) == pytest.approx(exact.area, rel=0.0003)
    # Patches that lie across the borders of tiles are whole.
    large = [part for part in exact.geoms if part.area > 0.01]
    assert len([part for part in missed.geoms if part.area > 0.01]) == len(large)


def test_a_changed_path_is_looked_at_anew_where_it_changed(wild: np.ndarray) -> None:
    target = Target(AREA, TOOL, 0.0001)
    target.missed(wild)
    longer = np.vstack([wild[:40], [[1.0, 6.0]], wild[40:]])
    for line in (longer, longer[::-1], wild[:50], wild):
        exact = AREA.difference(swept_shape(line, TOOL, 32)).area
        assert target.missed_area(line) == pytest.approx(exact, rel=0.0003)


def test_several_lines_and_none(wild: np.ndarray) -> None:
    target = Target(AREA, TOOL)
    assert target.missed_area() == pytest.approx(AREA.area)
    assert target.missed().area == pytest.approx(AREA.area)
    both = shapely.union_all([swept_shape(line, TOOL) for line in (wild[:30], wild[60:90])])
    expected = AREA.difference(both).area
    assert target.missed_area(wild[:30], wild[60:90]) == pytest.approx(expected, rel=0.001)


def test_how_much_of_it_a_shape_holds() -> None:
    shape = shapely.box(3, -1, 10, 2)
    expected = AREA.intersection(shape).area
    assert Target(AREA, TOOL).area_in(shape) == pytest.approx(expected)


def test_which_points_an_area_holds() -> None:
    area = MultiPolygon([shapely.box(0, 0, 9, 5).difference(shapely.box(3, 1, 4, 2))])
    points = np.random.default_rng(4).uniform(-1, 10, (500, 2))
    found = Target(area, 0.4).holds(points)
    assert np.array_equal(found, shapely.intersects_xy(area, *points.T))


def test_what_is_missed_still_after_more(wild: np.ndarray) -> None:
    target = Target(AREA, TOOL, 0.0001)
    left = target.still_missed(target.missed(wild[:20]), wild[20:40], wild[40:])
    expected = target.missed(wild[:20], wild[20:40], wild[40:])
    assert left.symmetric_difference(expected).area < 1e-4 * expected.area
    assert target.still_missed(expected, np.array([[20.0, 20], [21, 20]])).equals(expected)
    assert target.still_missed(MultiPolygon(), wild).is_empty
