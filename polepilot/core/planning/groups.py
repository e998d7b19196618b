"""The paper's groups A, B, C, D (Fig. 13): parts of the free space that only a narrow way joins.

Where the free space for the robot's centre is narrower than the tool, no second loop fits through:
there one group of nested loops ends and the next begins. Groups have letters, those that the path
gets to first, in its order; their loops have numbers, the outermost being 1.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import shapely
from shapely import LineString, Point, Polygon

from polepilot.core import geometry
from polepilot.core.plan import Plan
from polepilot.core.planning.space import as_multi, footprint, free_poles, polygons
from polepilot.core.site import Site

_SMALLEST = 0.01
"""A core smaller than this share of the tool's square is no group of its own."""
_MOST_LOOPS = 200


@dataclass(frozen=True, slots=True, eq=False)
class Group:
    """Nested loops that belong together; ``reached`` unless the robot cannot get there."""

    name: str
    """``A``, ``B``, ... ``Z``, ``AA``, ..."""
    region: Polygon
    """Of the free space for the robot's centre."""
    loops: tuple[shapely.Geometry, ...]
    """Where the loops A1, A2, ... run if they are as far apart as the tool is wide."""
    reached: bool

    def holds(self, point: geometry.Point) -> bool:
        return bool(self.region.distance(Point(point)) < 1e-3)


def groups_of(site: Site, plan: Plan) -> tuple[Group, ...]:
    """The groups of a scan's free space, those that are reached first."""
    things = [LineString(wall) for wall in site.walls]
    things += [Point(pole) for pole in free_poles(site)]
    free = polygons(footprint(plan.clearance).places(site.floor(), things))
    if not free:
        return ()
    start = Point(plan.path[0])
    home = min(free, key=lambda piece: float(piece.distance(start)))
    path = shapely.points(plan.path)
    mine = regions_of(home, plan.tool_width)
    mine.sort(key=lambda region: _first(region, path))
    others = [
        region
        for piece in free
        if piece is not home and piece.area > 1e-3
        for region in regions_of(piece, plan.tool_width)
    ]
    others.sort(key=lambda region: -float(region.area))
    return tuple(
        Group(_letters(index), region, _loops(region, plan.tool_width), index < len(mine))
        for index, region in enumerate([*mine, *others])
    )


def regions_of(piece: Polygon, tool: float) -> list[Polygon]:
    """The parts of a piece of free space between its narrow ways; itself where it has none.

    ``tool``: width of the tool, metres. What lies in a narrow way belongs to no part.
    """
    inner = piece.buffer(-tool / 2, join_style="mitre", mitre_limit=2.0)
    cores = [core for core in polygons(inner) if core.area > _SMALLEST * tool**2]
    if len(cores) < 2:
        return [piece]
    grown = [
        core.buffer(tool / 2 + 1e-4, join_style="mitre", mitre_limit=2.0).intersection(piece)
        for core in cores
    ]
    # Where two of them grow into the same narrow way, it belongs to neither.
    tree = shapely.STRtree(grown)
    apart: list[Polygon] = []
    for index, shape in enumerate(grown):
        others = [grown[other] for other in tree.query(shape) if other != index]
        parts = polygons(shape.difference(shapely.union_all(others)))
        apart.append(max(parts or polygons(shape), key=lambda part: float(part.area)))
    return apart


def _first(region: Polygon, path: shapely.Geometry) -> int:
    """The index of the first point of a path that is in a region."""
    inside = np.flatnonzero(shapely.distance(region, path) < 1e-3)
    return int(inside[0]) if len(inside) else len(path)


def _loops(region: Polygon, tool: float) -> tuple[shapely.Geometry, ...]:
    found: list[shapely.Geometry] = []
    inner = as_multi(region)
    while not inner.is_empty and len(found) < _MOST_LOOPS:
        found.append(inner.boundary)
        inner = as_multi(region.buffer(-tool * len(found), join_style="mitre", mitre_limit=2.0))
    return tuple(found)


def _letters(index: int) -> str:
    """0 is A, 25 is Z, 26 is AA."""
    name = ""
    index += 1
    while index:
        index, letter = divmod(index - 1, 26)
        name = chr(ord("A") + letter) + name
    return name
