"""A pose that was given up, until another one is found: landmarks that agree bring it back."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

from polepilot.core.localization.odometry import OdometryHistory
from polepilot.core.localization.settings import LocalizerSettings
from polepilot.core.localization.track import Sighting, Track

_RESUMING = 2
"""Sightings that bring it back."""


@dataclass(slots=True)
class GivenUp:
    """Followed through time, so that it can be compared with what is seen now."""

    track: Track
    settings: LocalizerSettings
    _agreeing: int = 0

    def agrees(self, history: OdometryHistory, stamp: float, seen: Iterable[Sighting]) -> bool:
        """Whether it is to be believed again, after what a picture of ``stamp`` showed."""
        track = self.track
        if stamp < track.stamp - 1e-9:
            return False
        track.predict(history, stamp)
        for measurement, mark in seen:
            taken, gap = track.filter.take(measurement, mark, track.tolerance)
            if taken:
                self._agreeing += 1
            elif gap > self.settings.tolerance:
                self._agreeing = 0
        return self._agreeing >= _RESUMING and track.sigma <= self.settings.degraded_sigma
