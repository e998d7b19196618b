"""The camera constant C from pictures of a landmark at known distances (paper, Eq. 1).

A picture fixes the product of C and of what one pixel of height means; what the detector says at
some provisional constant can therefore be carried over to any other one. With q = depth / C, u the
landmark's columns from the optical axis and a the axis behind the surface that is seen, the
horizontal range is

    r(C) = a + q sqrt(C² + u²)

which is Eq. 1 with the depth along the optical axis made a distance to the landmark's axis. C is
the one that brings all ranges nearest to the measured distances, each weighted by how certain it
is; a picture that contradicts the others loses its weight (Huber).
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from polepilot.core.errors import InputError
from polepilot.core.observation import Detection
from polepilot.core.vehicle import Camera
from polepilot.core.verdict import Verdict

TAPE_SIGMA = 0.003
"""How well a person measures from the camera's axis to a landmark's axis, metres."""
NEAREST, FARTHEST = 0.05, 1000.0
"""Distances outside of this are slips of the keyboard, metres."""

_HUBER = 1.5
_OUTLIER = 4.0
"""Sigmas beyond which a picture disagrees with the others."""
_LEAST_DISAGREEMENT = 0.003
"""And it has to be off by this share of its distance."""
_OFFSET, _LARGEST_OFFSET = 0.01, 0.3
"""An error common to all distances is spoken of from here on, and up to there, metres."""
_USUAL = (0.2, 20.0)
"""Camera constants per width of a picture, from the widest lenses to telescopes."""
_APART = 1.2
"""Distances whose ratio is less count as one."""
_GOOD, _FAIR = 0.005, 0.015
"""Largest residual, as a share of the distance."""
_EXCUSE = 3.0
"""Sigmas by which an unsharp picture may be off."""
_ROUNDS = 60

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class KnownRange:
    """A landmark seen from a ``distance`` that somebody measured, metres, horizontal.

    ``detection`` was made with the provisional ``constant``; ``axis_depth`` is how far the
    landmark's axis lies behind its surface.
    """

    name: str
    """Of the picture, for messages."""
    distance: float
    detection: Detection
    constant: float
    axis_depth: float = 0.0

    def __post_init__(self) -> None:
        if not NEAREST <= self.distance <= FARTHEST:
            raise InputError(
                f"{self.name}: the distance is {self.distance:g} m: expected {NEAREST:g} to "
                f"{FARTHEST:g} m."
            )
        if not self.distance > self.axis_depth:
            raise InputError(
                f"{self.name}: the distance is {self.distance:g} m: expected more than the "
                f"landmark's radius, {self.axis_depth:g} m."
            )

    @property
    def _depth_per_pixel(self) -> float:
        """q: depth along the optical axis for C = 1."""
        seen = self.detection
        return (seen.range - self.axis_depth) * math.cos(seen.bearing) / self.constant

    @property
    def _aside(self) -> float:
        """u: columns from the optical axis."""
        return self.constant * math.tan(self.detection.bearing)

    def range_at(self, constant: float) -> float:
        """What the detector would say with another constant, metres."""
        return self.axis_depth + self._depth_per_pixel * math.hypot(constant, self._aside)

    def slope_at(self, constant: float) -> float:
        """By how much the range grows with the constant, metres per pixel."""
        return self._depth_per_pixel * constant / math.hypot(constant, self._aside)

    @property
    def own_constant(self) -> float:
        """The constant that makes this picture agree with its distance, pixels."""
        reach = (self.distance - self.axis_depth) / self._depth_per_pixel
        return math.sqrt(max(reach**2 - self._aside**2, 1.0))


@dataclass(frozen=True, slots=True)
class Residual:
    """What is left of a picture after the fit."""

    sample: KnownRange
    measured: float
    """Range with the fitted constant, metres."""
    sigma: float
    """How far it may be from the given distance, metres."""
    agrees: bool

    @property
    def error(self) -> float:
        """Measured minus given, metres."""
        return self.measured - self.sample.distance

    @property
    def share(self) -> float:
        """The error as a share of the given distance."""
        return self.error / self.sample.distance

    @property
    def unsharp(self) -> bool:
        """Whether the picture says little about its distance."""
        return self.sigma > _GOOD * self.sample.distance

    @property
    def excused(self) -> bool:
        """Whether the error is what was to be expected of an unsharp picture."""
        return self.unsharp and abs(self.error) < _EXCUSE * self.sigma


@dataclass(frozen=True, slots=True)
class ConstantFit:
    """The camera constant (pixels), its standard error, and how every picture agrees with it."""

    constant: float
    standard_error: float
    residuals: tuple[Residual, ...]
    offset: float | None = None
    """Metres by which all distances seem to be short, where that explains the residuals better."""

    @property
    def worst(self) -> float:
        """Largest residual of those that agree, as a share of the distance.

        A picture that is unsharp, and off by no more than it says itself, does not count.
        """
        counting = [r for r in self.residuals if r.agrees and not r.excused]
        return max(abs(r.share) for r in counting or self.residuals if r.agrees)

    @property
    def outliers(self) -> tuple[Residual, ...]:
        """The pictures that contradict the others, in the order given; the fit left them out."""
        return tuple(r for r in self.residuals if not r.agrees)


def fit_constant(samples: Sequence[KnownRange]) -> ConstantFit:
    """The constant that fits all ``samples``.

    Raises:
        InputError: no samples.
    """
    if not samples:
        raise InputError("no picture to find the camera constant from: expected at least one.")
    sigma = _sigmas(samples)
    constant, scale = _solve(samples, sigma)
    agrees = _agreeing(samples, constant, sigma * scale)
    if not agrees.all():
        kept = [s for s, good in zip(samples, agrees, strict=True) if good]
        constant, _ = _solve(kept, sigma[agrees])
    return ConstantFit(
        constant=constant,
        standard_error=_standard_error(samples, constant, sigma, agrees),
        residuals=tuple(
            Residual(sample, sample.range_at(constant), float(one), bool(good))
            for sample, one, good in zip(samples, sigma, agrees, strict=True)
        ),
        offset=_common_offset(samples, constant, sigma),
    )


def judge(fit: ConstantFit, width: int) -> Verdict:
    """What to think of a fit to pictures ``width`` pixels wide, in words."""
    notes = tuple(_notes(fit))
    within = f"within {fit.worst * 100:.2f} %"
    doubt = fit.standard_error / fit.constant
    good, fair = (fit.worst <= limit and doubt <= limit for limit in (_GOOD, _FAIR))
    out = fit.outliers
    low, high = (factor * width for factor in _USUAL)
    if not low < fit.constant < high:
        view = math.degrees(2 * math.atan2(width / 2, fit.constant))
        reason = f"such a camera would see {view:.1f}° from left to right. Are these metres?"
        return Verdict("poor", reason, notes)
    if out:
        which = "one picture disagrees" if len(out) == 1 else f"{len(out)} pictures disagree"
        named = "; ".join(_off(residual) for residual in out)
        useful = fair and 3 * len(out) <= len(fit.residuals)
        reason = f"{which}: {named}. Left out; the others agree {within}."
        return Verdict("fair" if useful else "poor", reason, notes)
    if fair and not several_distances([residual.sample for residual in fit.residuals]):
        return Verdict("fair", "one distance; nothing shows whether it is right.", notes)
    if good:
        return Verdict("good", f"every picture agrees {within}.", notes)
    if fair:
        return Verdict("fair", f"the pictures agree {within} only.", notes)
    worst = max(fit.residuals, key=lambda residual: abs(residual.share))
    return Verdict("poor", f"the pictures contradict each other: {_off(worst)}.", notes)


def _notes(fit: ConstantFit) -> Iterator[str]:
    if fit.offset is not None:
        way = "short" if fit.offset > 0 else "long"
        yield (
            f"All distances seem {abs(fit.offset) * 100:.1f} cm too {way}: measure from the "
            "camera's axis (not from the front of the lens) to the landmark's axis, on the level."
        )
    elif fit.outliers or fit.worst > _FAIR:
        yield "A distance may be wrong, or a landmark of another size than was said."
    if vague := [residual for residual in fit.residuals if residual.unsharp and residual.agrees]:
        named = ", ".join(
            f"{r.sample.name} (to {r.sigma / r.sample.distance * 100:.1f} %)" for r in vague
        )
        yield f"Says little about its distance: {named}. Go nearer, hold still, add light."
    if not several_distances([residual.sample for residual in fit.residuals]):
        yield (
            "Only one distance: an error in it goes straight into the constant; take a second, at "
            "least half as far again."
        )


def _off(residual: Residual) -> str:
    way = "far" if residual.error > 0 else "near"
    return (
        f"{residual.sample.name} by {abs(residual.share) * 100:.1f} % "
        f"({abs(residual.error) * 100:.1f} cm too {way})"
    )


def resized(camera: Camera, width: int, height: int) -> Camera:
    """``camera`` for its pictures cut and averaged down to ``width`` x ``height``, as capture does.

    Constant and centre follow the pixels; the lens itself, in tangents, stays what it is.
    """
    across, down, left, top = _cut((camera.width, camera.height), (width, height))
    return replace(
        camera,
        constant=camera.constant * math.sqrt(across * down),
        width=width,
        height=height,
        center_x=(camera.center_x + 0.5 - left) * across - 0.5,
        center_y=(camera.center_y + 0.5 - top) * down - 0.5,
    )


def before_resizing(camera: Camera, width: int, height: int) -> Camera:
    """The camera whose ``width`` x ``height`` pictures, ``resized``, are those of ``camera``."""
    across, down, left, top = _cut((width, height), (camera.width, camera.height))
    return replace(
        camera,
        constant=camera.constant / math.sqrt(across * down),
        width=width,
        height=height,
        center_x=(camera.center_x + 0.5) / across - 0.5 + left,
        center_y=(camera.center_y + 0.5) / down - 0.5 + top,
    )


def _cut(whole: tuple[int, int], wanted: tuple[int, int]) -> tuple[float, float, int, int]:
    """Scale across and down, and the columns and rows that are cut off at the left and top."""
    (columns, rows), (width, height) = whole, wanted
    kept_columns = max(min(columns, round(rows * width / height)), 1)
    kept_rows = max(min(rows, round(columns * height / width)), 1)
    left, top = (columns - kept_columns) // 2, (rows - kept_rows) // 2
    return width / kept_columns, height / kept_rows, left, top


def _sigmas(samples: Sequence[KnownRange]) -> NDArray[np.float64]:
    """Pictures from one place share the tape's error: together they carry no more than one."""
    counts = Counter(round(s.distance, 6) for s in samples)
    return np.array(
        [
            math.hypot(
                s.detection.range_sigma, TAPE_SIGMA * math.sqrt(counts[round(s.distance, 6)])
            )
            for s in samples
        ]
    )


