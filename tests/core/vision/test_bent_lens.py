"""Landmarks seen through a lens that bends: measured as if it did not."""

from __future__ import annotations

import math
from dataclasses import replace
from functools import lru_cache

import cv2
import numpy as np
import pytest
from numpy.typing import NDArray
from vision_scenes import CAMERA, HERE, pole, room

from polepilot.core.landmark import Landmark, LandmarkKind
from polepilot.core.observation import Detection, Image
from polepilot.core.sim.render import Look, Renderer
from polepilot.core.vehicle import Camera
from polepilot.core.vision.detector import LandmarkDetector
from polepilot.core.vision.kernel import Strip
from polepilot.core.vision.lens import distort
from polepilot.core.vision.measure import stands, through_pinhole

BARREL = (-0.25, 0.08, 0.0, 0.0, 0.0)
SKEWED = (0.12, -0.05, 0.002, -0.002, 0.01)
FINE = 3
ALL = dict.fromkeys(range(1, 16), LandmarkKind())


@lru_cache(maxsize=4)
def rays(camera: Camera) -> NDArray[np.float32]:
    """Where each third of a pixel looks, as pixels of a pinhole; followed back by OpenCV."""
    across = (np.arange(camera.width * FINE) + 0.5) / FINE - 0.5
    down = (np.arange(camera.height * FINE) + 0.5) / FINE - 0.5
    grid = np.stack(np.meshgrid(across, down), axis=-1).reshape(-1, 1, 2)
    matrix = np.diag([camera.constant, camera.constant, 1.0])
    matrix[:2, 2] = camera.center_x, camera.center_y
    criteria = (cv2.TERM_CRITERIA_COUNT | cv2.TERM_CRITERIA_EPS, 40, 1e-9)
    seen = cv2.undistortPoints(
        grid, matrix, np.array(camera.distortion), P=matrix, criteria=criteria
    )
    return np.asarray(seen.reshape(camera.height * FINE, camera.width * FINE, 2), dtype=np.float32)


def through_lens(poles: list[Landmark], camera: Camera, seed: int) -> Image:
    """A finely drawn picture, warped and averaged in linear light, with the sensor's noise."""
    wide = replace(
        camera,
        constant=camera.constant * FINE,
        width=round(camera.width * FINE * 1.2),
        height=round(camera.height * FINE * 1.2),
        center_x=camera.width * FINE * 0.6,
        center_y=camera.height * FINE * 0.6,
        distortion=(),
    )
    look = Look(noise=0.0, vignetting=0.0, blur=0.35 * FINE)
    rng = np.random.default_rng(seed)
    drawn = Renderer(wide, poles, room(20.0), rng, look).render(HERE) / np.float32(255.0)
    light = np.where(drawn <= 0.04045, drawn / 12.92, ((drawn + 0.055) / 1.055) ** 2.4)
    off = np.array([camera.center_x, camera.center_y])
    places = ((rays(camera) - off) * FINE + [wide.center_x, wide.center_y]).astype(np.float32)
    seen = cv2.remap(light.astype(np.float32), places, None, cv2.INTER_LINEAR)
    mean = seen.reshape(camera.height, FINE, camera.width, FINE, 3).mean(axis=(1, 3))
    grey = np.where(mean <= 0.0031308, 12.92 * mean, 1.055 * mean ** (1 / 2.4) - 0.055) * 255
    return np.clip(np.rint(grey + rng.normal(0.0, 2.0, grey.shape)), 0, 255).astype(np.uint8)


def only(image: Image, camera: Camera, kind: LandmarkKind) -> Detection:
    kinds = dict.fromkeys(range(1, 2**kind.bits), kind)
    (found,) = LandmarkDetector(camera, kinds).detect(image)
    return found


def test_a_bent_picture_is_measured_through() -> None:
    bent = replace(CAMERA, distortion=BARREL)
    mended, plain = [], []
    for away in (2.1, 4.0):
        # Poles that are seen whole, up to the border.
        for bearing in (-0.31, 0.0, 0.18, 0.31):
            image = through_lens([pole(13, away, bearing)], bent, round(away * 10))
            one = only(image, bent, LandmarkKind())
            assert one.id == 13
            assert one.range == pytest.approx(away, rel=0.005)
            assert one.bearing == pytest.approx(bearing, abs=math.radians(0.1))
            mended.append(abs(one.range / away - 1))
            other = only(image, CAMERA, LandmarkKind())
            plain.append(abs(other.range / away - 1))
            # Where the strip is drawn is where it is seen.
            assert (one.column, one.top, one.bottom) == (other.column, other.top, other.bottom)
            if abs(bearing) > 0.3:
                assert abs(other.range / away - 1) > 0.01
                assert abs(other.bearing - bearing) > math.radians(0.2)
    assert np.mean(mended) < 0.002
    assert np.mean(plain) > 0.01


@pytest.mark.parametrize("bits", [4, 8])
def test_another_lens_off_the_middle(bits: int) -> None:
    bent = replace(CAMERA, distortion=SKEWED, center_x=212.0, center_y=139.0, mount_height=0.5)
    kind = LandmarkKind(bits=bits)
    for number, away, bearing in ((1, 3.4, 0.28), (11, 5.0, -0.26)):
        image = through_lens([pole(number, away, bearing, kind)], bent, number)
        one = only(image, bent, kind)
        assert one.id == number
        assert one.range == pytest.approx(away, rel=0.005)
        assert one.bearing == pytest.approx(bearing, abs=math.radians(0.1))


def strip(column: float, row: float, unit: float) -> Strip:
    return Strip(
        id=13, bits=4, column=column, row=row, unit=unit, front=1.0, unit_sigma=1e-4,
        sag_sigma=1e-5, column_sigma=0.1, code=b"1101000101011",
    )  # fmt: skip


def test_small_strips_go_where_points_go() -> None:
    camera = replace(CAMERA, distortion=BARREL)
    for place in ((20.0, 30.0), (390.0, 280.0), (199.5, 149.5)):
        ideal = np.array(place)
        half = np.array([0.0, 0.5])
        seen = distort(np.stack([ideal, ideal - half, ideal + half]), camera)
        aside, down = map(float, seen[2] - seen[1])
        given = strip(*map(float, seen[0]), 0.3 * down)
        given.lean = aside / down  # an upright pole leans there
        small = through_pinhole(given, ALL[13], camera)
        assert (small.column, small.row) == pytest.approx(tuple(ideal), abs=0.05)
        assert small.unit == pytest.approx(0.3, rel=1e-3)
        assert small.lean == pytest.approx(0.0, abs=1e-3)
        assert small.id == 13


def test_without_distortion_nothing_moves() -> None:
    given = strip(150.0, 140.0, 9.0)
    given.sag, given.lean = 0.001, 0.02
    same = through_pinhole(given, ALL[13], CAMERA)
    for name, _ in Strip._fields_:
        assert getattr(same, name) == pytest.approx(getattr(given, name), abs=1e-9), name


def test_where_the_lens_draws_nothing_nothing_stands() -> None:
    camera = replace(CAMERA, distortion=(-3.0, 0.0, 0.0, 0.0, 0.0))
    beyond = through_pinhole(strip(390.0, 140.0, 9.0), ALL[13], camera)
    assert math.isnan(beyond.unit)
    assert not stands(beyond, ALL[13], camera)
