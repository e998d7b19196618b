"""Where the camera points, and when: the recent angles, and the sweep."""

from __future__ import annotations

from bisect import bisect_right
from collections import deque

from polepilot.core.observation import PanReading


class PanTrack:
    """The last second of pan readings, to ask where the camera pointed during an exposure."""

    def __init__(self, keep: float = 1.0) -> None:
        self._keep = keep
        self._stamps: deque[float] = deque()
        self._angles: deque[float] = deque()

    def add(self, reading: PanReading) -> None:
        """Readings that are not newer than the last one are ignored."""
        if self._stamps and reading.stamp <= self._stamps[-1]:
            return
        self._stamps.append(reading.stamp)
        self._angles.append(reading.angle)
        while self._stamps[0] < reading.stamp - self._keep:
            self._stamps.popleft()
            self._angles.popleft()

    @property
    def latest(self) -> PanReading | None:
        if not self._stamps:
            return None
        return PanReading(self._stamps[-1], self._angles[-1])

    def at(self, stamp: float) -> float | None:
        """The angle at ``stamp``, interpolated; None outside of the readings that are kept."""
        if not self._stamps or not self._stamps[0] <= stamp <= self._stamps[-1]:
            return None
        after = bisect_right(self._stamps, stamp)
        if after == len(self._stamps):
            return self._angles[-1]
        t0, t1 = self._stamps[after - 1], self._stamps[after]
        share = (stamp - t0) / (t1 - t0)
        return self._angles[after - 1] + share * (self._angles[after] - self._angles[after - 1])


class PanSweep:
    """Turns the camera to and fro (paper, "camera rotation") between two angles.

    As long as it is not known where landmarks are to be seen, those are the ends of the pan range.
    """

    def __init__(self, minimum: float, maximum: float, duty: float, margin: float = 0.06) -> None:
        self._ends = (minimum + margin, maximum - margin)
        self._duty = duty
        self._direction = 1.0
        self.turns = 0
        """How often it has turned round."""

    def rate(self, angle: float | None, between: tuple[float, float] | None = None) -> float:
        """The duty to ask for, -1 to 1, with the camera at ``angle``; 0 while that is unknown.

        ``between`` narrows the sweep to these two angles, inside the pan range.
        """
        if angle is None:
            return 0.0
        low, high = self._ends
        if between is not None:
            low, high = max(low, between[0]), min(high, between[1])
        wanted = self._direction
        if angle >= high:
            wanted = -1.0
        elif angle <= low:
            wanted = 1.0
        if wanted != self._direction:
            self._direction = wanted
            self.turns += 1
        return self._direction * self._duty
