"""Floor plans by lot: houses, offices and flats, furnished and bare. SITE.json documents, metres.

Doors are 0.8 to 1.2 m wide, and now and then one is too narrow for the robot.
"""

from __future__ import annotations

import math

import numpy as np
import shapely
from plans.shapes import Document, Ring, box, document, from_polygon
from shapely import Polygon, affinity

Rng = np.random.Generator
Room = tuple[float, float, float, float]


def house(seed: int, rooms: int, thick: float = 0.12) -> Document:
    """Rooms with thick walls between them, doors cut through: one floor with holes."""
    rng = np.random.default_rng(seed)
    cells = _split((0.0, 0.0, *_size(rng, rooms)), rooms, rng)
    floor = [
        shapely.box(x0 + thick / 2, y0 + thick / 2, x1 - thick / 2, y1 - thick / 2)
        for x0, y0, x1, y1 in cells
    ]
    for (x, y), along, width in _doors(cells, rng):
        half, deep = width / 2, thick
        floor.append(
            shapely.box(x - half, y - deep, x + half, y + deep)
            if along
            else shapely.box(x - deep, y - half, x + deep, y + half)
        )
    return from_polygon(_largest(shapely.union_all(floor)))


def office(seed: int, rooms: int, desks: int) -> Document:
    """Rooms parted by walls without thickness, with doors, desks, cupboards and plants."""
    rng = np.random.default_rng(seed)
    outer = (0.0, 0.0, *_size(rng, rooms))
    cells = _split(outer, rooms, rng)
    doors = _doors(cells, rng)
    lines = []
    for cell in cells:
        x0, y0, x1, y1 = cell
        lines += [((x1, y0), (x1, y1)), ((x0, y1), (x1, y1))]
    walls = shapely.union_all([shapely.LineString(line) for line in lines])
    rim = shapely.box(*outer)
    walls = walls.intersection(rim.buffer(-0.05)).difference(
        shapely.union_all(
            [
                shapely.LineString(
                    [(x - w / 2, y), (x + w / 2, y)] if along else [(x, y - w / 2), (x, y + w / 2)]
                ).buffer(0.001, cap_style="flat")
                for (x, y), along, w in doors
            ]
        )
    )
    merged = shapely.line_merge(walls)
    kept = [
        np.round(shapely.get_coordinates(line), 5).tolist()
        for line in shapely.get_parts(merged).tolist()
        if line.length > 0.05
    ]
    # A wall ends on the outer wall, not five centimetres before it.
    kept = [[_onto(point, outer) for point in line] for line in kept]
    return document(box(*outer), _furniture(cells, doors, desks, rng), walls=kept)


def flat(seed: int, rooms: int, pieces: int) -> Document:
    """A house with furniture in it; some stands at the wall and becomes part of the outline."""
    rng = np.random.default_rng(seed + 77)
    bare = house(seed, rooms)
    floor = Polygon(bare["boundary"], bare["islands"])
    for _ in range(pieces):
        x0, y0, x1, y1 = floor.bounds
        for _ in range(200):
            wide, deep = rng.choice([(1.6, 0.8), (2.0, 1.4), (0.5, 0.5), (1.2, 0.45), (0.9, 0.9)])
            thing = affinity.rotate(
                shapely.box(0, 0, wide, deep), float(rng.choice([0, 90, 90, 0, 30]))
            )
            thing = affinity.translate(
                thing, float(rng.uniform(x0, x1)), float(rng.uniform(y0, y1))
            )
            if rng.random() < 0.5:  # pushed to the nearest wall
                near, here = shapely.shortest_line(floor.exterior, thing).coords
                thing = affinity.translate(
                    thing, 1.001 * (near[0] - here[0]), 1.001 * (near[1] - here[1])
                )
            left = floor.difference(thing)
            free = left.buffer(-0.42)
            whole = isinstance(left, Polygon) and not free.is_empty
            if whole and floor.covers(thing.buffer(-0.06)) and _in_one(left):
                floor = left
                break
    return from_polygon(_largest(floor.buffer(0)))


def overlapping(seed: int, boxes: int) -> Document:
    """What a house looks like from rectangles that overlap, as in collections of floor plans."""
    rng = np.random.default_rng(seed)
    shapes = [shapely.box(0, 0, 4, 3)]
    while len(shapes) < boxes:
        whole = shapely.union_all(shapes)
        spot = shapely.line_interpolate_point(
            whole.boundary, float(rng.uniform(0, whole.boundary.length))
        )
        wide, high = rng.uniform(1.0, 4.5, 2)
        x, y = spot.x + float(rng.uniform(-wide, 0)), spot.y + float(rng.uniform(-high, 0))
        room = shapely.box(*np.round([x, y, x + wide, y + high], 2))
        if whole.intersection(room).area > 0.3:
            shapes.append(room)
    floor = shapely.union_all(shapes)
    return from_polygon(_largest(floor.buffer(0)))


