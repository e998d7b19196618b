"""Scanning Area: nested loops over everything that the robot can reach, in a drivable order."""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import shapely
from numpy.typing import NDArray
from shapely import MultiPolygon, Polygon

from polepilot.core.errors import PlanError
from polepilot.core.plan import Plan, PlanPart
from polepilot.core.planning.bumps import long_for_bumps
from polepilot.core.planning.curves import CHANGE
from polepilot.core.planning.driven import driven_path
from polepilot.core.planning.groups import regions_of
from polepilot.core.planning.leftover import stretches_over
from polepilot.core.planning.offset import (
    OVERLAP,
    Points,
    Stroke,
    cleanup_strokes,
    nested_loops,
)
from polepilot.core.planning.options import PlanOptions
from polepilot.core.planning.order import Run, ordered_runs
from polepilot.core.planning.outline import wheel_outlines
from polepilot.core.planning.patches import patches_of
from polepilot.core.planning.score import predict
from polepilot.core.planning.sharp import path_cost, sharp_path
from polepilot.core.planning.space import (
    MARGIN,
    FreeSpace,
    as_multi,
    free_space,
    other_starts,
    polygons,
)
from polepilot.core.planning.swept import few_corners, swept_shape
from polepilot.core.planning.target import CHORD, Target
from polepilot.core.planning.unreachable import unreachable_pieces
from polepilot.core.planning.wording import in_words
from polepilot.core.site import Site

Gears = NDArray[np.int8]
Planned = tuple[Points, Gears, tuple[PlanPart, ...], float | None]
"""A path, its gears and parts, and where that is known well enough, how much it misses, m²."""
Progress = Callable[[float, str], None]
"""Called with the share done, 0 to 1, and what is being done."""

LONGEST = 200_000.0
"""A plan longer than this would not be a day's work but a year's, metres."""
_CLOSER = (1.0, 0.0, 0.95, 0.9)
"""Spacings that are tried; see ``nested_loops``."""
_SPARSE = 0.04
_CLOSER_THEN = 0.955
"""Where loops with many corners leave more than this share they lie this much closer."""
_SOON = (2000, 600)
"""With more corners than the first no other spacing is tried, up to the second all of them."""
_FEW = 250
"""Up to so many corners other starts are tried as well, where the site has none."""
_FEW_SQUARES = 250.0
"""On maps of fewer squares of the tool a wheel's path is worked out for every spacing."""
_TOUCH = 0.004
"""How much loops overlap where bumps sweep what is left between them."""
_AT_WALLS = 0.005
"""How much a tool that is wider than the robot overlaps walls, as a share of its width."""
_GAP = 0.55
"""Tool widths between the two crossings from a loop to another and back."""
_LONG = 3.0
"""Only missed patches longer than so many tool widths get a pass of their own for a wheel; the
others are visited from the path."""
_BROAD = 0.36
"""Bumps do not sweep patches that are broader than twice this share of the tool's width."""
_DETAIL = 0.001
"""How exactly outlines are taken to tell how broad a patch is, metres: ragged ones have hundreds of
corners, and an offset by many times their size takes up to half a second."""
_MANY = 24
_MANY_FOR_WHEELS = 60
_LARGE = 5000.0
"""Up to so many loops, and squares of the tool, several spacings are tried."""
_SMALL = 100.0
_FINE = 0.0001
"""Up to so many squares of the tool the prediction takes arcs as exactly as this, metres."""
_SMALLEST = 0.008
"""Missed patches below this are left, m² for a tool of 0.4 m; scaled with its square."""


@np.errstate(invalid="ignore", divide="ignore")  # GEOS sets these flags for nothing
def plan_scan(
    site: Site,
    options: PlanOptions,
    area: MultiPolygon | None = None,
    progress: Progress | None = None,
) -> Plan:
    """The path that sweeps the reachable area, or of it only ``area`` (patches missed before).

    Begins at the start. ``Plan.area`` is what is to be swept and what the coverage refers to.

    Raises:
        PlanError: the robot does not fit, or there is nothing to sweep.
    """
    began = time.perf_counter()
    report = progress or _silent
    report(0.0, "free space")
    space = free_space(site, options)
    reachable = space.reachable()
    reachable = as_multi(reachable.intersection(space.floor))
    if reachable.area / options.tool_width > LONGEST:
        raise PlanError(
            f"the reachable area of {reachable.area:.0f} m² is too large for a tool of "
            f"{in_words(options.tool_width)}: expected a path of at most {LONGEST / 1000:.0f} km."
        )
    wanted = reachable if area is None else as_multi(reachable.intersection(area.buffer(0)))
    if wanted.area < 1e-4:
        raise PlanError("nothing of the area to scan can be reached from the start.")
    pieces, swept = [space.polygon], wanted
    if options.min_turn_radius > 0:
        pieces, swept = wheel_outlines(site, space, wanted, options.tool_width)
    pieces = _off_walls(pieces, space, options.tool_width)
    notes = [*site.repairs, *space.notes]
    if options.tool_width / 2 < space.clearance:
        swept = _within_reach(wanted, swept, space, options, notes)
    target = Target(swept, options.tool_width)
    report(0.1, "loops")
    path, gear, parts, missed = _shortest(
        pieces, space, options, target, area is None, notes, report
    )
    report(0.8, "unreachable parts")
    missing = unreachable_pieces(space, reachable)
    report(0.9, "prediction")
    small = wanted.area < _SMALL * options.tool_width**2
    left = missed if swept is wanted and not small else None
    if left is None:
        if small or swept is not wanted:
            target = Target(wanted, options.tool_width, _FINE if small else CHORD)
        left = target.missed_area(path)
    # All that a path sweeps is reachable; with patches it sweeps other floor as well.
    under = wanted.area - left if area is None else swept_shape(path, options.tool_width).area
    predicted = predict(path, gear, options, 1.0 - left / wanted.area, under)
    report(1.0, "done")
    return Plan(
        mode="scan",
        path=path,
        gear=gear,
        parts=parts,
        unreachable=missing,
        predicted=predicted,
        tool_width=options.tool_width,
        clearance=options.clearance,
        min_turn_radius=options.min_turn_radius,
        area=wanted,
        notes=tuple(notes),
        runtime=time.perf_counter() - began,
    )


