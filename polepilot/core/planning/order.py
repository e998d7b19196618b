"""In which order strokes are driven: a tree of neighbours, walked so that little is driven twice.

The outermost loop nearest to the start is the root; each other stroke hangs on the neighbour to
which its connection is shortest. The default order drives a loop, leaves it where a branch of the
tree hangs, comes back and goes on; the last branch is entered where the loop ends, so that nothing
leads back from there. The paper's order finishes each loop before it goes on to the next one.
"""

from __future__ import annotations

import heapq
from collections.abc import Iterator
from dataclasses import dataclass, field

import numpy as np
import shapely
from shapely import LineString, Point

from polepilot.core import geometry
from polepilot.core.planning.offset import Points, Stroke
from polepilot.core.planning.options import Order
from polepilot.core.planning.space import FreeSpace


@dataclass(slots=True, eq=False)
class Run:
    """A stretch of one stroke, to be driven as it is. ``points``: N x 2."""

    points: Points
    stroke: Stroke
    whole: bool
    """Whether this is a closed loop in one go, which may begin anywhere."""


@dataclass(slots=True, eq=False)
class _Node:
    stroke: Stroke
    line: LineString
    children: list[_Node] = field(default_factory=list)
    weight: float = 0.0
    """Length of this stroke and all that hangs on it."""


def ordered_runs(
    strokes: list[Stroke], start: geometry.Point, space: FreeSpace, order: Order, reach: float
) -> list[Run]:
    """All strokes in the order of driving, beginning at the outermost loop nearest to ``start``.

    ``reach``: how far apart neighbours are, about a tool width.
    """
    if not strokes:
        return []
    root = _tree(strokes, start, space, reach)
    entry = float(root.line.project(Point(start)))
    return list(_walk(root, entry, order, space, 3 * reach))


def _tree(strokes: list[Stroke], start: geometry.Point, space: FreeSpace, reach: float) -> _Node:
    """Prim's tree over the strokes, by the length of the straight connection."""
    nodes = [_Node(stroke, stroke.line) for stroke in strokes]
    lines = [node.line for node in nodes]
    shapes = np.array(lines)
    outermost = [i for i, s in enumerate(strokes) if s.depth == 0] or list(range(len(strokes)))
    first = min(outermost, key=lambda i: (float(lines[i].distance(Point(start))), i))
    tree = shapely.STRtree(shapes)
    pairs = tree.query(shapes, predicate="dwithin", distance=1.5 * reach).T
    near: dict[int, list[int]] = {}
    for a, b in pairs.tolist():
        if a != b:
            near.setdefault(a, []).append(b)
    parent: dict[int, int] = {}
    heap: list[tuple[float, int, int]] = [(0.0, first, first)]
    sequence: list[int] = []
    waiting = set(range(len(nodes)))
    while waiting:
        if not heap:
            # Nothing is near any more: the nearest pair across whatever lies between.
            rest = sorted(waiting)
            done = np.array(sequence)
            distances = shapely.distance(shapes[done][:, None], shapes[rest][None, :])
            a, b = np.unravel_index(int(np.argmin(distances)), distances.shape)
            heap.append((0.0, rest[int(b)], int(done[int(a)])))
        _, here, above = heapq.heappop(heap)
        if here not in waiting:
            continue
        waiting.discard(here)
        sequence.append(here)
        parent[here] = above
        for other in near.get(here, []):
            if other in waiting:
                bridge = shapely.shortest_line(lines[here], lines[other])
                if space.holds(bridge):
                    heapq.heappush(heap, (round(float(bridge.length), 3), other, here))
    for index in sequence[1:]:
        nodes[parent[index]].children.append(nodes[index])
    for index in reversed(sequence):
        node = nodes[index]
        node.weight = float(node.line.length) + sum(child.weight for child in node.children)
    return nodes[first]


def _walk(root: _Node, entry: float, order: Order, space: FreeSpace, near: float) -> Iterator[Run]:
    """Runs in order. A stack instead of recursion: big fields nest hundreds of loops."""
    stack: list[Iterator[Run | tuple[_Node, geometry.Point]]] = [
        _visit(root, entry, order, space, near)
    ]
    while stack:
        step = next(stack[-1], None)
        if step is None:
            stack.pop()
        elif isinstance(step, Run):
            yield step
        else:
            child, place = step
            at = float(child.line.project(Point(place)))
            stack.append(_visit(child, at, order, space, near))


def _visit(
    node: _Node, entry: float, order: Order, space: FreeSpace, near: float
) -> Iterator[Run | tuple[_Node, geometry.Point]]:
    """Drives one stroke; (child, place) asks to do a child now, entered nearest to that place."""
    line, stroke = node.line, node.stroke
    length = float(line.length)
    if not stroke.closed:
        points = stroke.points if entry <= length / 2 else stroke.points[::-1].copy()
        yield Run(points, stroke, whole=False)
        for child in node.children:
            yield child, _point(points[-1])
        return
    here = line.interpolate(entry)
    children = sorted(node.children, key=lambda child: child.weight)
    last = _last(children, here, space, near)
    if order == "paper":
        yield Run(_stretch(line, entry, entry + length), stroke, whole=True)
        for child in sorted(node.children, key=lambda c: (c is last, -c.weight)):
            yield child, (float(here.x), float(here.y))
        return
    stops: list[tuple[float, _Node]] = []
    for child in children:
        if child is not last:
            at = float(line.project(Point(shapely.shortest_line(line, child.line).coords[0])))
            stops.append(((at - entry) % length, child))
    stops.sort(key=lambda stop: stop[0])
    done = 0.0
    for at, child in stops:
        if at - done > 0.01:
            yield Run(_stretch(line, entry + done, entry + at), stroke, whole=False)
            done = at
        place = line.interpolate((entry + done) % length)
        yield child, (float(place.x), float(place.y))
    yield Run(_stretch(line, entry + done, entry + length), stroke, whole=done == 0.0)
    if last is not None:
        yield last, (float(here.x), float(here.y))


def _last(children: list[_Node], here: Point, space: FreeSpace, near: float) -> _Node | None:
    """The heaviest child that can be entered from where the loop ends."""
    for child in reversed(children):
        bridge = shapely.shortest_line(here, child.line)
        if bridge.length <= near and space.holds(bridge):
            return child
    return None


def _stretch(line: LineString, first: float, last: float) -> Points:
    """The ring from one distance along it to another one, at most once around."""
    length = float(line.length)
    coords = np.asarray(line.coords, dtype=float)[:, :2]
    marks = np.r_[0.0, np.cumsum(np.hypot(*np.diff(coords, axis=0).T))]
    twice = np.vstack([coords[:-1], coords])
    marks = np.r_[marks[:-1], marks + length]
    turns = np.floor(first / length)
    first, last = first - turns * length, last - turns * length
    inner = twice[(marks > first + 1e-6) & (marks < last - 1e-6)]
    ends = [
        np.array(line.interpolate(at % length if at != length else 0.0).coords[0][:2])
        for at in (first, last)
    ]
    return np.vstack([ends[0][None], inner, ends[1][None]])


def _point(row: Points) -> geometry.Point:
    return (float(row[0]), float(row[1]))
