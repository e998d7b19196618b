"""Outlines for plans to be judged on: what people draw, and what they should not have drawn.

Every function gives a SITE.json document, metres. Nothing of polepilot is used here.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import Any

import numpy as np
import shapely
from shapely import Polygon

Document = dict[str, Any]
Ring = list[list[float]]


def document(boundary: Ring, islands: Iterable[Ring] = (), **more: Any) -> Document:
    """A site of a boundary, islands, and what else SITE.json has."""
    return {"boundary": boundary, "islands": list(islands), **more}


def from_polygon(floor: Polygon, **more: Any) -> Document:
    """A site of a floor with holes."""
    return document(_ring(floor.exterior), [_ring(hole) for hole in floor.interiors], **more)


def box(x0: float, y0: float, x1: float, y1: float) -> Ring:
    return [[x0, y0], [x1, y0], [x1, y1], [x0, y1]]


def circle(x: float, y: float, radius: float, count: int, turn: float = 0.0) -> Ring:
    angles = turn + np.arange(count) * math.tau / count
    return _rounded(np.stack([x + radius * np.cos(angles), y + radius * np.sin(angles)], axis=1))


def turned(site: Document, angle: float) -> Document:
    """The same site in another direction, as nobody draws parallel to the axes."""
    cos, sin = math.cos(angle), math.sin(angle)

    def line(points: Ring) -> Ring:
        return _rounded(np.array(points) @ np.array([[cos, sin], [-sin, cos]]))

    result = dict(site)
    result["boundary"] = line(site["boundary"])
    for key in ("islands", "walls"):
        if key in site:
            result[key] = [line(points) for points in site[key]]
    if "start" in site:
        result["start"] = line([site["start"][:2]])[0]
    return result


def ell(width: float, long: float, short: float) -> Document:
    return document([[0, 0], [long, 0], [long, width], [width, width], [width, short], [0, short]])


def horseshoe(width: float, long: float, gap: float) -> Document:
    """A U of three corridors."""
    over = 2 * width + gap
    return document(
        [
            [0, 0],
            [over, 0],
            [over, long],
            [over - width, long],
            [over - width, width],
            [width, width],
            [width, long],
            [0, long],
        ]
    )


def cross(arm: float, width: float) -> Document:
    """Two halls that cross, as in a vault."""
    a, b = arm, arm + width
    c = 2 * arm + width
    return document(
        [
            [a, 0],
            [b, 0],
            [b, a],
            [c, a],
            [c, b],
            [b, b],
            [b, c],
            [a, c],
            [a, b],
            [0, b],
            [0, a],
            [a, a],
        ]
    )


def comb(widths: list[float], depth: float, wall: float, aisle: float) -> Document:
    """Bays of many widths, open to one aisle."""
    total = sum(widths) + wall * (len(widths) - 1)
    points: Ring = [[0.0, 0.0], [total, 0.0]]
    right = total
    for index, width in enumerate(reversed(widths)):
        points += [[right, depth + aisle], [right - width, depth + aisle]]
        right -= width
        if index + 1 < len(widths):
            points += [[right, aisle], [right - wall, aisle]]
            right -= wall
    return document(_rounded(np.array(points)))


def snake(widths: list[float], long: float, wall: float) -> Document:
    """Corridors of many widths, one behind the other, joined at alternate ends by walls' gaps."""
    total = sum(widths) + wall * (len(widths) - 1)
    islands, walls = [], []
    y = 0.0
    for index, width in enumerate(widths[:-1]):
        y += width
        gap = max(width, widths[index + 1])
        left, right = (0.0, long - gap) if index % 2 == 0 else (gap, long)
        if wall > 0:
            islands.append(box(left, y, right, y + wall))
        else:
            walls.append([[left, y], [right, y]])
        y += wall
    if not islands:
        return document(box(0, 0, long, total), walls=walls)
    floor = Polygon(box(0, 0, long, total)).difference(
        shapely.union_all([Polygon(ring) for ring in islands])
    )
    return from_polygon(floor)


def spiral(turns: int, width: float, wall: float, steps: int) -> Document:
    """One corridor rolled up."""
    angles = np.arange(turns * steps + 1) * math.tau / steps
    radius = 0.6 + (width + wall) * angles / math.tau
    around = np.stack([np.cos(angles), np.sin(angles)], axis=1)
    outer, inner = (radius + width)[:, None] * around, radius[:, None] * around
    return document(_rounded(np.vstack([outer, inner[::-1]])))


