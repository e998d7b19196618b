"""Dead reckoning from speed, wheel angle and elapsed time: the paper's "time encoder".

Eqs. 4-9 of the paper do not form a rigid motion as printed (method.md, "Time encoder"). Here
`base_link` moves on the exact circular arc of the kinematic bicycle with wheelbase L::

    kappa = tan(steering) / L,   turn = speed dt kappa

It is written as a chord of that circle, so that nothing jumps or cancels where the curvature goes
to zero.
"""

from __future__ import annotations

import math
from bisect import bisect_right
from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from polepilot.core.errors import InternalError
from polepilot.core.geometry import Pose2D, wrap_angle
from polepilot.core.localization.following import Followed, follow
from polepilot.core.observation import Odometry

_SMALL_TURN = 1e-3
"""Below half of this turn (rad) series are used, whose error is then under 1e-13."""
_RETUNED = 4.0
"""Seconds of the past for which other constants of motors and servo matter."""
_SLOWER = 0.15
"""How much slower (s/rad) the servo is with which the one believed in is compared. A derivative
would be zero wherever the servo is believed to be fast enough not to matter, and nothing would
ever tell that it is not."""
_ALIKE = 1e-5
"""Wheel angles (rad) that need not be told apart."""


class Arc(NamedTuple):
    """A piece of a circle (m, rad), and how it depends on its length and curvature."""

    dx: float
    dy: float
    turn: float
    dx_by_distance: float
    dy_by_distance: float
    dx_by_curvature: float
    """At a fixed length, m²; the turn's derivatives are the curvature and the length."""
    dy_by_curvature: float


def arc(heading: float, distance: float, curvature: float) -> Arc:
    """Drive ``distance`` metres with ``curvature`` (1/m), beginning with ``heading``.

    The chord lies in the direction half way through the turn and is ``distance`` sinc(turn / 2)
    long: exact, and without a jump where the curvature goes to zero.
    """
    turn = distance * curvature
    half = 0.5 * turn
    middle = heading + half
    cos, sin = math.cos(middle), math.sin(middle)
    if abs(half) < _SMALL_TURN:
        square = half * half
        ratio, slope = 1.0 - square / 6.0, half * (square / 30.0 - 1.0 / 3.0)
        cos_half, sin_half = 1.0 - 0.5 * square, half * ratio
    else:
        cos_half, sin_half = math.cos(half), math.sin(half)
        ratio = sin_half / half
        slope = (cos_half - ratio) / half
    chord = distance * ratio
    # By curvature the chord turns by distance / 2 and changes its length.
    longer, turned = 0.5 * distance * distance * slope, 0.5 * distance * chord
    return Arc(
        chord * cos,
        chord * sin,
        turn,
        cos * cos_half - sin * sin_half,
        sin * cos_half + cos * sin_half,
        longer * cos - turned * sin,
        longer * sin + turned * cos,
    )


def advance(pose: Pose2D, speed: float, steering: float, dt: float, wheelbase: float) -> Pose2D:
    """Where `base_link` is after ``dt`` seconds at constant speed (m/s) and steering (rad)."""
    piece = arc(pose.heading, speed * dt, math.tan(steering) / wheelbase)
    return Pose2D(pose.x + piece.dx, pose.y + piece.dy, wrap_angle(pose.heading + piece.turn))


def advance_with_jacobians(
    pose: Pose2D, speed: float, steering: float, dt: float, wheelbase: float
) -> tuple[Pose2D, NDArray[np.float64]]:
    """``advance`` and its 3 x 5 Jacobian by (x, y, heading, speed, steering)."""
    tan = math.tan(steering)
    curvature, distance = tan / wheelbase, speed * dt
    piece = arc(pose.heading, distance, curvature)
    bend = (1.0 + tan * tan) / wheelbase
    jacobian = np.array(
        [
            [1.0, 0.0, -piece.dy, dt * piece.dx_by_distance, bend * piece.dx_by_curvature],
            [0.0, 1.0, piece.dx, dt * piece.dy_by_distance, bend * piece.dy_by_curvature],
            [0.0, 0.0, 1.0, curvature * dt, distance * bend],
        ]
    )
    moved = Pose2D(pose.x + piece.dx, pose.y + piece.dy, wrap_angle(pose.heading + piece.turn))
    return moved, jacobian


