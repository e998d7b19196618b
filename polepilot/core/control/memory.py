"""What the proximity sensors have seen that the site does not explain, kept for a while."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from polepilot.core.geometry import Point, Pose2D
from polepilot.core.scenery import Disc, Scenery
from polepilot.core.vehicle import Proximity

Readings = tuple[float | None, float | None, float | None]

RADIUS = 0.25
"""An obstacle is taken for a standing person: a disc of this radius behind the reading."""
HALF_BEAM = math.radians(7.5)
TOLERANCE = 0.12
"""A reading is explained by the site if it is no shorter than expected by more than this."""
FORGET = 10.0
"""Seconds after the last reading."""
FORGET_NEAR = 40.0
"""The same while the robot is near: what stands beside or behind it is in no sensor's view."""
NEAR = 2.0
"""Metres."""
CONFIRM = 3
"""Readings before an obstacle counts."""
MOST_PUSHED = 0.30
"""Who would have to stand farther than this from where it was read last, metres, stands there no
more."""
MISSES = 4
"""Free looks in a row at where it should be, after which it is gone."""
_SAME = 0.80
_RANGE_SIGMA = 0.05
_TOUCH_SIGMA = 0.08
_WANDER = 0.02
"""Growth of the variance of a position, m²/s: people move."""
_LARGEST_VARIANCE = 0.09


@dataclass(slots=True)
class Remembered:
    """One obstacle: where its centre is believed to be, and how sure that is."""

    center: NDArray[np.float64]
    covariance: NDArray[np.float64]
    seen: float
    """When it was last read."""
    hits: int = 1
    misses: int = 0
    pushed: float = 0.0
    """So far has it been moved out of free beams since it was read last, metres."""
    predicted: float = field(default=0.0)

    @property
    def position(self) -> Point:
        return (float(self.center[0]), float(self.center[1]))

    @property
    def confirmed(self) -> bool:
        return self.hits >= CONFIRM

    @property
    def disc(self) -> Disc:
        """What to keep clear of: wider by half a sigma while its place is uncertain."""
        sigma = math.sqrt(float(np.linalg.eigvalsh(self.covariance)[-1]))
        return (self.position, RADIUS + min(0.5 * sigma, 0.10))

    @property
    def body(self) -> Disc:
        """Where it stands at best knowledge."""
        return (self.position, RADIUS)


