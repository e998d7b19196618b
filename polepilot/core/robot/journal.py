"""What has happened lately, for the event list and the log; a lasting trouble is told once."""

from __future__ import annotations

import re
from collections import deque
from collections.abc import Callable

from polepilot.core.link.messages import Faults
from polepilot.core.robot.snapshot import Event, Level

EVENTS_SHOWN = 20

_NUMBER = re.compile(r"\d+(\.\d+)?")

_OF_BOARD: tuple[tuple[Faults, str, Level, str], ...] = (
    (Faults.LOW_BATTERY, "battery_low", "warning", "The battery is low: charge it soon."),
    (
        Faults.PAN_STUCK,
        "pan_stuck",
        "warning",
        "The camera does not turn: something holds it, or its potentiometer is disconnected.",
    ),
    (
        Faults.WATCHDOG_RESET,
        "watchdog_reset",
        "warning",
        "The microcontroller's program hung and was restarted by its watchdog.",
    ),
    (
        Faults.BROWN_OUT_RESET,
        "brown_out_reset",
        "warning",
        "The microcontroller's supply broke down and it restarted: check battery and wiring.",
    ),
)
"""Fault bits that a person should know of; button and obstacles show in the state."""


class Journal:
    """The newest events, numbered; ``on_event`` hears of each at once (a run's log, say)."""

    def __init__(self) -> None:
        self.on_event: Callable[[Event], None] = lambda _: None
        self._events: deque[Event] = deque(maxlen=EVENTS_SHOWN)
        self._seq = 0
        self._troubles: dict[str, str] = {}
        self._faults = Faults.NONE

    @property
    def events(self) -> tuple[Event, ...]:
        """The newest twenty, oldest first."""
        return tuple(self._events)

    def say(self, now: float, code: str, level: Level, text: str) -> None:
        """Something has happened."""
        self._seq += 1
        event = Event(self._seq, now, code, level, text)
        self._events.append(event)
        self.on_event(event)

    def trouble(self, now: float, source: str, text: str) -> None:
        """Something is wrong with ``source``: told once, not fifty times a second.

        The same words with other numbers ("for 3 s", "for 4 s") are the same trouble.
        """
        words = _NUMBER.sub("#", text)
        if self._troubles.get(source) != words:
            self._troubles[source] = words
            self.say(now, f"{source}_fault", "fault", text)

    def over(self, source: str) -> None:
        """``source`` works again; its next trouble is news."""
        self._troubles.pop(source, None)

    def board_faults(self, now: float, faults: Faults) -> None:
        """The fault bits as the board shows them now; those that were not set before are told."""
        new = faults & ~self._faults
        self._faults = faults
        for bit, code, level, text in _OF_BOARD:
            if bit in new:
                self.say(now, code, level, text)
