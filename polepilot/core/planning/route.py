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
from polepilot.core.planning.drivable import Driver
from polepilot.core.planning.options import PlanOptions
from polepilot.core.planning.score import predict
from polepilot.core.planning.space import FreeSpace, free_space
from polepilot.core.planning.unreachable import unreachable_pieces
from polepilot.core.site import Site
from polepilot.core.site_file import place

NEAR = 0.03
"""How near to a node its corner is rounded, metres."""


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
            f"place that the robot gets to with a clearance of {space.clearance:g} m is "
            f"{away:.2f} m away."
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
    """The whole way with corners that a steered wheel can take."""
    line = np.vstack([np.array(ways[0][:1]), *(np.array(way[1:]) for way in ways)])
    line = line[np.r_[True, np.hypot(*np.diff(line, axis=0).T) > 1e-6]]
    if len(line) < 2:
        raise PlanError(f"route {name!r} ends where it starts: there is nothing to drive.")
    first = line[1] - line[0]
    ahead = math.atan2(first[1], first[0])
    start = space.start
    heading = ahead if start.heading is None else start.heading
    driver = Driver(space, options.min_turn_radius, Pose2D(start.x, start.y, heading))
    if not driver.begin(line, NEAR):
        # The first leg cannot be reached in its own direction: node by node, any heading.
        for index, way in enumerate(ways):
            if not driver.connect(way[-1], None):
                raise PlanError(
                    f"the drive to node {index + 1} of route {name!r} is not possible with a "
                    f"turning radius of {options.min_turn_radius:g} m."
                )
        return driver.track.arrays()
    path, gear = driver.track.arrays()
    for index, way in enumerate(ways):
        node = np.array(way[-1])
        if _distance(path, node) > 0.10:
            raise PlanError(
                f"the drive to node {index + 1} of route {name!r} is not possible with a "
                f"turning radius of {options.min_turn_radius:g} m."
            )
    return path, gear


def _distance(path: NDArray[np.float64], node: NDArray[np.float64]) -> float:
    """From a point to a polyline."""
    a, step = path[:-1], np.diff(path, axis=0)
    squared = np.maximum((step**2).sum(axis=1), 1e-12)
    along = np.clip(((node - a) * step).sum(axis=1) / squared, 0.0, 1.0)
    return float(np.hypot(*(a + along[:, None] * step - node).T).min())
