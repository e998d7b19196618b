"""Two landmarks make a pose; if one of them was moved, it is wrong, and both agree with it.

A landmark that was moved round the other one keeps its distance to it, and nothing that was
measured says so: the pose is turned round the one that stands. That is two suppositions, one for
each of the two. Until third landmarks that agree have ruled them out, they are part of the pose's
covariance, and what contradicts the pose is not forgotten. A third one that stands near the pivot
hardly moves when the pose is turned round it: it rules out the other supposition alone.

No driving can tell them from the right pose: both landmarks together stand to the robot as they
should, and move past it as they should. So such a pose is never claimed without saying so. Where
such poses fail again and again, one moved landmark is no explanation any more.
"""

from __future__ import annotations

import math
from collections import Counter, deque
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from polepilot.core.geometry import Pose2D
from polepilot.core.landmark import Landmark
from polepilot.core.localization.doubt import largest_sigma
from polepilot.core.observation import RangeBearing

_MOST = 200
_OR_ELSE = ", or this is not the map of this place"
_TELLING = 0.5
"""A third landmark that would appear this share of the shift off its place would not agree."""
_PATIENCE, _REMEMBERED = 2, 300.0
"""After so many failed poses within so many seconds two landmarks give none any more."""


@dataclass(slots=True)
class Trial:
    """A pose that two landmarks have given, until a third one agrees; bounded in memory."""

    landmarks: Mapping[int, Landmark]
    shift: float
    """By how much one of the two may have been moved, metres."""
    slack: float
    """By how much the distance between them may be off without being noticed, metres."""
    fixed_by: frozenset[int] = frozenset()
    against: list[RangeBearing] = field(default_factory=list)
    led: list[RangeBearing] = field(default_factory=list)
    """Sightings of the two."""
    failed: bool = False
    """Others have contradicted the last one."""
    failures: deque[float] = field(default_factory=lambda: deque(maxlen=10))
    """When poses have been given up for that since one was confirmed."""
    pivots: set[int] = field(default_factory=set)
    """Round which of the two the pose may still be turned."""
    _third: dict[int, set[int]] = field(default_factory=dict)
    """Which others rule that out, by pivot."""

    @property
    def over(self) -> bool:
        return len(self.fixed_by) != 2

    def refusal(self, stamp: float) -> str:
        """Why two landmarks are to give no pose, for a person; empty where they may."""
        failures = sum(stamp - then < _REMEMBERED for then in self.failures)
        if failures < _PATIENCE:
            return ""
        return (
            f"Poses of two landmarks have failed {failures} times: three have to agree{_OR_ELSE}."
        )

    def forgive(self) -> None:
        """Somebody wants to begin anew: what has failed before says nothing any more."""
        self.failures.clear()

    @property
    def unconfirmed(self) -> str:
        """Why the pose is not to be claimed without a word, for a person; empty where it is."""
        if self.over:
            return ""
        one, other = sorted(self.fixed_by)
        if len(self.landmarks) < 3:
            return (
                f"The map has landmarks {one} and {other} only: if one of them has been moved "
                "round the other, nothing would tell."
            )
        return f"Only landmarks {one} and {other} have agreed so far: a third one has to."

    @property
    def undecided(self) -> bool:
        """A third landmark is still to say whether the two are right."""
        return not self.over and len(self.landmarks) >= 3

    def begin(self, fixed_by: Collection[int], seen: Sequence[RangeBearing] = ()) -> None:
        """``seen``: their sightings up to now, those that did not lead to the pose as well."""
        self.fixed_by = frozenset(fixed_by)
        self.pivots = set() if self.over else set(fixed_by)
        self._third.clear()
        if self.over:
            self.failures.clear()
        self.against.clear()
        self.led[:] = () if self.over else seen[-_MOST:]
        self.failed = False

    def give_up(self) -> list[RangeBearing]:
        """There is no pose any more. What is to be considered for another one, in any order.

        That is what contradicted it; if enough did, also the sightings of the two.
        """
        evidence = [*self.against, *(self.led if self.failed else ())]
        self.failed = self.failed and bool(evidence)
        if self.failed:
            self.failures.append(max(one.stamp for one in evidence))
        self.fixed_by = frozenset()
        self.against.clear()
        self.led.clear()
        return evidence

    def agrees(self, measurement: RangeBearing) -> None:
        """It fits to the pose."""
        if self.over:
            return
        if measurement.landmark in self.fixed_by:
            self.led.append(measurement)
            del self.led[:-_MOST]
            return
        third = self.landmarks[measurement.landmark].position
        for number in tuple(self.pivots):
            aside = self._turn * math.dist(third, self.landmarks[number].position)
            if aside > _TELLING * self.shift:
                agreeing = self._third.setdefault(number, set())
                agreeing.add(measurement.landmark)
                if len(agreeing) >= self._needed:
                    self.pivots.discard(number)
        if not self.pivots:
            self.begin(())

    def contradicts(self, measurement: RangeBearing) -> str:
        """Why the pose is to be given up; empty where it is not."""
        if self.over:
            return ""
        self.against.append(measurement)
        del self.against[:-_MOST]
        firm = self._firm()
        if len(firm) < 2:
            return ""
        self.failed = True
        one, other = sorted(self.fixed_by)
        return (
            f"Landmarks {' and '.join(map(str, firm))} contradict the pose that {one} and {other} "
            f"have given: one of those has been moved{_OR_ELSE if self.failures else ''}."
        )

    @property
    def _needed(self) -> int:
        """So many third landmarks have to agree: more than contradict, if there are so many."""
        against = len(self._firm())
        return max(1, min(against + 1, len(self.landmarks) - 2 - against))

    def _firm(self) -> list[int]:
        """Who has contradicted the pose twice.

        The two themselves are no witnesses against each other: then the robot was moved.
        """
        counts = Counter(one.landmark for one in self.against)
        return sorted(n for n, count in counts.items() if count >= 2 and n not in self.fixed_by)

    @property
    def doubt(self) -> str:
        """Why the pose may be wrong, for a person: a single landmark contradicts it."""
        firm = [] if self.over else self._firm()
        if len(firm) != 1:
            return ""
        one, other = sorted(self.fixed_by)
        return (
            f"Landmark {firm[0]} contradicts the pose that {one} and {other} have given: one of "
            "the three has been moved."
        )

    @property
    def _turn(self) -> float:
        """By how much one of the two turns the pose round the other, radians."""
        one, other = (self.landmarks[number] for number in self.fixed_by)
        return self.shift / math.dist(one.position, other.position)

    def covariance(self, pose: Pose2D) -> NDArray[np.float64]:
        """3 x 3, of turning ``pose`` round those of the two that may be pivots.

        Zeros where nothing is in doubt. Where the map has no third landmark nothing better will
        come: the two are believed.
        """
        spread = np.zeros((3, 3))
        if not self.undecided:
            return spread
        for mark in (self.landmarks[number] for number in sorted(self.pivots)):
            lever = self._turn * np.array([mark.y - pose.y, pose.x - mark.x, 1.0])
            spread += np.outer(lever, lever)
        spread[0, 0] += self.slack**2
        spread[1, 1] += self.slack**2
        # Two that stand close together turn the pose far: with that the robot could not even
        # drive to where it sees a third one.
        most = 2.0 * self.shift
        farthest = largest_sigma(*(float(spread[k]) for k in ((0, 0), (0, 1), (1, 1))))
        return spread * min(1.0, (most / farthest) ** 2)
