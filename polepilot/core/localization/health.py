"""Landmarks that contradict the rest: moved, or read with a wrong number."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Literal, NamedTuple

import numpy as np

from polepilot.core.geometry import Point, Pose2D
from polepilot.core.landmark import Landmark
from polepilot.core.observation import RangeBearing

_SIGHTINGS = 6
"""Contradicting sightings before a landmark is judged."""
_WITNESSED = 3
"""The same where another landmark was in its place before and after them."""
_SUSPICION = 10.0
"""Seconds for which a landmark that contradicted has to be in its place to be believed."""
_KNOWN = 0.045
"""Metres to which the best of these few must be known."""
_SETTLED, _VAGUER = 3.0, 0.065
"""So many seconds after it was seen last, what has been learnt of its place since is as good as it
gets: it may be known to so many metres only."""
_SPAN = 2.0
"""Seconds between the first and the last of them: more than one pass of the camera."""
_MEMORY = 60.0
_SCATTER = 0.12
"""How well they must agree on the new place, metres, or in standard deviations of both."""
_SIGMAS = 2.0
_SHIFT, _SIGNIFICANT = 0.12, 3.0
"""A landmark was moved by so many metres, and standard deviations, at least."""
_STRIKING = 6.0
"""The same where that place has been learnt since: with it goes all that the filter believes."""
_PAUSE = 1.0
"""Seconds between two rows of sightings."""
_SUREST = 0.01
"""Metres; no place is known better."""
_SIMILAR = 1.3
_FAMILY = 0.35
"""A place this near to another landmark is that landmark, misread."""


class Verdict(NamedTuple):
    """What is wrong with a landmark, and by how much it appears displaced, metres."""

    landmark: int
    code: Literal["landmark_moved", "landmark_misread"]
    dx: float
    dy: float

    @property
    def text(self) -> str:
        """For a person."""
        if self.code == "landmark_moved":
            far = 100 * math.hypot(self.dx, self.dy)
            return f"Landmark {self.landmark} has been moved by {far:.0f} cm."
        return f"Landmark {self.landmark} is read where another one stands."


def place_of(pose: Pose2D, measurement: RangeBearing, camera_forward: float) -> Point | None:
    """Where in `map` a landmark appears, seen from ``pose``; None without a range."""
    if not (math.isfinite(measurement.range) and math.isfinite(measurement.range_sigma)):
        return None
    x, y = pose.ahead(camera_forward)
    direction = pose.heading + measurement.bearing
    return (
        x + measurement.range * math.cos(direction),
        y + measurement.range * math.sin(direction),
    )


@dataclass(slots=True)
class LandmarkHealth:
    """Collects where landmarks appear that do not stand where the map has them."""

    landmarks: Mapping[int, Landmark]
    _places: dict[int, deque[tuple[float, Point, float]]] = field(default_factory=dict)
    _aside: dict[int, deque[tuple[float, Point, float]]] = field(default_factory=dict)
    _agreed: dict[int, int] = field(default_factory=dict)
    moved: dict[int, Point] = field(default_factory=dict)
    """Landmarks found displaced, and by how much; they are not to be used."""

    def contradicted(
        self, number: int, stamp: float, place: Point, sigma: float = 0.0, convict: bool = True
    ) -> Verdict | None:
        """``number`` appeared at ``place`` while other landmarks agreed with the pose.

        ``sigma``: how well that place is known, metres. ``convict``: False while it is only to be
        remembered, as the pose itself is not sure.
        """
        self._agreed.pop(number, None)
        if number in self.moved:
            return None
        places = self._places.setdefault(number, deque(maxlen=24))
        places.append((stamp, place, sigma))
        while stamp - places[0][0] > _MEMORY:
            places.popleft()
        if not convict or len(places) < _SIGHTINGS or stamp - places[0][0] < _SPAN:
            return None
        return self._verdict(number)

    def witnessed(
        self, witness: int, stamp: float = 0.0, shifts: Sequence[tuple[int, Point, float]] = ()
    ) -> list[Verdict]:
        """``witness`` stands where it should, seen after others that do not.

        The pose was right before they were seen (`contradicted` is told so) and is right after:
        a few sightings of them are enough. ``shifts``: what has been learnt since of how far some
        of them are displaced, and how well that is known.
        """
        since = {number: (shift, sigma) for number, shift, sigma in shifts}
        verdicts = []
        for number, places in list(self._places.items()):
            if number == witness or len(places) < _WITNESSED:
                continue
            known = min(sigma for _, _, sigma in places)
            learnt = since.get(number)
            if learnt is not None and learnt[1] >= known:
                learnt = None
            allowed = _KNOWN if stamp - places[-1][0] < _SETTLED or learnt is None else _VAGUER
            if (known if learnt is None else learnt[1]) <= allowed:
                verdicts.append(self._verdict(number, learnt))
        return [verdict for verdict in verdicts if verdict is not None]

    def _verdict(self, number: int, learnt: tuple[Point, float] | None = None) -> Verdict | None:
        """On what was collected, if that agrees on a new place; which is, if better, ``learnt``."""
        places = list(self._places[number])
        points = np.array([point for _, point, _ in places])
        sigmas = np.array([sigma for _, _, sigma in places])
        apart = np.hypot(*(points[:, None] - points[None]).transpose(2, 0, 1))
        allowed = np.maximum(_SCATTER, _SIGMAS * np.hypot(sigmas[:, None], sigmas[None]))
        near = apart <= allowed
        # Around the one with which most agree; of several, the surest.
        centre = int(np.lexsort((-sigmas, near.sum(axis=1)))[-1])
        if 2 * int(near[centre].sum()) <= len(places):
            return None
        mark = self.landmarks[number]
        if learnt is None:
            middle, sigma = _middle([places[index] for index in np.flatnonzero(near[centre])])
        else:
            ((dx, dy), sigma) = learnt
            middle = mark.x + dx, mark.y + dy
        dx, dy = middle[0] - mark.x, middle[1] - mark.y
        least = _SIGNIFICANT if learnt is None else _STRIKING
        if math.hypot(dx, dy) < max(_SHIFT, least * sigma):
            return None
        self._places.pop(number)
        if self.stands_another(number, middle):
            return Verdict(number, "landmark_misread", dx, dy)
        self.moved[number] = (dx, dy)
        return Verdict(number, "landmark_moved", dx, dy)

    def suspected(self, number: int, stamp: float) -> bool:
        """Whether ``number`` contradicted lately and has not been in its place since."""
        places = self._places.get(number)
        return places is not None and len(places) >= 2 and stamp - places[-1][0] < _SUSPICION

    def stands_another(self, number: int, place: Point) -> bool:
        """Whether the map has another landmark than ``number`` at ``place``."""
        return any(
            math.dist(place, other.position) < _FAMILY
            for other in self.landmarks.values()
            if other.id != number
        )

    def agreed(self, number: int) -> bool:
        """``number`` was seen where the map has it; True if that brings it back into use."""
        self._places.pop(number, None)
        if number not in self.moved:
            return False
        self._agreed[number] = self._agreed.get(number, 0) + 1
        if self._agreed[number] < _SIGHTINGS:
            return False
        del self.moved[number], self._agreed[number]
        return True

    def set_aside(self) -> None:
        """The pose itself seems wrong: then what contradicted it says nothing of the landmarks."""
        self._aside, self._places = self._places, {}

    def restore(self) -> None:
        """It was right."""
        self._places, self._aside = self._aside, {}


def _middle(places: Sequence[tuple[float, Point, float]]) -> tuple[Point, float]:
    """Where a landmark stands and how well that is known, by its sightings.

    Sightings in a row share the pose's error, which grows: only the surest of each row count.
    """
    x = y = weight = 0.0
    row: list[tuple[float, Point, float]] = []
    for one, after in zip(places, [*places[1:], None], strict=True):
        row.append(one)
        if after is not None and after[0] - one[0] < _PAUSE:
            continue
        best = max(min(sigma for _, _, sigma in row), _SUREST)
        chosen = [point for _, point, sigma in row if sigma <= _SIMILAR * best]
        share = 1.0 / best**2
        x += share * sum(point[0] for point in chosen) / len(chosen)
        y += share * sum(point[1] for point in chosen) / len(chosen)
        weight += share
        row.clear()
    return (x / weight, y / weight), 1.0 / math.sqrt(weight)
