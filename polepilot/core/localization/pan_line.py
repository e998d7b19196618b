"""From counts of the pan potentiometer to radians: a straight line through known directions.

The paper takes the voltage for linear in the angle; two directions are enough for a line, four or
more also show how far the potentiometer is from straight.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from polepilot.core.errors import InputError
from polepilot.core.vehicle import PanUnit
from polepilot.core.verdict import Verdict

TEN_BITS, SIXTEEN_BITS = 1023, 65535
"""Largest counts of the converter: of the boards that we know, and of the link's field."""
DIRECTION_SIGMA = math.radians(0.3)
"""How well a person points the camera into a known direction."""
ROUNDING_SIGMA = 1 / math.sqrt(12)
"""Of a converter that says whole counts, counts."""

_GOOD, _FAIR = math.radians(0.5), math.radians(1.5)
"""Largest residual, and largest doubt at the ends of the range."""
_BLUNDER = math.radians(1.5)
_BOW_FROM = 4
"""Directions from which on a bow can be told."""


@dataclass(frozen=True, slots=True)
class KnownDirection:
    """The converter said ``adc`` while the camera looked at ``angle`` (rad, left positive)."""

    adc: float
    angle: float

    def __post_init__(self) -> None:
        if not 0 <= self.adc <= SIXTEEN_BITS:
            raise InputError(f"{self.adc:g} counts: expected 0 to {SIXTEEN_BITS}.")
        if not abs(self.angle) <= math.tau:
            raise InputError(f"{math.degrees(self.angle):g} degrees: expected -360 to 360.")


@dataclass(frozen=True, slots=True)
class PanLine:
    """angle = ``zero`` + ``scale`` * counts, radians; a negative scale is a reversed motor."""

    zero: float
    scale: float

    def __post_init__(self) -> None:
        if not (math.isfinite(self.zero) and math.isfinite(self.scale) and self.scale != 0):
            raise InputError("the directions make no line: expected counts and angles that differ.")

    @classmethod
    def of(cls, unit: PanUnit) -> PanLine:
        """The line that ``unit`` is calibrated to."""
        scale = (unit.maximum - unit.minimum) / (unit.adc_at_maximum - unit.adc_at_minimum)
        return cls(unit.minimum - scale * unit.adc_at_minimum, scale)

    def angle(self, adc: float) -> float:
        return self.zero + self.scale * adc

    def adc(self, angle: float) -> float:
        return (angle - self.zero) / self.scale


@dataclass(frozen=True, slots=True)
class LineFit:
    """The line through some directions, and what is left of them."""

    line: PanLine
    directions: tuple[KnownDirection, ...]
    sigma_at: tuple[float, float]
    """How far off the line may be at the right and left end of the range, radians."""
    bow: float | None
    """Largest distance of a parabola through the directions from the line, radians."""

    @property
    def residuals(self) -> tuple[float, ...]:
        """Line minus given, radians; positive is to the left."""
        return tuple(self.line.angle(d.adc) - d.angle for d in self.directions)


def fit_line(directions: Sequence[KnownDirection], unit: PanUnit) -> LineFit:
    """The least-squares line through ``directions``; ``unit`` says where the range ends.

    Raises:
        InputError: fewer than two different directions.
    """
    adc = np.array([d.adc for d in directions])
    angle = np.array([d.angle for d in directions])
    if len(directions) < 2 or np.ptp(adc) < 1 or np.ptp(angle) < math.radians(1):
        raise InputError(
            f"{len(directions)} direction(s) given: expected at least two that differ, far apart."
        )
    middle = adc.mean()
    scale = float((adc - middle) @ angle / ((adc - middle) @ (adc - middle)))
    line = PanLine(float(angle.mean()) - scale * float(middle), scale)
    residual = line.zero + scale * adc - angle
    freedom = len(directions) - 2
    spread = math.sqrt(float(residual @ residual) / freedom) if freedom else 0.0
    # Residuals show what a count's rounding does as well; without any it has to be told.
    sigma = max(spread, math.hypot(DIRECTION_SIGMA, scale * ROUNDING_SIGMA))
    moment = float((adc - middle) @ (adc - middle))
    ends = (line.adc(unit.minimum), line.adc(unit.maximum))
    low, high = (
        sigma * math.sqrt(1 / len(adc) + (end - float(middle)) ** 2 / moment) for end in ends
    )
    return LineFit(line, tuple(directions), (low, high), _bow(adc, angle))


