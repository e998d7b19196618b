"""Eqs. 2-3 as corrected, and the pose from all landmarks at once."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from polepilot.core.errors import InputError
from polepilot.core.geometry import Pose2D, wrap_angle
from polepilot.core.landmark import Landmark
from polepilot.core.localization.fix import (
    Fix,
    FixRefusal,
    circle_intersections,
    covariance_of,
    fix,
    two_landmark_fix,
)
from polepilot.core.observation import RangeBearing

FORWARD = 0.1
MARKS = {
    1: Landmark(1, 0.0, 0.0),
    2: Landmark(2, 8.0, 0.0),
    3: Landmark(3, 8.0, 6.0),
    4: Landmark(4, 0.0, 6.0),
}
POSES = st.builds(Pose2D, st.floats(1.5, 6.5), st.floats(1.5, 4.5), st.floats(-3.1, 3.1))


def see(
    pose: Pose2D,
    number: int,
    marks: dict[int, Landmark] = MARKS,
    noise: np.random.Generator | None = None,
    forward: float = FORWARD,
) -> RangeBearing:
    camera = pose.compose(Pose2D(forward, 0.0, 0.0))
    distance = camera.distance_to(marks[number].position)
    bearing = camera.bearing_to(marks[number].position)
    sigma = 0.004 * distance
    turned = math.radians(0.05)
    if noise is not None:
        distance += float(noise.normal(0, sigma))
        bearing += float(noise.normal(0, turned))
    return RangeBearing(0.0, number, distance, bearing, sigma, turned)


def test_the_checked_example_of_equations_2_and_3() -> None:
    true = (150.0, 220.0)
    a, b = (0.0, 0.0), (400.0, 100.0)
    both = circle_intersections(a, b, math.dist(a, true), math.dist(b, true))
    assert both.gap == 0.0
    assert min(math.dist(point, true) for point in both[:2]) < 1e-9
    # The other one is its mirror image in the line through both landmarks.
    other = max(both[:2], key=lambda point: math.dist(point, true))
    assert math.dist(other, a) == pytest.approx(math.dist(true, a))
    assert math.dist(other, b) == pytest.approx(math.dist(true, b))


@settings(deadline=None)
@given(*[st.floats(-20, 20)] * 6)
def test_both_intersections_lie_on_both_circles(
    ax: float, ay: float, bx: float, by: float, x: float, y: float
) -> None:
    a, b, p = (ax, ay), (bx, by), (x, y)
    assume(math.dist(a, b) > 0.1)
    ra, rb = math.dist(a, p), math.dist(b, p)
    both = circle_intersections(a, b, ra, rb)
    assert both.gap < 1e-9
    assert min(math.dist(both.first, p), math.dist(both.second, p)) < 1e-4
    for point in (both.first, both.second):
        assert math.dist(point, a) == pytest.approx(ra, abs=1e-4)
        assert math.dist(point, b) == pytest.approx(rb, abs=1e-4)


def test_circles_that_miss_by_a_rounding_error_touch_where_they_should() -> None:
    both = circle_intersections((-1 / 3, 1 / 3), (1.0, 1 / 3), 1 / 3, 1.0)
    assert both.gap < 1e-12
    assert math.dist(both.first, (0.0, 1 / 3)) < 1e-6


@pytest.mark.parametrize(
    ("ra", "rb", "gap", "x"),
    [(1.0, 2.0, 1.0, 1.5), (6.0, 1.0, 1.0, 5.5), (1.0, 6.0, 1.0, -1.5)],
)
def test_circles_that_miss_answer_with_the_nearest_point(
    ra: float, rb: float, gap: float, x: float
) -> None:
    both = circle_intersections((0.0, 0.0), (4.0, 0.0), ra, rb)
    assert both.gap == pytest.approx(gap)
    assert both.first == both.second == pytest.approx((x, 0.0))
    # As far from the one circle as from the other.
    assert abs(abs(x) - ra) == pytest.approx(abs(abs(x - 4.0) - rb))


def test_impossible_circles_are_refused() -> None:
    with pytest.raises(InputError, match="same place"):
        circle_intersections((1.0, 1.0), (1.0, 1.0), 1.0, 1.0)
    with pytest.raises(InputError, match="expected finite"):
        circle_intersections((0.0, 0.0), (1.0, 1.0), math.inf, 1.0)


@settings(deadline=None)
@given(POSES, st.sampled_from([(1, 2), (2, 3), (3, 4), (4, 1)]))
def test_two_exact_landmarks_give_the_pose(pose: Pose2D, pair: tuple[int, int]) -> None:
    answer = two_landmark_fix(see(pose, pair[0]), see(pose, pair[1]), MARKS, FORWARD)
    assert isinstance(answer, Fix)
    assert answer.pose.distance_to(pose.position) < 1e-6
    assert abs(wrap_angle(answer.pose.heading - pose.heading)) < 1e-6


@settings(deadline=None, max_examples=40)
@given(POSES, st.integers(0, 2**32 - 1))
def test_noise_stays_within_the_covariance(pose: Pose2D, seed: int) -> None:
    rng = np.random.default_rng(seed)
    seen = [see(pose, number, noise=rng) for number in MARKS]
    answer = fix(seen, MARKS, FORWARD)
    assert isinstance(answer, Fix)
    error = np.array(answer.pose) - np.array(pose)
    error[2] = wrap_angle(float(error[2]))
    # 3 degrees of freedom: 40 is beyond a chance of 1 in 10^8.
    assert error @ np.linalg.solve(answer.covariance, error) < 40
    assert answer.landmarks == (1, 2, 3, 4)


def test_the_covariance_is_honest_on_average() -> None:
    rng = np.random.default_rng(5)
    squares = []
    for _ in range(300):
        pose = Pose2D(*rng.uniform((2, 2, -3), (6, 4, 3)))
        # Surveyed to 5 mm and read with a potentiometer that is 0.25 degrees off.
        marks = {
            n: Landmark(n, *(np.array(m.position) + rng.normal(0, 0.005, 2)))
            for n, m in MARKS.items()
        }
        seen = []
        for number in (1, 2, 3):
            m = see(pose, number, marks, rng)
            bearing = m.bearing + rng.normal(0, math.radians(0.25))
            seen.append(RangeBearing(0.0, number, m.range, bearing, m.range_sigma, m.bearing_sigma))
        answer = fix(seen, MARKS, FORWARD)
        assert isinstance(answer, Fix)
        error = np.array(answer.pose) - np.array(pose)
        error[2] = wrap_angle(float(error[2]))
        squares.append(error @ np.linalg.solve(answer.covariance, error))
    assert 2.4 < np.mean(squares) < 3.6


def test_a_moved_landmark_is_left_out() -> None:
    pose = Pose2D(3.0, 2.0, 0.5)
    moved = {**MARKS, 3: Landmark(3, 7.0, 5.0)}
    answer = fix([see(pose, n, moved) for n in MARKS], MARKS, FORWARD)
    assert isinstance(answer, Fix)
    assert answer.landmarks == (1, 2, 4)
    assert answer.outliers == (3,)
    assert answer.pose.distance_to(pose.position) < 1e-6


def test_a_wrong_id_among_many_sightings_is_left_out() -> None:
    pose = Pose2D(3.0, 2.0, 0.5)
    seen = [see(pose, n) for n in (1, 2, 1, 2, 1)]
    wrong = see(pose, 3)
    seen.insert(2, RangeBearing(0.0, 1, wrong.range, wrong.bearing, 0.01, 0.001))
    answer = fix(seen, MARKS, FORWARD)
    assert isinstance(answer, Fix)
    assert answer.pose.distance_to(pose.position) < 1e-6


def test_sightings_on_the_way_are_referred_to_the_end() -> None:
    before, now = Pose2D(2.0, 2.0, 0.2), Pose2D(2.6, 2.3, 0.9)
    relative = now.inverse().compose(before)
    camera = Pose2D(FORWARD, 0.0, 0.0)
    answer = fix(
        [see(before, 1), see(now, 2)],
        MARKS,
        FORWARD,
        mounts=[relative.compose(camera), camera],
    )
    assert isinstance(answer, Fix)
    assert answer.pose.distance_to(now.position) < 1e-6
    assert abs(wrap_angle(answer.pose.heading - now.heading)) < 1e-6


def refusal(answer: Fix | FixRefusal) -> FixRefusal:
    assert isinstance(answer, FixRefusal)
    assert answer.reason.endswith(".")
    return answer


def test_refusals_say_why() -> None:
    pose = Pose2D(3.0, 2.0, 0.5)
    assert refusal(fix([], MARKS, FORWARD)).code == "none"
    assert refusal(fix([see(pose, 1), see(pose, 1)], MARKS, FORWARD)).code == "one_landmark"
    assert (
        refusal(two_landmark_fix(see(pose, 1), see(pose, 1), MARKS, FORWARD)).code == "one_landmark"
    )
    only = {1: MARKS[1]}
    assert refusal(two_landmark_fix(see(pose, 1), see(pose, 2), only, FORWARD)).code == "none"


def test_contradicting_landmarks_are_named() -> None:
    pose = Pose2D(3.0, 2.0, 0.5)
    swapped = {1: MARKS[3], 2: Landmark(2, 1.0, 5.0)}
    seen = [
        RangeBearing(0.0, n, see(pose, n, swapped).range, see(pose, n, swapped).bearing, 0.01, 1e-3)
        for n in (1, 2)
    ]
    answer = refusal(fix(seen, MARKS, FORWARD))
    assert answer.code == "contradiction"
    assert answer.landmarks == (1, 2)


def test_circles_that_do_not_meet_are_refused() -> None:
    first = RangeBearing(0.0, 1, 2.0, 0.0, 0.01, 0.001)
    second = RangeBearing(0.0, 2, 2.0, 1.0, 0.01, 0.001)
    answer = refusal(two_landmark_fix(first, second, MARKS, FORWARD))
    assert answer.code == "no_intersection"
    assert "400 cm" in answer.reason


def test_nearly_tangent_circles_still_answer() -> None:
    pose = Pose2D(3.0, 0.0, 0.0)
    first, second = see(pose, 1, forward=0.0), see(pose, 2, forward=0.0)
    shorter = RangeBearing(0.0, 1, first.range - 0.03, first.bearing, 0.015, 0.001)
    answer = two_landmark_fix(shorter, second, MARKS, 0.0)
    assert isinstance(answer, Fix)
    assert answer.pose.distance_to(pose.position) < 0.05
    assert math.sqrt(answer.covariance[0, 0]) > 0.005


def test_landmarks_in_one_direction_are_refused() -> None:
    marks = {1: Landmark(1, 7.0, 2.0), 2: Landmark(2, 8.0, 2.0)}
    pose = Pose2D(1.0, 2.0, 0.0)
    answer = refusal(fix([see(pose, 1, marks), see(pose, 2, marks)], marks, FORWARD))
    assert answer.code == "one_direction"


@given(
    st.lists(
        st.tuples(
            st.sampled_from(list(MARKS)),
            st.floats(0.3, 10.0),
            st.floats(-3.1, 3.1),
            st.floats(1e-4, 1.0),
            st.floats(1e-5, 0.3),
            st.tuples(st.floats(-1, 1), st.floats(-1, 1), st.floats(-1, 1)),
        ),
        max_size=8,
    )
)
@settings(deadline=None, max_examples=200)
def test_whatever_was_measured_gives_a_fix_of_two_or_a_reason(rows: list[Any]) -> None:
    measured = [RangeBearing(0.0, *row[:5]) for row in rows]
    answer = fix(measured, MARKS, FORWARD, mounts=[Pose2D(*row[5]) for row in rows])
    if isinstance(answer, Fix):
        assert len(answer.landmarks) >= 2
        assert np.linalg.eigvalsh(answer.covariance)[0] > 0
    else:
        assert answer.reason.endswith(".")


def test_landmarks_that_one_pose_cannot_have_both() -> None:
    """As far apart as the map says, but for an error that no single pose takes up: a robot that
    was pushed. The sightings of one of them do not make a pose."""
    marks = {2: Landmark(2, 3.7898, 0.1883), 8: Landmark(8, 0.1776, 1.2731)}
    rows = [
        ((2, 4.2719, 1.1540, 0.14322, 0.09012), (-0.7200, 0.8809, -1.9078)),
        ((8, 2.9443, -0.3361, 0.07061, 0.06102), (-0.6288, 0.3489, -1.2154)),
        ((8, 2.6758, -1.6817, 0.00552, 0.00853), (0.0319, -0.0126, -0.1492)),
        ((8, 2.6840, -1.7294, 0.00432, 0.00679), (0.0585, -0.0109, -0.1121)),
        ((8, 2.6969, -1.7743, 0.00332, 0.00504), (0.0846, -0.0083, -0.0752)),
        ((8, 2.7019, -1.8210, 0.00261, 0.00327), (0.1102, -0.0048, -0.0388)),
        ((8, 2.7189, -1.8619, 0.00235, 0.00144), (0.137, 0.0, 0.0)),
    ]
    measured = [RangeBearing(0.0, *row) for row, _ in rows]
    mounts = [Pose2D(*mount) for _, mount in rows]
    assert refusal(fix(measured, marks, 0.137, mounts=mounts)).code == "contradiction"


def test_sightings_of_one_landmark_do_not_make_a_covariance() -> None:
    """From a robot that turned between two sightings of one landmark; met in a bad recording."""
    rows = [(3.1637, 0.8227), (3.1431, 0.8033)]
    information = np.zeros((3, 3))
    for distance, bearing in rows:
        row = np.array((math.cos(bearing), math.sin(bearing), distance))
        information += np.outer(row, row) / 0.015**2
    assert covariance_of(information) is None
    whole = covariance_of(np.diag((4.0, 1.0, 0.25)))
    assert whole is not None
    assert np.allclose(whole, np.diag((0.25, 1.0, 4.0)))
