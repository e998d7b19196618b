"""Where it pays to look: the directions in which landmarks should be seen from here."""

from __future__ import annotations

import math
from collections.abc import Mapping

from polepilot.core.geometry import Pose2D
from polepilot.core.landmark import Landmark
from polepilot.core.scenery import Scenery
from polepilot.core.vehicle import Camera, PanUnit

MARGIN = 0.25
"""The sweep goes so far beyond the outermost landmark, radians: the robot turns meanwhile."""
FARTHEST = 15.0
"""Landmarks farther away are not counted on, metres."""
SHORT_OF_AXIS = 0.10
"""A line of sight ends so far before the landmark, which may stand at a wall, metres."""
RENEW = 0.5
"""Seconds between two looks at the map."""
FULL_EVERY = 4
"""Every so many turns the whole range is swept: landmarks get moved, and poses can be wrong."""


class Gaze:
    """Narrows the camera's sweep to where the map has landmarks in sight.

    A sweep over the whole range takes six seconds, in which a robot beside a wall sees nothing
    half of the time; looked at where they are, the same landmarks are seen more than twice as
    often.
    """

    def __init__(
        self,
        camera: Camera,
        pan: PanUnit,
        landmarks: Mapping[int, Landmark],
        scenery: Scenery,
    ) -> None:
        self._camera = camera
        self._pan = pan
        self._landmarks = tuple(landmarks.values())
        self._scenery = scenery
        self._renewed = -math.inf
        self._between: tuple[float, float] | None = None

    def between(self, now: float, pose: Pose2D, turns: int) -> tuple[float, float] | None:
        """Two pan angles to sweep between from ``pose``; None for the whole range.

        Args:
            turns: how often the sweep has turned round so far.
        """
        if turns % FULL_EVERY == 0:
            return None
        if now - self._renewed >= RENEW:
            self._renewed = now
            self._between = self._look(pose)
        return self._between

    def _look(self, pose: Pose2D) -> tuple[float, float] | None:
        axis = self._camera.pose_on(pose)
        bearings = [
            axis.bearing_to(mark.position) for mark in self._landmarks if self._seen(axis, mark)
        ]
        inside = [b for b in bearings if self._pan.minimum <= b <= self._pan.maximum]
        if len(inside) < 2:
            return None
        return min(inside) - MARGIN, max(inside) + MARGIN

    def _seen(self, axis: Pose2D, mark: Landmark) -> bool:
        distance = axis.distance_to(mark.position)
        if not self._nearest(mark) <= distance <= FARTHEST:
            return False
        share = 1 - SHORT_OF_AXIS / distance
        end = (axis.x + share * (mark.x - axis.x), axis.y + share * (mark.y - axis.y))
        return not self._scenery.blocked(axis.position, end)

    def _nearest(self, mark: Landmark) -> float:
        """From where on the whole code fits into the picture, metres."""
        camera = self._camera
        above = mark.kind.height - camera.mount_height
        rows_up, rows_down = camera.center_y, camera.height - 1 - camera.center_y
        return max(
            camera.constant * above / rows_up,
            camera.constant * camera.mount_height / rows_down,
        )
