"""Steps so short that digits turn them: none in a plan as it is written."""

from __future__ import annotations

import math

import numpy as np
import pytest
from numpy.typing import NDArray
from plans.final import planned
from plans.sets import DEVELOPMENT, by_lot
from plans.shapes import box, document

from polepilot.core.planning.crumbs import SHORTEST, without_crumbs
from polepilot.core.planning.options import PlanOptions
from polepilot.core.planning.space import FreeSpace, free_space
from polepilot.core.site import parse_site

RADIUS = 0.6


def sharpness(path: NDArray[np.float64], gear: NDArray[np.int_]) -> float:
    """By how much, at most, a path turns more than a wheel of 0.6 m does, radians; every vertex
    and change of gear as it is written. 0.02 rad is what four digits do to steps of a centimetre.
    """
    steps = np.diff(path, axis=0)
    lengths = np.hypot(*steps.T)
    headings = np.arctan2(steps[:, 1] * gear, steps[:, 0] * gear)
    turns = np.abs((np.diff(headings) + math.pi) % math.tau - math.pi)
    legs = np.minimum(lengths, 0.2)
    return float((turns - (legs[:-1] + legs[1:]) / 2 / (0.98 * RADIUS)).max())


@pytest.fixture(scope="module")
def hall() -> FreeSpace:
    return free_space(parse_site(document(box(0, 0, 9, 9)), "hall"), PlanOptions())


def test_steps_are_joined_on_lines_and_arcs_but_not_at_changes_of_gear(hall: FreeSpace) -> None:
    turns = np.array([0.0, 0.09, 0.0901, 0.18, 0.1805, 0.27])
    arc = np.stack([4 + RADIUS * np.sin(turns), 4 - RADIUS * np.cos(turns)], axis=1)
    back = arc[-1] - np.array([[0.0003, 0.0], [0.3, 0.09], [0.3005, 0.0902]])
    path = np.vstack([arc, back])
    gears = np.array([1] * 5 + [-1] * 3, np.int8)
    kept, there, moved = without_crumbs(path, gears, hall)
    assert kept == pytest.approx(path[[0, 1, 3, 5, 8]])
    assert there.tolist() == [1, 1, 1, -1]
    assert moved[[0, 5, 8]].tolist() == [0, 3, 4]
    assert (np.diff(moved) >= 0).all()


def test_a_path_that_comes_by_its_own_end_keeps_its_places(hall: FreeSpace) -> None:
    bend = np.linspace(0, math.tau, 73)
    path = np.stack([4 + RADIUS * np.sin(bend), 4 - RADIUS * np.cos(bend)], axis=1)
    path = np.vstack([path, path[1:30]])  # once around and on
    kept, _, moved = without_crumbs(path, np.ones(len(path) - 1, np.int8), hall)
    assert len(kept) == len(path)
    assert (moved == np.arange(len(path))).all()


def test_short_steps_around_a_corner_of_the_free_space_stay(hall: FreeSpace) -> None:
    corner = np.array(hall.polygon.exterior.coords[0])
    inward = np.sign(np.array([4.5, 4.5]) - corner)
    path = np.array([corner + inward * step for step in ([0, 1], [0, 0.006], [0.005, 0], [1, 0])])
    kept, _, _ = without_crumbs(path, np.ones(3, np.int8), hall)
    assert hall.holds_points(kept)


@pytest.mark.parametrize("name", ["star 9", "pond, 1500 points", "flat 6"])
def test_no_place_of_a_written_plan_is_sharper_than_the_wheel(name: str) -> None:
    plan = planned(DEVELOPMENT[name](), RADIUS)
    path = np.array(plan["path"])
    assert sharpness(path, np.array(plan["gear"])) < 0.02
    gear = np.array(plan["gear"])
    inside = np.r_[False, gear[1:] == gear[:-1]] & np.r_[gear[1:] == gear[:-1], False]
    lengths = np.hypot(*np.diff(path, axis=0).T)
    assert lengths[inside].min() > 0.0015
    assert np.count_nonzero(lengths[inside] < 0.98 * SHORTEST) < 0.01 * len(path)


def test_nor_is_one_by_lot() -> None:
    rng = np.random.default_rng(1)
    for _ in range(12):
        plan = planned(by_lot(rng), RADIUS)
        assert sharpness(np.array(plan["path"]), np.array(plan["gear"])) < 0.02