def star(points: int, inner: float, outer: float) -> Document:
    angles = np.arange(2 * points) * math.pi / points
    radius = np.where(np.arange(2 * points) % 2 == 0, outer, inner)
    return document(_rounded(np.stack([radius * np.cos(angles), radius * np.sin(angles)], axis=1)))


def necks(widths: list[float], room: float) -> Document:
    """Rooms in a row behind necks of given widths; some are too narrow."""
    rooms = [shapely.box(i * (room + 0.5), 0, i * (room + 0.5) + room, room) for i in range(9)]
    floor = [rooms[0]]
    for index, width in enumerate(widths):
        left = index * (room + 0.5) + room
        middle = room * (0.3 + 0.4 * (index % 2))
        floor += [
            shapely.box(left - 0.01, middle - width / 2, left + 0.51, middle + width / 2),
            rooms[index + 1],
        ]
    return from_polygon(shapely.union_all(floor), start=[0.5, 0.5])


def wavy(count: int, radius: float, swing: float, seed: int) -> Document:
    """A pond: a closed outline of many points."""
    rng = np.random.default_rng(seed)
    angles = np.arange(count) * math.tau / count
    waves = sum(
        rng.uniform(0.2, 1.0) / math.sqrt(k) * np.sin(k * angles + rng.uniform(0, 6))
        for k in (2, 3, 5, 9, 17)
    )
    r = radius * (1 + swing * waves)
    return document(_rounded(np.stack([r * np.cos(angles), r * np.sin(angles)], axis=1)))


def traced(seed: int, size: tuple[float, float], count: int) -> Document:
    """A room as a scanner sees it: straight walls with a tremble of 2 cm, a point every few cm."""
    rng = np.random.default_rng(seed)
    long, wide = size
    ring = Polygon(
        [
            (0, 0),
            (long, 0),
            (long, 0.6 * wide),
            (0.7 * long, 0.6 * wide),
            (0.7 * long, wide),
            (0, wide),
        ]
    ).exterior
    points = shapely.get_coordinates(
        shapely.line_interpolate_point(ring, np.arange(count) / count * ring.length)
    )
    return document(_rounded(points + rng.normal(0, 0.005, points.shape)))


def pillars(
    size: tuple[float, float], count: int, radii: tuple[float, float], seed: int
) -> Document:
    """A hall with round and square pillars that keep apart from each other and the walls."""
    rng = np.random.default_rng(seed)
    islands: list[Ring] = []
    placed: list[tuple[float, float, float]] = []
    for _ in range(10_000):
        if len(placed) == count:
            break
        radius = float(rng.uniform(*radii))
        x = float(rng.uniform(radius + 0.1, size[0] - radius - 0.1))
        y = float(rng.uniform(radius + 0.1, size[1] - radius - 0.1))
        if any(math.hypot(x - a, y - b) < radius + r + 0.05 for a, b, r in placed):
            continue
        placed.append((x, y, radius))
        corners = 16 if len(placed) % 2 else 4
        islands.append(circle(x, y, radius, corners, float(rng.uniform(0, 2))))
    return document(box(0, 0, *size), islands)


def grid_pillars(columns: int, rows: int, pitch: float, side: float) -> Document:
    """A car park: square columns on a grid."""
    islands = [
        box(x * pitch - side / 2, y * pitch - side / 2, x * pitch + side / 2, y * pitch + side / 2)
        for x in range(1, columns)
        for y in range(1, rows)
    ]
    return document(_rounded_box(columns * pitch, rows * pitch), islands)


def ring(outer: float, inner: float, count: int) -> Document:
    """A round way around a pond."""
    return document(circle(0, 0, outer, count), [circle(0, 0, inner, count, 0.1)])


def field(long: float, wide: float, slant: float, islands: int, seed: int) -> Document:
    """A field with trees, of which one border runs askew."""
    rng = np.random.default_rng(seed)
    trees = [
        circle(
            float(rng.uniform(5, long - 8)),
            float(rng.uniform(5, wide - 5)),
            float(rng.uniform(0.4, 2.5)),
            12,
        )
        for _ in range(islands)
    ]
    floor = Polygon([(0, 0), (long, slant), (long - slant, wide), (0.0, wide - slant)])
    return from_polygon(floor.difference(shapely.union_all([Polygon(t) for t in trees])))


