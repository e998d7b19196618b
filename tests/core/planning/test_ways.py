"""Ways in tight places: they arrive, stay inside, and turn no tighter than asked."""

from __future__ import annotations

import math

import numpy as np
import pytest
from core.planning import maps

from polepilot.core.geometry import Pose2D
from polepilot.core.planning.curves import drive, sample
from polepilot.core.planning.options import PlanOptions
from polepilot.core.planning.space import FreeSpace, free_space
from polepilot.core.planning.ways import way_to_line, way_to_place

RADIUS = 0.6


def _space(wide: float, high: float) -> FreeSpace:
    return free_space(maps.site(maps.box(0, 0, wide, high)), PlanOptions())


def _end(space: FreeSpace, pose: Pose2D, curve: tuple[tuple[str, float], ...]) -> Pose2D:
    assert space.holds_points(sample(pose, curve, RADIUS)[0])
    for piece in curve:
        pose = drive(pose, piece, RADIUS)
    return pose


@pytest.mark.parametrize("seed", range(8))
def test_any_place_of_a_closet_is_reached(seed: int) -> None:
    space = _space(0.9, 1.1)
    rng = np.random.default_rng(seed)
    x, y, there_x, there_y = (float(v) for v in rng.uniform(0.25, 0.65, 4))
    pose = Pose2D(x, y, float(rng.uniform(-3, 3)))
    found = way_to_place(space, np.array([pose]), RADIUS, (there_x, there_y))
    assert found is not None
    assert _end(space, pose, found[1]).distance_to((there_x, there_y)) < 1e-6


@pytest.mark.parametrize("width", [0.8, 1.0, 1.3])
def test_a_wall_across_is_lined_up_with(width: float) -> None:
    """From along a corridor to the short wall at its end, looking one way or the other."""
    space = _space(4.0, width)
    first, last = (3.799, 0.201), (3.799, width - 0.201)
    pose = Pose2D(3.0, 0.201, 0.0)
    found = way_to_line(space, np.array([pose]), RADIUS, first, last)
    assert found is not None
    end = _end(space, pose, found[1])
    assert end.distance_to(first) < 1e-6
    assert abs(math.cos(end.heading)) < 1e-6


def test_the_nearer_of_two_poses_is_taken() -> None:
    space = _space(6.0, 4.0)
    poses = np.array([[1.0, 1.0, 0.0], [4.0, 2.0, 0.0]])
    found = way_to_place(space, poses, RADIUS, (4.5, 2.1))
    assert found is not None
    assert found[0] == 1


def test_behind_a_wall_there_is_no_way() -> None:
    site = maps.site(maps.box(0, 0, 4, 2), walls=[[[2, -1], [2, 3]]], start=[1, 1])
    space = free_space(site, PlanOptions())
    pose = np.array([[1.0, 1.0, 0.0]])
    assert way_to_place(space, pose, RADIUS, (3.0, 1.0), levels=3) is None
    assert way_to_place(space, np.zeros((0, 3)), RADIUS, (1.0, 1.0)) is None
