"""Landmark sightings drawn from the detector's error model, without pictures."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from polepilot.core.detector_model import (
    BEARING_SIGMA,
    BORDER,
    DROP_OUT,
    NEAREST,
    SIGHT_MARGIN,
    farthest,
    range_sigma,
    scale_of,
)
from polepilot.core.geometry import Point, Pose2D
from polepilot.core.landmark import Landmark
from polepilot.core.observation import Detection
from polepilot.core.scenery import Scenery
from polepilot.core.vehicle import Camera


def sightings(
    camera: Camera,
    pose: Pose2D,
    landmarks: Sequence[Landmark],
    sight: Scenery,
    rng: np.random.Generator,
) -> tuple[Detection, ...]:
    """What the detector would read in one picture, nearest first.

    A landmark is read where its whole code lies within the picture and nothing stands in
    between; errors are Gaussian with the sigmas that the detections carry.

    Args:
        pose: pan axis and looking direction in `map` at mid exposure.
        sight: walls and people that hide landmarks.
    """
    seen: list[Detection] = []
    shadows: list[tuple[float, float]] = []
    for mark in sorted(landmarks, key=lambda mark: pose.distance_to(mark.position)):
        away = pose.distance_to(mark.position)
        bearing = pose.bearing_to(mark.position)
        if away < NEAREST or abs(bearing) > camera.half_view + 0.05:
            continue
        covered = any(abs(bearing - middle) < half for middle, half in shadows)
        shadows.append((bearing, math.atan2(mark.kind.diameter / 2, away)))
        if covered or _hidden(pose, mark.position, away, sight):
            continue
        if rng.random() < DROP_OUT:
            continue
        detection = _measure(camera, mark, away, bearing, rng)
        if detection is not None:
            seen.append(detection)
    return tuple(seen)


def _hidden(pose: Pose2D, mark: Point, away: float, sight: Scenery) -> bool:
    share = max(away - SIGHT_MARGIN, 0.0) / away
    short = (pose.x + share * (mark[0] - pose.x), pose.y + share * (mark[1] - pose.y))
    return sight.blocked(pose.position, short)


def _measure(
    camera: Camera, mark: Landmark, away: float, bearing: float, rng: np.random.Generator
) -> Detection | None:
    """The detection of one landmark in the open, or None where its code is not in the picture."""
    scale = scale_of(camera, mark.kind, away, math.cos(bearing))
    height = mark.kind.height
    column = camera.center_x - camera.constant * math.tan(bearing)
    top = camera.center_y - scale * (height - camera.mount_height)
    bottom = camera.center_y + scale * camera.mount_height
    inside = (
        BORDER <= column <= camera.width - 1 - BORDER
        and top >= BORDER
        and bottom <= camera.height - 1 - BORDER
    )
    if not inside or away > farthest(mark.kind):
        return None
    sigma = range_sigma(camera, mark.kind, away, math.cos(bearing))
    range_error, bearing_error = rng.standard_normal(2)
    measured = away + sigma * float(range_error)
    direction = bearing + BEARING_SIGMA * float(bearing_error)
    # The picture that goes with the measured values, so that the two do not contradict.
    scale = scale_of(camera, mark.kind, measured, math.cos(direction))
    return Detection(
        id=mark.id,
        range=measured,
        bearing=direction,
        column=camera.center_x - camera.constant * math.tan(direction),
        top=camera.center_y - scale * (height - camera.mount_height),
        bottom=camera.center_y + scale * camera.mount_height,
        range_sigma=sigma,
        bearing_sigma=BEARING_SIGMA,
    )
