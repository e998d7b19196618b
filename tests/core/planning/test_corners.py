"""Ways with few corners, and what that saves a wheel in gaps hardly wider than the robot."""

from __future__ import annotations

import math

import numpy as np
import pytest
from core.planning import maps

from polepilot.core.planning.corners import with_few_corners
from polepilot.core.planning.options import PlanOptions
from polepilot.core.planning.route import plan_route
from polepilot.core.planning.space import FreeSpace, free_space
from polepilot.core.site import Site, Start


def _gap(width: float) -> Site:
    walls = [[[2.5, 0], [2.5, 2 - width / 2]], [[2.5, 2 + width / 2], [2.5, 4]]]
    return maps.site(maps.box(0, 0, 5, 4), walls=walls)


@pytest.fixture
def space() -> FreeSpace:
    return free_space(_gap(0.6), PlanOptions(start=Start(1, 1)))


@pytest.mark.parametrize("there", [(4.0, 1.0), (4.0, 3.0), (2.75, 0.6), (1.5, 3.5)])
def test_a_bend_is_one_corner_or_two(space: FreeSpace, there: tuple[float, float]) -> None:
    way = space.shortest_path((1.0, 1.0), there)
    assert way is not None
    few = with_few_corners(way, space)
    assert few[0] == way[0]
    assert few[-1] == way[-1]
    assert len(few) <= min(5, len(way))
    assert space.holds_points(np.array(few))
    lengths = [float(np.hypot(*np.diff(np.array(line), axis=0).T).sum()) for line in (way, few)]
    assert lengths[0] - 1e-9 <= lengths[1] < 1.2 * lengths[0]


def test_corners_that_are_not_free_stay(space: FreeSpace) -> None:
    straight = [(1.0, 1.0), (1.0, 3.0)]
    assert with_few_corners(straight, space) == straight
    # Both walls' ends are passed closely, on the one side and on the other: no corner is spared.
    sharp = [(1.0, 1.0), (1.0, 3.0), (2.0, 3.0), (2.0, 1.0)]
    assert with_few_corners(sharp, space) == sharp


@pytest.mark.parametrize("width", [0.4005, 0.405, 0.41, 0.45])
@pytest.mark.parametrize(("here", "there"), [((1, 1), (4, 3)), ((1, 3.2), (4, 0.8))])
def test_gaps_hardly_wider_than_the_robot_take_few_changes_of_gear(
    width: float, here: tuple[float, float], there: tuple[float, float]
) -> None:
    plan = plan_route(_gap(width), [there], PlanOptions(start=Start(*here, 0.3)))
    assert plan.predicted.reversals <= 6
    assert plan.predicted.length < 1.6 * math.dist(here, there)
    lengths = np.hypot(*np.diff(plan.path, axis=0).T)
    bounds = np.r_[0, np.flatnonzero(np.diff(plan.gear)) + 1]
    assert np.add.reduceat(lengths, bounds).min() > 0.01
