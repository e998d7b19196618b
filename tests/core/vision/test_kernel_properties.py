"""What must not matter to the eye: left and right, place, brightness, memory layout, threads."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from functools import cache

import numpy as np
import pytest
from numpy.typing import NDArray
from vision_scenes import CAMERA, photographs, picture, pole

from polepilot.core.errors import InternalError
from polepilot.core.landmark import LandmarkKind
from polepilot.core.observation import Detection, Image
from polepilot.core.vehicle import Camera
from polepilot.core.vision.detector import LandmarkDetector
from polepilot.core.vision.kernel import Kernel, Strip

KINDS = {number: LandmarkKind() for number in range(1, 16)}
DETECTOR = LandmarkDetector(CAMERA, KINDS)
KERNEL = Kernel(KINDS, CAMERA.constant)
FREE = 3.0
"""Rows between a landmark and the picture's upper or lower border: none of it is cut off."""
BORDER = 24
"""Pixels; even, as the eye looks at every second column."""


@dataclass(frozen=True)
class Change:
    """By how many sigmas a measurement has changed, of the larger one of both."""

    range: float
    bearing: float


@cache
def scenes() -> tuple[Image, ...]:
    """Three poles each, 1.8 to 9 m away."""
    images = []
    for seed in range(30):
        rng = np.random.default_rng(seed)
        ids = rng.permutation(np.arange(1, 16))[:3]
        poles = [
            pole(int(number), rng.uniform(1.8, 9), side + rng.uniform(-0.05, 0.05))
            for number, side in zip(ids, (-0.2, 0.0, 0.2), strict=True)
        ]
        images.append(picture(poles, seed))
    return tuple(images)


def whole(detections: list[Detection]) -> dict[int, Detection]:
    """Those that the picture's upper and lower border do not touch, by id."""
    return {
        one.id: one
        for one in detections
        if one.top > FREE and one.bottom < CAMERA.height - 1 - FREE
    }


def changes(look: Callable[[Image], list[Detection]], side: int = 1) -> list[Change]:
    """What ``look`` says of every scene, against what the detector says of it as it is.

    Args:
        side: -1 where left and right are exchanged.
    """
    found = []
    for image in scenes():
        expected, seen = whole(DETECTOR.detect(image)), {one.id: one for one in look(image)}
        assert len(expected) >= 2
        assert set(expected) <= set(seen)
        assert len(seen) <= 3
        for number, one in expected.items():
            other = seen[number]
            apart = abs(other.range - one.range)
            turned = abs(side * other.bearing - one.bearing)
            apart /= max(one.range_sigma, other.range_sigma)
            turned /= max(one.bearing_sigma, other.bearing_sigma)
            found.append(Change(apart, turned))
    return found


def check(found: list[Change], most: float, usual: float) -> None:
    """The largest change, and the median."""
    for values in ([one.range for one in found], [one.bearing for one in found]):
        assert max(values) < most
        assert np.median(values) < usual


def bordered(image: Image, down: int, right: int) -> Image:
    """The picture within a larger black one, away from its middle by so many pixels."""
    rows, columns = image.shape[:2]
    out = np.zeros((rows + 2 * BORDER, columns + 2 * BORDER, 3), np.uint8)
    out[BORDER + down :, BORDER + right :][:rows, :columns] = image
    return out


def look_with_borders(down: int, right: int) -> Callable[[Image], list[Detection]]:
    camera = replace(
        CAMERA,
        width=CAMERA.width + 2 * BORDER,
        height=CAMERA.height + 2 * BORDER,
        center_x=CAMERA.center_x + BORDER + right,
        center_y=CAMERA.center_y + BORDER + down,
    )
    detector = LandmarkDetector(camera, KINDS)
    return lambda image: detector.detect(bordered(image, down, right))


def dimmed(image: Image, share: float | NDArray[np.float64]) -> Image:
    """With less light, by the sRGB curve."""
    grey = image / 255
    light = share * np.where(grey <= 0.04045, grey / 12.92, ((grey + 0.055) / 1.055) ** 2.4)
    grey = np.where(light <= 0.0031308, 12.92 * light, 1.055 * light ** (1 / 2.4) - 0.055)
    return np.rint(255 * grey.clip(0, 1)).astype(np.uint8)


def content(strips: list[Strip]) -> list[bytes]:
    return [bytes(strip) for strip in strips]


def test_a_mirrored_picture_mirrors_bearings_and_nothing_else() -> None:
    """Every second column is looked at, so these are other ones: their noise is, too."""
    found = changes(lambda image: DETECTOR.detect(image[:, ::-1]), side=-1)
    check(found, most=2, usual=0.15)


@pytest.mark.parametrize(("down", "right"), [(0, 0), (1, 4), (2, 8), (5, 20), (8, 24)])
def test_black_borders_change_nothing(down: int, right: int) -> None:
    """By brightness every fourth column is looked at, by colour every second one."""
    found = changes(look_with_borders(down, right))
    check(found, most=0.15, usual=1e-6)


