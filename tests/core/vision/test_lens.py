"""Lens distortion of points, against OpenCV and against itself."""

from __future__ import annotations

import math

import cv2
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from polepilot.core.errors import ConfigError
from polepilot.core.vehicle import Camera
from polepilot.core.vision.lens import Lens, distort, undistort

WEBCAM = (-0.32, 0.11, 0.0012, -0.0007, -0.015)
WIDE = Camera(constant=280.0, distortion=(-0.25, 0.06, 0.001, 0.002, -0.005))
MATRIX = np.array([[600.0, 0, 199.5], [0, 600.0, 149.5], [0, 0, 1]])


def camera(*coefficients: float) -> Camera:
    return Camera(distortion=coefficients)


def grid(of: Camera) -> np.ndarray:
    columns, rows = np.meshgrid(np.linspace(0, of.width - 1, 23), np.linspace(0, of.height - 1, 17))
    return np.stack([columns, rows], axis=-1)


def test_an_ideal_lens_changes_nothing() -> None:
    points = grid(Camera())
    for ideal in (Camera(), camera(0, 0, 0, 0, 0)):
        assert Lens.of(ideal).ideal
        np.testing.assert_array_equal(undistort(points, ideal), points)
        np.testing.assert_array_equal(distort(points, ideal), points)
    moved = undistort(points, Camera())
    moved += 1
    np.testing.assert_array_equal(points, grid(Camera()))


def test_the_same_as_opencv() -> None:
    points = grid(Camera()).reshape(-1, 2)
    coefficients = np.array(WEBCAM)
    precise = (cv2.TERM_CRITERIA_COUNT | cv2.TERM_CRITERIA_EPS, 100, 1e-12)
    theirs = cv2.undistortPoints(
        points[:, None], MATRIX, coefficients, P=MATRIX, criteria=precise
    ).reshape(-1, 2)
    np.testing.assert_allclose(undistort(points, camera(*WEBCAM)), theirs, atol=1e-5)
    rays = np.column_stack([(points - [199.5, 149.5]) / 600.0, np.ones(len(points))])
    theirs, _ = cv2.projectPoints(rays[:, None], np.zeros(3), np.zeros(3), MATRIX, coefficients)
    np.testing.assert_allclose(distort(points, camera(*WEBCAM)), theirs.reshape(-1, 2), atol=1e-9)


@pytest.mark.parametrize("lens", [camera(*WEBCAM), WIDE])
def test_there_and_back(lens: Camera) -> None:
    assert Lens.of(lens).covers(lens)
    points = grid(lens)
    back = distort(undistort(points, lens), lens)
    np.testing.assert_allclose(back, points, atol=1e-7)
    assert back.shape == points.shape
    one = undistort((10.0, 20.0), lens)
    assert one.shape == (2,)
    # A barrel pulls inwards: without the lens the corner would be farther out.
    assert one[0] < 10
    assert one[1] < 20


def test_nothing_to_do() -> None:
    assert undistort(np.empty((0, 2)), WIDE).shape == (0, 2)


@given(
    st.tuples(
        st.floats(-0.4, 0.3),
        st.floats(-0.1, 0.2),
        st.floats(-0.005, 0.005),
        st.floats(-0.005, 0.005),
        st.floats(-0.05, 0.05),
    )
)
def test_any_lens_that_covers_the_picture_can_be_undone(lens: tuple[float, ...]) -> None:
    of = camera(*lens)
    if Lens.of(of).covers(of):
        points = grid(of)
        np.testing.assert_allclose(distort(undistort(points, of), of), points, atol=1e-6)


def test_what_no_lens_draws() -> None:
    strong = camera(-2.0, 0, 0, 0, 0)
    assert Lens(k1=-2.0).limit == pytest.approx(math.sqrt(1 / 6))
    # The picture's corners are farther out than the farthest thing that this lens draws.
    assert not Lens.of(strong).covers(strong)
    corner = undistort([[0.0, 0.0], [200.0, 150.0]], strong)
    assert np.isnan(corner[0]).all()
    assert np.isfinite(corner[1]).all()
    assert math.isinf(Lens(k1=0.1).limit)


def test_impossible_lenses() -> None:
    with pytest.raises(ConfigError, match="finite"):
        Lens(k1=math.nan)
    with pytest.raises(ConfigError, match="has 2 numbers"):
        Camera(distortion=(0.1, 0.2))
