"""Tracking Route: by way of drawn nodes to a destination, around what stands between."""

from __future__ import annotations

import math
import time
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import shapely
from numpy.typing import NDArray
from shapely import LineString, Polygon

from polepilot.core.errors import PlanError
from polepilot.core.geometry import Point, Pose2D
from polepilot.core.plan import Plan, PlanPart
from polepilot.core.planning.corners import with_few_corners
from polepilot.core.planning.crumbs import without_crumbs
from polepilot.core.planning.curves import CHANGE
from polepilot.core.planning.driver import Driver
from polepilot.core.planning.options import PlanOptions
from polepilot.core.planning.score import predict
from polepilot.core.planning.space import FreeSpace, free_poles, free_space
from polepilot.core.planning.track import without_jerks
from polepilot.core.planning.unreachable import unreachable_pieces
from polepilot.core.planning.wording import in_words, measured_in_words
from polepilot.core.site import Site
from polepilot.core.site_file import place

_RUN_UP = (0.5, 0.3, 0.2, 0.1, 0.05)
"""Straight pieces before a last node with a heading, of which the longest that fits is taken, m."""


@dataclass(frozen=True, slots=True)
class _Wanted:
    """What is to be driven: nodes in order, and how to stand at the last one."""

    name: str
    nodes: tuple[Point, ...]
    heading: float | None

    def node(self, index: int) -> str:
        """How messages call a node."""
        of = f" of route {self.name!r}" if self.name else ""
        return f"node {index + 1}{of} at {place(self.nodes[index])}"


@np.errstate(invalid="ignore", divide="ignore")  # GEOS sets these flags for nothing
def plan_route(
    site: Site,
    route: str | Sequence[Point],
    options: PlanOptions,
    end_heading: float | None = None,
) -> Plan:
    """The path from the start by way of the nodes of a named route, or of the given nodes.

    Straight between nodes where that is free, else the shortest way around, which ``notes`` say.
    The drive is judged by how near it passes to the nodes, not to the lines between them.

    Args:
        site: the map.
        route: name of one of its routes, or places in `map`.
        options: clearance, turning radius, start, speeds.
        end_heading: how to stand at the last node, radians in `map`; None: as the route says.

    Raises:
        SiteError: the site has no route of that name.
        PlanError: a node cannot be reached, or not with that heading; the message names it.
    """
    began = time.perf_counter()
    wanted = _wanted(site, route, end_heading)
    space = free_space(site, options)
    notes = [*site.repairs, *space.notes]
    _check_nodes(wanted, site, space)
    ways = _ways(wanted, site, space, notes)
    if options.min_turn_radius > 0:
        path, gear = _driven(wanted, ways, space, options, notes)
    else:
        path = _plain(wanted, ways, space)
        gear = np.ones(len(path) - 1, np.int8)
    if len(path) < 2:
        raise PlanError(f"route {wanted.name!r} ends where it starts: there is nothing to drive.")
    return Plan(
        mode="route",
        path=path,
        gear=gear,
        parts=(PlanPart("route", 0, len(path) - 1),),
        unreachable=unreachable_pieces(space, space.reachable()),
        predicted=predict(path, gear, options),
        tool_width=options.tool_width,
        clearance=options.clearance,
        min_turn_radius=options.min_turn_radius,
        nodes=wanted.nodes,
        notes=tuple(notes),
        runtime=time.perf_counter() - began,
    )


def _wanted(site: Site, route: str | Sequence[Point], end_heading: float | None) -> _Wanted:
    if end_heading is not None and not math.isfinite(end_heading):
        raise PlanError("the heading at the last node is not finite: expected radians.")
    if isinstance(route, str):
        drawn = site.route(route)
        heading = drawn.heading if end_heading is None else end_heading
        return _Wanted(route, drawn.nodes, heading)
    nodes = tuple((float(x), float(y)) for x, y in route)
    if not nodes or not all(math.isfinite(value) for node in nodes for value in node):
        raise PlanError("a route needs at least one node with finite coordinates.")
    return _Wanted("", nodes, end_heading)


