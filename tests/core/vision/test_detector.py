"""Rendered pictures in, ids and measurements out; the bounds are what the product promises."""

from __future__ import annotations

import math

import numpy as np
import pytest
from vision_scenes import CAMERA, jpeg, photographs, picture, pole, room

from polepilot.core.landmark import SUPPORTED_BITS, LandmarkKind
from polepilot.core.observation import Detection, Image
from polepilot.core.sim.render import Look
from polepilot.core.vision.detector import LandmarkDetector

ALL = LandmarkDetector(CAMERA, dict.fromkeys(range(1, 16), LandmarkKind()))


def only(image: Image, detector: LandmarkDetector = ALL) -> Detection:
    found = detector.detect(image)
    assert len(found) == 1, found
    return found[0]


def test_a_grid_of_places_is_read_and_measured() -> None:
    errors, bearings, honesty = [], [], []
    number = 0
    for away in (1.8, 2.0, 2.5, 3.2, 4.0, 5.0, 6.0, 7.0, 8.0):
        for bearing in (-0.28, -0.12, 0.0, 0.2):
            number = number % 15 + 1
            one = only(picture([pole(number, away, bearing)], seed=number))
            assert one.id == number
            errors.append(abs(one.range / away - 1))
            bearings.append(abs(one.bearing - bearing))
            honesty.append((one.range - away) / one.range_sigma)
    assert np.mean(errors) <= 0.0015
    assert np.max(errors) <= 0.01
    assert np.median(bearings) <= math.radians(0.03)
    assert np.max(bearings) <= math.radians(0.15)
    assert np.sqrt(np.mean(np.square(honesty))) < 1.6


def test_far_landmarks() -> None:
    errors = []
    places = [(away, number) for away in (9.0, 11.0, 13.0, 15.5) for number in (1, 5, 8, 13, 15)]
    for seed, (away, number) in enumerate(places):
        one = only(picture([pole(number, away, 0.1)], seed=seed))
        assert one.id == number
        errors.append(abs(one.range / away - 1))
    assert np.mean(errors) <= 0.005


def test_several_distances_in_one_picture() -> None:
    poles = [pole(13, 2.5, 0.2), pole(6, 10.0, 0.0), pole(9, 5.0, -0.2)]
    found = ALL.detect(picture(poles))
    assert [one.id for one in found] == [13, 6, 9]
    for one, away, bearing in zip(found, (2.5, 10.0, 5.0), (0.2, 0.0, -0.2), strict=True):
        assert one.range == pytest.approx(away, rel=0.008)
        assert one.bearing == pytest.approx(bearing, abs=math.radians(0.1))
    assert found[0].column < found[1].column < found[2].column


@pytest.mark.parametrize("bits", SUPPORTED_BITS)
@pytest.mark.parametrize("shape", ["cylinder", "flat"])
def test_all_codes_and_shapes(bits: int, shape: str) -> None:
    kind = LandmarkKind(bits=bits, shape="flat" if shape == "flat" else "cylinder")
    detector = LandmarkDetector(CAMERA, dict.fromkeys(range(1, 2**bits), kind))
    rng = np.random.default_rng(bits)
    for number in [1, 2**bits - 1, *(int(n) for n in rng.integers(1, 2**bits, 3))]:
        one = only(picture([pole(number, 5.0, -0.1, kind)], seed=number), detector)
        assert one.id == number
        assert one.range == pytest.approx(5.0, rel=0.006)


def test_edges_and_column_are_where_the_pole_is() -> None:
    one = only(picture([pole(13, 4.0, 0.1)]))
    scale = CAMERA.constant / ((4.0 - 0.035) * math.cos(0.1))
    assert one.top == pytest.approx(CAMERA.center_y - 0.25 * scale, abs=0.3)
    assert one.bottom == pytest.approx(CAMERA.center_y + 0.40 * scale, abs=0.3)
    assert one.column == pytest.approx(CAMERA.center_x - 600 * math.tan(0.1), abs=0.3)


@pytest.mark.parametrize("turn", [-60, -30, 30, 60])
def test_a_panning_camera_shears_but_does_not_mislead(turn: float) -> None:
    for away in (2.2, 4.5, 7.5):
        image = picture([pole(11, away, 0.05)], pan_rate=math.radians(turn))
        one = only(image)
        assert one.id == 11
        assert one.range == pytest.approx(away, rel=0.006)
        assert one.bearing == pytest.approx(0.05, abs=math.radians(0.12))


