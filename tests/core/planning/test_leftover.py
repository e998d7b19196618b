"""What a job left is swept by stretches of the usual loops."""

from __future__ import annotations

import math

import numpy as np
import pytest
import shapely
from shapely import MultiPolygon, box

from polepilot.core.plan import Plan
from polepilot.core.planning.coverage import plan_scan
from polepilot.core.planning.leftover import stretches_over
from polepilot.core.planning.offset import nested_loops
from polepilot.core.planning.options import PlanOptions
from polepilot.core.planning.swept import SweptArea
from polepilot.core.site import Site, Start, parse_site

TOOL = 0.4
ROOM = box(0, 0, 6, 4)
LOOPS = nested_loops([ROOM], TOOL, 0.002).loops


def test_of_what_is_left_everywhere_all_loops_are_driven() -> None:
    whole = MultiPolygon([ROOM.buffer(TOOL / 2)])
    assert stretches_over(LOOPS, whole, TOOL) == LOOPS


def test_only_what_lies_over_a_patch_is_driven_and_sweeps_it() -> None:
    patch = box(3.5, -0.2, 6.2, 4.2)
    strokes = stretches_over(LOOPS, MultiPolygon([patch]), TOOL)
    assert len(strokes) == len(LOOPS)
    for stroke in strokes:
        assert not stroke.closed
        assert shapely.covers(ROOM.buffer(1e-6), stroke.line)
        assert shapely.bounds(stroke.line)[0] > 3.5 - TOOL / 2
    swept = shapely.union_all([stroke.line.buffer(TOOL / 2) for stroke in strokes])
    loops = shapely.union_all([loop.line.buffer(TOOL / 2) for loop in LOOPS])
    assert patch.intersection(loops).difference(swept).area < 0.02 * patch.area
    length = sum(stroke.line.length for stroke in strokes)
    assert length < 1.15 * patch.area / TOOL


def test_short_gaps_are_driven_through_and_narrow_patches_left_to_passes() -> None:
    two = MultiPolygon([box(1, -0.2, 2.4, 0.9), box(2.9, -0.2, 4.4, 0.9)])
    outermost = [s for s in stretches_over(LOOPS, two, TOOL) if s.depth == 0]
    assert [s.line.length for s in outermost] == [pytest.approx(3.4 + TOOL, abs=0.15)]
    assert stretches_over(LOOPS, MultiPolygon([box(1, 1, 4, 1.4)]), TOOL) == []


def left_after(plan: Plan, share: float) -> tuple[MultiPolygon, Start, float, int]:
    """What is missed after a share of a plan, where the robot is then, and the length and the
    changes of gear of the rest."""
    marks = np.r_[0.0, np.cumsum(np.hypot(*np.diff(plan.path, axis=0).T))]
    stop = int(np.searchsorted(marks, share * marks[-1]))
    area = SweptArea(plan.area, plan.tool_width)
    for a, b in zip(plan.path[:stop], plan.path[1 : stop + 1], strict=True):
        area.sweep((float(a[0]), float(a[1])), (float(b[0]), float(b[1])))
    step = (plan.path[stop] - plan.path[stop - 1]) * plan.gear[stop - 1]
    here = Start(*plan.path[stop].tolist(), math.atan2(step[1], step[0]))
    changes = int(np.count_nonzero(np.diff(plan.gear[stop:])))
    return area.missed(), here, float(marks[-1] - marks[stop]), changes


def site(*islands: list[list[float]]) -> Site:
    boundary = [[0, 0], [6.5, 0], [6.5, 4.6], [0, 4.6]]
    return parse_site({"boundary": boundary, "islands": list(islands)}, "room")


@pytest.mark.parametrize("share", [0.15, 0.3, 0.5])
@pytest.mark.parametrize("islands", [[], [[[2.2, 2.0], [3.0, 2.0], [3.0, 2.6], [2.2, 2.6]]]])
def test_what_is_left_is_driven_about_as_the_plan_would_have_gone_on(
    share: float, islands: list[list[list[float]]]
) -> None:
    room = site(*islands)
    whole = plan_scan(room, PlanOptions(min_turn_radius=0.6))
    missed, here, length, changes = left_after(whole, share)
    rest = plan_scan(room, PlanOptions(min_turn_radius=0.6, start=here), area=missed)
    assert rest.predicted.coverage > 0.99
    assert rest.predicted.length < 1.4 * length + 5
    assert rest.predicted.reversals < 1.5 * changes + 12
