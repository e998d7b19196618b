"""The camera constant from landmarks at known distances."""

from __future__ import annotations

import math
from dataclasses import replace

import cv2
import numpy as np
import pytest
from vision_scenes import HERE, pole, room

from polepilot.core.errors import InputError
from polepilot.core.landmark import LandmarkKind
from polepilot.core.observation import Detection
from polepilot.core.sim.render import Renderer
from polepilot.core.vehicle import Camera
from polepilot.core.vision.calibration import (
    ConstantFit,
    KnownRange,
    before_resizing,
    fit_constant,
    judge,
    resized,
)
from polepilot.core.vision.capture import fit as cut_and_average
from polepilot.core.vision.detector import LandmarkDetector
from polepilot.core.vision.measure import range_of

KIND = LandmarkKind()
TRUE = 610.0


def seen(
    distance: float,
    bearing: float = 0.0,
    *,
    said: float | None = None,
    provisional: float = 600.0,
    stretch: float = 1.0,
) -> KnownRange:
    """A landmark at ``distance``, seen by a camera of ``TRUE`` that is taken for another one."""
    depth = (distance - KIND.axis_depth) * math.cos(bearing)
    unit = TRUE * KIND.segment / depth / stretch
    column = -TRUE * math.tan(bearing)
    camera = Camera(constant=provisional)
    apparent = math.atan2(-column, provisional)
    away = range_of(unit, apparent, KIND, camera)
    detection = Detection(7, away, apparent, column, 50.0, 100.0, 0.001 * away, 0.0003)
    name = f"{distance:g}m.png"
    return KnownRange(name, said or distance, detection, provisional, KIND.axis_depth)


def fit(*samples: KnownRange) -> ConstantFit:
    return fit_constant(samples)


@pytest.mark.parametrize("provisional", [300.0, 600.0, 610.0, 2000.0])
def test_the_constant_does_not_depend_on_the_provisional_one(provisional: float) -> None:
    samples = [
        seen(2.0, 0.25, provisional=provisional),
        seen(3.5, -0.1, provisional=provisional),
        seen(6.0, provisional=provisional),
    ]
    answer = fit(*samples)
    assert answer.constant == pytest.approx(TRUE, rel=1e-9)
    for residual in answer.residuals:
        assert residual.error == pytest.approx(0, abs=1e-9)
        assert residual.agrees
    assert judge(answer, 400).grade == "good"
    assert judge(answer, 400).notes == ()


def test_one_picture_is_enough_for_a_constant_but_not_for_trust() -> None:
    answer = fit(seen(3.0))
    assert answer.constant == pytest.approx(TRUE, rel=1e-9)
    # 3 mm of the tape and 0.1 % of the picture: about 0.14 %.
    assert answer.standard_error == pytest.approx(0.0014 * TRUE, rel=0.05)
    verdict = judge(answer, 400)
    assert verdict.grade == "fair"
    assert "Only one distance" in verdict.notes[0]


def test_centimetres_are_no_metres() -> None:
    for factor in (100, 0.01):
        near = [seen(d, said=d * factor) for d in (6.5, 8.0, 9.5)]
        verdict = judge(fit(*near), 400)
        assert verdict.grade == "poor"
        assert "Are these metres?" in verdict.reason


def test_many_pictures_from_one_place_share_the_error_of_the_tape() -> None:
    several = fit(*[seen(3.0) for _ in range(100)])
    assert several.standard_error > 0.0009 * TRUE
    assert any("Only one distance" in note for note in judge(several, 400).notes)
    assert judge(several, 400).grade == "fair"
    apart = fit(*[seen(2.0 + 0.05 * n) for n in range(100)])
    assert apart.standard_error < 0.0003 * TRUE


def test_standard_error_is_honest() -> None:
    rng = np.random.default_rng(5)
    scores = []
    for _ in range(300):
        samples = []
        for distance in (2.0, 3.0, 4.5, 6.0):
            noise = 1 + 0.001 * rng.normal()
            tape = distance + 0.003 * rng.normal()
            samples.append(seen(distance, 0.1, stretch=noise, said=tape))
        answer = fit(*samples)
        scores.append((answer.constant - TRUE) / answer.standard_error)
    assert 0.75 < np.std(scores) < 1.15
    assert abs(np.mean(scores)) < 0.2


def test_one_picture_that_disagrees_is_named_and_left_out() -> None:
    answer = fit(seen(2.0), seen(3.0, 0.1), seen(4.0, said=4.4), seen(6.0), seen(5.0, 0.2))
    assert answer.constant == pytest.approx(TRUE, rel=1e-6)
    assert [r.sample.name for r in answer.outliers] == ["4m.png"]
    verdict = judge(answer, 400)
    assert verdict.grade == "fair"
    assert "one picture disagrees: 4m.png by 9.1 % (40.0 cm too near)" in verdict.reason


@pytest.mark.parametrize("wrong", [0, 1, 2])
@pytest.mark.parametrize("factor", [0.5, 0.93, 1.03, 1.2, 10.0])
def test_one_of_three_is_found_too(wrong: int, factor: float) -> None:
    noise = (1.001, 0.9995, 1.0005)
    said = [d * (factor if n == wrong else 1.0) for n, d in enumerate((2.5, 4.0, 6.0))]
    samples = [
        seen(d, stretch=stretch, said=given)
        for d, stretch, given in zip((2.5, 4.0, 6.0), noise, said, strict=True)
    ]
    answer = fit(*samples)
    assert answer.constant == pytest.approx(TRUE, rel=0.002)
    assert [r.agrees for r in answer.residuals] == [n != wrong for n in range(3)]
    assert judge(answer, 400).grade == "fair"


