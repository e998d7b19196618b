"""The scorer of plans, on paths whose figures are known by hand; the sets of maps; bad sites."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
import shapely
from plans import fuzz
from plans.bound import least_ratio
from plans.final import CLEARANCE, TOOL, planned
from plans.scorer import corners_of, ground, judge, uncovered
from plans.sets import DEVELOPMENT, FINAL, by_lot
from plans.shapes import box, document

from polepilot.core.site import parse_site


def plan(path: list[Any], gear: list[int] | None = None, **more: Any) -> dict[str, Any]:
    gear = gear or [1] * (len(path) - 1)
    return {
        "path": path,
        "gear": gear,
        "parts": [{"kind": "loop", "first": 0, "last": len(path) - 1}],
        "unreachable": [],
        "predicted": {"coverage": 1.0},
        "runtime": 0.1,
        **more,
    }


def test_a_straight_pass_is_measured_exactly() -> None:
    site = document(box(0, 0, 4, 1))
    found = judge("strip", site, plan([[0.2, 0.5], [3.8, 0.5]]), 0.4, 0.2, 0.0)
    corners = (4 - math.pi) * 0.04
    assert found.area == pytest.approx(4 - corners, abs=1e-4)
    assert found.missed == pytest.approx(4 - corners - (3.6 * 0.4 + math.pi * 0.04), abs=1e-3)
    assert found.length == pytest.approx(3.6)
    assert found.nearest == pytest.approx(0.2)
    assert (found.contacts, found.corners, found.parts) == (0, 0, True)


def test_contacts_are_found_at_walls_islands_no_go_areas_and_outside() -> None:
    wall = {"walls": [[[2, 0.0], [2, 0.35]]]}
    for more, hits in (
        ({}, 0),
        (wall, 1),
        ({"islands": [box(1.9, 0.0, 2.1, 0.35)]}, 1),
        ({"no_go": [box(1.9, 0.0, 2.1, 0.35)]}, 1),
    ):
        site = document(box(0, 0, 4, 1), **more)
        found = judge("strip", site, plan([[0.2, 0.5], [3.8, 0.5]]), 0.4, 0.2, 0.0)
        assert found.contacts == hits
    outside = judge("out", document(box(0, 0, 4, 1)), plan([[1, 0.5], [1, 2]]), 0.4, 0.2, 0.0)
    assert outside.nearest == -1.0


def _arc(radius: float, turn: float, count: int) -> np.ndarray:
    angles = np.linspace(0, turn, count)
    arc = np.stack([radius * np.sin(angles), radius * (1 - np.cos(angles))], axis=1)
    after = arc[-1] + 2 * np.array([math.cos(turn), math.sin(turn)])
    return np.round(np.vstack([[-2.0, 0.0], arc, after]), 4)


@pytest.mark.parametrize("count", [6, 12, 40, 200])
def test_arcs_of_the_radius_pass_and_tighter_ones_do_not(count: int) -> None:
    forward = np.ones(count + 1, int)
    assert corners_of(_arc(0.61, 1.5, count), forward, 0.6)[0] == 0
    assert corners_of(_arc(0.45, 1.5, count), forward, 0.6)[0] > 0


@pytest.mark.parametrize("radius", [0.6, 1.5, 3.0, 6.0])
def test_wide_curves_pass_with_chords_of_five_degrees(radius: float) -> None:
    forward = np.ones(19, int)
    assert corners_of(_arc(1.02 * radius, 1.5, 18), forward, radius)[0] == 0
    assert corners_of(_arc(0.75 * radius, 1.5, 18), forward, radius)[0] > 0
    corner = np.array([[0, 0], [20, 0], [40, 8]], float)
    assert corners_of(corner, np.array([1, 1]), radius)[0] == 1


def test_corners_between_long_legs_count_and_changes_of_gear_do_not() -> None:
    corner = np.array([[0, 0], [5, 0], [5, 5]], float)
    assert corners_of(corner, np.array([1, 1]), 0.6)[0] == 1
    back = np.array([[0, 0], [5, 0], [2, 0]], float)
    assert corners_of(back, np.array([1, -1]), 0.6)[:2] == (0, 0)
    crooked = np.array([[0, 0], [5, 0], [2, 1]], float)
    assert corners_of(crooked, np.array([1, -1]), 0.6)[:2] == (0, 1)


def test_what_was_missed_is_summed_over_tiles() -> None:
    area = shapely.box(0, 0, 23, 17)
    left = uncovered(np.array([[0, 8.0], [23, 8.0]]), area, 1.0)
    assert left == pytest.approx(23 * 16, abs=1e-6)


def test_unreachable_pieces_are_compared() -> None:
    site = document(box(0, 0, 4, 2), walls=[[[2, 0], [2, 2]]])
    path = [[0.2, 0.2], [1.8, 0.2]]
    piece = {"polygon": box(2, 0, 4, 2), "reason": "-"}
    wrong = {"polygon": box(3, 0, 4, 2), "reason": "-"}
    for pieces, percent in (([piece], 100), ([wrong], 50), ([], 0)):
        found = judge("two", site, plan(path, unreachable=pieces), 0.4, 0.2, 0.0)
        assert found.unreachable == pytest.approx(percent, abs=2)


@pytest.mark.parametrize(
    ("width", "ratio"),
    [(0.5, 1.6), (0.6, 4 / 3), (1.0, 1.2), (1.2, 1.0), (1.3, 16 / 13), (8.0, 1.0)],
)
def test_the_bound_is_that_of_straight_passes(width: float, ratio: float) -> None:
    here = ground(document(box(0, 0, 40, width)), (1.0, width / 2), 0.2)
    bound = least_ratio(here.free, here.reachable, here.walls, 0.4, 0.2)
    assert bound == pytest.approx(ratio, abs=0.04)


def test_the_sets_are_large_different_and_sound() -> None:
    assert len(FINAL) >= 40
    for maps in (FINAL, DEVELOPMENT):
        for name, make in maps.items():
            assert not parse_site(make(), name).repairs
    same = [name for name in FINAL if name in DEVELOPMENT]
    assert all(FINAL[name]() != DEVELOPMENT[name]() for name in same)


@pytest.mark.parametrize("radius", [0.0, 0.6])
@pytest.mark.parametrize("seed", range(4))
def test_plans_on_random_maps_touch_nothing_and_can_be_driven(seed: int, radius: float) -> None:
    """A few; the long campaigns have more."""
    site = by_lot(np.random.default_rng(seed))
    found = judge("random", site, planned(site, radius), TOOL, CLEARANCE, radius)
    assert (found.contacts, found.corners, found.crooked) == (0, 0, 0)
    assert found.parts
    assert found.predicted == pytest.approx(0, abs=0.3)


@pytest.mark.parametrize("block", range(5))
def test_bad_sites_are_refused_in_one_line_or_planned_on(block: int) -> None:
    """The large ones are left to the long campaigns."""
    for seed in range(10_000 + 8 * block, 10_008 + 8 * block):
        if fuzz.bad_site(seed)[0] not in ("many points", "stretched", "absurd size"):
            assert fuzz.wrong_with(fuzz.outcome(seed)) == ""


def test_pieces_whose_mitred_edges_cross_are_named() -> None:
    """Site 61502 has a piece out of reach that GEOS makes a ring of that crosses itself."""
    assert fuzz.wrong_with(fuzz.outcome(61_502)) == ""
