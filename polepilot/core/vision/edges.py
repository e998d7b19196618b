"""All edges of a code at once: a square wave seen through a lens, fitted to one scale.

The straightened column of light is compared with what a code of that scale would give: levels of
bright and dark, a blurred step at every boundary. The scale's uncertainty comes out of the same
fit.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from polepilot.core.vision.straight import Column

Floats = NDArray[np.floating[Any]]

_ROUNDS = 6
_LINEAR = 6
"""Light above, bright (level and gain along the code), dark (level and gain), light below."""
_NONLINEAR = 4
"""Top, unit, blur, growth."""
_GROWTH = 0.15
"""How much bright segments may seem to grow (glare, grey levels averaged), pixels."""
_SETTLED = 0.02
"""Pixels by which boundaries still move when a fit may end."""
_RIDGE = 1e-9


@dataclass(frozen=True, slots=True, eq=False)
class Scale:
    """Where the code's boundaries lie: boundary k at ``top`` + k * ``unit`` (rows)."""

    top: float
    unit: float
    blur: float
    bright: float
    dark: float
    unit_sigma: float
    noise: float
    """Rms of what the fit leaves over, as a share of bright - dark."""


def fit_scale(column: Column, code: str, top: float, unit: float) -> Scale | None:
    """Gauss-Newton fit of the whole code; None where it does not settle near the first guess."""
    rows, light = column.rows, column.profile
    segments = len(code)
    values = np.array([int(c) for c in code])
    changes = np.flatnonzero(np.diff(values)) + 1
    edges = np.concatenate([[0], changes, [segments]]).astype(np.float64)
    sign = np.ones(len(edges))
    sign[1::2] = -1
    # Photon noise: the variance of light grows with the light, in all channels that take part.
    trust = 1 / np.sqrt(np.abs(column.channels[:, [0, -1]]).sum(axis=1) + 0.02)
    guess = np.array([top, unit, 0.5, 0.0])
    limit = np.array([0.6 * unit, 0.08 * unit, 0.25, 0.3])
    jacobian = np.zeros((len(rows) + 1, _LINEAR + _NONLINEAR))
    wanted = np.zeros(len(rows) + 1)
    level: Floats | None = None
    for _ in range(_ROUNDS):
        basis, slopes, spreads, shift = _model(rows, guess, edges, sign, segments)
        if level is None:
            level = _solve(basis * trust[:, None], light * trust)
            if level is None:
                return None
        above, bright, gain, dark, tilt, below = level
        jump = sign * ((bright - dark) + (gain - tilt) * shift)[:, None]
        jump[:, 0] = bright + gain * shift - above
        jump[:, -1] = below - bright - gain * shift
        move = -jump * slopes
        jacobian[:-1, :_LINEAR] = basis
        jacobian[:-1, -4] = move.sum(axis=1)
        jacobian[:-1, -3] = move @ edges
        jacobian[:-1, -2] = (jump * spreads).sum(axis=1)
        jacobian[:-1, -1] = -(move @ sign)
        jacobian[:-1] *= trust[:, None]
        rest = (light - basis @ level) * trust
        wanted[:-1] = rest
        # A weak prior holds the growth of bright segments near nought where a code cannot tell.
        pull = math.sqrt(float(rest @ rest) / max(len(rows) - _LINEAR - _NONLINEAR, 1)) / _GROWTH
        jacobian[-1, -1] = pull
        wanted[-1] = -pull * guess[3]
        change = _solve(jacobian, wanted)
        if change is None:
            return None
        level = level + change[:_LINEAR]
        delta = np.minimum(np.maximum(change[_LINEAR:], -limit), limit)
        guess = guess + delta
        guess[2] = min(max(guess[2], 0.2), 0.25 * guess[1] + 1.2)
        if abs(guess[0] - top) > unit + 1 or abs(guess[1] / unit - 1) > 0.2:
            return None
        # The step after this one would be the square of it, about.
        if abs(delta[0]) < _SETTLED and abs(delta[1]) * segments < _SETTLED:
            break
    contrast = bright - dark
    if contrast <= 0:
        return None
    free = max(len(rows) - _LINEAR - _NONLINEAR, 1)
    variance = float(rest @ rest) / free
    normal = jacobian.T @ jacobian
    normal.flat[:: len(normal) + 1] *= 1 + _RIDGE
    spread = np.linalg.inv(normal)[-3, -3] * variance
    return Scale(
        top=float(guess[0]),
        unit=float(guess[1]),
        blur=float(guess[2]),
        bright=float(bright),
        dark=float(dark),
        unit_sigma=math.sqrt(max(float(spread), 0.0)),
        noise=float(np.sqrt(np.mean((rest / trust) ** 2))) / float(contrast),
    )