def _check_nodes(wanted: _Wanted, site: Site, space: FreeSpace) -> None:
    """Refuses nodes that the robot's disc cannot stand at, with the reason."""
    for index, node in enumerate(wanted.nodes):
        away = math.dist(node, space.nearest(node))
        if away <= 0.001:
            continue
        where = "; it lies " + _lies(site, node) if _lies(site, node) else ""
        raise PlanError(
            f"{wanted.node(index)} cannot be reached{where}: the nearest place that the robot gets "
            f"to with a clearance of {in_words(space.clearance)} is {measured_in_words(away)} away."
        )


def _lies(site: Site, node: Point) -> str:
    """Where no robot can be whatever its size, in words; empty for places on the floor."""
    if not shapely.intersects_xy(Polygon(site.boundary), *node):
        return "outside the boundary"
    for rings, what in ((site.islands, "in island"), (site.no_go, "in no-go area")):
        for index, ring in enumerate(rings):
            if shapely.intersects_xy(Polygon(ring), *node):
                return f"{what} {index + 1}"
    return ""


def _ways(wanted: _Wanted, site: Site, space: FreeSpace, notes: list[str]) -> list[list[Point]]:
    """From the start to the first node, and from each node to the next."""
    ways: list[list[Point]] = []
    here = space.start.position
    for index, node in enumerate(wanted.nodes):
        there = space.nearest(node)
        way = space.shortest_path(here, there)
        if way is None:
            raise PlanError(f"{wanted.node(index)} cannot be reached.")
        if len(way) > 2:
            origin = "the start" if index == 0 else f"node {index}"
            what = _in_the_way(site, here, there, space.clearance)
            notes.append(
                f"The straight line from {origin} to node {index + 1} is not free ({what}); the "
                f"path goes around by {place(way[1])} and is {_length(way):.1f} m long instead of "
                f"{math.dist(here, there):.1f} m."
            )
        ways.append(way)
        here = there
    return ways


def _in_the_way(site: Site, here: Point, there: Point, clearance: float) -> str:
    """The first thing that a disc driven straight over would touch, in words."""
    line = LineString([here, there])
    things: list[tuple[str, shapely.Geometry]] = [
        ("the boundary", LineString([*site.boundary, site.boundary[0]]))
    ]
    things += [(f"island {i + 1}", Polygon(ring)) for i, ring in enumerate(site.islands)]
    things += [(f"wall {i + 1}", LineString(wall)) for i, wall in enumerate(site.walls)]
    things += [(f"no-go area {i + 1}", Polygon(ring)) for i, ring in enumerate(site.no_go)]
    things += [("a landmark", shapely.Point(pole)) for pole in free_poles(site)]
    disc = line.buffer(clearance)
    met = [
        (line.project(shapely.shortest_line(line, thing.intersection(disc)).interpolate(0)), name)
        for name, thing in things
        if thing.distance(line) < clearance
    ]
    return min(met)[1] if met else "too narrow"


def _length(way: Sequence[Point]) -> float:
    return float(np.hypot(*np.diff(np.array(way), axis=0).T).sum())


def _plain(wanted: _Wanted, ways: list[list[Point]], space: FreeSpace) -> NDArray[np.float64]:
    """Corners as sharp as they come; a heading asked for is that of the last, straight piece."""
    if wanted.heading is not None:
        *_, goal = ways[-1]
        before = next(
            (
                spot
                for length in _RUN_UP
                if space.holds(
                    LineString(
                        [spot := Pose2D(*goal, wanted.heading).ahead(-length), goal],
                    )
                )
            ),
            None,
        )
        way = None if before is None else space.shortest_path(ways[-1][0], before)
        if before is None or way is None:
            raise PlanError(
                f"{wanted.node(len(wanted.nodes) - 1)} cannot be driven to with a heading of "
                f"{math.degrees(wanted.heading):.0f}°: there is no room before it."
            )
        ways = [*ways[:-1], [*way, goal]]
    points = np.vstack([np.array(ways[0][:1]), *(np.array(way[1:]) for way in ways)])
    steps: NDArray[np.float64] = np.hypot(*np.diff(points, axis=0).T)
    return points[np.r_[True, steps > 1e-6]]


