"""The motion model against numeric integration, and the bounded history."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from polepilot.core.geometry import Pose2D, wrap_angle
from polepilot.core.localization.odometry import (
    Following,
    OdometryHistory,
    advance,
    advance_with_jacobians,
)
from polepilot.core.observation import Odometry

POSES = st.builds(
    Pose2D, st.floats(-50, 50), st.floats(-50, 50), st.floats(-math.pi + 1e-9, math.pi)
)
SPEEDS = st.floats(-2, 2)
STEERING = st.one_of(st.floats(-0.7, 0.7), st.floats(-1e-6, 1e-6), st.just(0.0))
TIMES = st.floats(0, 2)
WHEELBASES = st.floats(0.1, 2)


def integrate(
    pose: Pose2D, speed: float, steering: float, dt: float, wheelbase: float, count: int = 200
) -> Pose2D:
    """Runge-Kutta on the differential equation of the bicycle, independent of the arc."""
    state = np.array(pose)
    step = dt / count
    rate = speed * math.tan(steering) / wheelbase

    def slope(s: np.ndarray) -> np.ndarray:
        return np.array([speed * math.cos(s[2]), speed * math.sin(s[2]), rate])

    for _ in range(count):
        k1 = slope(state)
        k2 = slope(state + 0.5 * step * k1)
        k3 = slope(state + 0.5 * step * k2)
        k4 = slope(state + step * k3)
        state = state + step / 6 * (k1 + 2 * k2 + 2 * k3 + k4)
    return Pose2D(float(state[0]), float(state[1]), wrap_angle(float(state[2])))


def assert_same(a: Pose2D, b: Pose2D, tolerance: float = 1e-6) -> None:
    assert a.distance_to(b.position) < tolerance
    assert abs(wrap_angle(a.heading - b.heading)) < tolerance


@settings(deadline=None, max_examples=60)
@given(POSES, SPEEDS, STEERING, TIMES, WHEELBASES)
def test_the_arc_is_the_integral(
    pose: Pose2D, speed: float, steering: float, dt: float, wheelbase: float
) -> None:
    assert_same(
        advance(pose, speed, steering, dt, wheelbase),
        integrate(pose, speed, steering, dt, wheelbase),
    )


@settings(deadline=None)
@given(POSES, SPEEDS, STEERING, TIMES, TIMES, WHEELBASES)
def test_two_short_arcs_are_one_long_arc(
    pose: Pose2D, speed: float, steering: float, first: float, second: float, wheelbase: float
) -> None:
    half = advance(pose, speed, steering, first, wheelbase)
    assert_same(
        advance(half, speed, steering, second, wheelbase),
        advance(pose, speed, steering, first + second, wheelbase),
        1e-9,
    )


@settings(deadline=None)
@given(POSES, SPEEDS, STEERING, TIMES, WHEELBASES)
def test_driving_back_returns(
    pose: Pose2D, speed: float, steering: float, dt: float, wheelbase: float
) -> None:
    there = advance(pose, speed, steering, dt, wheelbase)
    assert_same(advance(there, -speed, steering, dt, wheelbase), pose, 1e-9)


def test_no_jump_where_the_curvature_vanishes() -> None:
    origin = Pose2D(0, 0, 0)
    ends = [advance(origin, 1, g, 1, 0.2) for g in np.linspace(-1e-7, 1e-7, 41)]
    steps = np.diff(np.array(ends), axis=0)
    assert np.abs(steps[:, 1] - 0.5 * 5e-9 / 0.2).max() < 1e-13
    assert np.abs(steps[:, 0]).max() < 1e-13


@settings(deadline=None)
@given(POSES, SPEEDS, STEERING, TIMES, WHEELBASES)
def test_jacobians_match_differences(
    pose: Pose2D, speed: float, steering: float, dt: float, wheelbase: float
) -> None:
    moved, jacobian = advance_with_jacobians(pose, speed, steering, dt, wheelbase)
    assert_same(moved, advance(pose, speed, steering, dt, wheelbase), 1e-9)
    inputs = np.array([*pose, speed, steering])
    small = 1e-6
    for column in range(5):
        low, high = inputs.copy(), inputs.copy()
        low[column] -= small
        high[column] += small
        a = advance(Pose2D(*low[:3]), low[3], low[4], dt, wheelbase)
        b = advance(Pose2D(*high[:3]), high[3], high[4], dt, wheelbase)
        numeric = np.array([b.x - a.x, b.y - a.y, wrap_angle(b.heading - a.heading)]) / (2 * small)
        scale = 1 + np.abs(jacobian[:, column]).max()
        assert np.abs(numeric - jacobian[:, column]).max() < 1e-4 * scale**2


@pytest.mark.parametrize("turn", [0.999e-3, 1.001e-3, -0.999e-3, -1.001e-3])
def test_series_and_formula_meet(turn: float) -> None:
    steering = math.atan(turn * 0.2)
    _, jacobian = advance_with_jacobians(Pose2D(0, 0, 0), 1.0, steering, 1.0, 0.2)
    by_curvature = jacobian[:2, 4] / ((1 + (turn * 0.2) ** 2) / 0.2)
    assert by_curvature[0] == pytest.approx(-turn / 3 + turn**3 / 30, abs=1e-10)
    assert by_curvature[1] == pytest.approx(0.5 - turn**2 / 8, abs=1e-10)


def test_history_holds_a_command_until_the_next() -> None:
    history = OdometryHistory(0.2)
    history.add(Odometry(1.0, 0.5, 0.0))
    history.add(Odometry(2.0, 0.5, 0.3))
    history.add(Odometry(3.0, 0.0, 0.3))
    expected = advance(Pose2D(0.5, 0.0, 0.0), 0.5, 0.3, 1.0, 0.2)
    assert_same(history.advance(Pose2D(0, 0, 0), 0.0, 9.0), advance(expected, 0, 0, 0, 0.2), 1e-9)
    assert history.moved(0.0, 9.0) == (pytest.approx(1.0), pytest.approx(2.0))
    assert_same(
        history.advance(history.advance(Pose2D(1, 2, 3), 1.3, 2.7), 2.7, 1.3),
        Pose2D(1, 2, 3),
        1e-9,
    )


def test_history_models_the_servo() -> None:
    history = OdometryHistory(0.2, steering_lag=0.1, longest_step=0.001)
    history.add(Odometry(0.0, 1.0, 0.0))
    history.add(Odometry(1.0, 1.0, 0.2))
    steps = list(history.steps(1.0, 1.5))
    assert steps[0].steering == pytest.approx(0.0, abs=0.002)
    assert steps[0].unsettled == pytest.approx(0.2, abs=0.002)
    assert steps[100].steering == pytest.approx(0.2 * (1 - math.exp(-1.005)), abs=1e-4)


COMMANDS = [(0.0, 0.0), (0.5, 0.3), (0.2, -0.2), (0.6, 0.1), (0.4, 0.4)]
WIDE = [(0.4, -0.5), (0.4, 0.5), (0.4, 0.5), (0.2, -0.5), (0.3, 0.3)]


def lagging(
    lag: float, slowness: float, commands: list[tuple[float, float]] = COMMANDS
) -> OdometryHistory:
    history = OdometryHistory(
        0.2, steering_lag=lag, speed_lag=2 * lag, steering_slowness=slowness, longest_step=0.01
    )
    for index, (speed, angle) in enumerate(commands):
        history.add(Odometry(0.15 * index, speed, angle))
    return history


@pytest.mark.parametrize("slowness", [0.0, 0.3, 0.45])
def test_the_effect_of_lags_matches_differences(slowness: float) -> None:
    history = lagging(0.3, 0.1)
    history.retune(Following(0.2, 0.1, slowness))
    steps = list(history.steps(0.15, 0.9))
    same, low, high = (
        list(lagging(x, slowness).steps(0.15, 0.9)) for x in (0.1, 0.1 - 1e-5, 0.1 + 1e-5)
    )
    assert [s.steering for s in steps] == pytest.approx([s.steering for s in same])
    assert [s.speed for s in steps] == pytest.approx([s.speed for s in same])
    for step, a, b in zip(steps, low, high, strict=True):
        assert step.by_lag == pytest.approx((b.steering - a.steering) / 2e-5, abs=1e-3)
        assert step.speed_by_lag == pytest.approx((b.speed - a.speed) / 4e-5, abs=1e-4)


@pytest.mark.parametrize("slowness", [0.0, 0.1, 0.3, 0.45])
def test_what_a_slower_servo_would_do_is_known(slowness: float) -> None:
    """Also where a servo as fast as believed would make no difference: so it can be learned."""
    history = lagging(0.3, 0.2, WIDE)
    history.retune(Following(0.2, 0.1, slowness))
    steps = list(history.steps(0.15, 0.9))
    slower = list(lagging(0.1, slowness + 0.15, WIDE).steps(0.15, 0.9))
    expected = [(b.steering - a.steering) / 0.15 for a, b in zip(steps, slower, strict=True)]
    assert [s.by_slowness for s in steps] == pytest.approx(expected, abs=1e-9)
    assert max(map(abs, expected)) > 0.1


def test_a_slow_servo_needs_its_time() -> None:
    """Against an integration in small steps."""
    history = OdometryHistory(0.2, steering_lag=0.1, steering_slowness=1 / 3, longest_step=0.01)
    history.add(Odometry(0.0, 0.3, 0.5))
    history.add(Odometry(1.0, 0.3, -0.5))
    angle, small = 0.5, 1e-4
    reached = []
    for _ in range(10_000):
        angle += min(max((-0.5 - angle) / 0.1, -3.0), 3.0) * small
        reached.append(angle)
    steps = list(history.steps(1.0, 2.0))
    told = [reached[round((0.01 * index + 0.005) / small) - 1] for index in range(100)]
    assert [step.steering for step in steps] == pytest.approx(told, abs=2e-3)
    assert abs(steps[10].steering - (0.5 - 3.0 * 0.105)) < 1e-9


def test_history_is_bounded_and_ignores_nonsense() -> None:
    history = OdometryHistory(0.2, span=2.0)
    for index in range(20_000):
        history.add(Odometry(0.02 * index, 0.3, 0.0))
    size = len(history)
    assert size <= 2 * 2.0 / 0.02 + 2
    history.add(Odometry(1.0, 5.0, 0.0))
    history.add(Odometry(math.nan, 5.0, 0.0))
    history.add(Odometry(500.0, math.inf, 0.0))
    assert len(history) == size
    assert history.moved(399.0, 399.5)[0] == pytest.approx(0.15, abs=1e-9)
