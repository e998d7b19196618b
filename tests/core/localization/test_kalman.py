"""Table 1 of the paper, and the extended filter's arithmetic."""

from __future__ import annotations

import math
import time

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from polepilot.core.errors import InternalError
from polepilot.core.geometry import Pose2D, wrap_angle
from polepilot.core.landmark import Landmark
from polepilot.core.localization.ekf import PAN, PANS, RANGE, SPEED, STATES, STEERING, PoseFilter
from polepilot.core.localization.kalman import AxisFilter
from polepilot.core.localization.noise import NoiseModel
from polepilot.core.localization.odometry import OdometryHistory, Step
from polepilot.core.localization.radial import RadialFilter, radial_correction
from polepilot.core.observation import Odometry, RangeBearing

MARK = Landmark(1, 6.0, 3.0)


@pytest.mark.parametrize(
    ("first", "second", "result"), [(130.24, 138.84, 133.94), (174.51, 177.11, 175.63)]
)
def test_table_1(first: float, second: float, result: float) -> None:
    axis = AxisFilter()
    assert axis.update(first) == pytest.approx(first)
    assert axis.gain == pytest.approx(0.647, abs=5e-4)
    assert axis.variance == pytest.approx(0.353, abs=5e-4)
    assert axis.update(second) == pytest.approx(result, abs=0.005)
    assert axis.gain == pytest.approx(0.430, abs=5e-4)
    assert axis.variance == pytest.approx(0.201, abs=5e-4)


def test_the_printed_filter_ends_at_a_gain_of_one_seventh() -> None:
    axis = AxisFilter()
    for _ in range(200):
        axis.update(1.0)
    assert axis.gain == pytest.approx(1 / 7, abs=1e-3)
    assert axis.variance < 1e-6


def test_an_impossible_axis_filter_is_refused() -> None:
    with pytest.raises(InternalError):
        AxisFilter(measurement_noise=0.0)


def test_the_radial_correction_makes_the_range_agree() -> None:
    predicted = Pose2D(1.0, 1.0, 0.4)
    seen = RangeBearing(0.0, 1, 5.0, 0.0, 0.02, 0.001)
    moved = radial_correction(predicted, seen, MARK, 0.1)
    assert math.dist(moved.ahead(0.1), MARK.position) == pytest.approx(5.0)
    direction = math.atan2(moved.y - predicted.y, moved.x - predicted.x)
    line = math.atan2(3.0 - predicted.ahead(0.1)[1], 6.0 - predicted.ahead(0.1)[0])
    assert math.sin(direction - line) == pytest.approx(0.0, abs=1e-9)
    assert moved.heading == predicted.heading


def test_the_radial_filter_goes_a_share_of_the_way_and_keeps_the_heading() -> None:
    tracked = RadialFilter(0.2, 0.1)
    tracked.reset(Pose2D(1.0, 1.0, 0.4), np.eye(3) * 1e-4)
    seen = RangeBearing(0.0, 1, 5.6, 0.0, 0.02, 0.001)
    full = radial_correction(tracked.pose, seen, MARK, 0.1)
    taken, gap = tracked.take(seen, MARK, 0.2)
    assert not taken
    assert gap == pytest.approx(math.dist(full.position, (1.0, 1.0)))
    assert tracked.pose == Pose2D(1.0, 1.0, 0.4)
    tracked.update(seen, MARK)
    assert tracked.pose.x == pytest.approx(1.0 + 11 / 17 * (full.x - 1.0))
    assert tracked.pose.heading == 0.4


def fresh(pose: Pose2D, sigma: float = 0.05, surveyed: tuple[int, ...] = ()) -> PoseFilter:
    tracked = PoseFilter(0.2, 0.1, surveyed=surveyed)
    tracked.reset(pose, np.diag([sigma**2, sigma**2, 0.03**2]))
    return tracked


def measure(state: np.ndarray, pan: float) -> tuple[float, float]:
    """Range and bearing that a state explains, written out anew."""
    x, y, heading = state[:3]
    shift = state[STATES:] if len(state) > STATES else (0.0, 0.0)
    dx = MARK.x + shift[0] - x - 0.1 * math.cos(heading)
    dy = MARK.y + shift[1] - y - 0.1 * math.sin(heading)
    distance = math.hypot(dx, dy)
    bent = float(np.polynomial.legendre.legval(pan / math.radians(135), state[PAN:STATES]))
    bearing = math.atan2(dy, dx) - heading + bent
    return distance * (1 + state[RANGE]), wrap_angle(bearing)


