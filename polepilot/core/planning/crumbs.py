"""Steps of a path so short that the digits in which it is written would turn them.

A plan is written with four digits. Of a step of 0.2 mm that leaves hardly the direction, and who
follows the plan would find a corner there.
"""

from __future__ import annotations

import math

import numpy as np
import shapely
from numpy.typing import NDArray

from polepilot.core.planning.space import FreeSpace

Points = NDArray[np.float64]
Indices = NDArray[np.intp]

SHORTEST = 0.01
"""Steps shorter than this are joined with their neighbours where the path stays free, metres."""
_CRUMB = 0.002
"""Steps shorter than this are joined in any case, metres; a point that is left out lies less than
twice this from one that stays, along the path: one gear's curve hardly bends on so short a way."""


def without_crumbs(
    path: Points, gears: NDArray[np.int8], space: FreeSpace
) -> tuple[Points, NDArray[np.int8], Indices]:
    """A path without short steps inside of one gear; its ends and changes of gear stay.

    Also its gears, and for each point of the old path the index of the new one.
    """
    fixed: Indices = np.r_[0, np.flatnonzero(np.diff(gears)) + 1, len(path) - 1]
    kept = np.ones(len(path), dtype=bool)
    for shortest, anyway in ((_CRUMB, True), (SHORTEST, False)):
        rows = np.flatnonzero(kept)
        dropped = rows[_short(path[rows], np.searchsorted(rows, fixed), shortest)]
        kept[dropped] = False
        if anyway or not len(dropped):
            continue
        left = np.flatnonzero(kept)
        after = np.searchsorted(left, dropped)
        chords = shapely.linestrings(np.stack([path[left[after - 1]], path[left[after]]], axis=1))
        kept[dropped[[not space.holds(chord) for chord in chords]]] = True
    rows = np.flatnonzero(kept)
    moved = np.searchsorted(rows, np.arange(len(path)))
    return path[rows], gears[rows[:-1]], moved


def _short(path: Points, fixed: Indices, shortest: float) -> Indices:
    """Which points to leave out so that no step is shorter, the ``fixed`` ones not."""
    short = np.flatnonzero(np.hypot(*np.diff(path, axis=0).T) < shortest)
    stretches = np.flatnonzero(np.bincount(np.searchsorted(fixed, short, side="right") - 1))
    dropped: list[int] = []
    for first, last in fixed[stretches[:, None] + np.arange(2)].tolist():
        kept = [first]
        for point in range(first + 1, last):
            if math.dist(path[point], path[kept[-1]]) < shortest:
                dropped.append(point)
            else:
                kept.append(point)
        while len(kept) > 1 and math.dist(path[last], path[kept[-1]]) < shortest:
            dropped.append(kept.pop())
    return np.array(dropped, dtype=np.intp)
