"""How the simulated robot really moves: motors, steering, slip, the pan motor and its sensor."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from polepilot.core.errors import InternalError
from polepilot.core.geometry import Pose2D, wrap_angle
from polepilot.core.vehicle import PanUnit, Vehicle

LONGEST_STEP = 0.005
"""Seconds. Motors and servo have time constants of 40 ms and more."""
_BLOCK = 512


@dataclass(frozen=True, slots=True)
class Disturbances:
    """What the real robot does that its model does not know. Metres, radians, seconds."""

    speed_scale: float = 0.02
    """Both rear wheels turn so much faster than they should."""
    wheel_difference: float = 0.004
    """The right wheel turns so much faster than the left one, as a share."""
    steering_offset: float = math.radians(1.0)
    """Where the front wheel points when it is told to point straight ahead."""
    dead_band: float = 0.0
    """Share of the full duty below which a wheel stands: friction in the gears."""
    motor_lag: float = 0.08
    friction: float = 1.0
    """What slows a wheel down besides, once its duty is zero, m/s²: gears, and the bridge that
    shorts the motor."""
    servo_lag: float = 0.04
    rear_grip: float = 0.2
    """Who wins where the rear wheels' speeds do not fit the steering angle: 0 the front wheel,
    1 the rear wheels; the other side slips."""
    slip: float = 0.004
    """White slip along the way: standard deviation after one metre, metres."""
    turn_slip: float = math.radians(0.4)
    """The same for the heading, radians after one metre."""
    burst_rate: float = 0.02
    """Bursts of slip per second of driving."""
    burst_loss: float = 0.35
    """Share of the speed that is lost in a burst."""
    burst_length: float = 0.4
    """Longest burst, seconds."""
    pan_scale: float = 0.05
    """The pan motor turns so much faster than it should."""
    pan_lag: float = 0.06
    backlash: float = math.radians(0.1)
    """Play between the potentiometer's shaft and the camera."""
    adc_noise: float = 0.5
    """Counts, standard deviation."""
    adc_bow: float = 0.003
    """Largest deviation of the potentiometer from its straight line, as a share of full scale."""

    @classmethod
    def none(cls) -> Disturbances:
        """A robot that does exactly what it is told, at once."""
        return cls(**dict.fromkeys(cls.__dataclass_fields__, 0.0))

    @classmethod
    def drawn(cls, rng: np.random.Generator) -> Disturbances:
        """One robot of a series: speed within 3 %, steering within 1 degree, and so on."""
        nominal = cls()
        return replace(
            nominal,
            speed_scale=float(rng.uniform(-0.03, 0.03)),
            wheel_difference=float(rng.uniform(-1, 1)) * nominal.wheel_difference,
            steering_offset=float(rng.uniform(-1, 1)) * nominal.steering_offset,
            pan_scale=float(rng.uniform(-1, 1)) * nominal.pan_scale,
            adc_bow=float(rng.uniform(-1, 1)) * nominal.adc_bow,
        )


@dataclass(frozen=True, slots=True)
class Actuation:
    """What the board puts on its pins: duties in per mille, the servo's angle in radians."""

    left: float = 0.0
    right: float = 0.0
    steering: float = 0.0
    pan: float = 0.0