@pytest.mark.parametrize("surveyed", [(), (1,)])
def test_the_measurement_jacobian_matches_differences(surveyed: tuple[int, ...]) -> None:
    tracked = fresh(Pose2D(2.0, 1.0, 0.7), surveyed=surveyed)
    size = STATES + 2 * len(surveyed)
    tracked.state[3:] = np.random.default_rng(3).normal(0, 0.01, size - 3)
    seen = RangeBearing(0.0, 1, 4.0, 0.3, 0.02, 0.001, pan=0.5)
    innovation = tracked.innovation(seen, MARK)
    expected = measure(tracked.state, 0.5)
    assert innovation.range_gap == pytest.approx(4.0 - expected[0])
    assert innovation.bearing_gap == pytest.approx(wrap_angle(0.3 - expected[1]))
    for column in range(size):
        high, low = tracked.state.copy(), tracked.state.copy()
        high[column] += 1e-6
        low[column] -= 1e-6
        numeric = (np.array(measure(high, 0.5)) - measure(low, 0.5)) / 2e-6
        assert innovation.jacobian[:, column] == pytest.approx(numeric, abs=1e-6)


def test_a_landmark_appears_where_it_stands_once_distortions_are_known() -> None:
    tracked = fresh(Pose2D(2.0, 1.0, 0.7))
    tracked.state[3:] = np.random.default_rng(3).normal(0, 0.01, STATES - 3)
    exact = measure(tracked.state, 0.5)
    seen = RangeBearing(0.0, 1, *exact, 0.02, 0.001, pan=0.5)
    assert tracked.appears(seen) == pytest.approx(MARK.position)
    blind = RangeBearing(0.0, 1, math.inf, exact[1], math.inf, 0.001, pan=0.5)
    assert tracked.appears(blind) is None


def test_the_update_is_the_textbook_one() -> None:
    tracked = fresh(Pose2D(2.0, 1.0, 0.7))
    seen = RangeBearing(0.0, 1, 4.4, 0.1, 0.02, 0.001, pan=0.1)
    before, innovation = tracked.covariance.copy(), tracked.innovation(seen, MARK)
    h, noise = innovation.jacobian, tracked.noise
    r = np.diag(
        [
            0.02**2 + noise.range_floor**2 + noise.survey_sigma**2,
            0.001**2 + noise.bearing_floor**2 + (noise.survey_sigma / innovation.distance) ** 2,
        ]
    )
    gap = np.array([innovation.range_gap, innovation.bearing_gap])
    s = h @ before @ h.T + r
    gain = before @ h.T @ np.linalg.inv(s)
    assert innovation.squared == pytest.approx(gap @ np.linalg.solve(s, gap))
    state = tracked.state + gain @ gap
    tracked.update(innovation)
    assert tracked.state == pytest.approx(state)
    assert tracked.covariance == pytest.approx((np.eye(STATES) - gain @ h) @ before, abs=1e-12)


def test_the_maps_errors_are_not_averaged_away() -> None:
    """Sightings of one landmark repeat its error: they cannot make the pose surer than the map."""
    sure = NoiseModel(
        range_prior=1e-6, pan_priors=(1e-9,) * PANS, position_limit=0.0, heading_limit=0.0
    )
    sigmas = []
    for surveyed in ((), (1, 2)):
        tracked = PoseFilter(0.2, 0.1, sure, surveyed=surveyed)
        tracked.reset(Pose2D(2.0, 1.0, 0.7), np.diag([0.05**2, 0.05**2, 0.03**2]))
        exact = measure(tracked.state, 0.0)
        other = Landmark(2, 2.0, 6.0)
        dx, dy = other.x - 2.0 - 0.1 * math.cos(0.7), other.y - 1.0 - 0.1 * math.sin(0.7)
        bearing = wrap_angle(math.atan2(dy, dx) - 0.7)
        for _ in range(500):
            tracked.take(RangeBearing(0.0, 1, *exact, 0.01, 0.001, pan=0.0), MARK, 0.2)
            seen = RangeBearing(0.0, 2, math.hypot(dx, dy), bearing, 0.01, 0.001, pan=bearing)
            tracked.take(seen, other, 0.2)
        sigmas.append(float(np.sqrt(tracked.covariance[0, 0])))
    assert sigmas[0] < 0.001
    assert sigmas[1] > 0.003


