"""Plans judged from their JSON alone, by geometry that shares nothing with the planner.

What is judged: ``plan --json`` of a site, both as documents. See ``Verdict`` for what is found.
"""

from __future__ import annotations

import math
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np
import shapely
from numpy.typing import NDArray
from plans.bound import least_ratio
from shapely import Polygon

Array = NDArray[np.float64]
Document = dict[str, Any]

_ROUND = 64
"""Segments per quarter turn of discs; at 0.2 m they are 0.015 mm inside."""
_CONTACT = 1e-5
"""Nearer to a wall than the clearance by more than this is a contact, m."""
_SHORTEST = 0.01
"""Steps below this are joined before curvature is looked at: coordinates have four digits, m."""
_LONGEST = 0.2
"""A step counts no longer than this: two long legs make a corner, not a wide curve, m.
At a change of gear half of it, as the robot stands there."""
_CHORD = 0.15
"""Or no longer than this share of the turning radius: wide curves are written with long chords."""
_PLAY = 0.02
"""Turns below this come from the digits, rad."""
_SMALLEST = 0.05
"""Unreachable pieces below this may be left out, m²."""
_TILE = 5.0


@dataclass(frozen=True, slots=True)
class Verdict:
    """One plan on one map."""

    map: str
    area: float
    """What the robot's disc can reach from where the path begins, m²."""
    coverage: float
    """Share of it under the tool's disc, percent: one capsule per segment, united."""
    missed: float
    """The rest, m²."""
    length: float
    ratio: float
    """Length over area / tool width."""
    bound: float
    """The least ratio that the widths of corridors allow, 1 at least; see ``plans.bound``."""
    over: float
    """The ratio over that bound."""
    contacts: int
    """Segments on which the disc touches a wall."""
    nearest: float
    """The least distance of the path to a wall, m."""
    corners: int
    """Places sharper than the turning radius allows, changes of gear apart."""
    crooked: int
    """Changes of gear at which the heading jumps."""
    sharpest: float
    """The smallest turning radius that the path asks for, m; infinite for straight ones."""
    reversals: int
    unreachable: float
    """Agreement with what the disc leaves of the floor, percent: common over united area."""
    predicted: float
    """Predicted minus found coverage, percentage points."""
    seconds: float
    """What the plan says that it took."""
    parts: bool
    """Whether the parts follow each other without a gap."""
    begins: float
    """From the wanted start to where the path begins, m."""

    def to_json(self) -> Document:
        row = asdict(self)
        return {
            key: (None if value == math.inf else round(value, 5))
            if isinstance(value, float)
            else value
            for key, value in row.items()
        }


@dataclass(frozen=True, slots=True)
class Ground:
    """A site as a robot of some size finds it."""

    floor: shapely.Geometry
    walls: shapely.Geometry
    """Everything that the disc must not touch: outline, islands, walls, no-go areas."""
    free: Polygon
    """Where the centre may be, the part with the start."""
    reachable: shapely.Geometry


def ground(site: Document, start: tuple[float, float], clearance: float) -> Ground:
    """The part of a site that a disc of radius ``clearance`` gets to from ``start``."""
    closed = [Polygon(ring) for ring in (*site.get("islands", ()), *site.get("no_go", ()))]
    floor = shapely.make_valid(Polygon(site["boundary"])).difference(shapely.union_all(closed))
    lines = [shapely.LineString(line) for line in site.get("walls", ())]
    free = floor.buffer(-clearance, quad_segs=_ROUND)
    if lines:
        free = free.difference(
            shapely.union_all(shapely.buffer(lines, clearance, quad_segs=_ROUND))
        )
    pieces = [part for part in shapely.get_parts(free).tolist() if part.area > 1e-7]
    home = min(pieces, key=lambda part: part.distance(shapely.Point(start)))
    reachable = _around(home, clearance)
    walls = shapely.union_all([shapely.boundary(floor), *lines])
    return Ground(floor, walls, home, reachable.intersection(floor))


def _around(home: Polygon, radius: float) -> shapely.Geometry:
    """What a disc takes up whose middle goes everywhere in ``home``: one capsule per side, united.

    A buffer of all at once may fill what lies between two walls.
    """
    sides = [edge for rim in shapely.get_parts(home.boundary) for edge in _segments(rim)]
    return shapely.union_all([home, *shapely.buffer(sides, radius, quad_segs=_ROUND)])


def judge(
    name: str, site: Document, plan: Document, tool: float, clearance: float, radius: float
) -> Verdict:
    """What a plan is worth.

    Args:
        name: of the map.
        site: SITE.json, as it was given to the planner.
        plan: what ``plan --json`` printed.
        tool, clearance, radius: width of the tool, clearance, turning radius, m.
    """
    path = np.array(plan["path"], float)
    gear = np.array(plan["gear"], int)
    begin = (float(path[0, 0]), float(path[0, 1]))
    here = ground(site, begin, clearance)
    area = float(here.reachable.area)
    left = uncovered(path, here.reachable, tool)
    length = float(np.hypot(*np.diff(path, axis=0).T).sum())
    ratio = length / (area / tool)
    bound = least_ratio(here.free, here.reachable, here.walls, tool, clearance)
    near, contacts = clearances(path, here, clearance)
    corners, crooked, sharpest = corners_of(path, gear, radius)
    start = site.get("start") or begin
    ends = [0, *(part["last"] for part in plan["parts"])]
    whole = [part["first"] for part in plan["parts"]] == ends[:-1] and ends[-1] == len(path) - 1
    covered = 100 * (1 - left / area)
    return Verdict(
        map=name,
        area=area,
        coverage=covered,
        missed=left,
        length=length,
        ratio=ratio,
        bound=bound,
        over=ratio / bound,
        contacts=contacts,
        nearest=near,
        corners=corners if radius > 0 else 0,
        crooked=crooked if radius > 0 else 0,
        sharpest=sharpest,
        reversals=int(np.count_nonzero(np.diff(gear))),
        unreachable=100 * agreement(here, plan["unreachable"]),
        predicted=100 * plan["predicted"]["coverage"] - covered,
        seconds=float(plan["runtime"]),
        parts=whole,
        begins=math.dist(start[:2], begin),
    )