def test_an_unsharp_picture_does_not_spoil_the_others() -> None:
    vague = seen(7.0, stretch=1.015)
    vague = replace(vague, detection=replace(vague.detection, range_sigma=0.06))
    answer = fit(seen(2.5), seen(4.0), vague)
    assert answer.constant == pytest.approx(TRUE, rel=0.001)
    assert answer.worst < 0.001
    verdict = judge(answer, 400)
    assert verdict.grade == "good"
    assert "7m.png (to 0.9 %)" in verdict.notes[0]
    # Sharper, the same error would be one.
    vague = replace(vague, detection=replace(vague.detection, range_sigma=0.015))
    assert judge(fit(seen(2.5), seen(4.0), vague), 400).grade == "fair"


def test_two_pictures_that_contradict_each_other() -> None:
    answer = fit(seen(3.0), seen(3.1, said=3.5))
    assert answer.outliers == ()
    verdict = judge(answer, 400)
    assert verdict.grade == "poor"
    assert "contradict each other" in verdict.reason


def test_three_pictures_two_of_which_are_wrong_are_not_taken_for_good() -> None:
    verdict = judge(fit(seen(2.0, said=2.3), seen(4.0), seen(6.0, said=5.0)), 400)
    assert verdict.grade == "poor"


@pytest.mark.parametrize("off", [0.04, -0.03])
def test_distances_measured_from_the_wrong_place(off: float) -> None:
    distances = (1.8, 2.5, 3.5, 5.0)
    answer = fit(*[seen(d, said=d - off) for d in distances])
    assert answer.offset == pytest.approx(off, abs=0.005)
    word = "short" if off > 0 else "long"
    assert f"All distances seem {abs(off) * 100:.1f} cm too {word}" in judge(answer, 400).notes[0]


def test_sizes_change_the_words_and_nothing_else() -> None:
    # A landmark that is 2 % longer than was said cannot be told from another constant.
    answer = fit(*[seen(d, stretch=1 / 1.02) for d in (2.0, 4.0, 6.0)])
    assert answer.constant == pytest.approx(TRUE * 1.02, rel=0.001)


@pytest.mark.parametrize("distance", [0.0, -1.0, math.nan, math.inf, 0.01])
def test_impossible_distances(distance: float) -> None:
    good = seen(3.0)
    with pytest.raises(InputError, match=r"3m\.png: the distance is"):
        replace(good, distance=distance)
    with pytest.raises(InputError, match="landmark's radius"):
        replace(good, distance=0.2, axis_depth=0.25)


def test_nothing_to_fit() -> None:
    with pytest.raises(InputError, match="at least one"):
        fit_constant([])


def test_rendered_pictures() -> None:
    camera = Camera(constant=TRUE)
    provisional = Camera(constant=560.0)
    samples = []
    for seed, (away, bearing) in enumerate([(2.5, 0.12), (4.0, -0.2), (6.0, 0.05)]):
        rng = np.random.default_rng(seed)
        image = Renderer(camera, [pole(13, away, bearing)], room(20.0), rng).render(HERE, 0.0)
        (found,) = LandmarkDetector(provisional, {13: KIND}).detect(image)
        samples.append(KnownRange(f"{away} m", away, found, provisional.constant, KIND.axis_depth))
    answer = fit_constant(samples)
    assert answer.constant == pytest.approx(TRUE, rel=0.003)
    assert judge(answer, 400).grade == "good"


@pytest.mark.parametrize("size", [(1600, 1200), (1920, 1080), (1280, 1024), (640, 480)])
def test_another_size_of_picture(size: tuple[int, int]) -> None:
    width, height = size
    whole = Camera(
        constant=2.0 * width,
        width=width,
        height=height,
        center_x=0.52 * width,
        center_y=0.47 * height,
        distortion=(0.1, 0, 0, 0, 0),
    )
    small = resized(whole, 400, 300)
    assert (small.width, small.height, small.distortion) == (400, 300, whole.distortion)
    back = before_resizing(small, width, height)
    assert back.constant == pytest.approx(whole.constant)
    assert (back.center_x, back.center_y) == pytest.approx((whole.center_x, whole.center_y))
    # Two spots seen through the whole picture lie where the small camera says.
    for tangent_x, tangent_y in [(0.05, 0.04), (-0.11, -0.06)]:
        picture = np.zeros((height, width), np.uint8)
        x = whole.center_x + whole.constant * tangent_x
        y = whole.center_y + whole.constant * tangent_y
        radius = width // 40
        cv2.circle(picture, (round(x * 16), round(y * 16)), radius * 16, 255, -1, cv2.LINE_AA, 4)
        moments = cv2.moments(cut_and_average(picture, 400, 300))
        column, row = moments["m10"] / moments["m00"], moments["m01"] / moments["m00"]
        assert small.center_x + small.constant * tangent_x == pytest.approx(column, abs=0.1)
        assert small.center_y + small.constant * tangent_y == pytest.approx(row, abs=0.1)
