"""Paths with sharp corners: joined, closed over what loops leave, and no longer than needed."""

from __future__ import annotations

import itertools
import math

import numpy as np
import pytest
import shapely
from core.planning import maps
from shapely import MultiPolygon

from polepilot.core.plan import PartKind
from polepilot.core.planning.offset import Stroke, nested_loops
from polepilot.core.planning.options import Order, PlanOptions
from polepilot.core.planning.order import ordered_runs
from polepilot.core.planning.sharp import Recorder, chained, path_cost, path_length, sharp_path
from polepilot.core.planning.space import FreeSpace, as_multi, free_space
from polepilot.core.planning.target import Target
from polepilot.core.site import Start

TOOL = 0.4
OPTIONS = PlanOptions(min_turn_radius=0, start=Start(0.5, 0.5))


def _planned(space: FreeSpace, order: Order = "default") -> tuple[np.ndarray, tuple, Target]:
    options = PlanOptions(min_turn_radius=0, start=OPTIONS.start, order=order)
    target = Target(as_multi(space.reachable().intersection(space.floor)), TOOL)
    strokes = nested_loops([space.polygon], TOOL, 0.002, overlap=0.004).loops
    runs = ordered_runs(strokes, (0.5, 0.5), space, options.order, TOOL, 0.22)
    notes: list[str] = []
    path, parts, _ = sharp_path(runs, space, options, target, notes)
    assert notes == []
    return path, parts, target


@pytest.mark.parametrize("order", ["default", "paper"])
@pytest.mark.parametrize("size", [(4.0, 3.0), (3.3, 2.5), (7.0, 1.1)])
def test_all_is_swept_inside_the_free_space(size: tuple[float, float], order: str) -> None:
    space = free_space(maps.site(maps.box(0, 0, *size)), OPTIONS)
    path, parts, target = _planned(space, order)
    assert space.holds_points(path)
    assert target.missed_area(path) < 0.005 * target.area
    assert path_length(path) < (1.3 if order == "default" else 1.5) * target.area / TOOL
    assert parts[0].first == 0
    assert parts[-1].last == len(path) - 1
    assert all(a.last == b.first for a, b in itertools.pairwise(parts))


def test_what_is_missed_costs_more_than_the_path_that_would_sweep_it() -> None:
    target = Target(MultiPolygon([shapely.box(0, 0, 4, 1)]), TOOL)
    half = np.array([[0.2, 0.5], [2.0, 0.5]])
    whole = np.array([[0.2, 0.5], [3.8, 0.5]])
    assert path_length(half) == pytest.approx(1.8)
    left = [target.missed_area(way) for way in (half, whole)]
    assert path_cost(whole, left[1], TOOL) < path_cost(half, left[0], TOOL)


def test_a_chain_of_passes_takes_the_nearest_end_next() -> None:
    rng = np.random.default_rng(3)
    strokes = [Stroke(rng.uniform(0, 5, (2, 2)), False, -1) for _ in range(12)]
    runs = chained(strokes, (0.0, 0.0))
    assert {id(run.stroke) for run in runs} == {id(stroke) for stroke in strokes}
    for run in runs:
        ends = sorted(map(tuple, run.points.tolist()))
        assert ends == sorted(map(tuple, run.stroke.points.tolist()))
    waiting = {id(run.stroke): run for run in runs[1:]}
    for here, after in itertools.pairwise(runs):
        ends = [end for run in waiting.values() for end in run.stroke.points]
        nearest = min(math.dist(here.points[-1], end) for end in ends)
        assert math.dist(here.points[-1], after.points[0]) == pytest.approx(nearest, abs=1e-5)
        del waiting[id(after.stroke)]


def test_parts_follow_each_other() -> None:
    recorder = Recorder()
    runs: list[tuple[PartKind, int]] = [("link", 2), ("loop", 5), ("loop", 9)]
    for kind, last in (*runs, ("cleanup", 9), ("cleanup", 11)):
        recorder.close(kind, last)
    recorder.close("cleanup", 12)
    found = [(part.kind, part.first, part.last) for part in recorder.parts]
    assert found == [("link", 0, 2), ("loop", 2, 5), ("loop", 5, 9), ("cleanup", 9, 12)]
    recorder.ahead = 10
    recorder.close("link", 3)
    assert (recorder.parts[-1].first, recorder.parts[-1].last) == (12, 13)
