"""Ways round a corner for a wheel that turns no tighter than a radius, the cheapest first.

A curve of Reeds and Shepp between the two legs, begun before, at, or beyond the corner.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from polepilot.core.geometry import Pose2D, wrap_angle
from polepilot.core.planning.curves import (
    CHANGE,
    Curve,
    changes,
    columns,
    joined,
    sample,
    shortest_curves_each,
)

Points = NDArray[np.float64]

_SHORTEST = 0.004
"""Pieces shorter than this are not driven, metres."""
_CURVES = 4
"""So many curves between two places are looked at."""


_Place = tuple[float, float, bool, bool]

_PLACES: tuple[_Place, ...] = (
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
_USUAL = (*_PLACES[:5], (0, 0.5, True, False))
_DIGITS = 5
"""Turns are told apart to so many digits."""
_MOST_KNOWN = 8000


@dataclass(slots=True, eq=False)
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
    _points: Points | None = field(init=False, default=None)

    @property
    def points(self) -> Points:
        """The curve's points, M x 2, from the corner on where that is visited."""
        if self._points is None:
            begin, curve = self.lead, self.curve
            if self.visit:
                begin, curve = 0.0, joined((("S", self.lead), *self.curve))
            self._points = sample(Pose2D(begin, 0.0, 0.0), curve, self.radius)[0]
        return self._points

    def after(self, before: float) -> Curve:
        """The whole curve for a corner that lies ``before`` metres ahead."""
        if self.visit:
            return joined((("S", before), ("S", self.lead), *self.curve))
        return joined((("S", before + self.lead), *self.curve))


_KNOWN: dict[tuple[float, float, bool], tuple[Turn, ...]] = {}


def turns_round(turn: float, radius: float, every: bool = True) -> tuple[Turn, ...]:
    """Ways round a corner of ``turn`` radians, the cheapest first; not ``every`` one: only of the
    kinds that nearly always are the cheapest that fit, which is sooner worked out."""
    turn = round(turn, _DIGITS)
    key = (turn, radius, every)
    if key not in _KNOWN:
        if len(_KNOWN) > _MOST_KNOWN:
            _KNOWN.clear()
        if turn < 0:
            _KNOWN[key] = tuple(map(_mirrored, turns_round(-turn, radius, every)))
        else:
            _KNOWN[key] = _left_turns([turn], radius, _PLACES if every else _USUAL)[0]
    return _KNOWN[key]


def prepare(turns: Iterable[float], radius: float) -> None:
    """Works out the usual ways round many corners at once, which takes less time."""
    wanted = {round(abs(turn), _DIGITS) for turn in turns}
    new = sorted(turn for turn in wanted if (turn, radius, False) not in _KNOWN)
    if not new:
        return
    for turn, ways in zip(new, _left_turns(new, radius, _USUAL), strict=True):
        _KNOWN[turn, radius, False] = ways


def _mirrored(way: Turn) -> Turn:
    """The same to the other side."""
    side = {"L": "R", "R": "L", "S": "S"}
    return replace(way, curve=tuple((side[kind], length) for kind, length in way.curve))


