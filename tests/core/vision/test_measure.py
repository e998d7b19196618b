from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from polepilot.core.landmark import LandmarkKind
from polepilot.core.observation import Detection
from polepilot.core.vehicle import Camera
from polepilot.core.vision.kernel import Strip
from polepilot.core.vision.measure import (
    Pitch,
    bearing_of,
    column_of,
    depth_of,
    measure,
    pitch_of,
    pixels_of,
    range_of,
    stands,
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


def strip(kind: LandmarkKind, away: float, pitch: float, up: float = -0.075) -> Strip:
    """A pole straight ahead whose middle is ``up`` above the lens, as a pitched camera sees it."""
    depth = away - kind.axis_depth
    rows = []
    for k in range(kind.segments + 1):
        height = up + kind.height / 2 - k * kind.segment
        rise = math.tan(math.atan2(height, depth) - pitch)
        rows.append(CAMERA.center_y - CAMERA.constant * rise)
    places = np.arange(kind.segments + 1) - kind.segments / 2
    # row = middle + unit * k / (1 + sag * k), linear in its three unknowns.
    system = np.column_stack([np.ones_like(places), places, -np.multiply(rows, places)])
    middle, slope, sag = np.linalg.lstsq(system, np.asarray(rows), rcond=None)[0]
    return Strip(
        id=1, bits=kind.bits, column=CAMERA.center_x, row=middle, unit=slope - middle * sag,
        sag=sag, front=1.0, unit_sigma=1e-4, sag_sigma=1e-5, column_sigma=0.1,
    )  # fmt: skip


@settings(deadline=None)
@given(st.floats(1.8, 20.0), st.floats(-0.035, 0.035), st.sampled_from((4, 8)))
def test_a_camera_that_looks_up_or_down_measures_the_same_range(
    away: float, pitch: float, bits: int
) -> None:
    kind = LandmarkKind(bits=bits)
    seen = strip(kind, away, pitch, kind.height / 2 - CAMERA.mount_height)
    one = measure(seen, kind, Pitch(pitch, 0.0), CAMERA)
    assert one.range == pytest.approx(away, rel=1e-6)
    assert stands(seen, kind, CAMERA)
    found = pitch_of([(seen, kind)], CAMERA)
    assert abs(found.angle - pitch) < 3 * found.sigma
    one = measure(seen, kind, found, CAMERA)
    assert abs(one.range - away) < 3 * one.range_sigma


def test_nothing_stands_under_the_floor() -> None:
    kind = LandmarkKind()
    assert not stands(strip(kind, 15.0, 0.0, up=-2.0), kind, CAMERA)
    assert not stands(strip(kind, 15.0, 0.0, up=5.0), kind, CAMERA)
    assert stands(strip(kind, 3.0, 0.0, up=1.4), kind, CAMERA)


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
