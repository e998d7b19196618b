"""From pixels to metres and radians, and from the picture to the robot.

The optical axis is horizontal, the picture upright. A landmark is vertical, so one segment of its
front covers ``constant * segment / depth`` pixels at every height (Eq. 1). Deviations from Eq. 1,
which takes depth for range: the depth along the optical axis becomes a horizontal distance
(1 / cos(bearing)), and the axis lies behind the surface that is seen.
"""

from __future__ import annotations

import math

from polepilot.core.geometry import wrap_angle
from polepilot.core.landmark import LandmarkKind
from polepilot.core.observation import Detection, RangeBearing
from polepilot.core.vehicle import Camera


def depth_of(length: float, pixels: float, constant: float) -> float:
    """Eq. 1, r = C h1 / h2: depth (m) of something ``length`` m long that covers ``pixels``."""
    return constant * length / pixels


def pixels_of(length: float, depth: float, constant: float) -> float:
    """Eq. 1 the other way round: 0.65 m at 3 m with C = 600 covers 130 pixels."""
    return constant * length / depth


def bearing_of(column: float, camera: Camera) -> float:
    """Direction of a column from the optical axis, left positive, radians."""
    return math.atan2(camera.center_x - column, camera.constant)


def column_of(bearing: float, camera: Camera) -> float:
    """The column in which a bearing (within +- pi/2) is seen; may lie outside the picture."""
    return camera.center_x - camera.constant * math.tan(bearing)


def range_of(
    unit: float, bearing: float, kind: LandmarkKind, camera: Camera, front: float = 1.0
) -> float:
    """Horizontal distance from the camera's vertical axis to the landmark's axis, metres.

    Args:
        unit: pixels per segment.
        bearing: of the landmark from the optical axis, radians.
        front: how far the surface that was measured stands out from the axis, as a share of
            ``kind.axis_depth``: 1 for the middle column of a cylinder, less towards its sides.
    """
    depth = depth_of(kind.segment, unit, camera.constant)
    return depth / math.cos(bearing) + front * kind.axis_depth


def half_width_of(distance: float, bearing: float, kind: LandmarkKind, camera: Camera) -> float:
    """Half of the pixels that the landmark covers from left to right."""
    half = math.asin(min(kind.diameter / 2 / distance, 1.0))
    left = column_of(min(bearing + half, 1.5), camera)
    return (column_of(max(bearing - half, -1.5), camera) - left) / 2


def to_range_bearing(detection: Detection, stamp: float, pan: float) -> RangeBearing:
    """A detection as seen from the robot: ``pan`` is where the camera looked at ``stamp``.

    The range's origin stays the pan axis; the bearing becomes one from the robot's heading.
    """
    return RangeBearing(
        stamp=stamp,
        landmark=detection.id,
        range=detection.range,
        bearing=wrap_angle(pan + detection.bearing),
        range_sigma=detection.range_sigma,
        bearing_sigma=detection.bearing_sigma,
        pan=pan,
    )
