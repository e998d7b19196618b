"""A way back to the path that a steered front wheel can drive, forward and backward.

Who left its path to pass something, or to make room, may stand in a corner that it cannot turn
round in. The curves between two poses come from outside; here they are tried, against walls and
obstacles, in portions that fit into a tick.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from polepilot.core.control.places import Floats, Gears, pose_at
from polepilot.core.geometry import Pose2D, wrap_angle

Line = tuple[Floats, Gears]
"""Points (N x 2, `map`) and the gear between each two of them (N-1)."""
Curves = Callable[[Pose2D, Pose2D], Sequence[Line]]
"""Ways from one pose to another, no tighter than the wheel can turn, the best first."""
Gaps = Callable[[Floats], Floats]
"""How much farther than it has to be each of some points is from everything, metres."""

CHANGE = 0.5
"""What a change of gear costs, as metres of way."""
BACKWARD = 2.0
"""What a metre backward costs: no sensor looks that way."""
SKIPPED = 2.0
"""What a metre of the path costs that is left out."""
MOST_BACKWARD = 0.8
"""No way goes farther backward than this in one go, metres."""
SPACING = 0.03
"""Metres between the points that are checked."""
ENDS = 0.30
"""So near either end the way may be as narrow as that end is itself, metres;"""
GIVE = 0.005
"""and by so much narrower."""
LEAST_ROOM = -0.045
"""What may be missing of the room at the end, where the path may be narrow, metres."""
GOAL_EVERY = 5
"""Every so many samples of the path are a place to go back to,"""
GOALS_TO = 1.0
"""so far along the path, metres;"""
FAR_GOALS = 50
"""and one in so many samples after that."""
_MOVES = [(gear * length, bend) for length in (0.2, 0.4, 0.7) for gear in (-1, 1)
          for bend in (0, 1, -1)]  # fmt: skip
"""What can be driven first, where no single curve leads back: metres, and left, straight, right."""


@dataclass(frozen=True, slots=True)
class Goal:
    """A place of the path."""

    pose: Pose2D
    along: float
    """Metres along the path."""
    skipped: float
    """So much of the path is left out by who goes on from there, metres."""


@dataclass(frozen=True, slots=True, eq=False)
class Way:
    """A way that is free."""

    points: Floats
    gears: Gears
    goal: Goal
    cost: float

    def led_out(self, points: Floats, along: Floats, gears: Gears) -> Line:
        """The way, and after it the path in one gear: points, metres along it and gears given."""
        after = along > self.goal.along + 1e-6
        points, gears = points[after], gears[after]
        count = int((np.cumsum(np.diff(gears, prepend=gears[:1]) != 0) == 0).sum())
        return np.vstack([self.points, points[:count]]), np.append(self.gears, gears[:count])


def goals_on(
    points: Floats, along: Floats, gears: Gears, free: NDArray[np.bool_], *, far: bool
) -> list[Goal]:
    """Free places of the path ahead to go back to: many soon, ``far``: and some later."""
    if len(points) == 0:
        return []
    chosen = np.zeros(len(points), bool)
    chosen[::GOAL_EVERY] = True
    chosen &= along <= along[0] + GOALS_TO
    chosen[::FAR_GOALS] |= far
    return [
        Goal(pose_at(points, gears, int(i)), float(along[i]), float(along[i] - along[0]))
        for i in np.flatnonzero(chosen & free)
    ]


def ways_back(
    start: Pose2D, goals: Sequence[Goal], curves: Curves, gaps: Gaps, radius: float
) -> Iterator[Way | None]:
    """Look for the cheapest way to any of the goals; each step is one portion of work.

    First without, then with a short move before the curve.

    Args:
        radius: of the arcs of that first move.

    Yields:
        None after a portion without a result, or the way, which is the last that comes.
    """
    best = _best(_line_of(start, 0.0, 0, radius), start, goals, curves, gaps)
    if best is not None:
        yield best
        return
    yield None
    found: list[Way] = []
    for length, bend in _MOVES:
        first = _line_of(start, length, bend, radius)
        if _free(first[0], gaps):
            way = _best(first, _moved(start, length, bend, radius), goals, curves, gaps)
            found += [] if way is None else [way]
        yield None
    if found:
        yield min(found, key=lambda way: way.cost)


def _best(
    first: Line, begin: Pose2D, goals: Sequence[Goal], curves: Curves, gaps: Gaps
) -> Way | None:
    best: Way | None = None
    for goal in goals:
        for points, gears in curves(begin, goal.pose):
            line = _dense(np.vstack([first[0], points[1:]]), np.concatenate([first[1], gears]))
            cost = _cost(line) + SKIPPED * goal.skipped
            if cost >= (math.inf if best is None else best.cost) or len(line[1]) == 0:
                continue
            if _free(line[0], gaps):
                best = Way(*line, goal, cost)
    return best


def _line_of(start: Pose2D, length: float, bend: int, radius: float) -> Line:
    count = math.ceil(abs(length) / SPACING)
    stops = [_moved(start, length * i / max(count, 1), bend, radius) for i in range(count + 1)]
    points = np.array([stop.position for stop in stops])
    return points, np.full(count, 1 if length > 0 else -1, np.int8)


def _moved(start: Pose2D, length: float, bend: int, radius: float) -> Pose2D:
    if bend == 0:
        return Pose2D(*start.ahead(length), start.heading)
    turn = bend * length / radius
    chord = 2 * radius * math.sin(turn / 2) * bend
    x = start.x + chord * math.cos(start.heading + turn / 2)
    y = start.y + chord * math.sin(start.heading + turn / 2)
    return Pose2D(x, y, wrap_angle(start.heading + turn))


def _dense(points: Floats, gears: Gears) -> Line:
    """The same line with a point at least every few centimetres."""
    steps = np.diff(points, axis=0)
    lengths = np.hypot(*steps.T)
    keep = lengths > 1e-6
    counts = np.ceil(lengths[keep] / SPACING).astype(int)
    pieces = [points[:1]]
    for origin, step, count in zip(points[:-1][keep], steps[keep], counts, strict=True):
        pieces.append(origin + step * (np.arange(1, count + 1) / count)[:, None])
    return np.vstack(pieces), np.repeat(gears[keep], counts)


def _cost(line: Line) -> float:
    """Of a way that is left forward; infinite if too far backward in one go."""
    points, gears = line
    lengths = np.hypot(*np.diff(points, axis=0).T)
    changes = np.flatnonzero(np.diff(gears))
    pieces = np.split(lengths * (gears < 0), changes + 1)
    if max(float(piece.sum()) for piece in pieces) > MOST_BACKWARD:
        return math.inf
    return float(lengths @ np.where(gears < 0, BACKWARD, 1.0)) + CHANGE * len(changes)


def _free(points: Floats, gaps: Gaps) -> bool:
    """Whether the line keeps away from everything; near its ends, as far as those do."""
    room = gaps(points)
    needed = np.zeros(len(points))
    for end, least in ((0, -math.inf), (-1, LEAST_ROOM)):
        near = np.hypot(*(points - points[end]).T) < ENDS
        needed[near] = np.minimum(needed[near], max(room[end] - GIVE, least))
    return bool((room >= needed).all())
