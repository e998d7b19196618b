from __future__ import annotations

import math

import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st

from polepilot.core.geometry import Pose2D
from polepilot.core.scenery import Scenery

coordinate = st.integers(-300, 300).map(lambda cm: cm / 100)
point = st.tuples(coordinate, coordinate)
segments = st.lists(st.tuples(point, point), max_size=6)
discs = st.lists(st.tuples(point, st.floats(0.05, 0.4)), max_size=3)


@settings(deadline=None, max_examples=150)
@given(segments=segments, discs=discs, where=point)
def test_distance_as_by_shapely(segments: list, discs: list, where: tuple[float, float]) -> None:
    scenery = Scenery(segments, discs)
    expected = min(
        [shapely.LineString(s).distance(shapely.Point(where)) for s in segments]
        + [max(math.dist(where, c) - r, 0.0) for c, r in discs]
        + [math.inf]
    )
    assert scenery.distance(where) == pytest.approx(expected, abs=1e-6)
    assert scenery.distances(np.array([where]))[0] == pytest.approx(expected, abs=1e-6)


@settings(deadline=None, max_examples=150)
@given(
    segments=segments,
    discs=discs,
    where=point,
    heading=coordinate,
    half=st.integers(2, 50).map(lambda percent: percent / 100),
)
def test_beam_as_by_shapely(
    segments: list, discs: list, where: tuple[float, float], heading: float, half: float
) -> None:
    reach = 2.0
    found = Scenery(segments, discs).in_beam(Pose2D(*where, heading), half, reach)
    fan = [
        (where[0] + 9 * math.cos(heading + a), where[1] + 9 * math.sin(heading + a))
        for a in np.linspace(-half, half, 81)
    ]
    beam = shapely.Polygon([where, *fan])
    ranges = [math.inf]
    for thing in [
        *(shapely.LineString(s) for s in segments),
        *(shapely.Point(c).buffer(r, 64) for c, r in discs),
    ]:
        inside = thing.intersection(beam)
        if not inside.is_empty:
            ranges.append(inside.distance(shapely.Point(where)))
    expected = min(ranges)
    if abs(expected - reach) < 0.01:
        return
    if expected > reach:
        # shapely's 64-gon lies inside the disc: what only grazes the beam may go either way.
        assert found is None or found > reach - 0.02 or _grazes(discs, where, heading, half)
    elif found is None:
        assert _touches_an_edge(segments, where, heading, half)
    else:
        grazing = _grazes(discs, where, heading, half)
        grazing = grazing or _touches_an_edge(segments, where, heading, half)
        assert found == pytest.approx(expected, abs=0.01) or grazing


def _grazes(discs: list, where: tuple[float, float], heading: float, half: float) -> bool:
    """Whether an edge of the beam is nearly tangent to a disc."""
    for edge in (-half, half):
        ray = shapely.LineString(
            [
                where,
                (where[0] + 9 * math.cos(heading + edge), where[1] + 9 * math.sin(heading + edge)),
            ]
        )
        for center, radius in discs:
            if abs(ray.distance(shapely.Point(center)) - radius) < 0.005:
                return True
    return False


def _touches_an_edge(
    segments: list, where: tuple[float, float], heading: float, half: float
) -> bool:
    """Whether an end of a wall lies on an edge of the beam, or the sensor on a wall."""
    if any(shapely.LineString(s).distance(shapely.Point(where)) < 1e-6 for s in segments):
        return True
    pose = Pose2D(*where, heading)
    return any(abs(abs(pose.bearing_to(end)) - half) < 1e-3 for s in segments for end in s)


def test_blocked_by_walls_and_people() -> None:
    scenery = Scenery([((1, -1), (1, 1))], [((3, 0.2), 0.25)])
    assert scenery.blocked((0, 0), (2, 0))
    assert not scenery.blocked((0, 0), (0.9, 0))
    assert scenery.blocked((2, 0), (4, 0))
    assert not scenery.blocked((2, -0.1), (4, -0.1))
    assert not scenery.blocked((2, 0), (2, 0))


def test_wall_aslant_is_seen_where_the_beam_meets_it_first() -> None:
    # A wall at 45 degrees, 1 m ahead: the left edge of the beam meets it nearer than the axis.
    wall = Scenery([((1 - 2, 2), (1 + 2, -2))])
    half = math.radians(7.5)
    nearest = math.sqrt(0.5) / math.cos(math.radians(45) - half)
    assert wall.in_beam(Pose2D(0, 0, 0), half, 2.0) == pytest.approx(nearest)
    assert wall.in_beam(Pose2D(0, 0, math.pi), half, 2.0) is None


def test_near_keeps_what_can_be_reached() -> None:
    scenery = Scenery([((0, 0), (10, 0)), ((0, 5), (10, 5))], [((5, 1), 0.5), ((5, 9), 0.5)])
    near = scenery.near((5, 1), 2.0)
    assert near.distance((5, 5)) == pytest.approx(3.5)
    assert len(near.discs) == 1
    assert len(near.with_discs([((0, 0), 1.0)]).discs) == 2


def test_nothing_is_infinitely_far() -> None:
    empty = Scenery()
    assert empty.distance((0, 0)) == math.inf
    assert empty.in_beam(Pose2D(0, 0, 0), 0.1, 1.5) is None
    assert not empty.blocked((0, 0), (1, 1))
