"""What a simulated board reads from its pins, what it puts there, and what is compiled into it."""

from __future__ import annotations

import math
from dataclasses import dataclass

from polepilot.core.errors import InternalError
from polepilot.core.link.messages import NO_SENSOR, Features
from polepilot.core.vehicle import RobotModel

_PAN_MARGIN = 8
"""ADC counts between the pan motor's end stops and the ends of its potentiometer."""


@dataclass(frozen=True, slots=True)
class BoardSettings:
    """What is compiled into one robot's firmware (``firmware/core/settings.h``)."""

    features: Features = Features.PROXIMITY | Features.BATTERY | Features.PAN
    """By default no encoders: the paper's robot counts time, not turns."""
    max_steering: int = 4500
    """Centidegrees."""
    duty_slew: int = 4
    """Largest change of a wheel's duty, per mille per millisecond."""
    pan_slew: int = 10
    """The same for the pan motor."""
    steering_slew: int = 40
    """Centidegrees per millisecond."""
    hard_limits_mm: tuple[int, int, int] = (107, 100, 107)
    """Left, centre, right: nearer than this to the sensor nothing turns forward."""
    pan_low: int = 8
    """ADC counts: at or below, the pan motor turns only back."""
    pan_high: int = 1015
    pan_rising: bool = True
    """Whether the counts rise as the camera turns left."""
    pan_stuck_ms: int = 1000
    pan_stuck_counts: int = 3
    pan_stuck_duty: int = 300
    """At this duty or more, fewer counts in that time mean a stuck motor."""
    low_battery_mv: int = 9900
    battery_hysteresis_mv: int = 200

    def __post_init__(self) -> None:
        for name in ("duty_slew", "pan_slew", "steering_slew"):
            if getattr(self, name) < 1:
                raise InternalError(f"{name} is {getattr(self, name)} a millisecond, at least 1")

    @classmethod
    def from_model(
        cls,
        model: RobotModel,
        features: Features = Features.PROXIMITY | Features.BATTERY | Features.PAN,
    ) -> BoardSettings:
        """For this body: the hard limit is measured from the disc that holds it.

        A sensor sits inside or ahead of that disc; along its direction the edge is at the
        positive root of ``|(forward, 0) + r (cos a, sin a)| = body_radius``.
        """
        radius, proximity = model.vehicle.body_radius, model.proximity
        limits = []
        for angle in proximity.angles:
            along = proximity.forward * math.cos(angle)
            discriminant = along**2 - proximity.forward**2 + radius**2
            edge = max(0.0, -along + math.sqrt(discriminant)) if discriminant > 0 else 0.0
            limits.append(round((edge + proximity.hard_limit) * 1000))
        left, center, right = limits
        ends = sorted((model.pan.adc_at_minimum, model.pan.adc_at_maximum))
        return cls(
            features=features,
            hard_limits_mm=(left, center, right),
            pan_low=ends[0] + _PAN_MARGIN,
            pan_high=ends[1] - _PAN_MARGIN,
            pan_rising=model.pan.adc_at_minimum < model.pan.adc_at_maximum,
        )


@dataclass(frozen=True, slots=True)
class BoardInputs:
    """What the pins say."""

    pan_adc: int = 512
    proximity_mm: tuple[int, int, int] = (NO_SENSOR, NO_SENSOR, NO_SENSOR)
    """Left, centre, right, from each sensor; its greatest range where nothing is in sight."""
    battery_mv: int = 12000
    odometer: tuple[int, int] = (0, 0)
    """Encoder counts since power-up, left and right."""
    stop_button: bool = False


@dataclass(frozen=True, slots=True)
class BoardOutputs:
    """What the motors get."""

    left: int = 0
    """Duty, per mille, forward positive."""
    right: int = 0
    steering: int = 0
    """Centidegrees, left positive."""
    pan: int = 0
    """Duty, per mille, left positive."""

    @property
    def steering_angle(self) -> float:
        """Radians."""
        return math.radians(self.steering / 100)
