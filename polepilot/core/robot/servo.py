"""Where the front wheel has got to while it turns to the angle that it was told."""

from __future__ import annotations

from dataclasses import replace

from polepilot.core.observation import Odometry


class Servo:
    """A steering servo turns at a bounded rate, and the board reports only what it was told.

    Without this a change of steering looks finished up to half a second before it is, and a turn
    of 60 degrees at full lock is off by several degrees.
    """

    def __init__(self, rate: float) -> None:
        """``rate``: how fast the wheel turns, rad/s."""
        self._rate = rate
        self._angle: float | None = None
        self._stamp = 0.0

    def follow(self, odometry: Odometry) -> Odometry:
        """The same with the angle that the wheel can have reached by ``odometry.stamp``."""
        if self._angle is None:
            self._angle = odometry.steering
        reach = self._rate * max(0.0, odometry.stamp - self._stamp)
        self._angle += min(max(odometry.steering - self._angle, -reach), reach)
        self._stamp = odometry.stamp
        return replace(odometry, steering=self._angle)