class Step(NamedTuple):
    """A short stretch of time with constant speed and steering."""

    dt: float
    speed: float
    steering: float
    unsettled: float
    """How far the servo still was from the angle it was told, rad: a measure of doubt."""
    by_lag: float = 0.0
    """Derivative of ``steering`` by the servo's time constant, rad/s."""
    unsettled_speed: float = 0.0
    """How far the motors still were from the speed they were told, m/s."""
    speed_by_lag: float = 0.0
    """Derivative of ``speed`` by the motors' time constant, m/s²."""
    by_slowness: float = 0.0
    """By how much ``steering`` differs for a slower servo, per s/rad that it is slower."""


class Following(NamedTuple):
    """How motors and servo follow what they are told, or by how much that is wrong."""

    motor: float
    """Time constant of the motors, seconds."""
    servo: float
    """Time constant of the servo, seconds."""
    slowness: float = 0.0
    """Seconds that the servo needs for a radian at least."""


NO_LAGS = Following(0.0, 0.0)
"""All is done at once."""


class _Entry(NamedTuple):
    stamp: float
    speed: float
    steering: float
    speed_then: Followed
    """What the motors did at ``stamp``, while on the way to ``speed``."""
    steering_then: Followed
    slower_then: Followed
    """What a slower servo did."""