def _errors(samples: Sequence[KnownRange], constant: float) -> Array:
    """Measured minus given, metres."""
    return np.array([s.range_at(constant) - s.distance for s in samples])


def _slopes(samples: Sequence[KnownRange], constant: float) -> Array:
    return np.array([s.slope_at(constant) for s in samples])


def _solve(samples: Sequence[KnownRange], sigma: Array) -> tuple[float, float]:
    """The constant, and by how much the residuals are larger than ``sigma`` says (at least 1)."""
    own = np.array([s.own_constant for s in samples])
    pull = np.array([s.slope_at(c) for s, c in zip(samples, own, strict=True)]) / sigma
    constant, scale = _weighted_median(own, pull), 1.0
    if len(samples) > 2:
        # From the median, once: measured around a mean that an outlier draws, it would grow.
        scaled = _errors(samples, constant) / sigma
        scale = max(1.0, 1.4826 * float(np.median(np.abs(scaled))))
    for _ in range(_ROUNDS):
        scaled = _errors(samples, constant) / sigma
        pull = _slopes(samples, constant) / sigma
        weight = np.minimum(1.0, _HUBER * scale / np.maximum(np.abs(scaled), 1e-12))
        step = float((weight * pull) @ scaled / ((weight * pull) @ pull))
        constant = max(constant - step, constant / 2)
        if abs(step) < 1e-9 * constant:
            break
    return constant, scale


