"""Landmarks of which the picture shows a part: what is told of them, and what is not guessed."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace
from itertools import product

import numpy as np
import pytest
from vision_scenes import CAMERA, picture, pole

from polepilot.core.landmark import LandmarkKind
from polepilot.core.observation import Detection, Image
from polepilot.core.vision.detector import LandmarkDetector
from polepilot.core.vision.measure import column_of

KINDS = dict.fromkeys(range(1, 16), LandmarkKind())
ALL = LandmarkDetector(CAMERA, KINDS)


def only(image: Image, detector: LandmarkDetector = ALL) -> Detection:
    found = detector.detect(image)
    assert len(found) == 1, found
    return found[0]


def off(one: Detection, away: float, bearing: float) -> tuple[float, float, float]:
    """Of the range as a share, and of range and bearing over their sigmas."""
    range_ratio = (one.range - away) / one.range_sigma
    return abs(one.range / away - 1), range_ratio, (one.bearing - bearing) / one.bearing_sigma


@pytest.mark.parametrize("side", [-1, 1])
@pytest.mark.parametrize("away", [1.4, 2.2, 4.0])
def test_cut_off_by_the_side_of_the_picture(side: int, away: float) -> None:
    """From a third of its width on; range and bearing as good as of a whole one, about."""
    half = CAMERA.constant * 0.035 / away
    rows = []
    for number in range(1, 16):
        for share in (0.35, 0.5, 0.75, 1.0):
            edge = 0.0 if side < 0 else CAMERA.width - 1.0
            middle = edge - side * (2 * share - 1) * half
            bearing = math.atan2(CAMERA.center_x - middle, CAMERA.constant)
            assert column_of(bearing, CAMERA) == pytest.approx(middle)
            one = only(picture([pole(number, away, bearing)], seed=number))
            assert one.id == number, share
            rows.append(off(one, away, bearing))
    errors, ratios, turned = np.array(rows).T
    assert np.mean(errors) <= 0.0025
    assert np.max(errors) <= 0.01
    assert np.sqrt(np.mean(np.square(ratios))) <= 1.6
    assert np.sqrt(np.mean(np.square(turned))) <= 1.25


def test_poles_that_the_robot_passes_closely() -> None:
    """From where the last bit is in the picture on, though not all of what is below it. Those with
    one bright bit say too little of their size."""
    several = [number for number in KINDS if number & number - 1]
    rows = []
    places = product((1.08, 1.11, 1.14, 1.18, 1.23), (-0.24, -0.1, 0.0, 0.17))
    for seed, (away, bearing) in enumerate(places):
        number = several[seed % len(several)]
        one = only(picture([pole(number, away, bearing)], seed=seed))
        assert one.id == number, (away, bearing)
        rows.append(off(one, away, bearing))
    errors, ratios, turned = np.array(rows).T
    assert np.mean(errors) <= 0.002
    assert np.max(errors) <= 0.01
    assert np.sqrt(np.mean(np.square(ratios))) < 1.6
    assert np.sqrt(np.mean(np.square(turned))) < 1.25


def test_nearer_ones_are_never_taken_for_others() -> None:
    """Their segments have the proportions of other codes, larger or smaller, higher or lower."""
    rng = np.random.default_rng(8)
    read = 0
    for seed in range(300):
        ids = sorted(int(one) for one in rng.choice(range(1, 16), 7, replace=False))
        number, away = int(rng.choice(ids)), float(rng.uniform(0.35, 1.2))
        bearing = float(rng.uniform(-0.4, 0.4))
        detector = LandmarkDetector(CAMERA, dict.fromkeys(ids, LandmarkKind()))
        found = detector.detect(picture([pole(number, away, bearing)], seed=seed))
        assert {one.id for one in found} <= {number}, (seed, away, bearing)
        for one in found:
            assert one.range == pytest.approx(away, rel=0.015), (seed, away, bearing)
        read += len(found)
    assert read >= 75


def cut(
    image: Image,
    first: int,
    end: int,
    lower: float = 0.0,
    kinds: Mapping[int, LandmarkKind] = KINDS,
) -> list[Detection]:
    """What is seen in these rows of a picture, all that a camera shows; ``lower``: by how many rows
    its axis is thought to be lower."""
    center = CAMERA.center_y - first + lower
    camera = replace(CAMERA, height=end - first, center_y=center)
    detector = LandmarkDetector(camera, kinds)
    return detector.detect(np.ascontiguousarray(image[first:end]))


def test_near_landmarks_whose_lower_bar_is_out_of_the_picture() -> None:
    rows = []
    number = 0
    for away in (1.28, 1.33, 1.38, 1.43, 1.48, 1.53):
        for bearing in (-0.24, -0.1, 0.0, 0.17):
            number = number % 15 + 1
            one = only(picture([pole(number, away, bearing)], seed=number))
            assert one.id == number
            assert one.bottom > CAMERA.height + 0.4 * (one.bottom - one.top) / 13
            rows.append(off(one, away, bearing))
    errors, ratios, turned = np.array(rows).T
    assert np.mean(errors) <= 0.0015
    assert np.max(errors) <= 0.01
    assert np.sqrt(np.mean(np.square(ratios))) < 1.25
    assert np.sqrt(np.mean(np.square(turned))) < 1.25


@pytest.mark.parametrize("number", range(1, 16))
def test_how_much_of_a_landmark_has_to_be_in_the_picture(number: int) -> None:
    """All its bits, if every number exists, and a part of an end bar; it is never another one."""
    away = 2.2
    image = picture([pole(number, away, 0.1)], number)
    one = only(image)
    unit = (one.bottom - one.top) / 13

    def seen(above: float, below: float) -> list[Detection]:
        """With so many segments out of the picture at either end."""
        return cut(image, round(one.top + above * unit), round(one.bottom - below * unit) + 1)

    read = 0
    for above, below in ((0, 1), (0, 2), (1, 0), (2, 0), (1.3, 1.3), (2, 1.2), (0, 3), (3, 0)):
        (found,) = seen(above, below)
        assert found.id == number, (above, below)
        assert found.range == pytest.approx(away, abs=3.5 * found.range_sigma)
        assert found.range == pytest.approx(away, rel=0.01)
        assert found.bearing == pytest.approx(0.1, abs=3 * found.bearing_sigma)
    for above, below in ((2, 2), (0, 5), (5, 0), (2, 4), (0, 9), (9, 0)):
        assert seen(above, below) == [], (above, below)
    for above in np.arange(0, 9, 0.25):
        for below in (0, 0.5, 1.5, 2, 2.6):
            some = seen(above, below)
            assert {one.id for one in some} <= {number}, (above, below)
            read += len(some)
    assert read >= 40


def test_a_site_with_few_landmarks_knows_them_by_a_part() -> None:
    image = picture([pole(6, 2.2, 0.1)])
    one = only(image)
    end = round(one.bottom - 5.0 * (one.bottom - one.top) / 13) + 1
    few = dict.fromkeys((3, 6, 9), LandmarkKind())
    assert cut(image, round(one.top), end) == [], "14 begins with the same bits"
    (found,) = cut(image, round(one.top), end, kinds=few)
    assert found.id == 6
    assert found.range == pytest.approx(2.2, rel=0.005)
    likely = {**few, 14: LandmarkKind(bits=5)}
    assert cut(image, round(one.top), end, kinds=likely) == [], "a longer one that begins alike"


@pytest.mark.parametrize("number", [3, 16 + 5, 16 + 15, 128 + 9])
def test_a_longer_code_cut_short_is_no_shorter_one(number: int) -> None:
    """Its lower end stands on the floor; its upper one, at the picture's edge, is any segment."""
    bits = 8 if number > 31 else 5
    longer = LandmarkKind(bits=bits)
    kinds = dict.fromkeys(range(1, 16), LandmarkKind()) | {number: longer}
    detector = LandmarkDetector(CAMERA, kinds)
    image = picture([pole(number, 3.0, 0.0, longer)])
    (whole,) = detector.detect(image)
    assert whole.id == number
    unit = (whole.bottom - whole.top) / longer.segments
    for gone in np.arange(0.5, 2 * bits, 0.25):
        first = round(whole.top + gone * unit)
        left = replace(CAMERA, height=300 - first, center_y=CAMERA.center_y - first)
        looking = LandmarkDetector(left, kinds)
        found = looking.detect(np.ascontiguousarray(image[first:]))
        assert {one.id for one in found} <= {number}, gone


