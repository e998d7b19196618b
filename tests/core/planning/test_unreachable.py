"""What cannot be reached, as polygons that other programs can work with."""

from __future__ import annotations

import numpy as np
import pytest
import shapely
from shapely import Polygon

from polepilot.core.planning.unreachable import _on_grid, _ring


@pytest.mark.parametrize("seed", range(20))
def test_corners_that_nearly_touch_stay_sound_on_the_grid(seed: int) -> None:
    """A corner 0.02 mm from a slanting side: rounded each by itself, they would cross."""
    rng = np.random.default_rng(seed)
    side = np.array([[0.0, 0.0], [2.0, rng.uniform(0.3, 0.9)]])
    step = side[1] / np.hypot(*side[1])
    tip = side[1] * rng.uniform(0.3, 0.7) + 2e-5 * np.array([-step[1], step[0]])
    right, left = np.array([0.2, 0.4]), np.array([-0.2, 0.4])
    piece = Polygon([*side, (2, 1.5), tip + right, tip, tip + left, (0, 1.5)])
    assert piece.is_valid
    parts = [Polygon(_ring(part)) for part in _on_grid(piece)]
    assert all(part.is_valid and not part.interiors for part in parts)
    assert shapely.union_all(parts).area == pytest.approx(piece.area, abs=0.001)
    corners = np.vstack([np.asarray(part.exterior.coords) for part in parts])
    assert np.abs(corners * 1e4 - np.rint(corners * 1e4)).max() < 1e-6