def _driven(
    wanted: _Wanted,
    ways: list[list[Point]],
    space: FreeSpace,
    options: PlanOptions,
    notes: list[str],
) -> tuple[NDArray[np.float64], NDArray[np.int8]]:
    """The whole way with curves that a steered wheel can take.

    From each node the wheel is turned until the robot looks at the next one, then straight on
    (paper, Tracking Route); with changes of gear where that is shorter or does not fit.
    """
    few = [with_few_corners(way, space) for way in ways]
    found: list[tuple[Driver, list[int]]] = []
    for tried in (few, ways) if few != ways else (ways,):
        try:
            found.append(_tracked(wanted, tried, space, options))
        except PlanError:
            if tried is ways and not found:
                raise
    driver, ends = min(found, key=lambda way: _cost(way[0]))
    path, gears, moved = without_jerks(*driver.track.arrays())
    path, gears, there = without_crumbs(path, gears, space)
    counts = [np.count_nonzero(np.diff(gears[: there[moved[end]]])) for end in ends]
    for index, changes in enumerate(np.diff(counts).tolist()):
        if changes:
            times = "once" if changes == 1 else f"{changes} times"
            notes.append(
                f"On the way to node {index + 1} the robot changes its gear {times}: its turning "
                f"radius of {in_words(options.min_turn_radius)} asks for it."
            )
    return path, gears


def _cost(driver: Driver) -> float:
    """How long a drive is, with what its changes of gear cost, metres."""
    path, gears = driver.track.arrays()
    length = float(np.hypot(*np.diff(path, axis=0).T).sum())
    return length + CHANGE * np.count_nonzero(np.diff(gears))


def _tracked(
    wanted: _Wanted, ways: list[list[Point]], space: FreeSpace, options: PlanOptions
) -> tuple[Driver, list[int]]:
    """Drives along ways; also at which points of the track the nodes are.

    Raises:
        PlanError: one of the nodes cannot be driven to.
    """
    driver = Driver(
        space, options.min_turn_radius, Pose2D(*space.start.position, _first_heading(ways, space))
    )
    ends = [0]
    for index, way in enumerate(ways):
        heading = wanted.heading if index == len(ways) - 1 else None
        for goal in way[1:-1] if heading is not None else way[1:]:
            if not driver.head_for(goal) and not driver.head_for(way[-1]):
                raise _impossible(wanted, index, options)
        if heading is not None and not driver.connect(way[-1], heading):
            raise _impossible(wanted, index, options)
        ends.append(driver.track.last)
    return driver, ends


def _impossible(wanted: _Wanted, index: int, options: PlanOptions) -> PlanError:
    last = wanted.heading is not None and index == len(wanted.nodes) - 1
    heading = f" and a heading of {math.degrees(wanted.heading or 0):.0f}°" if last else ""
    return PlanError(
        f"the drive to {wanted.node(index)} is not possible with a turning radius of "
        f"{in_words(options.min_turn_radius)}{heading}."
    )


def _first_heading(ways: list[list[Point]], space: FreeSpace) -> float:
    """The start's; where it has none, towards the first place that is somewhere else."""
    start = space.start
    if start.heading is not None:
        return start.heading
    aim = next(
        (spot for way in ways for spot in way if math.dist(spot, start.position) > 1e-6),
        start.position,
    )
    return math.atan2(aim[1] - start.y, aim[0] - start.x)
