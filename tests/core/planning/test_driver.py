"""Runs followed by a steered wheel: loops got onto from beside, and who is stuck."""

from __future__ import annotations

import math
import time

import numpy as np
import pytest
from plans.shapes import box, document

from polepilot.core.geometry import Pose2D
from polepilot.core.planning.driver import Driver
from polepilot.core.planning.options import PlanOptions
from polepilot.core.planning.space import FreeSpace, free_space
from polepilot.core.site import parse_site

RADIUS = 0.6


def space_of(site: dict[str, object]) -> FreeSpace:
    return free_space(parse_site(site, "the map"), PlanOptions(min_turn_radius=RADIUS))


def test_a_loop_beside_is_got_onto_forward_and_driven_once_around() -> None:
    driver = Driver(space_of(document(box(0, 0, 9, 7))), RADIUS, Pose2D(4.0, 1.0, 0.0))
    loop = np.array([[4.0, 1.38], [7.5, 1.38], [7.5, 5.5], [1.5, 5.5], [1.5, 1.38], [4.0, 1.38]])
    rest = driver.enter(loop, closed=True)
    assert rest is not None
    points, gears = driver.track.arrays()
    assert (gears > 0).all()
    assert points[-1] == pytest.approx(rest[0])
    assert driver.track.pose.heading == pytest.approx(0.0, abs=1e-6)
    assert rest[0, 1] == pytest.approx(1.38)
    assert 4.0 + RADIUS < rest[0, 0] < 4.0 + 3 * RADIUS
    assert rest[0] == pytest.approx(rest[-1])
    length, whole = (float(np.hypot(*np.diff(line, axis=0).T).sum()) for line in (rest, loop))
    assert length == pytest.approx(whole)
    assert {tuple(row) for row in loop[1:-1]} < {tuple(row) for row in rest}


def test_a_line_begins_where_it_begins() -> None:
    driver = Driver(space_of(document(box(0, 0, 9, 7))), RADIUS, Pose2D(4.0, 1.0, 0.0))
    line = np.array([[4.0, 1.38], [7.5, 1.38]])
    rest = driver.enter(line)
    assert rest is not None
    assert rest == pytest.approx(line)


def test_who_is_stuck_finds_that_out_soon() -> None:
    # Across a corridor hardly wider than the robot no wheel turns.
    driver = Driver(space_of(document(box(0, 0, 6, 0.42))), RADIUS, Pose2D(3.0, 0.21, math.pi / 2))
    around = np.array([[x, 0.21] for x in np.linspace(3.3, 5.7, 13)])
    began = time.process_time()
    for _ in range(5):
        assert driver.enter(around) is None
    assert driver.track.last == 0
    assert time.process_time() - began < 2.0
