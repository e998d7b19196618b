"""How short a path over an area can be: the bound on length over area / tool width, per map.

The outline. A point of a wall is swept only by the disc that touches it there; with a tool as wide
as the robot the path has therefore to follow the whole outline of the free space. That is a proof.

The inside, which the outline leaves. It takes at least its area over the tool's width; and where
the floor is so narrow that n = ceil(W / w) straight passes of a tool of width w are needed, the
n - 2 passes between the two along the walls take the length of what is left, (n - 2) times its area
over W - 2 w. W, the local width, is the diameter of the largest disc that fits on the floor and
holds the place. Above four tools a floor counts as wide: there area over width is all.

In a corridor of 0.5 m that is 1.6 for a tool of 0.4 m, in one of 1 m 1.2; in a hall it is 1. Half
a percent of W is forgiven, as coverage need not be complete, and widths are rounded so that the
bound is rather too low. A serpentine across a corridor is no shorter: (W + w) / W.
"""

from __future__ import annotations

import math

import numpy as np
import shapely

_STEP = 0.025
"""Widths are looked at in steps of this share of the tool."""
_WIDEST = 4.0
"""Tool widths beyond which a floor counts as wide."""
_FORGIVEN = 0.995


def least_ratio(
    free: shapely.Geometry,
    reachable: shapely.Geometry,
    walls: shapely.Geometry,
    tool: float,
    clearance: float,
) -> float:
    """The bound for a robot whose centre may be in ``free`` and whose disc gets to ``reachable``.

    1 where the tool is not as wide as the robot: then nothing is known of the walls.
    """
    area = float(reachable.area)
    if abs(tool - 2 * clearance) > 1e-6 or area <= 0:
        return 1.0
    near = walls.intersection(reachable.buffer(0.001))
    floor = reachable.difference(near.buffer(1e-4)) if not near.is_empty else reachable
    inside = free.buffer(-tool / 2)
    length, before = float(free.boundary.length), float(inside.area)
    for width in tool * np.arange(2.0 + _STEP, _WIDEST + _STEP / 2, _STEP):
        wide = floor.buffer(-width / 2, quad_segs=16).buffer(width / 2, quad_segs=16)
        rest = min(before, float(inside.intersection(wide).area))
        passes = math.ceil(_FORGIVEN * (width / tool - _STEP)) - 2
        length += max(0, passes) * (before - rest) / (width - 2 * tool)
        before = rest
    return max(1.0, (length + before / tool) * tool / area)
