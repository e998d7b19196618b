"""Trajectories on disk (TUM text) and how far two of them are apart.

A line of a ``.tum`` file is ``t x y z qx qy qz qw``: seconds, then the pose of `base_link` in
`map`. A robot in the plane has z = qx = qy = 0; ``evo`` and the other common tools read it.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike, NDArray

from polepilot.core.errors import DatasetError
from polepilot.core.geometry import Pose2D, wrap_angle

Array = NDArray[np.float64]

LARGEST = 1e12
"""No time and no place in a file is larger."""


@dataclass(frozen=True, slots=True, eq=False)
class Trajectory:
    """Poses over time: ``stamps`` (N, not falling) and ``poses`` (N x 3: x, y, heading)."""

    stamps: Array
    poses: Array

    def at(self, stamps: ArrayLike) -> Trajectory:
        """Interpolated at ``stamps``; those outside its own span are left out."""
        wanted = np.asarray(stamps, dtype=float)
        if len(self.stamps) == 0:
            return Trajectory(np.empty(0), np.empty((0, 3)))
        wanted = wanted[(wanted >= self.stamps[0]) & (wanted <= self.stamps[-1])]
        heading = np.unwrap(self.poses[:, 2])
        columns = [
            np.interp(wanted, self.stamps, column)
            for column in (self.poses[:, 0], self.poses[:, 1], heading)
        ]
        columns[2] = np.arctan2(np.sin(columns[2]), np.cos(columns[2]))
        return Trajectory(wanted, np.stack(columns, axis=1))


@dataclass(frozen=True, slots=True)
class ErrorStatistics:
    """Mean, 95th percentile and largest of some errors; all zero where there are none."""

    mean: float = 0.0
    p95: float = 0.0
    max: float = 0.0

    @classmethod
    def of(cls, errors: ArrayLike) -> ErrorStatistics:
        values = np.abs(np.asarray(errors, dtype=float))
        if values.size == 0:
            return cls()
        return cls(float(values.mean()), float(np.percentile(values, 95)), float(values.max()))

    def to_json(self) -> dict[str, float]:
        return {"mean": self.mean, "p95": self.p95, "max": self.max}


def format_tum(stamps: Iterable[float], poses: Iterable[Pose2D | Sequence[float]]) -> str:
    """The text of a TUM file; each pose is x, y, heading."""
    lines = []
    for stamp, (x, y, heading) in zip(stamps, poses, strict=True):
        half = 0.5 * heading
        lines.append(f"{stamp:.6f} {x:.6f} {y:.6f} 0 0 0 {math.sin(half):.9f} {math.cos(half):.9f}")
    return "".join(line + "\n" for line in lines)


def write_tum(
    path: Path, stamps: Iterable[float], poses: Iterable[Pose2D | Sequence[float]]
) -> None:
    """Write ``path``, one line per pose (x, y, heading)."""
    path.write_text(format_tum(stamps, poses), encoding="ascii")


_ROUNDED = 0.1
"""So far from 1 a rounded quaternion's length may be."""


def read_tum(path: Path) -> Trajectory:
    """Read a TUM file. Empty lines and lines that begin with ``#`` are skipped.

    Raises:
        DatasetError: no such file, or a line that is not eight finite numbers in order of time, or
            whose last four are no rotation.
    """
    try:
        text = path.read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError) as error:
        raise DatasetError(f"{path}: cannot be read as text ({error}).") from error
    rows: list[tuple[float, float, float, float]] = []
    for number, line in enumerate(text.splitlines(), start=1):
        content = line.strip()
        if not content or content.startswith("#"):
            continue
        try:
            values = [float(word) for word in content.split()]
        except ValueError:
            values = []
        # Not infinite, not a number, and not so large that sums of squares are.
        if len(values) != 8 or not all(abs(value) <= LARGEST for value in values):
            raise DatasetError(
                f"{path}:{number}: expected eight finite numbers `t x y z qx qy qz qw`."
            )
        stamp, x, y, _, qx, qy, qz, qw = values
        if rows and stamp < rows[-1][0]:
            raise DatasetError(
                f"{path}:{number}: time {stamp} follows {rows[-1][0]}: expected rising times."
            )
        if abs(math.hypot(qx, qy, qz, qw) - 1.0) > _ROUNDED:
            raise DatasetError(
                f"{path}:{number}: {qx:g} {qy:g} {qz:g} {qw:g} is no rotation: expected a "
                "quaternion of length 1."
            )
        heading = math.atan2(2.0 * (qw * qz + qx * qy), 1.0 - 2.0 * (qy * qy + qz * qz))
        rows.append((stamp, x, y, wrap_angle(heading)))
    table = np.array(rows, dtype=float).reshape(-1, 4)
    return Trajectory(table[:, 0], table[:, 1:])


def position_errors(reference: Trajectory, trajectory: Trajectory) -> ErrorStatistics:
    """Distances in metres to ``reference`` interpolated at the same times; nothing is aligned."""
    truth, seen = _paired(reference, trajectory)
    return ErrorStatistics.of(np.hypot(*(truth[:, :2] - seen[:, :2]).T))


def heading_errors(reference: Trajectory, trajectory: Trajectory) -> ErrorStatistics:
    """Differences of heading in radians to ``reference`` interpolated at the same times."""
    truth, seen = _paired(reference, trajectory)
    difference = seen[:, 2] - truth[:, 2]
    return ErrorStatistics.of(np.arctan2(np.sin(difference), np.cos(difference)))


def _paired(reference: Trajectory, trajectory: Trajectory) -> tuple[Array, Array]:
    if len(reference.stamps) == 0 or len(trajectory.stamps) == 0:
        return np.empty((0, 3)), np.empty((0, 3))
    first, last = reference.stamps[0], reference.stamps[-1]
    inside = (trajectory.stamps >= first) & (trajectory.stamps <= last)
    return reference.at(trajectory.stamps[inside]).poses, trajectory.poses[inside]
