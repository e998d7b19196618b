"""A way round an obstacle and back to the path: search on a small raster, then smoothing."""

from __future__ import annotations

import heapq
import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from polepilot.core.geometry import Point
from polepilot.core.scenery import Disc, Scenery

Floats = NDArray[np.float64]
Raster = NDArray[np.float64]

CELL = 0.06
MARGIN = 1.6
"""How far the search may leave the rectangle of start, goal and obstacle, metres."""
BARRIER = 6.0
"""Length of the line that closes the right side of the obstacle, metres."""
_STEPS = [(a, b, math.hypot(a, b)) for a in (-1, 0, 1) for b in (-1, 0, 1) if a or b]


@dataclass(frozen=True, slots=True)
class Room:
    """How near `base_link` may come to what, metres from its centre."""

    walls: float
    """To walls and poles."""
    least: float
    """To the surface of an obstacle, never less."""
    wanted: float
    """To the surface of an obstacle, where there is room."""


def find(
    start: Point,
    goals: Sequence[Point],
    obstacles: Sequence[Disc],
    barrier: tuple[Point, float] | None,
    scenery: Scenery,
    room: Room,
) -> tuple[int, Floats] | None:
    """The cheapest way from start to any of the goals that keeps clear of everything.

    Args:
        barrier: a place and a direction: the way does not cross the line from there; None where
            there is none.

    Returns:
        Which goal, and the way, N x 2 in `map`; None where no goal can be reached.
    """
    if not goals:
        return None
    low, high = _bounds([start, *goals, *(center for center, _ in obstacles)])
    shape = tuple(np.ceil((high - low) / CELL).astype(int) + 1)
    grid = np.stack(np.meshgrid(*(np.arange(n) for n in shape), indexing="ij"), axis=-1)
    places = low + grid.reshape(-1, 2) * CELL
    cost = _cost(places, start, obstacles, scenery, room).reshape(shape)
    if barrier is not None:
        (x, y), direction = barrier
        end = (x + BARRIER * math.cos(direction), y + BARRIER * math.sin(direction))
        fence = Scenery([((x, y), end)]).distances(places).reshape(shape)
        cost[fence < 0.75 * CELL] = np.inf
    cells = _search(cost, _cell(start, low, shape), {_cell(goal, low, shape) for goal in goals})
    if cells is None:
        return None
    reached = next(i for i, goal in enumerate(goals) if _cell(goal, low, shape) == cells[-1])
    way = low + np.asarray(cells, float) * CELL
    if len(way) < 2:
        way = np.vstack([way, way])
    way[0], way[-1] = start, goals[reached]
    return reached, _smooth(way, low, cost)


def _bounds(points: Sequence[Point]) -> tuple[Floats, Floats]:
    array = np.asarray(points, float)
    return array.min(axis=0) - MARGIN, array.max(axis=0) + MARGIN


def _cell(place: Point, low: Floats, shape: tuple[int, ...]) -> tuple[int, int]:
    index = np.round((np.asarray(place) - low) / CELL).astype(int)
    index = np.clip(index, 0, np.asarray(shape) - 1)
    return int(index[0]), int(index[1])


def _cost(
    places: Floats, start: Point, obstacles: Sequence[Disc], scenery: Scenery, room: Room
) -> Raster:
    """Cost per metre: 1 in the open, more where it is narrow, infinite where it is closed."""
    low, high = places.min(axis=0), places.max(axis=0)
    middle = (float(low[0] + high[0]) / 2, float(low[1] + high[1]) / 2)
    walls = scenery.near(middle, math.dist(low, high) / 2).distances(places)
    people = Scenery([], obstacles).distances(places)
    cost = np.ones(len(places))
    tight = np.clip((room.wanted - people) / (room.wanted - room.least), 0.0, 1.0)
    cost += 8 * tight
    cost += 3 * np.clip((room.walls + 0.06 - walls) / 0.06, 0.0, 1.0)
    closed = (people < room.least) | (walls < room.walls)
    # Where it stands already it may be, if only to get away from there.
    here = np.asarray([start], float)
    near = np.hypot(*(places - here[0]).T) < 0.15
    closed &= ~(
        near
        & (people >= Scenery([], obstacles).distances(here)[0] - 0.02)
        & (walls >= min(room.walls, float(scenery.distance(start)) - 0.02))
    )
    cost[closed] = np.inf
    return cost


def _search(
    cost: Raster, first: tuple[int, int], goals: set[tuple[int, int]]
) -> list[tuple[int, int]] | None:
    """Dijkstra over eight neighbours, to the first goal that is reached."""
    rows, columns = cost.shape
    price = cost.tolist()
    best = {first: 0.0}
    came: dict[tuple[int, int], tuple[int, int]] = {}
    queue = [(0.0, first)]
    while queue:
        so_far, here = heapq.heappop(queue)
        if so_far > best[here]:
            continue
        if here in goals:
            way = [here]
            while here in came:
                here = came[here]
                way.append(here)
            return way[::-1]
        for row, column, length in _STEPS:
            there = (here[0] + row, here[1] + column)
            if not (0 <= there[0] < rows and 0 <= there[1] < columns):
                continue
            total = so_far + length * price[there[0]][there[1]]
            if total < best.get(there, math.inf):
                best[there] = total
                came[there] = here
                heapq.heappush(queue, (total, there))
    return None


def _smooth(way: Floats, low: Floats, cost: Raster) -> Floats:
    """Round the corners of the raster, wherever that does not lead into a closed cell."""
    smooth = way.copy()
    for _ in range(30):
        moved = smooth.copy()
        moved[1:-1] = 0.25 * smooth[:-2] + 0.5 * smooth[1:-1] + 0.25 * smooth[2:]
        cells = np.round((moved - low) / CELL).astype(int)
        good = np.isfinite(cost[cells[:, 0], cells[:, 1]])
        smooth[good] = moved[good]
    return smooth
