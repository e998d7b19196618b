"""Visits to what a path missed: there and back on one track, and on as if nothing had been."""

from __future__ import annotations

import numpy as np
import pytest
import shapely
from core.planning import judge, maps

from polepilot.core.plan import Plan, PlanPart, Prediction
from polepilot.core.planning.options import PlanOptions
from polepilot.core.planning.space import as_multi, free_space
from polepilot.core.planning.swept import swept_shape
from polepilot.core.planning.target import Target
from polepilot.core.planning.visits import with_visits

TOOL, RADIUS = 0.4, 0.6
PATH = np.array([[0.5, 2.0], [3.5, 2.0]])
GEAR = np.ones(1, np.int8)
PARTS = (PlanPart("loop", 0, 1),)


def _visited(missed: shapely.Geometry, enough: float = 0.0) -> tuple[np.ndarray, np.ndarray]:
    site = maps.site(maps.box(0, 0, 4, 4))
    space = free_space(site, PlanOptions())
    target = Target(as_multi(missed), TOOL)
    path, gear, parts, left = with_visits(
        PATH, GEAR, PARTS, target, space, RADIUS, 1e-4, enough, target.missed(PATH)
    )
    assert left.area == pytest.approx(target.missed_area(path), abs=1e-5)
    assert parts == (PlanPart("loop", 0, len(path) - 1),)
    assert len(gear) == len(path) - 1
    assert path[0] == pytest.approx(PATH[0])
    assert path[-1] == pytest.approx(PATH[-1])
    plan = Plan(
        mode="scan",
        path=path,
        gear=gear,
        parts=parts,
        unreachable=(),
        predicted=Prediction(1.0, 1.0, 1.0, 0, 0.0),
        tool_width=TOOL,
        clearance=0.2,
        min_turn_radius=RADIUS,
        area=as_multi(missed),
        notes=(),
        runtime=0.0,
    )
    assert judge.clearance_of(plan, site) >= 0.2
    assert judge.sharpest(plan) >= 0.98 * RADIUS
    return path, gear


def test_a_spot_is_visited_and_left_the_same_way() -> None:
    spot = shapely.Point(2.0, 2.5).buffer(0.1)
    path, gear = _visited(spot)
    assert spot.difference(swept_shape(path, TOOL)).area < 0.02 * spot.area
    inner = path[1:-1]
    assert inner == pytest.approx(inner[::-1])
    assert gear[1:-1].tolist() == (-gear[1:-1][::-1]).tolist()


def test_several_spots_some_from_the_same_place() -> None:
    spots = [
        shapely.Point(x, y).buffer(0.08) for x, y in ((2, 2.6), (2, 1.4), (2.1, 2.8), (3, 1.5))
    ]
    path, _ = _visited(shapely.union_all(spots))
    for spot in spots:
        assert spot.difference(swept_shape(path, TOOL)).area < 0.02 * spot.area


def test_a_strip_is_driven_along() -> None:
    strip = shapely.box(0.6, 2.3, 3.4, 2.6)
    path, gear = _visited(strip)
    assert strip.difference(swept_shape(path, TOOL)).area < 0.02 * strip.area
    assert np.count_nonzero(np.diff(gear)) <= 8


def test_what_is_little_enough_is_left() -> None:
    spot = shapely.Point(2.0, 2.5).buffer(0.1)
    path, _ = _visited(spot, enough=0.1)
    assert len(path) == 2
