"""A precision map: figures on a grid over the floor, or why there are none."""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum
from typing import Any

import numpy as np
from numpy.typing import NDArray

from polepilot.core.localization.precision_sight import Bools, Floats

CLASSES = (0.005, 0.0075, 0.01, 0.015, 0.02, 0.03)
"""Where the colours of a drawn map change, metres: always the same, so that maps compare."""


class Reason(IntEnum):
    """Why there is no figure at a spot."""

    FIX = 0
    """There is one."""
    NONE = 1
    """No landmark is seen."""
    ONE_LANDMARK = 2
    ONE_DIRECTION = 3
    """Landmarks are seen, but the pose would be vaguer than a fix may be."""
    OUTSIDE = 4
    """The robot cannot stand there."""


@dataclass(frozen=True, slots=True, eq=False)
class PrecisionMap:
    """Rows of square cells, ``resolution`` wide, from the lower left one's centre (``x``, ``y``).

    Arrays are rows x columns. ``position`` and ``heading`` are nan where ``reason`` is not FIX.
    """

    x: float
    y: float
    resolution: float
    position: Floats
    """Standard deviation along the worst direction, metres."""
    heading: Floats
    """Standard deviation, radians."""
    share: Floats
    """Of the headings that are possible at the spot, at how many a fix is."""
    seen: Floats
    """Landmarks read in one sweep, mean over the headings."""
    reason: NDArray[np.uint8]
    weight: Floats
    """Which share of the cell is floor: means are means over the floor."""
    limit: float
    """What `overall` counts a spot without a fix as: the vaguest position that a fix may have."""

    @property
    def floor(self) -> Bools:
        """The cells at which the robot can stand."""
        result: Bools = self.reason != Reason.OUTSIDE
        return result

    @property
    def fixed(self) -> Bools:
        """The cells with figures."""
        result: Bools = self.reason == Reason.FIX
        return result

    @property
    def coverage(self) -> float:
        """Of all ways to stand on the floor, the share at which a fix is possible."""
        return float(np.average(self.share, weights=self.weight * self.floor))

    @property
    def mean_position(self) -> float | None:
        """Mean over the spots with a fix, metres."""
        return self._mean(self.position)

    @property
    def worst_position(self) -> float | None:
        return float(self.position[self.fixed].max()) if self.fixed.any() else None

    @property
    def mean_heading(self) -> float | None:
        """Mean over the spots with a fix, radians."""
        return self._mean(self.heading)

    @property
    def overall(self) -> float:
        """Mean over the whole floor, what has no fix counted as ``limit``, metres.

        For comparing two sets of landmarks: a landmark that makes a vague fix possible where there
        was none would otherwise make the mean worse.
        """
        squared = np.nan_to_num(self.position) ** 2
        values = np.sqrt(self.share * squared + (1.0 - self.share) * self.limit**2)
        return float(np.average(values, weights=self.weight * self.floor))

    def area(self, reason: Reason) -> float:
        """Floor with this reason, square metres."""
        return float(self.weight[self.reason == reason].sum()) * self.resolution**2

    def _mean(self, values: Floats) -> float | None:
        if not self.fixed.any():
            return None
        return float(np.average(values[self.fixed], weights=self.weight[self.fixed]))

    def to_json(self) -> dict[str, Any]:
        """Rows from the lowest y on, null where there is no figure; tenths of a millimetre."""
        return {
            "x": self.x,
            "y": self.y,
            "resolution": self.resolution,
            "columns": self.position.shape[1],
            "rows": self.position.shape[0],
            "position": _listed(self.position, 4),
            "heading": _listed(self.heading, 5),
            "share": _listed(np.where(self.floor, self.share, np.nan), 3),
            "seen": _listed(np.where(self.floor, self.seen, np.nan), 2),
            "reason": self.reason.tolist(),
            **self.summary(),
        }

    def summary(self) -> dict[str, Any]:
        """The figures for the whole site."""
        return {
            "mean_position": self.mean_position,
            "worst_position": self.worst_position,
            "mean_heading": self.mean_heading,
            "overall": self.overall,
            "coverage": self.coverage,
            "limit": self.limit,
        }


def _listed(values: Floats, digits: int) -> list[list[float | None]]:
    rounded = np.round(values, digits)
    return [[None if value != value else value for value in row] for row in rounded.tolist()]
