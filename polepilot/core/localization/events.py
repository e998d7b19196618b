"""What happened to the pose or to a landmark, kept until somebody asks; bounded in memory."""

from __future__ import annotations

import math
from collections import deque
from dataclasses import dataclass, field

_QUIET = 2.0
"""Seconds between two reports of one kind about one landmark."""


@dataclass(frozen=True, slots=True)
class LocalizerEvent:
    """Something that happened to the pose or to a landmark.

    ``code`` is one of fixed, refixed, resumed, degraded, recovered, lost, rejected, late,
    landmark_unknown, landmark_moved, landmark_misread, landmark_hidden, landmark_back.
    """

    stamp: float
    code: str
    text: str
    landmark: int | None = None
    dx: float | None = None
    """How far the landmark appears displaced in `map`, metres."""
    dy: float | None = None


@dataclass(slots=True)
class EventLog:
    """The last events; the oldest give way."""

    _events: deque[LocalizerEvent] = field(default_factory=lambda: deque(maxlen=256))
    _reported: dict[tuple[str, int], float] = field(default_factory=dict)

    def add(self, event: LocalizerEvent) -> None:
        self._events.append(event)

    def report(self, event: LocalizerEvent) -> None:
        """Add, but about each landmark not more often than every two seconds."""
        key = (event.code, event.landmark or 0)
        if event.stamp - self._reported.get(key, -math.inf) < _QUIET:
            return
        if len(self._reported) > 1000:
            self._reported.clear()
        self._reported[key] = event.stamp
        self._events.append(event)

    def drain(self) -> list[LocalizerEvent]:
        """What happened since the last call."""
        drained = list(self._events)
        self._events.clear()
        return drained
