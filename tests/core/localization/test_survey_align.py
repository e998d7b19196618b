"""Maps laid over each other."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from polepilot.core.geometry import Point, Pose2D
from polepilot.core.localization.survey_align import fit_rigid, free_covariance, overlay

MAP: dict[int, Point] = {1: (0.0, 0.0), 2: (8.0, 0.3), 3: (7.6, 5.9), 4: (0.2, 6.0), 5: (4.0, 3.0)}
TOLERANCE = dict.fromkeys(MAP, 0.05)
angles = st.floats(-math.pi, math.pi)
places = st.floats(-20, 20)


@given(places, places, angles)
def test_a_motion_is_found_again(x: float, y: float, heading: float) -> None:
    pose = Pose2D(x, y, heading)
    moved = {k: pose.to_parent(place) for k, place in MAP.items()}
    laid = overlay(MAP, moved, TOLERANCE)
    assert laid is not None
    assert laid.agreeing == tuple(MAP)
    assert laid.contradicted == ()
    assert laid.clear
    for number, place in MAP.items():
        assert math.dist(laid.pose.to_parent(place), moved[number]) < 1e-9


@given(st.sampled_from(sorted(MAP)), angles, st.floats(0.2, 3.0))
def test_the_one_that_stands_elsewhere_is_told(number: int, way: float, far: float) -> None:
    moved = dict(MAP)
    x, y = MAP[number]
    moved[number] = (x + far * math.cos(way), y + far * math.sin(way))
    laid = overlay(MAP, moved, TOLERANCE)
    assert laid is not None
    assert laid.contradicted == (number,)
    assert abs(laid.pose.heading) < 1e-6


def test_two_against_one_is_not_clear() -> None:
    three = {k: MAP[k] for k in (1, 2, 4)}
    # Pole 4 swung about pole 2: 1 and 2 agree, and so do 2 and 4, by another motion.
    swing = Pose2D(*MAP[2], 0.05)
    moved = three | {4: swing.to_parent(Pose2D(*MAP[2], 0.0).to_local(MAP[4]))}
    laid = overlay(three, moved, TOLERANCE)
    assert laid is not None
    assert len(laid.agreeing) == 2
    assert len(laid.contradicted) == 1
    assert not laid.clear


def test_maps_that_share_too_little() -> None:
    assert overlay({1: (0, 0), 2: (3, 0)}, {1: (0, 0), 7: (3, 0)}, {1: 0.1, 2: 0.1}) is None
    assert overlay({1: (0, 0), 2: (3, 0)}, {1: (0, 0), 2: (5, 0)}, {1: 0.1, 2: 0.1}) is None
    # Two poles that stand nearly together give no direction.
    assert overlay({1: (0, 0), 2: (0.1, 0)}, {1: (0, 0), 2: (0.1, 0)}, {1: 0.1, 2: 0.1}) is None


def test_a_mirrored_map_does_not_fit() -> None:
    mirrored = {k: (-x, y) for k, (x, y) in MAP.items()}
    laid = overlay(MAP, mirrored, TOLERANCE)
    assert laid is None or len(laid.agreeing) < 3


def test_fit_is_the_best_there_is() -> None:
    rng = np.random.default_rng(1)
    noisy = {k: (x + rng.normal(0, 0.1), y + rng.normal(0, 0.1)) for k, (x, y) in MAP.items()}
    ids = tuple(MAP)
    best = fit_rigid(MAP, noisy, ids)

    def cost(pose: Pose2D) -> float:
        return sum(math.dist(pose.to_parent(MAP[k]), noisy[k]) ** 2 for k in ids)

    for step in ((1e-3, 0, 0), (-1e-3, 0, 0), (0, 1e-3, 0), (0, -1e-3, 0), (0, 0, 1e-3)):
        assert cost(best) < cost(Pose2D(*(a + b for a, b in zip(best, step, strict=True))))


def test_free_covariance_knows_nothing_of_where_the_map_lies() -> None:
    points = np.array(list(MAP.values()))
    count = len(points)
    shift = np.tile(np.eye(2), (count, 1))
    turn = np.column_stack([-points[:, 1], points[:, 0]]).reshape(-1, 1)
    loose = shift @ shift.T * 4.0 + turn @ turn.T * 0.3
    assert free_covariance(points, loose) == pytest.approx(np.zeros((2 * count, 2 * count)))
    own = np.diag(np.full(2 * count, 0.01))
    kept = free_covariance(points, own + loose)
    assert kept == pytest.approx(free_covariance(points, own), abs=1e-9)
    # Three of the ten degrees of freedom are the motion's.
    assert np.trace(kept) == pytest.approx(0.01 * (2 * count - 3))
