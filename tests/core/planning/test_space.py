"""Where the robot's centre may be: many points at once, as one by one."""

from __future__ import annotations

import numpy as np
import shapely
from core.planning import maps

from polepilot.core.planning.options import PlanOptions
from polepilot.core.planning.space import SLACK, free_space


def test_points_looked_up_in_squares_are_those_the_free_space_holds() -> None:
    space = free_space(maps.office(), PlanOptions())
    x0, y0, x1, y1 = space.polygon.bounds
    rng = np.random.default_rng(8)
    points = rng.uniform((x0 - 3, y0 - 3), (x1 + 3, y1 + 3), (4000, 2))
    rim = shapely.get_coordinates(shapely.segmentize(space.polygon.boundary, 0.03))
    near = np.repeat(rim, 3, axis=0) + rng.normal(0, 0.01, (3 * len(rim), 2))
    loose = space.polygon.buffer(SLACK, join_style="mitre")
    for some in (points, near, points[:300], near[::-1], rim):
        found = space.holds_each(some)
        assert np.array_equal(found, shapely.intersects_xy(loose, *some.T))
        # One at a time is the same.
        assert [bool(space.holds_each(point[None])[0]) for point in some[:20]] == list(found[:20])
    assert space.holds_each(rim).all()