class Motion:
    """The true motion of `base_link` in `map`, and of the camera on its pan axis.

    Two driven rear wheels and a steered front wheel (Ackermann geometry, which the paper's
    simulator left out). The arc of each step is exact (Eqs. 4 to 9 in their corrected form).

    Args:
        full_speed: of a rear wheel at 1000 per mille, m/s.
        pose: where the robot stands at first.
    """

    def __init__(
        self,
        vehicle: Vehicle,
        pan: PanUnit,
        disturbances: Disturbances,
        rng: np.random.Generator,
        *,
        full_speed: float = 0.5,
        pose: Pose2D = Pose2D(0.0, 0.0, 0.0),  # noqa: B008  an immutable tuple
    ) -> None:
        self.pose = pose
        self.speed = 0.0
        """Of `base_link` along the heading, slip included, m/s."""
        self.turn_rate = 0.0
        self.left = 0.0
        """Speed of the left rear wheel's rim, m/s."""
        self.right = 0.0
        self.left_travel = 0.0
        """What an encoder on the left wheel would have counted, metres."""
        self.right_travel = 0.0
        self.steering = disturbances.steering_offset
        """True angle of the front wheel."""
        self.pan_angle = 0.0
        """True angle of the camera from the robot's heading."""
        self.pan_rate = 0.0
        self._vehicle = vehicle
        self._pan = pan
        self._off = disturbances
        self._rng = rng
        self._full_speed = full_speed
        self._servo = 0.0
        self._shaft = 0.0
        self._shaft_rate = 0.0
        self._burst = 0.0
        self._noise: list[float] = []

    @property
    def standing(self) -> bool:
        """Whether both driven wheels are still (below 5 mm/s)."""
        return abs(self.left) < 0.005 and abs(self.right) < 0.005

    def place(self, pose: Pose2D) -> None:
        """Lift the robot and put it down at ``pose``; its motors do not notice."""
        self.pose = pose

    def advance(self, dt: float, actuation: Actuation) -> None:
        """Let ``dt`` seconds pass with these outputs."""
        if not 0 <= dt < 60:
            raise InternalError(f"the world was asked to move on by {dt} s.")
        steps = math.ceil(dt / LONGEST_STEP - 1e-9)
        for _ in range(steps):
            self._drive(dt / steps, actuation)
            self._turn_camera(dt / steps, actuation.pan)

    def adc(self) -> int:
        """What the converter reads from the potentiometer now: counts, 10 bits."""
        unit = self._pan
        share = (self._shaft - unit.minimum) / (unit.maximum - unit.minimum)
        share += self._off.adc_bow * math.sin(math.tau * share)
        counts = unit.adc_at_minimum + share * (unit.adc_at_maximum - unit.adc_at_minimum)
        if self._off.adc_noise:
            counts += self._off.adc_noise * self._draw()
        return min(max(round(counts), 0), 1023)

    def _drive(self, dt: float, actuation: Actuation) -> None:
        off, vehicle = self._off, self._vehicle
        full = self._full_speed * (1 + off.speed_scale) / 1000
        share = _share(dt, off.motor_lag)
        left, right = self._felt(actuation.left), self._felt(actuation.right)
        self.left += share * (left * full * (1 - off.wheel_difference / 2) - self.left)
        self.right += share * (right * full * (1 + off.wheel_difference / 2) - self.right)
        rub = off.friction * dt
        if actuation.left == 0:
            self.left -= min(max(self.left, -rub), rub)
        if actuation.right == 0:
            self.right -= min(max(self.right, -rub), rub)
        self.left_travel += self.left * dt
        self.right_travel += self.right * dt

        wanted = min(max(actuation.steering, -vehicle.max_steering), vehicle.max_steering)
        reach = vehicle.steering_rate * dt
        self._servo += min(max(wanted - self._servo, -reach), reach)
        held = self.steering - off.steering_offset
        self.steering += _share(dt, off.servo_lag) * (self._servo - held)

        speed = (self.left + self.right) / 2
        if speed == 0 and self.left == self.right:
            self.speed = self.turn_rate = 0.0
            return
        by_front = speed * math.tan(self.steering) / vehicle.wheelbase
        by_rear = (self.right - self.left) / vehicle.track
        turn_rate = by_front + off.rear_grip * (by_rear - by_front)
        speed *= 1 - self._slip_burst(dt)
        way = math.sqrt(abs(speed) * dt)
        along, turned = speed * dt, turn_rate * dt
        if off.slip:
            along += off.slip * way * self._draw()
        if off.turn_slip:
            turned += off.turn_slip * way * self._draw()
        self.speed, self.turn_rate = along / dt, turned / dt
        # The chord of the arc: exact for a constant curvature, without a jump at the straight.
        chord = along * (math.sin(turned / 2) / (turned / 2) if abs(turned) > 1e-9 else 1.0)
        x, y, heading = self.pose
        self.pose = Pose2D(
            x + chord * math.cos(heading + turned / 2),
            y + chord * math.sin(heading + turned / 2),
            wrap_angle(heading + turned),
        )

    def _felt(self, duty: float) -> float:
        """What is left of a duty beyond the dead band, per mille."""
        band = self._off.dead_band
        if band == 0:
            return duty
        share = (abs(duty) / 1000 - band) / (1 - band)
        return math.copysign(max(0.0, share) * 1000, duty)

    def _slip_burst(self, dt: float) -> float:
        """Share of the speed that is lost just now."""
        if self._burst > 0:
            self._burst -= dt
            return self._off.burst_loss
        if self._off.burst_rate and self._rng.random() < self._off.burst_rate * dt:
            self._burst = float(self._rng.uniform(0.2, 1.0)) * self._off.burst_length
        return 0.0

    def _turn_camera(self, dt: float, duty: float) -> None:
        unit, off = self._pan, self._off
        wanted = duty / 1000 * unit.rate * (1 + off.pan_scale)
        self._shaft_rate += _share(dt, off.pan_lag) * (wanted - self._shaft_rate)
        self._shaft += self._shaft_rate * dt
        if not unit.minimum <= self._shaft <= unit.maximum:
            self._shaft = min(max(self._shaft, unit.minimum), unit.maximum)
            self._shaft_rate = 0.0
        play = off.backlash / 2
        before = self.pan_angle
        self.pan_angle = min(max(before, self._shaft - play), self._shaft + play)
        self.pan_rate = (self.pan_angle - before) / dt

    def _draw(self) -> float:
        if not self._noise:
            self._noise = self._rng.standard_normal(_BLOCK).tolist()
        return self._noise.pop()


def _share(dt: float, lag: float) -> float:
    """How much of the way to its target a first-order lag goes in ``dt``."""
    return -math.expm1(-dt / lag) if lag > 0 else 1.0