def corrected(unit: PanUnit, line: PanLine) -> PanUnit:
    """``unit`` calibrated to ``line``: whole counts at (nearly) the same ends.

    Counts are whole numbers, so each end is moved to the angle of the nearest one; an end that the
    converter does not reach becomes its last count.

    Raises:
        InputError: nothing is left of the range.
    """
    present = max(unit.adc_at_minimum, unit.adc_at_maximum)
    most = TEN_BITS if present <= TEN_BITS else SIXTEEN_BITS
    low, high = (min(max(round(line.adc(a)), 0), most) for a in (unit.minimum, unit.maximum))
    if low == high or line.angle(low) >= line.angle(high):
        raise InputError(
            f"the line leaves nothing of the range: {math.degrees(unit.minimum):g} to "
            f"{math.degrees(unit.maximum):g} degrees would be {low} to {high} counts."
        )
    return replace(
        unit,
        minimum=round(line.angle(low), 6),
        maximum=round(line.angle(high), 6),
        adc_at_minimum=low,
        adc_at_maximum=high,
    )


def judge(fit: LineFit) -> Verdict:
    """What to think of a fit, in words."""
    notes = tuple(_notes(fit))
    largest = max(abs(value) for value in fit.residuals)
    ends = max(fit.sigma_at)
    within = f"all directions lie within {math.degrees(largest):.2f}° of a line"
    sure = f"the ends of the range are known to {math.degrees(ends):.2f}°"
    if len(fit.directions) == 2 and ends <= _FAIR:
        reason = f"two directions always make a line, a third would show a mistake; {sure}."
        return Verdict("fair", reason, notes)
    if largest <= _GOOD and ends <= _GOOD:
        return Verdict("good", f"{within}; {sure}.", notes)
    if largest <= _FAIR and ends <= _FAIR:
        return Verdict("fair", f"{within}; {sure}.", notes)
    if largest > _FAIR:
        reason = f"the directions are up to {math.degrees(largest):.1f}° off any line."
        return Verdict("poor", reason, notes)
    return Verdict("poor", f"{sure} only: take directions farther apart.", notes)


def _notes(fit: LineFit) -> Iterator[str]:
    blunder = _blunder(fit.directions)
    if blunder is not None:
        index, off = blunder
        one = fit.directions[index]
        side = "left" if off > 0 else "right"
        yield (
            f"{one.adc:g} = {math.degrees(one.angle):g}° does not fit the others: they say "
            f"{math.degrees(abs(off)):.1f}° farther {side}. Take it again."
        )
    span = max(d.angle for d in fit.directions) - min(d.angle for d in fit.directions)
    if max(fit.sigma_at) > _GOOD:
        yield (
            f"The directions span {math.degrees(span):.0f}° only: some near both ends of the range "
            "make the line surer."
        )
    if fit.bow is not None and blunder is None and fit.bow > _GOOD:
        yield (
            f"The potentiometer is bent: {math.degrees(fit.bow):.1f}° off the line "
            f"({fit.bow / span * 100:.1f} % of the span). The localizer learns this by itself."
        )


def _bow(adc: np.ndarray, angle: np.ndarray) -> float | None:
    if len(np.unique(adc)) < _BOW_FROM:
        return None
    place = (adc - adc.min()) / np.ptp(adc)
    grid = np.linspace(0, 1, 101)
    bent = np.polyval(np.polyfit(place, angle, 2), grid)
    straight = np.polyval(np.polyfit(place, angle, 1), grid)
    return float(np.abs(bent - straight).max())


def _blunder(directions: Sequence[KnownDirection]) -> tuple[int, float] | None:
    """Which one contradicts all others, which agree with each other; and where they put it."""
    if len(directions) < 4:
        return None
    found = []
    for index, one in enumerate(directions):
        others = [*directions[:index], *directions[index + 1 :]]
        adc = np.array([d.adc for d in others])
        angle = np.array([d.angle for d in others])
        if np.ptp(adc) < 1:
            continue
        scale, zero = np.polyfit(adc, angle, 1)
        off = float(zero + scale * one.adc - one.angle)
        rest = float(np.abs(zero + scale * adc - angle).max())
        if abs(off) > max(_BLUNDER, 4 * rest):
            found.append((index, off))
    return found[0] if len(found) == 1 else None
