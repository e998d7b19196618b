"""Routes: by way of the nodes, around what stands between, with a steered wheel."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from core.planning import judge, maps
from shapely import LineString, Point

from polepilot.core.errors import PlanError, SiteError
from polepilot.core.planning.options import PlanOptions
from polepilot.core.planning.route import plan_route
from polepilot.core.site import Start, read_site

DEMO = Path(__file__).parents[3] / "polepilot" / "demo" / "workshop.json"


@pytest.mark.parametrize("radius", [0.0, 0.36, 0.6])
def test_demo_route_passes_its_nodes(radius: float) -> None:
    site = read_site(DEMO)
    plan = plan_route(site, "Tour", PlanOptions(min_turn_radius=radius))
    assert plan.mode == "route"
    assert [part.kind for part in plan.parts] == ["route"]
    assert plan.nodes == site.routes[0].nodes
    assert plan.path[0] == pytest.approx((1.0, 1.2))
    assert plan.path[-1] == pytest.approx(plan.nodes[-1], abs=1e-6)
    line = LineString(plan.path)
    assert max(line.distance(Point(node)) for node in plan.nodes) < 0.01
    assert judge.clearance_of(plan, site) >= 0.199
    if radius:
        assert judge.sharpest(plan) >= 0.98 * radius
    straight = np.hypot(*np.diff([(1.0, 1.2), *plan.nodes], axis=0).T).sum()
    assert straight - 1e-6 <= plan.predicted.length <= 1.15 * straight
    assert plan.predicted.duration > plan.predicted.length / 0.4


@pytest.mark.parametrize("radius", [0.0, 0.36, 0.6])
def test_around_an_obstacle(radius: float) -> None:
    site = maps.site(maps.box(0, 0, 8, 6), [maps.box(3, 1, 4, 5)], start=[1, 3, 0])
    plan = plan_route(site, [(7.0, 3.0)], PlanOptions(min_turn_radius=radius))
    assert judge.clearance_of(plan, site) >= 0.199
    assert plan.path[-1] == pytest.approx((7.0, 3.0), abs=1e-6)
    assert any("not free" in note for note in plan.notes)
    if radius == 0:
        # By hand: to the arc around a corner, along it, across, and the same mirrored.
        tangent = np.sqrt(2.0**2 + 2.0**2 - 0.2**2)
        angle = np.arctan2(2.0, 2.0) + np.arcsin(0.2 / np.hypot(2.0, 2.0))
        right = np.sqrt(3.0**2 + 2.0**2 - 0.2**2)
        other = np.arctan2(2.0, 3.0) + np.arcsin(0.2 / np.hypot(3.0, 2.0))
        expected = tangent + right + 1.0 + 0.2 * (angle + other)
        assert plan.predicted.length == pytest.approx(expected, abs=0.01)
    else:
        assert judge.sharpest(plan) >= 0.98 * radius


def test_nodes_that_cannot_be_reached() -> None:
    site = maps.office()
    with pytest.raises(PlanError, match=r"node 2 of route '' at \(6\.00, 1\.50\)"):
        plan_route(site, [(2.0, 3.7), (6.0, 1.5)], PlanOptions())
    with pytest.raises(PlanError, match="at least one node"):
        plan_route(site, [], PlanOptions())
    with pytest.raises(SiteError, match="'Nowhere' is not on the site"):
        plan_route(site, "Nowhere", PlanOptions())


def test_turning_round_in_place() -> None:
    site = maps.site(maps.box(0, 0, 6, 4))
    options = PlanOptions(start=Start(4.0, 2.0, 0.0))
    plan = plan_route(site, [(1.0, 2.0)], options)
    assert judge.sharpest(plan) >= 0.588
    assert judge.clearance_of(plan, site) >= 0.199
    assert plan.predicted.length < 8
