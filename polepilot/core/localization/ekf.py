"""Extended Kalman filter on the pose and on what distorts odometry and measurements.

Twelve states: x, y, heading; the relative error of the speed; the steering's offset; the errors of
the servo's and the motors' time constants; the relative error of ranges; and four Legendre
coefficients of the potentiometer's error over the pan range. The last nine change slowly or never;
estimating them is what brings the error from decimetres to centimetres (the paper's one-landmark
correction never corrects the heading).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from polepilot.core.geometry import Pose2D, wrap_angle
from polepilot.core.landmark import Landmark
from polepilot.core.localization.odometry import OdometryHistory, Step, advance_with_jacobians
from polepilot.core.observation import RangeBearing

Array = NDArray[np.float64]

_WIDE = (0.3, 0.3, math.radians(8.0))
"""Standard deviations before the sightings of a fix are taken in, metres and radians."""

STATES = 12
SPEED, STEERING, SERVO_LAG, MOTOR_LAG, RANGE, PAN = 3, 4, 5, 6, 7, 8


@dataclass(frozen=True, slots=True)
class NoiseModel:
    """What is believed before the first measurement, and how fast it may change. SI units.

    ``*_prior`` are standard deviations at the start, ``*_walk`` per square root of a second,
    ``*_noise`` densities of white noise on the inputs (per square root of a hertz).
    """

    speed_prior: float = 0.04
    speed_walk: float = 0.002
    speed_noise: float = 0.03
    steering_prior: float = math.radians(1.5)
    steering_walk: float = math.radians(0.02)
    steering_noise: float = math.radians(0.3)
    servo_lag_prior: float = 0.06
    motor_lag_prior: float = 0.05
    servo_doubt: float = 0.1
    """Error of the modelled wheel angle while the servo is on its way, as a share of that way."""
    motor_doubt: float = 0.2
    """The same for the motors on their way to another speed."""
    skid: float = 0.004
    """Unmodelled motion in any direction, metres per square root of a metre driven."""
    range_prior: float = 0.005
    pan_priors: tuple[float, float, float, float] = tuple(  # type: ignore[assignment]
        math.radians(a) for a in (0.3, 0.6, 0.4, 0.6)
    )
    pan_range: float = math.radians(135)
    """Half of the pan range; the Legendre polynomials live on it."""
    range_floor: float = 0.006
    """Added to every range's error: landmarks are surveyed to a few millimetres."""
    bearing_floor: float = math.radians(0.20)
    """Added to every bearing's error: quantization, and what four coefficients do not describe."""
    survey_sigma: float = 0.005
    position_limit: float = 0.004
    """No standard deviation of x or y is ever believed to be smaller: the map is not better."""
    heading_limit: float = math.radians(0.08)


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
    """2 x 12."""
    spread: Array
    """2 x 2 covariance of the innovation, inverted."""
    cross: Array
    """12 x 2, P Hᵀ."""

    @property
    def metres(self) -> float:
        """How far off the landmark appears on the floor."""
        return math.hypot(self.range_gap, self.distance * self.bearing_gap)


