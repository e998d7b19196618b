"""Nested loops, and what they leave, against the same from the tracks."""

from __future__ import annotations

import pytest
import shapely
from core.planning import maps

from polepilot.core.planning.offset import nested_loops
from polepilot.core.planning.options import PlanOptions
from polepilot.core.planning.space import as_multi, free_space
from polepilot.core.planning.target import Target
from polepilot.core.site import Site

TOOL = 0.4


def _ell() -> Site:
    return maps.site([[0, 0], [6, 0], [6, 2.2], [2.5, 2.2], [2.5, 5], [0, 5]])


def _round() -> Site:
    return maps.site([list(point) for point in shapely.Point(0, 0).buffer(3).exterior.coords[:-1]])


def _pillars() -> Site:
    return maps.site(maps.box(0, 0, 7, 5), islands=[maps.box(2, 2, 3, 3), maps.box(4, 1.5, 5, 2)])


@pytest.mark.parametrize("site", [_ell(), _round(), _pillars()])
@pytest.mark.parametrize("overlap", [0.004, 0.06])
@pytest.mark.parametrize("closer", [1.0, 0.95, 0.0])
def test_what_loops_leave_is_what_their_tracks_leave(
    site: Site, overlap: float, closer: float
) -> None:
    space = free_space(site, PlanOptions())
    area = as_multi(space.reachable().intersection(space.floor))
    nest = nested_loops([space.polygon], TOOL, 0.002, closer, overlap)
    target = Target(area, TOOL, 0.0001)
    exact = target.missed(*(stroke.track for stroke in nest.loops))
    soon = nest.missed(area, TOOL, target.quad_segs)
    # A millimetre or two along all that is missed, and nowhere else.
    assert soon.difference(exact.buffer(0.003)).area < 1e-6
    assert exact.difference(soon.buffer(0.003)).area < 1e-6
    assert soon.area == pytest.approx(exact.area, abs=0.003 * exact.length)


def test_each_shape_is_inside_of_another() -> None:
    space = free_space(_pillars(), PlanOptions())
    nest = nested_loops([space.polygon], TOOL, 0.002)
    assert nest.inside.count(-1) == 1
    for shape, outside in zip(nest.shapes, nest.inside, strict=True):
        if outside >= 0:
            assert nest.shapes[outside].buffer(0.003).covers(shape)
    assert sum(float(shape.length) for shape in nest.shapes) == pytest.approx(
        sum(float(stroke.line.length) for stroke in nest.loops)
    )
    assert all(stroke.closed for stroke in nest.loops)
