"""Ways round a corner for a wheel that turns no tighter than a radius, the cheapest first.

A curve of Reeds and Shepp between the two legs, begun before, at, or beyond the corner.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np
import shapely
from numpy.typing import NDArray
from shapely import LineString

from polepilot.core.geometry import Pose2D, wrap_angle
from polepilot.core.planning.curves import (
    CHANGE,
    Curve,
    curve_cost,
    joined,
    sample,
    shortest_curves_each,
)

Points = NDArray[np.float64]

_SHORTEST = 0.004
"""Pieces shorter than this are not driven, metres."""


_PLACES: tuple[tuple[float, float, bool, bool], ...] = (
    *((-share, share, False, False) for share in (0.25, 0.5, 0.75, 1.0)),
    *(
        (first, last, True, False)
        for first, last in ((0, 0), (1, -1), (0.5, -0.5), (0.5, 0), (0, -0.5), (0, -1), (1, 0))
    ),
    *(
        (first, last, True, finish)
        for first, last in ((-1, 1), (-0.5, 1), (-1, 0.5), (-0.5, 0.5), (-0.25, 0.25), (0, 0.5))
        for finish in (True, False)
    ),
    *(
        (first, last, True, True)
        for first, last in ((-0.5, 0), (-1, 0), (-0.5, -0.5), (-1.5, 1.5), (-2, 1), (-2, 2))
    ),
)
"""Where turns begin on the way in and end on the way out, in shares of what an arc needs; whether
the corner is driven to before that, and whether the robot goes back to it after that."""


@dataclass(frozen=True, slots=True)
class Turn:
    """A way round a corner, in a frame with the corner at the origin and the way in along x."""

    cost: float
    cut: float
    lead: float
    """Where on the line of the way in it begins to turn, metres; negative: before the corner."""
    visit: bool
    """Whether the corner is driven to first; else the turn begins before it is reached."""
    stop: float
    """Where on the way out it ends; negative: before the corner."""
    curve: Curve
    """From ``lead`` to ``stop``."""
    radius: float

    @property
    def points(self) -> Points:
        """The curve's points, M x 2, from the corner on where that is visited."""
        if self.visit:
            begin, curve = 0.0, joined((("S", self.lead), *self.curve))
        else:
            begin, curve = self.lead, self.curve
        return _points(begin, curve, self.radius)

    def after(self, before: float) -> Curve:
        """The whole curve for a corner that lies ``before`` metres ahead."""
        if self.visit:
            return joined((("S", before), ("S", self.lead), *self.curve))
        return joined((("S", before + self.lead), *self.curve))


@lru_cache(maxsize=20_000)
def _points(begin: float, curve: Curve, radius: float) -> Points:
    return sample(Pose2D(begin, 0.0, 0.0), curve, radius)[0]


def turns_round(turn: float, radius: float) -> tuple[Turn, ...]:
    """Ways round a corner of ``turn`` radians, the cheapest first."""
    return _left_turns(turn, radius) if turn >= 0 else _right_turns(-turn, radius)


@lru_cache(maxsize=4000)
def _right_turns(turn: float, radius: float) -> tuple[Turn, ...]:
    """The mirror images of those to the left."""
    side = {"L": "R", "R": "L", "S": "S"}
    return tuple(
        replace(
            way,
            curve=tuple((side[kind], length) for kind, length in way.curve),
        )
        for way in _left_turns(turn, radius)
    )


@lru_cache(maxsize=4000)
def _left_turns(turn: float, radius: float) -> tuple[Turn, ...]:
    """Ways round a corner of ``turn`` radians to the left, the cheapest first."""
    legs = radius * math.tan(min(abs(turn), math.radians(120)) / 2)
    out = np.array([math.cos(turn), math.sin(turn)])
    least = _SHORTEST if abs(turn) * radius > _SHORTEST else 0.0
    ends = [
        (
            Pose2D(legs * first, 0.0, 0.0),
            Pose2D(legs * last * math.cos(turn), legs * last * math.sin(turn), wrap_angle(turn)),
        )
        for first, last, _, _ in _PLACES
    ]
    ways: list[Turn] = []
    every = shortest_curves_each(ends, radius, CHANGE)
    for (share, end, visit, finish), (start, _), curves in zip(_PLACES, ends, every, strict=True):
        first, last = share * legs, end * legs
        finish = finish or last < 0  # what lies before the corner must be free as well
        checks: list[Points] = []
        if not visit and first < 0:
            checks += [np.array([first * part, 0.0]) for part in (0.0, 0.25, 0.5, 0.75)]
        if not finish and last > 0:
            checks += [last * part * out for part in (0.25, 0.5, 0.75)]
        for curve in curves[:4]:
            if any(abs(length) < least for _, length in curve):
                continue
            cut = 0.0
            if checks:
                driven = sample(start, curve, radius)[0]
                if len(driven) < 2:
                    continue  # shorter than anything that is driven
                line = LineString(driven)
                cut = float(np.max(shapely.distance(line, shapely.points(np.array(checks)))))
            whole: Curve = (*curve, ("S", -last)) if finish else curve
            stop = 0.0 if finish else last
            way = Turn(0.0, cut, first, visit, stop, joined(whole), radius)
            cost = curve_cost(way.after(10.0)) - 10.0 - stop + 20 * min(cut, 0.5) ** 2
            ways.append(replace(way, cost=cost))
    return tuple(sorted(ways, key=lambda way: way.cost))
