"""Where a landmark stands that is not in its place: the filter, supposing that nobody knows.

A sighting tells that no better than the pose is known at that moment: badly where nothing was seen
for long, or soon after the start. Sightings of other landmarks tell later how wrong that pose was.
So a copy of the filter goes along with the pose, for which the landmark's place is unknown: what it
learns of pose, steering and speed moves the place that it has found as well.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from polepilot.core.geometry import Point
from polepilot.core.landmark import Landmark
from polepilot.core.localization.fix import Fix
from polepilot.core.localization.odometry import Following, OdometryHistory
from polepilot.core.observation import RangeBearing

if TYPE_CHECKING:
    from polepilot.core.localization.track import Filter, Sighting

_MOST = 2
"""So many landmarks are followed at once."""
_LONGEST = 8.0
"""Seconds without any sighting after which a copy is given up: the odometry ends somewhere."""
_REFUSED = 4
"""So many sightings in a row that do not fit to the place found: it was none."""


@dataclass(slots=True)
class _Copy:
    filter: Filter
    stamp: float
    refused: int = 0


@dataclass(slots=True)
class Supposed:
    """Such copies, by landmark; bounded in memory."""

    _copies: dict[int, _Copy] = field(default_factory=dict)

    def __bool__(self) -> bool:
        return bool(self._copies)

    def begin(self, filtered: Filter, stamp: float, landmark: Landmark, place: Point) -> None:
        """``landmark`` appears at ``place``, which is not where it should be."""
        if landmark.id in self._copies or len(self._copies) >= _MOST:
            return
        copy = filtered.supposing(landmark, place)
        if copy is not None:
            self._copies[landmark.id] = _Copy(copy, stamp)

    def start(
        self,
        before: Filter,
        found: Fix,
        stamp: float,
        agreeing: Sequence[Sighting],
        outsiders: Sequence[tuple[Sighting, Point, float]],
        history: OdometryHistory,
    ) -> list[tuple[RangeBearing, Point, float]]:
        """A pose was found at ``stamp``; landmarks that had no part in it are followed from there.

        Args:
            before: the filter without that pose.
            found: the pose.
            stamp: its moment.
            agreeing: the sightings behind it.
            outsiders: those of other landmarks, where they put them in `map`, and how well dead
                reckoning alone knows that, metres.
            history: how the robot moved between them.

        Returns:
            the same, as the filter has it: it carries sightings along with all that it has learnt
            of speed and steering, and the landmarks that came after them tell how the robot drove.
        """
        places = {sighting[1]: place for sighting, place, _ in outsiders}
        learnt: dict[int, tuple[Point, float]] = {}
        for mark, place in places.items():
            copy = before.supposing(mark, place)
            if copy is None:
                continue
            seen = [sighting for sighting, *_ in outsiders if sighting[1] is mark]
            both = sorted([*agreeing, *seen], key=lambda one: one[0].stamp)
            refused = copy.begin(found, stamp, both, history)
            shift = copy.shift_of(mark.id)
            # One that is here and there has no place.
            if shift is not None and 2 * sum(m.landmark == mark.id for m in refused) <= len(seen):
                self._copies[mark.id] = _Copy(copy, stamp)
                (dx, dy), sigma = shift
                learnt[mark.id] = (mark.x + dx, mark.y + dy), sigma
        return [
            (sighting, *learnt.get(sighting.landmark, (place, sigma)))
            for (sighting, _), place, sigma in outsiders
        ]

    def keep(self, numbers: Collection[int]) -> None:
        """Follow only these, and no more at once than is affordable."""
        kept = [number for number in self._copies if number in numbers][:_MOST]
        self._copies = {number: self._copies[number] for number in kept}

    def follow(
        self,
        history: OdometryHistory,
        stamp: float,
        agreeing: Sequence[Sighting],
        against: Sequence[Sighting],
        tolerance: float,
    ) -> None:
        """A picture of ``stamp``: what agrees with the pose, and what does not."""
        for number, copy in list(self._copies.items()):
            if stamp - copy.stamp > _LONGEST:
                del self._copies[number]
                continue
            copy.filter.predict(history.steps(copy.stamp, stamp))
            copy.stamp = stamp
            for sighting in agreeing:
                copy.filter.take(*sighting, tolerance)
            for sighting in against:
                if sighting[1].id == number:
                    taken, _ = copy.filter.take(*sighting, tolerance)
                    copy.refused = 0 if taken else copy.refused + 1
            if copy.refused >= _REFUSED:
                del self._copies[number]

    def places(self) -> list[tuple[int, Point, float]]:
        """The landmarks followed, by how much they are displaced, and how well that is known."""
        found = []
        for number, copy in self._copies.items():
            shift = copy.filter.shift_of(number)
            if shift is not None:
                found.append((number, *shift))
        return found

    def end(self, number: int) -> None:
        """It is known, or it was nothing."""
        self._copies.pop(number, None)

    def retuned(self, by: Following) -> None:
        """As the filter's."""
        for copy in self._copies.values():
            copy.filter.retuned(by)
