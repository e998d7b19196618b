"""The disc that plans take the robot for."""

from __future__ import annotations

import math

import pytest
import shapely
from hypothesis import given
from hypothesis import strategies as st
from shapely import LineString, Point, box

from polepilot.core.errors import InternalError
from polepilot.core.planning.footprint import Footprint

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
