"""Whether a drive that somebody asked for may still go on without asking again."""

from __future__ import annotations

from polepilot.core.link.protocol import LinkState

STANDING_AFTER = 0.4
"""Seconds without a turning wheel after which the robot counts as standing."""
ARMING_PATIENCE = 2.0
"""Seconds until a board that does not arm pauses the mission."""
STANDSTILL_PATIENCE = 60.0
"""Seconds of standing for whatever reason while a mission runs; then it takes a person to go on:
a robot that has stood for long must not start to move by itself."""

_DISARMED: dict[LinkState, str] = {
    LinkState.CLOSED: "Stopped: the line to the microcontroller is gone. Plug it in, then Resume.",
    LinkState.CONNECTING: "Stopped: the microcontroller does not answer. Check its power, Resume.",
    LinkState.IDLE: "Stopped: the microcontroller is not armed. Resume arms it.",
    LinkState.LINK_LOST: "Stopped: the microcontroller missed the computer for a moment. Resume.",
    LinkState.ESTOP: "Stopped: the button on the robot is pressed.",
}


class Watch:
    """Remembers when somebody asked for the drive, and when a wheel turned last."""

    def __init__(self) -> None:
        self._armed = False
        """Since somebody asked for it last."""
        self._asked = 0.0
        self._last_moving = 0.0

    def asked(self, now: float) -> None:
        """Somebody wants it to drive."""
        self._armed = False
        self._asked = now

    def moved(self, stamp: float) -> None:
        """A wheel was turning at ``stamp``."""
        self._last_moving = stamp

    def standing(self, now: float) -> bool:
        return now - self._last_moving > STANDING_AFTER

    def objection(self, now: float, state: LinkState, why: str) -> str | None:
        """Why it has to pause now, or None. Whatever ends the arming ends the drive.

        Args:
            why: what keeps it from driving, if anything does.
        """
        if state is LinkState.ARMED:
            self._armed = True
        elif self._armed or now - self._asked > ARMING_PATIENCE:
            return _DISARMED[state]
        if now - max(self._last_moving, self._asked) <= STANDSTILL_PATIENCE:
            return None
        words = [f"Stopped: could not drive for {STANDSTILL_PATIENCE:.0f} s.", why, "Then Resume."]
        return " ".join(word for word in words if word)
