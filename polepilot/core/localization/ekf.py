"""Extended Kalman filter on the pose and on what distorts odometry, measurements and map.

The states: x, y, heading; the relative error of the speed; the steering's offset; the errors of
the servo's and the motors' time constants, and of the time that the servo needs for a radian; the
relative error of ranges; Legendre coefficients of the potentiometer's error over the pan range;
and, for as many landmarks as `surveyed` names, the error of their mapped positions: where the map
has more, of those that were seen last. All but the pose change slowly or never. Estimating them is
what brings the error from decimetres to centimetres (the paper's one-landmark correction never
corrects the heading); the map's errors repeat in every sighting of a landmark, and a filter that
took them for noise would become too sure of itself.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import replace
from operator import mul
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from polepilot.core.geometry import Point, Pose2D, wrap_angle
from polepilot.core.landmark import Landmark
from polepilot.core.localization.doubt import largest_sigma
from polepilot.core.localization.fix import Fix
from polepilot.core.localization.health import place_of
from polepilot.core.localization.noise import NoiseModel
from polepilot.core.localization.odometry import Following, OdometryHistory, Step
from polepilot.core.localization.stretch import Distortions, drive
from polepilot.core.localization.suspicion import MapMisfit
from polepilot.core.observation import RangeBearing

Array = NDArray[np.float64]

_WIDE = (0.3, 0.3, math.radians(8.0))
"""Standard deviations before the sightings of a fix are taken in, metres and radians."""
_ANYWHERE = 1.0
"""Of the place of a landmark of which nothing is known, metres."""
_NO_RANGE = 1e6
"""Variance of a range that was not measured, m²."""

SPEED, STEERING, SERVO_LAG, MOTOR_LAG, SLOWNESS, RANGE, PAN = 3, 4, 5, 6, 7, 8, 9
PANS = 6
STATES = PAN + PANS
"""States besides the map's errors."""
_NO_ODOMETRY, _NO_PAN = (0.0,) * (RANGE - 3), (0.0,) * PANS
"""What a measurement does not depend on."""


class Innovation(NamedTuple):
    """How a measurement differs from what the state expects."""

    range_gap: float
    """Measured minus expected range, metres (0 where no range was measured)."""
    bearing_gap: float
    distance: float
    """Expected range, metres."""
    squared: float
    """Squared Mahalanobis distance."""
    jacobian: Array
    """2 x states."""
    spread: tuple[float, float, float]
    """The innovation's covariance: of the range, of both, of the bearing."""
    cross: Array
    """states x 2, P Hᵀ."""

    @property
    def metres(self) -> float:
        """How far off the landmark appears on the floor."""
        return math.hypot(self.range_gap, self.distance * self.bearing_gap)