def _off_walls(pieces: list[Polygon], space: FreeSpace, tool: float) -> list[Polygon]:
    """Where the outermost loops of a tool go that reaches farther than the robot has to stay away
    from walls: so far inside of ``pieces`` that it gets to the walls from there."""
    depth = tool / 2 - space.clearance - MARGIN - _AT_WALLS * tool
    if depth <= 0:
        return pieces
    inner = shapely.buffer(pieces, -depth, join_style="mitre", mitre_limit=2.0)
    return [part for part in polygons(inner) if part.area > 1e-4] or pieces


def _within_reach(
    wanted: MultiPolygon,
    swept: MultiPolygon,
    space: FreeSpace,
    options: PlanOptions,
    notes: list[str],
) -> MultiPolygon:
    """What of ``swept`` a tool gets to that is narrower than the robot keeps away from walls; a
    note says how much of ``wanted`` it does not."""
    reach = space.polygon.buffer(options.tool_width / 2, quad_segs=16)
    rim = wanted.difference(reach).area
    if rim >= 0.01:
        notes.append(
            f"{rim:.2f} m² along walls is out of the tool's reach: it is "
            f"{in_words(options.tool_width)} wide, and the robot keeps "
            f"{in_words(space.clearance)} away."
        )
    return as_multi(swept.intersection(reach))


def _shortest(
    pieces: list[Polygon],
    space: FreeSpace,
    options: PlanOptions,
    target: Target,
    whole: bool,
    notes: list[str],
    report: Progress,
) -> Planned:
    """The path along loops in ``pieces``; on maps where that is soon done the shortest for some
    spacings of the loops."""
    plain = options.min_turn_radius <= 0
    best: Planned | None = None
    least = math.inf
    spacings = [_CLOSER[:2], *((closer,) for closer in _CLOSER[2:])] if plain else [_CLOSER]
    trials = [(space, spacing) for spacing in spacings]
    free_start = space.anywhere
    while trials:
        here, spacing = trials.pop(0)
        ways = _strokes(pieces, here, options, target, whole, spacing)
        few = not plain and target.area < _FEW_SQUARES * target.tool**2
        tried = []
        for strokes in (ways if few else ways[:1]) or [[_least_stroke(here)]]:
            report(0.3, "order")
            runs = ordered_runs(
                strokes,
                here.start.position,
                here,
                options.order,
                reach=options.tool_width,
                gap=0.0 if options.min_turn_radius > 0 else _GAP * options.tool_width,
            )
            report(0.5, "path")
            said: list[str] = []
            tried.append((_path(runs, here, options, target, said, whole), said))
        found, said = min(tried, key=lambda way: _driven_cost(way[0], target))
        notes += said if best is None else []
        corners = len(few_corners(found[0]))
        large = corners > _SOON[0] or target.area > _LARGE * target.tool**2
        if not plain or not whole or options.order == "paper" or large:
            return best or found
        cost = path_cost(found[0], found[3] or 0.0, target.tool)
        if cost < least:
            best, least, best_spacing = (*found[:3], None), cost, spacing
        if corners > _SOON[1]:
            break
        if not trials and free_start and corners <= _FEW:
            # Where the job may begin anywhere, it may be shorter from an end of the longest side.
            trials = [(replace(space, start=start), best_spacing) for start in other_starts(space)]
            free_start = False
    assert best is not None  # there is at least one spacing
    return best


def _driven_cost(planned: Planned, target: Target) -> float:
    """What a path costs with its changes of gear and what it misses, metres."""
    path, gears, _, missed = planned
    return path_cost(path, missed or 0.0, target.tool) + CHANGE * np.count_nonzero(np.diff(gears))


def _least_stroke(space: FreeSpace) -> Stroke:
    """Where there is hardly room to move: the longest straight line that was found in it."""
    x, y = space.start.position
    corners = np.asarray(space.polygon.exterior.coords, dtype=float)[:, :2]
    lines = [np.array([[x, y], corner]) for corner in corners]
    return Stroke(
        max(
            (line for line in lines if space.holds_points(line)),
            key=lambda line: float(np.hypot(*(line[1] - line[0]))),
            default=np.array([[x, y], [x, y]]),
        ),
        False,
        -1,
    )


