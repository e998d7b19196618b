"""The robot's body: wheels, camera, pan unit, proximity sensors. Metres, radians, seconds."""

from __future__ import annotations

import math
from dataclasses import dataclass

from polepilot.core.errors import ConfigError
from polepilot.core.geometry import Pose2D


@dataclass(frozen=True, slots=True)
class Vehicle:
    """A steered front wheel and two driven rear wheels; `base_link` is midway between those.

    ``tool_width``, ``clearance`` and ``turn_radius_margin`` are what plans use where a user
    does not say otherwise.
    """

    wheelbase: float = 0.20
    """From the rear axle to the front axle (the paper's l1 + l2)."""
    track: float = 0.20
    """Between the rear wheels (the paper's w)."""
    body_radius: float = 0.14
    """Of the disc around `base_link` that holds the whole body."""
    max_steering: float = math.atan2(0.20, 0.30)
    """Of the virtual front wheel, to either side."""
    steering_rate: float = 2.0
    """How fast the servo turns, rad/s."""
    max_speed: float = 0.40
    max_acceleration: float = 0.60
    tool_width: float = 0.40
    clearance: float = 0.20
    """How near the path may come to a wall."""
    turn_radius_margin: float = 1.2
    """Plans turn no tighter than this times the tightest turn, so that control has room."""

    @property
    def min_turn_radius(self) -> float:
        """The tightest circle of `base_link` that the steering allows."""
        return self.wheelbase / math.tan(self.max_steering)

    @property
    def plan_turn_radius(self) -> float:
        """The tightest circle that plans for this vehicle use."""
        return self.min_turn_radius * self.turn_radius_margin


@dataclass(frozen=True, slots=True)
class Camera:
    """Pinhole camera (the paper's constant C in pixels) and where it sits on the robot."""

    constant: float = 600.0
    """Focal length in pixels, for ``width`` x ``height`` pictures."""
    width: int = 400
    height: int = 300
    center_x: float = 199.5
    """Column of the optical axis; pixel centres are integers."""
    center_y: float = 149.5
    forward: float = 0.10
    """Of the pan axis ahead of `base_link` (the paper's l2)."""
    mount_height: float = 0.40
    """Of the lens above the floor."""
    rate: float = 15.0
    """Frames per second asked for."""
    distortion: tuple[float, ...] = ()
    """Of the lens: k1, k2, p1, p2, k3 in OpenCV's order (`core/vision/lens.py`); empty is ideal."""

    def __post_init__(self) -> None:
        if len(self.distortion) not in (0, 5):
            raise ConfigError(
                f"camera: distortion has {len(self.distortion)} numbers: expected k1, k2, p1, p2, "
                "k3, or none."
            )

    @property
    def half_view(self) -> float:
        """Half of the horizontal angle of view, radians."""
        return math.atan2(self.width / 2, self.constant)

    def pose_on(self, base: Pose2D) -> Pose2D:
        """The pose of the pan axis in `map`, looking along the robot's heading."""
        return base.compose(Pose2D(self.forward, 0.0, 0.0))


@dataclass(frozen=True, slots=True)
class PanUnit:
    """The motor that turns the camera to and fro, and its potentiometer."""

    minimum: float = math.radians(-135)
    maximum: float = math.radians(135)
    rate: float = math.radians(45)
    """At full duty."""
    sweep_duty: float = 1.0
    """Share of the full duty while sweeping."""
    adc_at_minimum: int = 0
    adc_at_maximum: int = 1023

    def angle(self, adc: float) -> float:
        """Counts of the potentiometer's converter to radians; linear (paper, "pan angle")."""
        share = (adc - self.adc_at_minimum) / (self.adc_at_maximum - self.adc_at_minimum)
        return self.minimum + share * (self.maximum - self.minimum)


@dataclass(frozen=True, slots=True)
class Proximity:
    """Three range sensors at the front: left, centre, right."""

    angles: tuple[float, float, float] = (math.radians(45), 0.0, math.radians(-45))
    """Their directions from straight ahead. The paper's "450 degrees" is a misprint."""
    forward: float = 0.12
    """How far ahead of `base_link` they sit."""
    max_range: float = 1.5
    hard_limit: float = 0.08
    """Nearer than this ahead of the body the firmware stops forward motion by itself."""


@dataclass(frozen=True, slots=True)
class RobotModel:
    """All parts together: what `robot.toml` describes."""

    vehicle: Vehicle = Vehicle()
    camera: Camera = Camera()
    pan: PanUnit = PanUnit()
    proximity: Proximity = Proximity()
