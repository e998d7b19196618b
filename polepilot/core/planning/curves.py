"""Curves of a steered front wheel: straight lines and arcs, forward and backward.

``shortest_curves`` follows Reeds and Shepp, "Optimal paths for a car that goes both forwards and
backwards" (Pacific J. Math. 145, 1990): words of up to five pieces between two poses. Each word
is checked by driving it, so that only those that arrive are returned.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from functools import lru_cache
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from polepilot.core.geometry import Pose2D, wrap_angle

Piece = tuple[str, float]
"""("S" straight, "L" left or "R" right, signed length in metres: backward negative)."""
Curve = tuple[Piece, ...]

CHANGE = 0.5
"""What a change of gear costs, as metres of path."""
_MOST = 8
"""So many curves between two poses are worked out."""
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


def sample(
    pose: Pose2D, curve: Curve, radius: float
) -> tuple[NDArray[np.float64], NDArray[np.int8], Pose2D]:
    """N x 2 points with the start, N-1 gears, and the pose at the end."""
    points: list[NDArray[np.float64]] = [np.array([[pose.x, pose.y]])]
    gears: list[NDArray[np.int8]] = []
    for piece in curve:
        kind, length = piece
        if abs(length) < 1e-6:  # no point of its own, but what it turns tells a metre on
            pose = drive(pose, piece, radius)
            continue
        if kind == "S":
            count = 1
            new = np.array([pose.ahead(length)])
        else:
            side = 1.0 if kind == "L" else -1.0
            count = max(1, math.ceil(abs(length) / radius / STEP - 1e-6))
            angle = pose.heading + side * np.arange(1, count + 1) / count * length / radius
            new = np.stack(
                [
                    pose.x + side * radius * (np.sin(angle) - math.sin(pose.heading)),
                    pose.y - side * radius * (np.cos(angle) - math.cos(pose.heading)),
                ],
                axis=1,
            )
        points.append(new)
        gears.append(np.full(count, 1 if length > 0 else -1, np.int8))
        pose = drive(pose, piece, radius)
    return (
        np.vstack(points),
        np.concatenate(gears) if gears else np.zeros(0, np.int8),
        pose,
    )


def shortest_curves(start: Pose2D, goal: Pose2D, radius: float, change: float) -> list[Curve]:
    """Curves from ``start`` to ``goal``, the best first: length plus ``change`` metres per gear."""
    x, y = start.to_local(goal.position)
    turn = wrap_angle(goal.heading - start.heading)
    return [
        tuple((kind, length * radius) for kind, length in curve)
        for curve in _curves(
            round(x / radius, 9), round(y / radius, 9), round(turn, 9), round(change / radius, 6)
        )
    ]


@lru_cache(maxsize=20_000)
def _curves(x: float, y: float, turn: float, change: float) -> tuple[Curve, ...]:
    """The ``_MOST`` best for radius 1; only those that are looked at are driven."""
    found: dict[tuple[tuple[str, float], ...], float] = {}
    for curve in _words(x, y, turn):
        cost, forward = 0.0, None
        for _, length in curve:
            cost += abs(length)
            if forward is not None and forward != (length > 0) and abs(length) > 1e-6:
                cost += change
            if abs(length) > 1e-6:
                forward = length > 0
        if cost > 1e-7:
            found[tuple([piece for piece in curve if abs(piece[1]) > 1e-7])] = cost
    best: dict[tuple[tuple[str, float], ...], Curve] = {}
    for curve in sorted(found, key=lambda curve: (found[curve], curve)):
        name = tuple((kind, round(length, 6)) for kind, length in curve)
        if name not in best and _arrives(curve, x, y, turn):
            best[name] = curve
            if len(best) == _MOST:
                break
    return tuple(best.values())


def _arrives(curve: Curve, x: float, y: float, turn: float) -> bool:
    """Whether the curve, driven from the origin with radius 1, ends in the pose x, y, turn."""
    here_x, here_y, heading = 0.0, 0.0, 0.0
    for kind, length in curve:
        sin, cos = math.sin(heading), math.cos(heading)
        if kind == "S":
            here_x += length * cos
            here_y += length * sin
            continue
        side = 1.0 if kind == "L" else -1.0
        heading += side * length
        here_x += side * (math.sin(heading) - sin)
        here_y -= side * (math.cos(heading) - cos)
    return math.hypot(here_x - x, here_y - y) + abs(wrap_angle(heading - turn)) < 1e-6


def _words(x: float, y: float, turn: float) -> Iterator[Curve]:
    """Each family as it is, driven backward (x, turn negated), mirrored (y, turn), and both."""
    cos, sin = math.cos(turn), math.sin(turn)
    # The same curve driven from its end: the way back, read in reverse.
    for px, py, reverse in ((x, y, False), (x * cos + y * sin, x * sin - y * cos, True)):
        for back in (1.0, -1.0):
            for mirror in (1.0, -1.0):
                for curve in _families(back * px, mirror * py, back * mirror * turn):
                    side = {"L": "R", "R": "L", "S": "S"} if mirror < 0 else None
                    whole = tuple(
                        (side[kind] if side else kind, back * length) for kind, length in curve
                    )
                    yield whole[::-1] if reverse else whole


def _families(x: float, y: float, turn: float) -> Iterator[Curve]:
    """Sections 8.1 to 8.11 of the paper, radius 1, for a goal at x, y with heading ``turn``."""
    sin, cos = math.sin(turn), math.cos(turn)
    # The goal's left circle, and its right circle, seen from the start's left circle.
    lx, ly = x - sin, y - 1 + cos
    rx, ry = x + sin, y - 1 - cos
    l_rho, l_theta = math.hypot(lx, ly), math.atan2(ly, lx)
    r_rho, r_theta = math.hypot(rx, ry), math.atan2(ry, rx)
    # L+ S+ L+
    yield ("L", _m(l_theta)), ("S", l_rho), ("L", _m(turn - l_theta))
    # L+ S+ R+
    if r_rho >= 2:
        u = math.sqrt(r_rho * r_rho - 4)
        t = _m(r_theta + math.atan2(2, u))
        yield ("L", t), ("S", u), ("R", _m(t - turn))
    # L+ R- L, and L+ R+ L by way of the other solution
    if l_rho <= 4:
        u = -2 * math.asin(l_rho / 4)
        t = _m(l_theta + u / 2 + math.pi)
        yield ("L", t), ("R", u), ("L", _m(turn - t + u))
    # L+ R+ L- R-
    rho = (2 + r_rho) / 4
    if rho <= 1:
        u = math.acos(rho)
        t, v = _tau_omega(u, -u, rx, ry, turn)
        yield ("L", t), ("R", u), ("L", -u), ("R", v)
    # L+ R- L- R+
    rho = (20 - r_rho * r_rho) / 16
    if 0 <= rho <= 1:
        u = -math.acos(rho)
        t, v = _tau_omega(u, u, rx, ry, turn)
        yield ("L", t), ("R", u), ("L", u), ("R", v)
    # L+ R- S- L-
    if l_rho >= 2:
        r = math.sqrt(l_rho * l_rho - 4)
        t = _m(l_theta + math.atan2(r, -2))
        yield ("L", t), ("R", -math.pi / 2), ("S", 2 - r), ("L", _m(turn - math.pi / 2 - t))
    if r_rho >= 2:
        # L+ R- S- R-
        t = math.atan2(rx, -ry)
        yield ("L", t), ("R", -math.pi / 2), ("S", 2 - r_rho), ("R", _m(t + math.pi / 2 - turn))
        # L+ R- S- L- R+
        u = 4 - math.sqrt(r_rho * r_rho - 4)
        if u <= 0:
            t = _m(math.atan2((4 - u) * rx - 2 * ry, -2 * rx + (u - 4) * ry))
            half = -math.pi / 2
            yield ("L", t), ("R", half), ("S", u), ("L", half), ("R", _m(t - turn))


def _tau_omega(u: float, v: float, x: float, y: float, turn: float) -> tuple[float, float]:
    delta = _m(u - v)
    a, b = math.sin(u) - math.sin(delta), math.cos(u) - math.cos(delta) - 1
    t1 = math.atan2(y * a - x * b, x * a + y * b)
    t2 = 2 * (math.cos(delta) - math.cos(v) - math.cos(u)) + 3
    tau = _m(t1 + math.pi) if t2 < 0 else _m(t1)
    return tau, _m(tau - u + v - turn)


def _m(angle: float) -> float:
    return wrap_angle(angle)
