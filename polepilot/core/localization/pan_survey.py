"""What the pan potentiometer gets wrong, from landmarks of a surveyed site seen while standing.

Unknown are where the camera stands, which way pan angle zero points, and the true pan angle as a
function of the one that was read, p:

    true = offset + scale p + bow P2(p / half range),      P2(u) = (3 u² - 1) / 2

besides a common error of all ranges. Bearings and ranges of three or more landmarks determine all
of it but the offset: a robot that stands cannot tell a camera that is mounted askew from a heading
of its own. Where its heading is known, the offset follows.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from polepilot.core.errors import InputError
from polepilot.core.geometry import Pose2D, wrap_angle
from polepilot.core.landmark import Landmark
from polepilot.core.localization.fix import Fix, FixSettings, fix
from polepilot.core.localization.pan_line import PanLine
from polepilot.core.observation import RangeBearing
from polepilot.core.verdict import Verdict

Array = NDArray[np.float64]

FEWEST_LANDMARKS = 3
SURVEY_SIGMA = 0.005
"""Of a landmark's mapped position, metres."""
BEARING_FLOOR = math.radians(0.1)
"""What repeats in all bearings of a landmark besides: wiggles of the potentiometer."""

_SCALE_PRIOR, _BOW_PRIOR, _RANGE_PRIOR = 0.2, math.radians(1.5), 0.02
_SCALES = np.round(np.arange(-0.2, 0.201, 0.01), 3)
"""By how much a scale may be off that is found at all."""
_ROUGH = FixSettings(
    bearing_floor=math.radians(1), max_position_sigma=0.5, max_heading_sigma=math.radians(10)
)
_EACH = 6
"""Sightings per landmark for a first guess."""
_HUBER = 2.0
_ROUNDS = 40
_SLACK, _GATE = 0.05, 5.0
"""A landmark disagrees if it is off by this many metres, and by so many sigmas."""
_LEAST_SPAN = math.radians(40)
_GOOD, _FAIR = math.radians(0.5), math.radians(1.5)
_X, _Y, _ZERO, _SCALE, _BOW, _RANGE = range(6)


@dataclass(frozen=True, slots=True)
class Check:
    """How one landmark agrees: measured minus expected, over all its sightings."""

    landmark: int
    sightings: int
    pan: tuple[float, float]
    """Least and greatest pan angle (as read) at which it was seen, radians."""
    range_error: float
    bearing_error: float
    agrees: bool


@dataclass(frozen=True, slots=True)
class PanSurvey:
    """The errors of the pan angle, and where the robot stood. Radians, metres."""

    camera: Pose2D
    """The pan axis in `map`, looking along pan angle zero as it is read."""
    scale: float
    """True angle per angle that was read."""
    scale_sigma: float
    bow: float
    """Coefficient of P2: how much farther left both ends are than the line says."""
    bow_sigma: float
    range_scale: float
    """Measured range per true range."""
    range_scale_sigma: float
    half_range: float
    span: tuple[float, float]
    """Least and greatest angle read with a landmark in view."""
    checks: tuple[Check, ...]
    consistent: bool = True
    """Whether the landmarks that are left agree with each other."""
    offset: float | None = None
    """True angle where 0 was read; None where the heading of the robot is not known."""

    def line(self, present: PanLine) -> PanLine:
        """``present``, the line by which the angles were read, put right."""
        zero = (self.offset or 0.0) + self.scale * present.zero
        return PanLine(zero, self.scale * present.scale)


def survey_pan(
    measurements: Sequence[RangeBearing],
    landmarks: Mapping[int, Landmark],
    half_range: float,
    heading: float | None = None,
) -> PanSurvey:
    """Solve for everything at once.

    Args:
        measurements: from one place; ``bearing`` holds ``pan`` as it was read.
        half_range: half of the pan range, radians.
        heading: of the robot in `map`, where it is known otherwise.

    Raises:
        InputError: fewer than three landmarks of the site, or what was seen does not fit it.
    """
    usable = [
        m for m in measurements if m.landmark in landmarks and m.pan is not None and _finite(m)
    ]
    _enough({m.landmark for m in usable})
    state = _first_guess(usable, landmarks, half_range)
    dropped: set[int] = set()
    problem = _Problem(usable, landmarks, half_range)
    state, covariance = problem.solve(state)
    while not (consistent := _consistent(problem, state)):
        if len(problem.ids) <= FEWEST_LANDMARKS:
            break
        # Which one is wrong shows in how well the others agree without it.
        trials = []
        for number in problem.ids:
            rest = [m for m in usable if m.landmark not in {*dropped, number}]
            trial = _Problem(rest, landmarks, half_range)
            answer, doubt = trial.solve(state)
            trials.append((trial.cost(answer) / len(rest), number, trial, answer, doubt))
        _, number, problem, state, covariance = min(trials, key=lambda one: one[0])
        dropped.add(number)
    whole = _Problem(usable, landmarks, half_range)
    pans = [m.pan for m in usable if m.pan is not None]
    sigma = np.sqrt(np.diag(covariance))
    return PanSurvey(
        camera=Pose2D(float(state[_X]), float(state[_Y]), wrap_angle(float(state[_ZERO]))),
        scale=1.0 + float(state[_SCALE]),
        scale_sigma=float(sigma[_SCALE]),
        bow=float(state[_BOW]),
        bow_sigma=float(sigma[_BOW]),
        range_scale=1.0 + float(state[_RANGE]),
        range_scale_sigma=float(sigma[_RANGE]),
        half_range=half_range,
        span=(min(pans), max(pans)),
        checks=tuple(_checks(whole, state, dropped)),
        consistent=consistent,
        offset=None if heading is None else wrap_angle(float(state[_ZERO]) - heading),
    )


