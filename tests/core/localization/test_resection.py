"""The camera's pose without a known pan angle."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from polepilot.core.geometry import Pose2D, wrap_angle
from polepilot.core.landmark import Landmark
from polepilot.core.localization.fix import FixRefusal
from polepilot.core.localization.resection import Resection, resect, three_bearings
from polepilot.core.observation import RangeBearing

MARKS = {
    1: Landmark(1, 0.0, 0.0),
    2: Landmark(2, 8.0, 0.5),
    3: Landmark(3, 7.5, 6.0),
    4: Landmark(4, 0.4, 5.5),
    5: Landmark(5, 4.0, 6.4),
}
FORWARD = 0.1
POSES = st.builds(Pose2D, st.floats(1.5, 6.5), st.floats(1.5, 4.5), st.floats(-3.1, 3.1))
ZEROS = st.floats(-3.1, 3.1)


def seen(
    base: Pose2D,
    zero: float,
    ids: tuple[int, ...] = (1, 2, 3, 4),
    *,
    ranges: bool = True,
    noise: np.random.Generator | None = None,
) -> list[RangeBearing]:
    """From a robot at ``base``, bearings counted from ``zero`` to the left of its heading."""
    camera = base.compose(Pose2D(FORWARD, 0.0, 0.0))
    out = []
    for number in ids:
        distance = camera.distance_to(MARKS[number].position)
        bearing = wrap_angle(camera.bearing_to(MARKS[number].position) - zero)
        sigma, turned = 0.003 * distance, math.radians(0.05)
        if noise is not None:
            distance += float(noise.normal(0, sigma))
            bearing += float(noise.normal(0, turned))
        where = (distance, sigma) if ranges else (math.inf, math.inf)
        out.append(RangeBearing(0.0, number, where[0], bearing, where[1], turned))
    return out


@settings(deadline=None, max_examples=50)
@given(POSES, ZEROS)
def test_three_ranges_and_differences_of_bearing_tell_all(base: Pose2D, zero: float) -> None:
    answer = resect(seen(base, zero, (1, 3, 4)), MARKS)
    assert isinstance(answer, Resection)
    found = answer.base(zero, FORWARD)
    assert found.distance_to(base.position) < 1e-6
    assert abs(wrap_angle(found.heading - base.heading)) < 1e-6


@settings(deadline=None, max_examples=100)
@given(POSES, ZEROS, st.permutations([1, 2, 3, 4, 5]))
def test_three_bearings_meet_in_one_point(base: Pose2D, zero: float, order: list[int]) -> None:
    three = tuple(order[:3])
    measured = seen(base, zero, three, ranges=False)
    camera = base.compose(Pose2D(FORWARD, 0.0, 0.0))
    bearings = [m.bearing for m in measured]
    differences = [a - b for a, b in zip(bearings, bearings[1:] + bearings[:1], strict=True)]
    assume(min(abs(math.sin(d)) for d in differences) > 0.02)
    # Off the circle through the three, on which they would not tell.
    rows = [[*MARKS[n].position, 1.0] for n in three]
    sides = [-(x * x + y * y) for x, y, _ in rows]
    d, e, f = np.linalg.solve(np.array(rows), np.array(sides))
    x, y = camera.position
    assume(abs(x * x + y * y + d * x + e * y + f) > 1.0)
    point = three_bearings([MARKS[n].position for n in three], bearings)
    assert point is not None
    assert camera.distance_to(point) < 1e-5


@settings(deadline=None, max_examples=30)
@given(POSES, ZEROS, st.integers(0, 10_000))
def test_bearings_alone_are_enough_and_honest(base: Pose2D, zero: float, seed: int) -> None:
    rng = np.random.default_rng(seed)
    answer = resect(seen(base, zero, (1, 2, 3, 4, 5), ranges=False, noise=rng), MARKS)
    assert isinstance(answer, Resection)
    camera = base.compose(Pose2D(FORWARD, 0.0, 0.0))
    error = np.array(answer.camera) - np.array((camera.x, camera.y, base.heading + zero))
    error[2] = wrap_angle(float(error[2]))
    assert float(error @ np.linalg.solve(answer.covariance, error)) < 25.0
    assert math.hypot(error[0], error[1]) < 0.15


def test_a_wrong_bearing_is_left_out() -> None:
    measured = seen(Pose2D(3.0, 2.0, 0.4), 1.0, (1, 2, 3, 4, 5), ranges=False)
    wrong = measured[2]
    measured[2] = RangeBearing(0.0, 3, math.inf, wrong.bearing + 0.3, math.inf, 0.001)
    answer = resect(measured, MARKS)
    assert isinstance(answer, Resection)
    assert answer.outliers == (3,)
    assert answer.base(1.0, FORWARD).distance_to((3.0, 2.0)) < 1e-6


@pytest.mark.parametrize(
    ("ids", "reason"),
    [
        ((), "No landmark of the map has been seen: without a known pan angle a fix needs three."),
        ((2,), "Only landmark 2 has been seen: without a known pan angle a fix needs three."),
        ((2, 4), "Only landmarks 2 and 4 have been seen: without a known pan angle a fix needs t"),
    ],
)
def test_fewer_than_three_are_refused(ids: tuple[int, ...], reason: str) -> None:
    answer = resect(seen(Pose2D(3.0, 2.0, 0.4), 1.0, ids), MARKS)
    assert isinstance(answer, FixRefusal)
    assert answer.reason.startswith(reason)


def test_on_the_dangerous_circle_bearings_do_not_tell() -> None:
    marks = {
        number: Landmark(number, 3 * math.cos(a), 3 * math.sin(a))
        for number, a in ((1, 0.2), (2, 1.5), (3, 2.8))
    }
    camera = Pose2D(3 * math.cos(-1.5), 3 * math.sin(-1.5), 0.0)
    measured = [
        RangeBearing(0.0, n, math.inf, camera.bearing_to(mark.position), math.inf, 0.001)
        for n, mark in marks.items()
    ]
    answer = resect(measured, marks)
    assert isinstance(answer, FixRefusal)
    assert answer.code == "one_direction"
    assert "circle" in answer.reason


def test_contradicting_ranges_are_refused() -> None:
    measured = seen(Pose2D(3.0, 2.0, 0.4), 1.0, (1, 2, 3))
    wrong = measured[0]
    measured[0] = RangeBearing(0.0, 1, wrong.range + 1.0, wrong.bearing, 0.01, 0.001)
    answer = resect(measured, MARKS)
    assert isinstance(answer, FixRefusal)
    assert answer.code == "contradiction"