def zigzag(count: int, width: float, leg: float) -> Document:
    """A corridor that bends at sharp angles."""
    middle = [(i * leg * 0.6, (i % 2) * leg * 0.8) for i in range(count)]
    line = shapely.LineString(middle)
    return from_polygon(line.buffer(width / 2, cap_style="flat", join_style="mitre"))


def gear(teeth: int, inner: float, outer: float) -> Document:
    """Square teeth around a disc: many right angles, none parallel to the axes."""
    points = []
    for tooth in range(teeth):
        for share, radius in ((0.0, inner), (0.25, inner), (0.25, outer), (0.75, outer)):
            angle = (tooth + share) * math.tau / teeth
            points.append([radius * math.cos(angle), radius * math.sin(angle)])
        angle = (tooth + 0.75) * math.tau / teeth
        points.append([inner * math.cos(angle), inner * math.sin(angle)])
    return document(_rounded(np.array(points)))


def maze(columns: int, rows: int, pitch: float, seed: int) -> Document:
    """Free-standing walls on a grid so that one way leads everywhere."""
    rng = np.random.default_rng(seed)
    seen = {(0, 0)}
    open_between: set[tuple[tuple[int, int], tuple[int, int]]] = set()
    stack = [(0, 0)]
    while stack:
        x, y = stack[-1]
        near = [(x + 1, y), (x - 1, y), (x, y + 1), (x, y - 1)]
        fresh = [
            cell
            for cell in near
            if 0 <= cell[0] < columns and 0 <= cell[1] < rows and cell not in seen
        ]
        if not fresh:
            stack.pop()
            continue
        there = fresh[int(rng.integers(len(fresh)))]
        seen.add(there)
        open_between.add(((x, y), there))
        open_between.add((there, (x, y)))
        stack.append(there)
    walls = []
    for x in range(columns):
        for y in range(rows):
            if x + 1 < columns and ((x, y), (x + 1, y)) not in open_between:
                walls.append([[(x + 1) * pitch, y * pitch], [(x + 1) * pitch, (y + 1) * pitch]])
            if y + 1 < rows and ((x, y), (x, y + 1)) not in open_between:
                walls.append([[x * pitch, (y + 1) * pitch], [(x + 1) * pitch, (y + 1) * pitch]])
    return document(_rounded_box(columns * pitch, rows * pitch), walls=walls)


def fences(size: tuple[float, float], count: int, seed: int) -> Document:
    """A yard with straight fences that stand free or start at a wall."""
    rng = np.random.default_rng(seed)
    walls = []
    for index in range(count):
        x, y = float(rng.uniform(0.8, size[0] - 0.8)), float(rng.uniform(0.8, size[1] - 0.8))
        long, angle = float(rng.uniform(0.5, 2.5)), float(rng.uniform(0, math.tau))
        end = [
            min(max(x + long * math.cos(angle), 0.0), size[0]),
            min(max(y + long * math.sin(angle), 0.0), size[1]),
        ]
        walls.append(_rounded(np.array([[x, y], end])))
        if index % 3 == 0:
            walls.append([[round(x, 3), 0.0], [round(x, 3), round(0.3 * y, 3)]])
    return document(box(0, 0, *size), walls=walls)


def figure_13() -> Document:
    """A site after Fig. 13 of the paper: a gate that is wide enough joins A and B; those to C, and
    from there to D, are too narrow."""
    walls = [
        [[2.6, 0.0], [2.6, 0.6]],
        [[2.6, 1.2], [2.6, 1.9]],
        [[2.6, 1.9], [2.6, 2.7]],
        [[2.6, 3.0], [2.6, 3.8]],
        [[0.0, 1.9], [3.6, 1.9]],
        [[3.95, 1.9], [5.4, 1.9]],
    ]
    start = [0.25, 0.9]
    return document(box(0, 0, 5.4, 3.8), walls=walls, start=start)


def _rounded_box(width: float, height: float) -> Ring:
    return box(0.0, 0.0, round(width, 5), round(height, 5))


def _ring(line: shapely.LinearRing) -> Ring:
    return _rounded(shapely.get_coordinates(line)[:-1])


def _rounded(points: np.ndarray) -> Ring:
    return [[round(float(x), 5), round(float(y), 5)] for x, y in points]
