"""A path with corners as sharp as they come: runs joined, one last strip, bumps for the rest."""

from __future__ import annotations

import math
from dataclasses import replace
from itertools import pairwise

import numpy as np
import shapely
from shapely import Polygon

from polepilot.core.plan import PartKind, PlanPart
from polepilot.core.planning.bumps import bumps_length, with_bumps
from polepilot.core.planning.offset import Points, Stroke, cleanup_strokes
from polepilot.core.planning.options import PlanOptions
from polepilot.core.planning.order import Run
from polepilot.core.planning.patches import SLIVER, patches_of
from polepilot.core.planning.space import FreeSpace
from polepilot.core.planning.swept import few_corners
from polepilot.core.planning.target import Target
from polepilot.core.planning.trim import trimmed

Swept = tuple[Points, tuple[PlanPart, ...], float]
"""A path, its parts, and about how much it misses, m²."""

_LEAST = 0.0065
"""Missed patches smaller than this share of the tool's square get no bump."""
_SHARE = 0.00008
"""Nor those smaller than this share of all that is to be swept."""
_TRIFLE = 0.0001
"""Where less than this share is missed by a path with sharp corners, it gets no further bump."""
_LITTLE = 0.0005
"""The same on large maps, where each bump is a smaller part of the whole."""
_STRIP = 5.0
"""A missed patch longer than so many tool widths may be driven along at the end."""
_ABOUT = 1.5
"""How far the length of bumps may be from what is expected, either way."""
_LONG = 100
"""Strips around which it is more tool widths than this are not tried out both ways."""
_FEW_CORNERS = 600
"""Up to so many it is tried out what is shorter."""
_DEAR = 10.0
"""How much more what is missed counts than the path that would sweep it."""
_STARTS = 12
_MOST_CORNERS = 2000
"""A path with more corners than this is not driven along its longest strip."""


def sharp_path(
    runs: list[Run],
    space: FreeSpace,
    options: PlanOptions,
    target: Target,
    notes: list[str],
) -> Swept:
    """Corners as sharp as they come, all forward; with bumps to what is missed."""
    tool = options.tool_width
    smallest = min(_LEAST * tool**2, _SHARE * target.area)
    path, parts = _joined_runs(runs, space, options, notes)
    if options.order != "paper":
        ways = [trimmed(path, parts, target, 3 * smallest)]
        if runs[-1].whole:
            # Its end may be swept already if the last loop is driven the other way round.
            turned = [*runs[:-1], replace(runs[-1], points=runs[-1].points[::-1].copy())]
            ways.append(trimmed(*_joined_runs(turned, space, options, []), target, 3 * smallest))
        path, parts = min(ways, key=lambda way: path_length(way[0]))
    corners = len(few_corners(path))
    if options.order == "paper" or corners > _MOST_CORNERS:
        return _with_bumps(path, parts, space, options, target)
    missed = target.missed(path)
    strip = _longest_strip(missed, tool)
    if strip is None:
        return _with_bumps(path, parts, space, options, target, missed)
    # The longest strip that loops leave is driven once, and nothing leads back from there.
    passes = cleanup_strokes(strip, tool, space, smallest)
    if not passes:
        return _with_bumps(path, parts, space, options, target, missed)
    end = (float(path[-1, 0]), float(path[-1, 1]))
    longer = _joined_runs(chained(passes, end), space, options, [], path, parts)
    longer = trimmed(*longer, target, 3 * smallest)
    more = path_length(longer[0]) - path_length(path)
    bumpy = bumps_length(strip, tool)
    tried = corners <= _FEW_CORNERS and strip.length < _LONG * tool
    found = []
    if more < _ABOUT * bumpy:
        found.append(_with_bumps(*longer, space, options, target))
    if not found or (more > bumpy / _ABOUT and tried):
        found.append(_with_bumps(path, parts, space, options, target, missed))
    return min(found, key=lambda way: path_cost(way[0], way[2], target.tool))


def path_cost(path: Points, missed: float, tool: float) -> float:
    """Its length, and for the ``missed`` m² more than it would take to sweep them."""
    return path_length(path) + _DEAR * missed / tool


