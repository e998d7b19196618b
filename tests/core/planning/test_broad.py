"""Which missed patches are too broad for bumps, and that ragged ones take no time to tell."""

from __future__ import annotations

import math
import time

import numpy as np
import pytest
import shapely
from plans.shapes import document
from shapely import Point, Polygon

from polepilot.core.planning.bumps import long_for_bumps
from polepilot.core.planning.coverage import _broad, plan_scan
from polepilot.core.planning.options import PlanOptions
from polepilot.core.site import parse_site

TOOL = 0.4


def ragged(radius: float, corners: int, seed: int) -> Polygon:
    """A disc whose outline goes in and out by 2 mm at every corner."""
    turns = np.linspace(0, math.tau, corners, endpoint=False)
    out = radius + np.random.default_rng(seed).uniform(0, 0.002, corners)
    return Polygon(np.stack([2 + out * np.cos(turns), 1 + out * np.sin(turns)], axis=1))


@pytest.mark.parametrize("share", [0.2, 0.34, 0.35, 0.37, 0.38, 0.45])
@pytest.mark.parametrize("corners", [150, 450])
def test_ragged_discs_are_as_broad_as_plain_ones(share: float, corners: int) -> None:
    patch = ragged(share * TOOL, corners, seed=corners)
    plain = Point(2, 1).buffer(share * TOOL)
    assert not long_for_bumps(patch, TOOL)  # else it would not be asked how broad it is
    assert _broad(patch, TOOL) == _broad(plain, TOOL) == (share > 0.36)


def test_a_ragged_ring_is_no_broader_than_its_band() -> None:
    """What tells how broad a patch is leaves its hole where it is."""
    outer, inner = ragged(0.3, 300, 1), ragged(0.1, 300, 2)
    assert not _broad(shapely.difference(outer, inner), TOOL)
    assert _broad(outer, TOOL)


def test_a_map_with_ragged_patches_is_planned_soon() -> None:
    """Narrow corners in which the missed patches have nearly 500 corners each."""
    boundary = [(1.618, 1.228), (1.919, 1.557), (-0.609, 0.927), (-1.555, 1.502)]
    boundary += [(0.858, -1.372), (2.427, -1.341), (0.592, -0.264)]
    site = parse_site(document([list(corner) for corner in boundary]), "narrow corners")
    began = time.process_time()
    plan = plan_scan(site, PlanOptions(tool_width=0.49, clearance=0.14, min_turn_radius=0))
    assert time.process_time() - began < 3.0
    assert plan.predicted.coverage > 0.99
