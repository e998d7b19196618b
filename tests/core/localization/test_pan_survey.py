"""The pan potentiometer's errors from landmarks seen while standing."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
import pytest

from polepilot.core.errors import InputError
from polepilot.core.geometry import Pose2D, wrap_angle
from polepilot.core.landmark import Landmark
from polepilot.core.localization.pan_line import PanLine
from polepilot.core.localization.pan_survey import PanSurvey, judge, survey_pan
from polepilot.core.observation import RangeBearing

HALF = math.radians(135)
STANDS = Pose2D(2.2, 1.7, 0.8)
"""The camera, and the heading of the robot."""
PLACES = [(2.6, 0.3), (5.7, 0.3), (5.6, 4.6), (0.2, 4.5), (3.0, 4.8), (4.5, 2.2)]
MARKS = {n: Landmark(n, *place) for n, place in enumerate(PLACES, start=1)}


def sweep(
    numbers: Sequence[int] = tuple(MARKS),
    *,
    scale: float = 1.0,
    offset: float = 0.0,
    bow: float = 0.0,
    range_scale: float = 1.0,
    seed: int = 1,
    moved: dict[int, tuple[float, float]] | None = None,
    survey: float = 0.0,
) -> list[RangeBearing]:
    """What a camera that turns from end to end and back sees.

    The true pan angle is ``offset`` + ``scale`` * read + ``bow`` * P2(read / HALF).
    """
    rng = np.random.default_rng(seed)
    places = {n: MARKS[n].position for n in numbers} | (moved or {})
    places = {
        n: (x + survey * rng.normal(), y + survey * rng.normal()) for n, (x, y) in places.items()
    }
    found = []
    reads = np.concatenate([np.arange(-2.3, 2.3, 0.05), np.arange(2.3, -2.3, -0.05)])
    for index, read in enumerate(reads):
        unit = read / HALF
        true = offset + scale * read + bow * (1.5 * unit**2 - 0.5)
        for number, place in places.items():
            inside = wrap_angle(STANDS.bearing_to(place) - true)
            if abs(inside) > 0.3:
                continue
            away = STANDS.distance_to(place)
            measured = range_scale * away * (1 + 0.002 * rng.normal())
            image = inside + 0.0003 * rng.normal()
            found.append(
                RangeBearing(
                    index * 0.07,
                    number,
                    measured,
                    wrap_angle(read + image),
                    0.002 * measured,
                    0.0003,
                    float(read),
                )
            )
    return found


def solve(found: list[RangeBearing], heading: float | None = None) -> PanSurvey:
    return survey_pan(found, MARKS, HALF, heading)


@pytest.mark.parametrize("scale", [1.0, 1.02, 0.97, 1.08, 0.87])
@pytest.mark.parametrize("numbers", [(1, 2, 3, 4, 5, 6), (2, 3, 5), (1, 3, 6)])
def test_scale_and_place(scale: float, numbers: tuple[int, ...]) -> None:
    answer = solve(sweep(numbers, scale=scale), STANDS.heading)
    assert answer.scale == pytest.approx(scale, abs=0.003)
    assert abs(answer.scale - scale) < 4 * answer.scale_sigma
    assert answer.camera.distance_to(STANDS.position) < 0.01
    assert answer.offset == pytest.approx(0, abs=math.radians(0.3))
    assert all(check.agrees for check in answer.checks)
    assert {check.landmark for check in answer.checks} == set(numbers)


def test_everything_at_once() -> None:
    true = {"scale": 0.96, "offset": math.radians(4), "bow": math.radians(0.8)}
    answer = solve(sweep(**true, range_scale=1.012), STANDS.heading)
    assert answer.scale == pytest.approx(0.96, abs=0.002)
    assert answer.offset == pytest.approx(true["offset"], abs=math.radians(0.2))
    assert answer.bow == pytest.approx(true["bow"], abs=math.radians(0.2))
    assert answer.range_scale == pytest.approx(1.012, abs=0.002)
    verdict = judge(answer)
    assert verdict.grade == "good"
    assert any("bent: +0." in note for note in verdict.notes)
    assert any("1.2 % too long" in note for note in verdict.notes)
    # The line by which it was read, put right.
    present = PanLine(-HALF, 2 * HALF / 1023)
    line = answer.line(present)
    for adc in (0.0, 511.5, 1023.0):
        read = present.angle(adc)
        assert line.angle(adc) == pytest.approx(answer.offset + 0.96 * read, abs=0.005)


def test_a_good_calibration_is_said_to_be_one() -> None:
    right, wrong = (judge(solve(sweep(scale=scale), STANDS.heading)) for scale in (1.0, 1.03))
    assert any("not shown to be wrong" in note for note in right.notes)
    assert not any("not shown to be wrong" in note for note in wrong.notes)


def test_without_a_heading_straight_ahead_is_kept() -> None:
    answer = solve(sweep(scale=1.03, offset=0.1))
    assert answer.offset is None
    assert answer.scale == pytest.approx(1.03, abs=0.002)
    # The direction of zero as it was read is known all the same.
    assert answer.camera.heading == pytest.approx(STANDS.heading + 0.1, abs=0.005)
    present = PanLine(-HALF, 2 * HALF / 1023)
    assert answer.line(present).angle(511.5) == pytest.approx(0, abs=1e-9)
    assert any("--heading" in note for note in judge(answer).notes)


def test_a_landmark_that_was_moved_is_named() -> None:
    answer = solve(sweep(moved={4: (0.6, 4.5)}), STANDS.heading)
    assert [check.landmark for check in answer.checks if not check.agrees] == [4]
    assert answer.scale == pytest.approx(1.0, abs=0.003)
    verdict = judge(answer)
    assert verdict.grade == "fair"
    assert "Landmark 4 was left out" in verdict.notes[0]


def test_errors_are_as_large_as_they_say() -> None:
    scores = []
    for seed in range(30):
        answer = solve(sweep((1, 2, 3, 5), seed=seed, survey=0.005), STANDS.heading)
        scores.append((answer.scale - 1) / answer.scale_sigma)
    assert 0.3 < np.std(scores) < 1.3


def test_a_small_part_of_the_range_is_not_believed() -> None:
    near = {7: Landmark(7, 4.0, 4.6), 8: Landmark(8, 3.6, 4.2), 5: MARKS[5]}
    found = [
        RangeBearing(
            0.0,
            number,
            STANDS.distance_to(mark.position),
            STANDS.bearing_to(mark.position),
            0.005,
            0.0003,
            pan,
        )
        for number, mark in near.items()
        for pan in (0.0, 0.1, 0.2)
    ]
    verdict = judge(survey_pan(found, near, HALF))
    assert verdict.grade == "poor"
    assert "over 11° of pan only" in verdict.reason


def test_too_few_landmarks() -> None:
    with pytest.raises(InputError, match=r"seen while standing: 1, 2; expected at least 3"):
        solve(sweep((1, 2)))
    with pytest.raises(InputError, match="none; expected"):
        solve([])
    with pytest.raises(InputError, match="none; expected"):
        survey_pan(sweep(), {}, HALF)


def test_another_site() -> None:
    rng = np.random.default_rng(3)
    other = {n: Landmark(n, *rng.uniform(0, 12, 2)) for n in MARKS}
    try:
        answer = survey_pan(sweep(), other, HALF)
    except InputError as error:
        assert "right site" in str(error)  # noqa: PT017
    else:
        assert judge(answer).grade == "poor"
