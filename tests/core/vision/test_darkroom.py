"""The second renderer draws what geometry says, the same each time, and nothing cut off."""

from __future__ import annotations

from itertools import pairwise
from math import asin, cos, radians, sin, tan
from typing import get_args

import numpy as np
import pytest
from numpy.typing import NDArray
from scenes.darkroom import arrange, scene, spells
from scenes.darkroom_camera import Camera, Lens
from scenes.darkroom_light import Light, draw_light
from scenes.darkroom_mesh import Canvas, Stand, View, code_bands
from scenes.darkroom_shot import Post, Shot
from scenes.darkroom_stage import Stage
from scenes.truth import Family

from polepilot.core.landmark import encode

C, CX, CY, RADIUS = 600.0, 199.5, 149.5, 0.035
WHITE = Light(
    np.eye(3), np.full(3, 0.8), np.full(3, 0.8), np.ones(3), np.eye(3), np.ones(3), "white on black"
)
PAINT = Light(
    np.eye(3), np.full(3, 0.8), np.full(3, 0.2), np.ones(3), np.eye(3), np.ones(3), "white and grey"
)
LENS = Lens("gauss", 0.5)


def cover(stand: Stand, view: View, light: Light = WHITE, lens: Lens = LENS) -> NDArray[np.float64]:
    """How much of each pixel a white pole before black covers."""
    stage = Stage(view)
    stage.plane[:] = 0
    camera = Camera(tone="linear")
    picture, _ = Shot(view, light, camera, lens).take(
        stage, [Post(stand)], np.random.default_rng(0)
    )
    return np.asarray(picture[:, :, 1] / (255 * 0.8))


def ends(picture: NDArray[np.float64], column: float) -> tuple[float, float]:
    """The upper and lower border of a white pole at a column, from areas alone."""
    left = int(column)
    share = column - left
    profile = (1 - share) * picture[:, left] + share * picture[:, left + 1]
    middle = float((profile * np.arange(len(profile))).sum() / profile.sum())
    return middle - profile.sum() / 2, middle + profile.sum() / 2


@pytest.mark.parametrize("distance", [2.0, 3.7, 8.0])
@pytest.mark.parametrize("bearing", [-14.0, 0.0, 9.3])
def test_a_level_camera_sees_top_bottom_and_middle_where_they_are(
    distance: float, bearing: float
) -> None:
    beta = radians(bearing)
    picture = cover(Stand(6, distance, beta), View())
    depth = (distance - RADIUS) * cos(beta)
    top, bottom = ends(picture, CX - C * tan(beta))
    assert top == pytest.approx(CY - C * 0.25 / depth, abs=0.1)
    assert bottom == pytest.approx(CY + C * 0.40 / depth, abs=0.1)

    half = asin(RADIUS / distance)
    left, right = CX - C * tan(beta + half), CX - C * tan(beta - half)
    row = picture[round(CY)]
    assert row.sum() == pytest.approx(right - left, abs=0.1)
    assert (row * np.arange(400)).sum() / row.sum() == pytest.approx((left + right) / 2, abs=0.1)


@pytest.mark.parametrize("pitch", [-2.0, 2.0])
def test_a_camera_that_nods_sees_the_ends_where_they_are(pitch: float) -> None:
    nod = radians(pitch)
    top, bottom = ends(cover(Stand(6, 3.0, 0.0), View(pitch=nod)), CX)
    near = 3.0 - RADIUS
    for seen, up in ((top, 0.25), (bottom, -0.40)):
        # Angles add up: nose down moves everything up.
        assert seen == pytest.approx(CY - C * tan(np.arctan2(up, near) + nod), abs=0.1)


@pytest.mark.parametrize("roll", [-2.0, 2.0])
def test_a_camera_that_tilts_turns_the_picture(roll: float) -> None:
    tilt = radians(roll)
    picture = cover(Stand(6, 3.0, 0.1), View(roll=tilt))
    for height in (0.60, 0.10):
        # Right side down: what is upright leans to the left.
        level = np.array([-C * tan(0.1), -C * (height - 0.40) / (3.0 * cos(0.1))])
        x = CX + level[0] * cos(tilt) + level[1] * sin(tilt)
        y = CY - level[0] * sin(tilt) + level[1] * cos(tilt)
        row = picture[round(y)]
        middle = (row * np.arange(400)).sum() / row.sum()
        slant = tan(tilt) * (round(y) - y)
        assert middle == pytest.approx(x + slant, abs=0.1)


def test_segments_change_where_they_should() -> None:
    stand = Stand(9, 2.5, 0.0)
    picture = cover(stand, View(), PAINT, Lens())
    profile = (picture[:, 199] + picture[:, 200]) / 2
    code = encode(9)
    near = 2.5 - RADIUS
    border = [CY - C * (0.65 - 0.05 * k - 0.40) / near for k in range(14)]
    whole = sum((1.0 if c == "1" else 0.25) * (border[1] - border[0]) for c in code)
    assert profile.sum() == pytest.approx(whole, abs=0.3)
    for k, bit in enumerate(code):
        middle = round((border[k] + border[k + 1]) / 2)
        assert profile[middle] == pytest.approx(1.0 if bit == "1" else 0.25, abs=0.02)


