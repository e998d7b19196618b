"""What the robot senses. Stamps are seconds of the robot's monotonic clock.

Frames of reference: `camera` sits on the pan axis, ``Vehicle.camera_forward`` ahead of
`base_link`. A bearing is positive to the left.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum

import numpy as np
from numpy.typing import NDArray

from polepilot.core.geometry import Pose2D

Image = NDArray[np.uint8]
"""Rows x columns x 3, blue-green-red, or rows x columns for a monochrome camera."""


@dataclass(frozen=True, slots=True, eq=False)
class Frame:
    """One picture. ``stamp`` is the middle of the exposure of its middle row."""

    stamp: float
    image: Image


@dataclass(frozen=True, slots=True)
class Detection:
    """A landmark's strip in a picture, read and measured.

    ``range`` is horizontal, from the camera's vertical axis to the landmark's axis; ``bearing``
    is measured from the optical axis. ``column``, ``top`` and ``bottom`` are pixel positions
    (centres of pixels are integers) of the strip's middle and of the code's outer edges.
    """

    id: int
    range: float
    bearing: float
    column: float
    top: float
    bottom: float
    range_sigma: float
    bearing_sigma: float


@dataclass(frozen=True, slots=True)
class RangeBearing:
    """A landmark measured from the robot: ``bearing`` is from the robot's heading (pan added).

    The origin is the camera's axis, not `base_link`.
    """

    stamp: float
    landmark: int
    range: float
    bearing: float
    range_sigma: float
    bearing_sigma: float
    pan: float | None = None
    """Where the camera pointed, where known: the potentiometer's error depends on it."""


@dataclass(frozen=True, slots=True)
class Odometry:
    """How the robot moves from ``stamp`` until the next Odometry.

    ``speed`` is that of `base_link` (m/s, backward negative), ``steering`` the angle of the
    virtual front wheel (left positive). Either comes from applied commands (the paper's time
    encoder) or from wheel encoders where the board has them.
    """

    stamp: float
    speed: float
    steering: float


@dataclass(frozen=True, slots=True)
class PanReading:
    """Where the camera points, left of straight ahead positive, from the potentiometer."""

    stamp: float
    angle: float


class Status(StrEnum):
    """How well the pose is known."""

    FIXING = "fixing"
    """Standing and sweeping for landmarks; no pose yet."""
    TRACKING = "tracking"
    DEGRADED = "degraded"
    """Still usable, but without a correction for a while or with contradictions."""
    LOST = "lost"
    """Not to be driven by."""


@dataclass(frozen=True, slots=True, eq=False)
class PoseEstimate:
    """The pose of `base_link` in `map` at ``stamp``, with a 3x3 covariance (m², m·rad, rad²)."""

    stamp: float
    pose: Pose2D
    covariance: NDArray[np.float64]
    status: Status
    reason: str = ""
    """Why the status is not TRACKING, for a person."""

    @property
    def position_sigma(self) -> float:
        """Standard deviation along the worst direction, metres."""
        return float(np.sqrt(np.linalg.eigvalsh(self.covariance[:2, :2])[-1]))

    @property
    def heading_sigma(self) -> float:
        """Standard deviation of the heading, radians."""
        return float(np.sqrt(self.covariance[2, 2]))
