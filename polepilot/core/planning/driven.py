"""A path for a steered front wheel: runs driven one by one, what its curves miss visited."""

from __future__ import annotations

import math
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray
from shapely import MultiPolygon

from polepilot.core.errors import PlanError
from polepilot.core.geometry import Pose2D, wrap_angle
from polepilot.core.plan import PlanPart
from polepilot.core.planning.crumbs import without_crumbs
from polepilot.core.planning.driver import Driver
from polepilot.core.planning.offset import Points, cleanup_strokes
from polepilot.core.planning.options import PlanOptions
from polepilot.core.planning.order import Run
from polepilot.core.planning.sharp import Recorder, chained
from polepilot.core.planning.space import FreeSpace
from polepilot.core.planning.swept import SMALLEST_PATCH
from polepilot.core.planning.target import Target
from polepilot.core.planning.track import without_jerks
from polepilot.core.planning.visits import Vain, with_visits
from polepilot.core.planning.wording import in_words

Gears = NDArray[np.int8]
Parts = tuple[PlanPart, ...]
Driven = tuple[Points, Gears, Parts, MultiPolygon]
"""A path, its gears and parts, and what it misses."""

_LEAST = 0.0065
"""Missed patches smaller than this share of the tool's square are not visited."""
_CRUMB = SMALLEST_PATCH / 0.4**2
"""Nor those smaller than this where only a rest is to be swept."""
_ENOUGH = 0.0003
"""Where less than this share of all is missed, no further patch is visited."""
_SAID = 0.005
"""Less than this is not worth a note, m²."""
_WORTH = 0.1
"""Missed patches larger than this share of the tool's square are driven to from the end."""


def driven_path(
    runs: list[Run],
    space: FreeSpace,
    options: PlanOptions,
    target: Target,
    notes: list[str],
    whole: bool = True,
) -> tuple[Points, Gears, Parts, float]:
    """Followable by a steered wheel; what its curves miss is visited at the end. And how much of
    the target is missed then, m².

    ``whole``: else the target is what was left before, of which crumbs are left again.
    """
    driver, recorder = _from_start(runs, space, options, target)
    path, gear = driver.track.arrays()
    driven = path, gear, tuple(recorder.parts), target.missed(path)
    if len(path) > 1:
        smallest = (_LEAST if whole else _CRUMB) * target.tool**2
        radius = driver.track.radius
        vain = Vain()
        driven = _visited(*driven, space, radius, target, smallest, vain)
        longer = _passed(*driven, driver, space, options, target, vain)
        if longer is not None:
            driven = _visited(*longer, space, radius, target, smallest, Vain())
    path, gear, parts, missed = driven
    left = float(missed.area)
    if left > max(0.02 * target.area, _SAID):
        notes.append(
            f"{left:.2f} m² is missed: no way was found there with a turning radius of "
            f"{in_words(options.min_turn_radius)} and a clearance of {in_words(options.clearance)}."
        )
    if len(path) < 2:
        raise PlanError(
            f"the robot cannot move from the start with a turning radius of "
            f"{in_words(options.min_turn_radius)}."
        )
    path, gear, moved = without_jerks(path, gear)
    path, gear, there = without_crumbs(path, gear, space)
    return path, gear, _moved_parts(parts, there[moved]), left


def _from_start(
    runs: list[Run], space: FreeSpace, options: PlanOptions, target: Target
) -> tuple[Driver, Recorder]:
    """The runs driven from the start with the heading from which most of them is reached."""
    best: tuple[Driver, Recorder] | None = None
    least = math.inf
    headings = _headings(space, runs)
    # A heading that does not even get to the first run is given up, unless all are like that.
    for heading, anyway in (*((heading, False) for heading in headings), (headings[0], True)):
        if anyway and best is not None:
            break
        driver = Driver(
            space, options.min_turn_radius, Pose2D(space.start.x, space.start.y, heading)
        )
        recorder = Recorder()
        _drive(driver, runs, recorder, options, anyway or len(headings) == 1)
        if not (driver.track.last or anyway):
            continue
        path, _ = driver.track.arrays()
        left = target.missed_area(path)
        if best is None or left < least:
            best, least = (driver, recorder), left
        if left < 0.1 * target.area:
            break
    assert best is not None  # the last one is not given up
    return best


