"""From speeds and angles to duties and servo angles, and back: what one robot's motors do.

The two rear motors form an electronic differential (method, "Time encoder"): with curvature
kappa = tan(steering) / wheelbase the left and the right wheel run at v (1 -/+ kappa track / 2).
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from polepilot.core.command import DriveCommand
from polepilot.core.errors import ConfigError
from polepilot.core.link.messages import MAX_DUTY, Features, Telemetry
from polepilot.core.observation import Odometry
from polepilot.core.vehicle import Vehicle

_MIN_SPEED = 1e-4
"""Slower than this (m/s) is standing: no duty, whatever the dead band."""


@dataclass(frozen=True, slots=True)
class DriveCalibration:
    """What a duty does to a wheel, what an angle does to the servo.

    A wheel turns at ``full_speed`` (m/s on the floor) under full duty, not at all below the dead
    band, and in proportion between the two.
    """

    full_speed_left: float = 0.50
    full_speed_right: float = 0.50
    """A robot that pulls to one side has different ones: this is the trim."""
    dead_band: float = 0.0
    """Share of the full duty, below 1, that moves nothing."""
    servo_center: float = 0.0
    """What to send to drive straight on, rad."""
    servo_scale: float = 1.0
    """Angle to send per angle of the virtual front wheel; negative where the servo is mirrored."""
    servo_limit: float = math.radians(45)
    """Largest angle to send, to either side, rad."""
    counts_per_metre: float = 0.0
    """Of the wheel encoders; 0 where there are none."""

    def __post_init__(self) -> None:
        checks = (
            ("full_speed_left", self.full_speed_left > 0, "more than 0 m/s"),
            ("full_speed_right", self.full_speed_right > 0, "more than 0 m/s"),
            ("dead_band", 0 <= self.dead_band < 1, "a share of at least 0 and below 1"),
            ("servo_center", abs(self.servo_center) < self.servo_limit, "within servo_limit"),
            ("servo_scale", self.servo_scale != 0, "not 0"),
            ("servo_limit", 0 < self.servo_limit < math.pi / 2, "between 0 and 90 degrees"),
            ("counts_per_metre", self.counts_per_metre >= 0, "0 (no encoders) or more"),
        )
        for name, good, expected in checks:
            value = getattr(self, name)
            if not good or not math.isfinite(value):
                raise ConfigError(f"drive calibration: {name} is {value}, expected {expected}.")

    def wheel_speed(self, duty: int, right: bool) -> float:
        """Speed of a wheel (m/s) under ``duty`` per mille."""
        share = (abs(duty) / MAX_DUTY - self.dead_band) / (1 - self.dead_band)
        full = self.full_speed_right if right else self.full_speed_left
        return math.copysign(max(0.0, share) * full, duty)

    def wheel_duty(self, speed: float, right: bool) -> int:
        """Duty (per mille, not clamped) for a wheel's ``speed`` in m/s."""
        if abs(speed) < _MIN_SPEED:
            return 0
        full = self.full_speed_right if right else self.full_speed_left
        share = self.dead_band + (1 - self.dead_band) * abs(speed) / full
        return round(math.copysign(share * MAX_DUTY, speed))

    def to_drive(self, command: DriveCommand, vehicle: Vehicle) -> tuple[int, int, int]:
        """Left and right duty (per mille) and steering (centidegrees) for HostLink.drive.

        The steering is limited by vehicle and servo first; where a wheel cannot turn that fast,
        both are slowed down in proportion, so that the curve stays the same.
        """
        angle = max(-vehicle.max_steering, min(vehicle.max_steering, command.steering))
        servo = self.servo_center + self.servo_scale * angle
        servo = max(-self.servo_limit, min(self.servo_limit, servo))
        angle = (servo - self.servo_center) / self.servo_scale

        half_turn = math.tan(angle) / vehicle.wheelbase * vehicle.track / 2
        left, right = command.speed * (1 - half_turn), command.speed * (1 + half_turn)
        excess = max(abs(left) / self.full_speed_left, abs(right) / self.full_speed_right, 1.0)
        return (
            self.wheel_duty(left / excess, right=False),
            self.wheel_duty(right / excess, right=True),
            round(math.degrees(servo) * 100),
        )

    def to_steering(self, centidegrees: int) -> float:
        """Angle of the virtual front wheel (rad) for a steering value of the link."""
        return (math.radians(centidegrees / 100) - self.servo_center) / self.servo_scale

    def to_odometry(
        self,
        telemetry: Telemetry,
        stamp: float,
        previous: Telemetry | None = None,
        features: Features = Features.NONE,
    ) -> Odometry:
        """What moves the robot from ``stamp`` on, by the duty that the board applies (Eqs. 4-9).

        With encoders (``features``, ``counts_per_metre``, and the ``previous`` telemetry of the
        same session) the speed is the mean over the time since then.
        """
        steering = self.to_steering(telemetry.steering)
        measured = self._encoder_speed(telemetry, previous, features)
        if measured is not None:
            return Odometry(stamp, measured, steering)
        left, right = telemetry.duty
        speed = (self.wheel_speed(left, right=False) + self.wheel_speed(right, right=True)) / 2
        return Odometry(stamp, speed, steering)

    def _encoder_speed(
        self, telemetry: Telemetry, previous: Telemetry | None, features: Features
    ) -> float | None:
        if previous is None or not self.counts_per_metre or Features.ENCODERS not in features:
            return None
        elapsed = ((telemetry.t_ms - previous.t_ms) & 0xFFFFFFFF) / 1000
        if elapsed == 0:
            return None
        counts = sum(
            _signed32(new - old)
            for new, old in zip(telemetry.odometer, previous.odometer, strict=True)
        )
        return counts / 2 / self.counts_per_metre / elapsed


def _signed32(difference: int) -> int:
    """A difference of two counters that wrap at 32 bits."""
    return (difference + (1 << 31)) % (1 << 32) - (1 << 31)