def _left_turns(
    turns: Sequence[float], radius: float, places: Sequence[_Place]
) -> list[tuple[Turn, ...]]:
    """Ways round corners of some turns to the left, in radians; the cheapest first."""
    arcs = [radius * math.tan(min(turn, math.radians(120)) / 2) for turn in turns]
    ends = [
        (
            Pose2D(legs * first, 0.0, 0.0),
            Pose2D(legs * last * math.cos(turn), legs * last * math.sin(turn), wrap_angle(turn)),
        )
        for turn, legs in zip(turns, arcs, strict=True)
        for first, last, _, _ in places
    ]
    least = [_SHORTEST if turn * radius > _SHORTEST else 0.0 for turn in turns]
    found = [
        (row // len(places), places[row % len(places)], curve)
        for row, curves in enumerate(shortest_curves_each(ends, radius, CHANGE, _CURVES))
        for curve in curves
        if all(abs(length) >= least[row // len(places)] for _, length in curve)
    ]
    of = np.array([corner for corner, _, _ in found], dtype=np.intp)
    legs, angles = np.array(arcs)[of], np.array(turns)[of]
    out = np.stack([np.cos(angles), np.sin(angles)], axis=1)[:, None]
    first, last = legs * np.array([place[:2] for _, place, _ in found]).reshape(-1, 2).T
    visit, finish = np.array([place[2:] for _, place, _ in found], bool).reshape(-1, 2).T
    finish = finish | (last < 0)  # what lies before the corner must be free as well
    sides, lengths = columns([curve for _, _, curve in found])
    # What a curve leaves out of the legs: the way in up to the corner, the way out from there on.
    shares = np.array([0.0, 0.25, 0.5, 0.75])[:, None]
    beyond = np.maximum(shares, shares[1])
    spots = [first[:, None, None] * shares * [1.0, 0.0], last[:, None, None] * beyond * out]
    off = _distances(first, sides, lengths, radius, np.concatenate(spots, axis=1))
    off_in, off_out = off.reshape(-1, 2, len(shares)).max(axis=2).T
    cut = np.where(~visit & (first < 0), off_in, 0.0)
    cut = np.maximum(cut, np.where(~finish & (last > 0), off_out, 0.0))
    stop = np.where(finish, 0.0, last)
    end = np.where(finish, -last, 0.0)
    # Ten metres before the corner, where it is driven to first, or as far as the turn begins.
    begin = np.where(visit, 10.0, 10.0 + first)
    pieces = np.column_stack([begin, np.where(visit, first, 0.0), lengths, end])
    cost = np.abs(pieces).sum(axis=1) + CHANGE * changes(pieces)
    cost = np.round(cost + 20 * np.minimum(cut, 0.5) ** 2 - 10.0 - stop, 9)
    ways: list[list[Turn]] = [[] for _ in turns]
    for row in np.argsort(cost, kind="stable").tolist():
        corner, _, curve = found[row]
        ways[corner].append(
            Turn(
                float(cost[row]),
                float(cut[row]),
                float(first[row]),
                bool(visit[row]),
                float(stop[row]),
                joined((*curve, ("S", float(end[row])))),
                radius,
            )
        )
    return list(map(tuple, ways))


def _distances(
    first: Points, sides: Points, lengths: Points, radius: float, spots: Points
) -> Points:
    """How far each curve, from ``first`` on the x axis on, stays away from its spots, N x K x 2."""
    x, y, heading = first.copy(), np.zeros(len(first)), np.zeros(len(first))
    near = np.hypot(spots[..., 0] - x[:, None], spots[..., 1] - y[:, None])
    for side, length in zip(sides.T, lengths.T, strict=True):
        ahead = np.stack([np.cos(heading), np.sin(heading)], axis=1)
        left = np.stack([-ahead[:, 1], ahead[:, 0]], axis=1)
        off = spots - np.stack([x, y], axis=1)[:, None]
        along = (off * ahead[:, None]).sum(axis=2)
        across = (off * left[:, None]).sum(axis=2)
        # Beside a straight piece, or between the two ends of an arc as seen from its middle.
        gear = np.sign(length)[:, None]
        inside = (gear * along > 0) & (gear * along < np.abs(length)[:, None])
        beside = np.where(inside, np.abs(across), np.inf)
        bow = side[:, None]
        angle = np.arctan2(gear * along, radius - bow * across) % math.tau
        swung = angle <= np.abs(length)[:, None] / radius
        rim = np.abs(np.hypot(along, radius - bow * across) - radius)
        near = np.minimum(near, np.where(bow == 0, beside, np.where(swung, rim, np.inf)))
        turned = heading + side * length / radius
        straight = side == 0
        x = x + np.where(
            straight, length * np.cos(heading), side * radius * (np.sin(turned) - np.sin(heading))
        )
        y = y + np.where(
            straight, length * np.sin(heading), side * radius * (np.cos(heading) - np.cos(turned))
        )
        heading = turned
        near = np.minimum(near, np.hypot(spots[..., 0] - x[:, None], spots[..., 1] - y[:, None]))
    return near
