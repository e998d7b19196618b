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
from numpy.typing import NDArray
from shapely import LineString, Point

from polepilot.core import geometry
from polepilot.core.planning.offset import Points, Stroke
from polepilot.core.planning.options import Order
from polepilot.core.planning.space import FreeSpace

_MOST_SIDES = 24
"""So many of a loop's longest sides are looked at for a place to leave it."""


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


@dataclass(frozen=True, slots=True)
class _Way:
    """How strokes are connected, metres."""

    reach: float
    gap: float


def ordered_runs(
    strokes: list[Stroke],
    start: geometry.Point,
    space: FreeSpace,
    order: Order,
    reach: float,
    gap: float = 0.0,
) -> list[Run]:
    """All strokes in the order of driving, beginning at the outermost loop nearest to ``start``.

    ``reach``: how far apart neighbours are, about a tool width. ``gap``: how far the two crossings
    between a loop and one that hangs on it lie apart; loops leave that out. 0: back where it left.
    """
    if not strokes:
        return []
    root = _tree(strokes, start, space, reach)
    entry = _Entry.at(root, start, final=True)
    return list(_walk(root, entry, order, space, _Way(reach, gap)))


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


@dataclass(frozen=True, slots=True)
class _Entry:
    """How a stroke is driven: ``span`` metres along ``line`` from ``first`` on."""

    line: LineString
    first: float
    span: float
    final: bool
    """Whether nothing is driven after this stroke and what hangs on it."""

    @classmethod
    def at(cls, node: _Node, place: geometry.Point, final: bool) -> _Entry:
        """All of it, from the point nearest to ``place`` on."""
        line = node.line
        return cls(line, float(line.project(Point(place))), float(line.length), final)


_Step = Run | tuple[_Node, _Entry]


def _walk(root: _Node, entry: _Entry, order: Order, space: FreeSpace, way: _Way) -> Iterator[Run]:
    """Runs in order. A stack instead of recursion: big fields nest hundreds of loops."""
    stack: list[Iterator[_Step]] = [_visit(root, entry, order, space, way)]
    while stack:
        step = next(stack[-1], None)
        if step is None:
            stack.pop()
        elif isinstance(step, Run):
            yield step
        else:
            stack.append(_visit(*step, order, space, way))


def _visit(
    node: _Node, entry: _Entry, order: Order, space: FreeSpace, way: _Way
) -> Iterator[_Step]:
    """Drives one stroke; (child, entry) asks to do a child now."""
    line, stroke = entry.line, node.stroke
    length = float(line.length)
    if not stroke.closed:
        points = stroke.points if entry.first <= length / 2 else stroke.points[::-1].copy()
        yield Run(points, stroke, whole=False)
        for child in node.children:
            yield child, _Entry.at(child, _point(points[-1]), final=False)
        return
    here = line.interpolate(entry.first)
    place = (float(here.x), float(here.y))
    children = sorted(node.children, key=lambda child: child.weight)
    last = _last(children, here, space, 3 * way.reach) if entry.final or not way.gap else None
    if order == "paper":
        yield Run(_stretch(line, entry.first, entry.first + length), stroke, whole=True)
        # What lies inside of this loop belongs to its group, which is finished first.
        ring = shapely.Polygon(stroke.points)
        mine = {id(c) for c in node.children if shapely.covers(ring, c.stroke.line)}
        for child in sorted(node.children, key=lambda c: (id(c) not in mine, c is last, -c.weight)):
            yield child, _Entry.at(child, place, final=False)
        return
    span = entry.span
    if last is not None and way.gap and last.stroke.closed and span > 6 * way.gap:
        span -= way.gap
    done = 0.0
    for at, child in _stops(entry, span, [c for c in children if c is not last], way):
        at = max(at, done)
        if at - done > 0.01:
            yield Run(_stretch(line, entry.first + done, entry.first + at), stroke, whole=False)
            done = at
        beyond = done + way.gap
        crossed = None
        if way.gap and child.stroke.closed and beyond < span:
            crossed = _crossing(entry, done, beyond, child, space, way)
        if crossed is None:
            spot = line.interpolate((entry.first + done) % length)
            yield child, _Entry.at(child, (float(spot.x), float(spot.y)), final=False)
        else:
            yield child, crossed
            done = beyond
    whole = done == 0.0 and span == length
    yield Run(_stretch(line, entry.first + done, entry.first + span), stroke, whole=whole)
    if last is not None:
        yield last, _Entry.at(last, place, entry.final)


