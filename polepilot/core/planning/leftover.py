"""What is left of an area, swept by those stretches of the usual loops that lie over it.

Patches that a job left have ragged outlines, which no wheel follows well; the loops of the free
space are those that the job would have gone on with.
"""

from __future__ import annotations

import numpy as np
import shapely
from numpy.typing import NDArray
from shapely import LineString, MultiPolygon

from polepilot.core.planning.offset import Stroke
from polepilot.core.planning.space import polygons

Points = NDArray[np.float64]

_WIDE = 0.55
"""Patches with no room for a disc of this many tool widths are left to passes of their own."""
_RIM = 0.08
"""So much along the rim of a patch, in tool widths, is no reason to drive there."""
_RAGGED = 0.05
"""How exactly the outlines of patches are taken, in tool widths."""
_TOUCH = 0.05
"""Nor is what only the outermost part of the tool would sweep, as a share of its width."""
_GAP = 2.5
"""Stretches of a loop are joined where no more lies between them, in tool widths."""
_SHORTEST = 0.5
"""Stretches shorter than this are left to passes, in tool widths."""
_WHOLE = 0.85
"""A loop of which more than this share is needed is driven as a whole."""


def stretches_over(loops: list[Stroke], target: MultiPolygon, tool: float) -> list[Stroke]:
    """The loops, or what of them is needed, for the wide patches of ``target``."""
    smooth = target.simplify(_RAGGED * tool)
    wide = [patch for patch in polygons(smooth) if not patch.buffer(-_WIDE * tool).is_empty]
    core = shapely.union_all(wide).buffer(-_RIM * tool, quad_segs=4)
    zone = shapely.union_all(polygons(core)).buffer((0.5 - _TOUCH) * tool, quad_segs=4)
    if zone.is_empty:
        return []
    shapely.prepare(zone)
    found: list[Stroke] = []
    for loop in loops:
        line = loop.line
        if shapely.covers(zone, line):
            found.append(loop)
        elif shapely.intersects(zone, line):
            found += _needed(loop, shapely.intersection(zone, line), tool)
    return found


def _needed(loop: Stroke, inside: shapely.Geometry, tool: float) -> list[Stroke]:
    """The stretches of a loop that lie inside of something, joined over short gaps."""
    line, length = loop.line, float(loop.line.length)
    spans: list[list[float]] = []
    for part in shapely.get_parts(shapely.line_merge(inside)).tolist():
        if isinstance(part, LineString) and part.length > 1e-6:
            middle = float(line.project(part.interpolate(0.5, normalized=True)))
            first = (middle - float(part.length) / 2) % length
            spans.append([first, first + float(part.length)])
    spans.sort()
    joined: list[list[float]] = []
    for span in spans:
        if joined and span[0] - joined[-1][1] < _GAP * tool:
            joined[-1][1] = max(joined[-1][1], span[1])
        else:
            joined.append(span)
    if len(joined) > 1 and joined[0][0] + length - joined[-1][1] < _GAP * tool:
        joined[-1][1] = max(joined[-1][1], length + joined.pop(0)[1])
    if sum(last - first for first, last in joined) > _WHOLE * length:
        return [loop]
    return [
        Stroke(_stretch(loop.track, first, last), False, loop.depth)
        for first, last in joined
        if last - first > _SHORTEST * tool
    ]


def _stretch(track: Points, first: float, last: float) -> Points:
    """What of a closed line lies between two lengths along it, of which the second may be beyond
    its end."""
    twice = np.vstack([track, track[1:]])
    marks = np.r_[0.0, np.cumsum(np.hypot(*np.diff(twice, axis=0).T))]
    inner = twice[(marks > first + 1e-6) & (marks < last - 1e-6)]
    ends = [[float(np.interp(at, marks, column)) for column in twice.T] for at in (first, last)]
    return np.vstack([ends[:1], inner, ends[1:]])