def uncovered(path: Array, area: shapely.Geometry, tool: float) -> float:
    """What of ``area`` a disc of diameter ``tool`` leaves along the path, m².

    A capsule per segment, united tile by tile: exact, and linear in the size of the map.
    """
    steps = path[np.r_[True, np.hypot(*np.diff(path, axis=0).T) > 1e-9]]
    lines = shapely.linestrings(np.stack([steps[:-1], steps[1:]], axis=1))
    capsules = shapely.buffer(lines, tool / 2, quad_segs=_ROUND // 2)
    tree = shapely.STRtree(capsules)
    x0, y0, x1, y1 = area.bounds
    left = 0.0
    for x in np.arange(x0, x1, _TILE):
        for y in np.arange(y0, y1, _TILE):
            tile = shapely.box(x, y, x + _TILE, y + _TILE)
            piece = shapely.intersection(area, tile)
            if piece.area > 0:
                near = capsules[tree.query(tile, predicate="intersects")]
                near = shapely.intersection(near, tile.buffer(0.01))
                left += float(piece.difference(shapely.union_all(near)).area)
    return left


def clearances(path: Array, here: Ground, clearance: float) -> tuple[float, int]:
    """The least distance of the path to walls (negative outside), and on how many segments the
    disc touches one."""
    lines = shapely.linestrings(np.stack([path[:-1], path[1:]], axis=1))
    walls = here.walls
    edges = np.array([e for part in shapely.get_parts(walls) for e in _segments(part)])
    tree = shapely.STRtree(edges)
    pairs, distances = tree.query_nearest(lines, return_distance=True, all_matches=False)
    nearest = np.full(len(lines), np.inf)
    nearest[pairs[0]] = distances
    shapely.prepare(here.floor)
    inside = shapely.intersects_xy(here.floor, path[:, 0], path[:, 1])
    nearest[~(inside[:-1] & inside[1:])] = -1.0
    return float(nearest.min()), int(np.count_nonzero(nearest < clearance - _CONTACT))


def _segments(line: shapely.Geometry) -> list[shapely.Geometry]:
    points = shapely.get_coordinates(line)
    return list(shapely.linestrings(np.stack([points[:-1], points[1:]], axis=1)))


def corners_of(path: Array, gear: NDArray[np.int_], radius: float) -> tuple[int, int, float]:
    """Places sharper than ``radius``, gear changes with a jump of heading, the smallest radius.

    The robot's heading is that of each segment (turned round in reverse). Where it turns by t
    between legs a and b, a wheel on a circle needs the radius (a + b) / 2 t.
    """
    path, gear = _joined(path, gear)
    moves = np.diff(path, axis=0)
    lengths = np.hypot(*moves.T)
    headings = np.arctan2(moves[:, 1] * gear, moves[:, 0] * gear)
    turns = np.abs((np.diff(headings) + math.pi) % math.tau - math.pi)
    changes = np.diff(gear) != 0
    longest = max(_LONGEST, _CHORD * radius) * np.where(changes, 0.5, 1.0)
    mean = (np.minimum(lengths[:-1], longest) + np.minimum(lengths[1:], longest)) / 2
    asked = mean / np.maximum(turns - _PLAY, 1e-12)
    sharp = asked < 0.98 * radius
    along = asked[~changes]
    smallest = float(along.min()) if len(along) else math.inf
    return (
        int(np.count_nonzero(sharp & ~changes)),
        int(np.count_nonzero(sharp & changes)),
        math.inf if smallest > 1e6 else smallest,
    )


def _joined(path: Array, gear: NDArray[np.int_]) -> tuple[Array, NDArray[np.int_]]:
    """The path without steps below ``_SHORTEST``; ends and changes of gear stay."""
    kept = [0]
    for index in range(1, len(path) - 1):
        change = gear[index - 1] != gear[index]
        if not change and math.dist(path[index], path[kept[-1]]) < _SHORTEST:
            continue
        if change:
            while (
                len(kept) > 1
                and math.dist(path[index], path[kept[-1]]) < _SHORTEST
                and gear[kept[-1] - 1] == gear[kept[-1]]
            ):
                kept.pop()
        kept.append(index)
    kept.append(len(path) - 1)
    return path[kept], gear[kept[:-1]]


def agreement(here: Ground, pieces: list[Document]) -> float:
    """How far polygons of unreachable floor agree with what the disc leaves, 0 to 1.

    Common over united area; pieces below 0.05 m² count neither when they are left out nor when
    they are named. 1 where there is nothing to name and nothing is named.
    """
    rest = here.floor.difference(here.reachable)
    # Corners hang together along walls by less than a hair.
    parts = shapely.get_parts(rest.buffer(-1e-4).buffer(1e-4, join_style="mitre"))
    large = shapely.union_all([part for part in parts.tolist() if part.area >= _SMALLEST])
    named = shapely.union_all([shapely.make_valid(Polygon(p["polygon"])) for p in pieces])
    missing = large.difference(named).area
    extra = named.difference(rest).area
    united = large.union(named.difference(rest)).area
    return float(1 - (missing + extra) / united) if united > 0 else 1.0