def _with_bumps(
    path: Points,
    parts: tuple[PlanPart, ...],
    space: FreeSpace,
    options: PlanOptions,
    target: Target,
    missed: shapely.Geometry | None = None,
) -> Swept:
    """The path with bumps to what it misses, if that is known already ``missed``."""
    return with_bumps(
        path,
        parts,
        target,
        space,
        min(_LEAST * target.tool**2, _SHARE * target.area),
        (_TRIFLE if len(few_corners(path)) < _MOST_CORNERS else _LITTLE) * target.area,
        options.order == "paper",
        missed,
    )


def chained(strokes: list[Stroke], here: tuple[float, float]) -> list[Run]:
    """Open passes in that order, always the nearest end next, which has the shortest gaps."""
    ends = np.array([[stroke.points[0], stroke.points[-1]] for stroke in strokes])
    between = np.hypot(*np.moveaxis(ends[:, :, None, None] - ends[None, None], -1, 0))
    between[np.arange(len(ends)), :, np.arange(len(ends))] = math.inf
    lonely = np.round(between.min(axis=(2, 3)), 6).ravel()
    best: list[tuple[int, int]] = []
    least = math.inf
    for start in np.argsort(-lonely, kind="stable")[:_STARTS].tolist():
        order = [(start // 2, start % 2)]
        waiting = np.ones(len(strokes), dtype=bool)
        waiting[start // 2] = False
        gaps = math.dist(here, ends[start // 2, start % 2])
        while waiting.any():
            distances = between[order[-1][0], 1 - order[-1][1]].copy()
            distances[~waiting] = math.inf
            index, side = divmod(int(np.argmin(np.round(distances, 6))), 2)
            order.append((index, side))
            gaps += float(distances[index, side])
            waiting[index] = False
        if gaps < least:
            best, least = order, gaps
    return [
        Run(strokes[i].points[::-1].copy() if flip else strokes[i].points, strokes[i], False)
        for i, flip in best
    ]


def _longest_strip(missed: shapely.Geometry, tool: float) -> Polygon | None:
    """The longest missed patch, if it is worth to be driven along."""
    longest = max(
        patches_of(missed, 0.0, 2 * SLIVER), key=lambda patch: float(patch.length), default=None
    )
    if longest is None or longest.length / 2 < _STRIP * tool:
        return None
    return longest


def path_length(path: Points) -> float:
    return float(np.hypot(*np.diff(path, axis=0).T).sum())


def _joined_runs(
    runs: list[Run],
    space: FreeSpace,
    options: PlanOptions,
    notes: list[str],
    path: Points | None = None,
    parts: tuple[PlanPart, ...] = (),
) -> tuple[Points, tuple[PlanPart, ...]]:
    """The runs with the ways between them, after ``path`` if there is one."""
    blocks: list[Points] = [np.array([space.start.position]) if path is None else path]
    recorder = Recorder()
    recorder.parts += parts
    count = len(blocks[0])
    for run in runs:
        here = (float(blocks[-1][-1, 0]), float(blocks[-1][-1, 1]))
        there = (float(run.points[0, 0]), float(run.points[0, 1]))
        if math.dist(here, there) > 1e-6:
            way = space.shortest_path(here, there)
            if way is None:
                x, y = there
                notes.append(f"no way was found to a pass at ({x:.2f}, {y:.2f}); it is left out.")
                continue
            blocks.append(np.array(way[1:]))
            count += len(way) - 1
            recorder.close(_connection(way, options) if recorder.parts else "link", count - 1)
        blocks.append(run.points[1:])
        count += len(run.points) - 1
        recorder.close("loop" if run.stroke.closed else "cleanup", count - 1)
    return np.vstack(blocks), tuple(recorder.parts)


def _connection(way: list[tuple[float, float]], options: PlanOptions) -> PartKind:
    """A bridge joins neighbouring loops; anything longer is a link."""
    length = sum(math.dist(a, b) for a, b in pairwise(way))
    return "bridge" if len(way) == 2 and length <= 1.6 * options.tool_width else "link"


class Recorder:
    """Collects the parts of a path while it grows."""

    def __init__(self) -> None:
        self.parts: list[PlanPart] = []
        self.ahead = 0
        """How many more points the path has before those that are counted here."""

    def close(self, kind: PartKind, last: int) -> None:
        last += self.ahead
        first = self.parts[-1].last if self.parts else 0
        if last > first:
            if self.parts and self.parts[-1].kind == kind and kind != "loop":
                self.parts[-1] = PlanPart(kind, self.parts[-1].first, last)
            else:
                self.parts.append(PlanPart(kind, first, last))
