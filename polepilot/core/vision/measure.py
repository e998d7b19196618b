"""From pixels to metres and radians, and from the picture to the robot.

One segment of a landmark's front covers ``constant * segment / depth`` pixels (Eq. 1). Deviations
from Eq. 1, which takes that depth for the range: the depth along the optical axis becomes a
horizontal distance (1 / cos(bearing)), the axis lies behind the surface that is seen, and a camera
that looks up or down sees a vertical pole longer or shorter than it is.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from polepilot.core.geometry import wrap_angle
from polepilot.core.landmark import LandmarkKind
from polepilot.core.observation import Detection, RangeBearing
from polepilot.core.vehicle import Camera
from polepilot.core.vision.kernel import Strip
from polepilot.core.vision.lens import undistort

PITCH_PRIOR = math.radians(1.5)
"""A camera that is meant to look level does so within this."""
TILT = math.radians(0.5)
"""A landmark that is meant to stand upright does so within this."""
FOOT_SIGMA = 0.05
"""Metres by which the foot of a landmark may stand higher or lower than the robot's floor."""
MOST_PITCH = math.radians(6)
"""Where a landmark's foot seems to be farther off than this, it does not stand on the floor."""
LEVEL = math.radians(2.5)
"""A camera looks up or down by no more than this."""
HIGHEST = 2.0
"""Metres above the floor at which a landmark's middle may be, and half of its height more."""
UNIT_FACTOR = 1.15
"""By how much the scale is less certain than a fit with independent noise says."""
COLUMN_FACTOR = 1.5
COLUMN_FLOOR = 0.13
"""Pixels by which the strip's middle is uncertain besides what the fit knows."""
LEAN_SIGMA = 0.004
"""Columns per row by which a strip's lean is uncertain."""


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
    unit: float,
    bearing: float,
    kind: LandmarkKind,
    camera: Camera,
    front: float = 1.0,
    aside: float = 0.0,
) -> float:
    """Horizontal distance from a level camera's vertical axis to the landmark's axis, metres.

    Args:
        unit: pixels per segment.
        bearing: of the landmark from the optical axis, radians.
        front: how far the surface that was measured stands out from the axis, as a share of
            ``kind.axis_depth``: 1 for the middle column of a cylinder, less towards its sides.
        aside: how far to the right of the axis that surface is, as a share of half its diameter:
            away from the picture's middle that is nearer along the optical axis, or farther.
    """
    depth = depth_of(kind.segment, unit, camera.constant)
    shift = aside * math.tan(bearing) * kind.diameter / 2
    return depth / math.cos(bearing) + front * kind.axis_depth - shift


@dataclass(frozen=True, slots=True)
class Pitch:
    """How far the camera looks up (radians) in one picture, and how sure that is."""

    angle: float
    sigma: float


def pitch_of(strips: Sequence[tuple[Strip, LandmarkKind]], camera: Camera) -> Pitch:
    """The camera's pitch, from all landmarks of a picture together.

    Three witnesses: it is meant to look level; a pole's segments crowd towards the end that is
    farther away (`Strip.sag`: near poles tell); a pole's foot stands on the floor
    (``camera.mount_height`` below: far poles tell).
    """
    weight = 1 / PITCH_PRIOR**2
    total = 0.0
    constant = camera.constant
    for strip, kind in strips:
        # sag = -segment sin(pitch) / depth, and depth = C segment / unit.
        by_pixels = constant / strip.unit
        variance = (strip.sag_sigma * by_pixels) ** 2 + TILT**2
        if variance < (10 * PITCH_PRIOR) ** 2:
            total -= strip.sag * by_pixels / variance
            weight += 1 / variance
        depth = by_pixels * kind.segment
        seen = math.atan2(camera.center_y - strip.row, constant)
        standing = math.atan2(kind.height / 2 - camera.mount_height, depth)
        if abs(standing - seen) < MOST_PITCH:
            variance = (FOOT_SIGMA / depth) ** 2 + 0.002**2
            total += (standing - seen) / variance
            weight += 1 / variance
    return Pitch(total / weight, 1 / math.sqrt(weight))


def is_cut(strip: Strip, kind: LandmarkKind, camera: Camera) -> bool:
    """Whether more than half of an end bar lies above or below the picture."""
    inner = kind.segments / 2 - 1
    row, reach, bend = strip.row, strip.unit * inner, strip.sag * inner
    return row - reach / (1 - bend) < -0.5 or row + reach / (1 + bend) > camera.height - 0.5


def stands(strip: Strip, kind: LandmarkKind, camera: Camera, cut: bool = False) -> bool:
    """Whether a strip is where a landmark can be: not under the floor, nor out of a hand's reach.

    Far stripes of other things are told from landmarks by this more than by anything else.
    Of one that the picture has ``cut`` less is seen, so it has to stand on the floor.
    """
    constant, above, height = camera.constant, camera.mount_height, kind.height
    depth = constant * kind.segment / strip.unit
    seen = math.atan2(camera.center_y - strip.row, constant)
    lowest = depth * math.tan(min(seen + LEVEL, 1.5)) + above
    highest = depth * math.tan(max(seen - LEVEL, -1.5)) + above
    most = height / 2 + 3 * FOOT_SIGMA if cut else HIGHEST + height / 2
    return lowest > -0.1 * height and highest < most


