"""Landmarks that should be seen and are not: hidden, or the robot is not where it seems."""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping
from dataclasses import dataclass, field
from operator import add

import numpy as np

from polepilot.core.geometry import Pose2D
from polepilot.core.landmark import Landmark

_MARGIN = math.radians(4.0)
"""So far inside the picture a landmark must be expected to be looked for."""
_NEARER = 1.03
"""Nearer than this times the least depth at which a landmark was seen, none is expected."""
_FARTHER = 1.0
"""Farther than this times the distance from which it was seen, a landmark is not expected."""
_ASIDE = 0.12
"""Metres: a landmark that stands so near the line of sight to another one may hide it."""
_PLACE = 0.05
"""Metres: within so much the view is the same, whatever stands in the way."""
_SURE = 3
"""Sightings from one place after which a landmark is sure to be seen from there."""
_HIDDEN_SIGHTINGS = 11.0
"""Sightings that a landmark owes before it is hidden: by how often those are read that stand as
far away, which decides at the end of what the camera can resolve."""
_ALIKE = 20
"""More looks in vain than this, between two sightings, say nothing more: the robot stands."""
_RING, _RINGS = math.log(1.25), 16
"""Distances are told apart by this, logarithm of metres, from a metre on."""
_HIDDEN_SPAN = 8.0
"""Seconds: more than one pass of the camera."""


@dataclass(slots=True)
class _Record:
    """How one landmark was looked for."""

    place: tuple[float, float] = (math.inf, math.inf)
    """From where it was seen last."""
    hits: int = 0
    """Sightings from there."""
    overlooked: int = 0
    """Looks in vain from there, between sightings."""
    missed: int = 0
    """Looks in vain since the last sighting."""
    first_missed: float = 0.0
    owed: float = 0.0
    """Sightings that were to be expected since then."""
    vain: list[int] = field(default_factory=lambda: [0] * _RINGS)
    """Looks in vain since the last sighting, by distance."""
    ever: int = 0
    farthest: float = 0.0
    """Metres from which it was seen."""
    hidden: bool = False


class Presence:
    """Compares what is seen with what should be; bounded in memory."""

    def __init__(
        self, landmarks: Mapping[int, Landmark], camera_forward: float, half_view: float
    ) -> None:
        """``half_view``: half of the camera's horizontal angle of view, radians."""
        self._ids = list(landmarks)
        self._points = np.array([mark.position for mark in landmarks.values()]).reshape(-1, 2)
        self._forward = camera_forward
        self._inside = half_view - _MARGIN
        self._records = {number: _Record() for number in landmarks}
        self._nearest = math.inf
        self._read, self._overlooked = [0] * _RINGS, [0] * _RINGS
        """By distance, how often any landmark was read, and how often not that was seen later."""

    def forget(self) -> None:
        """The pose was wrong: so is what was expected from it."""
        for record in self._records.values():
            record.place, record.missed, record.owed = (math.inf, math.inf), 0, 0.0
            record.vain = [0] * _RINGS

    def expected(self, pose: Pose2D, pan: float) -> list[int]:
        """Landmarks that stand well inside the picture, as near as they were seen before.

        None of them stands behind another one.
        """
        in_view = self._in_view(pose, pan)
        return [n for n, distance in in_view if distance < _FARTHER * self._records[n].farthest]

    def _in_view(self, pose: Pose2D, pan: float) -> list[tuple[int, float]]:
        """Landmarks well inside the picture that no other one hides, and their distances (m)."""
        x, y = pose.ahead(self._forward)
        offsets = self._points - (x, y)
        direction = pose.heading + pan
        cos, sin = math.cos(direction), math.sin(direction)
        depth = offsets @ (cos, sin)
        aside = offsets @ (-sin, cos)
        inside = np.abs(aside) < math.tan(self._inside) * depth
        # How much of a pole fits into the picture depends on its depth.
        inside &= depth > _NEARER * self._nearest
        found = []
        for index in np.flatnonzero(inside).tolist():
            number = self._ids[index]
            distance = math.hypot(depth[index], aside[index])
            sight = offsets[index] / distance
            along = offsets @ sight
            before = (along > 0.0) & (along < distance - _ASIDE)
            across = np.abs(offsets[:, 0] * sight[1] - offsets[:, 1] * sight[0])
            if not (before & (across < _ASIDE)).any():
                found.append((number, distance))
        return found

    def _likely(self, ring: int) -> float:
        """How likely a landmark at that distance is read in a picture, by all of them."""
        # Laplace's rule of succession.
        return (self._read[ring] + 1) / (self._read[ring] + self._overlooked[ring] + 2)

    def saw(self, number: int, distance: float, off_axis: float, pose: Pose2D) -> bool:
        """``number`` was seen where it should be; True if it was thought hidden.

        Args:
            distance: metres.
            off_axis: bearing in the picture, radians.
        """
        self._nearest = min(self._nearest, distance * math.cos(off_axis))
        record = self._records[number]
        record.farthest = max(record.farthest, distance)
        if math.dist(record.place, pose.position) > _PLACE:
            record.place, record.hits, record.overlooked = pose.position, 0, 0
        else:
            record.overlooked += record.missed
        record.hits += 1
        record.ever += 1
        record.missed, record.owed = 0, 0.0
        if not record.hidden:
            self._overlooked = list(map(add, self._overlooked, record.vain))
        record.vain = [0] * _RINGS
        self._read[_ring(distance)] += 1
        was, record.hidden = record.hidden, False
        return was

    def look(
        self, stamp: float, pose: Pose2D, pan: float, seen: Collection[int]
    ) -> tuple[list[int], float, list[int]]:
        """A picture was taken.

        Returns:
            landmarks that were seen from here before and are missing in this picture; how likely
            it is that they were overlooked in it and the ones before; and landmarks that have not
            been seen for so long that something must hide them, once each.
        """
        missing: list[int] = []
        hidden: list[int] = []
        chance = 1.0
        for number, distance in self._in_view(pose, pan):
            if number in seen:
                continue
            record, ring = self._records[number], _ring(distance)
            record.vain[ring] = min(record.vain[ring] + 1, _ALIKE)
            if distance >= _FARTHER * record.farthest:
                continue
            if record.missed == 0:
                record.first_missed = stamp
            record.missed += 1
            record.owed += self._likely(ring)
            near = math.dist(record.place, pose.position) <= _PLACE
            if near and record.hits >= _SURE:
                # Laplace's rule of succession.
                missing.append(number)
                share = (record.overlooked + 1) / (record.overlooked + record.hits + 2)
                chance *= share**record.missed
            elif (
                record.owed >= _HIDDEN_SIGHTINGS
                and stamp - record.first_missed > _HIDDEN_SPAN
                and record.ever >= _SURE
                and not record.hidden
            ):
                record.hidden = True
                hidden.append(number)
        return missing, chance, hidden


def _ring(distance: float) -> int:
    """Which of the distances told apart ``distance`` (m) is."""
    return min(int(math.log(max(distance, 1.0)) / _RING), _RINGS - 1)
