"""Where more landmarks help most: greedy over places along walls, with bounds on what is possible.

The gain of a set of places is the mean of ½ log det(I₀ + I) over all stands (a spot and a
heading), where I is the information of all landmarks and I₀ that of a pose known just as vaguely as
a fix may be at most. Landmarks add up in I, so that the gain is monotone and submodular: what the
greedy choice reached after k places, plus the k largest gains that single places could add to it,
is more than any k of the same places can reach (the same after each earlier step; the smallest of
these counts).

The gain is counted in information, which is what makes the bound hold; people want centimetres. So
there is a second bound on the mean error itself: what it would be if a landmark stood at every one
of the places, and what it would be if each stand could choose its own k of them.
Both leave aside that poles hide each other, which makes them no less true.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
import shapely

from polepilot.core.errors import InputError
from polepilot.core.geometry import Point
from polepilot.core.landmark import Landmark, LandmarkKind, id_set, spacing
from polepilot.core.localization.precision import PrecisionField, round_resolution
from polepilot.core.localization.precision_grid import PrecisionMap
from polepilot.core.localization.precision_sight import Bools, Floats, Sweep
from polepilot.core.site import Site

MOST_PLACES = 120
"""So many places, at most, are compared."""
MOST_SUGGESTIONS = 20
SPOTS = 400
"""About so many spots are looked at."""
_APART = 0.3
"""Metres that a new landmark stays away from others."""
_AT_EDGE = 0.05
"""Metres from the boundary or an island to the axis of a pole that leans on it."""
_AT_WALL = 0.12
"""The same for a wall, which may be thin: nearer, a pole would be taken for seen through it."""
_BEARINGS = 8


@dataclass(frozen=True, slots=True)
class Suggestion:
    """A landmark that would help, and how things stand once it and those before it are there."""

    landmark: Landmark
    overall: float
    """`PrecisionMap.overall`, metres."""
    mean_position: float | None
    coverage: float

    def to_json(self) -> dict[str, Any]:
        mark = self.landmark
        return {
            "id": mark.id,
            "x": mark.x,
            "y": mark.y,
            "overall": self.overall,
            "mean_position": self.mean_position,
            "coverage": self.coverage,
        }


@dataclass(frozen=True, slots=True)
class Suggestions:
    """The answer of `suggest`, best place first."""

    chosen: tuple[Suggestion, ...]
    before: PrecisionMap
    places: int
    """How many places were compared."""
    gain: float
    """Mean information gained per stand, in natural units."""
    gain_bound: float
    """No equally large set of the same places gains more."""
    overall_bound: float
    """No equally large set of the same places makes ``overall`` smaller, metres."""

    def to_json(self) -> dict[str, Any]:
        return {
            "suggestions": [suggestion.to_json() for suggestion in self.chosen],
            "before": self.before.summary(),
            "places": self.places,
            "gain": self.gain,
            "gain_bound": self.gain_bound,
            "overall_bound": self.overall_bound,
        }


def suggest(
    site: Site, k: int, sweep: Sweep | None = None, resolution: float | None = None
) -> Suggestions:
    """``k`` places for more landmarks, chosen one after the other.

    Args:
        resolution: metres between the spots that are to become better; None makes about
            `SPOTS` of them.

    Raises:
        InputError: ``k`` is not 1 to 20, the site has no ids or no places left for so many, or
            ``resolution`` cannot be used for it.
    """
    if not 1 <= k <= MOST_SUGGESTIONS:
        raise InputError(f"suggest is {k}: expected 1 to {MOST_SUGGESTIONS} landmarks.")
    kind = site.landmarks[0].kind if site.landmarks else LandmarkKind()
    ids = _free_ids(site, kind, k)
    places = candidate_places(site)
    if len(places) < k:
        raise InputError(
            f"suggest is {k}: the site has {len(places)} places along its walls left for landmarks."
        )
    if resolution is None:
        resolution = round_resolution(site, SPOTS)
    field = PrecisionField(site, sweep, resolution)
    possible = field.possible
    prior = _prior(field)
    told = np.stack([field.alone(Landmark(ids[0], *p, kind))[:, possible] for p in places])
    known = field.information(site.landmarks)[:, possible]
    start = known
    value = float(_value(known + prior).mean())
    first, bound = value, math.inf
    left = list(range(len(places)))
    chosen: list[int] = []
    for _ in range(k + 1):
        values = _value((known + prior)[None] + told[left]).mean(axis=1)
        gains = np.maximum(values - value, 0.0)
        bound = min(bound, value - first + float(np.sort(gains)[-k:].sum()))
        if len(chosen) == k:
            break
        best = int(np.argmax(values))
        value = float(values[best])
        chosen.append(left.pop(best))
        known = known + told[chosen[-1]]
        if not left:
            break
    before = field.precision(site.landmarks)
    marks = list(site.landmarks)
    answers = []
    for number, index in zip(ids, chosen, strict=True):
        mark = Landmark(number, *places[index], kind)
        marks.append(mark)
        after = field.precision(marks)
        answers.append(Suggestion(mark, after.overall, after.mean_position, after.coverage))
    return Suggestions(
        tuple(answers),
        before,
        len(places),
        value - first,
        max(bound, value - first),
        _least_error(field, start, told, k, possible),
    )


def candidate_places(site: Site) -> list[Point]:
    """Places where a landmark would stand in nobody's way: along boundary, islands and walls.

    At most `MOST_PLACES`, evenly spread, on whole centimetres, away from the site's landmarks.
    """
    floor = site.floor()
    lines: list[tuple[shapely.Geometry, float]] = [
        (shapely.LinearRing(ring), _AT_EDGE) for ring in (site.boundary, *site.islands)
    ]
    lines += [(shapely.LineString(wall), _AT_WALL) for wall in site.walls]
    rims = [
        shapely.intersection(shapely.buffer(line, away, join_style="mitre").boundary, floor)
        for line, away in lines
    ]
    solid = shapely.union_all([shapely.buffer(line, 0.9 * away) for line, away in lines])
    free = shapely.difference(shapely.union_all(rims), solid)
    step = max(0.05, free.length / MOST_PLACES)
    taken = [mark.position for mark in site.landmarks]
    places: list[Point] = []
    for part in shapely.get_parts(free):
        number = math.floor(part.length / step)
        for along in (np.arange(number) + 0.5) * (part.length / max(number, 1)):
            point = part.interpolate(float(along))
            place = (round(point.x, 2), round(point.y, 2))
            if all(math.dist(place, other) >= _APART for other in taken):
                places.append(place)
    return places[:MOST_PLACES]


def _free_ids(site: Site, kind: LandmarkKind, k: int) -> list[int]:
    """Ids that are not on the site, those that are hard to mistake for another one first."""
    used = [mark.id for mark in site.landmarks]
    free = [number for number in id_set(kind.bits, 1) if number not in used]
    if len(free) < k:
        raise InputError(
            f"suggest is {k}: {kind.bits} bits have {len(free)} ids left on this site.",
            remedy="Use landmarks with more bits, or ask for fewer.",
        )
    chosen: list[int] = []
    for _ in range(k):
        same = [n for n in used if n < 2**kind.bits]
        best = max(free, key=lambda number: (min(spacing([*same, number], kind.bits), 2), -number))
        chosen.append(best)
        used.append(best)
        free.remove(best)
    return chosen


def _prior(field: PrecisionField) -> Floats:
    """I₀, as 6 x 1."""
    settings = field.sweep.fix
    place, turn = settings.max_position_sigma**-2, settings.max_heading_sigma**-2
    return np.array([place, 0.0, place, 0.0, 0.0, turn])[:, None]


def _value(information: Floats) -> Floats:
    """½ log det of symmetric 3 x 3 matrices; the six entries stand on the last axis but one."""
    xx, xy, yy, xh, yh, hh = (information[..., i, :] for i in range(6))
    result: Floats = 0.5 * np.log(
        xx * (yy * hh - yh * yh) + xy * (xh * yh - xy * hh) + xh * (xy * yh - xh * yy)
    )
    return result


def _least_error(
    field: PrecisionField, known: Floats, told: Floats, k: int, possible: Bools
) -> float:
    """A lower bound on ``overall`` with any ``k`` of the places.

    Of the information about the position along one direction, a stand has at most what it would
    have with its heading known and its own best k places; and the worst direction is no better
    than any other. With all places it knows no less than with k of them.
    """
    angles = np.arange(_BEARINGS) * (math.pi / _BEARINGS)
    most = np.full(known.shape[1], np.inf)
    for ux, uy in zip(np.cos(angles), np.sin(angles), strict=True):
        along = np.array([ux * ux, 2 * ux * uy, uy * uy])
        single = np.einsum("i,cim->cm", along, told[:, :3])
        top = np.partition(single, len(single) - k, axis=0)[-k:].sum(axis=0)
        most = np.minimum(most, along @ known[:3] + top)
    everything = known + told.sum(axis=0)
    xx, xy, yy, xh, yh, hh = everything
    turn = np.maximum(hh, 1e-12)
    a, b, d = xx - xh * xh / turn, xy - xh * yh / turn, yy - yh * yh / turn
    weakest = 0.5 * (a + d) - np.hypot(0.5 * (a - d), b)
    least = np.minimum(most, np.maximum(weakest, 0.0))
    limit = field.sweep.fix.max_position_sigma
    variance = np.minimum(1.0 / np.maximum(least, 1e-12), limit**2)
    laid = np.zeros(possible.shape)
    laid[possible] = variance
    number = possible.sum(axis=1)
    spots = laid.sum(axis=1)[number > 0] / number[number > 0]
    return float(np.average(np.sqrt(spots), weights=field.weights[number > 0]))
