"""Where the robot's centre may be, what its disc can reach from the start, and what it cannot."""

from __future__ import annotations

import heapq
import math
from dataclasses import dataclass, field

import numpy as np
import shapely
from numpy.typing import NDArray
from shapely import LineString, MultiPolygon, Point, Polygon

from polepilot.core import geometry
from polepilot.core.errors import PlanError
from polepilot.core.planning.footprint import Footprint
from polepilot.core.planning.options import PlanOptions
from polepilot.core.planning.wording import in_words, measured_in_words
from polepilot.core.site import Site, Start
from polepilot.core.site_file import place

CHORD = 0.00005
"""How far the chords of a rounded outline are inside of it, at most, m."""
SLACK = 0.00002
"""How far outside the free space a line may seem to be through rounding, m."""
MARGIN = CHORD + SLACK + 0.00008
"""How much farther than the clearance the path stays away, so that it keeps it in spite of those
and of the digits in which it is written, m."""
_TOLERANCES = (0.005, 0.02, 0.05, 0.1, 0.2)
"""How exactly corners are taken when a way is looked for, m."""
_MOST_CORNERS = 400
_SQUARE = 0.03
_MOST_SQUARES = 1_000_000
"""Side of the squares in which points are looked up, m; it is longer where there would be more."""
_GLANCES = np.arange(1, 17) / 17
"""Where on a line of sight points are looked at first."""
STRIDE = 4
"""Of the points of curves every so-manieth is looked at first."""
_FEW = 8
"""Fewer points than this are looked at one by one."""
_RIM, _UNKNOWN, _INSIDE, _OUTSIDE = range(4)
"""What is known of such a square."""
_AROUND = np.array([-1, 0, 1])
POLE_GAP = 0.01
"""A pole whose surface is farther than this from everything stands free, m."""


@dataclass(slots=True, eq=False)
class _Graph:
    """Corners around which shortest paths bend, and what was seen from them so far."""

    tolerance: float
    """How exactly the corners are taken, m; 0: those of the free space itself."""
    nodes: NDArray[np.float64]
    """N x 2."""
    arms: NDArray[np.float64]
    """N x 2 x 2: from each corner along its two sides."""
    seen: dict[int, tuple[NDArray[np.intp], NDArray[np.float64]]] = field(default_factory=dict)


class _Squares:
    """Which points a shape holds, square by square: only of those through which its outline runs
    each point is looked at, of the others the first."""

    def __init__(self, shape: shapely.Geometry) -> None:
        x0, y0, x1, y1 = shape.bounds
        self._shape = shape
        self._side = side = max(_SQUARE, math.sqrt((x1 - x0) * (y1 - y0) / _MOST_SQUARES))
        self._x, self._y = x0 - 2 * side, y0 - 2 * side
        self._columns, self._rows = (math.ceil(size / side) + 4 for size in (x1 - x0, y1 - y0))
        self._state = np.full(self._columns * self._rows, _UNKNOWN, np.int8)
        rim = shapely.get_coordinates(shapely.segmentize(shape.boundary, side / 2))
        near = self._numbers(rim)[:, None] + _AROUND + self._rows * _AROUND[:, None, None]
        self._state[near] = _RIM

    def _numbers(self, points: NDArray[np.float64]) -> NDArray[np.intp]:
        """In which squares points are; those beside all of them are in one at the border."""
        x = (points[:, 0] - self._x) / self._side
        y = (points[:, 1] - self._y) / self._side
        column = np.minimum(np.maximum(x, 0.0), self._columns - 1).astype(np.intp)
        row = np.minimum(np.maximum(y, 0.0), self._rows - 1).astype(np.intp)
        return np.asarray(column * self._rows + row)

    def hold(self, points: NDArray[np.float64]) -> NDArray[np.bool_]:
        """Which of N x 2 points are in the shape."""
        numbers = self._numbers(points)
        state = self._state[numbers]
        inside = state == _INSIDE
        ask = np.flatnonzero(state <= _UNKNOWN)
        if len(ask):
            inside[ask] = shapely.intersects_xy(self._shape, points[ask, 0], points[ask, 1])
            new = ask[state[ask] == _UNKNOWN]
            self._state[numbers[new]] = np.where(inside[new], _INSIDE, _OUTSIDE)
        return np.asarray(inside)


