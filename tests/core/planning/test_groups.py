"""The paper's Fig. 13: groups, their order, and what cannot be reached; and its drawing."""

from __future__ import annotations

from xml.etree import ElementTree

import numpy as np
import pytest
from core.planning import judge, maps
from plans.shapes import figure_13
from shapely import LineString

from polepilot.core.planning.coverage import plan_scan
from polepilot.core.planning.groups import groups_of, regions_of
from polepilot.core.planning.options import PlanOptions
from polepilot.core.planning.plot import plot_svg
from polepilot.core.planning.space import free_space
from polepilot.core.site import parse_site

SITE = parse_site(figure_13(), "Fig. 13")
PAPER = PlanOptions(min_turn_radius=0, order="paper")


def test_the_structure_of_figure_13() -> None:
    plan = plan_scan(SITE, PAPER)
    groups = groups_of(SITE, plan)
    assert [(group.name, group.reached) for group in groups] == [
        ("A", True),
        ("B", True),
        ("C", False),
        ("D", False),
    ]
    assert all(len(group.loops) == 2 for group in groups)
    # A1 and A2 are finished before B1 and B2; each loop in one go.
    loops = [part for part in plan.parts if part.kind == "loop"]
    driven = []
    for part in loops:
        middle = LineString(plan.path[part.first : part.last + 1]).centroid
        driven.append("A" if middle.x < 2.6 else "B")
        assert plan.path[part.first] == pytest.approx(plan.path[part.last], abs=1e-6)
    assert driven == ["A", "A", "B", "B"]
    between = [part.kind for part in plan.parts if part.kind != "loop"]
    assert between == ["link", "bridge", "link", "bridge"]
    (piece,) = plan.unreachable
    assert piece.reason == "behind a passage of 35 cm; the robot needs 40 cm"
    assert judge.clearance_of(plan, SITE) >= 0.2 - 1e-6
    assert judge.coverage(plan, SITE) >= 0.99
    # The first loop is counter-clockwise and begins straight beside the start.
    first = plan.path[loops[0].first : loops[0].last + 1]
    x, y = first.T
    assert np.sum(x[:-1] * y[1:] - x[1:] * y[:-1]) > 0
    assert first[0] == pytest.approx((0.2, 0.9), abs=0.002)


def test_the_drawing_names_groups_loops_bridges_and_links() -> None:
    svg = plot_svg(SITE, plan_scan(SITE, PAPER))
    texts = [node.text for node in ElementTree.fromstring(svg).iter() if node.tag.endswith("}text")]
    for name in (
        "A",
        "B",
        "C",
        "D",
        "A1",
        "A2",
        "B1",
        "B2",
        "C1",
        "C2",
        "D1",
        "D2",
        "a",
        "b",
        "ab",
    ):
        assert texts.count(name) >= 1, name


def test_a_room_without_narrow_ways_is_one_group() -> None:
    site = maps.NAMED["room"]()
    assert len(groups_of(site, plan_scan(site, PAPER))) == 1
    narrow = maps.site(maps.box(0, 0, 5, 0.5))
    assert [len(group.loops) for group in groups_of(narrow, plan_scan(narrow, PAPER))] == [1]


def test_regions_lie_in_the_free_space_and_apart() -> None:
    space = free_space(SITE, PlanOptions())
    regions = regions_of(space.polygon, 0.4)
    assert len(regions) > 1
    for index, region in enumerate(regions):
        assert space.polygon.buffer(1e-6).covers(region)
        assert all(region.intersection(other).area < 1e-3 for other in regions[:index])


def test_no_go_areas_are_drawn_and_not_driven_on() -> None:
    site = maps.site(maps.box(0, 0, 6, 4), no_go=[maps.box(2, 1, 4, 2)], name="<carpet>")
    for radius in (0.0, 0.6):
        plan = plan_scan(site, PlanOptions(min_turn_radius=radius))
        assert judge.clearance_of(plan, site) >= 0.2 - 1e-6
        svg = plot_svg(site, plan)
        ElementTree.fromstring(svg)
        assert "<title>no-go area</title>" in svg
        assert not plan.unreachable
