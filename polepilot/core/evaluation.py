"""How far estimated poses are from true ones: errors, alignment, and whether the doubt was honest.

Poses are compared at the estimate's own times with the truth interpolated. Where the truth has a
gap, or has not begun, nothing is made up: such poses are left out and counted.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from polepilot.core.errors import DatasetError
from polepilot.core.trajectory import LARGEST, Array, Trajectory

Align = Literal["none", "se2"]

INSIDE_95 = 7.814728
"""95 % of the squared, normalized errors of three independent numbers are below it (chi square)."""
_SMALLEST = 1e-9
"""No standard deviation is smaller, metres or radians."""
_SAME_TIME = 1e-3
"""A covariance belongs to the pose whose stamp is so near, seconds."""


@dataclass(frozen=True, slots=True)
class Spread:
    """Of absolute errors: metres or radians."""

    mean: float
    rmse: float
    median: float
    p95: float
    max: float

    @classmethod
    def of(cls, errors: Array) -> Spread:
        size = np.abs(errors)
        return cls(
            float(size.mean()),
            float(np.sqrt(np.mean(size**2))),
            float(np.median(size)),
            float(np.percentile(size, 95)),
            float(size.max()),
        )

    def to_json(self) -> dict[str, float]:
        return {name: getattr(self, name) for name in ("mean", "rmse", "median", "p95", "max")}


@dataclass(frozen=True, slots=True)
class Consistency:
    """Squared errors in units of the estimate's own covariance (NEES, 3 degrees of freedom).

    An honest estimate has a ``mean`` of 3 and 95 % ``inside`` the 95 % bound.
    """

    mean: float
    inside: float
    """Share inside the 95 % bound."""
    poses: int
    """How many poses had a covariance."""

    def to_json(self) -> dict[str, float]:
        return {"mean": self.mean, "inside_95": self.inside, "poses": self.poses, "dof": 3}


@dataclass(frozen=True, slots=True)
class Shift:
    """The rigid motion that brings an estimate nearest to the truth: turn about 0, then move."""

    x: float
    y: float
    rotation: float

    def to_json(self) -> dict[str, float]:
        return {"x": self.x, "y": self.y, "rotation": self.rotation}


@dataclass(frozen=True, slots=True, eq=False)
class Comparison:
    """One trajectory against the truth. ``stamps`` and errors are those of the compared poses."""

    poses: int
    longest_gap: float
    """Between two of its poses, seconds."""
    stamps: Array
    offsets: Array
    """Estimate minus truth, n x 3: metres, metres, radians in (-pi, pi]."""
    aligned_offsets: Array | None = None
    shift: Shift | None = None
    consistency: Consistency | None = None

    @property
    def distances(self) -> Array:
        return np.asarray(np.hypot(self.offsets[:, 0], self.offsets[:, 1]))

    def to_json(self) -> dict[str, Any]:
        """Metres, radians, seconds."""
        return {
            "poses": self.poses,
            "compared": len(self.stamps),
            "left_out": self.poses - len(self.stamps),
            "first_t": float(self.stamps[0]),
            "last_t": float(self.stamps[-1]),
            "longest_gap": self.longest_gap,
            **_errors(self.offsets),
            "nees": None if self.consistency is None else self.consistency.to_json(),
            "aligned": None
            if self.aligned_offsets is None or self.shift is None
            else {**self.shift.to_json(), **_errors(self.aligned_offsets)},
        }


@dataclass(frozen=True, slots=True, eq=False)
class Covariances:
    """Of poses: ``stamps`` (N, not falling) and ``matrices`` (N x 3 x 3; m², m rad, rad²)."""

    stamps: Array
    matrices: Array


def compare(
    truth: Trajectory,
    estimate: Trajectory,
    covariances: Covariances | None = None,
    align: Align = "none",
    longest_gap: float = 0.5,
) -> Comparison | None:
    """``estimate`` against ``truth``; None where they share no time.

    ``longest_gap``: the truth is not interpolated over longer ones, seconds. Errors are those of
    the estimate as it is; ``align`` "se2" adds those that are left after the best rigid motion.
    """
    inside = _within(truth.stamps, estimate.stamps, longest_gap)
    stamps, poses = estimate.stamps[inside], estimate.poses[inside]
    if len(stamps) == 0:
        return None
    true = truth.at(stamps).poses
    aligned = shift = None
    if align == "se2":
        shift = _best_shift(true, poses)
        aligned = _offsets(true, _moved(poses, shift))
    offsets = _offsets(true, poses)
    gaps = np.diff(estimate.stamps)
    return Comparison(
        poses=len(estimate.stamps),
        longest_gap=float(gaps.max()) if len(gaps) else 0.0,
        stamps=stamps,
        offsets=offsets,
        aligned_offsets=aligned,
        shift=shift,
        consistency=None if covariances is None else _consistency(stamps, offsets, covariances),
    )


def read_covariances(path: Path) -> Covariances:
    """Read ``t pxx pxy pxh pyy pyh phh`` per line, as `replay` writes them.

    Raises:
        DatasetError: no such file, or a line that is no covariance in order of time.
    """
    try:
        text = path.read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError) as error:
        raise DatasetError(f"{path}: cannot be read as text ({error}).") from error
    rows: list[list[float]] = []
    for number, line in enumerate(text.split("\n"), start=1):
        content = line.strip()
        if not content or content.startswith("#"):
            continue
        try:
            values = [float(word) for word in content.split()]
        except ValueError:
            values = []
        if len(values) != 7 or not all(abs(value) <= LARGEST for value in values):
            raise DatasetError(
                f"{path}:{number}: expected seven finite numbers `t pxx pxy pxh pyy pyh phh`."
            )
        if rows and values[0] < rows[-1][0]:
            raise DatasetError(
                f"{path}:{number}: time {values[0]} follows {rows[-1][0]}: expected rising times."
            )
        if not _positive(_matrices(np.array([values[1:]]))[0]):
            raise DatasetError(
                f"{path}:{number}: is no covariance: expected a positive definite matrix."
            )
        rows.append(values)
    table = np.array(rows, dtype=float).reshape(-1, 7)
    return covariances_of(table[:, 0], table[:, 1:])


def covariances_of(stamps: Array, upper: Array) -> Covariances:
    """From n x 6 upper triangles: pxx, pxy, pxh, pyy, pyh, phh."""
    return Covariances(stamps, _matrices(upper))


def _matrices(upper: Array) -> Array:
    return np.asarray(upper[:, [0, 1, 2, 1, 3, 4, 2, 4, 5]].reshape(-1, 3, 3))


def _positive(matrix: Array) -> bool:
    """Whether it is positive definite, whatever the units of its rows."""
    sigmas = np.sqrt(np.maximum(np.diagonal(matrix), 0.0))
    if not (sigmas > _SMALLEST).all():
        return False
    correlations = matrix / np.outer(sigmas, sigmas)
    return bool(np.linalg.eigvalsh(correlations)[0] > 0)


def _within(known: Array, wanted: Array, longest_gap: float) -> NDArray[np.bool_]:
    """Which of the ``wanted`` times lie on a known one or between two that are near enough."""
    if len(known) == 0:
        return np.zeros(len(wanted), bool)
    before = np.searchsorted(known, wanted, side="right") - 1
    after = np.minimum(before + 1, len(known) - 1)
    begun = before >= 0
    before = np.maximum(before, 0)
    exact = known[before] == wanted
    near = (known[after] - known[before] <= longest_gap) & (wanted <= known[after])
    return np.asarray(begun & (exact | near))


def _offsets(true: Array, poses: Array) -> Array:
    offsets = poses - true
    offsets[:, 2] = np.arctan2(np.sin(offsets[:, 2]), np.cos(offsets[:, 2]))
    return np.asarray(offsets)


def _best_shift(true: Array, poses: Array) -> Shift:
    """Least squares over the positions, in closed form."""
    to, of = true[:, :2].mean(axis=0), poses[:, :2].mean(axis=0)
    a, b = poses[:, :2] - of, true[:, :2] - to
    cross = float(np.sum(a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]))
    rotation = math.atan2(cross, float(np.sum(a * b)))
    cos, sin = math.cos(rotation), math.sin(rotation)
    return Shift(
        float(to[0] - cos * of[0] + sin * of[1]),
        float(to[1] - sin * of[0] - cos * of[1]),
        rotation,
    )


def _moved(poses: Array, shift: Shift) -> Array:
    cos, sin = math.cos(shift.rotation), math.sin(shift.rotation)
    x, y, heading = poses.T
    return np.stack(
        [shift.x + cos * x - sin * y, shift.y + sin * x + cos * y, heading + shift.rotation], axis=1
    )


def _consistency(stamps: Array, offsets: Array, covariances: Covariances) -> Consistency | None:
    known = covariances.stamps
    if len(known) == 0:
        return None
    after = np.clip(np.searchsorted(known, stamps), 0, len(known) - 1)
    before = np.maximum(after - 1, 0)
    nearer = np.abs(known[before] - stamps) < np.abs(known[after] - stamps)
    index = np.where(nearer, before, after)
    same = np.abs(known[index] - stamps) < _SAME_TIME
    if not same.any():
        return None
    errors, matrices = offsets[same], covariances.matrices[index[same]]
    squared = np.einsum("ni,ni->n", errors, np.linalg.solve(matrices, errors[..., None])[..., 0])
    return Consistency(float(squared.mean()), float(np.mean(squared <= INSIDE_95)), int(same.sum()))


def _errors(offsets: Array) -> dict[str, Any]:
    return {
        "position": Spread.of(np.hypot(offsets[:, 0], offsets[:, 1])).to_json(),
        "heading": Spread.of(offsets[:, 2]).to_json(),
    }
