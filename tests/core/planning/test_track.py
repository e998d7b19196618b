"""The track under a plan: appended curves, backing out along it, and forgetting."""

from __future__ import annotations

import math

import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st
from shapely import LineString

from polepilot.core.geometry import Pose2D
from polepilot.core.planning.curves import CHANGE
from polepilot.core.planning.track import Track, without_jerks

RADIUS = 0.6


def test_backing_out_of_an_arc_keeps_its_places_and_ends_where_it_began() -> None:
    track = Track(Pose2D(1.0, 2.0, 0.3), RADIUS)
    track.append((("S", 0.5), ("L", RADIUS * math.pi / 2)))
    there, _ = track.arrays()
    assert track.pose.heading == pytest.approx(0.3 + math.pi / 2)
    assert track.back_out(0.4)
    points, gears = track.arrays()
    back = points[len(there) :]
    assert {tuple(point) for point in back} <= {tuple(point) for point in there}
    assert (gears[len(there) - 1 :] == -1).all()
    assert not track.back_out(9.0)
    points, gears = track.arrays()
    assert points[-1] == pytest.approx((1.0, 2.0))
    assert track.pose.heading == pytest.approx(0.3, abs=0.01)
    assert len(gears) == track.last == len(points) - 1


@pytest.mark.parametrize("radius", [0.6, 2.0])
@pytest.mark.parametrize("distance", [0.1, 0.3, 0.55, 1.0, 1.2])
def test_backing_out_of_an_arc_ends_along_the_arc(radius: float, distance: float) -> None:
    track = Track(Pose2D(-1.0, 0.0, 0.0), radius)
    track.append((("S", 1.0), ("L", 1.0)))
    track.back_out(distance)
    x, y, heading = track.pose
    bend = 0.0 if x <= 1e-9 else math.atan2(x, radius - y)
    assert heading == pytest.approx(bend, abs=math.radians(0.2))
    assert y == pytest.approx(radius * (1 - math.cos(bend)), abs=0.002)


def test_restoring_forgets_and_costs_count_changes_of_gear() -> None:
    track = Track(Pose2D(0.0, 0.0, 0.0), RADIUS)
    track.append((("S", 1.0),))
    before, saved = track.arrays(), track.save()
    track.append((("S", 0.5), ("S", -0.25), ("R", RADIUS)))
    assert track.cost_since(saved) == pytest.approx(0.75 + RADIUS + 2 * CHANGE, abs=0.01)
    track.restore(saved)
    assert np.array_equal(track.arrays()[0], before[0])
    assert track.pose == Pose2D(1.0, 0.0, 0.0)
    assert track.straight == 1.0


def test_turned_round_the_same_curves_are_driven_tail_first() -> None:
    track = Track(Pose2D(0.0, 0.0, 0.0), RADIUS)
    saved = track.save()
    track.turn_round()
    track.append((("S", 1.0), ("L", RADIUS * math.pi / 2)))
    points, gears = track.arrays()
    assert points[1] == pytest.approx((-1.0, 0.0))
    assert points[-1] == pytest.approx((-1.0 - RADIUS, -RADIUS))
    assert (gears == -1).all()
    assert not track.back_out(9.0)
    points, gears = track.arrays()
    assert points[-1] == pytest.approx((0.0, 0.0))
    assert gears[-1] == 1
    track.turn_round()
    assert track.pose.heading == pytest.approx(0.0, abs=0.01)
    track.restore(saved)
    assert track.sign == 1


@settings(deadline=None, max_examples=60)
@given(st.lists(st.tuples(st.sampled_from("SLR"), st.booleans(), st.floats(0, 1)), max_size=9))
def test_without_jerks_a_path_keeps_its_place_and_its_ends(
    drawn: list[tuple[str, bool, float]],
) -> None:
    """Pieces of 20 cm to 1 m and, as often, of up to 2 mm, in any gears."""
    track = Track(Pose2D(0.3, 0.2, 0.1), RADIUS)
    for kind, back, size in (("S", False, 0.9), *drawn, ("S", False, 0.9)):
        length = size if size > 0.2 else size / 100
        track.append(((kind, -length if back else length),))
    path, gears = track.arrays()
    kept, there, moved = without_jerks(path, gears)
    assert np.array_equal(kept[[0, -1]], path[[0, -1]])
    assert {tuple(point) for point in kept} <= {tuple(point) for point in path}
    assert (np.diff(moved) >= 0).all()
    assert (moved[0], moved[-1]) == (0, len(kept) - 1)
    assert there[0] == there[-1] == 1
    bounds = np.r_[0, np.flatnonzero(np.diff(there)) + 1, len(there)]
    lengths = np.add.reduceat(np.hypot(*np.diff(kept, axis=0).T), bounds[:-1])
    assert lengths.min() >= 0.002
    away = shapely.distance(LineString(kept), shapely.points(path))
    assert away.max() < 0.004
    assert np.hypot(*(kept[moved] - path).T).max() < 0.004 * len(bounds)