@dataclass(slots=True, eq=False)
class FreeSpace:
    """The free space for the robot's centre that is connected to the start."""

    floor: MultiPolygon
    """The floor itself: boundary without islands."""
    lines: shapely.Geometry
    """Free-standing walls."""
    polygon: Polygon
    """Where the centre may be: one piece, with the start."""
    others: tuple[Polygon, ...]
    """Where the centre might be as well if it could get there."""
    clearance: float
    start: Start
    """Inside ``polygon``."""
    anywhere: bool = False
    """Whether nobody has said where to start."""
    notes: list[str] = field(default_factory=list)
    _loose: Polygon = field(init=False)
    _squares: _Squares | None = field(init=False)
    """Made when many points are asked for the first time."""
    _graphs: list[_Graph] = field(init=False, default_factory=list)
    """Coarse ones first; each is made when the one before it knows no way."""

    def __post_init__(self) -> None:
        self._loose = self.polygon.buffer(SLACK, join_style="mitre")
        shapely.prepare(self._loose)
        self._squares = None

    def holds(self, line: shapely.Geometry) -> bool:
        """Whether the centre may move along all of ``line``."""
        return bool(shapely.covers(self._loose, line))

    def holds_points(self, points: NDArray[np.float64]) -> bool:
        """Whether the centre may move along the line through N x 2 ``points``."""
        if not self.holds_each(points).all():
            return False
        return len(points) < 2 or self.holds(LineString(points))

    def holds_each(self, points: NDArray[np.float64]) -> NDArray[np.bool_]:
        """Whether the centre may be at each of N x 2 ``points``."""
        if self._squares is None:
            if len(points) < _FEW:
                return np.asarray(shapely.intersects_xy(self._loose, points[:, 0], points[:, 1]))
            self._squares = _Squares(self._loose)
        return self._squares.hold(points)

    def holds_rows(self, points: NDArray[np.float64]) -> NDArray[np.bool_]:
        """Whether the centre may be at all points of each row of N x M x 2 ``points``."""
        rows = np.arange(len(points))
        for some in (points[:, ::STRIDE], points):  # a few of them rule most rows out
            free = self.holds_each(some[rows].reshape(-1, 2)).reshape(len(rows), some.shape[1])
            rows = rows[free.all(axis=1)]
        found = np.zeros(len(points), dtype=bool)
        found[rows] = True
        return found

    def reachable(self) -> MultiPolygon:
        """The union of the clearance discs whose centres are in ``polygon``."""
        return as_multi(footprint(self.clearance).ground(self.polygon))

    def nearest(self, point: geometry.Point) -> geometry.Point:
        """The place of the free space nearest to ``point``."""
        if shapely.intersects_xy(self.polygon, *point):
            return point
        line = shapely.shortest_line(self.polygon, Point(point))
        return (float(line.coords[0][0]), float(line.coords[0][1]))

    def shortest_path(self, a: geometry.Point, b: geometry.Point) -> list[geometry.Point] | None:
        """The shortest line from ``a`` to ``b`` inside the free space; None where there is none.

        A* on the visibility graph of the corners around which a shortest path can bend; what a
        corner sees is computed when it is first needed and kept.
        """
        if self.holds(LineString([a, b])):
            return [a, b]
        # Coarse corners lie a little inside, which closes the narrowest necks.
        level = 0
        while True:
            if level == len(self._graphs):
                before = self._graphs[-1].tolerance if self._graphs else math.inf
                if before == 0:
                    return None
                self._graphs.append(self._graph(before))
            way = self._search(a, b, self._graphs[level])
            if way is not None:
                return way
            level += 1

    def _search(
        self, a: geometry.Point, b: geometry.Point, graph: _Graph
    ) -> list[geometry.Point] | None:
        """A* from ``a`` to ``b`` over the corners."""
        nodes = graph.nodes
        count = len(nodes)
        points = np.vstack([nodes, [a], [b]])
        goal = count + 1
        to_goal = np.hypot(*(points - points[goal]).T)
        sees_goal = set(self._visible(points[goal], graph)[0].tolist())
        cost = {count: 0.0}
        came: dict[int, int] = {}
        queue = [(float(to_goal[count]), count)]
        closed: set[int] = set()
        while queue:
            _, here = heapq.heappop(queue)
            if here in closed:
                continue
            if here == goal:
                trail = [goal]
                while trail[-1] in came:
                    trail.append(came[trail[-1]])
                return [(float(points[i, 0]), float(points[i, 1])) for i in reversed(trail)]
            closed.add(here)
            if here < count:
                if here not in graph.seen:
                    graph.seen[here] = self._visible(points[here], graph, here)
                near, lengths = graph.seen[here]
            else:
                near, lengths = self._visible(points[here], graph)
            steps = list(zip(near.tolist(), lengths.tolist(), strict=True))
            if here in sees_goal:
                steps.append((goal, float(to_goal[here])))
            for there, length in steps:
                total = cost[here] + length
                if there not in closed and total < cost.get(there, math.inf):
                    cost[there] = total
                    came[there] = here
                    heapq.heappush(queue, (total + float(to_goal[there]), there))
        return None

    def _graph(self, coarser: float) -> _Graph:
        """Corners of the free space that point into it; shortest paths bend only there.

        First the finest ones that are not too many, then finer ones than ``coarser``, at last all
        of them.
        """
        if coarser <= _TOLERANCES[0]:
            return _graph_of(0.0, self.polygon)
        for tolerance in _TOLERANCES:
            inner = self.polygon.buffer(-tolerance / 2, join_style="mitre").simplify(tolerance / 2)
            chosen = _graph_of(tolerance, inner)
            if not math.isinf(coarser) or len(chosen.nodes) <= _MOST_CORNERS:
                break
        return chosen

    def _visible(
        self, here: NDArray[np.float64], graph: _Graph, index: int | None = None
    ) -> tuple[NDArray[np.intp], NDArray[np.float64]]:
        """Which corners are seen from a point, and how far away they are.

        Only those past which a shortest path from there can lead: that touch the line of sight,
        and are touched by it (``index``: the point is that corner).
        """
        sights = graph.nodes - here
        useful = _touched(sights, graph.arms)
        if index is not None:
            useful &= _touched(sights, graph.arms[index])
        lengths = np.hypot(*sights.T)
        near = np.flatnonzero(useful & (lengths > 1e-9))
        # Most lines of sight are blocked, of which a few points on them tell.
        near = near[self.holds_rows(here + _GLANCES[:, None] * sights[near][:, None])]
        pairs = np.stack([np.broadcast_to(here, (len(near), 2)), graph.nodes[near]], axis=1)
        seen = near[shapely.covers(self._loose, shapely.linestrings(pairs))]
        return seen, lengths[seen]


