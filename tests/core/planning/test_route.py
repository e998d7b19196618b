"""Routes: by way of the nodes, around what stands between, with a steered wheel."""

from __future__ import annotations

import math
import re
from pathlib import Path

import numpy as np
import pytest
from core.planning import judge, maps
from hypothesis import given, settings
from hypothesis import strategies as st
from shapely import LineString, Point, Polygon

from polepilot.core.errors import PlanError, SiteError
from polepilot.core.geometry import angle_between
from polepilot.core.plan import Plan
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
    with pytest.raises(PlanError, match=r"node 2 at \(6\.00, 1\.50\)"):
        plan_route(site, [(2.0, 3.7), (6.0, 1.5)], PlanOptions())
    with pytest.raises(PlanError, match="at least one node"):
        plan_route(site, [], PlanOptions())
    with pytest.raises(SiteError, match="'Nowhere' is not on the site"):
        plan_route(site, "Nowhere", PlanOptions())


def test_a_node_where_nobody_can_stand_is_refused_with_the_reason() -> None:
    carpet, table = maps.box(4, 1, 6, 3), maps.box(1, 1, 2, 2)
    site = maps.site(maps.box(0, 0, 8, 4), [table], no_go=[carpet], start=[0.5, 0.5])
    for node, words in (
        ((5.0, 2.0), "lies in no-go area 1"),
        ((1.5, 1.5), "lies in island 1"),
        ((9.0, 1.0), "lies outside the boundary"),
        ((3.9, 2.0), r"is 10 cm away"),
    ):
        with pytest.raises(PlanError, match=words):
            plan_route(site, [node], PlanOptions())


def test_what_is_driven_around_is_named() -> None:
    site = maps.site(
        maps.box(0, 0, 12, 6),
        [maps.box(2, 2, 3, 4)],
        walls=[[[5, 1], [5, 6]]],
        no_go=[maps.box(8, 0, 9, 4)],
        start=[1, 3, 0],
    )
    nodes = [(4.0, 3.0), (6.0, 3.0), (11.0, 3.0), (11.0, 5.0)]
    plan = plan_route(site, nodes, PlanOptions(min_turn_radius=0))
    around = [note for note in plan.notes if "not free" in note]
    assert [note.split("(")[1].split(")")[0] for note in around] == [
        "island 1",
        "wall 1",
        "no-go area 1",
    ]
    assert judge.clearance_of(plan, site) >= 0.199
    assert LineString(plan.path).distance(Polygon(site.no_go[0])) >= 0.199


@pytest.mark.parametrize("radius", [0.0, 0.36, 0.6])
@pytest.mark.parametrize("heading", [0.0, 1.5, 3.0, -2.0])
def test_the_heading_at_the_end_is_as_asked_for(radius: float, heading: float) -> None:
    site = maps.site(maps.box(0, 0, 6, 5), start=[1, 1, 0])
    plan = plan_route(
        site, [(3.0, 1.5), (4.0, 3.0)], PlanOptions(min_turn_radius=radius), end_heading=heading
    )
    last = (plan.path[-1] - plan.path[-2]) * plan.gear[-1]
    assert abs(angle_between(math.atan2(last[1], last[0]), heading)) < 0.06  # a chord of an arc
    assert plan.path[-1] == pytest.approx((4.0, 3.0), abs=1e-6)
    assert LineString(plan.path).distance(Point(3.0, 1.5)) < 0.01
    assert judge.clearance_of(plan, site) >= 0.199
    if radius:
        assert judge.sharpest(plan) >= 0.98 * radius


def test_the_heading_of_a_drawn_route_counts_unless_another_is_asked_for() -> None:
    route = {"name": "Dock", "nodes": [[4.0, 3.0]], "heading": 2.0}
    site = maps.site(maps.box(0, 0, 6, 5), start=[1, 1, 0], routes=[route])
    for asked, expected in ((None, 2.0), (-1.0, -1.0)):
        plan = plan_route(site, "Dock", PlanOptions(min_turn_radius=0), asked)
        last = plan.path[-1] - plan.path[-2]
        assert math.atan2(last[1], last[0]) == pytest.approx(expected, abs=1e-6)
    with pytest.raises(PlanError, match="not finite"):
        plan_route(site, "Dock", PlanOptions(), math.nan)


def test_a_heading_for_which_there_is_no_room() -> None:
    site = maps.site(maps.box(0, 0, 6, 0.41), start=[1, 0.205, 0])
    for radius in (0.0, 0.6):
        with pytest.raises(PlanError, match=r"node 1 at \(4\.00, 0\.20\).*90°"):
            plan_route(site, [(4.0, 0.205)], PlanOptions(min_turn_radius=radius), math.pi / 2)


