"""Curves of a steered wheel: they arrive, and they are short."""

from __future__ import annotations

import math

import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st

from polepilot.core.geometry import Pose2D, angle_between
from polepilot.core.planning.curves import (
    Curve,
    columns,
    curve_length,
    gear_changes,
    sample,
    shortest_curves,
    spots,
)
from polepilot.core.planning.turns import prepare, turns_round

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


def test_spots_lie_on_their_curves() -> None:
    poses = np.array([[1.0, 2.0, 0.3], [-1.0, 0.5, -2.0], [0.0, 0.0, 1.0]])
    curves: list[Curve] = [
        (("L", 1.0), ("R", -1.0), ("S", 0.5)),
        (("S", -2.0),),
        (("R", 0.4), ("S", -0.3), ("L", -0.9), ("R", 0.2)),
    ]
    points = spots(poses, *columns(curves), 0.6)
    for pose, curve, some in zip(poses.tolist(), curves, points, strict=True):
        line, _, end = sample(Pose2D(*pose), curve, 0.6)
        assert some[-1] == pytest.approx(end.position)
        track = shapely.LineString(line)
        assert shapely.distance(track, shapely.points(some)).max() < 0.001
        # On each piece, as far as its end.
        marks = np.cumsum([abs(length) for _, length in curve])
        driven = np.r_[0.0, np.cumsum(np.hypot(*np.diff(line, axis=0).T))]
        for mark in marks:
            there = [np.interp(mark, driven, column) for column in line.T]
            assert np.hypot(*(some - there).T).min() < 0.01
    same = spots(poses[:1], *columns([curves[0], curves[0]]), 0.6)
    assert same[0] == pytest.approx(points[0, : same.shape[1]])
    assert spots(poses[:1], *columns([]), 0.6).shape[0] == 0


def test_turns_prepared_at_once_are_those_worked_out_one_by_one() -> None:
    turns, radius = [0.0371, 0.7123, 1.5708, 2.9001], 0.6137
    alone = [turns_round(turn, radius + 1e-9, every=False) for turn in turns]
    prepare([*turns, -turns[0]], radius)
    for turn, ways in zip(turns, alone, strict=True):
        together = turns_round(turn, radius, every=False)
        assert [way.cost for way in together] == pytest.approx([way.cost for way in ways], abs=1e-6)
        mirrored = turns_round(-turn, radius, every=False)
        assert [way.stop for way in mirrored] == [way.stop for way in together]
        costs = {round(way.cost, 6) for way in turns_round(turn, radius)}
        assert {round(way.cost, 6) for way in together} <= costs