def test_the_bearing_is_that_of_the_middle_row() -> None:
    view = View(pan_rate=radians(50), readout=0.03, exposure=0.004)
    smear = C * view.pan_rate * view.exposure
    picture = cover(Stand(6, 2.2, 0.12), view, lens=Lens("gauss", 0.4, smear=smear))
    half = asin(RADIUS / 2.2)
    for row in (100, 149, 150, 220):
        turned = 0.12 - radians(50) * 0.03 * (row - CY) / 300
        expected = CX - C * (tan(turned + half) + tan(turned - half)) / 2
        seen = (picture[row] * np.arange(400)).sum() / picture[row].sum()
        assert seen == pytest.approx(expected, abs=0.1)


def test_areas_are_exact() -> None:
    rng = np.random.default_rng(5)
    for _ in range(20):
        points = rng.uniform(1, 18, (3, 2))
        canvas = Canvas(0, 0, 20, 20, 3)
        canvas.add_polygon(points, np.ones(4))
        a, b = points[1] - points[0], points[2] - points[0]
        seen = canvas.image()[..., 3]
        assert seen.sum() / 9 == pytest.approx(abs(a[0] * b[1] - a[1] * b[0]) / 2, abs=1e-3)
        assert seen.min() > -1e-6
        assert seen.max() < 1 + 1e-6


def test_a_mosaic_moves_nothing() -> None:
    stand, view = Stand(6, 4.0, 0.07), View(0.01, 0.02)
    expected = cover(stand, view)
    for mosaic in (1, 2):
        for corner in range(4):
            stage = Stage(view)
            stage.plane[:] = 0
            camera = Camera(tone="linear", mosaic=mosaic, corner=corner)
            shot = Shot(view, WHITE, camera, LENS)
            picture, _ = shot.take(stage, [Post(stand)], np.random.default_rng(0))
            seen = picture.astype(float).mean(axis=2) / (255 * 0.8)
            for axis, size in ((0, 400), (1, 300)):
                sums, wanted = seen.sum(axis=axis), expected.sum(axis=axis)
                middle = (sums * np.arange(size)).sum() / sums.sum()
                truth = (wanted * np.arange(size)).sum() / wanted.sum()
                assert middle == pytest.approx(truth, abs=0.06)


@pytest.mark.parametrize("family", get_args(Family))
def test_a_seed_says_it_all(family: Family) -> None:
    first, again, other = scene(family, 3), scene(family, 3), scene(family, 4)
    assert np.array_equal(first.image, again.image)
    assert first.truths == again.truths
    assert first.note == again.note
    assert not np.array_equal(first.image, other.image)
    for shown in (first, other):
        assert shown.image.shape == (300, 400, 3)
        assert shown.image.dtype == np.uint8
        assert (len(shown.truths) == 0) == (family == "empty")
        assert all(truth.hidden == (family == "hidden") for truth in shown.truths)
        assert len({truth.id for truth in shown.truths}) == len(shown.truths) <= 4


def test_landmarks_are_whole_and_apart() -> None:
    rng = np.random.default_rng(1)
    counts = []
    for ranges in ((2.0, 8.0), (16.0, 22.0)):
        for _ in range(60):
            view = View(*rng.uniform(-radians(2), radians(2), 2))
            stands = arrange(rng, view, ranges)
            counts.append(len(stands))
            boxes = []
            for stand in stands:
                assert ranges[0] <= stand.range <= ranges[1]
                outline = stand.outline(view)
                assert outline.min() >= 1
                assert np.all(outline.max(axis=0) <= [398, 298])
                boxes.append((outline[:, 0].min(), outline[:, 0].max()))
            boxes.sort()
            assert all(a[1] < b[0] for a, b in pairwise(boxes))
    assert set(counts) == {1, 2, 3, 4}


def test_no_trap_spells_a_code() -> None:
    for number in range(1, 16):
        heights, bright = code_bands(number)
        lengths = -np.diff(heights)
        assert spells(lengths, bright)
        assert spells(np.concatenate([[0.3], lengths, [0.2]]), [False, *bright, False])
        assert not spells(lengths, [not b for b in bright])
    assert not spells(np.full(13, 0.05), [k % 2 == 0 for k in range(13)])


def test_orange_paint_is_orange_in_any_light() -> None:
    for seed in range(60):
        light = draw_light(np.random.default_rng(seed), 0.45)
        blue, green, red = light.seen(light.orange)
        assert red > 2 * green > 0
        assert red > 2.5 * blue
        dark = light.seen(light.black)
        assert dark.max() < 0.25 * red
