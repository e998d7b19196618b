"""Patches: found, cut to the tool's size, and where the tool stands for them."""

from __future__ import annotations

import math

import numpy as np
import pytest
import shapely
from core.planning import maps
from shapely import MultiPolygon, Point

from polepilot.core.planning.options import PlanOptions
from polepilot.core.planning.patches import patches_of, pieces_of, standing_place, strip_of
from polepilot.core.planning.space import FreeSpace, free_space

RADIUS = 0.2


@pytest.fixture(scope="module")
def space() -> FreeSpace:
    return free_space(maps.site(maps.box(0, 0, 4, 3)), PlanOptions())


def test_small_and_thin_ones_are_left_out() -> None:
    missed = MultiPolygon(
        [shapely.box(0, 0, 1, 0.1), shapely.box(2, 0, 2.02, 0.02), shapely.box(3, 0, 4, 0.003)]
    )
    (patch,) = patches_of(missed, 0.001)
    assert patch.area == pytest.approx(0.1, rel=0.01)
    assert patches_of(shapely.Polygon(), 0.001) == []
    assert patches_of(missed, 0.001, sliver=0.06) == []


def test_from_the_standing_place_all_of_a_patch_is_swept(space: FreeSpace) -> None:
    patch = shapely.box(1.0, 1.0, 1.2, 1.15)
    place = standing_place(patch, space, RADIUS)
    assert place is not None
    for x, y in shapely.get_coordinates(place):
        # A thirtieth of the radius may be left along the edge.
        disc = Point(x, y).buffer(RADIUS, quad_segs=64)
        assert patch.difference(disc.buffer(0.03 * RADIUS + 0.001)).area < 1e-6


def test_beside_a_wall_it_is_where_the_robot_can_be(space: FreeSpace) -> None:
    place = standing_place(shapely.box(1.0, 0.02, 1.1, 0.1), space, RADIUS)
    assert place is not None
    assert space.polygon.buffer(1e-4).covers(place)
    assert standing_place(shapely.box(0.0, 0.0, 0.03, 0.03), space, RADIUS) is None  # a corner
    assert standing_place(shapely.box(1, 1, 1.5, 1.1), space, RADIUS) is None  # too long


def test_pieces_make_up_the_patch_and_fit_under_the_tool() -> None:
    patch = shapely.affinity.rotate(shapely.box(0, 0, 1.3, 0.12), 25)
    pieces = pieces_of(patch, RADIUS)
    assert shapely.union_all(pieces).symmetric_difference(patch).area < 1e-6
    assert all(shapely.minimum_bounding_radius(piece) < RADIUS for piece in pieces)
    assert len(pieces) <= math.ceil(1.3 / 0.2)


def test_a_strip_is_straight_and_narrow() -> None:
    pieces = strip_of(shapely.box(0, 0, 2.0, 0.1), 0.34)
    assert len(pieces) == 6
    assert np.ptp(shapely.area(pieces)) < 1e-9
    assert strip_of(shapely.box(0, 0, 0.3, 0.1), 0.34) == []  # short
    assert strip_of(shapely.box(0, 0, 2, 1), 0.34) == []  # wide
    ring = Point(0, 0).buffer(1).difference(Point(0, 0).buffer(0.9))
    assert strip_of(ring, 0.34) == []
