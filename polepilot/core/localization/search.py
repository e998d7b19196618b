"""Looking for the first pose: sightings of the last seconds, carried along while the robot moves.

A standing robot collects landmarks during a sweep; a moving one refers each sighting, through dead
reckoning, to the newest moment, and trusts it the less the farther it has driven since.
"""

from __future__ import annotations

import math
from collections import Counter, deque
from collections.abc import Collection, Iterable, Iterator, Mapping
from dataclasses import dataclass, field, replace

from polepilot.core.geometry import Point, Pose2D
from polepilot.core.landmark import Landmark
from polepilot.core.localization.fix import Fix, FixRefusal, FixSettings, fix
from polepilot.core.localization.odometry import OdometryHistory
from polepilot.core.observation import RangeBearing

_PER_LANDMARK = 6
"""Sightings of one landmark that take part in a fix, the newest."""
_NOTHING = FixRefusal("No landmark of the map has been seen.", "none")
_SHARES = (1.0, 0.5, 0.25, 0.125)
"""Parts of the window that are tried one after the other, the newest."""
_LONGEST_WAY = 1.5
"""Metres driven after which a sighting says nothing of the present pose any more."""


@dataclass(slots=True)
class FixSearch:
    """Finds a Fix among the sightings of the last ``window`` seconds; bounded in memory."""

    landmarks: Mapping[int, Landmark]
    history: OdometryHistory
    camera_forward: float
    settings: FixSettings
    window: float = 8.0
    confirmations: int = 2
    scale: float = 1.0
    """What is known of the speed's error, as a factor."""
    offset: float = 0.0
    """What is known of the steering's error, radians."""
    _sightings: deque[RangeBearing] = field(default_factory=lambda: deque(maxlen=400))
    refusal: FixRefusal = _NOTHING
    """Why the last attempt gave nothing."""

    used: tuple[RangeBearing, ...] = ()
    """The sightings behind the last fix, as they were measured, oldest first."""

    def clear(self) -> None:
        self._sightings.clear()
        self.refusal = _NOTHING

    def refuse(self, reason: str) -> None:
        """Whoever asked does not believe the fix found, for this reason."""
        self.refusal = FixRefusal(reason, "contradiction")

    def add(self, measurement: RangeBearing) -> None:
        """Keep a sighting of a landmark of the map that carries a range."""
        if math.isfinite(measurement.range) and math.isfinite(measurement.range_sigma):
            self._sightings.append(measurement)

    def of(self, numbers: Collection[int]) -> list[RangeBearing]:
        """All sightings of these landmarks that are kept, whether a fix has used them or not."""
        return [sighting for sighting in self._sightings if sighting.landmark in numbers]

    def confirmed(self, sightings: Iterable[RangeBearing]) -> bool:
        """Whether two landmarks at least were seen as often as one has to be to count."""
        counts = Counter(sighting.landmark for sighting in sightings)
        return sum(count >= self.confirmations for count in counts.values()) >= 2

    def attempts(self, stamp: float) -> Iterator[Fix]:
        """Confirmed poses at ``stamp``, each with the sightings behind it in ``used``.

        The first is from all sightings of the window. Whoever does not believe it may ask for the
        next one, from the newest sightings alone: a robot that was pushed or carried has older
        ones from another place. Without any the reason is in ``refusal``.
        """
        while self._sightings and self._sightings[0].stamp < stamp - self.window:
            self._sightings.popleft()
        seen, refusal = -1, self.refusal
        for share in _SHARES:
            chosen = self._chosen(stamp, stamp - share * self.window)
            if len(chosen) == seen:
                continue
            seen = len(chosen)
            found = self._attempt(stamp, chosen)
            if found is not None:
                yield found
            if share == 1.0:
                refusal = self.refusal
        self.refusal = refusal

    def _chosen(self, stamp: float, since: float) -> list[RangeBearing]:
        """The newest sightings of each landmark, oldest first."""
        chosen: list[RangeBearing] = []
        counts: dict[int, int] = {}
        for sighting in reversed(self._sightings):
            if sighting.stamp < since:
                break
            count = counts.get(sighting.landmark, 0)
            if sighting.stamp <= stamp and count < _PER_LANDMARK:
                counts[sighting.landmark] = count + 1
                chosen.append(sighting)
        chosen.sort(key=lambda sighting: sighting.stamp)
        return chosen

    def _attempt(self, stamp: float, chosen: list[RangeBearing]) -> Fix | None:
        if not self.confirmed(chosen):
            counts = Counter(sighting.landmark for sighting in chosen)
            if len(counts) == 1:
                number = next(iter(counts))
                reason = f"Only landmark {number} has been seen: a fix needs two."
                self.refusal = FixRefusal(reason, "one_landmark", (number,))
            elif counts:
                reason = "The landmarks seen so far wait for a second sighting."
                self.refusal = FixRefusal(reason, "one_landmark", tuple(sorted(counts)))
            return None
        kept, mounts = self._carried(chosen, stamp)
        answer = fix(kept, self.landmarks, self.camera_forward, self.settings, mounts)
        if isinstance(answer, FixRefusal):
            self.refusal = answer
            return None
        sightings = [sum(m.landmark == number for m in kept) for number in answer.landmarks]
        few = sorted(sightings)[-2] < self.confirmations
        if len(answer.outliers) >= len(answer.landmarks) or few:
            self.refusal = FixRefusal(
                "The landmarks seen so far contradict each other or wait for another sighting.",
                "contradiction",
                answer.outliers,
            )
            return None
        self.used = tuple(m for m in chosen if m.landmark in answer.landmarks)
        return answer

    def appearing(
        self, found: Fix, stamp: float, but: Collection[int]
    ) -> list[tuple[RangeBearing, Point, float]]:
        """Where the window's landmarks appear by a fix, those of ``but`` left out.

        The sighting, where in `map`, and how well that is known, metres; oldest first.
        """
        chosen = self._chosen(stamp, stamp - self.window)
        kept, mounts = self._carried(chosen, stamp)
        rows = []
        for seen, m, mount in zip(chosen[len(chosen) - len(kept) :], kept, mounts, strict=True):
            if m.landmark not in but:
                ahead = m.range * math.cos(m.bearing), m.range * math.sin(m.bearing)
                place = found.pose.to_parent(mount.to_parent(ahead))
                sigma = math.hypot(m.range_sigma, m.range * m.bearing_sigma)
                rows.append((seen, place, sigma))
        return rows

    def _carried(
        self, chosen: list[RangeBearing], stamp: float
    ) -> tuple[list[RangeBearing], list[Pose2D]]:
        """Sightings with honest errors, and where the camera was, seen from now; oldest first."""
        camera = Pose2D(self.camera_forward, 0.0, 0.0)
        kept: list[RangeBearing] = []
        mounts: list[Pose2D] = []
        then, way, later = Pose2D(0.0, 0.0, 0.0), 0.0, stamp
        for sighting in reversed(chosen):
            if sighting.stamp < later:
                driven, piece = self.history.driven(sighting.stamp, later, self.scale, self.offset)
                if piece:
                    then, way = then.compose(driven.inverse()), way + piece
                later = sighting.stamp
            if way > _LONGEST_WAY:
                break
            kept.append(_vaguer(sighting, way) if way else sighting)
            mounts.append(then.compose(camera))
        return kept[::-1], mounts[::-1]


def _vaguer(sighting: RangeBearing, way: float) -> RangeBearing:
    """The sighting with the errors of dead reckoning over ``way`` metres since."""
    turned = 0.03 * way + 0.01 * math.sqrt(way)
    shifted = 0.04 * way + turned * way
    return replace(
        sighting,
        range_sigma=math.hypot(sighting.range_sigma, shifted),
        bearing_sigma=math.hypot(
            sighting.bearing_sigma, turned + shifted / max(sighting.range, 0.5)
        ),
    )
