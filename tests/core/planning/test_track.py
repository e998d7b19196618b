"""The track under a plan: appended curves, backing out along it, and forgetting."""

from __future__ import annotations

import math

import numpy as np
import pytest

from polepilot.core.geometry import Pose2D
from polepilot.core.planning.curves import CHANGE
from polepilot.core.planning.track import Track

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
