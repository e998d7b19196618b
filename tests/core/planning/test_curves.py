"""Curves of a steered wheel: they arrive, and they are short."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from polepilot.core.geometry import Pose2D, angle_between
from polepilot.core.planning.curves import curve_length, gear_changes, sample, shortest_curves
from polepilot.core.planning.turns import turns_round

_pose = st.builds(Pose2D, st.floats(-4, 4), st.floats(-4, 4), st.floats(-math.pi + 1e-6, math.pi))


@settings(deadline=None, max_examples=100)
@given(_pose, _pose, st.sampled_from([0.3, 0.6, 1.0]))
def test_curves_arrive(start: Pose2D, goal: Pose2D, radius: float) -> None:
    if start.distance_to(goal.position) < 0.01:
        return
    curves = shortest_curves(start, goal, radius, 0.0)
    assert curves
    for curve in curves[:5]:
        points, gears, end = sample(start, curve, radius)
        assert end.position == pytest.approx(goal.position, abs=1e-6)
        assert abs(angle_between(end.heading, goal.heading)) < 1e-6
        assert len(gears) == len(points) - 1
    best = curve_length(curves[0])
    assert best >= start.distance_to(goal.position) - 1e-6
    assert best >= radius * abs(angle_between(start.heading, goal.heading)) - 1e-6
    # Driven backward in time the way is as long.
    back = shortest_curves(goal, start, radius, 0.0)
    assert curve_length(back[0]) == pytest.approx(best, abs=1e-6)


def test_known_curves() -> None:
    origin = Pose2D(0, 0, 0)
    assert shortest_curves(origin, Pose2D(3, 0, 0), 1.0, 0.5)[0] == (("S", pytest.approx(3)),)
    assert shortest_curves(origin, Pose2D(-3, 0, 0), 1.0, 0.5)[0] == (("S", pytest.approx(-3)),)
    (quarter,) = shortest_curves(origin, Pose2D(1, 1, math.pi / 2), 1.0, 0.5)[:1]
    assert quarter == (("L", pytest.approx(math.pi / 2)),)
    # On the spot: three arcs that turn by the angle asked for, not more.
    spot = shortest_curves(origin, Pose2D(0, 0, math.pi / 2), 1.0, 0.1)[0]
    assert curve_length(spot) == pytest.approx(math.pi / 2)
    assert gear_changes(spot) == 2


def test_samples_keep_the_radius() -> None:
    points, gears, _ = sample(Pose2D(1, 2, 0.3), (("L", 1.0), ("R", -1.0), ("S", 0.5)), 0.6)
    assert points[0] == pytest.approx((1, 2))
    assert gears.tolist().count(-1) > 5
    steps = np.hypot(*np.diff(points, axis=0).T)
    assert steps[:-1].max() <= 0.6 * math.radians(5.01)


@pytest.mark.parametrize("turn", [1e-6, 2e-6, 1e-5, 1e-4])
def test_the_least_of_turns_has_a_way(turn: float) -> None:
    for side in (turn, -turn):
        ways = turns_round(side, 0.6)
        assert ways
        assert [way.cost for way in ways] == sorted(way.cost for way in ways)
