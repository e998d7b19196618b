"""A pose that is followed through time, and put right when a measurement comes late.

The filter's state lives at the last measurement. The last moments are kept, so that a measurement
which arrives after others that were taken later is applied in its own place.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Iterable, Sequence
from typing import NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from polepilot.core.geometry import Pose2D
from polepilot.core.landmark import Landmark
from polepilot.core.localization.fix import Fix
from polepilot.core.localization.odometry import OdometryHistory, Step
from polepilot.core.observation import RangeBearing

Sighting = tuple[RangeBearing, Landmark]
_KEPT = 24
"""So many pictures can be gone back at most."""
_LAG_STEP = 0.01
"""The time constants are followed in steps of this, seconds, and within these limits."""
_SHORTEST_LAG, _LONGEST_LAG = 0.01, 0.5


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
    def lag_errors(self) -> tuple[float, float]: ...
    def retuned(self, motor: float, servo: float) -> None: ...
    def begin(
        self, found: Fix, stamp: float, sightings: Sequence[Sighting], history: OdometryHistory
    ) -> float: ...
    def predict(self, steps: Iterable[Step]) -> float: ...
    def take(
        self, measurement: RangeBearing, landmark: Landmark, tolerance: float
    ) -> tuple[bool, float]: ...
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
        self.moving = 0.0
        """Seconds of motion since the last correction."""
        self.moved = -1e9
        """When it moved last."""
        self._moments: deque[_Moment] = deque(maxlen=_KEPT)

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
        errors = self.filter.lag_errors
        if max(abs(errors[0]), abs(errors[1])) < _LAG_STEP:
            return
        before = (history.speed_lag, history.steering_lag)
        motor, servo = (
            min(max(lag + error, _SHORTEST_LAG), _LONGEST_LAG)
            for lag, error in zip(before, errors, strict=True)
        )
        if max(abs(motor - before[0]), abs(servo - before[1])) > 0.5 * _LAG_STEP:
            history.retune(motor, servo)
            self.filter.retuned(motor - before[0], servo - before[1])
            # What was kept belongs to the old time constants.
            self._moments.clear()

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