def test_changes_of_gear_are_said() -> None:
    site = maps.site(maps.box(0, 0, 6, 4))
    plan = plan_route(site, [(1.0, 2.0)], PlanOptions(start=Start(4.0, 2.0, 0.0)))
    said = [note for note in plan.notes if "changes its gear" in note]
    assert bool(said) == (plan.predicted.reversals > 0)


@settings(deadline=None, max_examples=10)
@given(st.integers(0, 2**32 - 1), st.sampled_from([0.0, 0.6]))
def test_random_routes_touch_nothing_or_are_refused(seed: int, radius: float) -> None:
    rng = np.random.default_rng(seed)
    try:
        site = maps.random_site(rng)
        nodes = [tuple(node) for node in rng.uniform(-2.5, 2.5, (3, 2))]
        plan = plan_route(
            site, nodes, PlanOptions(min_turn_radius=radius), float(rng.uniform(-3, 3))
        )
    except (SiteError, PlanError):
        return
    assert judge.clearance_of(plan, site) >= 0.199
    assert max(LineString(plan.path).distance(Point(node)) for node in nodes) < 0.01
    if radius:
        assert judge.sharpest(plan) >= 0.98 * radius


def test_turning_round_in_place() -> None:
    site = maps.site(maps.box(0, 0, 6, 4))
    options = PlanOptions(start=Start(4.0, 2.0, 0.0))
    plan = plan_route(site, [(1.0, 2.0)], options)
    assert judge.sharpest(plan) >= 0.588
    assert judge.clearance_of(plan, site) >= 0.199
    assert plan.predicted.length < 8


def gear_pieces(plan: Plan) -> list[float]:
    """How long each piece between two changes of gear is, as the plan is written, metres."""
    document = plan.to_json()
    steps = np.hypot(*np.diff(np.array(document["path"]), axis=0).T)
    bounds = np.flatnonzero(np.diff(np.array(document["gear"]), prepend=0))
    return [float(length) for length in np.add.reduceat(steps, bounds)]


def said_changes(plan: Plan) -> int:
    """How often its notes say that the robot changes its gear."""
    found = [re.search(r"changes its gear (once|\d+)", note) for note in plan.notes]
    words = [match[1] for match in found if match]
    return sum(1 if word == "once" else int(word) for word in words)


def check_gear_pieces(plan: Plan) -> None:
    """None so short that four digits turn it, and the notes count what is left of them."""
    assert min(gear_pieces(plan)) > 0.001
    assert said_changes(plan) == plan.predicted.reversals
    written = np.array(plan.to_json()["path"])
    assert np.hypot(*np.diff(written, axis=0).T).min() > 0


def test_a_route_does_not_end_with_a_change_of_gear_on_the_spot() -> None:
    site = maps.site(maps.box(0, 0, 4.13, 3.17), start=[3, 1, 0])
    options = PlanOptions(clearance=0.15, min_turn_radius=0.3)
    plan = plan_route(site, [(0.212, 2.065)], options, 1.642)
    check_gear_pieces(plan)
    assert plan.path[-1] == pytest.approx((0.212, 2.065), abs=1e-5)
    last = plan.gear[-1] * (plan.path[-1] - plan.path[-2])
    assert math.atan2(last[1], last[0]) == pytest.approx(1.642, abs=0.05)  # a chord of an arc


def test_nor_does_it_change_its_gear_back_and_forth_on_a_node_that_comes_twice() -> None:
    boundary = [[1.3919, 2.38812], [2.7838, 0.53225], [4.1757, 2.38812], [5.82308, 0.19161]]
    boundary += [[5.31211, -0.19161], [4.1757, 1.32361], [2.7838, -0.53225], [1.3919, 1.32361]]
    boundary += [[0.25548, -0.19161], [-0.25548, 0.19161]]
    nodes = [(5.449, 0.215), (5.449, 0.215), (0.848, 1.306)]
    plan = plan_route(maps.site(boundary), nodes, PlanOptions(min_turn_radius=0.6))
    check_gear_pieces(plan)
    assert max(LineString(plan.path).distance(Point(node)) for node in nodes) < 0.01


@settings(deadline=None, max_examples=25)
@given(st.integers(0, 2**32 - 1), st.sampled_from([0.3, 0.6]))
def test_no_route_in_a_room_has_a_gear_for_less_than_a_millimetre(seed: int, radius: float) -> None:
    rng = np.random.default_rng(seed)
    site = maps.site(maps.box(0, 0, *rng.uniform(2, 5, 2)))
    nodes = [tuple(node) for node in rng.uniform(0.2, 1.8, (int(rng.integers(1, 4)), 2))]
    options = PlanOptions(clearance=0.15, min_turn_radius=radius)
    try:
        plan = plan_route(site, nodes, options, float(rng.uniform(-3, 3)))
    except PlanError:
        return
    check_gear_pieces(plan)
    assert judge.clearance_of(plan, site) >= 0.149
    assert judge.sharpest(plan) >= 0.98 * radius