class PoseFilter:
    """The filter's state. A prediction or an update takes a few tens of microseconds."""

    def __init__(
        self,
        wheelbase: float,
        camera_forward: float,
        noise: NoiseModel | None = None,
        gate: float = 16.0,
        surveyed: Sequence[int] = (),
        *,
        shared: bool = False,
    ) -> None:
        """``surveyed``: the landmarks whose positions' errors are states.

        ``shared``: others take their places over, from the one that was not seen for longest.
        ``gate``: squared Mahalanobis distance beyond which a measurement is not taken.
        """
        self.wheelbase = wheelbase
        self.camera_forward = camera_forward
        self.noise = noise or NoiseModel()
        self.gate = gate
        self._places = {number: STATES + 2 * k for k, number in enumerate(surveyed)}
        """Where in the state; if they are shared, the one seen last comes last. Never changed."""
        self._shared = shared and bool(surveyed)
        size = STATES + 2 * len(surveyed)
        model = self.noise
        priors = (
            *(1.0, 1.0, 1.0),
            model.speed_prior,
            model.steering_prior,
            model.servo_lag_prior,
            model.motor_lag_prior,
            model.slowness_prior,
            model.range_prior,
            *model.pan_priors,
            *(model.survey_sigma for _ in range(size - STATES)),
        )
        self.state: Array = np.zeros(size)
        self.covariance: Array = np.diag(np.square(priors))

    def reset(self, pose: Pose2D, covariance: Array) -> None:
        """Start again at ``pose`` (3 x 3 covariance). What is known of the robot's errors stays."""
        self.state[:3] = pose
        self.covariance[:3, :3] = covariance
        self.covariance[:3, 3:] = 0.0
        self.covariance[3:, :3] = 0.0

    def retuned(self, by: Following) -> None:
        """The history's constants were raised by so much."""
        self.state[MOTOR_LAG] -= by.motor
        self.state[SERVO_LAG] -= by.servo
        self.state[SLOWNESS] -= by.slowness

    def copy(self) -> PoseFilter:
        other = PoseFilter.__new__(PoseFilter)
        other.wheelbase, other.camera_forward = self.wheelbase, self.camera_forward
        other.noise, other.gate = self.noise, self.gate
        other._places, other._shared = self._places, self._shared
        other.state, other.covariance = self.state.copy(), self.covariance.copy()
        return other

    @property
    def following_errors(self) -> Following:
        """True constants of motors and servo minus the history's."""
        servo, motor, slowness = self.state[SERVO_LAG : SLOWNESS + 1].tolist()
        return Following(motor, servo, slowness)

    @property
    def speed_factor(self) -> float:
        """True speed as a multiple of the reported one."""
        return 1.0 + float(self.state[SPEED])

    @property
    def steering_offset(self) -> float:
        """True wheel angle minus the reported one, radians."""
        return float(self.state[STEERING])

    @property
    def pose(self) -> Pose2D:
        x, y, heading = self.state[:3].tolist()
        return Pose2D(x, y, wrap_angle(heading))

    @property
    def pose_covariance(self) -> Array:
        return self.covariance[:3, :3].copy()

    @property
    def map_misfit(self) -> MapMisfit:
        """How far landmarks had to be moved for everything to agree."""
        shifts = self.state[STATES:]
        if not len(shifts):
            return MapMisfit()
        unit = self.noise.survey_sigma**2
        freedom = len(shifts) - float(self.covariance.diagonal()[STATES:].sum()) / unit
        stretch = float(self.state[RANGE]) / self.noise.range_prior
        misfit = MapMisfit(float(shifts @ shifts) / unit, freedom, None, stretch)
        if not misfit.worth_a_word:
            return misfit
        worst = STATES + 2 * (int(np.abs(shifts).argmax()) // 2)
        number = next(k for k, place in self._places.items() if place == worst)
        return misfit._replace(worst=number)

    def begin(
        self,
        found: Fix,
        stamp: float,
        sightings: Sequence[tuple[RangeBearing, Landmark]],
        history: OdometryHistory,
    ) -> list[RangeBearing]:
        """Start at a fix, ``found`` at ``stamp``, by taking its ``sightings`` in, oldest first.

        The fix serves as the point of linearization only. Its own covariance would not say how
        its error hangs together with the potentiometer's, and be counted twice. Answers which
        of the sightings did not pass the gate.
        """
        start = min([stamp, *(sighting.stamp for sighting, _ in sightings)])
        factor, offset = self.speed_factor, self.steering_offset
        before = history.advance(found.pose, stamp, start, factor, offset)
        self.reset(before, np.diag(np.square(_WIDE)))
        refused = []
        for sighting, landmark in sightings:
            self.predict(history.steps(start, sighting.stamp))
            start = max(start, sighting.stamp)
            self._make_room(landmark)
            innovation = self.innovation(sighting, landmark)
            if innovation.squared <= self.gate:
                self.update(innovation)
            else:
                refused.append(sighting)
        self.predict(history.steps(start, stamp))
        return refused

    def predict(self, steps: Iterable[Step]) -> float:
        """Move by steps of odometry; while the robot stands nothing is lost or gained.

        Returns how many seconds of it the robot moved.
        """
        state, noise = self.state, self.noise
        heading, *wrong = state[2 : SLOWNESS + 1].tolist()
        stretch = drive(heading, steps, Distortions(*wrong), noise, self.wheelbase)
        if stretch is None:
            return 0.0
        state[0] += stretch.dx
        state[1] += stretch.dy
        state[2] = wrap_angle(heading + stretch.turn)
        jacobian, p = stretch.jacobian, self.covariance
        moved = jacobian @ p[:RANGE]
        p[:3] = moved
        p[:, :3] = moved.T
        p[:3, :3] = moved[:, :RANGE] @ jacobian.T + stretch.noise
        p[SPEED, SPEED] += noise.speed_walk**2 * stretch.moving
        p[STEERING, STEERING] += noise.steering_walk**2 * stretch.moving
        return stretch.moving

    def supposing(self, landmark: Landmark, place: Point) -> PoseFilter | None:
        """A copy that does not know where ``landmark`` stands, and begins with ``place``.

        None where the error of its place is no state.
        """
        at = self._places.get(landmark.id)
        if at is None:
            return None
        other = self.copy()
        part = slice(at, at + 2)
        other.state[part] = place[0] - landmark.x, place[1] - landmark.y
        other.covariance[part] = 0.0
        other.covariance[:, part] = 0.0
        other.covariance[at, at] = other.covariance[at + 1, at + 1] = _ANYWHERE**2
        return other

    def shift_of(self, number: int) -> tuple[Point, float] | None:
        """How far a landmark stands from its place in the map, and how well that is known (m).

        None where that is no state.
        """
        at = self._places.get(number)
        if at is None:
            return None
        (xx, xy), (_, yy) = self.covariance[at : at + 2, at : at + 2].tolist()
        dx, dy = self.state[at : at + 2].tolist()
        return (dx, dy), largest_sigma(xx, xy, yy)

    def innovation(self, measurement: RangeBearing, landmark: Landmark) -> Innovation:
        """Compare a measurement with the state, which must have been predicted to its stamp."""
        noise = self.noise
        place = self._places.get(landmark.id)
        x, y, heading = self.state[:3].tolist()
        scale, *bends = self.state[RANGE:STATES].tolist()
        scale += 1.0
        arm_x = self.camera_forward * math.cos(heading)
        arm_y = self.camera_forward * math.sin(heading)
        dx, dy = landmark.x - x - arm_x, landmark.y - y - arm_y
        if place is not None:
            shift_x, shift_y = self.state[place : place + 2].tolist()
            dx, dy = dx + shift_x, dy + shift_y
        distance = max(math.hypot(dx, dy), 1e-3)
        ux, uy = dx / distance, dy / distance
        tx, ty = uy / distance, -ux / distance
        shapes = self._shapes(measurement)
        by_range = [-ux * scale, -uy * scale, (ux * arm_y - uy * arm_x) * scale, *_NO_ODOMETRY]
        by_range += (distance, *_NO_PAN)
        by_bearing = [tx, ty, tx * -arm_y + ty * arm_x - 1.0, *_NO_ODOMETRY, 0.0, *shapes]
        rest = [0.0] * (len(self.state) - STATES)
        by_range += rest
        by_bearing += rest
        own = 0.0
        if place is not None:
            by_range[place : place + 2] = ux * scale, uy * scale
            by_bearing[place : place + 2] = -tx, -ty
        else:
            own = noise.survey_sigma**2
        jacobian = np.array((by_range, by_bearing))
        pan_error = sum(map(mul, shapes, bends))
        bearing_gap = wrap_angle(measurement.bearing - pan_error - math.atan2(dy, dx) + heading)
        bearing_variance = (
            measurement.bearing_sigma**2 + noise.bearing_floor**2 + own / (distance * distance)
        )
        if math.isfinite(measurement.range) and math.isfinite(measurement.range_sigma):
            range_gap = measurement.range - distance * scale
            range_variance = measurement.range_sigma**2 + noise.range_floor**2 + own
        else:
            range_gap, range_variance = 0.0, _NO_RANGE
        cross = self.covariance @ jacobian.T
        (a, b), (_, d) = (jacobian @ cross).tolist()
        a, d = a + range_variance, d + bearing_variance
        squared = (d * range_gap**2 - 2.0 * b * range_gap * bearing_gap + a * bearing_gap**2) / (
            a * d - b * b
        )
        return Innovation(range_gap, bearing_gap, distance, squared, jacobian, (a, b, d), cross)

    def _shapes(self, measurement: RangeBearing) -> list[float]:
        """The Legendre polynomials where the camera pointed."""
        pan = measurement.bearing if measurement.pan is None else measurement.pan
        return _legendre(min(max(pan / self.noise.pan_range, -1.0), 1.0))

    def appears(self, measurement: RangeBearing) -> Point | None:
        """Where in `map` a landmark appears, by all that is known of what distorts measurements.

        None without a range.
        """
        scale, *bends = self.state[RANGE:STATES].tolist()
        bearing = measurement.bearing - sum(map(mul, self._shapes(measurement), bends))
        true = replace(measurement, range=measurement.range / (1.0 + scale), bearing=bearing)
        return place_of(self.pose, true, self.camera_forward)

    def take(
        self, measurement: RangeBearing, landmark: Landmark, tolerance: float
    ) -> tuple[bool, float]:
        """Take a measurement in if it passes the gate.

        Returns whether it was taken, and how many metres it was off. One that does not pass though
        it is within ``tolerance`` metres says that the state is surer than it should be.
        """
        self._make_room(landmark)
        innovation = self.innovation(measurement, landmark)
        if innovation.squared <= self.gate:
            self.update(innovation)
            return True, innovation.metres
        if innovation.metres <= tolerance:
            self._doubt(1.2)
        return False, innovation.metres

    def update(self, innovation: Innovation) -> None:
        """Take a measurement in; ``innovation`` must come from the present state."""
        a, b, d = innovation.spread
        # With S = C Cᵀ, W = P Hᵀ C⁻ᵀ makes of the textbook's P - K S Kᵀ a P - W Wᵀ, which rounding
        # cannot make lopsided.
        c = math.sqrt(a)
        e = b / c
        f = math.sqrt(d - e * e)
        gaps = innovation.range_gap / c
        inverse = np.array(((1.0 / c, -e / (c * f)), (0.0, 1.0 / f)))
        whitened = innovation.cross @ inverse
        self.state += whitened @ (gaps, (innovation.bearing_gap - e * gaps) / f)
        self.state[2] = wrap_angle(float(self.state[2]))
        p = self.covariance
        p -= whitened @ whitened.T
        # Sightings repeat what no state describes: a robot that stands and looks for an hour does
        # not know better where it is.
        limit = self.noise.position_limit**2
        px, py, ph = p[0, 0], p[1, 1], p[2, 2]
        if px < limit:
            p[0, 0] = limit
        if py < limit:
            p[1, 1] = limit
        limit = self.noise.heading_limit**2
        if ph < limit:
            p[2, 2] = limit

    def _make_room(self, landmark: Landmark) -> None:
        """The error of its place becomes a state, instead of that of one not seen for long.

        What was learnt with that one is kept; seen again, its error counts as a new one.
        """
        if not self._shared or next(reversed(self._places)) == landmark.id:
            return
        places = dict(self._places)
        place = places.pop(landmark.id, None)
        if place is None:
            place = places.pop(next(iter(places)))
            part = slice(place, place + 2)
            self.state[part] = 0.0
            self.covariance[part] = 0.0
            self.covariance[:, part] = 0.0
            for index in (place, place + 1):
                self.covariance[index, index] = self.noise.survey_sigma**2
        places[landmark.id] = place
        self._places = places

    def _doubt(self, factor: float) -> None:
        """Trust the pose less: its standard deviations times ``factor``."""
        self.covariance[:3] *= factor
        self.covariance[:, :3] *= factor


def _legendre(u: float) -> list[float]:
    """The polynomials P0, P1, ... at ``u``, -1 to 1."""
    before, last = 1.0, u
    values = [before, last]
    for degree in range(2, PANS):
        before, last = last, ((2 * degree - 1) * u * last - (degree - 1) * before) / degree
        values.append(last)
    return values
