"""The paper's tracking of a moving robot, whole: predict, move along the line, filter.

Time encoder gives R_2^1; the one-landmark correction moves it along the line to the landmark so
that the distance agrees with the measured one (R_2^2); the filter of Table 1, axis by axis, gives
R_2^3. The heading comes from the time encoder alone, as in the paper: only a fix corrects it.

Deviation: the paper says nothing of how sure the result is. The covariance here is a plain budget:
what the fix left, plus a share of the way driven since.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from polepilot.core.geometry import Point, Pose2D, wrap_angle
from polepilot.core.landmark import Landmark
from polepilot.core.localization.fix import Fix
from polepilot.core.localization.health import place_of
from polepilot.core.localization.kalman import AxisFilter
from polepilot.core.localization.odometry import (
    NO_LAGS,
    Following,
    OdometryHistory,
    Step,
    advance,
)
from polepilot.core.localization.suspicion import MapMisfit
from polepilot.core.observation import RangeBearing

_POSITION_PER_METRE = 0.06
_HEADING_PER_METRE = 0.04
_RANGE_SHARE = 0.5
"""How much of the doubt along the line a range takes away, through the filter's gain."""


def radial_correction(
    predicted: Pose2D, measurement: RangeBearing, landmark: Landmark, camera_forward: float
) -> Pose2D:
    """R_2^2: ``predicted`` moved along the line from camera to landmark until the range agrees."""
    cx, cy = predicted.ahead(camera_forward)
    dx, dy = landmark.x - cx, landmark.y - cy
    distance = math.hypot(dx, dy)
    if distance < 1e-6:
        return predicted
    excess = 1.0 - measurement.range / distance
    return Pose2D(predicted.x + dx * excess, predicted.y + dy * excess, predicted.heading)


def unfiltered(
    predicted: Pose2D, measurement: RangeBearing, landmark: Landmark, camera_forward: float
) -> Pose2D:
    """R_2^2, with the heading from the bearing."""
    moved = radial_correction(predicted, measurement, landmark, camera_forward)
    camera = predicted.ahead(camera_forward)
    direction = math.atan2(landmark.y - camera[1], landmark.x - camera[0])
    return Pose2D(moved.x, moved.y, wrap_angle(direction - measurement.bearing))


@dataclass(slots=True)
class RadialFilter:
    """Pose by the paper's method. Same verbs as the EKF."""

    wheelbase: float
    camera_forward: float
    pose: Pose2D = field(default_factory=lambda: Pose2D(0.0, 0.0, 0.0))
    x: AxisFilter = field(default_factory=AxisFilter)
    y: AxisFilter = field(default_factory=AxisFilter)
    position_variance: float = 1.0
    heading_variance: float = 1.0

    @property
    def following_errors(self) -> Following:
        """The paper knows of no lags."""
        return NO_LAGS

    def retuned(self, by: Following) -> None:
        """The history's constants were raised by so much: no matter here."""

    @property
    def map_misfit(self) -> MapMisfit:
        """The paper takes the map for right."""
        return MapMisfit()

    def begin(
        self,
        found: Fix,
        stamp: float,
        sightings: Sequence[tuple[RangeBearing, Landmark]],
        history: OdometryHistory,
    ) -> list[RangeBearing]:
        """Start at a fix; the sightings behind it say no more than it does itself."""
        del stamp, sightings, history
        self.reset(found.pose, found.covariance)
        return []

    def supposing(self, landmark: Landmark, place: Point) -> None:
        """The paper has no such thing."""

    def shift_of(self, number: int) -> None:
        """Likewise."""

    def reset(self, pose: Pose2D, covariance: NDArray[np.float64]) -> None:
        self.pose = pose
        self.x, self.y = AxisFilter(value=pose.x), AxisFilter(value=pose.y)
        self.position_variance = float(max(covariance[0, 0], covariance[1, 1]))
        self.heading_variance = float(covariance[2, 2])

    def copy(self) -> RadialFilter:
        return RadialFilter(
            self.wheelbase,
            self.camera_forward,
            self.pose,
            AxisFilter(variance=self.x.variance, value=self.x.value),
            AxisFilter(variance=self.y.variance, value=self.y.value),
            self.position_variance,
            self.heading_variance,
        )

    @property
    def speed_factor(self) -> float:
        """The paper takes the speed as it is told."""
        return 1.0

    @property
    def steering_offset(self) -> float:
        """The paper takes the wheel angle as it is told."""
        return 0.0

    @property
    def pose_covariance(self) -> NDArray[np.float64]:
        return np.diag([self.position_variance, self.position_variance, self.heading_variance])

    def predict(self, steps: Iterable[Step]) -> float:
        """Move by steps of odometry; returns how many seconds of it the robot moved."""
        moving = 0.0
        for step in steps:
            if step.speed == 0.0:
                continue
            moving += step.dt
            self.pose = advance(self.pose, step.speed, step.steering, step.dt, self.wheelbase)
            driven = abs(step.speed) * step.dt
            share = _POSITION_PER_METRE**2 + self.heading_variance * driven
            self.position_variance += share * driven
            self.heading_variance += _HEADING_PER_METRE**2 * driven
        return moving

    def take(
        self, measurement: RangeBearing, landmark: Landmark, tolerance: float
    ) -> tuple[bool, float]:
        """Correct by a range unless it is off by more than ``tolerance`` metres.

        Returns whether it was taken, and how far it was off.
        """
        if not (math.isfinite(measurement.range) and math.isfinite(measurement.range_sigma)):
            return False, 0.0
        camera = self.pose.ahead(self.camera_forward)
        gap = abs(measurement.range - math.dist(camera, landmark.position))
        if gap > tolerance:
            return False, gap
        self.update(measurement, landmark)
        return True, gap

    def appears(self, measurement: RangeBearing) -> Point | None:
        """Where in `map` a landmark appears; None without a range."""
        return place_of(self.pose, measurement, self.camera_forward)

    def update(self, measurement: RangeBearing, landmark: Landmark) -> None:
        """R_2^2 and R_2^3 from one range."""
        moved = radial_correction(self.pose, measurement, landmark, self.camera_forward)
        x = self.x.update(moved.x, self.pose.x)
        y = self.y.update(moved.y, self.pose.y)
        self.pose = Pose2D(x, y, self.pose.heading)
        floor = measurement.range_sigma**2 + 0.02**2
        keep = 1.0 - _RANGE_SHARE * self.x.gain
        self.position_variance = max(keep * self.position_variance, floor)
