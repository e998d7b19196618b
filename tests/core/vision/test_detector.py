"""Rendered pictures in, ids and measurements out; the bounds are what the product promises."""

from __future__ import annotations

import math

import cv2
import numpy as np
import pytest
from numpy.typing import NDArray
from vision_scenes import CAMERA, jpeg, photographs, picture, pole, room

from polepilot.core.landmark import SUPPORTED_BITS, LandmarkKind, encode
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


def test_far_landmarks_whose_colour_jpeg_has_blurred() -> None:
    """JPEG keeps one colour for four pixels, and a pale picture has little: brightness tells."""
    read, errors = 0, []
    for seed in range(25):
        rng = np.random.default_rng(seed)
        ids = [int(number) for number in rng.choice(range(1, 16), 3, replace=False)]
        ranges = rng.uniform(11.0, 15.0, 3)
        poles = [pole(*one) for one in zip(ids, ranges, (-0.2, 0.02, 0.22), strict=True)]
        image = picture(poles, seed).astype(float)
        pale = 0.6 * image + 0.4 * image.mean(axis=2, keepdims=True)
        found = ALL.detect(jpeg(np.rint(pale).astype(np.uint8), 85))
        assert {one.id for one in found} <= set(ids)
        read += len(found)
        errors += [abs(one.range / ranges[ids.index(one.id)] - 1) for one in found]
    assert read >= 0.9 * 75
    assert np.mean(errors) <= 0.006


def test_far_codes_of_other_lengths_are_no_others() -> None:
    """A longer code far away has the height of a shorter one nearer by, or holds it as a part."""
    read = seen = 0
    for seed in range(80):
        rng = np.random.default_rng(seed)
        lengths = rng.choice(SUPPORTED_BITS, int(rng.integers(2, 4)), replace=False)
        kinds = {}
        for bits in lengths:
            for number in rng.choice(np.arange(1, 2**bits), 4, replace=False):
                kinds[int(number)] = LandmarkKind(bits=int(bits))
        number = int(rng.choice(sorted(kinds)))
        away = float(rng.uniform(11.0, 20.0)) * kinds[number].segments / 13
        image = jpeg(picture([pole(number, away, 0.1, kinds[number])], seed), 85)
        found = LandmarkDetector(CAMERA, kinds).detect(image)
        assert {one.id for one in found} <= {number}, seed
        for one in found:
            assert one.range == pytest.approx(away, rel=0.05), seed
        read += len(found)
        seen += 1
    assert read >= 0.3 * seen


def test_a_monochrome_camera() -> None:
    look = Look(bright=(0.9, 0.9, 0.9))
    grey = picture([pole(13, 4.0, 0.1)], look=look, walls=room(20.0))[:, :, 1]
    one = only(np.ascontiguousarray(grey))
    assert one.id == 13
    assert one.range == pytest.approx(4.0, rel=0.01)