@settings(deadline=None, max_examples=25)
@given(st.integers(0, 10_000))
def test_the_covariance_stays_one(seed: int) -> None:
    rng = np.random.default_rng(seed)
    tracked = fresh(Pose2D(2.0, 1.0, 0.7), surveyed=(1,))
    for _ in range(60):
        tracked.predict([Step(0.05, rng.uniform(-0.4, 0.4), rng.uniform(-0.5, 0.5), 0.1, 0.5)])
        distance, bearing = measure(tracked.state, 0.2)
        noise = rng.normal(0, (0.02, 0.002))
        seen = RangeBearing(0.0, 1, distance + noise[0], bearing + noise[1], 0.02, 0.002, 0.2)
        tracked.take(seen, MARK, 0.2)
    p = tracked.covariance
    assert p == pytest.approx(p.T, abs=1e-15)
    assert np.linalg.eigvalsh(p).min() > 0


def test_prediction_carries_the_covariance_as_samples_do() -> None:
    rng = np.random.default_rng(11)
    tracked = fresh(Pose2D(0.0, 0.0, 0.3), 0.02)
    start = tracked.covariance.copy()
    step = Step(0.05, 0.4, 0.2, 0.0)
    states = rng.multivariate_normal(tracked.state, start, 4000)
    for _ in range(40):
        tracked.predict([step])
        speed = step.speed * (
            1 + states[:, SPEED] + rng.normal(0, tracked.noise.speed_noise / math.sqrt(0.05), 4000)
        )
        angle = step.steering + states[:, STEERING]
        angle = angle + rng.normal(0, tracked.noise.steering_noise / math.sqrt(0.05), 4000)
        turn = speed * np.tan(angle) / 0.2 * 0.05
        states[:, 0] += speed * 0.05 * np.cos(states[:, 2] + turn / 2)
        states[:, 1] += speed * 0.05 * np.sin(states[:, 2] + turn / 2)
        states[:, 2] += turn
    sampled = np.cov(states[:, :3].T)
    assert np.sqrt(np.diag(tracked.covariance)[:3]) == pytest.approx(
        np.sqrt(np.diag(sampled)), rel=0.15
    )


def test_a_standing_robot_never_believes_the_impossible() -> None:
    tracked = fresh(Pose2D(2.0, 1.0, 0.7))
    exact = measure(tracked.state, 0.2)
    seen = RangeBearing(0.0, 1, exact[0], exact[1], 0.01, 0.0005, pan=0.2)
    other = Landmark(2, 2.0, 6.0)
    for _ in range(3000):
        tracked.predict([Step(0.05, 0.0, 0.0, 0.0)])
        assert tracked.take(seen, MARK, 0.2)[0]
        tracked.innovation(seen, other)
    assert np.linalg.eigvalsh(tracked.covariance).min() > 0
    assert np.sqrt(tracked.covariance[:3, :3].diagonal()).min() >= 0.8 * math.radians(0.1)


def test_a_bearing_alone_is_taken_in() -> None:
    tracked = fresh(Pose2D(2.0, 1.0, 0.7))
    exact = measure(tracked.state, 0.0)
    seen = RangeBearing(0.0, 1, math.inf, exact[1] + 0.01, math.inf, 0.001, pan=0.0)
    before = tracked.covariance[2, 2]
    assert tracked.take(seen, MARK, 0.2)[0]
    assert tracked.covariance[2, 2] < before
    assert np.isfinite(tracked.state).all()


def test_a_wrong_measurement_is_not_taken() -> None:
    tracked = fresh(Pose2D(2.0, 1.0, 0.7), 0.01)
    exact = measure(tracked.state, 0.0)
    before = tracked.state.copy(), tracked.covariance.copy()
    taken, gap = tracked.take(
        RangeBearing(0.0, 1, exact[0] + 1.0, exact[1], 0.02, 0.001, pan=0.0), MARK, 0.2
    )
    assert not taken
    assert gap == pytest.approx(1.0)
    assert (tracked.state == before[0]).all()
    assert (tracked.covariance == before[1]).all()
    # A small contradiction only makes it less sure.
    assert not tracked.take(
        RangeBearing(0.0, 1, exact[0] + 0.15, exact[1], 0.002, 0.001, pan=0.0), MARK, 0.2
    )[0]
    assert tracked.covariance[0, 0] > before[1][0, 0]


