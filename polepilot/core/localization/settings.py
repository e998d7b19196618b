"""What the localizer tolerates, and what it believes of the robot."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Literal

from polepilot.core.localization.fix import FixSettings
from polepilot.core.localization.noise import NoiseModel

Method = Literal["ekf", "paper"]


@dataclass(frozen=True, slots=True)
class LocalizerSettings:
    """SI units."""

    method: Method = "ekf"
    tolerance: float = 0.20
    """A landmark may appear this far from where it should be; beyond it, the pose is in doubt."""
    gate: float = 16.0
    """Squared Mahalanobis distance beyond which a measurement is not taken."""
    degraded_after: float = 2.0
    """Seconds of motion without a correction."""
    degraded_sigma: float = 0.10
    lost_after: float = 20.0
    lost_sigma: float = 0.25
    steering_lag: float = 0.10
    """Time constant of the steering servo, seconds; the EKF learns the true one."""
    speed_lag: float = 0.04
    """Time constant of the motors, likewise."""
    steering_slowness: float = 0.22
    """Seconds that the servo needs for a radian at least, likewise."""
    late: float = 1.0
    """Measurements that come at most so many seconds late are applied in their place."""
    fix: FixSettings = field(default_factory=FixSettings)
    noise: NoiseModel = field(default_factory=NoiseModel)
