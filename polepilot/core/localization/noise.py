"""What is believed of the robot's errors before the first measurement, and how fast they change."""

from __future__ import annotations

import math
from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class NoiseModel:
    """Errors of odometry, measurements and map. SI units.

    ``*_prior`` are standard deviations at the start, ``*_walk`` per square root of a second,
    ``*_noise`` densities of white noise on the inputs (per square root of a hertz).
    """

    speed_prior: float = 0.04
    speed_walk: float = 0.002
    speed_noise: float = 0.03
    """Of the speed, as a share of it: wheels slip."""
    steering_prior: float = math.radians(1.5)
    steering_walk: float = math.radians(0.02)
    steering_noise: float = math.radians(0.27)
    servo_lag_prior: float = 0.06
    motor_lag_prior: float = 0.05
    slowness_prior: float = 0.20
    """Of the time that the servo needs for a radian, seconds."""
    servo_doubt: float = 0.05
    """Density of the modelled wheel angle's error while the servo is on its way, as a share of
    the way that is left."""
    motor_doubt: float = 0.045
    """The same for the motors on their way to another speed."""
    skid: float = 0.004
    """Unmodelled motion in any direction, metres per square root of a metre driven."""
    range_prior: float = 0.005
    pan_priors: tuple[float, ...] = tuple(
        math.radians(a) for a in (0.25, 0.4, 0.6, 0.5, 0.35, 0.25)
    )
    """Of the Legendre coefficients of the potentiometer's error, from the constant on: the line is
    calibrated, what is left bends by up to 0.3 % of the range, nobody knows how."""
    pan_range: float = math.radians(135)
    """Half of the pan range; the Legendre polynomials live on it."""
    range_floor: float = 0.003
    """Added to every range's error, metres: what the detector does not know of its errors."""
    bearing_floor: float = math.radians(0.10)
    """Added to every bearing's error: quantization, and what six coefficients do not describe."""
    survey_sigma: float = 0.005
    """Of a landmark's mapped position, per axis, metres."""
    position_limit: float = 0.002
    """No standard deviation of x or y is ever believed to be smaller: the map is not better."""
    heading_limit: float = math.radians(0.08)
