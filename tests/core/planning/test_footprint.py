"""The disc that plans take the robot for."""

from __future__ import annotations

import math
import time

import numpy as np
import pytest
import shapely
from hypothesis import given
from hypothesis import strategies as st
from plans.scorer import ground
from plans.shapes import fences
from shapely import LineString, Point, Polygon, box

from polepilot.core.errors import InternalError
from polepilot.core.planning.footprint import Footprint
from polepilot.core.planning.space import footprint, polygons

DISC = Footprint(0.25, 1e-4)


def test_places_keep_off_edges_walls_and_poles() -> None:
    places = DISC.places(box(0, 0, 4, 3), [LineString([(2, 1), (2, 3)]), Point(1, 1)])
    for thing in (box(0, 0, 4, 3).exterior, LineString([(2, 1), (2, 3)]), Point(1, 1)):
        assert places.distance(thing) == pytest.approx(0.25, abs=1.5e-4)
    assert DISC.places(box(0, 0, 4, 0.499)).is_empty
    assert not DISC.places(box(0, 0, 4, 0.501)).is_empty
    assert DISC.width == 0.5


def test_the_ground_of_a_room_lacks_only_its_corners() -> None:
    room = box(0, 0, 4, 3)
    ground = DISC.ground(DISC.places(room))
    assert room.buffer(1e-9).covers(ground)
    assert room.area - ground.area == pytest.approx((4 - math.pi) * 0.25**2, abs=1e-3)


def test_a_trembling_outline_takes_little_time_and_keeps_the_clearance() -> None:
    """With 10,000 corners a few millimetres apart, all at once took seconds."""
    rng = np.random.default_rng(7)
    angles = np.arange(10_000) * math.tau / 10_000
    radius = 3 + 0.3 * np.sin(9 * angles) + rng.normal(0, 3e-3, 10_000)
    room = Polygon(np.stack([radius * np.cos(angles), radius * np.sin(angles)], axis=1))
    disc = footprint(0.2)
    began = time.process_time()
    places = disc.places(room)
    assert time.process_time() - began < 1.5
    assert 0.2 + 0.00005 < places.distance(room.exterior) < 0.2 + 0.0003
    spots = shapely.points(rng.uniform(-3.5, 3.5, (4000, 2)))
    shapely.prepare(room)
    shapely.prepare(room.exterior)
    far = shapely.covers(room, spots) & ~shapely.dwithin(room.exterior, spots, 0.2004)
    assert shapely.covers(places, spots[far]).all()


@pytest.mark.parametrize("seed", [2012, 2022, 2039, 2055, 2092])
def test_the_ground_between_fences_is_what_the_disc_gets_to(seed: int) -> None:
    """Of whole outlines like these buffers are valid and fill what lies between two fences."""
    site = fences((6, 5), 14, seed)
    lines = [LineString(wall) for wall in site["walls"]]
    disc = footprint(0.2)
    places = max(polygons(disc.places(box(0, 0, 6, 5), lines)), key=lambda piece: piece.area)
    start = places.representative_point()
    spots = np.stack(np.meshgrid(np.arange(0.01, 6, 0.02), np.arange(0.01, 5, 0.02)), axis=-1)
    spots = spots.reshape(-1, 2)
    away = shapely.distance(places, shapely.points(spots))
    for found in (disc.ground(places), ground(site, (start.x, start.y), 0.2).reachable):
        inside = shapely.intersects_xy(found, *spots.T)
        assert away[inside].max() < 0.202  # the planner keeps 0.15 mm more
        assert away[~inside].min() > 0.1999
        assert found.area == pytest.approx(0.02**2 * np.count_nonzero(away < 0.2), abs=0.03)


@given(st.floats(0.01, 50.0), st.floats(1e-5, 0.01))
def test_chords_are_as_near_to_the_arc_as_asked_for(radius: float, chord: float) -> None:
    disc = Footprint(radius, chord)
    edge = Point(0, 0).buffer(radius, quad_segs=disc.quadrant).exterior
    inside = radius - edge.distance(Point(0, 0))
    assert inside <= 1.01 * max(chord, radius * (1 - math.cos(math.pi / 4 / 128)))


def test_no_such_robot() -> None:
    for radius, chord in ((-0.1, 1e-4), (math.nan, 1e-4), (0.2, 0.0)):
        with pytest.raises(InternalError):
            Footprint(radius, chord)
    assert shapely.equals(Footprint(0.0, 1e-4).places(box(0, 0, 1, 1)), box(0, 0, 1, 1))
