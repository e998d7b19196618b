"""The end of a path that sweeps nothing new is not driven."""

from __future__ import annotations

import numpy as np
import shapely
from numpy.typing import NDArray

from polepilot.core.plan import PlanPart
from polepilot.core.planning.swept import few_corners, swept_by, swept_shape
from polepilot.core.planning.target import CHORD, Target

Points = NDArray[np.float64]

_FIRST = 0.4
"""How much of the end is looked at first, metres; then always twice as much."""
_FINE = 0.02


def trimmed(
    path: Points,
    parts: tuple[PlanPart, ...],
    target: Target,
    most: float,
) -> tuple[Points, tuple[PlanPart, ...]]:
    """The path without as much of its end as can be left out for ``most`` m² of ``target``."""
    if len(path) < 3:
        return path, parts
    tail = _Tail(path, target)
    kept, gone = 0.0, min(_FIRST, tail.length)
    while tail.loss(gone) <= most:
        kept, gone = gone, min(2 * gone, tail.length)
        if kept == gone:
            break
    while gone - kept > _FINE:
        middle = (kept + gone) / 2
        if tail.loss(middle) <= most:
            kept = middle
        else:
            gone = middle
    kept = min(kept, tail.length - target.tool)
    if kept <= _FINE:
        return path, parts
    short = tail.without(kept)
    last = len(short) - 1
    return short, tuple(
        PlanPart(part.kind, part.first, min(part.last, last)) for part in parts if part.first < last
    )


class _Tail:
    """The end of a path, and what is swept by it alone."""

    def __init__(self, path: Points, target: Target) -> None:
        self._path = path
        self._target = target
        self._tool = target.tool
        self._marks = np.append(0.0, np.cumsum(np.hypot(*np.diff(path, axis=0).T)))
        self.length = float(self._marks[-1])
        few = few_corners(path, CHORD)
        self._few, self._few_marks = path[few], self._marks[few]
        pairs = np.stack([self._few[:-1], self._few[1:]], axis=1)
        self._tree = shapely.STRtree(shapely.linestrings(pairs))
        after = np.vstack([self._few[2:], np.full((1, 2), np.nan)])
        self._segments = np.hstack([self._few[:-1], self._few[1:], after])

    def without(self, length: float) -> Points:
        """The path without the last ``length`` metres."""
        return self._cut(self._path, self._marks, self.length - length)

    def loss(self, length: float) -> float:
        """What nothing but the last ``length`` metres sweeps, m²."""
        mark = self.length - length
        head = self._cut(self._few, self._few_marks, mark)
        tail = np.vstack([head[-1:], self._few[self._few_marks > mark + 1e-9]])
        if len(tail) < 2:
            return 0.0
        swept = swept_shape(tail, self._tool)
        near = self._tree.query(shapely.linestrings(tail), predicate="dwithin", distance=self._tool)
        before = near[near < len(head) - 2]
        last = swept_shape(head[-2:], self._tool)
        pieces = swept_by(self._segments[before], self._tool / 2)
        rest = swept.difference(shapely.union_all([*pieces, last]))
        return self._target.area_in(rest)

    @staticmethod
    def _cut(path: Points, marks: Points, mark: float) -> Points:
        end = [np.interp(mark, marks, path[:, 0]), np.interp(mark, marks, path[:, 1])]
        return np.vstack([path[marks < mark - 1e-9], end])