def _stops(
    entry: _Entry, span: float, children: list[_Node], way: _Way
) -> list[tuple[float, _Node]]:
    """Where along the stroke each child is entered, as lengths from its beginning."""
    line, length = entry.line, float(entry.line.length)
    if not way.gap:
        nearest = [
            float(line.project(Point(shapely.shortest_line(line, child.line).coords[0])))
            for child in children
        ]
        found = [
            ((at - entry.first) % length, child)
            for at, child in zip(nearest, children, strict=True)
        ]
        return sorted(found, key=lambda stop: stop[0])
    marks = _marks(line)
    sides = np.diff(marks)
    spots: list[float] = []
    for index in np.argsort(-sides, kind="stable")[:_MOST_SIDES].tolist():
        if sides[index] > 2 * way.gap or not spots:
            spots += [marks[index] + share * sides[index] for share in (0.5, 0.3, 0.7, 0.15, 0.85)]
    lengths = (np.array(spots) - entry.first) % length
    corners = np.asarray(line.coords, dtype=float)[:, :2]

    def ends(at: Points) -> NDArray[np.object_]:
        """2 x N places, so far along the stroke and a gap farther."""
        along = (entry.first + at + np.array([[0.0], [way.gap]])) % length
        x, y = (np.interp(along, marks, values) for values in corners.T)
        return np.asarray(shapely.points(x, y))

    common = ends(lengths)
    taken: list[tuple[float, _Node]] = []
    for child in sorted(children, key=lambda c: -c.weight):
        own = float(line.project(Point(shapely.shortest_line(line, child.line).coords[0])))
        choices = np.r_[lengths, (own - entry.first) % length]
        places = np.hstack([common, ends(choices[-1:])])
        cost = shapely.distance(places, child.line).sum(axis=0)
        cost = np.round(cost, 3) + 2.0 * ((choices < way.gap) | (choices > span - 2 * way.gap))
        for at, _ in taken:
            cost = cost + 2.0 * (np.abs(choices - at) < 2 * way.gap)
        taken.append((float(choices[int(np.argmin(cost))]), child))
    return sorted(((min(at, span), child) for at, child in taken), key=lambda stop: stop[0])


def _crossing(
    entry: _Entry, done: float, beyond: float, child: _Node, space: FreeSpace, way: _Way
) -> _Entry | None:
    """The child driven from opposite ``done`` around to opposite ``beyond``; None: not possible.

    What both strokes leave out between the two crossings is swept by the crossings.
    """
    line, length, ring = entry.line, float(entry.line.length), child.line
    spots = [line.interpolate((entry.first + at) % length) for at in (done, beyond)]
    marks = [float(ring.project(spot)) for spot in spots]
    for spot, mark in zip(spots, marks, strict=True):
        bridge = LineString([spot, ring.interpolate(mark)])
        if bridge.length > 1.5 * way.reach or not space.holds(bridge):
            return None
    around = float(ring.length)
    span = (marks[1] - marks[0]) % around
    if span < around / 2:
        ring, marks = LineString(ring.coords[::-1]), [around - mark for mark in marks]
        span = around - span
    if span < around - 3 * way.gap:
        return None
    return _Entry(ring, marks[0], span, final=False)


def _last(children: list[_Node], here: Point, space: FreeSpace, near: float) -> _Node | None:
    """The heaviest child that can be entered from where the loop ends."""
    for child in reversed(children):
        bridge = shapely.shortest_line(here, child.line)
        if bridge.length <= near and space.holds(bridge):
            return child
    return None


def _marks(line: LineString) -> Points:
    """Length along a line at each of its points."""
    coords = np.asarray(line.coords, dtype=float)[:, :2]
    return np.asarray(np.r_[0.0, np.cumsum(np.hypot(*np.diff(coords, axis=0).T))])


def _stretch(line: LineString, first: float, last: float) -> Points:
    """The ring from one distance along it to another one, at most once around."""
    length = float(line.length)
    coords = np.asarray(line.coords, dtype=float)[:, :2]
    marks = _marks(line)
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
