"""The three simulated range sensors: wide beams, noise, a greatest range."""

from __future__ import annotations

import math

import numpy as np

from polepilot.core.geometry import Pose2D
from polepilot.core.scenery import Scenery
from polepilot.core.vehicle import Proximity

HALF_BEAM = math.radians(7.5)
NOISE = 0.01
"""Metres, standard deviation."""


def sense(
    base: Pose2D, proximity: Proximity, scenery: Scenery, rng: np.random.Generator
) -> tuple[int, int, int]:
    """Left, centre, right in millimetres from each sensor.

    An ideal beam reports the nearest thing within it. Where nothing stands within the greatest
    range, that range is reported, as by an infrared ranger.
    """
    left, center, right = (
        _one(base.compose(Pose2D(proximity.forward, 0.0, angle)), proximity.max_range, scenery, rng)
        for angle in proximity.angles
    )
    return left, center, right


def _one(origin: Pose2D, reach: float, scenery: Scenery, rng: np.random.Generator) -> int:
    seen = scenery.in_beam(origin, HALF_BEAM, reach)
    if seen is None:
        return round(reach * 1000)
    noisy = seen + NOISE * float(rng.standard_normal())
    return round(min(max(noisy, 0.0), reach) * 1000)
