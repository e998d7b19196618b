"""A pose that hangs together and may be wrong all the same: what cannot be told from within.

Landmarks that agree with a pose have been made to agree: the filter bends the potentiometer's line
and moves landmarks until they do. Where that takes more than there is, where too few landmarks are
left to say which of them is wrong, or where the pose had to be found again and again, the figures
of the filter are too good, and a person has to look.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import NamedTuple

from polepilot.core.geometry import Point

_FEWEST = 3
"""So many landmarks that agree say which one does not."""
_SEVERAL = 2
"""So many that were moved, and nearly as many as agree, are more than somebody's carelessness."""
_TIMES, _WITHIN = 3, 60.0
"""So often within so many seconds is more than chance."""
_STRETCH = 2.0
"""Standard deviations of the error of all ranges that need more than three landmarks to be told
from an error of the map."""
_SIGMAS, _CALM = 4.0, 3.0
"""The map's errors may be so many standard deviations of their sum of squares above its mean; once
they were not, they have to come back to so many."""


class MapMisfit(NamedTuple):
    """How far landmarks had to be moved for everything to agree."""

    squares: float = 0.0
    """Sum of squares of the errors of their places, in standard deviations."""
    freedom: float = 0.0
    """What that sum should be: how many of these errors the measurements have told so far."""
    worst: int | None = None
    """The landmark that was moved most, where that is worth a word."""
    stretch: float = 0.0
    """By how much all ranges had to be changed, in standard deviations."""

    @property
    def excess(self) -> float:
        """In standard deviations of that sum."""
        return (self.squares - self.freedom) / math.sqrt(2.0 * max(self.freedom, 1.0))

    @property
    def worth_a_word(self) -> bool:
        return self.excess > _CALM


class Suspected(NamedTuple):
    """What may be wrong, for a person, and by how much the position may be off, metres."""

    reason: str = ""
    spread: float = 0.0


@dataclass(slots=True)
class Suspicion:
    """Judges what the filter itself cannot; bounded in memory."""

    tolerance: float
    """Metres by which a landmark may appear off its place."""
    _losses: deque[float] = field(default_factory=lambda: deque(maxlen=_TIMES))
    _map: bool = False
    """The map was improbable, and is not yet probable again."""

    def lost(self, stamp: float) -> None:
        """The pose was given up."""
        self._losses.append(stamp)

    def judge(
        self,
        stamp: float,
        landmarks: int,
        moved: Mapping[int, Point],
        misfit: MapMisfit,
        agreeing: int | None = None,
    ) -> Suspected:
        """No reason where nothing is suspected.

        Args:
            landmarks: of the map.
            moved: those found displaced, and by how much.
            misfit: of the map, by the filter.
            agreeing: so many landmarks have agreed with this pose; None where nobody has counted.
        """
        self._map = misfit.excess > (_CALM if self._map else _SIGMAS)
        if moved and landmarks - len(moved) < _FEWEST:
            number = next(iter(moved))
            return Suspected(
                f"Landmark {number} and the others contradict each other, and with so few of them "
                "it cannot be told which one has been moved.",
                max(math.hypot(*shift) for shift in moved.values()),
            )
        if agreeing is not None and len(moved) >= max(_SEVERAL, agreeing - 1):
            return Suspected(
                f"{len(moved)} landmarks are not in their places, and only {agreeing} were seen in "
                "theirs since the pose was found: perhaps this is not the map of this place.",
                max(math.hypot(*shift) for shift in moved.values()),
            )
        if self._map:
            return Suspected(
                "The landmarks do not stand to each other as on the map, most of all landmark "
                f"{misfit.worst}: check the map.",
                0.5 * self.tolerance,
            )
        if abs(misfit.stretch) > _STRETCH and landmarks - len(moved) <= _FEWEST:
            return Suspected(
                "The landmarks stand closer together or farther apart than on the map: one of them "
                "is not in its place, or the camera's calibration is off.",
                0.5 * self.tolerance,
            )
        if len(self._losses) == _TIMES and stamp - self._losses[0] < _WITHIN:
            return Suspected(
                f"The pose was lost and found {_TIMES} times within a minute: check the "
                "calibration and the map.",
                0.5 * self.tolerance,
            )
        return Suspected()