def through_pinhole(strip: Strip, kind: LandmarkKind, camera: Camera) -> Strip:
    """``strip`` as it would be seen without the lens's distortion.

    A lens moves the edges of segments and bows the strip. Each edge goes from where the kernel's
    model has it, on a straight line, to where a pinhole would draw it, and the same model is fitted
    to the same edges there: what it leaves over is alike in both, so that it cancels out.
    Where the lens draws nothing all becomes nan, and such a strip ``stands`` nowhere.
    """
    code, half = strip.code, kind.segments / 2
    # The outer edges, often hardly a step against what is behind, count for little in the kernel.
    places = np.array([k for k in range(1, kind.segments) if code[k] != code[k - 1]]) - half
    rows = strip.unit * places / (1 + strip.sag * places)
    # Beyond the picture nothing was seen, and what is known of the lens need not hold.
    seen = (strip.row + rows > -0.5) & (strip.row + rows < camera.height - 0.5)
    places, rows = places[seen], rows[seen]
    line = np.column_stack([strip.column + strip.lean * rows, strip.row + rows])
    sides = [(strip.column + side, strip.row) for side in (-0.5, 0.5)]
    points = undistort(np.vstack([line, sides]), camera)
    ideal = Strip.from_buffer_copy(strip)
    if not np.isfinite(points).all():
        ideal.column = ideal.row = ideal.unit = math.nan
        return ideal
    columns, rows = points[:-2].T
    middle = rows.mean()
    # row = first + unit * k / (1 + sag * k), linear in its three unknowns.
    system = np.column_stack([np.ones_like(places), places, -places * (rows - middle)])
    first, slope, sag = np.linalg.lstsq(system, rows - middle, rcond=None)[0]
    lean = np.cov(columns, rows)[0, 1] / np.var(rows, ddof=1)
    ideal.row = middle + first
    ideal.unit = slope - first * sag
    ideal.sag = sag
    ideal.lean = lean
    ideal.column = columns.mean() + lean * first
    ideal.column_sigma = strip.column_sigma * (points[-1, 0] - points[-2, 0])
    return ideal


def _whole(strip: Strip, camera: Camera) -> tuple[float, float, float]:
    """Column, `Strip.front` and `Strip.aside` of a strip; of one side the picture may show nothing.

    To the other one the kernel adds half of the width that a landmark has in the picture's middle.
    Off the optical axis a round one is wider, by 1 / cos of that angle.
    """
    if strip.sides == 2:
        return strip.column, strip.front, strip.aside
    off = strip.column - camera.center_x
    wider = math.copysign(math.hypot(1, off / camera.constant) - 1, off)
    aside = max(-1.0, min(strip.aside - wider, 1.0))
    lower = math.sqrt(1 - aside**2) - math.sqrt(max(1 - strip.aside**2, 0.0))
    return strip.column + wider * strip.width / 2, strip.front + lower, aside


def measure(
    strip: Strip,
    kind: LandmarkKind,
    pitch: Pitch,
    camera: Camera,
    seen: Strip | None = None,
) -> Detection:
    """A strip that was read, in metres and radians.

    Args:
        strip: as a pinhole sees it; ``through_pinhole`` where the lens bends.
        seen: as the picture shows it, where that is something else.

    With the optical axis raised by the pitch, a piece of a vertical pole seen at elevation e, at
    the angle a from the optical axis, covers cos(a)^2 / cos(e)^2 more pixels than Eq. 1 says.
    """
    # Rolling shutter and roll both lean a strip about the middle row: there it is where the
    # landmark stands at the picture's stamp.
    constant = camera.constant
    off = camera.center_y - strip.row
    column, front, aside = _whole(strip, camera)
    column += strip.lean * off
    bearing = math.atan2((camera.center_x - column) * math.cos(pitch.angle), constant)
    rise = off / constant
    elevation = math.tan(math.atan(rise) + pitch.angle)
    longer = (1 + rise * rise) / (1 + elevation * elevation)
    distance = range_of(strip.unit / longer, bearing, kind, camera, front, aside)
    relative = math.hypot(
        UNIT_FACTOR * strip.unit_sigma, 2 * elevation * pitch.sigma, pitch.sigma**2
    )
    sigma = math.hypot(COLUMN_FACTOR * strip.column_sigma, COLUMN_FLOOR, LEAN_SIGMA * off)
    shown = seen or strip
    half = kind.segments / 2
    row, reach, bend = shown.row, shown.unit * half, shown.sag * half
    return Detection(
        id=strip.id,
        range=distance,
        bearing=bearing,
        column=shown.column,
        top=row - reach / (1 - bend),
        bottom=row + reach / (1 + bend),
        range_sigma=relative * distance,
        bearing_sigma=sigma * math.cos(bearing) ** 2 / constant,
    )


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
