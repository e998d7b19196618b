"""Tracking Route: by way of drawn nodes to a destination, around what stands between."""

from __future__ import annotations

import math
import time
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from shapely import MultiPolygon

from polepilot.core.errors import PlanError
from polepilot.core.geometry import Point, Pose2D
from polepilot.core.plan import Plan, PlanPart
from polepilot.core.planning.driver import Driver
from polepilot.core.planning.options import PlanOptions
from polepilot.core.planning.score import predict
from polepilot.core.planning.space import FreeSpace, free_space
from polepilot.core.planning.unreachable import unreachable_pieces
from polepilot.core.planning.wording import in_words, measured_in_words
from polepilot.core.site import Site
from polepilot.core.site_file import place


@np.errstate(invalid="ignore", divide="ignore")  # GEOS sets these flags for nothing
def plan_route(site: Site, route: str | Sequence[Point], options: PlanOptions) -> Plan:
    """The path from the start by way of the nodes of a named route, or of the given nodes.

    Straight between nodes where that is free, else the shortest way around, which ``notes`` say.
    The drive is judged by how near it passes to the nodes, not to the lines between them.

    Raises:
        SiteError: the site has no route of that name.
        PlanError: a node cannot be reached; the message names it.
    """
    began = time.perf_counter()
    name, nodes = _nodes(site, route)
    space = free_space(site, options)
    notes = [*site.repairs, *space.notes]
    _check_nodes(name, nodes, space)
    ways = _ways(name, nodes, space, notes)
    if options.min_turn_radius > 0:
        path, gear = _driven(name, ways, space, options)
    else:
        points = np.vstack([np.array(ways[0][:1]), *(np.array(way[1:]) for way in ways)])
        path = points[np.r_[True, np.hypot(*np.diff(points, axis=0).T) > 1e-6]]
        gear = np.ones(len(path) - 1, np.int8)
    if len(path) < 2:
        raise PlanError(f"route {name!r} ends where it starts: there is nothing to drive.")
    return Plan(
        mode="route",
        path=path,
        gear=gear,
        parts=(PlanPart("route", 0, len(path) - 1),),
        unreachable=unreachable_pieces(space, space.reachable()),
        predicted=predict(path, gear, MultiPolygon(), options),
        tool_width=options.tool_width,
        clearance=options.clearance,
        min_turn_radius=options.min_turn_radius,
        nodes=nodes,
        notes=tuple(notes),
        runtime=time.perf_counter() - began,
    )


def _nodes(site: Site, route: str | Sequence[Point]) -> tuple[str, tuple[Point, ...]]:
    if isinstance(route, str):
        return route, site.route(route).nodes
    nodes = tuple((float(x), float(y)) for x, y in route)
    if not nodes or not all(math.isfinite(value) for node in nodes for value in node):
        raise PlanError("a route needs at least one node with finite coordinates.")
    return "", nodes


def _check_nodes(name: str, nodes: tuple[Point, ...], space: FreeSpace) -> None:
    for index, node in enumerate(nodes):
        away = math.dist(node, space.nearest(node))
        if away <= 0.001:
            continue
        raise PlanError(
            f"node {index + 1} of route {name!r} at {place(node)} cannot be reached: the nearest "
            f"place that the robot gets to with a clearance of {in_words(space.clearance)} is "
            f"{measured_in_words(away)} away."
        )


def _ways(
    name: str, nodes: tuple[Point, ...], space: FreeSpace, notes: list[str]
) -> list[list[Point]]:
    """From the start to the first node, and from each node to the next."""
    ways: list[list[Point]] = []
    here = space.start.position
    for index, node in enumerate(nodes):
        there = space.nearest(node)
        way = space.shortest_path(here, there)
        if way is None:
            raise PlanError(
                f"node {index + 1} of route {name!r} at {place(node)} cannot be reached."
            )
        if len(way) > 2:
            origin = "the start" if index == 0 else f"node {index}"
            notes.append(
                f"The straight line from {origin} to node {index + 1} is not free; "
                f"the path goes around by {place(way[1])}."
            )
        ways.append(way)
        here = there
    return ways


def _driven(
    name: str, ways: list[list[Point]], space: FreeSpace, options: PlanOptions
) -> tuple[NDArray[np.float64], NDArray[np.int8]]:
    """The whole way with curves that a steered wheel can take.

    From each node the wheel is turned until the robot looks at the next one, then straight on
    (paper, Tracking Route); with changes of gear where that is shorter or does not fit.
    """
    start = space.start
    heading = start.heading
    if heading is None:
        aim = next((p for way in ways for p in way if math.dist(p, start.position) > 1e-6), None)
        aim = aim or start.position
        heading = math.atan2(aim[1] - start.y, aim[0] - start.x)
    driver = Driver(space, options.min_turn_radius, Pose2D(start.x, start.y, heading))
    for index, way in enumerate(ways):
        for goal in way[1:]:
            if not driver.head_for(goal) and not driver.head_for(way[-1]):
                raise PlanError(
                    f"the drive to node {index + 1} of route {name!r} at {place(way[-1])} is not "
                    f"possible with a turning radius of {in_words(options.min_turn_radius)}."
                )
    return driver.track.arrays()