class OdometryHistory:
    """The last seconds of Odometry, with the servo's and the motors' lag; bounded in memory.

    Motors and servo follow what they are told (`following.py`). The history answers how the robot
    moved between any two moments of its span, so that a measurement which comes late is
    applied at the pose from which it was made. Before the first entry the robot stood.
    """

    def __init__(
        self,
        wheelbase: float,
        *,
        steering_lag: float = 0.0,
        speed_lag: float = 0.0,
        steering_slowness: float = 0.0,
        span: float = 15.0,
        longest_step: float = 0.05,
    ) -> None:
        following = Following(speed_lag, steering_lag, steering_slowness)
        if wheelbase <= 0 or min(following) < 0 or span <= 0 or longest_step <= 0:
            raise InternalError("an odometry history needs a positive wheelbase, span and step.")
        self.wheelbase = wheelbase
        self._following = following
        self._span = span
        self._longest_step = longest_step
        self._entries: list[_Entry] = []
        self._stamps: list[float] = []

    def __len__(self) -> int:
        return len(self._entries)

    def add(self, odometry: Odometry) -> None:
        """Append; one that is older than the newest, or not finite, is ignored."""
        stamp, speed, steering = odometry.stamp, odometry.speed, odometry.steering
        if not (math.isfinite(stamp) and math.isfinite(speed) and math.isfinite(steering)):
            return
        if not self._entries:
            then = Followed(speed), Followed(steering), Followed(steering)
            self._push(_Entry(stamp, speed, steering, *then))
            return
        last = self._entries[-1]
        if stamp < last.stamp:
            return
        then = self._values(last, stamp)
        if stamp == last.stamp:
            self._entries.pop()
            self._stamps.pop()
        self._push(_Entry(stamp, speed, steering, *then))
        if self._stamps[0] < stamp - 2.0 * self._span:
            # The one entry that was valid when the span begins stays.
            keep = max(0, bisect_right(self._stamps, stamp - self._span) - 1)
            del self._entries[:keep]
            del self._stamps[:keep]

    @property
    def following(self) -> Following:
        """How motors and servo follow what they are told."""
        return self._following

    def retune(self, following: Following) -> None:
        """Other constants, for the last seconds: what is older has long been settled."""
        self._following = following
        if not self._stamps:
            return
        first = bisect_right(self._stamps, self._stamps[-1] - _RETUNED)
        for index in range(max(first, 1), len(self._entries)):
            entry = self._entries[index]
            then = self._values(self._entries[index - 1], entry.stamp)
            self._entries[index] = _Entry(entry.stamp, entry.speed, entry.steering, *then)

    def steps(self, start: float, end: float) -> Iterator[Step]:
        """The motion from ``start`` to ``end`` in steps of at most ``longest_step`` seconds."""
        index = bisect_right(self._stamps, start) - 1
        now = start
        while now < end:
            following = self._stamps[index + 1] if index + 1 < len(self._stamps) else math.inf
            until = min(end, following)
            if index < 0:
                yield Step(until - now, 0.0, 0.0, 0.0)
            else:
                yield from self._entry_steps(self._entries[index], now, until)
            now = until
            index += 1

    def advance(
        self, pose: Pose2D, start: float, end: float, scale: float = 1.0, offset: float = 0.0
    ) -> Pose2D:
        """``pose`` moved from ``start`` to ``end``, or back where ``end`` is earlier.

        ``scale`` and ``offset`` are what is known of the speed's and the steering's errors.
        """
        if end < start:
            moved = self.advance(Pose2D(0.0, 0.0, 0.0), end, start, scale, offset)
            return pose.compose(moved.inverse())
        for step in self.steps(start, end):
            if step.speed:
                steering = step.steering + offset
                pose = advance(pose, scale * step.speed, steering, step.dt, self.wheelbase)
        return pose

    def driven(
        self, start: float, end: float, scale: float = 1.0, offset: float = 0.0
    ) -> tuple[Pose2D, float]:
        """The pose at ``end``, seen from that at ``start``, and the way as it was told, metres."""
        pose, way = Pose2D(0.0, 0.0, 0.0), 0.0
        for step in self.steps(start, end):
            if step.speed:
                steering = step.steering + offset
                pose = advance(pose, scale * step.speed, steering, step.dt, self.wheelbase)
                way += abs(step.speed) * step.dt
        return pose, way

    def moved(self, start: float, end: float) -> tuple[float, float]:
        """Metres travelled and seconds spent moving between two moments."""
        distance = seconds = 0.0
        for step in self.steps(start, end):
            if abs(step.speed) > 1e-4:
                distance += abs(step.speed) * step.dt
                seconds += step.dt
        return distance, seconds

    def _push(self, entry: _Entry) -> None:
        self._entries.append(entry)
        self._stamps.append(entry.stamp)

    def _entry_steps(self, entry: _Entry, start: float, end: float) -> Iterator[Step]:
        still = entry.speed == 0.0 and abs(entry.speed_then.value) < 1e-4
        count = 1 if still else max(1, math.ceil((end - start) / self._longest_step - 1e-9))
        dt = (end - start) / count
        if dt <= 0:
            return
        for index in range(count):
            speed, steering, slower = self._values(entry, start + (index + 0.5) * dt)
            if abs(speed.value) < 1e-4:
                yield Step(dt, 0.0, steering.value, 0.0)
                continue
            yield Step(
                dt,
                speed.value,
                steering.value,
                abs(entry.steering - steering.value),
                steering.by_lag,
                abs(entry.speed - speed.value),
                speed.by_lag,
                (slower.value - steering.value) / _SLOWER,
            )

    def _values(self, entry: _Entry, stamp: float) -> tuple[Followed, Followed, Followed]:
        """What motors, servo and a slower servo had reached at ``stamp``."""
        age = stamp - entry.stamp
        motor, servo, slowness = self._following
        speed = follow(entry.speed, entry.speed_then, age, motor, 0.0)
        then, slower = entry.steering_then, entry.slower_then
        steering = follow(entry.steering, then, age, servo, slowness)
        slowness += _SLOWER
        alike = abs(slower.value - then.value) < _ALIKE
        if alike and abs(entry.steering - then.value) * slowness <= servo:
            return speed, steering, steering
        return speed, steering, follow(entry.steering, slower, age, servo, slowness)
