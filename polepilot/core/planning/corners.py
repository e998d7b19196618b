"""Ways with few corners: the small ones with which a shortest way bends around something as one.

A wheel that turns no tighter than some radius needs changes of gear at each corner that is tighter,
be it ever so small; at one large corner in their place it needs them once.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from polepilot.core.geometry import Point, angle_between
from polepilot.core.planning.space import FreeSpace

_MOST_TURN = math.radians(100.0)
"""Corners together turn by no more than this."""
_LEAST_TURN = math.radians(0.01)


def with_few_corners(way: Sequence[Point], space: FreeSpace) -> list[Point]:
    """A way in the free space with fewer corners, or as it is; it begins and ends where it did."""
    points = [np.array(point, dtype=float) for point in way]
    done = [points[0]]
    at = 1
    while at < len(points) - 1:
        for last in range(len(points) - 2, at, -1):
            corner = _met(done[-1], points[at], points[last], points[last + 1])
            if corner is not None and space.holds_points(
                np.vstack([done[-1], corner, points[last + 1]])
            ):
                done.append(corner)
                at = last + 1
                break
        else:
            done.append(points[at])
            at += 1
    done.append(points[-1])
    return [(float(x), float(y)) for x, y in done]


def _met(
    a: NDArray[np.float64],
    b: NDArray[np.float64],
    c: NDArray[np.float64],
    d: NDArray[np.float64],
) -> NDArray[np.float64] | None:
    """Where the way on from ``b``, come to from ``a``, meets the way back from ``c``, left to
    ``d``; None: not ahead of either, or at too sharp a corner."""
    on, back = b - a, d - c
    turn = angle_between(math.atan2(on[1], on[0]), math.atan2(back[1], back[0]))
    if not _LEAST_TURN < abs(turn) < _MOST_TURN:
        return None
    cross = on[0] * back[1] - on[1] * back[0]
    between = c - a
    share = (between[0] * back[1] - between[1] * back[0]) / cross
    rest = (between[0] * on[1] - between[1] * on[0]) / cross
    if share < 1.0 or rest > 0.0:
        return None
    return np.asarray(a + share * on)