@pytest.mark.parametrize("exposure", [0.08, 0.4, 1.0, 2.5])
@pytest.mark.parametrize("light", [(0.42, 0.78, 1.3), (1.3, 1.0, 0.85)])
def test_warm_and_cold_dim_and_glaring_light(
    exposure: float, light: tuple[float, float, float]
) -> None:
    look = Look(light=light, exposure=exposure)
    for number, away in ((6, 3.0), (13, 6.0)):
        one = only(picture([pole(number, away, -0.1)], look=look))
        assert one.id == number
        assert one.range == pytest.approx(away, rel=0.01)


def test_jpeg() -> None:
    for number, away in ((3, 2.5), (10, 4.0), (12, 5.5)):
        one = only(jpeg(picture([pole(number, away, 0.15)], seed=number)))
        assert one.id == number
        assert one.range == pytest.approx(away, rel=0.01)


def test_a_monochrome_camera() -> None:
    look = Look(bright=(0.9, 0.9, 0.9))
    grey = picture([pole(13, 4.0, 0.1)], look=look, walls=room(20.0))[:, :, 1]
    one = only(np.ascontiguousarray(grey))
    assert one.id == 13
    assert one.range == pytest.approx(4.0, rel=0.01)


def test_cut_off_by_the_side_of_the_picture() -> None:
    bearing = CAMERA.half_view - 0.002
    one = only(picture([pole(13, 2.2, bearing)]))
    assert one.id == 13
    assert one.range == pytest.approx(2.2, rel=0.01)
    assert one.bearing == pytest.approx(bearing, abs=3 * one.bearing_sigma)


def test_unknown_ids_are_not_reported() -> None:
    some = LandmarkDetector(CAMERA, dict.fromkeys((1, 2, 3), LandmarkKind()))
    image = picture([pole(13, 3.0, 0.1), pole(2, 3.0, -0.1)])
    assert [one.id for one in some.detect(image)] == [2]


def test_a_covered_segment_is_not_guessed() -> None:
    image = picture([pole(13, 3.0, 0.0)])
    one = only(image)
    unit = (one.bottom - one.top) / 13
    for segment in range(13):
        first = round(one.top + segment * unit)
        covered = image.copy()
        covered[first : round(first + unit), 180:220] = (150, 150, 150)
        assert ALL.detect(covered) == [], segment


def test_a_grey_ladder_is_no_landmark() -> None:
    look = Look(bright=(0.6, 0.6, 0.6))
    assert ALL.detect(picture([pole(13, 3.0, 0.0)], look=look)) == []


def test_orange_stripes_with_grey_between_are_no_landmark() -> None:
    look = Look(dark=(0.5, 0.5, 0.5))
    assert ALL.detect(picture([pole(13, 3.0, 0.0)], look=look)) == []


def test_no_landmarks_in_photographs() -> None:
    for image in photographs(80, seed=7):
        assert ALL.detect(image) == []


def test_no_landmarks_in_an_empty_room() -> None:
    for exposure in (0.05, 0.3, 1.0):
        look = Look(light=(0.5, 0.8, 1.3), exposure=exposure, noise=4.0)
        assert ALL.detect(picture([], look=look, walls=room(4.0))) == []


@pytest.mark.parametrize("size", [(1, 1), (1, 3000), (3000, 1), (7, 5), (13, 400)])
def test_any_size_is_an_answer(size: tuple[int, int]) -> None:
    rng = np.random.default_rng(1)
    for shape in (size, (*size, 3)):
        noise = rng.integers(0, 256, shape, dtype=np.uint8)
        assert ALL.detect(noise) == []
        assert ALL.detect(np.zeros(shape, np.uint8)) == []
        assert ALL.detect(np.full(shape, 255, np.uint8)) == []


def test_pictures_are_taken_one_by_one() -> None:
    image = picture([pole(13, 3.0, 0.1)])
    first = ALL.detect(image)
    ALL.detect(picture([pole(4, 5.0, 0.1)]))
    assert ALL.detect(image) == first
