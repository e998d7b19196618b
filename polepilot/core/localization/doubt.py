"""What speaks against the pose since it was last confirmed."""

from __future__ import annotations

import math
from collections.abc import Container
from dataclasses import dataclass, field
from typing import Literal, NamedTuple

from polepilot.core.observation import RangeBearing

_MOST = 200
_LONG = 5.0
"""Seconds after which one contradicting landmark is enough."""


class Judgement(NamedTuple):
    """How bad it is, and why, for a person."""

    status: Literal["degraded", "lost"]
    reason: str


@dataclass(slots=True)
class Doubt:
    """Collects contradictions to the pose; bounded in memory."""

    tolerance: float
    """Metres beyond which a landmark contradicts."""
    hasty: bool = False
    """The first landmark that contradicts is enough, as the paper has it."""
    against: list[RangeBearing] = field(default_factory=list)
    gap: float = 0.0
    """How far off the last contradiction was, metres."""

    def clear(self) -> None:
        self.against.clear()

    def add(self, measurement: RangeBearing, gap: float) -> None:
        self.against.append(measurement)
        self.gap = gap
        del self.against[:-_MOST]

    @property
    def spread(self) -> float:
        """By how much the position may be off, metres; 0 without a reason to doubt."""
        return self.gap if len(self.against) >= 2 else 0.0

    def judge(self, stamp: float, trusted: Container[int], standing: bool) -> Judgement | None:
        """None where the pose stands.

        Args:
            trusted: landmarks that agreed with the pose before: they have not moved by themselves.
            standing: one contradiction of a trusted landmark is enough. It costs nothing to stop,
                and sightings that agree bring the pose back.
        """
        if not self.against:
            return None
        counts: dict[int, int] = {}
        for measurement in self.against:
            counts[measurement.landmark] = counts.get(measurement.landmark, 0) + 1
        firm = [number for number, count in counts.items() if count >= 2]
        limit = f"{100 * self.tolerance:.0f} cm"
        sure = any(
            (number in trusted and (standing or count >= 3)) or (self.hasty and count >= 3)
            for number, count in counts.items()
        )
        lasting = bool(firm) and stamp - self.against[0].stamp > _LONG
        if len(firm) >= 2 or lasting or sure:
            ids = " and ".join(str(number) for number in sorted(counts))
            return Judgement(
                "lost",
                f"Landmark {ids} appear{'s' if len(counts) == 1 else ''} more than {limit} from "
                "where the pose has them: the robot has been moved, or has slipped.",
            )
        if firm:
            ids = " and ".join(str(number) for number in sorted(firm))
            return Judgement("degraded", f"Landmark {ids} appears more than {limit} off its place.")
        return None


def largest_sigma(xx: float, xy: float, yy: float) -> float:
    """Standard deviation along the worst direction, from a 2 x 2 covariance."""
    return math.sqrt(max(0.5 * (xx + yy) + math.hypot(0.5 * (xx - yy), xy), 0.0))