def _touched(sights: NDArray[np.float64], arms: NDArray[np.float64]) -> NDArray[np.bool_]:
    """Where both sides of a corner lie on the same side of a line of sight."""
    first = sights[:, 0] * arms[..., 0, 1] - sights[:, 1] * arms[..., 0, 0]
    second = sights[:, 0] * arms[..., 1, 1] - sights[:, 1] * arms[..., 1, 0]
    return np.asarray(first * second >= -1e-12)


def free_space(site: Site, options: PlanOptions) -> FreeSpace:
    """The free space that holds the start (``options``', else the site's, else the largest part).

    Raises:
        PlanError: the robot fits nowhere, or not at the start.
    """
    floor = site.floor()
    if not floor.is_valid:
        floor = shapely.make_valid(floor)
    things = [LineString(wall) for wall in site.walls]
    things += [Point(pole) for pole in free_poles(site)]
    free = footprint(options.clearance).places(floor, things)
    pieces = sorted(
        (piece for piece in polygons(free) if piece.area > 1e-6), key=lambda p: -float(p.area)
    )
    if not pieces:
        raise PlanError(
            f"the robot fits nowhere on the floor: with a clearance of "
            f"{in_words(options.clearance)} it needs passages of {in_words(2 * options.clearance)}."
        )
    start = options.start or site.start
    anywhere = start is None
    notes: list[str] = []
    if start is None:
        home = pieces[0]
        x, y = _default_start(home)
        start = Start(x, y)
    else:
        home, start = _at_start(pieces, floor, start, options, notes)
    return FreeSpace(
        floor=as_multi(floor),
        lines=shapely.union_all([LineString(wall) for wall in site.walls]),
        polygon=home,
        others=tuple(piece for piece in pieces if piece is not home),
        clearance=options.clearance,
        start=start,
        anywhere=anywhere,
        notes=notes,
    )


def footprint(clearance: float) -> Footprint:
    """The robot as plans see it: the disc that keeps ``clearance``, and the margin."""
    return Footprint(clearance + MARGIN, CHORD)


