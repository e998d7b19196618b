"""A first map of poles of which nothing is known, good enough for least squares to start from.

A Kalman filter drives along with the recording; its state holds the pose, the errors of speed and
steering, and every pole that was seen at the same place often enough. Where what is seen
contradicts it for long (the robot was lifted, say) or the recording has a gap, it starts a new
map; maps with two poles or more in common are laid over each other in the end.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from polepilot.core.geometry import Point, Pose2D, wrap_angle
from polepilot.core.localization.odometry import advance_with_jacobians
from polepilot.core.localization.survey_align import overlay
from polepilot.core.localization.survey_run import SurveyRun
from polepilot.core.observation import RangeBearing

Array = NDArray[np.float64]

_SPEED_PRIOR, _STEERING_PRIOR = 0.1, math.radians(2.5)
_SPEED_NOISE, _STEERING_NOISE, _SKID = 0.06, math.radians(0.6), 0.008
_BEARING_SIGMA, _RANGE_SIGMA, _RANGE_SHARE = math.radians(0.7), 0.01, 0.005
"""A potentiometer that is not straight, and what else is not modelled here."""
_GATE = 25.0
_LOST_AFTER = 8
"""Sightings in a row that contradict the map, of two poles at least: the robot was moved."""
_CONFIRMATIONS = 3
"""So many sightings have to agree before a pole is put on the map."""
_MEMORY = 8
_AGREE, _AGREE_SHARE = 0.15, 0.04
"""How near to each other they have to be: metres, and share of the range."""
_MERGE, _MERGE_SHARE = 0.25, 0.03
_POSE = 5


@dataclass(slots=True)
class Piece:
    """A map in a frame of its own, from a stretch of the drive."""

    poses: dict[int, Pose2D] = field(default_factory=dict)
    """Per picture, by its index."""
    poles: dict[int, Point] = field(default_factory=dict)
    taken: int = 0
    """Sightings that it agrees with."""


@dataclass(frozen=True, slots=True)
class FirstMap:
    """Where everything is, roughly, in the frame of the first picture that counts."""

    poses: dict[int, Pose2D]
    poles: dict[int, Point]
    cuts: frozenset[int]
    """Pictures before which the robot was moved by other means than its wheels."""
    apart: dict[int, str]
    """Poles that could not be brought onto the map, with the reason."""


def first_map(run: SurveyRun, progress: Callable[[float], None] | None = None) -> FirstMap:
    """Drive through the recording and put all its pieces together."""
    pieces: list[Piece] = []
    cuts: set[int] = set()
    index = 0
    while index < len(run.pictures):
        piece, following = _drive(run, index, progress)
        pieces.append(piece)
        if following < len(run.pictures):
            cuts.add(following)
        index = following
    main = max(pieces, key=lambda piece: (len(piece.poles), piece.taken))
    rest = [piece for piece in pieces if piece is not main and piece.poles]
    while joined := next((piece for piece in rest if _join(main, piece)), None):
        rest.remove(joined)
    apart = {
        number: "was seen only where nothing joins the recording to the rest: no two poles in "
        "common across a gap, or after the robot had been moved"
        for piece in rest
        for number in piece.poles
        if number not in main.poles
    }
    return FirstMap(main.poses, main.poles, frozenset(cuts), apart)


def _join(main: Piece, piece: Piece) -> bool:
    """Bring ``piece`` onto ``main`` if two poles or more say how."""
    reach = {
        number: _MERGE + _MERGE_SHARE * max(math.hypot(*piece.poles[number]), 1.0)
        for number in piece.poles
    }
    laid = overlay(piece.poles, main.poles, reach)
    if laid is None or not laid.clear:
        return False
    main.poses |= {index: laid.pose.compose(pose) for index, pose in piece.poses.items()}
    for number, place in piece.poles.items():
        main.poles.setdefault(number, laid.pose.to_parent(place))
    main.taken += piece.taken
    return True


def _drive(
    run: SurveyRun, begin: int, progress: Callable[[float], None] | None
) -> tuple[Piece, int]:
    """Map from picture ``begin`` on; returns the picture where another map has to begin."""
    mapper = _Mapper(run)
    piece = Piece()
    rejected: list[tuple[int, int]] = []
    now = run.pictures[begin][0]
    for index in range(begin, len(run.pictures)):
        stamp, seen = run.pictures[index]
        if index > begin and run.broken(now, stamp):
            break
        mapper.advance(now, stamp)
        now = stamp
        for sighting in seen:
            verdict = mapper.take(sighting)
            if verdict is None:
                continue
            if verdict:
                rejected = []
                piece.taken += 1
                continue
            rejected.append((index, sighting.landmark))
        if len(rejected) >= _LOST_AFTER and len({number for _, number in rejected}) > 1:
            index = rejected[0][0]
            for wrong in range(index, len(run.pictures)):
                piece.poses.pop(wrong, None)
            piece.poles = mapper.poles()
            return piece, max(index, begin + 1)
        piece.poses[index] = mapper.pose
        if progress is not None and index % 50 == 0:
            progress(index / len(run.pictures))
    else:
        index = len(run.pictures)
    piece.poles = mapper.poles()
    return piece, index


class _Mapper:
    """The filter: x, y, heading, speed and steering errors, and two numbers per pole."""

    def __init__(self, run: SurveyRun) -> None:
        self._run = run
        self._state = np.zeros(_POSE)
        self._covariance = np.diag([1e-12, 1e-12, 1e-12, _SPEED_PRIOR**2, _STEERING_PRIOR**2])
        self._slot: dict[int, int] = {}
        self._waiting: dict[int, deque[Point]] = {}

    @property
    def pose(self) -> Pose2D:
        x, y, heading = (float(v) for v in self._state[:3])
        return Pose2D(x, y, wrap_angle(heading))

    def poles(self) -> dict[int, Point]:
        return {
            number: (float(self._state[slot]), float(self._state[slot + 1]))
            for number, slot in self._slot.items()
        }

    def advance(self, start: float, end: float) -> None:
        """Along the odometry from ``start`` to ``end``."""
        state, p = self._state, self._covariance
        for step in self._run.history.steps(start, end):
            if step.speed == 0.0:
                continue
            pose, jacobian = advance_with_jacobians(
                Pose2D(state[0], state[1], state[2]),
                step.speed * (1.0 + state[3]),
                step.steering + state[4],
                step.dt,
                self._run.wheelbase,
            )
            state[:3] = pose
            jacobian[:, 3] *= step.speed
            moved = jacobian @ p[:_POSE]
            block = moved[:, :_POSE] @ jacobian.T
            speed, steering = jacobian[:, 3], jacobian[:, 4]
            block += np.outer(speed, speed) * _SPEED_NOISE**2 / step.dt
            block += np.outer(steering, steering) * (
                _STEERING_NOISE**2 / step.dt + (0.3 * step.unsettled) ** 2
            )
            block[:2, :2] += np.eye(2) * _SKID**2 * abs(step.speed) * step.dt
            p[:3] = moved
            p[:, :3] = moved.T
            p[:3, :3] = block

    def take(self, sighting: RangeBearing) -> bool | None:
        """Whether it agrees with the map; None where the pole is not on the map yet."""
        if sighting.landmark not in self._slot:
            self._consider(sighting)
            return None
        slot = self._slot[sighting.landmark]
        gap, jacobian, noise = self._compare(sighting, slot)
        cross = self._covariance @ jacobian.T
        spread = np.linalg.inv(jacobian @ cross + noise)
        if float(gap @ spread @ gap) > _GATE:
            return False
        gain = cross @ spread
        self._state += gain @ gap
        self._state[2] = wrap_angle(float(self._state[2]))
        p = self._covariance - gain @ cross.T
        self._covariance = 0.5 * (p + p.T)
        return True

    def _compare(self, sighting: RangeBearing, slot: int) -> tuple[Array, Array, Array]:
        state = self._state
        arm = self._run.camera_forward * np.array([math.cos(state[2]), math.sin(state[2])])
        away = state[slot : slot + 2] - state[:2] - arm
        distance = max(float(np.hypot(*away)), 1e-3)
        ux, uy = away / distance
        jacobian = np.zeros((2, len(state)))
        jacobian[0, :2] = -ux, -uy
        jacobian[0, 2] = ux * arm[1] - uy * arm[0]
        jacobian[1, :2] = uy / distance, -ux / distance
        jacobian[1, 2] = -(uy * arm[1] + ux * arm[0]) / distance - 1.0
        jacobian[:, slot : slot + 2] = -jacobian[:, :2]
        bearing = wrap_angle(sighting.bearing - math.atan2(uy, ux) + float(state[2]))
        gap = np.array([sighting.range - distance, bearing])
        noise = _noise(sighting)
        if not math.isfinite(sighting.range):
            gap[0], noise[0, 0] = 0.0, 1e6
        return gap, jacobian, noise

    def _consider(self, sighting: RangeBearing) -> None:
        """Put a pole on the map when it was seen at one place often enough."""
        if not math.isfinite(sighting.range):
            return
        place = project(self.pose, self._run.camera_forward, sighting)
        waiting = self._waiting.setdefault(sighting.landmark, deque(maxlen=_MEMORY))
        waiting.append(place)
        reach = max(_AGREE, _AGREE_SHARE * sighting.range)
        if sum(math.dist(place, other) <= reach for other in waiting) < _CONFIRMATIONS:
            return
        del self._waiting[sighting.landmark]
        slot, size = len(self._state), len(self._state) + 2
        self._slot[sighting.landmark] = slot
        self._state = np.concatenate([self._state, place])
        # As if it had been known to nobody: a wide prior, then the sighting.
        covariance = np.zeros((size, size))
        covariance[:slot, :slot] = self._covariance
        _, jacobian, noise = self._compare(sighting, slot)
        of_pole = np.linalg.inv(jacobian[:, slot:])
        of_pose = -of_pole @ jacobian[:, :slot]
        cross = of_pose @ self._covariance
        covariance[slot:, :slot] = cross
        covariance[:slot, slot:] = cross.T
        covariance[slot:, slot:] = cross @ of_pose.T + of_pole @ noise @ of_pole.T
        self._covariance = covariance


def project(pose: Pose2D, forward: float, sighting: RangeBearing) -> Point:
    """Where a sighting puts its pole, the robot being at ``pose``."""
    x, y = pose.ahead(forward)
    direction = pose.heading + sighting.bearing
    return (
        x + sighting.range * math.cos(direction),
        y + sighting.range * math.sin(direction),
    )


def _noise(sighting: RangeBearing) -> Array:
    share = _RANGE_SHARE * (sighting.range if math.isfinite(sighting.range) else 0.0)
    of_range = sighting.range_sigma if math.isfinite(sighting.range_sigma) else 0.0
    return np.diag(
        [
            of_range**2 + _RANGE_SIGMA**2 + share**2,
            sighting.bearing_sigma**2 + _BEARING_SIGMA**2,
        ]
    )