def judge(survey: PanSurvey) -> Verdict:
    """What to think of it, in words."""
    notes = tuple(_notes(survey))
    doubt = survey.scale_sigma * survey.half_range
    agreeing = [check for check in survey.checks if check.agrees]
    largest = max(abs(check.bearing_error) for check in agreeing)
    sure = f"the ends of the range are known to {math.degrees(doubt):.2f}°"
    within = f"{len(agreeing)} landmarks agree within {math.degrees(largest):.2f}°"
    if survey.span[1] - survey.span[0] < _LEAST_SPAN:
        seen = math.degrees(survey.span[1] - survey.span[0])
        return Verdict("poor", f"landmarks were seen over {seen:.0f}° of pan only.", notes)
    if not survey.consistent:
        return Verdict("poor", f"the landmarks contradict each other: {within}.", notes)
    good = largest <= _GOOD and doubt <= _GOOD and len(agreeing) == len(survey.checks)
    if good:
        return Verdict("good", f"{within}; {sure}.", notes)
    if largest <= _FAIR and doubt <= _FAIR:
        return Verdict("fair", f"{within}; {sure}.", notes)
    return Verdict("poor", f"{within}; {sure} only.", notes)


def _notes(survey: PanSurvey) -> Iterator[str]:
    for check in survey.checks:
        if not check.agrees:
            yield (
                f"Landmark {check.landmark} was left out: {check.range_error * 100:+.0f} cm and "
                f"{math.degrees(check.bearing_error):+.1f}° off. Has it been moved?"
            )
    doubt = math.degrees(survey.scale_sigma * survey.half_range)
    if abs(survey.scale - 1) < 3 * survey.scale_sigma:
        yield (
            "The scale so far is not shown to be wrong: the correction is no larger than what is "
            f"uncertain here ({doubt:.1f}° at the ends). Landmarks all around would tell more."
        )
    if survey.offset is None:
        yield (
            "What counts as straight ahead was kept: from one place it cannot be told from the "
            "robot's heading. Give --heading where that is known."
        )
    if abs(survey.bow) > max(3 * survey.bow_sigma, math.radians(0.3)):
        yield (
            f"The potentiometer is bent: {math.degrees(survey.bow):+.1f}° at the ends. The "
            "localizer learns this by itself."
        )
    off = survey.range_scale - 1
    if abs(off) > max(3 * survey.range_scale_sigma, 0.005):
        way = "long" if off > 0 else "short"
        yield f"Ranges come out {abs(off) * 100:.1f} % too {way}: calibrate the camera first."