def test_other_columns_give_the_same_within_the_noise() -> None:
    found = changes(look_with_borders(1, right=1))
    check(found, most=2, usual=0.15)


def test_strips_move_with_the_picture() -> None:
    for image in scenes()[:10]:
        here = {s.id: s for s in KERNEL.look(bordered(image, 0, 0)) if not s.reason}
        there = {s.id: s for s in KERNEL.look(bordered(image, 7, 12)) if not s.reason}
        assert here
        assert set(here) == set(there)
        for number, strip in here.items():
            moved = there[number]
            assert moved.column == pytest.approx(strip.column + 12, abs=1e-6)
            assert moved.row == pytest.approx(strip.row + 7, abs=1e-6)
            assert moved.unit == pytest.approx(strip.unit, rel=1e-8)
            assert moved.code == strip.code


@pytest.mark.parametrize("share", [0.7, 0.4])
def test_less_light_changes_nothing(share: float) -> None:
    found = changes(lambda image: DETECTOR.detect(dimmed(image, share)))
    check(found, most=1.5, usual=0.15)


@pytest.mark.parametrize("share", [0.05, 0.02])
def test_dark_pictures_are_made_brighter(share: float) -> None:
    """Orange has 60 and 38 grey levels: a level more or less is a part of the edge's error."""
    found = changes(lambda image: DETECTOR.detect(dimmed(image, share)))
    check(found, most=3, usual=1)


def test_a_lamp_in_the_dark_does_not_make_it_bright() -> None:
    def lit(image: Image) -> Image:
        out = dimmed(image, 0.02)
        out[4:20, 8:24] = 255
        return out

    check(changes(lambda image: DETECTOR.detect(lit(image))), most=3, usual=1)


def test_a_landmark_that_alone_is_lit_in_the_dark_keeps_its_shades() -> None:
    """By a narrow lamp; what is promised for plain rooms 12.5 to 16 m away holds."""
    rows, columns = np.mgrid[0 : CAMERA.height, 0 : CAMERA.width]
    away, errors = 14.0, []
    beam = np.exp(-(((columns - CAMERA.center_x) * away / 24) ** 2))
    beam *= np.exp(-(((rows - CAMERA.center_y) * away / 250) ** 4))
    for seed in range(20):
        image = picture([pole(5, away, 0.0)], seed)
        lit = dimmed(image, (0.003 + beam)[..., None])
        errors += [abs(one.range / away - 1) for one in DETECTOR.detect(lit)]
    assert len(errors) == 20
    assert np.mean(errors) < 0.006


def test_grey_pictures_may_have_an_axis_for_their_channel() -> None:
    for image in scenes()[:5]:
        grey = np.ascontiguousarray(image[..., 2])
        assert content(KERNEL.look(grey)) == content(KERNEL.look(grey[..., None]))


@pytest.mark.parametrize(
    "stored",
    [
        lambda image: np.pad(image, ((2, 3), (4, 5), (0, 0)))[2:-3, 4:-5],
        lambda image: np.ascontiguousarray(image[::-1])[::-1],
        lambda image: np.ascontiguousarray(image[:, ::-1])[:, ::-1],
        lambda image: np.ascontiguousarray(image[..., ::-1])[..., ::-1],
        lambda image: np.repeat(image, 2, axis=0)[::2],
        lambda image: np.repeat(image, 2, axis=1)[:, ::2],
        np.asfortranarray,
    ],
    ids=["cut out", "upside down", "mirrored", "rgb", "every other row", "columns", "fortran"],
)
def test_layout_in_memory_changes_nothing(stored: Callable[[Image], Image]) -> None:
    for image in scenes()[:5]:
        same = stored(image)
        assert not same.flags.c_contiguous
        assert np.array_equal(same, image)
        assert content(KERNEL.look(same)) == content(KERNEL.look(image))
        grey, same_grey = np.ascontiguousarray(image[..., 1]), stored(image)[..., 1]
        assert content(KERNEL.look(same_grey)) == content(KERNEL.look(grey))


def test_threads_do_not_disturb_each_other() -> None:
    images = [*scenes(), *photographs(10, seed=1)]
    alone = [content(KERNEL.look(image)) for image in images]
    with ThreadPoolExecutor(4) as pool:
        for _ in range(3):
            together = pool.map(lambda image: content(KERNEL.look(image)), images * 4)
            assert list(together) == alone * 4


def test_pictures_are_independent_of_what_was_seen_before() -> None:
    camera = Camera()
    fresh = [LandmarkDetector(camera, KINDS).detect(image) for image in scenes()]
    assert fresh == [DETECTOR.detect(image) for image in scenes()]


@pytest.mark.parametrize(
    ("number", "constant"), [(0, 600.0), (256, 600.0), (-1, 600.0), (1, 0.0), (1, float("nan"))]
)
def test_what_the_eye_cannot_look_for(number: int, constant: float) -> None:
    with pytest.raises(InternalError, match="expected more than 0 pixels, and ids from 1 to 255"):
        Kernel({number: LandmarkKind()}, constant)