def test_grey_in_three_channels_is_grey() -> None:
    image = picture([pole(13, 4.0, 0.1)])[:, :, 1]
    assert only(np.ascontiguousarray(image)).id == 13
    assert ALL.detect(np.dstack([image] * 3)) == ALL.detect(np.ascontiguousarray(image))
    tinted = np.dstack([image] * 3)
    tinted[image.shape[0] // 2, 0, 2] += 1  # one pixel with colour: a picture with hardly any
    assert ALL.detect(tinted) == []


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


@pytest.mark.parametrize("lighter", [0, 4, 10, 20])
def test_tape_a_little_wider_than_the_pole_is_not_taken_for_paint(lighter: int) -> None:
    image = picture([pole(13, 3.0, 0.0)], 1)
    one = only(image)
    unit = (one.bottom - one.top) / 13
    half = 0.7 * unit + 2
    black = image[round(one.top + 2.5 * unit), round(one.column)].astype(int)
    for segment in (3, 7, 9):  # the bright ones
        upper, lower = one.top + segment * unit - 1.5, one.top + (segment + 1) * unit + 1.5
        taped = image.copy()
        rows = slice(round(upper), round(lower))
        taped[rows, round(one.column - half) : round(one.column + half) + 1] = black + lighter
        assert ALL.detect(taped) == [], segment


def test_a_cover_matters_where_it_makes_one_landmark_of_another() -> None:
    """A dark board crosses 12 where 13 has a bright bit and 14 another one."""
    image = picture([pole(12, 3.0, 0.0)], 2)
    one = only(image)
    unit = (one.bottom - one.top) / 13
    rows = slice(round(one.top + 3 * unit), round(one.top + 4 * unit))
    middle, black = round(one.column), image[rows.start + 2, round(one.column)].astype(int)
    for side in (slice(0, middle - round(0.7 * unit)), slice(middle + round(0.7 * unit), 400)):
        image[rows, side] = black + 3
    for others, seen in (((13,), []), ((15,), []), ((14,), [12]), ((3, 10), [12])):
        some = LandmarkDetector(CAMERA, dict.fromkeys((12, *others), LandmarkKind()))
        assert [found.id for found in some.detect(image)] == seen, others


@pytest.mark.parametrize("tone", [(76, 66, 62), (40, 40, 42), None], ids=["grey", "dark", "black"])
@pytest.mark.parametrize("away", [3.0, 6.0, 9.0])
def test_a_thing_over_two_bits_is_noticed(tone: tuple[int, int, int] | None, away: float) -> None:
    """On a map whose ids differ in two bits, 14 reads as 2 where both its lower bits are hidden."""
    some = LandmarkDetector(CAMERA, dict.fromkeys((2, 14), LandmarkKind()))
    for seed in range(4):
        image = picture([pole(14, away, 0.0)], seed)
        one = only(image)
        unit = (one.bottom - one.top) / 13
        middle = (one.column, one.top + 8.5 * unit)
        size = (round(3.5 * unit), round(1.75 * unit))
        blob = cv2.ellipse(
            np.zeros(image.shape[:2], np.uint8),
            (round(middle[0]), round(middle[1])), size, 0, 0, 360, 255, -1,
        )  # fmt: skip
        paint = image[round(one.top + 2.5 * unit), round(one.column)]
        image[blob > 0] = paint if tone is None else tone
        assert some.detect(image) == []


def inside(n: int, first: float, end: float) -> NDArray[np.float64]:
    """Share of each of ``n`` pixels in a row that lies between two places."""
    at = np.arange(float(n))
    return np.clip(np.minimum(at + 0.5, end) - np.maximum(at - 0.5, first), 0.0, 1.0)


@pytest.mark.parametrize("tone", [12, 30, 55])
@pytest.mark.parametrize("away", [5.0, 8.5, 10.0, 12.0, 14.0])
def test_a_board_across_a_landmark_is_noticed_near_and_far(away: float, tone: int) -> None:
    for seed, number in enumerate((3, 7, 11, 13, 14, 15)):
        image = picture([pole(number, away, 0.0)], seed)
        one = only(image)
        unit = (one.bottom - one.top) / 13
        for bit in range(4):
            if number >> bit & 1 and number != 1 << bit:
                upper = one.top + (2.8 + 2 * bit) * unit
                half = 1.7 * unit + 3.0
                high = inside(image.shape[0], upper, upper + 1.4 * unit)
                wide = inside(image.shape[1], one.column - half, one.column + half)
                share = cv2.GaussianBlur(high[:, None] * wide, (0, 0), 0.45)[..., None]
                covered = np.rint(image + share * (tone - image.astype(float)))
                found = ALL.detect(covered.astype(np.uint8))
                assert {other.id for other in found} <= {number}, (number, bit)


ROWS = np.arange(300.0)[:, None]


@pytest.mark.parametrize(
    "wall",
    [
        155 + 0 * ROWS,
        155 - 0.6 * (ROWS - 150),
        155 - (ROWS - 150),
        155 + 20 * np.sin(ROWS / 9),
        np.where(ROWS > 150, 135.0, 155.0),
        np.where(ROWS > 190, 110.0, 155.0),
    ],
    ids=["plain", "shaded", "more shaded", "waves", "two tones", "floor"],
)
@pytest.mark.parametrize("unit", [4, 6, 9])
def test_a_rod_in_front_is_not_taken_for_paint(wall: NDArray[np.float64], unit: int) -> None:
    """As black as paint, it hides a bright bit; whatever the wall behind looks like."""
    for number in (3, 7, 9, 11, 13, 14, 15):
        code = encode(number, 4)
        for bit in range(4):
            if number >> bit & 1:
                image = post(code, unit, bit, wall=wall, rod=3 + 2 * bit)
                assert {one.id for one in ALL.detect(image)} <= {number}, bit


def post(
    code: str,
    unit: int,
    seed: int,
    *,
    longer: int = 0,
    board: bool = False,
    bars: bool = True,
    wall: float | NDArray[np.float64] = 155.0,
    rod: int | None = None,
) -> Image:
    """A painted post in front of a grey wall or an orange board.

    Args:
        code: from top to bottom, "1" for bright.
        wall: how bright the wall is, about; or each of its rows.
        longer: segments of bright paint that follow at either end.
        bars: whether the two segments at either end are painted at all.
        rod: the segment in front of which a black rod crosses the picture.
    """
    image = np.zeros((300, 400, 3)) + np.stack([wall - 5, wall + 0, wall + 5], axis=-1)
    if board:
        image[:, 140:260] = (60.0, 135.0, 225.0)
    across = (np.arange(400) - 200.0) / (0.7 * unit)
    inside = np.abs(across) <= 1
    shade = 0.55 + 0.45 * np.sqrt(np.clip(1 - across[inside] ** 2, 0, 1))
    places = np.floor((np.arange(300) - (150 - len(code) * unit / 2)) / unit).astype(int)
    for row, place in enumerate(places):
        bar = not 2 <= place < len(code) - 2
        if not -longer <= place < len(code) + longer or (bar and not bars):
            continue
        bright = not 0 <= place < len(code) or code[place] == "1"
        paint = np.array((40.0, 120.0, 235.0) if bright else (20.0, 20.0, 20.0))
        image[row, inside] = paint * shade[:, None]
    if rod is not None:
        image[places == rod] = 20.0
    image = np.asarray(cv2.GaussianBlur(image, (0, 0), 0.6))
    image += np.random.default_rng(seed).normal(0, 1.2, image.shape)
    return np.clip(image, 0, 255).astype(np.uint8)


@pytest.mark.parametrize("number", [1, 2, 12, 15])
@pytest.mark.parametrize("unit", [8, 10, 12])
def test_an_end_bar_is_paint_and_ends(number: int, unit: int) -> None:
    code = encode(number, 4)
    for board in (False, True):
        assert only(post(code, unit, unit, board=board)).id == number
    assert ALL.detect(post(code, unit, unit, longer=5)) == [], "a post that goes on"
    assert ALL.detect(post(code, unit, unit, board=True, bars=False)) == [], "stripes on a board"


def stripes(code: str, unit: int, seed: int, fainter: float) -> Image:
    """Stripes across a board, a pole's width of them in full colour, the rest ``fainter``."""
    grey, image = np.array((150.0, 155.0, 160.0)), np.full((300, 400, 3), (150.0, 155.0, 160.0))
    across = np.abs(np.arange(400) - 200.0) / (0.7 * unit)
    places = np.floor((np.arange(300) - (150 - len(code) * unit / 2)) / unit).astype(int)
    for row, place in enumerate(places):
        if 0 <= place < len(code):
            paint = np.array((40.0, 120.0, 235.0) if code[place] == "1" else (20.0, 20.0, 20.0))
            image[row, across <= 3.5] = paint + fainter * (grey - paint)
            image[row, across <= 1] = paint
    image = np.asarray(cv2.GaussianBlur(image, (0, 0), 0.6))
    image += np.random.default_rng(seed).normal(0, 1.2, image.shape)
    return np.clip(image, 0, 255).astype(np.uint8)


@pytest.mark.parametrize("unit", [3, 4, 6, 10])
def test_a_pole_hides_what_is_behind_it(unit: int) -> None:
    """What goes on beside a strip as it does on it is a pattern, and no pole."""
    for number in range(1, 16):
        code = encode(number, 4)
        assert only(stripes(code, unit, unit, 1.0)).id == number
        for fainter in (0.0, 0.1, 0.2):
            assert ALL.detect(stripes(code, unit, unit, fainter)) == []


@pytest.mark.parametrize("bits", SUPPORTED_BITS)
def test_codes_with_one_bright_bit_are_read_before_black(bits: int) -> None:
    """Only their few bright segments stand out there."""
    some = LandmarkDetector(CAMERA, {1 << bit: LandmarkKind(bits=bits) for bit in range(bits)})
    for bit in range(bits):
        for unit in (4, 6, 9):
            image = post(encode(1 << bit, bits), unit, bit, wall=12.0)
            assert only(image, some).id == 1 << bit


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