def _weighted_median(values: Array, weights: Array) -> float:
    order = np.argsort(values)
    total = np.cumsum(weights[order])
    return float(values[order][int(np.searchsorted(total, total[-1] / 2))])


def _agreeing(samples: Sequence[KnownRange], constant: float, sigma: Array) -> NDArray[np.bool_]:
    """Which pictures agree; with one or two, or without a majority, nobody can be blamed."""
    error = np.abs(_errors(samples, constant))
    given = np.array([s.distance for s in samples])
    agrees = (error <= _OUTLIER * sigma) | (error <= _LEAST_DISAGREEMENT * given)
    if len(agrees) < 3 or agrees.sum() * 2 <= len(agrees):
        return np.ones(len(agrees), np.bool_)
    return agrees


def _standard_error(
    samples: Sequence[KnownRange], constant: float, sigma: Array, agrees: NDArray[np.bool_]
) -> float:
    scaled = (_errors(samples, constant) / sigma)[agrees]
    pull = (_slopes(samples, constant) / sigma)[agrees]
    freedom = len(scaled) - 1
    inflation = math.sqrt(float(scaled @ scaled) / freedom) if freedom else 1.0
    return max(1.0, inflation) / math.sqrt(float(pull @ pull))


def _common_offset(samples: Sequence[KnownRange], constant: float, sigma: Array) -> float | None:
    """What would have to be added to every distance, if that brings all pictures to agree."""
    if not several_distances(samples):
        return None
    design = np.column_stack([np.ones(len(samples)), -_slopes(samples, constant)]) / sigma[:, None]
    wanted = _errors(samples, constant) / sigma
    normal = design.T @ design
    solution = np.linalg.solve(normal, design.T @ wanted)
    after = wanted - design @ solution
    offset, doubt = float(solution[0]), math.sqrt(float(np.linalg.inv(normal)[0, 0]))
    significant = max(3 * doubt, _OFFSET) < abs(offset) < _LARGEST_OFFSET
    better = float(wanted @ wanted) > float(after @ after) + 9.0
    consistent = float(np.abs(after).max()) < 3.0
    return offset if significant and better and consistent else None


def several_distances(samples: Sequence[KnownRange]) -> bool:
    """Whether an error in one distance would show."""
    distances = [s.distance for s in samples]
    return max(distances) > _APART * min(distances)