class _Problem:
    """Residuals and derivatives of all sightings for a state."""

    def __init__(
        self,
        measurements: Sequence[RangeBearing],
        landmarks: Mapping[int, Landmark],
        half_range: float,
    ) -> None:
        self.ids = sorted({m.landmark for m in measurements})
        self.number = np.array([m.landmark for m in measurements])
        self._place = np.array([landmarks[m.landmark].position for m in measurements])
        self._range = np.array([m.range for m in measurements])
        self._bearing = np.array([m.bearing for m in measurements])
        self.pan = np.array([m.pan or 0.0 for m in measurements])
        unit = np.clip(self.pan / half_range, -1, 1)
        self._bend = 1.5 * unit**2 - 0.5
        # Errors of the map repeat in every sighting of a landmark: each carries its share of them.
        count = np.array([np.count_nonzero(self.number == n) for n in self.number])
        range_sigma = np.array([m.range_sigma for m in measurements])
        bearing_sigma = np.array([m.bearing_sigma for m in measurements])
        shared = BEARING_FLOOR**2 + (SURVEY_SIGMA / self._range) ** 2
        self.range_sigma = np.sqrt(range_sigma**2 + count * SURVEY_SIGMA**2)
        self.bearing_sigma = np.sqrt(bearing_sigma**2 + count * shared)

    def residuals(self, state: Array) -> tuple[Array, Array, Array]:
        """Measured minus expected ranges and bearings, and the distances."""
        offset = self._place - state[:2]
        distance = np.maximum(np.hypot(offset[:, 0], offset[:, 1]), 1e-6)
        direction = np.arctan2(offset[:, 1], offset[:, 0])
        seen = state[_ZERO] + self._bearing + state[_SCALE] * self.pan + state[_BOW] * self._bend
        turned = np.mod(seen - direction + np.pi, math.tau) - np.pi
        return self._range - distance * (1 + state[_RANGE]), turned, distance

    def solve(self, state: Array) -> tuple[Array, Array]:
        """Gauss-Newton with Huber's weights, and the covariance."""
        prior = np.array([0, 0, 0, _SCALE_PRIOR**-2, _BOW_PRIOR**-2, _RANGE_PRIOR**-2])
        information = np.diag(prior)
        for _ in range(_ROUNDS):
            ranges, bearings, distance = self.residuals(state)
            away = (self._place - state[:2]) / distance[:, None]
            none, ones = np.zeros_like(distance), np.ones_like(distance)
            # Derivatives of the residuals.
            of_range = np.column_stack([away * (1 + state[_RANGE]), none, none, none, -distance])
            of_bearing = np.column_stack(
                [-away[:, 1] / distance, away[:, 0] / distance, ones, self.pan, self._bend, none]
            )
            jacobian = np.vstack(
                [of_range / self.range_sigma[:, None], of_bearing / self.bearing_sigma[:, None]]
            )
            scaled = np.concatenate([ranges / self.range_sigma, bearings / self.bearing_sigma])
            weight = np.minimum(1.0, _HUBER / np.maximum(np.abs(scaled), 1e-12))
            information = (jacobian.T * weight) @ jacobian + np.diag(prior)
            gradient = (jacobian.T * weight) @ scaled + prior * state
            step = np.linalg.solve(information, gradient)
            state = state - step
            if float(np.abs(step).max()) < 1e-9:
                break
        ranges, bearings, _ = self.residuals(state)
        scaled = np.concatenate([ranges / self.range_sigma, bearings / self.bearing_sigma])
        # All sightings of a landmark together carry the weight of about one.
        freedom = max(2 * len(self.ids) - 4, 1)
        inflation = max(float(scaled @ scaled) / freedom, 1.0)
        return state, np.linalg.inv(information) * inflation

    def cost(self, state: Array) -> float:
        """Sum of the residuals in sigmas, none of which counts for more than a blunder."""
        ranges, bearings, _ = self.residuals(state)
        scaled = np.concatenate([ranges / self.range_sigma, bearings / self.bearing_sigma])
        return float(np.minimum(np.abs(scaled), 5.0).sum())


def _finite(measurement: RangeBearing) -> bool:
    return all(
        math.isfinite(value)
        for value in (
            measurement.range,
            measurement.bearing,
            measurement.range_sigma,
            measurement.bearing_sigma,
        )
    )


def _enough(ids: set[int]) -> None:
    if len(ids) < FEWEST_LANDMARKS:
        seen = ", ".join(str(number) for number in sorted(ids)) or "none"
        raise InputError(
            f"landmarks of the site that were seen while standing: {seen}; expected at least "
            f"{FEWEST_LANDMARKS}."
        )


def _first_guess(
    measurements: Sequence[RangeBearing], landmarks: Mapping[int, Landmark], half_range: float
) -> Array:
    """A fix for each scale that is possible; the one that explains most of what was seen."""
    few = []
    for number in sorted({m.landmark for m in measurements}):
        own = [m for m in measurements if m.landmark == number]
        picks = np.unique(np.linspace(0, len(own) - 1, _EACH).round().astype(int))
        few += [own[index] for index in picks]
    problem = _Problem(few, landmarks, half_range)
    best: tuple[float, Array] | None = None
    for scale in _SCALES:
        turned = [replace(m, bearing=m.bearing + scale * (m.pan or 0.0)) for m in few]
        answer = fix(turned, landmarks, 0.0, _ROUGH)
        if isinstance(answer, Fix):
            state, _ = problem.solve(np.array([*answer.pose, float(scale), 0.0, 0.0]))
            if best is None or problem.cost(state) < best[0]:
                best = problem.cost(state), state
    if best is None:
        raise InputError(
            "what was seen does not fit the site's landmarks, whatever the pan's scale: is it the "
            "right site, did the robot stand still, does the camera pan the way it should?"
        )
    return best[1]


def _checks(problem: _Problem, state: Array, dropped: set[int]) -> Iterator[Check]:
    ranges, bearings, _ = problem.residuals(state)
    for number in problem.ids:
        own = problem.number == number
        yield Check(
            landmark=number,
            sightings=int(np.count_nonzero(own)),
            pan=(float(problem.pan[own].min()), float(problem.pan[own].max())),
            range_error=float(np.median(ranges[own])),
            bearing_error=float(np.median(bearings[own])),
            agrees=number not in dropped,
        )


def _consistent(problem: _Problem, state: Array) -> bool:
    """Whether every landmark is where the map has it, as far as can be told."""
    ranges, bearings, distance = problem.residuals(state)
    aside, aside_sigma = bearings * distance, problem.bearing_sigma * distance
    for number in problem.ids:
        own = problem.number == number
        count = math.sqrt(np.count_nonzero(own))
        for error, sigma in ((ranges, problem.range_sigma), (aside, aside_sigma)):
            allowed = _SLACK + _GATE * float(sigma[own].mean()) / count
            if abs(float(np.median(error[own]))) > allowed:
                return False
    return True
