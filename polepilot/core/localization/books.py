"""The books on landmarks: which ones agree with the pose, and what those that do not tell.

A sighting goes into the filter or it does not; either way it says something of the pose, and of the
landmark. What has been moved, misread or hidden is found here, and so is what makes a pose lost.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Iterable, Mapping

from polepilot.core.geometry import Point
from polepilot.core.landmark import Landmark
from polepilot.core.localization.belief import Belief
from polepilot.core.localization.doubt import Doubt
from polepilot.core.localization.events import EventLog, LocalizerEvent
from polepilot.core.localization.health import LandmarkHealth, Verdict
from polepilot.core.localization.presence import Presence
from polepilot.core.localization.settings import LocalizerSettings
from polepilot.core.localization.track import Track
from polepilot.core.localization.trial import Trial
from polepilot.core.observation import RangeBearing

_STANDS_AFTER = 0.2
"""Seconds after the last motion from when on the robot counts as standing."""
_SWEEPS = 8.0
"""Another landmark agreed with the pose recently: within the last two sweeps or so, seconds."""
_CHANCE = 0.01
"""How likely it may be that missing landmarks are just overlooked before the pose is given up."""


class Books:
    """Kept on one pose after the other; bounded in memory."""

    def __init__(
        self,
        landmarks: Mapping[int, Landmark],
        settings: LocalizerSettings,
        events: EventLog,
        belief: Belief,
        presence: Presence | None,
    ) -> None:
        """``presence``: None where the camera's angle of view is not known."""
        self._landmarks = landmarks
        self._tolerance = settings.tolerance
        self._events = events
        self._belief = belief
        self._presence = presence
        self._agreed: dict[int, float] = {}
        """When each landmark last agreed with this pose."""
        self.health = LandmarkHealth(landmarks)
        self.doubt = Doubt(settings.tolerance, settings.method == "paper")
        self.trial = Trial(landmarks, settings.tolerance, settings.fix.slack)

    # ---- from pose to pose -------------------------------------------------------------------

    def open(self, stamp: float, agreed: Iterable[int]) -> None:
        """A pose with which these landmarks agree is believed."""
        self.doubt.clear()
        self._agreed = dict.fromkeys(agreed, stamp)

    def reopen(self, stamp: float, agreed: Iterable[int]) -> None:
        """The pose that was given up last was right all the same."""
        self.open(stamp, agreed)
        self.health.restore()

    def close(self) -> list[RangeBearing]:
        """The pose is given up; what contradicted it, in order of time."""
        health, against = self.health, {*self.trial.give_up(), *self.doubt.against}
        if len(self._landmarks) - len(health.moved) < 2:
            # With so few left, it is as likely that the pose was wrong.
            health.moved.clear()
        self.doubt.clear()
        self._agreed.clear()
        health.set_aside()
        if self._presence is not None:
            self._presence.forget()
        return sorted(against, key=lambda m: m.stamp)

    @property
    def agreeing(self) -> int:
        """How many landmarks have agreed with this pose and have not been moved."""
        return len(self._agreed.keys() - self.health.moved.keys())

    # ---- sightings ---------------------------------------------------------------------------

    def usable(self, measurement: RangeBearing) -> bool:
        """Whether it is a measurement of a landmark of the map."""
        numbers = (measurement.stamp, measurement.bearing, measurement.bearing_sigma)
        if not all(math.isfinite(number) for number in numbers) or math.isnan(measurement.range):
            return False
        if measurement.landmark in self._landmarks:
            return True
        text = f"Landmark {measurement.landmark} is seen but is not on the map."
        self._report(measurement, "landmark_unknown", text)
        return False

    def late(self, measurements: Iterable[RangeBearing]) -> None:
        """They came too late to be of use."""
        for measurement in measurements:
            self._report(measurement, "late", "A measurement came too late.")

    def take(self, track: Track, measurement: RangeBearing) -> bool:
        """Whether a measurement was fused; keeps the books on those that were not."""
        number, stamp = measurement.landmark, measurement.stamp
        mark = self._landmarks[number]
        health = self.health
        if number in health.moved:
            self._displaced(track, measurement, mark)
            return False
        place = track.filter.appears(measurement) if health.suspected(number, stamp) else None
        off = 0.0 if place is None else math.dist(place, mark.position)
        if off > 0.5 * self._tolerance:
            # A pose that has become vague since must not make room for it.
            taken, gap = False, off
        else:
            taken, gap = track.filter.take(measurement, mark, track.tolerance)
        if taken:
            self._agrees(track, measurement, gap)
            return True
        place = place or track.filter.appears(measurement)
        offset = (None, None) if place is None else (place[0] - mark.x, place[1] - mark.y)
        text = f"Landmark {number} appears {100 * gap:.0f} cm from where it should be."
        self._report(measurement, "rejected", text, *offset)
        # A number read where another landmark stands speaks against the reading, not the pose.
        misread = place is not None and health.stands_another(number, place)
        if gap > self._tolerance and not misread:
            self.doubt.add(measurement, gap)
        if reason := "" if misread else self.trial.contradicts(measurement):
            self._belief.lose(stamp, reason)
        if place is not None and self._others_agree(number, stamp):
            aside = math.hypot(track.heading_sigma, measurement.bearing_sigma)
            sigma = math.hypot(track.sigma, measurement.range * aside, measurement.range_sigma)
            track.supposed.begin(track.filter, stamp, mark, place)
            self.contradicted(number, stamp, place, sigma)
        return False

    def _displaced(self, track: Track, measurement: RangeBearing, mark: Landmark) -> None:
        """One that has been moved is seen: there, or where the map has it?"""
        number, stamp = measurement.landmark, measurement.stamp
        place = track.filter.appears(measurement)
        if place is None or math.dist(place, mark.position) > 0.5 * self._tolerance:
            self.health.contradicted(number, stamp, place or (math.nan, math.nan))
        elif self.health.agreed(number):
            text = f"Landmark {number} stands again where the map has it."
            self._events.add(LocalizerEvent(stamp, "landmark_back", text, number))

    def _agrees(self, track: Track, measurement: RangeBearing, gap: float) -> None:
        number, stamp = measurement.landmark, measurement.stamp
        self._agreed[number] = stamp
        track.supposed.end(number)
        self.health.agreed(number)
        self.trial.agrees(measurement)
        if gap < 0.5 * self._tolerance and not self.trial.undecided:
            for verdict in self.health.witnessed(number, stamp, track.supposed.places()):
                track.supposed.end(verdict.landmark)
                self._tell(verdict, stamp)
        pan = measurement.pan
        if self._presence is None or pan is None or not math.isfinite(measurement.range):
            return
        off_axis = measurement.bearing - pan
        if self._presence.saw(number, measurement.range, off_axis, track.filter.pose):
            text = f"Landmark {number} is seen again."
            self._events.add(LocalizerEvent(stamp, "landmark_back", text, number))

    def displaced(self, measurement: RangeBearing, place: Point, sigma: float) -> bool:
        """Whether a landmark that appears at ``place``, by a pose of others, is not in its own."""
        off = math.dist(place, self._landmarks[measurement.landmark].position)
        if off <= max(0.5 * self._tolerance, 3.0 * sigma):
            return False
        self.contradicted(measurement.landmark, measurement.stamp, place, sigma)
        return True

    def contradicted(self, number: int, stamp: float, place: Point, sigma: float) -> None:
        """A landmark is not in its place though the pose is right: is it to be left out?"""
        sure = not self.trial.undecided
        verdict = self.health.contradicted(number, stamp, place, sigma, sure)
        if verdict is not None:
            self._tell(verdict, stamp)

    def _others_agree(self, number: int, stamp: float) -> bool:
        return any(
            other != number and stamp - when < _SWEEPS for other, when in self._agreed.items()
        )

    def _tell(self, verdict: Verdict, stamp: float) -> None:
        number = verdict.landmark
        self._events.add(
            LocalizerEvent(stamp, verdict.code, verdict.text, number, verdict.dx, verdict.dy)
        )

    def _report(
        self,
        about: RangeBearing,
        code: str,
        text: str,
        dx: float | None = None,
        dy: float | None = None,
    ) -> None:
        self._events.report(LocalizerEvent(about.stamp, code, text, about.landmark, dx, dy))

    # ---- pictures ----------------------------------------------------------------------------

    def look(self, then: Track, pan: float, seen: Collection[int]) -> None:
        """Notice what is not in a picture, taken from the pose ``then``, though it should be."""
        if self._presence is None:
            return
        stamp = then.stamp
        missing, chance, hidden = self._presence.look(stamp, then.filter.pose, pan, seen)
        for number in hidden:
            text = f"Landmark {number} should be seen and is not: something hides it."
            self._events.add(LocalizerEvent(stamp, "landmark_hidden", text, number))
        if chance < _CHANCE and stamp - then.moved > _STANDS_AFTER:
            ids = " and ".join(str(number) for number in missing)
            self._belief.lose(
                stamp,
                f"Landmark {ids}, seen from here before, is missing: the robot has been moved, or "
                "something stands before it.",
            )

    def judge(self, track: Track) -> None:
        """LOST when too much contradicts the pose and nothing agrees."""
        standing = track.stamp - track.moved > _STANDS_AFTER
        if judged := self.doubt.judge(track.stamp, self._agreed, standing):
            react = self._belief.lose if judged.status == "lost" else self._belief.doubt
            react(track.stamp, judged.reason)
