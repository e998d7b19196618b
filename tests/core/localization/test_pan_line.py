"""Potentiometer counts to radians, from directions that a person knows."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from polepilot.core.errors import InputError
from polepilot.core.localization.pan_line import (
    KnownDirection,
    LineFit,
    PanLine,
    corrected,
    fit_line,
    judge,
)
from polepilot.core.vehicle import PanUnit

UNIT = PanUnit()
TRUE = PanLine(math.radians(-140), math.radians(0.27))
"""-140 degrees at 0 counts, 0.27 degrees per count."""


def directions(*counts: float, line: PanLine = TRUE) -> list[KnownDirection]:
    return [KnownDirection(count, line.angle(count)) for count in counts]


def known(*pairs: tuple[float, float]) -> LineFit:
    return fit_line([KnownDirection(adc, math.radians(a)) for adc, a in pairs], UNIT)


def test_a_line_through_all() -> None:
    fit = fit_line(directions(100, 400, 518.5, 900), UNIT)
    assert fit.line.scale == pytest.approx(TRUE.scale)
    assert fit.line.zero == pytest.approx(TRUE.zero)
    assert fit.residuals == pytest.approx([0, 0, 0, 0], abs=1e-12)
    assert fit.bow == pytest.approx(0, abs=1e-9)
    assert judge(fit).grade == "good"
    assert judge(fit).notes == ()


def test_two_directions() -> None:
    fit = known((100, -90), (900, 90))
    assert fit.line.angle(500) == pytest.approx(0)
    assert judge(fit).grade == "fair"
    assert "a third" in judge(fit).reason
    # Two directions near each other say little about the ends.
    near = judge(known((500, 0), (540, 10)))
    assert near.grade == "poor"
    assert "span 10° only" in near.notes[0]


def test_counts_are_whole_numbers() -> None:
    # A count apart may be any slope: the ends of the range, 120 counts away, are anywhere.
    next_to_each_other = known((512, 0), (513, 90))
    assert min(next_to_each_other.sigma_at) > math.radians(30)
    verdict = judge(next_to_each_other)
    assert verdict.grade == "poor"
    assert "take directions farther apart" in verdict.reason
    # Five degrees per count are coarse, even where the counts say exactly that.
    coarse = known(*((512 + count, 5.0 * count) for count in (-24, -12, 0, 12, 24)))
    assert judge(coarse).grade == "fair"
    # At 0.27 degrees per count the rounding adds little to what a person's eye does.
    fine = fit_line(directions(100, 300, 700, 900), UNIT)
    end = TRUE.adc(UNIT.minimum)
    by_eye = math.radians(0.3) * math.sqrt(1 / 4 + (500 - end) ** 2 / 400_000)
    assert by_eye < fine.sigma_at[0] < 1.05 * by_eye


def test_the_spread_of_rounding_is_what_is_believed() -> None:
    rng = np.random.default_rng(5)
    missed = []
    for _ in range(300):
        line = PanLine(math.radians(-140), math.radians(2.0))
        counts = np.array([20.0, 60.0]) + rng.uniform(-0.5, 0.5, 2)
        read = [KnownDirection(float(np.rint(c)), line.angle(float(c))) for c in counts]
        fit = fit_line(read, UNIT)
        end = UNIT.maximum - line.angle(fit.line.adc(UNIT.maximum))
        missed.append(end / fit.sigma_at[1])
    # Rounding alone, without the 0.3 degrees of the person.
    assert 0.7 < float(np.std(missed)) < 1.1


def test_the_present_calibration_as_a_line() -> None:
    line = PanLine.of(UNIT)
    for adc in (0, 300, 1023):
        assert line.angle(adc) == pytest.approx(UNIT.angle(adc))
        assert line.adc(line.angle(adc)) == pytest.approx(adc)


@pytest.mark.parametrize(
    "line",
    [
        TRUE,
        PanLine(math.radians(130), math.radians(-0.25)),
        PanLine(math.radians(-100), math.radians(0.1)),
    ],
)
def test_the_corrected_unit_follows_the_line(line: PanLine) -> None:
    unit = corrected(UNIT, line)
    for adc in (unit.adc_at_minimum, 200, 512, 1000, unit.adc_at_maximum):
        assert unit.angle(adc) == pytest.approx(line.angle(adc), abs=2e-6)
    assert 0 <= unit.adc_at_minimum <= 1023
    assert 0 <= unit.adc_at_maximum <= 1023
    assert unit.minimum < unit.maximum
    assert unit.rate == UNIT.rate
    # An end stays where it was, to half a count, where the converter reaches it.
    reach = sorted((line.angle(0), line.angle(1023)))
    assert unit.minimum == pytest.approx(max(UNIT.minimum, reach[0]), abs=abs(line.scale) / 2)
    assert unit.maximum == pytest.approx(min(UNIT.maximum, reach[1]), abs=abs(line.scale) / 2)


def test_a_converter_of_sixteen_bits() -> None:
    unit = PanUnit(adc_at_minimum=3000, adc_at_maximum=60000)
    line = PanLine(math.radians(-150), math.radians(0.005))
    assert corrected(unit, line).adc_at_maximum == 57000


def test_nothing_left_of_the_range() -> None:
    with pytest.raises(InputError, match="nothing of the range"):
        corrected(UNIT, PanLine(math.radians(200), math.radians(0.1)))


def test_a_wrong_reading_is_named() -> None:
    points = [(100, -113.0), (300, -59.0), (500, -5.0), (700, 40.0), (900, 103.0)]
    verdict = judge(known(*points))
    assert verdict.grade == "poor"
    assert "700 = 40° does not fit the others: they say 9.0° farther left" in verdict.notes[0]


def test_a_bent_potentiometer() -> None:
    counts = np.linspace(30, 1000, 7)
    place = (counts - 30) / 970
    bent = TRUE.angle(0) + TRUE.scale * counts + math.radians(4) * place * (1 - place)
    fit = fit_line([KnownDirection(c, a) for c, a in zip(counts, bent, strict=True)], UNIT)
    # Of a bow of 1 degree in the middle the best line takes two thirds at most.
    assert fit.bow is not None
    assert math.radians(0.5) < fit.bow < math.radians(0.8)
    verdict = judge(fit)
    assert verdict.grade == "fair"
    assert any("bent" in note for note in verdict.notes)
    assert fit_line(directions(10, 500, 900), UNIT).bow is None


@given(
    st.floats(-2.5, -2.0),
    st.floats(0.004, 0.006),
    st.lists(st.integers(0, 1023), min_size=2, max_size=8, unique=True),
)
def test_any_line_is_found(zero: float, scale: float, counts: list[int]) -> None:
    line = PanLine(zero, scale)
    if max(counts) - min(counts) < 20:
        return
    fit = fit_line(directions(*counts, line=line), UNIT)
    assert fit.line.scale == pytest.approx(scale, rel=1e-6)
    assert fit.line.angle(512) == pytest.approx(line.angle(512), abs=1e-6)


@pytest.mark.parametrize("pairs", [[], [(5, 10)], [(5, 10), (5, 20)], [(5, 10), (900, 10)]])
def test_too_little(pairs: list[tuple[float, float]]) -> None:
    with pytest.raises(InputError, match="at least two that differ"):
        known(*pairs)


@pytest.mark.parametrize(("adc", "angle"), [(-1, 0), (70000, 0), (math.nan, 0), (5, 400)])
def test_impossible_directions(adc: float, angle: float) -> None:
    with pytest.raises(InputError, match="expected"):
        KnownDirection(adc, math.radians(angle))
