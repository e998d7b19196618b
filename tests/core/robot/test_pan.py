from __future__ import annotations

import math

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from polepilot.core.observation import PanReading
from polepilot.core.robot.pan import PanSweep, PanTrack


def track(*readings: tuple[float, float]) -> PanTrack:
    pan = PanTrack()
    for stamp, angle in readings:
        pan.add(PanReading(stamp, angle))
    return pan


def test_interpolates_between_readings() -> None:
    pan = track((0.0, 0.0), (0.02, 0.2), (0.04, 0.1))
    assert pan.at(0.01) == pytest.approx(0.1)
    assert pan.at(0.03) == pytest.approx(0.15)
    assert pan.at(0.04) == pytest.approx(0.1)


def test_does_not_guess_outside_its_readings() -> None:
    pan = track((1.0, 0.0), (1.02, 0.2))
    assert pan.at(0.99) is None
    assert pan.at(1.03) is None
    assert PanTrack().at(0.0) is None


def test_forgets_what_is_old_and_ignores_what_goes_back() -> None:
    pan = track(*((0.02 * i, 0.001 * i) for i in range(200)))
    assert pan.at(1.0) is None
    pan.add(PanReading(0.5, 9.0))
    assert pan.latest == PanReading(0.02 * 199, 0.001 * 199)


@settings(deadline=None)
@given(st.floats(0.2, 1.0), st.floats(0.5, 3.0), st.floats(-2.0, 2.0))
def test_sweeps_between_its_ends_for_ever(duty: float, rate: float, angle: float) -> None:
    low, high = math.radians(-135), math.radians(135)
    sweep = PanSweep(low, high, duty)
    seen = set()
    for _ in range(3000):
        wanted = sweep.rate(angle)
        assert abs(wanted) == duty
        seen.add(wanted > 0)
        angle += wanted * rate * 0.02
        assert low <= angle <= high
    assert seen == {True, False}


def test_does_not_turn_blindly() -> None:
    assert PanSweep(-2.0, 2.0, 1.0).rate(None) == 0.0
