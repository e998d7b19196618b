from __future__ import annotations

import math

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from polepilot.core.landmark import LandmarkKind
from polepilot.core.observation import Detection
from polepilot.core.vehicle import Camera
from polepilot.core.vision.measure import (
    bearing_of,
    column_of,
    depth_of,
    half_width_of,
    pixels_of,
    range_of,
    to_range_bearing,
)

CAMERA = Camera()


def test_the_papers_camera_constant() -> None:
    assert pixels_of(0.65, 3.0, 600.0) == pytest.approx(130.0)
    assert depth_of(0.65, 130.0, 600.0) == pytest.approx(3.0)


def test_range_is_horizontal_and_to_the_axis() -> None:
    kind = LandmarkKind()
    ahead = range_of(10.0, 0.0, kind, CAMERA)
    assert ahead == pytest.approx(600 * 0.05 / 10 + 0.035)
    aside = range_of(10.0, 0.3, kind, CAMERA)
    assert aside == pytest.approx(3.0 / math.cos(0.3) + 0.035)
    assert range_of(10.0, 0.0, LandmarkKind(shape="flat"), CAMERA) == pytest.approx(3.0)


def test_left_of_the_axis_is_positive() -> None:
    assert bearing_of(0.0, CAMERA) == pytest.approx(math.atan2(199.5, 600))
    assert bearing_of(199.5, CAMERA) == 0.0
    assert bearing_of(399.0, CAMERA) < 0


@settings(deadline=None)
@given(st.floats(-1.4, 1.4))
def test_columns_and_bearings_are_inverse(bearing: float) -> None:
    assert bearing_of(column_of(bearing, CAMERA), CAMERA) == pytest.approx(bearing, abs=1e-9)


def test_width_of_a_far_cylinder() -> None:
    half = half_width_of(8.0, 0.0, LandmarkKind(), CAMERA)
    assert half == pytest.approx(600 * 0.035 / 8, rel=1e-4)


@settings(deadline=None)
@given(st.floats(-2.4, 2.4), st.floats(-0.3, 0.3))
def test_pan_is_added_and_wrapped(pan: float, bearing: float) -> None:
    seen = Detection(7, 3.0, bearing, 10.0, 5.0, 50.0, 0.01, 0.002)
    measured = to_range_bearing(seen, 12.5, pan)
    assert measured.stamp == 12.5
    assert measured.landmark == 7
    assert measured.range == 3.0
    assert -math.pi < measured.bearing <= math.pi
    assert math.cos(measured.bearing - pan - bearing) == pytest.approx(1.0)
    assert (measured.range_sigma, measured.bearing_sigma) == (0.01, 0.002)
