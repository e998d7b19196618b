"""Two landmarks make a pose; if one of them was moved, it is wrong, and both agree with it.

A landmark that was moved round the other one keeps its distance to it, and nothing that was
measured says so: the pose is turned round the one that stands. Until a third landmark agrees, that
is part of the pose's covariance, and what contradicts the pose is not forgotten.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from polepilot.core.geometry import Pose2D
from polepilot.core.landmark import Landmark
from polepilot.core.localization.doubt import largest_sigma
from polepilot.core.observation import RangeBearing

_MOST = 200


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

    @property
    def over(self) -> bool:
        return len(self.fixed_by) != 2

    @property
    def undecided(self) -> bool:
        """A third landmark is still to say whether the two are right."""
        return not self.over and len(self.landmarks) >= 3

    def begin(self, fixed_by: Collection[int], used: Sequence[RangeBearing] = ()) -> None:
        """``used``: the sightings that led to the pose."""
        self.fixed_by = frozenset(fixed_by)
        self.against.clear()
        self.led[:] = () if self.over else used
        self.failed = False

    def give_up(self) -> list[RangeBearing]:
        """There is no pose any more. What is to be considered for another one, in any order.

        That is what contradicted it; if enough did, also the sightings of the two.
        """
        evidence = [*self.against, *(self.led if self.failed else ())]
        self.failed = self.failed and bool(evidence)
        self.fixed_by = frozenset()
        self.against.clear()
        self.led.clear()
        return evidence

    def agrees(self, measurement: RangeBearing) -> None:
        if measurement.landmark not in self.fixed_by:
            self.begin(())
        elif not self.over:
            self.led.append(measurement)
            del self.led[:-_MOST]

    def contradicts(self, measurement: RangeBearing) -> str:
        """Why the pose is to be given up; empty where it is not."""
        if self.over:
            return ""
        self.against.append(measurement)
        del self.against[:-_MOST]
        counts = Counter(one.landmark for one in self.against)
        firm = sorted(number for number, count in counts.items() if count >= 2)
        if len(firm) < 2:
            return ""
        self.failed = True
        one, other = sorted(self.fixed_by)
        return (
            f"Landmarks {' and '.join(map(str, firm))} contradict the pose that {one} and {other} "
            "have given: one of those has been moved."
        )

    def covariance(self, pose: Pose2D) -> NDArray[np.float64]:
        """3 x 3, of turning ``pose`` round either of the two; zeros where nothing is in doubt.

        Where the map has no third landmark nothing better will come: the two are believed.
        """
        spread = np.zeros((3, 3))
        if not self.undecided:
            return spread
        one, other = (self.landmarks[number] for number in self.fixed_by)
        turn = self.shift / math.dist(one.position, other.position)
        for mark in (one, other):
            lever = turn * np.array([mark.y - pose.y, pose.x - mark.x, 1.0])
            spread += np.outer(lever, lever)
        spread[0, 0] += self.slack**2
        spread[1, 1] += self.slack**2
        # Two that stand close together turn the pose far: with that the robot could not even
        # drive to where it sees a third one.
        most = 2.0 * self.shift
        farthest = largest_sigma(*(float(spread[k]) for k in ((0, 0), (0, 1), (1, 1))))
        return spread * min(1.0, (most / farthest) ** 2)