def test_a_landmark_without_an_end_bar_stands_on_the_floor() -> None:
    image = picture([pole(13, 3.0, 0.0)])
    one = only(image)
    first = round(one.top + 2 * (one.bottom - one.top) / 13)
    assert [found.id for found in cut(image, first, 300)] == [13]
    assert cut(image, first, 300, lower=80) == [], "40 cm above the floor"
    assert [found.id for found in cut(image, first - 20, 300, lower=80)] == [13], "all is seen"


def test_a_covered_segment_is_not_guessed_where_a_bar_is_out_of_the_picture() -> None:
    image = picture([pole(13, 1.3, 0.0)])
    one = only(image)
    unit = (one.bottom - one.top) / 13
    for segment in range(11):
        first = round(one.top + segment * unit)
        covered = image.copy()
        covered[first : round(first + unit), 170:230] = (150, 150, 150)
        assert ALL.detect(covered) == [], segment


def test_something_black_at_the_edge_of_the_picture_is_no_end_of_a_code() -> None:
    """A doorstep, a bumper, a carpet: as black as the paint, it may hide bright bits."""
    read = 0
    for seed in range(120):
        rng = np.random.default_rng(seed)
        number, away = int(rng.integers(1, 16)), float(rng.uniform(1.0, 1.8))
        image = picture([pole(number, away, float(rng.uniform(-0.25, 0.25)))], seed)
        strip = image[CAMERA.height - int(rng.integers(10, 90)) :]
        strip[:] = np.clip(rng.choice([20, 35, 45, 60]) + rng.normal(0, 2, strip.shape), 0, 255)
        found = ALL.detect(image)
        assert {one.id for one in found} <= {number}, seed
        read += len(found)
    assert read >= 2, "where it hides hardly anything"


def test_a_black_thing_across_one_that_the_picture_cuts_is_noticed() -> None:
    """Only one side of it is to be seen."""
    read = wrong = 0
    for seed in range(150):
        rng = np.random.default_rng(seed)
        number, away = int(rng.integers(1, 16)), float(rng.uniform(1.4, 3.0))
        half = CAMERA.constant * 0.035 / away
        shown = (2 * float(rng.uniform(0.4, 1.0)) - 1) * half
        image = picture([pole(number, away, math.atan2(CAMERA.center_x - shown, 600))], seed)
        unit = CAMERA.constant * 0.05 / away
        top = (
            CAMERA.center_y
            - 5 * unit
            + (3 + 2 * int(rng.integers(4)) - rng.uniform(0.1, 0.9)) * unit
        )
        thing = image[
            round(max(top, 0)) : round(top + unit * rng.uniform(1.2, 1.9)), : round(4 * half) + 20
        ]
        thing[:] = np.clip(rng.choice([20, 28, 35, 40, 50]) + rng.normal(0, 2, thing.shape), 0, 255)
        found = ALL.detect(image)
        read += sum(one.id == number for one in found)
        wrong += sum(one.id != number for one in found)
    assert wrong <= 1
    assert read >= 5
