"""Curves of a steered front wheel: straight lines and arcs, forward and backward.

``shortest_curves`` follows Reeds and Shepp, "Optimal paths for a car that goes both forwards and
backwards" (Pacific J. Math. 145, 1990): words of up to five pieces between two poses. Each word
is checked by driving it, so that only those that arrive are returned.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from polepilot.core.geometry import Pose2D, wrap_angle

Array = NDArray[np.float64]
Indices = NDArray[np.intp]
Piece = tuple[str, float]
"""("S" straight, "L" left or "R" right, signed length in metres: backward negative)."""
Curve = tuple[Piece, ...]

Sampled = tuple[Array, NDArray[np.int8], Pose2D]
"""N x 2 points with the start, N-1 gears, and the pose at the end."""

CHANGE = 0.5
"""What a change of gear costs, as metres of path."""
_MOST = 8
"""So many curves between two poses are worked out."""
_SPOTS = 5
"""Points on a piece of a curve that are looked at first."""
STEP = math.radians(5.0)
"""Arcs are drawn with a vertex at least every so many radians."""


def curve_length(curve: Curve) -> float:
    return sum(abs(length) for _, length in curve)


def gear_changes(curve: Curve) -> int:
    """How often a curve changes between forward and backward."""
    signs = [length > 0 for _, length in curve if abs(length) > 1e-6]
    return sum(a != b for a, b in pairwise(signs))


def curve_cost(curve: Curve) -> float:
    """Of a curve that is entered and left in forward gear."""
    return curve_length(curve) + CHANGE * gear_changes((("S", 1e-3), *curve, ("S", 1e-3)))


def joined(curve: Curve) -> Curve:
    """Neighbouring straight pieces in one gear as one; those that cancel are dropped.

    Straight forward and back again is kept: it sweeps what lies there.
    """
    pieces: list[tuple[str, float]] = []
    for kind, length in curve:
        if abs(length) < 1e-9:
            continue
        if pieces and pieces[-1][0] == kind and (pieces[-1][1] > 0) == (length > 0):
            pieces[-1] = (kind, pieces[-1][1] + length)
        else:
            pieces.append((kind, length))
    return tuple(pieces)


def drive(pose: Pose2D, piece: Piece, radius: float) -> Pose2D:
    """The pose after one piece."""
    kind, length = piece
    if kind == "S":
        return Pose2D(*pose.ahead(length), pose.heading)
    side = 1.0 if kind == "L" else -1.0
    turn = side * length / radius
    x = side * radius * (math.sin(pose.heading + turn) - math.sin(pose.heading))
    y = -side * radius * (math.cos(pose.heading + turn) - math.cos(pose.heading))
    return Pose2D(pose.x + x, pose.y + y, wrap_angle(pose.heading + turn))


def sample(pose: Pose2D, curve: Curve, radius: float) -> Sampled:
    """The points of a curve that begins at ``pose``, their gears, and the pose at its end."""
    x, y, heading = pose
    points, gears = [(x, y)], []
    for kind, length in curve:
        side = _SIDES[kind]
        bend = side * length / radius
        # What is too short gets no point of its own, but what it turns tells a metre on.
        count = max(1, math.ceil(abs(bend) / STEP - 1e-6)) if abs(length) >= 1e-6 else 0
        if side:
            cos, sin = math.cos(heading), math.sin(heading)
            for turned in [bend * (k / count) + heading for k in range(1, count)]:
                east, north = math.sin(turned) - sin, math.cos(turned) - cos
                points.append((x + side * radius * east, y - side * radius * north))
        pose = drive(Pose2D(x, y, heading), (kind, length), radius)
        x, y, heading = pose
        if count:
            points.append((x, y))
            gears += [1 if length > 0 else -1] * count
    return np.array(points), np.array(gears, np.int8), pose


def columns(curves: Sequence[Curve]) -> tuple[Array, Array]:
    """Sides of the pieces of curves (1: left, -1: right), and their lengths, metres; N x M each."""
    most = max(map(len, curves), default=0)
    filled = [(*curve, *[("S", 0.0)] * (most - len(curve))) for curve in curves]
    return (
        np.array([[_SIDES[kind] for kind, _ in curve] for curve in filled]).reshape(
            len(curves), most
        ),
        np.array([[length for _, length in curve] for curve in filled]).reshape(len(curves), most),
    )


def changes(lengths: Array) -> Array:
    """How often each row of signed lengths changes its gear, entered and left forward."""
    count, gear = np.zeros(len(lengths)), np.ones(len(lengths))
    for column in (*lengths.T, np.ones(len(lengths))):
        new = np.where(np.abs(column) > 1e-6, np.sign(column), gear)
        count += new != gear
        gear = new
    return count


def spots(poses: Array, sides: Array, lengths: Array, radius: float) -> Array:
    """Points on curves (see ``columns``), N x P x 2, evenly on each piece: where one of them is not
    free a curve is not. ``poses``: where they begin, N x 3 or for all of them 1 x 3."""
    count, most = lengths.shape
    x, y, heading = np.broadcast_to(poses, (count, 3)).T
    found = np.empty((count, most * _SPOTS, 2))
    shares = np.arange(1, _SPOTS + 1) / _SPOTS
    for piece in range(most):
        length = lengths[:, piece, None] * shares
        bend = sides[:, piece, None] * length / (2 * radius)
        chord = length * np.sinc(bend / math.pi)
        there = found[:, piece * _SPOTS : (piece + 1) * _SPOTS]
        there[:, :, 0] = x[:, None] + chord * np.cos(heading[:, None] + bend)
        there[:, :, 1] = y[:, None] + chord * np.sin(heading[:, None] + bend)
        x, y, heading = there[:, -1, 0], there[:, -1, 1], heading + 2 * bend[:, -1]
    return found


def shortest_curves(start: Pose2D, goal: Pose2D, radius: float, change: float) -> list[Curve]:
    """Curves from ``start`` to ``goal``, the best first: length plus ``change`` metres per gear."""
    return shortest_curves_each([(start, goal)], radius, change)[0]


def shortest_curves_each(
    ways: Sequence[tuple[Pose2D, Pose2D]], radius: float, change: float, most: int = _MOST
) -> list[list[Curve]]:
    """The same for many starts and goals at once, ``most`` for each."""
    poses = np.array([(tuple(start), tuple(goal)) for start, goal in ways]).reshape(-1, 2, 3)
    found = best_curves(poses[:, 0], poses[:, 1], radius, change, most)
    every: list[list[Curve]] = [[] for _ in ways]
    rows = zip(found.of.tolist(), found.words.tolist(), found.lengths.tolist(), strict=True)
    for way, word, lengths in rows:
        pieces = zip(_WORDS[word], lengths, strict=False)
        every[way].append(tuple([piece for piece in pieces if piece[1]]))
    return every


@dataclass(frozen=True, slots=True, eq=False)
class Curves:
    """Many curves between poses: those of one pair of poses after another, the best first."""

    of: Indices
    """Between which pair of poses each leads."""
    words: Indices
    lengths: Array
    """N x 5, metres; of pieces that a curve does not have 0."""

    @property
    def sides(self) -> Array:
        """The sides of its pieces, N x 5; 1: left, 0: straight on, -1: right."""
        return np.asarray(_KINDS[self.words])


def best_curves(
    starts: Array, goals: Array, radius: float, change: float, most: int = _MOST
) -> Curves:
    """The ``most`` best curves from each of N starts x, y, heading to its goal, length plus
    ``change`` metres per gear."""
    off, cos, sin = goals - starts, np.cos(starts[:, 2]), np.sin(starts[:, 2])
    ahead = cos * off[:, 0] + sin * off[:, 1]
    aside = cos * off[:, 1] - sin * off[:, 0]
    local = np.stack([ahead / radius, aside / radius, _wrapped(off[:, 2])], axis=1)
    return _curves(np.round(local, 9), round(change / radius, 6), most, radius)


def _curves(goals: Array, change: float, most: int, radius: float) -> Curves:
    """The ``most`` best for radius 1 to each of N goals x, y, heading; then of another radius."""
    with np.errstate(invalid="ignore"):  # what is no number is no curve
        kinds, every = _words(*goals.T)
    words, of = np.nonzero(np.isfinite(every.sum(axis=2)))
    lengths = every[words, of]
    arrived = _arrive(kinds[words], lengths, goals[of])
    words, of, lengths = words[arrived], of[arrived], lengths[arrived]
    lengths = np.where(np.abs(lengths) <= 1e-7, 0.0, lengths)
    cost = np.abs(lengths).sum(axis=1)
    forward = np.zeros(len(cost))
    for length in lengths.T:
        way = np.where(np.abs(length) > 1e-6, np.sign(length), forward)
        cost += change * ((forward != 0) & (way != forward))
        forward = way
    some = cost > 1e-7
    words, of, lengths, cost = words[some], of[some], lengths[some], np.round(cost[some], 9)
    # Words with pieces of no length may be the same curve: it bends the same way everywhere.
    marks = np.cumsum(np.abs(lengths), axis=1) ** 2
    spans = np.diff(marks, axis=1, prepend=0.0)
    bend = np.round((spans * (kinds[words] + 0.37 * np.sign(lengths))).sum(axis=1), 5)
    order = np.lexsort((words, bend, cost, of))
    keys = np.stack([of, cost, bend])[:, order]
    new = order[np.r_[True, (keys[:, 1:] != keys[:, :-1]).any(axis=0)][: len(order)]]
    new = new[np.lexsort((words[new], cost[new], of[new]))]
    rank = np.arange(len(new)) - np.searchsorted(of[new], of[new])
    new = new[rank < most]
    return Curves(of[new], words[new], lengths[new] * radius)


def _arrive(sides: Array, lengths: Array, goals: Array) -> NDArray[np.bool_]:
    """Which of N curves, driven from the origin with radius 1, end in their goals."""
    x, y, heading, sin = np.zeros((4, len(lengths)))
    cos = np.ones(len(lengths))
    for side, length in zip(sides.T, lengths.T, strict=True):
        turned = heading + side * length
        new_cos, new_sin = np.cos(turned), np.sin(turned)
        straight = side == 0
        x += np.where(straight, length * cos, side * (new_sin - sin))
        y += np.where(straight, length * sin, side * (cos - new_cos))
        heading, cos, sin = turned, new_cos, new_sin
    off = np.abs(_wrapped(heading - goals[:, 2]))
    return np.asarray(np.hypot(x - goals[:, 0], y - goals[:, 1]) + off < 1e-6)


_FAMILIES = ("LSL", "LSR", "LRL", "LRLR", "LRLR", "LRSL", "LRSR", "LRSLR")
_LONGEST = 5
_SIDES = {"L": 1.0, "R": -1.0, "S": 0.0}
KIND = {side: kind for kind, side in _SIDES.items()}
"""Which kind of piece bends to which side."""
_MIRRORED = str.maketrans("LR", "RL")
_FORMS = tuple(itertools.product((False, True), (1.0, -1.0), (1.0, -1.0)))
"""Each family is driven as it is or from its end, forward or backward, and mirrored."""
_ALL_WORDS = tuple(
    (family[::-1] if reverse else family).translate(_MIRRORED if mirror < 0 else {})
    for family in _FAMILIES
    for reverse, _, mirror in _FORMS
)
_NEW = np.array(
    [family in ("LRSL", "LRSR") or not form[0] for family in _FAMILIES for form in _FORMS]
)
"""The others are the same from their end as they are mirrored, or as they are."""
_WORDS = tuple(word for word, new in zip(_ALL_WORDS, _NEW, strict=True) if new)
_KINDS = np.array([[_SIDES[kind] for kind in word.ljust(_LONGEST, "S")] for word in _WORDS])


def _words(x: Array, y: Array, turn: Array) -> tuple[Array, Array]:
    """Sides of the pieces of each word, W x 5, and their lengths, W x N x 5; NaN: not possible."""
    cos, sin = np.cos(turn), np.sin(turn)
    # The same curve driven from its end: the way back, read in reverse.
    ends = {False: (x, y), True: (x * cos + y * sin, x * sin - y * cos)}
    forms = [
        (back * ends[reverse][0], mirror * ends[reverse][1], back * mirror * turn)
        for reverse, back, mirror in _FORMS
    ]
    families = _families(*np.array(forms).transpose(1, 0, 2))
    backs = np.array([back for _, back, _ in _FORMS])[:, None]
    lengths = np.zeros((len(_FAMILIES), len(_FORMS), len(x), _LONGEST))
    half = len(_FORMS) // 2
    for index, family in enumerate(families):
        for place, length in enumerate(family):
            lengths[index, :half, :, place] = (backs * length)[:half]
            lengths[index, half:, :, len(family) - 1 - place] = (backs * length)[half:]
    return _KINDS, lengths.reshape(len(_NEW), len(x), _LONGEST)[_NEW]


def _families(x: Array, y: Array, turn: Array) -> Iterator[tuple[Array, ...]]:
    """Sections 8.1 to 8.11 of the paper, radius 1, for goals at x, y with heading ``turn``: the
    lengths of the pieces of each of ``_FAMILIES``."""
    sin, cos = np.sin(turn), np.cos(turn)
    # The goal's left circle, and its right circle, seen from the start's left circle.
    lx, ly = x - sin, y - 1 + cos
    rx, ry = x + sin, y - 1 - cos
    l_rho, l_theta = np.hypot(lx, ly), np.arctan2(ly, lx)
    r_rho, r_theta = np.hypot(rx, ry), np.arctan2(ry, rx)
    half = np.full_like(x, -math.pi / 2)
    # L+ S+ L+
    yield _wrapped(l_theta), l_rho, _wrapped(turn - l_theta)
    # L+ S+ R+
    u = np.sqrt(r_rho * r_rho - 4)
    t = _wrapped(r_theta + np.arctan2(2, u))
    yield t, u, _wrapped(t - turn)
    # L+ R- L, and L+ R+ L by way of the other solution
    u = -2 * np.arcsin(l_rho / 4)
    t = _wrapped(l_theta + u / 2 + math.pi)
    yield t, u, _wrapped(turn - t + u)
    # L+ R+ L- R-
    u = np.arccos((2 + r_rho) / 4)
    t, v = _tau_omega(u, -u, rx, ry, turn)
    yield t, u, -u, v
    # L+ R- L- R+
    rho = (20 - r_rho * r_rho) / 16
    u = -np.arccos(np.where(rho >= 0, rho, np.nan))
    t, v = _tau_omega(u, u, rx, ry, turn)
    yield t, u, u, v
    # L+ R- S- L-
    r = np.sqrt(l_rho * l_rho - 4)
    t = _wrapped(l_theta + np.arctan2(r, -2))
    yield t, half, 2 - r, _wrapped(turn - math.pi / 2 - t)
    # L+ R- S- R-
    t = np.where(r_rho >= 2, np.arctan2(rx, -ry), np.nan)
    yield t, half, 2 - r_rho, _wrapped(t + math.pi / 2 - turn)
    # L+ R- S- L- R+
    u = 4 - np.sqrt(r_rho * r_rho - 4)
    u = np.where(u <= 0, u, np.nan)
    t = _wrapped(np.arctan2((4 - u) * rx - 2 * ry, -2 * rx + (u - 4) * ry))
    yield t, half, u, half, _wrapped(t - turn)


def _tau_omega(u: Array, v: Array, x: Array, y: Array, turn: Array) -> tuple[Array, Array]:
    delta = _wrapped(u - v)
    a, b = np.sin(u) - np.sin(delta), np.cos(u) - np.cos(delta) - 1
    t1 = np.arctan2(y * a - x * b, x * a + y * b)
    t2 = 2 * (np.cos(delta) - np.cos(v) - np.cos(u)) + 3
    tau = np.where(t2 < 0, _wrapped(t1 + math.pi), _wrapped(t1))
    return tau, _wrapped(tau - u + v - turn)


def _wrapped(angle: Array) -> Array:
    """Angles between -pi and pi."""
    return np.asarray((angle + math.pi) % math.tau - math.pi)
