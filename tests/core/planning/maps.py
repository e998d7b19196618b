"""Sites for planning tests: shapes that people draw, nasty ones, and random ones."""

from __future__ import annotations

import math

import numpy as np

from polepilot.core.site import Site, parse_site

Ring = list[list[float]]


def site(boundary: Ring, islands: list[Ring] | None = None, **more: object) -> Site:
    document = {"boundary": boundary, "islands": islands or [], **more}
    return parse_site(document, "test")


def box(x0: float, y0: float, x1: float, y1: float) -> Ring:
    return [[x0, y0], [x1, y0], [x1, y1], [x0, y1]]


def circle(x: float, y: float, radius: float, count: int) -> Ring:
    angles = np.arange(count) * math.tau / count
    return np.round(
        np.stack([x + radius * np.cos(angles), y + radius * np.sin(angles)], axis=1), 5
    ).tolist()


def comb(teeth: int, width: float, depth: float, wall: float) -> Site:
    """Narrow bays side by side, open to one aisle."""
    points: Ring = [[0, 0], [teeth * (width + wall), 0]]
    for tooth in reversed(range(teeth)):
        x = tooth * (width + wall)
        points += [[x + width + wall, 1.2], [x + width, 1.2], [x + width, depth], [x, depth]]
        points += [[x, 1.2]]
    return site(points)


def spiral(turns: int, width: float) -> Site:
    """One corridor rolled up."""
    outer: Ring = []
    inner: Ring = []
    for step in range(turns * 16 + 1):
        angle = step * math.tau / 16
        radius = 0.6 + (width + 0.15) * angle / math.tau
        outer.append([(radius + width) * math.cos(angle), (radius + width) * math.sin(angle)])
        inner.append([radius * math.cos(angle), radius * math.sin(angle)])
    return site(outer + inner[::-1])


def star(points: int, inner: float, outer: float) -> Site:
    ring = []
    for index in range(2 * points):
        radius = outer if index % 2 == 0 else inner
        angle = index * math.pi / points
        ring.append([radius * math.cos(angle), radius * math.sin(angle)])
    return site(ring)


def wavy(count: int, seed: int = 0) -> Site:
    """A closed outline with many vertices."""
    rng = np.random.default_rng(seed)
    angles = np.arange(count) * math.tau / count
    radius = 5.0 + sum(
        rng.uniform(0.1, 0.5) * np.sin(k * angles + rng.uniform(0, 6)) for k in (2, 3, 5, 9)
    )
    return site(np.stack([radius * np.cos(angles), radius * np.sin(angles)], axis=1).tolist())


def office() -> Site:
    """Three rooms with doors on a corridor, and furniture; one door is too narrow."""
    walls = [
        [[0, 3], [1.2, 3]],
        [[2.1, 3], [5.2, 3]],
        [[5.55, 3], [8, 3]],
        [[4, 0], [4, 3]],
        [[0, 4.4], [3.0, 4.4]],
        [[4.0, 4.4], [8, 4.4]],
    ]
    islands = [box(0.6, 1.0, 1.8, 1.6), box(6, 5.4, 7, 6.4), circle(2, 6, 0.3, 16)]
    return site(box(0, 0, 8, 8), islands, walls=walls, start=[1.0, 3.7])


def pillars(count: int, seed: int) -> Site:
    """A hall with round and square pillars."""
    rng = np.random.default_rng(seed)
    islands = []
    for index in range(count):
        x, y = rng.uniform(1, 9), rng.uniform(1, 7)
        radius = rng.uniform(0.05, 0.35)
        islands.append(circle(x, y, radius, 12 if index % 2 else 4))
    return site(box(0, 0, 10, 8), islands)


def random_site(rng: np.random.Generator) -> Site:
    """A star-shaped room with islands, walls and perhaps a start somewhere."""
    count = int(rng.integers(3, 14))
    angles = np.sort(rng.uniform(0, math.tau, count) + np.arange(count) * 1e-3)
    radii = rng.uniform(1.2, 5.0, count)
    ring = np.stack([radii * np.cos(angles), radii * np.sin(angles)], axis=1)
    if rng.random() < 0.5:
        ring = np.round(ring * 2) / 2  # drawn on a grid
    islands = [
        circle(*rng.uniform(-2, 2, 2), float(rng.uniform(0.05, 0.6)), int(rng.integers(3, 9)))
        for _ in range(int(rng.integers(0, 4)))
    ]
    walls = [rng.uniform(-3, 3, (2, 2)).tolist() for _ in range(int(rng.integers(0, 3)))]
    return site(ring.tolist(), islands, walls=walls)


NAMED = {
    "room": lambda: site(box(0, 0, 5, 4)),
    "slot": lambda: site(box(0, 0, 6, 0.45)),
    "tight": lambda: site(box(0, 0, 0.42, 0.42)),
    "ell": lambda: site([[0, 0], [4, 0], [4, 1], [1, 1], [1, 4], [0, 4]]),
    "comb": lambda: comb(4, 0.7, 3.0, 0.2),
    "spiral": lambda: spiral(3, 0.8),
    "star": lambda: star(7, 1.5, 4.0),
    "neck": lambda: site(
        [
            [0, 0],
            [3, 0],
            [3, 1.2],
            [4, 1.2],
            [4, 0],
            [7, 0],
            [7, 3],
            [4, 3],
            [4, 1.65],
            [3, 1.65],
            [3, 3],
            [0, 3],
        ]
    ),
    "wavy": lambda: wavy(1500),
    "office": office,
    "pillars": lambda: pillars(12, 3),
    "disc": lambda: site(circle(0, 0, 2.5, 48)),
    "triangle": lambda: site([[0, 0], [5, 0], [0.5, 1.6]]),
}