@dataclass(slots=True)
class PoseFilter:
    """The filter's state; all methods take a few tens of microseconds."""

    wheelbase: float
    camera_forward: float
    noise: NoiseModel = field(default_factory=NoiseModel)
    gate: float = 16.0
    """Squared Mahalanobis distance beyond which a measurement is not taken."""
    state: Array = field(default_factory=lambda: np.zeros(STATES))
    covariance: Array = field(default_factory=lambda: np.eye(STATES))

    def __post_init__(self) -> None:
        noise = self.noise
        priors = (
            noise.speed_prior,
            noise.steering_prior,
            noise.servo_lag_prior,
            noise.motor_lag_prior,
            noise.range_prior,
            *noise.pan_priors,
        )
        self.covariance[3:, 3:] = np.diag(np.square(priors))

    def reset(self, pose: Pose2D, covariance: Array) -> None:
        """Start again at ``pose`` (3 x 3 covariance). What is known of the robot's errors stays."""
        self.state[:3] = pose
        self.covariance[:3, :3] = covariance
        self.covariance[:3, 3:] = 0.0
        self.covariance[3:, :3] = 0.0

    def retuned(self, motor: float, servo: float) -> None:
        """The history's time constants were raised by so many seconds."""
        self.state[MOTOR_LAG] -= motor
        self.state[SERVO_LAG] -= servo

    @property
    def lag_errors(self) -> tuple[float, float]:
        """True time constants of motors and servo minus the history's, seconds."""
        return float(self.state[MOTOR_LAG]), float(self.state[SERVO_LAG])

    def begin(
        self,
        pose: Pose2D,
        stamp: float,
        sightings: Sequence[tuple[RangeBearing, Landmark]],
        history: OdometryHistory,
    ) -> float:
        """Start at a fix, ``pose`` at ``stamp``, by taking its ``sightings`` in, oldest first.

        The fix serves as the point of linearization only. Its own covariance would not say how
        its error hangs together with the potentiometer's, and be counted twice.
        """
        start = min([stamp, *(sighting.stamp for sighting, _ in sightings)])
        factor, offset = self.speed_factor, self.steering_offset
        before = history.advance(pose, stamp, start, factor, offset)
        self.reset(before, np.diag(np.square(_WIDE)))
        taken = 0
        for sighting, landmark in sightings:
            for step in history.steps(start, sighting.stamp):
                self.predict(step)
            start = max(start, sighting.stamp)
            innovation = self.innovation(sighting, landmark)
            if innovation.squared <= self.gate:
                self.update(innovation)
                taken += 1
        for step in history.steps(start, stamp):
            self.predict(step)
        return taken / max(len(sightings), 1)

    @property
    def speed_factor(self) -> float:
        """True speed as a multiple of the reported one."""
        return 1.0 + float(self.state[SPEED])

    @property
    def steering_offset(self) -> float:
        """True wheel angle minus the reported one, radians."""
        return float(self.state[STEERING])

    def copy(self) -> PoseFilter:
        other = PoseFilter(self.wheelbase, self.camera_forward, self.noise, self.gate)
        other.state[:] = self.state
        other.covariance[:] = self.covariance
        return other

    @property
    def pose(self) -> Pose2D:
        return Pose2D(float(self.state[0]), float(self.state[1]), wrap_angle(float(self.state[2])))

    @property
    def pose_covariance(self) -> Array:
        return self.covariance[:3, :3].copy()

    def predict(self, step: Step) -> None:
        """Move by one step of odometry. While the robot stands nothing is lost or gained."""
        if step.speed == 0.0:
            return
        state, noise, dt = self.state, self.noise, step.dt
        speed = step.speed + step.speed_by_lag * float(state[MOTOR_LAG])
        factor = 1.0 + float(state[SPEED])
        pose, jacobian = advance_with_jacobians(
            Pose2D(state[0], state[1], state[2]),
            speed * factor,
            step.steering + state[STEERING] + step.by_lag * state[SERVO_LAG],
            dt,
            self.wheelbase,
        )
        state[:3] = pose
        raw = jacobian[:, 3]
        hurried = raw * (noise.motor_doubt * step.unsettled_speed)
        jacobian = np.column_stack(
            (
                jacobian,
                jacobian[:, 4] * step.by_lag,
                raw * (factor * step.speed_by_lag),
            )
        )
        jacobian[:, 3] *= speed
        speed_variance = noise.speed_noise**2 / dt
        steering_variance = noise.steering_noise**2 / dt + (noise.servo_doubt * step.unsettled) ** 2
        p = self.covariance
        moved = jacobian @ p[:7]
        block = moved[:, :7] @ jacobian.T
        by_speed, by_steering = jacobian[:, 3], jacobian[:, 4]
        block += np.outer(by_speed, by_speed) * speed_variance
        block += np.outer(by_steering, by_steering) * steering_variance
        if step.unsettled_speed:
            block += np.outer(hurried, hurried)
        skid = noise.skid**2 * abs(step.speed) * dt
        block[0, 0] += skid
        block[1, 1] += skid
        p[:3] = moved
        p[:, :3] = moved.T
        p[:3, :3] = block
        p[SPEED, SPEED] += noise.speed_walk**2 * dt
        p[STEERING, STEERING] += noise.steering_walk**2 * dt

    def innovation(self, measurement: RangeBearing, landmark: Landmark) -> Innovation:
        """Compare a measurement with the state, which must have been predicted to its stamp."""
        state, noise = self.state, self.noise
        cos, sin = math.cos(state[2]), math.sin(state[2])
        arm_x, arm_y = self.camera_forward * cos, self.camera_forward * sin
        dx, dy = landmark.x - state[0] - arm_x, landmark.y - state[1] - arm_y
        distance = max(math.hypot(dx, dy), 1e-3)
        ux, uy = dx / distance, dy / distance
        jacobian = np.zeros((2, STATES))
        scale = 1.0 + float(state[RANGE])
        jacobian[0, 0], jacobian[0, 1] = -ux * scale, -uy * scale
        jacobian[0, 2] = (ux * arm_y - uy * arm_x) * scale
        jacobian[0, RANGE] = distance
        jacobian[1, 0], jacobian[1, 1] = uy / distance, -ux / distance
        jacobian[1, 2] = -(uy * arm_y + ux * arm_x) / distance - 1.0
        pan = measurement.bearing if measurement.pan is None else measurement.pan
        u = min(max(pan / noise.pan_range, -1.0), 1.0)
        legendre = (1.0, u, 1.5 * u * u - 0.5, (2.5 * u * u - 1.5) * u)
        jacobian[1, PAN:] = legendre
        pan_error = float(jacobian[1, PAN:] @ state[PAN:])
        bearing_gap = wrap_angle(measurement.bearing - pan_error - math.atan2(dy, dx) + state[2])
        bearing_variance = (
            measurement.bearing_sigma**2
            + noise.bearing_floor**2
            + (noise.survey_sigma / distance) ** 2
        )
        if math.isfinite(measurement.range) and math.isfinite(measurement.range_sigma):
            range_gap = measurement.range - distance * scale
            range_variance = measurement.range_sigma**2 + noise.range_floor**2
        else:
            range_gap, range_variance = 0.0, 1e6
        cross = self.covariance @ jacobian.T
        a = float(jacobian[0] @ cross[:, 0]) + range_variance
        b = float(jacobian[0] @ cross[:, 1])
        d = float(jacobian[1] @ cross[:, 1]) + bearing_variance
        determinant = a * d - b * b
        inverse = np.array([[d, -b], [-b, a]]) / determinant
        squared = (
            d * range_gap**2 - 2.0 * b * range_gap * bearing_gap + a * bearing_gap**2
        ) / determinant
        return Innovation(range_gap, bearing_gap, distance, squared, jacobian, inverse, cross)

    def take(
        self, measurement: RangeBearing, landmark: Landmark, tolerance: float
    ) -> tuple[bool, float]:
        """Take a measurement in if it passes the gate.

        Returns whether it was taken, and how many metres it was off. One that does not pass though
        it is within ``tolerance`` metres says that the state is surer than it should be.
        """
        innovation = self.innovation(measurement, landmark)
        if innovation.squared <= self.gate:
            self.update(innovation)
            return True, innovation.metres
        if innovation.metres <= tolerance:
            self._doubt(1.2)
        return False, innovation.metres

    def update(self, innovation: Innovation) -> None:
        """Take a measurement in; ``innovation`` must come from the present state."""
        gain = innovation.cross @ innovation.spread
        self.state += gain @ (innovation.range_gap, innovation.bearing_gap)
        self.state[2] = wrap_angle(float(self.state[2]))
        p = self.covariance
        p -= gain @ innovation.cross.T
        # Rounding alone may make it lopsided; the mean of both halves stays a covariance.
        self.covariance = p = 0.5 * (p + p.T)
        # Sightings repeat the errors of map and potentiometer: a robot that stands and looks for
        # an hour does not know better where it is.
        limit = self.noise.position_limit**2
        p[0, 0] = max(p[0, 0], limit)
        p[1, 1] = max(p[1, 1], limit)
        p[2, 2] = max(p[2, 2], self.noise.heading_limit**2)

    def _doubt(self, factor: float) -> None:
        """Trust the pose less: its standard deviations times ``factor``."""
        self.covariance[:3] *= factor
        self.covariance[:, :3] *= factor
