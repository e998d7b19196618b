"""How long the robot has been standing before something, and whether it got ahead since."""

from __future__ import annotations

from polepilot.core.geometry import Point, Pose2D

COME_AWAY = 0.6
"""Metres from where it first had to stand; nearer it still counts as blocked."""
TWITCH = 0.08
"""Who has not come farther than this has been standing, metres."""


class Patience:
    """Two clocks that begin with a standstill: one for this place, one until it got away."""

    def __init__(self) -> None:
        self._standing_since: float | None = None
        self._stood_at: Point = (0.0, 0.0)
        self._blocked_since: float | None = None
        self._blocked_at: Point = (0.0, 0.0)

    @property
    def blocked(self) -> bool:
        """It had to stand and has not got ahead since."""
        return self._blocked_since is not None

    def stood_for(self, now: float) -> float:
        """Seconds of standing on the spot, twitches included."""
        return 0.0 if self._standing_since is None else now - self._standing_since

    def blocked_for(self, now: float) -> float:
        """Seconds since it had to stand; 0 once it has got ahead."""
        return 0.0 if self._blocked_since is None else now - self._blocked_since

    def move_on(self) -> None:
        """Something new is tried: it does not count as standing any more."""
        self._standing_since = None

    def forget(self) -> None:
        """Begin again."""
        self._standing_since = self._blocked_since = None

    def block(self, now: float, pose: Pose2D) -> None:
        """It has to stand here, unless that is known already."""
        if self._blocked_since is None:
            self._blocked_since, self._blocked_at = now, pose.position

    def watch(
        self, now: float, pose: Pose2D, *, stands: bool, waits: bool, gives_way: bool
    ) -> None:
        """Take in a tick.

        Args:
            stands: it is not to move.
            waits: it does not simply follow its path.
            gives_way: it makes room or goes to look, which is not getting ahead.
        """
        if self._blocked_since is not None:
            if gives_way:
                self._blocked_at = pose.position
            elif pose.distance_to(self._blocked_at) > COME_AWAY:
                self._blocked_since = None
        if not waits:
            self._standing_since = None
            return
        if self._standing_since is not None:
            # A short twitch after each new plan is no progress.
            if pose.distance_to(self._stood_at) > TWITCH:
                self._standing_since = None
        elif stands:
            self._standing_since, self._stood_at = now, pose.position
        if stands:
            self.block(now, pose)