def test_a_measurement_costs_less_than_100_microseconds() -> None:
    """With the prediction since the picture before, and the map's errors of twelve landmarks."""
    tracked = fresh(Pose2D(2.0, 1.0, 0.7), surveyed=tuple(range(1, 13)))
    history = OdometryHistory(0.2, steering_lag=0.1, speed_lag=0.05)
    for index in range(40):
        history.add(Odometry(0.05 * index, 0.3, 0.1 * math.sin(index)))
    exact = measure(tracked.state[:STATES], 0.0)
    seen = RangeBearing(0.0, 1, exact[0], exact[1], 0.02, 0.001, pan=0.0)
    durations = []
    for _ in range(400):
        copy = tracked.copy()
        begin = time.perf_counter()
        copy.predict(history.steps(1.03, 1.11))
        copy.take(seen, MARK, 0.2)
        durations.append(time.perf_counter() - begin)
    # Some 40 microseconds alone on a core; others may be using it too.
    assert float(np.percentile(durations, 10)) < 100e-6


def far(stamp: float, number: int) -> tuple[RangeBearing, Landmark]:
    """One of many landmarks on a circle round the robot, exactly where the map has it."""
    angle = 0.3 * number
    mark = Landmark(number, 3.0 * math.cos(angle), 3.0 * math.sin(angle))
    bearing = wrap_angle(angle)
    return RangeBearing(stamp, number, 3.0, bearing, 0.01, 0.002, 0.0), mark


def test_places_in_the_state_go_to_those_seen_last() -> None:
    """With fewer places than landmarks no landmark's error counts as fresh noise."""
    tracked = PoseFilter(0.2, 0.0, surveyed=(1, 2, 3), shared=True)
    tracked.reset(Pose2D(0.0, 0.0, 0.0), np.diag([0.01, 0.01, 0.01]))
    sigma = tracked.noise.survey_sigma
    for number in (5, 6, 5, 6, 7, 5, 6):
        tracked.take(*far(0.0, number), 0.2)
    copied = tracked.copy()
    before = tracked.covariance.copy()
    # Three stand still in the picture: for hours it would be the map that limits what is known.
    for _ in range(2000):
        for number in (5, 6, 7):
            tracked.take(*far(0.0, number), 0.2)
    spread = math.sqrt(float(np.linalg.eigvalsh(tracked.pose_covariance[:2, :2])[0]))
    assert spread > 0.5 * sigma / math.sqrt(3)
    # A fourth takes the place of the one that was not seen for longest.
    tracked.take(*far(0.0, 8), 0.2)
    assert set(tracked.covariance.diagonal()[STATES:].tolist()) != {sigma**2}
    shape = tracked.state.shape
    # The copy is as it was.
    assert np.array_equal(copied.covariance, before)
    for number in range(1, 16):
        tracked.take(*far(0.0, number), 0.2)
    assert tracked.state.shape == shape
    assert np.linalg.eigvalsh(tracked.covariance).min() > 0.0


def test_a_landmark_beyond_the_places_is_as_one_that_has_its_own() -> None:
    """Sixteen places or not: standing before three landmarks gives the same pose."""
    poses = []
    for surveyed, shared in (((1, 2, 3), False), ((11, 12, 13), True)):
        tracked = PoseFilter(0.2, 0.0, surveyed=surveyed, shared=shared)
        tracked.reset(Pose2D(0.02, -0.01, 0.01), np.diag([0.01, 0.01, 0.01]))
        for _ in range(50):
            for number in (1, 2, 3):
                tracked.take(*far(0.0, number), 0.2)
        poses.append((np.array(tracked.pose), tracked.pose_covariance))
    assert poses[0][0] == pytest.approx(poses[1][0], abs=1e-9)
    assert poses[0][1] == pytest.approx(poses[1][1], abs=1e-12)
