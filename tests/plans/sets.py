"""The maps on which plans are judged: a final set that nobody develops on, and another one.

Both have the same families; sizes, directions and seeds are different.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping

import numpy as np
from plans import buildings as b
from plans import shapes as s
from plans.shapes import Document

Maker = Callable[[], Document]

FINAL: Mapping[str, Maker] = {
    "room 5x4": lambda: s.document(s.box(0, 0, 5, 4)),
    "room 7.3x3.1 askew": lambda: s.turned(s.document(s.box(0, 0, 7.3, 3.1)), 0.4),
    "hall 20x12": lambda: s.document(s.box(0, 0, 20, 12)),
    "triangle": lambda: s.document([[0, 0], [6, 0.4], [1.2, 4.8]]),
    "disc": lambda: s.document(s.circle(0, 0, 3.1, 64)),
    "L": lambda: s.ell(1.7, 7.0, 5.0),
    "L narrow": lambda: s.ell(0.9, 5.0, 4.0),
    "U": lambda: s.horseshoe(1.35, 6.0, 1.2),
    "cross vault": lambda: s.cross(3.0, 2.1),
    "cross vault narrow": lambda: s.turned(s.cross(2.5, 1.1), 0.7),
    "corridor 0.5": lambda: s.document(s.box(0, 0, 8, 0.5)),
    "corridor 0.78": lambda: s.document(s.box(0, 0, 9, 0.78)),
    "corridor 1.3": lambda: s.turned(s.document(s.box(0, 0, 15, 1.3)), 1.1),
    "corridors, many widths": lambda: s.snake([0.6, 0.85, 1.0, 1.3, 1.7, 2.2], 9, 0.12),
    "corridors, fences": lambda: s.snake([0.9, 1.1, 1.4, 0.7, 2.0], 7, 0.0),
    "comb": lambda: s.comb([0.7] * 6, 3.0, 0.2, 1.2),
    "comb, many widths": lambda: s.comb([0.5, 0.62, 0.8, 0.95, 1.15, 1.5, 2.1], 3.5, 0.15, 1.4),
    "spiral": lambda: s.spiral(3, 0.9, 0.15, 20),
    "spiral wide": lambda: s.spiral(2, 1.7, 0.1, 9),
    "star 7": lambda: s.star(7, 1.8, 4.5),
    "star 12": lambda: s.star(12, 2.6, 4.2),
    "necks": lambda: s.necks([0.9, 0.5, 1.3, 0.38], 2.4),
    "zigzag": lambda: s.zigzag(6, 1.25, 3.2),
    "gear": lambda: s.gear(11, 2.4, 3.6),
    "pond, 1500 points": lambda: s.wavy(1500, 6.0, 0.22, 3105),
    "traced room, 1500 points": lambda: s.traced(3103, (9.0, 6.5), 1500),
    "ring": lambda: s.ring(3.6, 1.4, 40),
    "30 islands": lambda: s.pillars((12, 9), 30, (0.08, 0.35), 3121),
    "columns": lambda: s.grid_pillars(5, 4, 2.3, 0.4),
    "maze": lambda: s.maze(6, 5, 1.25, 3111),
    "fences": lambda: s.fences((9, 6), 8, 3113),
    "field 100x60": lambda: s.field(100, 60, 0, 0, 0),
    "field askew with trees": lambda: s.field(45, 30, 4.0, 12, 3105),
    "house 4": lambda: b.house(3101, 4),
    "house 6": lambda: b.house(3102, 6),
    "house 8": lambda: b.house(3103, 8),
    "house 12": lambda: b.house(3104, 12),
    "office 6": lambda: b.office(3201, 6, 10),
    "office 9": lambda: b.office(3202, 9, 16),
    "office 14": lambda: b.office(3203, 14, 24),
    "flat 4": lambda: b.flat(3301, 4, 6),
    "flat 6": lambda: b.flat(3302, 6, 10),
    "flat 8": lambda: b.flat(3303, 8, 14),
    "rectangles 5": lambda: b.overlapping(3401, 5),
    "rectangles 8": lambda: b.overlapping(3402, 8),
    "rectangles 12 askew": lambda: s.turned(b.overlapping(3403, 12), 0.3),
}

DEVELOPMENT: Mapping[str, Maker] = {
    "room 4x3": lambda: s.document(s.box(0, 0, 4, 3)),
    "room 6.1x4.7 askew": lambda: s.turned(s.document(s.box(0, 0, 6.1, 4.7)), 0.9),
    "triangle": lambda: s.document([[0, 0], [5, 0], [0.5, 2.6]]),
    "disc": lambda: s.document(s.circle(0, 0, 2.5, 48)),
    "L": lambda: s.ell(1.4, 6.0, 4.4),
    "U": lambda: s.horseshoe(1.05, 5.0, 0.9),
    "cross vault": lambda: s.cross(2.4, 1.7),
    "corridor 0.6": lambda: s.document(s.box(0, 0, 7, 0.6)),
    "corridor 1.0": lambda: s.turned(s.document(s.box(0, 0, 9, 1.0)), 0.5),
    "corridors, many widths": lambda: s.snake([0.7, 0.9, 1.15, 1.5, 1.9], 7, 0.1),
    "corridors, fences": lambda: s.snake([1.0, 1.25, 0.8, 1.8], 8, 0.0),
    "comb": lambda: s.comb([0.85] * 5, 2.6, 0.25, 1.1),
    "comb, many widths": lambda: s.comb([0.55, 0.7, 0.9, 1.05, 1.3, 1.8], 3.0, 0.12, 1.5),
    "spiral": lambda: s.spiral(3, 1.1, 0.12, 16),
    "star 5": lambda: s.star(5, 1.6, 4.0),
    "star 9": lambda: s.star(9, 2.2, 4.4),
    "necks": lambda: s.necks([0.7, 0.45, 0.36], 2.8),
    "zigzag": lambda: s.zigzag(5, 1.5, 3.0),
    "gear": lambda: s.gear(9, 2.2, 3.2),
    "pond, 1500 points": lambda: s.wavy(1500, 5.0, 0.2, 2),
    "traced room, 1500 points": lambda: s.traced(1, (7.5, 6.0), 1500),
    "ring": lambda: s.ring(3.0, 1.1, 36),
    "30 islands": lambda: s.pillars((10, 8), 30, (0.08, 0.3), 7),
    "columns": lambda: s.grid_pillars(4, 4, 2.0, 0.35),
    "maze": lambda: s.maze(5, 4, 1.4, 4),
    "fences": lambda: s.fences((8, 6), 6, 3),
    "field 100x60 askew": lambda: s.field(100, 60, 5.0, 6, 1),
    "house 4": lambda: b.house(1, 4),
    "house 7": lambda: b.house(2, 7),
    "office 6": lambda: b.office(11, 6, 9),
    "office 10": lambda: b.office(12, 10, 18),
    "flat 4": lambda: b.flat(21, 4, 6),
    "flat 6": lambda: b.flat(22, 6, 9),
    "rectangles 6": lambda: b.overlapping(31, 6),
    "rectangles 9": lambda: b.overlapping(32, 9),
}


def by_lot(rng: np.random.Generator) -> Document:
    """A map of any family, of a size that takes a second, with every number drawn by lot."""

    def between(low: float, high: float) -> float:
        return round(float(rng.uniform(low, high)), 3)

    seed = int(rng.integers(1 << 30))
    makers: list[Maker] = [
        lambda: s.document(s.box(0, 0, between(0.6, 8), between(0.6, 6))),
        lambda: s.ell(between(0.6, 2), between(2.5, 6), between(2.5, 6)),
        lambda: s.horseshoe(between(0.6, 1.6), between(2.5, 5), between(0.3, 1.5)),
        lambda: s.cross(between(0.8, 3), between(0.7, 2.5)),
        lambda: s.comb(
            [between(0.45, 1.6) for _ in range(5)], between(1, 3), 0.15, between(0.8, 2)
        ),
        lambda: s.snake([between(0.6, 1.8) for _ in range(4)], between(4, 7), 0.1),
        lambda: s.star(int(rng.integers(4, 12)), between(1.2, 2.2), between(2.5, 4)),
        lambda: s.necks([between(0.3, 1.2) for _ in range(3)], between(1.5, 3)),
        lambda: s.zigzag(int(rng.integers(3, 6)), between(0.7, 1.8), between(2.2, 3.5)),
        lambda: s.wavy(int(rng.integers(20, 400)), between(2, 4), between(0.05, 0.25), seed),
        lambda: s.pillars((7, 5), int(rng.integers(1, 14)), (0.08, 0.35), seed),
        lambda: s.maze(4, 3, between(0.8, 1.8), seed),
        lambda: s.fences((6, 5), int(rng.integers(1, 6)), seed),
        lambda: b.house(seed, int(rng.integers(2, 6))),
        lambda: b.office(seed, int(rng.integers(2, 6)), int(rng.integers(0, 9))),
        lambda: b.flat(seed, int(rng.integers(2, 5)), int(rng.integers(0, 6))),
        lambda: b.overlapping(seed, int(rng.integers(2, 7))),
    ]
    site = makers[int(rng.integers(len(makers)))]()
    return s.turned(site, between(-3, 3)) if rng.random() < 0.4 else site
