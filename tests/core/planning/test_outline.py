"""Outlines with few corners: nowhere outside of the traced ones, and not far inside."""

from __future__ import annotations

import numpy as np
import pytest
import shapely
from core.planning import maps
from plans.shapes import traced, wavy
from shapely import Polygon

from polepilot.core.planning.options import PlanOptions
from polepilot.core.planning.outline import smoothed, wheel_outlines
from polepilot.core.planning.space import as_multi, free_space
from polepilot.core.site import parse_site

TOOL = 0.4


def _trembling(seed: int, hole: bool = False) -> Polygon:
    rng = np.random.default_rng(seed)

    def ring(shape: Polygon) -> np.ndarray:
        line = shape.exterior
        points = shapely.get_coordinates(line.interpolate(np.arange(0, line.length, 0.02)))
        return points + rng.normal(0, 0.0004, points.shape)

    holes = [ring(shapely.box(2, 1, 3, 2))] if hole else []
    return Polygon(ring(shapely.box(0, 0, 5, 3)), holes).buffer(0)


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("hole", [False, True])
def test_a_trembling_line_becomes_straight_and_stays_inside(seed: int, hole: bool) -> None:
    polygon = _trembling(seed, hole)
    inner = smoothed(polygon, TOOL)
    assert polygon.buffer(2e-6).covers(inner)
    assert len(inner.interiors) == hole
    assert shapely.get_num_coordinates(inner) < 0.2 * shapely.get_num_coordinates(polygon)
    assert polygon.area - inner.area < 0.003 * polygon.area
    # No place is given up that is farther from the new outline than lines may tremble.
    assert shapely.hausdorff_distance(polygon.boundary, inner.boundary) < 0.03


def test_a_drawn_room_stays_as_it_is() -> None:
    room = shapely.box(0, 0, 5, 3).difference(shapely.box(2, 1, 3, 2))
    assert smoothed(room, TOOL) is room


def test_what_a_wheel_gives_up_is_no_part_of_its_target() -> None:
    for document in (traced(2, (5.0, 4.0), 700), wavy(700, 3.0, 0.1, 3)):
        site = parse_site(document, "traced")
        space = free_space(site, PlanOptions())
        wanted = as_multi(space.reachable().intersection(space.floor))
        pieces, target = wheel_outlines(site, space, wanted, TOOL)
        assert all(space.polygon.buffer(2e-6).covers(piece) for piece in pieces)
        assert sum(len(piece.exterior.coords) for piece in pieces) < 200
        assert 0.995 * wanted.area < target.area < wanted.area
        reached = shapely.union_all(pieces).buffer(space.clearance + 0.001)
        assert target.difference(reached).area < 1e-3


def test_around_a_pole_a_square_is_driven() -> None:
    site = maps.site(maps.box(0, 0, 5, 4), landmarks=[{"id": 1, "x": 2.5, "y": 2}])
    space = free_space(site, PlanOptions())
    wanted = as_multi(space.reachable().intersection(space.floor))
    ((piece,), target) = wheel_outlines(site, space, wanted, TOOL)
    (ring,) = piece.interiors
    assert shapely.Polygon(ring).area == pytest.approx(0.4**2, rel=0.01)  # a disc has 0.126 m²
    assert target.area == wanted.area
