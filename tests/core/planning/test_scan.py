"""Scan plans, judged from first principles: inside, clear, drivable, complete, the same twice."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import shapely
from core.planning import judge, maps
from hypothesis import given, settings
from hypothesis import strategies as st
from shapely import LineString, MultiPolygon, Point, Polygon, box

from polepilot.core.errors import PlanError, SiteError
from polepilot.core.plan import Plan
from polepilot.core.planning.coverage import plan_scan
from polepilot.core.planning.options import PlanOptions
from polepilot.core.site import Site, Start, read_site

DEMO = Path(__file__).parents[3] / "polepilot" / "demo" / "workshop.json"
SHAPES = ["room", "slot", "ell", "comb", "neck", "office", "disc", "triangle"]


def check(plan: Plan, site: Site, radius: float) -> None:
    """What every scan plan must be."""
    assert judge.clearance_of(plan, site) >= plan.clearance - 0.001
    assert np.isfinite(plan.path).all()
    assert plan.parts[0].first == 0
    assert plan.parts[-1].last == len(plan.path) - 1
    assert set(plan.gear.tolist()) <= {1, -1}
    if radius > 0:
        assert judge.sharpest(plan) >= 0.98 * radius
    else:
        assert (plan.gear == 1).all()


@pytest.mark.parametrize("radius", [0.0, 0.36, 0.6])
@pytest.mark.parametrize("name", SHAPES)
def test_shapes_are_covered(name: str, radius: float) -> None:
    site = maps.NAMED[name]()
    plan = plan_scan(site, PlanOptions(min_turn_radius=radius))
    check(plan, site, radius)
    covered = judge.coverage(plan, site)
    assert covered >= 0.98
    assert plan.predicted.coverage == pytest.approx(covered, abs=0.003)
    if radius == 0 and name != "slot":
        # Corridors narrower than three tools cost up to this much more than their area.
        assert plan.predicted.length <= 1.6 * plan.area.area / plan.tool_width


def test_the_demo_is_covered_with_little_driven_twice() -> None:
    site = read_site(DEMO)
    lengths = []
    for radius, ratio in ((0.0, 1.3), (0.36, 1.7), (0.6, 2.0)):
        plan = plan_scan(site, PlanOptions(min_turn_radius=radius))
        check(plan, site, radius)
        assert judge.coverage(plan, site) >= 0.99
        assert plan.predicted.length <= ratio * plan.area.area / plan.tool_width
        lengths.append(plan.predicted.length)
    assert lengths == sorted(lengths)


def test_a_way_back_that_fails_half_way() -> None:
    """A map on which a connection is tried, given up, and made another way."""
    boundary = [[3.5, 1.5], [1.5, 2], [-1.5, 3.5], [-1, 2.5], [-3.5, 2.5], [-1, 0.5]]
    boundary += [[-3.5, -2], [3, -4], [1.5, -1.5], [3.5, -1]]
    islands = [
        [[-0.42497, 1.46529], [-0.76614, 1.66227], [-0.76614, 1.26832]],
        [[-0.01289, 0.07311], [-0.55869, 0.38823], [-0.55869, -0.24201]],
        [[0.7548, 1.53075], [0.16266, 1.87262], [0.16266, 1.18888]],
    ]
    walls = [[[-2.6976, 0.0364], [-0.9961, -1.1314]], [[-2.2299, 1.6598], [-2.3832, -2.0482]]]
    site = maps.site(boundary, islands, walls=walls)
    check(plan_scan(site, PlanOptions(min_turn_radius=0.6)), site, 0.6)


def test_what_lies_behind_a_neck_of_two_millimetres_is_swept() -> None:
    site = maps.random_site(np.random.default_rng(5778))
    plan = plan_scan(site, PlanOptions(min_turn_radius=0.0))
    check(plan, site, 0.0)
    assert judge.coverage(plan, site) >= 0.97


@settings(deadline=None, max_examples=12)
@given(st.integers(0, 2**32 - 1), st.sampled_from([0.0, 0.36, 0.6]))
def test_random_maps(seed: int, radius: float) -> None:
    try:
        site = maps.random_site(np.random.default_rng(seed))
        plan = plan_scan(site, PlanOptions(min_turn_radius=radius))
    except (SiteError, PlanError):
        return
    check(plan, site, radius)
    assert plan.predicted.coverage == pytest.approx(judge.coverage(plan, site), abs=0.006)
    if radius == 0 and plan.area.area > 0.5:
        assert plan.predicted.coverage >= 0.97


def test_the_path_begins_at_the_start() -> None:
    site = maps.NAMED["room"]()
    for start in (Start(1.0, 1.0), Start(2.0, 3.0, 2.0)):
        for radius in (0.0, 0.6):
            plan = plan_scan(site, PlanOptions(min_turn_radius=radius, start=start))
            assert plan.path[0] == pytest.approx(start.position)
    moves = plan.path[1] - plan.path[0]
    heading = np.arctan2(*(moves[::-1] * plan.gear[0]))
    assert heading == pytest.approx(2.0, abs=0.05)


def test_a_start_too_near_to_a_wall() -> None:
    site = maps.NAMED["room"]()
    plan = plan_scan(site, PlanOptions(start=Start(0.15, 2.0)))
    assert plan.path[0] == pytest.approx((0.2, 2.0), abs=0.001)
    assert any("begins 5 cm away" in note for note in plan.notes)
    with pytest.raises(PlanError, match="does not fit at the start"):
        plan_scan(site, PlanOptions(start=Start(0.02, 2.0)))
    with pytest.raises(PlanError, match="not on the floor"):
        plan_scan(site, PlanOptions(start=Start(9.0, 2.0)))


def test_what_cannot_be_reached_is_said_with_the_reason() -> None:
    site = maps.office()
    plan = plan_scan(site, PlanOptions(min_turn_radius=0))
    (piece,) = plan.unreachable
    assert piece.reason == "behind a passage of 35 cm; the robot needs 40 cm"
    room = Polygon(piece.polygon)
    # The room behind the 35 cm door, and of its wall not more than the door lets in.
    assert room.contains(Polygon([(4.1, 0.1), (7.9, 0.1), (7.9, 2.7), (4.1, 2.7)]))
    assert room.area == pytest.approx(12.0, abs=0.2)


def test_a_fence_encloses() -> None:
    fence = [[1, 1], [3, 1], [3, 3], [1, 3], [1, 1]]
    site = maps.site(maps.box(0, 0, 6, 4), walls=[fence], start=[4, 2])
    plan = plan_scan(site, PlanOptions(min_turn_radius=0))
    assert [piece.reason for piece in plan.unreachable] == ["enclosed: no opening leads there"]


def test_free_poles_are_passed_at_the_clearance() -> None:
    site = maps.site(maps.box(0, 0, 5, 4), landmarks=[{"id": 1, "x": 2.5, "y": 2}])
    for radius in (0.0, 0.6):
        plan = plan_scan(site, PlanOptions(min_turn_radius=radius))
        steps = np.stack([plan.path[:-1], plan.path[1:]], axis=1)
        assert min(Point(2.5, 2).distance(judge.LineString(s)) for s in steps) >= 0.199


def test_missed_patches_are_planned_alone() -> None:
    site = maps.NAMED["room"]()
    patches = MultiPolygon(
        [Point(1, 1).buffer(0.15), Polygon([(3, 2), (4.5, 2), (4.5, 3), (3, 3)])]
    )
    start = Start(2.5, 0.5, 1.0)
    for radius in (0.0, 0.36):
        plan = plan_scan(site, PlanOptions(min_turn_radius=radius, start=start), patches)
        check(plan, site, radius)
        assert plan.area.area == pytest.approx(patches.area, rel=0.01)
        assert plan.predicted.coverage >= 0.97
        assert plan.path[0] == pytest.approx(start.position)
        assert plan.predicted.length < 40


def test_orders() -> None:
    site = maps.NAMED["neck"]()
    start = Start(1.5, 1.2)
    short = plan_scan(site, PlanOptions(min_turn_radius=0, start=start))
    paper = plan_scan(site, PlanOptions(min_turn_radius=0, order="paper", start=start))
    assert short.predicted.length <= paper.predicted.length
    kinds = [part.kind for part in paper.parts]
    assert kinds[0] == "link"
    # A loop of the paper's order is finished in one go: it ends where it begins.
    for part in paper.parts:
        if part.kind == "loop":
            assert paper.path[part.first] == pytest.approx(paper.path[part.last], abs=1e-6)


def test_overlap_is_what_the_strip_has_more_than_the_floor() -> None:
    site = maps.NAMED["room"]()
    plan = plan_scan(site, PlanOptions(min_turn_radius=0))
    strip = plan.predicted.length * 0.4 + np.pi * 0.2**2
    swept = plan.predicted.coverage * plan.area.area
    assert plan.predicted.overlap == pytest.approx(1 - swept / strip, abs=0.003)
    assert 0.0 < plan.predicted.overlap < 0.2


def test_the_same_twice() -> None:
    site = maps.office()
    first, second = (plan_scan(site, PlanOptions()) for _ in range(2))
    assert np.array_equal(first.path, second.path)
    assert first.parts == second.parts


def test_a_robot_that_fits_nowhere() -> None:
    with pytest.raises(PlanError, match=r"passages of 40 cm"):
        plan_scan(maps.site(maps.box(0, 0, 5, 0.3)), PlanOptions())
    plan = plan_scan(maps.NAMED["tight"](), PlanOptions())
    assert plan.predicted.coverage > 0.9
    with pytest.raises(PlanError, match="too large"):
        plan_scan(maps.site(maps.box(0, 0, 9000, 9000)), PlanOptions())


@pytest.mark.parametrize("radius", [0.0, 0.6])
def test_the_clearance_is_kept_as_written(radius: float) -> None:
    """Chords, rounding and all: not even a hundredth of a millimetre is missing."""
    site = maps.pillars(9, seed=5)
    document = plan_scan(site, PlanOptions(min_turn_radius=radius)).to_json()
    assert site.obstacles().distance(LineString(document["path"])) >= 0.2


@pytest.mark.parametrize("radius", [0.0, 0.36])
@pytest.mark.parametrize("tool", [0.1, 0.3, 0.39])
def test_a_tool_narrower_than_what_the_robot_keeps_away(tool: float, radius: float) -> None:
    """What it cannot get to along walls is said, and nothing is tried for it."""
    site = Site(boundary=((0, 0), (3, 0), (3, 2), (0, 2)), start=Start(1, 1, 0.0))
    options = PlanOptions(tool_width=tool, clearance=0.2, min_turn_radius=radius)
    plan = plan_scan(site, options)
    check(plan, site, radius)
    inner = Polygon([(0.2, 0.2), (2.8, 0.2), (2.8, 1.8), (0.2, 1.8)]).buffer(tool / 2)
    assert any("out of the tool's reach" in note for note in plan.notes)
    assert not any("turning radius" in note for note in plan.notes)
    assert plan.predicted.coverage >= inner.area / plan.area.area - 0.01


@pytest.mark.parametrize(("tool", "clearance"), [(0.6, 0.2), (0.5, 0.2), (0.4, 0.1)])
def test_a_tool_wider_than_what_the_robot_keeps_away(tool: float, clearance: float) -> None:
    """Its outermost loop is half a tool from the walls, which is shorter than one nearer to them;
    where the robot gets through, but only a narrower tool, it goes all the same."""
    room = maps.site(maps.box(0, 0, 4, 3))
    options = PlanOptions(tool_width=tool, clearance=clearance, min_turn_radius=0)
    plan = plan_scan(room, options)
    check(plan, room, 0.0)
    assert judge.coverage(plan, room) >= 0.999
    assert plan.predicted.length <= 1.13 * plan.area.area / tool
    width = 1.8 * max(clearance, tool / 3)
    rooms = shapely.union_all([box(0, 0, 3, 3), box(2.9, 1, 6.1, 1 + width), box(6, 0, 9, 3)])
    site = Site(boundary=tuple(rooms.exterior.coords[:-1]))
    plan = plan_scan(site, replace(options, clearance=min(clearance, 0.45 * width)))
    check(plan, site, 0.0)
    assert judge.coverage(plan, site) >= 0.995


@pytest.mark.parametrize("side", [0.41, 0.45, 0.5, 0.8])
def test_the_coverage_of_a_closet_is_as_predicted(side: float) -> None:
    site = maps.site(maps.box(0, 0, side, side))
    plan = plan_scan(site, PlanOptions(tool_width=0.4, clearance=0.2, min_turn_radius=0))
    check(plan, site, 0.0)
    assert judge.coverage(plan, site) >= 0.995
    assert plan.predicted.coverage == pytest.approx(judge.coverage(plan, site), abs=0.0015)


@pytest.mark.parametrize("radius", [0.0, 0.6])
@pytest.mark.parametrize("width", [0.403, 0.41, 0.42, 0.43, 0.44])
def test_a_corridor_hardly_wider_than_the_robot(width: float, radius: float) -> None:
    site = Site(boundary=((0, 0), (6, 0), (6, width), (0, width)), start=Start(1, width / 2, 0.0))
    options = PlanOptions(tool_width=0.4, clearance=0.2, min_turn_radius=radius)
    plan = plan_scan(site, options)
    check(plan, site, radius)
    assert plan.predicted.coverage >= 0.995
    assert plan.predicted.length <= 1.3 * (6 - 0.4) * 2
