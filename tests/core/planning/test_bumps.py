"""Bumps of a path: they sweep what it missed, lose nothing, and are short."""

from __future__ import annotations

import numpy as np
import pytest
import shapely
from core.planning import maps
from shapely import MultiPolygon

from polepilot.core.plan import PlanPart
from polepilot.core.planning import bumps
from polepilot.core.planning.bumps import with_bumps
from polepilot.core.planning.options import PlanOptions
from polepilot.core.planning.space import free_space
from polepilot.core.planning.swept import swept_shape
from polepilot.core.planning.target import Target

TOOL = 0.4


def _bumped(path: list[list[float]], target: shapely.Polygon) -> tuple[np.ndarray, float, float]:
    """The path with bumps, what it missed before of the target, and what it misses after, m²."""
    space = free_space(maps.site(maps.box(-2, -2, 4, 4)), PlanOptions(min_turn_radius=0))
    line, area = np.array(path, dtype=float), MultiPolygon([target])
    parts = (PlanPart("loop", 0, 1), PlanPart("loop", 1, len(line) - 1))
    points, moved, _ = with_bumps(line, parts, Target(area, TOOL), space, 0.0005)
    assert [part.kind for part in moved] == ["loop", "loop"]
    assert moved[0].last == moved[1].first
    assert moved[1].last == len(points) - 1
    before, after = (area.difference(swept_shape(way, TOOL)).area for way in (line, points))
    return points, before, after


def test_the_tip_of_a_corner_is_reached() -> None:
    # Outside of the corner the disc leaves a tip; the loop around would sweep the rest.
    target = shapely.box(0, 0.1, 1.2, 2).union(shapely.box(0.9, 0.0, 1.2, 0.3))
    path = [[1.0, 2.0], [1.0, 0.2], [0.2, 0.2]]
    points, before, after = _bumped(path, target.intersection(shapely.box(0.8, 0, 1.2, 2)))
    assert before > 0.005
    assert after < 0.3 * before
    assert _length(points) < _length(np.array(path)) + 0.2


def test_a_strip_beside_a_leg_is_swept_by_stretches_that_step_aside() -> None:
    target = shapely.box(0.3, -0.1, 2.7, 0.3)  # 10 cm more than the leg sweeps
    path = [[0.0, 0.0], [0.05, 0.0], [3.0, 0.0]]
    points, before, after = _bumped(path, target)
    assert before == pytest.approx(0.24, abs=0.001)
    assert after < 0.08 * before
    # Along the strip and back would be twice its length, 4.8 m.
    assert _length(points) - 3.0 < 0.85 * 2.4


def test_a_leg_twice_as_long_is_twice_the_work(monkeypatch: pytest.MonkeyPatch) -> None:
    """What bumps do elsewhere on a long leg is nobody's business here."""
    taken = 0
    part = bumps._Bumped._part

    def counted(self: bumps._Bumped, index: int, begin: float, end: float) -> bumps.Points:
        nonlocal taken
        taken += 1
        return part(self, index, begin, end)

    monkeypatch.setattr(bumps._Bumped, "_part", counted)
    work = []
    for length in (20.0, 40.0):
        taken = 0
        space = free_space(maps.site(maps.box(-2, -2, length + 2, 2)), PlanOptions())
        target = Target(MultiPolygon([shapely.box(0.3, -0.1, length - 0.3, 0.3)]), TOOL)
        path = np.array([[0.0, 0.0], [0.05, 0.0], [length, 0.0]])
        parts = (PlanPart("loop", 0, 2),)
        points, _, missed = with_bumps(path, parts, target, space, 0.0005)
        assert missed < 0.08 * 0.1 * length
        assert len(points) > 2 * length
        work.append(taken)
    assert work[0] > 50
    assert work[1] < 2.3 * work[0]


def test_nothing_missed_nothing_changed() -> None:
    path = [[0.0, 0.0], [1.0, 0.0], [3.0, 0.0]]
    points, before, after = _bumped(path, shapely.box(0.5, -0.1, 2.5, 0.1))
    assert before == after == 0
    assert np.array_equal(points, np.array(path))


def _length(points: np.ndarray) -> float:
    return float(np.hypot(*np.diff(points, axis=0).T).sum())


@pytest.mark.parametrize("tip", [0.02, 0.1, 0.3])
@pytest.mark.parametrize("corner", [[], [[0.15, 0.0]], [[0.15, 0.1]]])
def test_what_a_bump_no_longer_sweeps_is_measured(tip: float, corner: list[list[float]]) -> None:
    old = np.array([[0.0, 0.0], *corner, [0.3, 0.0 if not corner else 0.15]])
    new = np.array([old[0], [0.15, -tip], old[-1]])
    spots, sizes = bumps._pieces_along(old, TOOL / 2)
    found = sizes[bumps._away(spots, bumps._legs(new), TOOL / 2)].sum()
    discs = [shapely.LineString(line).buffer(TOOL / 2, quad_segs=64) for line in (old, new)]
    assert found == pytest.approx(discs[0].difference(discs[1]).area, rel=0.15, abs=3e-4)
