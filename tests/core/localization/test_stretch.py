"""A chain of steps against the steps one by one, and against differences."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from polepilot.core.geometry import Pose2D
from polepilot.core.localization.noise import NoiseModel
from polepilot.core.localization.odometry import Step, advance
from polepilot.core.localization.stretch import Distortions, drive

STEPS = st.lists(
    st.builds(
        Step,
        st.floats(0.01, 0.1),
        st.floats(-0.5, 0.5),
        st.floats(-0.6, 0.6),
        st.floats(0.0, 0.3),
        st.floats(-1.0, 1.0),
        st.floats(0.0, 0.2),
        st.floats(-1.0, 1.0),
        st.floats(-1.0, 1.0),
    ),
    min_size=1,
    max_size=6,
)
WRONG = st.builds(
    Distortions,
    st.floats(-0.05, 0.05),
    st.floats(-0.03, 0.03),
    st.floats(-0.05, 0.05),
    st.floats(-0.05, 0.05),
    st.floats(-0.05, 0.05),
)
HEADINGS = st.floats(-3.1, 3.1)


def driven(heading: float, steps: list[Step], wrong: Distortions) -> np.ndarray:
    pose = Pose2D(0.0, 0.0, heading)
    turned = 0.0
    for step in steps:
        if step.speed == 0.0:
            continue
        speed = (step.speed + step.speed_by_lag * wrong.motor) * (1 + wrong.speed)
        steering = step.steering + wrong.steering + step.by_lag * wrong.servo
        steering += step.by_slowness * wrong.slowness
        moved = advance(Pose2D(pose.x, pose.y, heading + turned), speed, steering, step.dt, 0.2)
        turned += speed * step.dt * np.tan(steering) / 0.2
        pose = moved
    return np.array([pose.x, pose.y, turned])


@settings(deadline=None, max_examples=60)
@given(HEADINGS, STEPS, WRONG)
def test_a_stretch_is_its_steps(heading: float, steps: list[Step], wrong: Distortions) -> None:
    stretch = drive(heading, steps, wrong, NoiseModel(), 0.2)
    if stretch is None:
        assert all(step.speed == 0.0 for step in steps)
        return
    expected = driven(heading, steps, wrong)
    assert (stretch.dx, stretch.dy, stretch.turn) == pytest.approx(expected, abs=1e-9)
    assert stretch.moving == pytest.approx(sum(s.dt for s in steps if s.speed))
    small = 1e-6
    for column in range(5):
        high, low = list(wrong), list(wrong)
        high[column] += small
        low[column] -= small
        numeric = driven(heading, steps, Distortions(*high))
        numeric -= driven(heading, steps, Distortions(*low))
        assert stretch.jacobian[:, 3 + column] == pytest.approx(numeric / (2 * small), abs=1e-5)
    numeric = driven(heading + small, steps, wrong) - driven(heading - small, steps, wrong)
    assert stretch.jacobian[:2, 2] == pytest.approx(numeric[:2] / (2 * small), abs=1e-5)


@settings(deadline=None, max_examples=60)
@given(HEADINGS, STEPS, WRONG)
def test_noise_adds_up_along_the_way(heading: float, steps: list[Step], wrong: Distortions) -> None:
    """The noise of a stretch is that of its parts, each carried on to the end."""
    model = NoiseModel()
    whole = drive(heading, steps, wrong, model, 0.2)
    noise = np.zeros((3, 3))
    turned = 0.0
    for step in steps:
        part = drive(heading + turned, [step], wrong, model, 0.2)
        if part is None:
            continue
        carry = part.jacobian[:, :3]
        noise = carry @ noise @ carry.T + part.noise
        turned += part.turn
    if whole is None:
        assert (noise == 0.0).all()
        return
    assert whole.noise == pytest.approx(noise, abs=1e-12)
    assert np.linalg.eigvalsh(whole.noise).min() > -1e-15


def test_the_same_way_in_finer_steps_is_as_uncertain() -> None:
    noises = []
    for count in (1, 2, 8):
        steps = [Step(0.1 / count, 0.3, 0.2, 0.1, 0.0, 0.05)] * count
        stretch = drive(0.3, steps, Distortions(0.0, 0.0, 0.0, 0.0), NoiseModel(), 0.2)
        assert stretch is not None
        noises.append(stretch.noise)
    assert noises[0] == pytest.approx(noises[2], rel=0.05, abs=1e-9)
    assert noises[1] == pytest.approx(noises[2], rel=0.02, abs=1e-9)


def test_who_stands_adds_nothing() -> None:
    steps = [Step(0.5, 0.0, 0.1, 0.0)] * 3
    assert drive(0.0, steps, Distortions(0.0, 0.0, 0.0, 0.0), NoiseModel(), 0.2) is None
