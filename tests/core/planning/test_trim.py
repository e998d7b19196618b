"""What sweeps nothing new at the end of a path is left out, and nothing else."""

from __future__ import annotations

import numpy as np
import pytest
import shapely
from shapely import MultiPolygon

from polepilot.core.plan import PlanPart
from polepilot.core.planning.swept import swept_shape
from polepilot.core.planning.target import Target
from polepilot.core.planning.trim import trimmed

TOOL = 0.4
FLOOR = Target(MultiPolygon([shapely.box(-1, -1, 9, 9)]), TOOL)


def _trimmed(path: list[list[float]], most: float = 0.001) -> np.ndarray:
    points = np.array(path, dtype=float)
    parts = (PlanPart("loop", 0, 2), PlanPart("cleanup", 2, len(points) - 1))
    short, left = trimmed(points, parts, FLOOR, most)
    lost = swept_shape(points, TOOL).difference(swept_shape(short, TOOL)).area
    assert lost <= most + 1e-4
    assert left[0].first == 0
    assert left[-1].last == len(short) - 1
    return short


def test_a_way_back_is_not_driven() -> None:
    short = _trimmed([[0, 0], [3, 0], [3, 2], [3, 0], [0.5, 0]])
    assert short[-1] == pytest.approx([3, 2], abs=0.1)


def test_a_part_of_a_leg_may_go() -> None:
    short = _trimmed([[0, 0], [3, 0], [3, 2], [1, 2], [1, 0]])
    # Down to the first leg new floor is swept, and its sides only by the middle of the disc.
    assert short[-1] == pytest.approx([1, 0.25], abs=0.1)
    assert len(short) == 5


def test_new_floor_is_kept() -> None:
    path = [[0, 0], [3, 0], [3, 2], [0, 2]]
    assert _trimmed(path) == pytest.approx(np.array(path))
    assert trimmed(np.zeros((2, 2)), (), FLOOR, 1.0)[0].shape == (2, 2)
