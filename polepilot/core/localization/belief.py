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

    @property
    def lost(self) -> bool:
        return self.status is Status.LOST

    def seek(self, reason: str) -> None:
        """There is no pose."""
        self.status, self.reason = Status.FIXING, reason

    def accept(self) -> None:
        """There is a pose that was checked."""
        self.status, self.reason = Status.TRACKING, ""

    def lose(self, stamp: float, reason: str) -> None:
        if self.status is not Status.LOST:
            self.status, self.reason = Status.LOST, reason
            self.events.add(LocalizerEvent(stamp, "lost", reason))

    def doubt(self, stamp: float, reason: str) -> None:
        """DEGRADED; the first reason stays."""
        if self.status is Status.TRACKING:
            self._set(stamp, Status.DEGRADED, reason)

    def judge(
        self, stamp: float, moving: float, sigma: float, doubted: bool, suspected: str = ""
    ) -> None:
        """By how long it has been driven without a correction (s), and how sure it is (m).

        ``suspected``: why the pose may be wrong all the same; empty where it may not.
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
            self._set(stamp, Status.DEGRADED, reason)
        elif not doubted:
            self._set(stamp, Status.TRACKING, "")

    def _set(self, stamp: float, status: Status, reason: str) -> None:
        if status is not self.status:
            code = "recovered" if status is Status.TRACKING else "degraded"
            text = reason or "The pose is certain again."
            self.events.add(LocalizerEvent(stamp, code, text))
        self.status, self.reason = status, reason
