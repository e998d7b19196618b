"""What a path will do: coverage, length, duration, changes of gear."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from polepilot.core.plan import Prediction
from polepilot.core.planning.options import PlanOptions

_SIDEWAYS = 0.25
"""Sideways acceleration that a plan counts on in curves, m/s²."""


def predict(
    path: NDArray[np.float64],
    gear: NDArray[np.int8],
    options: PlanOptions,
    coverage: float = 1.0,
    swept: float | None = None,
) -> Prediction:
    """Metres, seconds, changes of gear; overlap where it is known how many m² are ``swept``."""
    steps = np.hypot(*np.diff(path, axis=0).T)
    tool, overlap = options.tool_width, 0.0
    if swept is not None:
        strip = steps.sum() * tool + math.pi * tool**2 / 4
        overlap = float(max(0.0, 1.0 - swept / strip))
    return Prediction(
        coverage=min(1.0, coverage),
        length=float(steps.sum()),
        duration=_duration(path, gear, steps, options),
        reversals=int(np.count_nonzero(np.diff(gear))),
        overlap=overlap,
    )


def _duration(
    path: NDArray[np.float64],
    gear: NDArray[np.int8],
    steps: NDArray[np.float64],
    options: PlanOptions,
) -> float:
    """Seconds with limits on speed, on acceleration and in curves, and a stop at each change."""
    if len(steps) == 0 or steps.sum() < 1e-9:
        return 0.0
    keep = steps > 1e-9
    steps, gears = steps[keep], gear[keep].astype(float)
    moves = np.diff(path, axis=0)[keep]
    heading = np.arctan2(moves[:, 1] * gears, moves[:, 0] * gears)
    turns = np.abs((np.diff(heading) + math.pi) % math.tau - math.pi)
    bend = turns / np.maximum((steps[:-1] + steps[1:]) / 2, 1e-6)
    corner = np.minimum(options.max_speed, np.sqrt(_SIDEWAYS / np.maximum(bend, 1e-6)))
    changed = gears[:-1] != gears[1:]
    corner[changed] = 0.0
    limit = np.r_[0.0, corner, 0.0]
    speed = limit.copy()
    for index in range(1, len(speed)):
        reach = math.sqrt(speed[index - 1] ** 2 + 2 * options.max_acceleration * steps[index - 1])
        speed[index] = min(limit[index], reach)
    for index in range(len(speed) - 2, -1, -1):
        reach = math.sqrt(speed[index + 1] ** 2 + 2 * options.max_acceleration * steps[index])
        speed[index] = min(speed[index], reach)
    # Each step: up to the cruising speed and down again, as far as its length allows.
    a = options.max_acceleration
    first, last = speed[:-1], speed[1:]
    top = np.minimum(options.max_speed, np.sqrt((2 * a * steps + first**2 + last**2) / 2))
    top = np.maximum(top, np.maximum(first, last))
    rest = np.maximum(steps - (2 * top**2 - first**2 - last**2) / (2 * a), 0.0)
    time = (2 * top - first - last) / a + rest / np.maximum(top, 1e-6)
    return float(time.sum() + options.reversal_time * np.count_nonzero(changed))