def segment_levels(column: Column, scale: Scale, segments: int) -> Floats | None:
    """Light of every segment with its neighbours' blur taken out: segments x channels."""
    edges = scale.top + scale.unit * np.arange(segments + 1)
    steps, _, _ = _step(column.rows, edges, scale.blur)
    basis = np.column_stack([1 - steps[:, 0], steps[:, :-1] - steps[:, 1:], steps[:, -1]])
    normal = basis.T @ basis
    normal.flat[:: len(normal) + 1] += 1e-3
    levels: Floats = np.linalg.solve(normal, basis.T @ column.channels)
    return levels[1:-1]


def _model(
    rows: Floats, guess: Floats, edges: Floats, sign: Floats, segments: int
) -> tuple[Floats, Floats, Floats, Floats]:
    """What levels are multiplied by (rows x 6), how steps change with place and blur, and how
    far up or down the code each row lies (-1 to 1)."""
    # Bright segments have grown by guess[3] at either end.
    places = guess[0] + guess[1] * edges - guess[3] * sign
    steps, slopes, spreads = _step(rows, places, float(guess[2]))
    bright = steps @ sign
    inside = steps[:, 0] - steps[:, -1]
    dark = inside - bright
    shift = 2 * (rows - guess[0]) / (guess[1] * segments) - 1
    basis = np.stack(
        [1 - steps[:, 0], bright, bright * shift, dark, dark * shift, steps[:, -1]], axis=1
    )
    return basis, slopes, spreads, shift


def _step(rows: Floats, places: Floats, blur: float) -> tuple[Floats, Floats, Floats]:
    """Steps at ``places`` seen by consecutive rows, and their derivatives by row and by blur.

    A pixel averages over its area what the lens has blurred: the step is the mean of the normal
    distribution's cumulative function over one pixel. All results are rows x places.
    """
    borders = np.arange(len(rows) + 1) + (rows[0] - 0.5)
    z = (borders[:, None] - places) / blur
    curve, bell = _cumulative(z), np.exp(-0.5 * z * z) * (1 / math.sqrt(math.tau))
    area = z * curve + bell
    return blur * (area[1:] - area[:-1]), curve[1:] - curve[:-1], bell[1:] - bell[:-1]


def _cumulative(z: Floats) -> Floats:
    """The normal distribution's cumulative function, to 2e-4 (no scipy needed)."""
    curve: Floats = 0.5 + 0.5 * np.tanh(0.7978845608 * z * (1 + 0.044715 * z * z))
    return curve


def _solve(matrix: Floats, target: Floats) -> Floats | None:
    """Least squares by normal equations; a column without influence gets about zero."""
    normal = matrix.T @ matrix
    diagonal = normal.flat[:: len(normal) + 1]
    normal.flat[:: len(normal) + 1] = diagonal + _RIDGE * (diagonal.max() + 1e-12)
    try:
        solution: Floats = np.linalg.solve(normal, matrix.T @ target)
    except np.linalg.LinAlgError:
        return None
    return solution if np.isfinite(solution).all() else None