def _visited(
    path: Points,
    gear: Gears,
    parts: Parts,
    missed: MultiPolygon,
    space: FreeSpace,
    radius: float,
    target: Target,
    smallest: float,
    vain: Vain,
) -> Driven:
    """The path with visits to what it misses, and to what those miss."""
    enough = _ENOUGH * target.area
    for _ in range(2):
        before = len(path)
        path, gear, parts, missed = with_visits(
            path, gear, parts, target, space, radius, smallest, enough, missed, vain
        )
        if len(path) == before:
            break
    return path, gear, parts, missed


def _passed(
    path: Points,
    gear: Gears,
    parts: Parts,
    missed: MultiPolygon,
    driver: Driver,
    space: FreeSpace,
    options: PlanOptions,
    target: Target,
    vain: Vain,
) -> Driven | None:
    """The path with passes at its end over what lies too far from it for visits; None: nothing.

    ``driver`` stands where the path ends.
    """
    more = cleanup_strokes(missed, target.tool, space, _WORTH * target.tool**2)
    more = [stroke for stroke in more if not vain.holds_both(stroke.points)]
    if not more:
        return None
    last, recorder = driver.track.last, Recorder()
    recorder.parts += parts
    recorder.ahead = len(path) - 1 - last
    _drive(driver, chained(more, driver.track.pose.position), recorder, options)
    points, gears = driver.track.arrays()
    longer = np.vstack([path, points[last + 1 :]]), np.concatenate([gear, gears[last:]])
    return *longer, tuple(recorder.parts), target.still_missed(missed, points[last:])


def _moved_parts(parts: Parts, moved: NDArray[np.intp]) -> Parts:
    """Parts of a path of which some points were left out; ``moved``: where the others are now."""
    ends = [0, *(int(moved[part.last]) for part in parts)]
    return tuple(
        PlanPart(part.kind, first, last)
        for part, (first, last) in zip(parts, pairwise(ends), strict=True)
        if last > first
    )


def _headings(space: FreeSpace, runs: list[Run]) -> list[float]:
    """The start's heading; where it has none, along the first run, then others to try."""
    start = space.start
    if start.heading is not None:
        return [start.heading]
    first = runs[0].points
    aim = first[0] if math.dist(first[0], start.position) > 0.05 else first[1]
    along = math.atan2(aim[1] - start.y, aim[0] - start.x)
    return [wrap_angle(along + turn * math.pi / 2) for turn in (0, 2, 1, 3)]


def _drive(
    driver: Driver,
    runs: list[Run],
    recorder: Recorder,
    options: PlanOptions,
    anyway: bool = True,
) -> None:
    """Drives the runs; leaves out what cannot be reached or followed, or with the first of them
    all, unless it is to be driven ``anyway``."""
    for run, following in zip(runs, [*runs[1:], None], strict=True):
        here = driver.track.pose.position
        # The rest of another loop goes on where this one begins.
        back = following is not None and following.stroke.closed and not following.whole
        points = driver.enter(run.points, run.whole and not back)
        if points is None and not (anyway or driver.track.last):
            return
        if points is None:
            recorder.close("link", driver.track.last)
            continue
        place = (float(points[0, 0]), float(points[0, 1]))
        near = bool(recorder.parts) and math.dist(here, place) <= 1.6 * options.tool_width
        recorder.close("bridge" if near else "link", driver.track.last)
        driver.follow(points)
        recorder.close("loop" if run.stroke.closed else "cleanup", driver.track.last)
