"""How well the pose is known, and why not better: the status and its reason."""

from __future__ import annotations

from dataclasses import dataclass

from polepilot.core.localization.events import EventLog, LocalizerEvent
from polepilot.core.localization.settings import LocalizerSettings
from polepilot.core.observation import Status


@dataclass(slots=True)
class Belief:
    """The status; every change of it is an event."""

    settings: LocalizerSettings
    events: EventLog
    status: Status = Status.FIXING
    reason: str = ""
    """Why the status is not TRACKING, for a person; empty while tracking."""
    _unconfirmed: str = ""
    """The reason that a new pose has from the beginning: no event."""

    @property
    def lost(self) -> bool:
        return self.status is Status.LOST

    def seek(self, reason: str) -> None:
        """There is no pose."""
        self.status, self.reason = Status.FIXING, reason

    def accept(self, unconfirmed: str = "") -> None:
        """There is a pose that was checked; ``unconfirmed``: why it may be wrong all the same."""
        self.status = Status.DEGRADED if unconfirmed else Status.TRACKING
        self.reason = self._unconfirmed = unconfirmed

    def lose(self, stamp: float, reason: str) -> None:
        if self.status is not Status.LOST:
            self.status, self.reason = Status.LOST, reason
            self.events.add(LocalizerEvent(stamp, "lost", reason))

    def doubt(self, stamp: float, reason: str) -> None:
        """DEGRADED; the first reason stays."""
        if self._untroubled:
            self._degrade(stamp, reason)

    def judge(
        self,
        stamp: float,
        moving: float,
        sigma: float,
        doubted: bool,
        suspected: str = "",
        unconfirmed: str = "",
    ) -> None:
        """By how long it has been driven without a correction (s), and how sure it is (m).

        ``suspected``: why the pose may be wrong all the same; empty where it may not.
        ``unconfirmed``: likewise, from the beginning.
        """
        settings = self.settings
        if self.status in (Status.LOST, Status.FIXING):
            return
        reason = suspected
        if sigma > settings.degraded_sigma:
            reason = f"The position is known only to {100 * sigma:.0f} cm."
        elif moving > settings.degraded_after:
            reason = f"No landmark has been seen during {moving:.0f} s of driving."
        if sigma > settings.lost_sigma or moving > settings.lost_after:
            self.lose(stamp, reason)
        elif reason:
            self._degrade(stamp, reason)
        elif not doubted:
            before, self._unconfirmed = self._untroubled, unconfirmed
            self.status = Status.DEGRADED if unconfirmed else Status.TRACKING
            self.reason = unconfirmed
            if not before:
                text = unconfirmed or "The pose is certain again."
                self.events.add(LocalizerEvent(stamp, "recovered", text))

    @property
    def _untroubled(self) -> bool:
        """Nothing has happened to the pose since it was found."""
        return self.status is Status.TRACKING or (
            self.status is Status.DEGRADED and self.reason == self._unconfirmed
        )

    def _degrade(self, stamp: float, reason: str) -> None:
        if self._untroubled:
            self.events.add(LocalizerEvent(stamp, "degraded", reason))
        self.status, self.reason = Status.DEGRADED, reason