def _in_one(floor: Polygon) -> bool:
    return isinstance(floor.buffer(-0.25), Polygon) or floor.buffer(-0.25).geom_type == "Polygon"


def _largest(floor: shapely.Geometry) -> Polygon:
    return max(shapely.get_parts(floor).tolist(), key=lambda part: part.area)


def _size(rng: Rng, rooms: int) -> tuple[float, float]:
    area = rooms * float(rng.uniform(9, 16))
    wide = math.sqrt(area) * float(rng.uniform(0.9, 1.5))
    return round(wide, 2), round(area / wide, 2)


def _split(outer: Room, rooms: int, rng: Rng) -> list[Room]:
    """A rectangle cut across its longer side until there are enough."""
    cells = [outer]
    while len(cells) < rooms:
        cells.sort(key=lambda c: (c[2] - c[0]) * (c[3] - c[1]))
        x0, y0, x1, y1 = cells.pop()
        share = float(rng.uniform(0.35, 0.65))
        if x1 - x0 > y1 - y0:
            cut = round(x0 + share * (x1 - x0), 2)
            cells += [(x0, y0, cut, y1), (cut, y0, x1, y1)]
        else:
            cut = round(y0 + share * (y1 - y0), 2)
            cells += [(x0, y0, x1, cut), (x0, cut, x1, y1)]
    return cells


def _doors(cells: list[Room], rng: Rng) -> list[tuple[tuple[float, float], bool, float]]:
    """A door (middle, whether the wall runs along x, width) for a tree of rooms, and some more."""
    shared = []
    for i, a in enumerate(cells):
        for j, b in enumerate(cells[:i]):
            low, high = max(a[0], b[0]), min(a[2], b[2])
            if high - low > 1.5 and (a[1] == b[3] or a[3] == b[1]):
                y = a[1] if a[1] == b[3] else a[3]
                shared.append(
                    (i, j, (round(float(rng.uniform(low + 0.7, high - 0.7)), 2), y), True)
                )
            low, high = max(a[1], b[1]), min(a[3], b[3])
            if high - low > 1.5 and (a[0] == b[2] or a[2] == b[0]):
                x = a[0] if a[0] == b[2] else a[2]
                shared.append(
                    (i, j, (x, round(float(rng.uniform(low + 0.7, high - 0.7)), 2)), False)
                )
    rng.shuffle(shared)
    group = list(range(len(cells)))
    doors = []
    for i, j, middle, along in shared:
        joins = group[i] != group[j]
        if joins or rng.random() < 0.15:
            group = [group[i] if g == group[j] else g for g in group]
            narrow = rng.random() < 0.06
            width = 0.36 if narrow else float(rng.choice([0.8, 0.9, 1.0, 1.2]))
            doors.append((middle, along, width))
    return doors


def _furniture(
    cells: list[Room],
    doors: list[tuple[tuple[float, float], bool, float]],
    desks: int,
    rng: Rng,
) -> list[Ring]:
    """Desks and cupboards inside of rooms, away from the doors."""
    things: list[Polygon] = []
    for _ in range(desks * 30):
        if len(things) == desks:
            break
        x0, y0, x1, y1 = cells[int(rng.integers(len(cells)))]
        wide, deep = rng.choice([(1.6, 0.8), (1.2, 0.8), (0.4, 0.4), (0.8, 0.4), (1.0, 1.0)])
        if rng.random() < 0.5:
            wide, deep = deep, wide
        if x1 - x0 < wide + 1 or y1 - y0 < deep + 1:
            continue
        x, y = rng.uniform(x0 + 0.05, x1 - wide - 0.05), rng.uniform(y0 + 0.05, y1 - deep - 0.05)
        if rng.random() < 0.5:
            x = x0 + 0.02
        thing = shapely.box(*np.round([x, y, x + wide, y + deep], 2))
        clear = all(
            math.hypot(thing.centroid.x - a, thing.centroid.y - b) > 1.5 for (a, b), _, _ in doors
        )
        if clear and all(thing.distance(other) > 0.1 for other in things):
            things.append(thing)
    return [[list(point) for point in thing.exterior.coords[:-1]] for thing in things]


def _onto(point: list[float], outer: Room) -> list[float]:
    x, y = point
    for value in (outer[0], outer[2]):
        x = value if abs(x - value) < 0.06 else x
    for value in (outer[1], outer[3]):
        y = value if abs(y - value) < 0.06 else y
    return [x, y]