def free_poles(site: Site) -> list[geometry.Point]:
    """Axes of the landmarks that stand free on the floor; those at a wall belong to it."""
    round_ones = [mark for mark in site.landmarks if mark.kind.shape == "cylinder"]
    if not round_ones:
        return []
    points = shapely.points([mark.position for mark in round_ones])
    distances = shapely.distance(site.obstacles(), points)
    inside = shapely.covers(site.floor(), points)
    return [
        mark.position
        for mark, distance, here in zip(round_ones, distances, inside, strict=True)
        if here and distance > mark.kind.diameter / 2 + POLE_GAP
    ]


def _at_start(
    pieces: list[Polygon],
    floor: shapely.Geometry,
    start: Start,
    options: PlanOptions,
    notes: list[str],
) -> tuple[Polygon, Start]:
    """The piece that holds the start. A start too near to a wall is moved, and that is said."""
    spot = Point(start.position)
    if not floor.intersects(spot):
        raise PlanError(f"the start {place(start.position)} is not on the floor of the site.")
    distance, home = min(
        ((float(piece.distance(spot)), piece) for piece in pieces), key=lambda entry: entry[0]
    )
    if distance == 0:
        return home, start
    if distance > max(0.5 * options.clearance, 0.05) + 0.01:
        raise PlanError(
            f"the robot does not fit at the start {place(start.position)}: the nearest place with "
            f"a clearance of {in_words(options.clearance)} is {measured_in_words(distance)} away."
        )
    line = shapely.shortest_line(home, spot)
    x, y = (float(value) for value in line.coords[0])
    if distance > 0.001:
        notes.append(
            f"The start {place(start.position)} is nearer to a wall than "
            f"{in_words(options.clearance)}; the path begins {measured_in_words(distance)} away."
        )
    return home, Start(x, y, start.heading)


def _default_start(home: Polygon) -> geometry.Point:
    """A place from which a plan for a site without a start begins well: on a long side."""
    corners = np.asarray(home.exterior.coords, dtype=float)[:, :2]
    sides = np.round(np.hypot(*np.diff(corners, axis=0).T), 6)
    index = int(np.argmax(sides))
    middle = (corners[index] + corners[index + 1]) / 2
    return (float(middle[0]), float(middle[1]))


def other_starts(space: FreeSpace) -> list[Start]:
    """Both ends of the longest side, as starts where the site has none."""
    corners = np.asarray(space.polygon.exterior.coords, dtype=float)[:, :2]
    sides = np.round(np.hypot(*np.diff(corners, axis=0).T), 6)
    index = int(np.argmax(sides))
    return [Start(float(x), float(y)) for x, y in corners[[index, index + 1]]]


def _graph_of(tolerance: float, shape: shapely.Geometry) -> _Graph:
    """The corners of a shape at which its inside has more than half a turn."""
    nodes: list[NDArray[np.float64]] = [np.zeros((0, 2))]
    arms: list[NDArray[np.float64]] = [np.zeros((0, 2, 2))]
    for polygon in polygons(shape):
        for index, ring in enumerate((polygon.exterior, *polygon.interiors)):
            points = np.asarray(ring.coords)[:-1, :2]
            if (index == 0) != ring.is_ccw:
                points = points[::-1]  # now the inside is on the left everywhere
            back, ahead = np.roll(points, 1, axis=0) - points, np.roll(points, -1, axis=0) - points
            into = back[:, 0] * ahead[:, 1] - back[:, 1] * ahead[:, 0] > 0
            nodes.append(points[into])
            arms.append(np.stack([back, ahead], axis=1)[into])
    return _Graph(tolerance, np.vstack(nodes), np.vstack(arms))


def quadrant(radius: float, error: float = CHORD) -> int:
    """Segments per quarter turn so that a buffer's chords are no farther than ``error`` inside."""
    return Footprint(radius, error).quadrant


def polygons(shape: shapely.Geometry | NDArray[np.object_]) -> list[Polygon]:
    """The polygons of any shape or shapes, without lines, points and empty ones."""
    return [
        part
        for part in shapely.get_parts(shape).tolist()
        if isinstance(part, Polygon) and not part.is_empty
    ]


def as_multi(shape: shapely.Geometry) -> MultiPolygon:
    """Any shape as a MultiPolygon."""
    return MultiPolygon(polygons(shape))
