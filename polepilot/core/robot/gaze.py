"""Where it pays to look: the directions in which landmarks should be seen from here."""

from __future__ import annotations

import math
from collections.abc import Mapping

from polepilot.core.geometry import Pose2D
from polepilot.core.landmark import Landmark
from polepilot.core.observation import PoseEstimate, Status
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
FULL_AFTER = 12.0
"""So many seconds after the last time it looks as far as the camera turns, to the other side than
then: landmarks get moved, and poses can be wrong."""
FULL_IN_DOUBT = 24.0
"""The same while the pose is in doubt: what is known to be in sight goes before."""
BEYOND = 0.5
"""Share of half the angle of view beyond the end of the pan range that is counted on."""

_KNOWN = (Status.TRACKING, Status.DEGRADED)


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
        self._turns = -1
        self._full = True
        """The present sweep goes on to the end of the range."""
        self._doubtful = False
        """The pose was in doubt when the present sweep began."""
        self._full_at = -math.inf
        self._full_side = -1

    def between(
        self, now: float, estimate: PoseEstimate | None, turns: int
    ) -> tuple[float, float] | None:
        """Two pan angles to sweep between; None for the whole range.

        Args:
            estimate: where it stands. The less it has seen lately the more it matters to look
                where there is something: also a doubtful pose will do.
            turns: how often the sweep has turned round so far.
        """
        known = estimate is not None and estimate.status in _KNOWN
        doubtful = estimate is not None and estimate.status is Status.DEGRADED
        if turns != self._turns:
            self._turns, self._doubtful = turns, doubtful
            due = now - self._full_at >= (FULL_IN_DOUBT if doubtful else FULL_AFTER)
            self._full = due and turns % 2 != self._full_side
            if self._full:
                self._full_at, self._full_side = now, turns % 2
        elif doubtful and not self._doubtful:
            self._full = False  # first something that is known to be there
        if self._full or not known or estimate is None:
            return None
        if now - self._renewed >= RENEW:
            self._renewed = now
            self._between = self._look(estimate.pose)
        return self._between

    def _look(self, pose: Pose2D) -> tuple[float, float] | None:
        axis = self._camera.pose_on(pose)
        bearings = [
            axis.bearing_to(mark.position) for mark in self._landmarks if self._seen(axis, mark)
        ]
        beyond = BEYOND * self._camera.half_view
        low, high = self._pan.minimum - beyond, self._pan.maximum + beyond
        inside = [bearing for bearing in bearings if low <= bearing <= high]
        if not inside:
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
