"""An independent look at plans: geometry from first principles, nothing of the planner's."""

from __future__ import annotations

import math

import numpy as np
import shapely
from shapely import LineString, Polygon

from polepilot.core.plan import Plan
from polepilot.core.site import Site


def clearance_of(plan: Plan, site: Site) -> float:
    """The least distance of the path to boundary, islands and walls; negative outside."""
    path = LineString(plan.path)
    room = Polygon(site.boundary)
    if not room.buffer(1e-6).covers(path):
        return -1.0
    if any(Polygon(ring).intersects(path) for ring in (*site.islands, *site.no_go)):
        return -1.0
    return float(path.distance(site.obstacles()))


def reachable(site: Site, start: tuple[float, float], clearance: float) -> shapely.Geometry:
    """The union of clearance discs with centres in the free component nearest to ``start``."""
    free = (
        Polygon(site.boundary)
        .difference(shapely.union_all([Polygon(r) for r in site.islands]))
        .buffer(-clearance, quad_segs=32)
    )
    if site.walls:
        walls = shapely.union_all([LineString(w) for w in site.walls])
        free = free.difference(walls.buffer(clearance, quad_segs=32))
    parts = list(getattr(free, "geoms", [free]))
    home = min(parts, key=lambda part: part.distance(shapely.Point(start)))
    rims = [shapely.get_coordinates(rim) for rim in shapely.get_parts(home.boundary)]
    sides = [LineString(pair) for rim in rims for pair in np.stack([rim[:-1], rim[1:]], axis=1)]
    return shapely.union_all([home, *shapely.buffer(sides, clearance, quad_segs=32)])


def coverage(plan: Plan, site: Site) -> float:
    """Share of the reachable area under the tool's discs, one capsule per segment."""
    area = reachable(site, tuple(plan.path[0]), plan.clearance)
    capsules = [
        LineString(pair).buffer(plan.tool_width / 2, quad_segs=16)
        for pair in np.stack([plan.path[:-1], plan.path[1:]], axis=1)
    ]
    return float(area.intersection(shapely.union_all(capsules)).area / area.area)


def sharpest(plan: Plan) -> float:
    """The smallest radius of a circle through three neighbouring points within one gear, metres.

    At a corner between legs a and b with turn t the wheel needs the radius that fits: the mean leg
    over t. Infinity for a straight path.
    """
    smallest = math.inf
    moves = np.diff(plan.path, axis=0)
    lengths = np.hypot(*moves.T)
    for index in range(len(moves) - 1):
        if plan.gear[index] != plan.gear[index + 1]:
            # The robot stands: its heading must be the same, so the line turns right back.
            turn = _turn(moves[index], -moves[index + 1])
            if lengths[index] > 1e-6 and lengths[index + 1] > 1e-6 and turn > math.radians(6):
                return 0.0
            continue
        turn = _turn(moves[index], moves[index + 1])
        if turn > 1e-4:
            smallest = min(smallest, (lengths[index] + lengths[index + 1]) / 2 / turn)
    return smallest


def _turn(a: np.ndarray, b: np.ndarray) -> float:
    return abs(math.atan2(a[0] * b[1] - a[1] * b[0], float(a @ b)))