def _silent(share: float, what: str) -> None:
    """Nobody wants to know."""
    del share, what


def _strokes(
    pieces: list[Polygon],
    space: FreeSpace,
    options: PlanOptions,
    target: Target,
    whole: bool,
    spacings: tuple[float, ...],
) -> list[list[Stroke]]:
    """Loops and clean-up passes for ``target``, for some spacings, the best first; for patches
    passes, and stretches of loops."""
    tool = options.tool_width
    smallest = _SMALLEST * (tool / 0.4) ** 2
    plain = options.min_turn_radius <= 0
    tolerance = min(0.002, 0.01 * tool) if plain else min(0.02, 0.05 * tool)
    if options.order == "paper" and whole:
        pieces = [region for piece in pieces for region in regions_of(piece, tool)]
    passed = (_broad if tool / 2 > space.clearance + MARGIN else long_for_bumps) if plain else _long
    # Each clean-up pass has to be gone to and left again.
    extra = 2 * tool * (1 + (options.min_turn_radius > 0))
    overlap = _TOUCH if plain else OVERLAP
    if not whole:
        every = (nested_loops(pieces, tool, tolerance, closer, overlap) for closer in spacings)
        ways = [stretches_over(nest.loops, target.shape, tool) for nest in every]
        loops = min(ways, key=lambda strokes: _cost(strokes, extra))
        missed = target.missed(*(stroke.track for stroke in loops))
        return [_completed(loops, missed, space, target, smallest, _always if plain else _long)]
    found: list[tuple[float, list[Stroke]]] = []
    least = math.inf
    for closer in spacings:
        nest = nested_loops(pieces, tool, tolerance, closer, overlap)
        if _cost(nest.loops, extra) >= least:
            continue  # passes make that no less
        missed = nest.missed(target.shape, tool, target.quad_segs)
        tracks = [stroke.track for stroke in nest.loops]
        many = plain and closer == 1 and sum(map(len, tracks)) > _SOON[1]
        if many and missed.area > _SPARSE * target.area and target.area <= _LARGE * tool**2:
            nest = nested_loops(pieces, tool, tolerance, _CLOSER_THEN, _TOUCH)
            missed = nest.missed(target.shape, tool, target.quad_segs)
        strokes = _completed(nest.loops, missed, space, target, smallest, passed)
        if strokes:
            found.append((_cost(strokes, extra), strokes))
            least = min(least, found[-1][0])
        if many or target.area > _LARGE * tool**2:
            break  # on a large map the spacing matters less than the time to think about it
        if len(nest.loops) > (_MANY if plain else _MANY_FOR_WHEELS):
            break
    return [strokes for _, strokes in sorted(found, key=lambda way: way[0])]


def _cost(strokes: list[Stroke], extra: float) -> float:
    """Their length, and ``extra`` metres for each that is no loop."""
    return sum(float(s.line.length) + (0.0 if s.closed else extra) for s in strokes)


def _completed(
    loops: list[Stroke],
    missed: MultiPolygon,
    space: FreeSpace,
    target: Target,
    smallest: float,
    passed: Callable[[Polygon, float], bool],
) -> list[Stroke]:
    """Loops with the clean-up passes for those patches of what is ``missed`` by them that are to be
    ``passed`` over by a tool of some width."""
    strokes, tool = list(loops), target.tool
    more: list[Stroke] = []
    for again in range(1 if passed is long_for_bumps else 2):  # bumps do what passes leave
        if again:
            missed = target.still_missed(missed, *(stroke.track for stroke in more))
        patches = [p for p in patches_of(missed, smallest) if not strokes or passed(p, tool)]
        more = cleanup_strokes(MultiPolygon(patches), tool, space, smallest)
        strokes += more
        if not more:
            break
    return strokes or cleanup_strokes(target.shape, tool, space, 0.0)


def _always(patch: Polygon, tool: float) -> bool:
    """Every patch gets a pass."""
    del patch, tool
    return True


def _broad(patch: Polygon, tool: float) -> bool:
    """The same as ``long_for_bumps``, or whether it is a passage narrower than the tool, in which
    there is no loop for bumps."""
    if long_for_bumps(patch, tool):
        return True
    return not patch.simplify(_DETAIL).buffer(-_BROAD * tool, quad_segs=2).is_empty


def _long(patch: Polygon, tool: float) -> bool:
    """Whether a wheel does better with a pass along a patch than with visits to it."""
    return bool(patch.length > 2 * _LONG * tool)


def _path(
    runs: list[Run],
    space: FreeSpace,
    options: PlanOptions,
    target: Target,
    notes: list[str],
    whole: bool,
) -> Planned:
    if options.min_turn_radius <= 0:
        path, parts, missed = sharp_path(runs, space, options, target, notes)
        return path, np.ones(len(path) - 1, np.int8), parts, missed
    return driven_path(runs, space, options, target, notes, whole)
