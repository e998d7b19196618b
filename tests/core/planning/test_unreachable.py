"""What cannot be reached, as polygons that other programs can work with."""

from __future__ import annotations

import numpy as np
import pytest
import shapely
from plans.scorer import agreement, ground
from plans.shapes import fences, from_polygon
from shapely import Polygon

from polepilot.core.planning.options import PlanOptions
from polepilot.core.planning.space import as_multi, free_space
from polepilot.core.planning.unreachable import _on_grid, _ring, unreachable_pieces
from polepilot.core.site import parse_site


@pytest.mark.parametrize("seed", range(20))
def test_corners_that_nearly_touch_stay_sound_on_the_grid(seed: int) -> None:
    """A corner 0.02 mm from a slanting side: rounded each by itself, they would cross."""
    rng = np.random.default_rng(seed)
    side = np.array([[0.0, 0.0], [2.0, rng.uniform(0.3, 0.9)]])
    step = side[1] / np.hypot(*side[1])
    tip = side[1] * rng.uniform(0.3, 0.7) + 2e-5 * np.array([-step[1], step[0]])
    right, left = np.array([0.2, 0.4]), np.array([-0.2, 0.4])
    piece = Polygon([*side, (2, 1.5), tip + right, tip, tip + left, (0, 1.5)])
    assert piece.is_valid
    parts = [Polygon(_ring(part)) for part in _on_grid(piece)]
    assert all(part.is_valid and not part.interiors for part in parts)
    assert shapely.union_all(parts).area == pytest.approx(piece.area, abs=0.001)
    corners = np.vstack([np.asarray(part.exterior.coords) for part in parts])
    assert np.abs(corners * 1e4 - np.rint(corners * 1e4)).max() < 1e-6


@pytest.mark.parametrize("seed", [4, 9, 12, 13, 30, 31])
def test_pockets_between_thin_walls_are_named_whole(seed: int) -> None:
    """Walls cross each other at all angles; what they divide is judged from outside."""
    site = fences((8, 6), 8, seed)
    space = free_space(parse_site(site, "fences"), PlanOptions(min_turn_radius=0))
    reachable = as_multi(space.reachable().intersection(space.floor))
    pieces = unreachable_pieces(space, reachable)
    found = ground(site, space.start.position, space.clearance)
    named = [{"polygon": piece.polygon, "reason": piece.reason} for piece in pieces]
    assert agreement(found, named) > 0.985


def test_ground_is_nowhere_farther_from_the_free_space_than_the_disc() -> None:
    """Where arcs nearly touch, the outline of all discs was once filled in between."""
    site = parse_site(fences((8, 6), 8, 9), "fences")
    space = free_space(site, PlanOptions(min_turn_radius=0))
    x, y = np.meshgrid(np.arange(0.05, 8, 0.1), np.arange(0.05, 6, 0.1))
    points = shapely.points(x.ravel(), y.ravel())
    inside = shapely.covers(space.reachable(), points)
    distances = shapely.distance(space.polygon, points)
    assert distances[inside].max() < space.clearance + 0.001
    assert distances[~inside].min() > space.clearance - 0.001


@pytest.mark.parametrize(
    ("width", "said"),
    [
        (0.38, "behind a passage of 38 cm; the robot needs 40 cm"),
        (0.395, "behind a passage of 39.5 cm; the robot needs 40 cm"),
        (0.4001, "behind a passage of 40 cm; the robot needs 40 cm and a little play"),
        (0.41, None),
    ],
)
def test_the_width_of_a_passage_is_told_apart_from_what_is_needed(
    width: float, said: str | None
) -> None:
    rooms = shapely.union_all(
        [shapely.box(0, 0, 2, 2), shapely.box(2, 1, 3, 1 + width), shapely.box(3, 0, 5, 1.9)]
    )
    space = free_space(parse_site(from_polygon(rooms), "rooms"), PlanOptions(min_turn_radius=0))
    reasons = [p.reason for p in unreachable_pieces(space, space.reachable())]
    assert reasons == ([said] if said else [])
