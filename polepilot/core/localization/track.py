"""A pose that is followed through time, and put right when a measurement comes late.

The filter's state lives at the last measurement. The last moments are kept, so that a measurement
which arrives after others that were taken later is applied in its own place.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Iterable, Sequence
from typing import NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from polepilot.core.geometry import Point, Pose2D
from polepilot.core.landmark import Landmark
from polepilot.core.localization.doubt import largest_sigma
from polepilot.core.localization.fix import Fix
from polepilot.core.localization.odometry import Following, OdometryHistory, Step
from polepilot.core.localization.supposed import Supposed
from polepilot.core.localization.suspicion import MapMisfit
from polepilot.core.observation import RangeBearing

Sighting = tuple[RangeBearing, Landmark]
_KEPT = 24
"""So many pictures can be gone back at most."""
_STEPS = Following(0.01, 0.01, 0.05)
"""The constants of motors and servo are followed in steps of this, and within these limits."""
_LEAST, _MOST = Following(0.01, 0.01, 0.08), Following(0.5, 0.5, 1.0)


class Filter(Protocol):
    """What follows a pose: the extended Kalman filter, or the paper's method."""

    @property
    def pose(self) -> Pose2D: ...
    @property
    def pose_covariance(self) -> NDArray[np.float64]: ...
    @property
    def speed_factor(self) -> float: ...
    @property
    def steering_offset(self) -> float: ...
    @property
    def following_errors(self) -> Following: ...
    def retuned(self, by: Following) -> None: ...
    @property
    def map_misfit(self) -> MapMisfit: ...
    def begin(
        self, found: Fix, stamp: float, sightings: Sequence[Sighting], history: OdometryHistory
    ) -> Sequence[RangeBearing]: ...
    def supposing(self, landmark: Landmark, place: Point) -> Filter | None: ...
    def shift_of(self, number: int) -> tuple[Point, float] | None: ...
    def predict(self, steps: Iterable[Step]) -> float: ...
    def take(
        self, measurement: RangeBearing, landmark: Landmark, tolerance: float
    ) -> tuple[bool, float]: ...
    def appears(self, measurement: RangeBearing) -> Point | None: ...
    def copy(self) -> Filter: ...


class _Moment(NamedTuple):
    """A picture that was applied, and the track just before it."""

    stamp: float
    filter: Filter
    moving: float
    moved: float
    taken: list[Sighting]


class Track:
    """A filter's state at a moment."""

    def __init__(self, filtered: Filter, stamp: float, tolerance: float) -> None:
        """``tolerance``: metres, as `Filter.take` has it."""
        self.filter = filtered
        self.tolerance = tolerance
        self.stamp = stamp
        self.supposed = Supposed()
        self.moving = 0.0
        """Seconds of motion since the last correction."""
        self.moved = -1e9
        """When it moved last."""
        self._moments: deque[_Moment] = deque(maxlen=_KEPT)

    @property
    def sigma(self) -> float:
        """Standard deviation of the position along the worst direction, metres."""
        (xx, xy, _), (_, yy, _), _ = self.filter.pose_covariance.tolist()
        return largest_sigma(xx, xy, yy)

    @property
    def heading_sigma(self) -> float:
        return math.sqrt(float(self.filter.pose_covariance[2, 2]))

    def fork(self) -> Track:
        """The same pose, to be predicted ahead; it cannot go back."""
        other = Track(self.filter.copy(), self.stamp, self.tolerance)
        other.moving, other.moved = self.moving, self.moved
        return other

    def adopt(self, ahead: Track) -> None:
        """Go on from where a fork of this track has been predicted to."""
        self.filter, self.stamp = ahead.filter, ahead.stamp
        self.moving, self.moved = ahead.moving, ahead.moved

    def predict(self, history: OdometryHistory, stamp: float) -> None:
        if stamp <= self.stamp:
            return
        moving = self.filter.predict(history.steps(self.stamp, stamp))
        if moving:
            self.moving += moving
            self.moved = stamp
        self.stamp = stamp

    def keep(self) -> list[Sighting]:
        """Remember this moment; what is taken in now is to be added to the list returned."""
        taken: list[Sighting] = []
        moment = _Moment(self.stamp, self.filter.copy(), self.moving, self.moved, taken)
        self._moments.append(moment)
        return taken

    def retune(self, history: OdometryHistory) -> None:
        """Let the history follow what the filter has learnt of servo and motors."""
        errors = self.filter.following_errors
        motor, servo, slowness = errors
        if abs(motor) < _STEPS[0] and abs(servo) < _STEPS[1] and abs(slowness) < _STEPS[2]:
            return
        before = history.following
        after = Following(
            *(
                min(max(value + error, least), most)
                for value, error, least, most in zip(before, errors, _LEAST, _MOST, strict=True)
            )
        )
        by = Following(*(new - old for new, old in zip(after, before, strict=True)))
        if any(abs(change) > 0.5 * step for change, step in zip(by, _STEPS, strict=True)):
            history.retune(after)
            for filtered in (self.filter, *(moment.filter for moment in self._moments)):
                filtered.retuned(by)
            self.supposed.retuned(by)

    def rewind(self, stamp: float, history: OdometryHistory) -> list[_Moment] | None:
        """Go back to ``stamp``; answers what was applied since, or None where that is too far."""
        if not self._moments or self._moments[0].stamp > stamp:
            return None
        undone: list[_Moment] = []
        while self._moments[-1].stamp > stamp:
            undone.append(self._moments.pop())
        base = self._moments[-1]
        self.filter, self.stamp = base.filter.copy(), base.stamp
        self.moving, self.moved = base.moving, base.moved
        self._again(base.taken)
        self.predict(history, stamp)
        return undone[::-1]

    def replay(self, undone: Sequence[_Moment], history: OdometryHistory) -> None:
        """Apply again what `rewind` undid."""
        for moment in undone:
            self.predict(history, moment.stamp)
            taken = self.keep()
            taken += self._again(moment.taken)

    def _again(self, sightings: Sequence[Sighting]) -> list[Sighting]:
        taken = [s for s in sightings if self.filter.take(*s, self.tolerance)[0]]
        if taken:
            self.moving = 0.0
        return taken
