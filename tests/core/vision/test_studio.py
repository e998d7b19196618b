"""The studio's pictures show what their truths say."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import get_args

import numpy as np
import pytest
from scenes.campaign import CAMERA, match
from scenes.studio import RANGES, scene
from scenes.studio_light import draw_lighting, draw_paint
from scenes.studio_optics import Eye, Layer, Pole, see
from scenes.truth import Family, Truth

from polepilot.core.landmark import LandmarkKind
from polepilot.core.observation import Detection

LEVEL = Eye(blur=0.3)
KIND = LandmarkKind()


def stand(away: float, bearing: float, kind: LandmarkKind = KIND) -> Pole:
    return Pole(13, away, bearing, kind, draw_paint(np.random.default_rng(1)))


def shown(pole: Pole, eye: Eye = LEVEL) -> Layer:
    return see(pole, eye, draw_lighting(np.random.default_rng(2)))


def column_in(layer: Layer, row: float) -> float:
    """Where the middle of what is seen lies in a row of the picture."""
    cover = layer.cover[round(row) - layer.top]
    return float(layer.left + (cover * np.arange(len(cover))).sum() / cover.sum())


@pytest.mark.parametrize("away", [2.0, 5.0, 8.0, 14.0, 22.0])
@pytest.mark.parametrize("bearing", [0.0, 0.21, -0.13])
def test_a_cylinder_lies_where_the_pinhole_camera_puts_it(away: float, bearing: float) -> None:
    layer = shown(stand(away, bearing))
    half = math.asin(KIND.diameter / 2 / away)
    left, right = (199.5 - 600 * math.tan(bearing + side * half) for side in (1, -1))
    row = round(149.5 + 600 * 0.1 / away)
    assert layer.cover[row - layer.top].sum() == pytest.approx(right - left, abs=0.03)
    assert column_in(layer, row) == pytest.approx((left + right) / 2, abs=0.02)
    # Its surface, in the direction of the column next to its axis.
    column = round(199.5 - 600 * math.tan(bearing))
    aim = math.atan((199.5 - column) / 600)
    beside = away * math.sin(bearing - aim)
    front = away * math.cos(bearing - aim) - math.sqrt(0.035**2 - beside**2)
    depth = front * math.cos(aim)
    top, bottom = 149.5 - 600 * 0.25 / depth, 149.5 + 600 * 0.40 / depth
    middle = column - layer.left
    strip = layer.cover[:, middle] / layer.cover[row - layer.top, middle]
    assert strip.sum() == pytest.approx(bottom - top, abs=0.02)
    center = layer.top + (strip * np.arange(len(strip))).sum() / strip.sum()
    assert center == pytest.approx((top + bottom) / 2, abs=0.02)


def test_segments_lie_at_their_heights() -> None:
    pole = stand(3.0, 0.0)
    layer = shown(pole)
    red = layer.color[:, 199 - layer.left, 0]
    front = 3.0 - KIND.diameter / 2
    lit, dark = red.max(), np.percentile(red[layer.cover[:, 199 - layer.left] > 0.99], 20)
    assert lit > 3 * dark
    # 13 is 1101000101011: 7 of 13 segments are orange.
    share = (red > (lit + dark) / 2).sum() / (600 * 0.65 / front)
    assert share == pytest.approx(7 / 13, abs=0.03)


@pytest.mark.parametrize("rate", [60.0, -35.0])
def test_a_turning_camera_shears_what_it_sees(rate: float) -> None:
    eye = replace(LEVEL, pan_rate=math.radians(rate), readout=0.03, exposure=0.008)
    pole = stand(2.2, 0.05)
    layer = shown(pole, eye)
    # The camera turns left: what it sees moves right, row by row.
    slope = 600 * math.radians(rate) * 0.03 / 300
    at_middle = 199.5 - 600 * math.tan(0.05)
    for row in (110, 150, 200):
        expected = at_middle + slope * (row - 149.5)
        assert column_in(layer, row) == pytest.approx(expected, abs=0.1)
    sharp = shown(pole, replace(eye, exposure=0.0))
    row = 150
    assert layer.cover[row - layer.top].sum() == pytest.approx(
        sharp.cover[row - sharp.top].sum(), abs=0.05
    )
    assert (layer.cover[row - layer.top] > 0.02).sum() > (
        sharp.cover[row - sharp.top] > 0.02
    ).sum() + 600 * math.radians(abs(rate)) * 0.008 - 2


def test_rays_and_projection_agree() -> None:
    eye = Eye(pitch=0.03, roll=-0.03, pan_rate=1.0, readout=0.03)
    points = np.random.default_rng(3).uniform([2, -0.5, 0], [9, 0.5, 1], (50, 3))
    pixels = eye.project(points)
    for point, (column, row) in zip(points, pixels, strict=True):
        ray = np.array([float(one.item()) for one in eye.rays(column, np.array([[row]]))])
        toward = point - [0, 0, eye.above]
        assert ray / np.linalg.norm(ray) == pytest.approx(toward / np.linalg.norm(toward), abs=1e-6)


def test_looking_up_moves_things_down_and_rolling_left_moves_their_tops() -> None:
    point = np.array([[5.0, 0.0, 0.65]])
    assert replace(LEVEL, pitch=0.02).project(point)[0, 1] > LEVEL.project(point)[0, 1] + 10
    assert LEVEL.project(np.array([[5.0, 1.0, 0.4]]))[0, 0] < 199.5 - 100


def test_a_leaning_or_flat_landmark_keeps_its_middle() -> None:
    leaning = replace(stand(4.0, 0.1), lean=(0.0, math.radians(1.0)))
    middle = LEVEL.project(leaning.foot[None] + leaning.axis * KIND.height / 2)[0]
    assert middle[0] == pytest.approx(199.5 - 600 * math.tan(0.1), abs=0.01)
    assert column_in(shown(leaning), middle[1]) == pytest.approx(middle[0], abs=0.15)
    flat = LandmarkKind(shape="flat")
    sticker = replace(stand(4.0, 0.0, flat), turn=math.radians(30))
    layer = shown(sticker)
    wide = layer.cover[160 - layer.top].sum()
    assert wide == pytest.approx(600 * 0.07 * math.cos(math.radians(30)) / 4.0, abs=0.05)


@pytest.mark.parametrize("family", get_args(Family))
def test_a_picture_is_the_same_for_the_same_seed(family: Family) -> None:
    first, again, other = scene(family, 3), scene(family, 3), scene(family, 4)
    assert np.array_equal(first.image, again.image)
    assert first.truths == again.truths
    assert not np.array_equal(first.image, other.image)
    assert first.image.shape == (300, 400, 3)
    assert first.image.dtype == np.uint8


@pytest.mark.parametrize("family", get_args(Family))
def test_landmarks_stand_whole_in_the_picture_and_at_their_distance(family: Family) -> None:
    low, high = RANGES[family]
    for seed in range(8):
        shot = scene(family, seed)
        assert bool(shot.truths) == (family != "empty")
        columns = sorted(199.5 - 600 * math.tan(truth.bearing) for truth in shot.truths)
        assert all(0 < column < 399 for column in columns)
        assert all(low <= truth.range <= high for truth in shot.truths)
        assert len({truth.id for truth in shot.truths}) == len(shot.truths)
        assert any(truth.hidden for truth in shot.truths) == (family == "hidden")
        if family.startswith("clean"):
            assert not any(truth.orange_surround for truth in shot.truths)


def test_orange_surrounds_are_as_frequent_as_wanted() -> None:
    truths = [truth for seed in range(40) for truth in scene("photo", seed).truths]
    assert 0.25 < np.mean([truth.orange_surround for truth in truths]) < 0.5


def test_other_resolutions_show_the_same_landmarks() -> None:
    large = scene("clean", 5, size=(800, 600), constant=1200.0)
    assert large.image.shape == (600, 800, 3)
    assert [truth.id for truth in large.truths] == [truth.id for truth in scene("clean", 5).truths]


def test_other_kinds_can_be_asked_for() -> None:
    kind = LandmarkKind(bits=6, segment=0.06, diameter=0.10, shape="flat")
    shot = scene("clean-8-12", 2, kinds={40: kind, 55: kind})
    assert {truth.id for truth in shot.truths} <= {40, 55}
    assert all(truth.kind == kind for truth in shot.truths)


def answer(number: int, bearing: float) -> Detection:
    return Detection(number, 4.0, bearing, 199.5, 100.0, 200.0, 0.01, 0.001)


def test_the_campaign_tells_readings_from_wrong_ids_and_false_alarms() -> None:
    truths = [Truth(3, 4.0, 0.0), Truth(5, 4.0, 0.2)]
    marks = match([answer(3, 0.001), answer(9, 0.2), answer(7, -0.2)], truths, CAMERA)
    assert list(marks.read) == [0]
    assert [index for _, index in marks.wrong] == [1]
    assert [one.id for one in marks.false] == [7]
    # A second answer at the same place reads nothing.
    marks = match([answer(3, 0.0), answer(3, 0.0)], truths, CAMERA)
    assert len(marks.read) == len(marks.wrong) == 1
