"""Ways of a steered wheel in tight places, looked for in short pieces to and fro.

A wheel that turns no tighter than some radius still gets everywhere where its disc does, if it goes
forward and backward often enough. From one pose or several the search goes on by short arcs and
straight pieces, level by level; from each pose that it gets to it tries to end with a curve that is
worked out: an arc and a straight piece to a place, or two arcs onto a line.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from polepilot.core.geometry import Point, Pose2D
from polepilot.core.planning.curves import CHANGE, KIND, Curve, joined, sample, spots
from polepilot.core.planning.space import FreeSpace

Array = NDArray[np.float64]
Indices = NDArray[np.intp]

_STEPS = ((0.33, 7), (0.2, 13))
"""Length of a piece, in turning radii, and how many there are at most; the longer ones first."""
_MOST_LEVELS = 25
_STATES = 40
"""So many poses are gone on from on each level, for each of the levels that there are at most."""
_MOST_CHECKS = 30
"""So many ways are looked at closely on each level."""
_SHORTEST = 0.03
"""Pieces shorter than this are not driven, metres."""
_TURN = math.radians(8.0)
"""Headings nearer to each other than this count as one."""

_MOVES = tuple((kind, sign) for kind in "SLR" for sign in (1.0, -1.0))
_SIDES = np.array([{"S": 0.0, "L": 1.0, "R": -1.0}[kind] for kind, _ in _MOVES])
_SIGNS = np.array([sign for _, sign in _MOVES])


@dataclass(slots=True, eq=False)
class _States:
    """Poses to which ways lead: columns of one length."""

    x: Array
    y: Array
    heading: Array
    cost: Array
    move: Indices
    """By which of ``_MOVES`` the robot came; -1: it is where it began."""
    parent: Indices
    """Index of the state before it, one level up."""

    def __len__(self) -> int:
        return len(self.x)

    def take(self, rows: Indices) -> _States:
        return _States(
            self.x[rows],
            self.y[rows],
            self.heading[rows],
            self.cost[rows],
            self.move[rows],
            self.parent[rows],
        )

    def local(self, x: float, y: float) -> tuple[Array, Array]:
        """How far ahead and to the left a place is."""
        cos, sin = np.cos(self.heading), np.sin(self.heading)
        return (
            cos * (x - self.x) + sin * (y - self.y),
            -sin * (x - self.x) + cos * (y - self.y),
        )


@dataclass(frozen=True, slots=True, eq=False)
class _Ends:
    """Curves that lead from states to the goal, the cheapest first."""

    rows: Indices
    """Of the states."""
    sides: Array
    lengths: Array
    """See ``curves.columns``."""

    def curve(self, index: int) -> Curve:
        pieces = zip(self.sides[index].tolist(), self.lengths[index].tolist(), strict=True)
        return tuple((KIND[side], length) for side, length in pieces)


@dataclass(frozen=True, slots=True)
class _Goal:
    """Where to, as a search asks for it."""

    ends: Callable[[_States], _Ends]
    """The cheapest last curves from some states."""
    promise: Callable[[_States], Array]
    """How far the goal is from each of them, about, metres."""


def way_to_place(
    space: FreeSpace,
    poses: Array,
    radius: float,
    place: Point,
    levels: int = _MOST_LEVELS,
) -> tuple[int, Curve] | None:
    """A curve to a place, with whatever heading there, and from which row of ``poses`` it leads.

    ``poses``: N x 3, x, y, heading, all of them in the free space. ``radius``: of all arcs,
    metres. ``levels``: after so many pieces, if they are given, a search is given up that is
    the narrower the fewer there are. None: no way was found.
    """
    x, y = place

    def ends(here: _States) -> _Ends:
        return _ends_at(here, x, y, radius)

    def promise(here: _States) -> Array:
        return np.asarray(np.hypot(here.x - x, here.y - y))

    return _search(space, poses, radius, _Goal(ends, promise), levels)


def way_to_line(
    space: FreeSpace,
    poses: Array,
    radius: float,
    first: Point,
    last: Point,
    levels: int = _MOST_LEVELS,
) -> tuple[int, Curve] | None:
    """A curve to ``first`` that ends on the line to ``last``, looking along it or away from it."""
    heading = math.atan2(last[1] - first[1], last[0] - first[0])
    length = math.dist(first, last)
    cos, sin = math.cos(heading), math.sin(heading)

    def ends(here: _States) -> _Ends:
        return _ends_on(here, first, heading, radius)

    def promise(here: _States) -> Array:
        along = cos * (here.x - first[0]) + sin * (here.y - first[1])
        across = -sin * (here.x - first[0]) + cos * (here.y - first[1])
        beyond = np.maximum(0.0, np.maximum(-along, along - length))
        askew = np.abs(np.sin(here.heading - heading))
        return np.asarray(np.hypot(across, beyond) + radius * askew)

    return _search(space, poses, radius, _Goal(ends, promise), levels)


def _search(
    space: FreeSpace, poses: Array, radius: float, goal: _Goal, levels: int
) -> tuple[int, Curve] | None:
    if not len(poses):
        return None
    count = len(poses)
    x, y, heading = poses[:, :3].T
    begin = _States(x, y, heading, np.zeros(count), np.full(count, -1), np.arange(count))
    found = _checked(space, [begin], radius, goal, 0.0)
    for share, most in _STEPS:
        if found is not None:
            return found
        step = share * radius
        trail = [begin]
        known: Indices = np.zeros(0, dtype=np.int64)
        for _ in range(min(most, levels)):
            every = _moved(space, trail[-1], radius, step)
            cells = _cells(every, step)
            rows = _chosen(every, cells, known, goal.promise(every))[: _STATES * levels]
            known = np.concatenate([known, cells[rows]])
            states = every.take(rows)
            if not len(states):
                break
            trail.append(states)
            found = _checked(space, trail, radius, goal, step)
            if found is not None:
                return found
    return found


def _checked(
    space: FreeSpace, trail: list[_States], radius: float, goal: _Goal, step: float
) -> tuple[int, Curve] | None:
    """The cheapest curve to the goal from the last states of a trail that is free all the way."""
    states = trail[-1]
    ends = goal.ends(states)
    rows = ends.rows
    poses = np.stack([states.x[rows], states.y[rows], states.heading[rows]], axis=1)
    points = spots(poses, ends.sides, ends.lengths, radius)
    for index in np.flatnonzero(space.holds_rows(points))[:_MOST_CHECKS].tolist():
        start, curve = _traced(trail, int(rows[index]), ends.curve(index), step)
        first = trail[0]
        pose = Pose2D(float(first.x[start]), float(first.y[start]), float(first.heading[start]))
        if space.holds_points(sample(pose, curve, radius)[0]):
            return start, curve
    return None


def _traced(trail: list[_States], row: int, end: Curve, step: float) -> tuple[int, Curve]:
    """Where a way begins, and all of its pieces."""
    pieces: list[tuple[str, float]] = []
    for states in reversed(trail[1:]):
        kind, sign = _MOVES[int(states.move[row])]
        pieces.append((kind, sign * step))
        row = int(states.parent[row])
    return row, joined((*pieces[::-1], *end))


def _changed(states: _States, sign: Array) -> Array:
    """What a change of gear costs those that went the other way before."""
    return np.where((states.move >= 0) & ((states.move % 2 == 0) != (sign > 0)), CHANGE, 0.0)


def _signs(count: int) -> list[Array]:
    """All ways in which so many things may be 1 or -1, as columns."""
    return list(np.array(list(itertools.product((1.0, -1.0), repeat=count))).T[:, :, None])


def _ends_at(states: _States, x: float, y: float, radius: float) -> _Ends:
    """An arc, and straight on to a place."""
    side, sign = _signs(2)
    ahead, aside = states.local(x, y)
    # Where the place lies as seen from the middle of the circle to that side.
    along, across = sign * ahead, side * aside - radius
    square = along**2 + across**2 - radius**2
    rest = np.sqrt(np.maximum(square, 0.0))
    turn = (np.arctan2(across, along) + np.arctan2(radius, rest)) % math.tau
    turn = np.where(turn > math.tau - 1e-6, 0.0, turn)
    good = (square >= 0) & (turn < 0.75 * math.pi)
    good &= _driven(turn * radius) & _driven(rest)
    cost = states.cost + turn * radius + rest + _changed(states, sign)
    sides = np.stack(np.broadcast_arrays(side, 0.0), axis=-1)
    return _cheapest(good, cost, sides, np.stack([sign * radius * turn, sign * rest], axis=-1))


def _ends_on(states: _States, first: Point, heading: float, radius: float) -> _Ends:
    """Two arcs onto a line, and along it to its first place."""
    ahead, sign, side = _signs(3)
    about = np.where(ahead > 0, 0.0, math.pi)
    # As seen along the way that is driven: forward where it looks, backward its back.
    way = heading + about + np.where(sign > 0, 0.0, math.pi)
    cos, sin = np.cos(way), np.sin(way)
    along = cos * (states.x - first[0]) + sin * (states.y - first[1])
    across = -sin * (states.x - first[0]) + cos * (states.y - first[1])
    askew = (states.heading - heading - about + math.pi) % math.tau - math.pi
    middle = (1 + np.cos(askew) + side * across / radius) / 2
    back = np.arccos(np.clip(middle, -1.0, 1.0))
    turn = back - side * askew
    met = along + side * radius * (2 * np.sin(side * back) - np.sin(askew))
    good = (np.abs(middle) <= 1) & (turn >= 0) & (turn < 0.75 * math.pi)
    good &= _driven(turn * radius) & _driven(back * radius) & _driven(np.abs(met))
    cost = states.cost + radius * (turn + back) + np.abs(met)
    cost = cost + _changed(states, sign) + CHANGE * (met > 0)
    sides = np.stack(np.broadcast_arrays(side * sign, -side * sign, 0.0), axis=-1)
    arcs = sign * radius
    return _cheapest(good, cost, sides, np.stack([arcs * turn, arcs * back, -sign * met], axis=-1))


def _cheapest(good: NDArray[np.bool_], cost: Array, sides: Array, lengths: Array) -> _Ends:
    """The cheapest of the good ones, of each kind of curve so many. ``good``, ``cost``: kinds x
    states; ``sides``: kinds x 1 x pieces; ``lengths``: kinds x states x pieces."""
    cost = np.where(good, np.round(cost, 6), np.inf)
    rows = np.argsort(cost, axis=1, kind="stable")[:, : 2 * _MOST_CHECKS]
    kinds, places = np.nonzero(np.isfinite(np.take_along_axis(cost, rows, axis=1)))
    rows = rows[kinds, places]
    order = np.lexsort((rows, cost[kinds, rows]))
    kinds, rows = kinds[order], rows[order]
    return _Ends(rows, sides[kinds, 0], lengths[kinds, rows])


def _driven(length: Array) -> NDArray[np.bool_]:
    """Whether a piece is nothing at all, or long enough."""
    return np.asarray((length > _SHORTEST) | (length < 1e-7))


def _moved(space: FreeSpace, states: _States, radius: float, step: float) -> _States:
    """The states one piece farther on that are free, by each of the moves."""
    moves, rows = np.nonzero(states.move != (np.arange(len(_MOVES)) ^ 1)[:, None])  # no way back
    x, y, heading = states.x[rows], states.y[rows], states.heading[rows]
    whole: tuple[Array, Array] = (x, y)
    free = np.ones(len(rows), dtype=bool)
    for share in (1.0, 0.5):
        bend = _SIDES[moves] * _SIGNS[moves] * share * step / radius
        chord = _SIGNS[moves] * share * step * np.sinc(bend / math.tau)
        there = x + chord * np.cos(heading + bend / 2), y + chord * np.sin(heading + bend / 2)
        whole = there if share == 1.0 else whole
        free[free] = space.holds_each(np.stack(there, axis=1)[free])
    turned = heading + _SIDES[moves] * _SIGNS[moves] * step / radius
    changed = (states.move[rows] >= 0) & ((states.move[rows] % 2 == 0) != (_SIGNS[moves] > 0))
    cost = states.cost[rows] + step + np.where(changed, CHANGE, 0.0)
    return _States(whole[0], whole[1], turned, cost, moves, rows).take(np.flatnonzero(free))


def _cells(states: _States, step: float) -> Indices:
    """Numbers of which those of states that count as one are the same."""
    size = step / 4
    turn = np.round(states.heading / _TURN).astype(np.int64) % round(math.tau / _TURN)
    x, y = (np.floor(values / size).astype(np.int64) for values in (states.x, states.y))
    cells = ((x % 1_000_003) * 1_000_003 + y % 1_000_003) * 100 + turn * 2 + states.move % 2
    return np.asarray(cells)


def _chosen(states: _States, cells: Indices, known: Indices, promise: Array) -> Indices:
    """Rows of states unlike those known so far and unlike each other, the most promising first."""
    order = np.argsort(np.round(states.cost + promise, 6), kind="stable")
    first = np.unique(cells[order], return_index=True)[1]
    rows = order[np.sort(first)]
    return rows[~np.isin(cells[rows], known)]
