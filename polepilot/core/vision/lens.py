"""Lens distortion, for points: from where a lens draws them to where a pinhole would, and back.

The model is OpenCV's (radial k1, k2, k3, tangential p1, p2). With x, y the tangents of a direction
(right and down) and r² = x² + y²:

    x' = x (1 + k1 r² + k2 r⁴ + k3 r⁶) + 2 p1 x y + p2 (r² + 2 x²)
    y' = y (1 + k1 r² + k2 r⁴ + k3 r⁶) + p1 (r² + 2 y²) + 2 p2 x y

Pictures are never remapped: a few edges of a landmark are cheaper to correct than all pixels, and
resampling would cost sharpness.
"""

from __future__ import annotations

import math
from dataclasses import astuple, dataclass
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from polepilot.core.errors import ConfigError
from polepilot.core.vehicle import Camera

Points = NDArray[np.float64]
"""... x 2: column and row, pixels; centres of pixels are integers."""

_ROUNDS = 30
_TINY = 1e-9
"""A coefficient below this bends nothing."""
_CLOSE = 1e-11
"""Tangents nearer than this are the same: 1e-8 pixels."""


@dataclass(frozen=True, slots=True)
class Lens:
    """Five coefficients, in OpenCV's order; all zero is an ideal lens."""

    k1: float = 0.0
    k2: float = 0.0
    p1: float = 0.0
    p2: float = 0.0
    k3: float = 0.0

    def __post_init__(self) -> None:
        if not all(math.isfinite(value) for value in astuple(self)):
            raise ConfigError(f"lens distortion is {list(astuple(self))}: expected finite numbers.")

    @classmethod
    def of(cls, camera: Camera) -> Lens:
        """The lens of ``camera``; ideal where nothing is known of it."""
        return cls(*camera.distortion)

    @property
    def ideal(self) -> bool:
        """Whether it bends nothing: every coefficient is zero."""
        return not any(astuple(self))

    @property
    def limit(self) -> float:
        """Tangent of the widest angle to the axis at which the picture does not fold over itself.

        Beyond it the polynomial says nothing about a real lens. Infinite where it never folds.
        """
        return _limit(self.k1, self.k2, self.k3)

    def covers(self, camera: Camera) -> bool:
        """Whether every pixel of ``camera``'s picture shows one direction, and one only."""
        limit = self.limit
        if math.isinf(limit):
            return True
        square = limit * limit
        reach = limit * (1 + square * (self.k1 + square * (self.k2 + square * self.k3)))
        across = max(camera.center_x, camera.width - 1 - camera.center_x) / camera.constant
        down = max(camera.center_y, camera.height - 1 - camera.center_y) / camera.constant
        return math.hypot(across, down) < reach


def distort(points: ArrayLike, camera: Camera) -> Points:
    """Where the lens draws what a pinhole would draw at ``points`` (... x 2, pixels)."""
    lens = Lens.of(camera)
    ideal = np.array(points, dtype=np.float64)
    if lens.ideal:
        return ideal
    return _to_pixels(_bend(lens, _to_tangents(ideal, camera)), camera)


def undistort(points: ArrayLike, camera: Camera) -> Points:
    """Where a pinhole would draw what the lens draws at ``points`` (... x 2, pixels).

    Newton's method. A point at which the lens draws nothing, beyond its ``limit``, comes
    out as nan.
    """
    lens = Lens.of(camera)
    seen = np.array(points, dtype=np.float64)
    if lens.ideal:
        return seen
    wanted = _to_tangents(seen, camera)
    guess = wanted.copy()
    with np.errstate(all="ignore"):  # what does not converge becomes nan below
        for _ in range(_ROUNDS):
            miss = _bend(lens, guess) - wanted
            if float(np.max(np.abs(miss), initial=0.0)) < _CLOSE:
                break
            guess -= _solved(lens, guess, miss)
        else:
            miss = _bend(lens, guess) - wanted
            guess[~(np.abs(miss).max(axis=-1) < 1e3 * _CLOSE)] = np.nan
        # Beyond the limit the polynomial repeats directions that are drawn elsewhere.
        guess[np.hypot(guess[..., 0], guess[..., 1]) > lens.limit] = np.nan
    return _to_pixels(guess, camera)


@lru_cache(maxsize=8)
def _limit(k1: float, k2: float, k3: float) -> float:
    """Where the radial part, as a function of r, stops to grow."""
    slope = [value if abs(value) > _TINY else 0.0 for value in (7 * k3, 5 * k2, 3 * k1, 1.0)]
    roots = np.roots(slope)  # in r²; leading zeros are left out
    real = roots.real[(np.abs(roots.imag) < 1e-9) & (roots.real > 0)]
    return math.sqrt(float(real.min())) if len(real) else math.inf


def _bend(lens: Lens, tangents: Points) -> Points:
    x, y = tangents[..., 0], tangents[..., 1]
    square = x * x + y * y
    radial = 1 + square * (lens.k1 + square * (lens.k2 + square * lens.k3))
    return np.stack(
        [
            x * radial + 2 * lens.p1 * x * y + lens.p2 * (square + 2 * x * x),
            y * radial + lens.p1 * (square + 2 * y * y) + 2 * lens.p2 * x * y,
        ],
        axis=-1,
    )


def _solved(lens: Lens, tangents: Points, miss: Points) -> Points:
    """Newton's step: the inverse of the derivative of ``_bend``, times ``miss``."""
    x, y = tangents[..., 0], tangents[..., 1]
    square = x * x + y * y
    radial = 1 + square * (lens.k1 + square * (lens.k2 + square * lens.k3))
    growth = 2 * (lens.k1 + square * (2 * lens.k2 + 3 * square * lens.k3))
    xx = radial + x * x * growth + 2 * lens.p1 * y + 6 * lens.p2 * x
    yy = radial + y * y * growth + 6 * lens.p1 * y + 2 * lens.p2 * x
    xy = x * y * growth + 2 * lens.p1 * x + 2 * lens.p2 * y
    determinant = xx * yy - xy * xy
    across, down = miss[..., 0], miss[..., 1]
    return (
        np.stack([yy * across - xy * down, xx * down - xy * across], axis=-1)
        / (determinant[..., None])
    )


def _to_tangents(points: Points, camera: Camera) -> Points:
    center: NDArray[Any] = np.array([camera.center_x, camera.center_y])
    return np.asarray((points - center) / camera.constant, dtype=np.float64)


def _to_pixels(tangents: Points, camera: Camera) -> Points:
    center: NDArray[Any] = np.array([camera.center_x, camera.center_y])
    return np.asarray(tangents * camera.constant + center, dtype=np.float64)