class ObstacleMemory:
    """Positions of unexplained things, filtered from ranges of three wide beams.

    A beam says how far away the nearest thing is, but hardly in which direction; several looks
    from a moving robot do. Each obstacle is a small Kalman filter over its centre: a range
    corrects the distance, a free beam pushes the obstacle out of that beam.
    """

    def __init__(self, proximity: Proximity, scenery: Scenery) -> None:
        self._proximity = proximity
        self._scenery = scenery
        self._known: list[Remembered] = []

    @property
    def obstacles(self) -> list[Remembered]:
        """Those that were read often enough to count."""
        return [one for one in self._known if one.confirmed]

    def forget(self) -> None:
        self._known.clear()

    def observe(
        self,
        now: float,
        base: Pose2D,
        readings: Readings,
        position_sigma: float,
        heading_sigma: float,
    ) -> None:
        """Take in one set of readings.

        Args:
            base: estimated pose of `base_link`, with its two sigmas.
            readings: metres from each sensor (left, centre, right); None where there is none.
                The greatest range means that nothing is in sight.
        """
        for one in self._known:
            elapsed = max(now - one.predicted, 0.0)
            one.predicted = now
            one.covariance = one.covariance + np.eye(2) * _WANDER * min(elapsed, 1.0)
            largest = float(np.trace(one.covariance)) / 2
            if largest > _LARGEST_VARIANCE:
                one.covariance = one.covariance * (_LARGEST_VARIANCE / largest)
        walls = self._scenery.near(base.position, self._proximity.max_range + 0.5)
        for angle, reading in zip(self._proximity.angles, readings, strict=True):
            if reading is None:
                continue
            sensor = base.compose(Pose2D(self._proximity.forward, 0.0, angle))
            free = reading >= self._proximity.max_range - 0.03
            if not free and not self._explained(
                walls, sensor, reading, position_sigma, heading_sigma
            ):
                self._hit(now, sensor, reading)
            self._look_through(sensor, reading)
        self._known = [one for one in self._known if _kept(one, now, base)]

    def _explained(
        self, walls: Scenery, sensor: Pose2D, reading: float, position: float, heading: float
    ) -> bool:
        """Whether the site has something in that direction that is near enough."""
        half = HALF_BEAM + math.radians(2) + 2 * min(heading, 0.1)
        half += math.atan2(2 * min(position, 0.1), max(reading, 0.2))
        expected = walls.in_beam(sensor, half, self._proximity.max_range + 0.5)
        tolerance = TOLERANCE + 2 * position + 0.03 * reading
        return expected is not None and reading > expected - tolerance

    def _hit(self, now: float, sensor: Pose2D, reading: float) -> None:
        away = reading + RADIUS
        seen = np.array(sensor.ahead(away))
        along = np.array([math.cos(sensor.heading), math.sin(sensor.heading)])
        across = np.array([-along[1], along[0]])
        # It may touch the beam with its side only: as wide as beam and body together.
        wide = (away * math.tan(HALF_BEAM) + RADIUS) / math.sqrt(3)
        noise = np.outer(along, along) * _RANGE_SIGMA**2 + np.outer(across, across) * wide**2
        near = [one for one in self._known if _may_be(one, seen, noise)]
        if not near:
            self._known.append(Remembered(seen, noise, now, predicted=now))
            return
        one = min(near, key=lambda one: math.dist(one.position, seen))
        if Scenery([], [one.body]).in_beam(sensor, HALF_BEAM, 99.0) is not None:
            # It is where the beam can see it: the range is to its nearest point.
            offset = one.center - np.array(sensor.position)
            distance = float(np.hypot(*offset))
            unit = offset / max(distance, 1e-6)
            spread = one.covariance @ unit
            gain = spread / (float(unit @ spread) + _RANGE_SIGMA**2)
            one.center = one.center + gain * (away - distance)
            one.covariance = one.covariance - np.outer(gain, spread)
        else:
            # It stands beside the beam, so it seems: then only its side can be what was seen.
            turn = HALF_BEAM + 0.7 * math.asin(min(RADIUS / away, 1.0))
            turn = math.copysign(turn, sensor.bearing_to(one.position))
            touching = np.array(sensor.compose(Pose2D(0.0, 0.0, turn)).ahead(away))
            noise = np.eye(2) * _TOUCH_SIGMA**2
            gains = one.covariance @ np.linalg.inv(one.covariance + noise)
            one.center = one.center + gains @ (touching - one.center)
            one.covariance = one.covariance - gains @ one.covariance
        one.seen, one.hits, one.misses, one.pushed = now, one.hits + 1, 0, 0.0

    def _look_through(self, sensor: Pose2D, reading: float) -> None:
        """What a beam looks past cannot stand in it: push it aside, or take it for gone."""
        for one in self._known:
            expected = Scenery([], [one.body]).in_beam(sensor, HALF_BEAM, reading - 0.15)
            if expected is None:
                continue
            x, y = sensor.to_local(one.position)
            side = 1.0 if y >= 0 else -1.0
            # The edge of the beam is to be a tangent of the disc.
            missing = RADIUS - (abs(y) * math.cos(HALF_BEAM) - x * math.sin(HALF_BEAM))
            # Pushed on and on by a beam it would be before it for ever, and never gone.
            if missing + one.pushed > MOST_PUSHED or not one.confirmed:
                one.misses += 1
            else:
                shift = min(max(missing, 0.0), 0.05)
                one.pushed += shift
                heading = sensor.heading + side * (math.pi / 2 + HALF_BEAM)
                one.center = one.center + shift * np.array([math.cos(heading), math.sin(heading)])


def _kept(one: Remembered, now: float, base: Pose2D) -> bool:
    longest = FORGET_NEAR if base.distance_to(one.position) < NEAR else FORGET
    return now - one.seen <= longest and one.misses < MISSES


def _may_be(one: Remembered, seen: NDArray[np.float64], noise: NDArray[np.float64]) -> bool:
    """Whether a reading may come from an obstacle that is known: within three sigmas of it."""
    offset = seen - one.center
    if float(np.hypot(*offset)) > _SAME:
        return False
    return bool(offset @ np.linalg.solve(one.covariance + noise, offset) < 9.0)
