"""The drawn map: boundary, islands, walls, no-go areas, landmarks, routes, start. Metres, `map`."""

from __future__ import annotations

import json
from dataclasses import dataclass, field
from itertools import pairwise
from pathlib import Path
from typing import Any

import shapely
from shapely import LineString, MultiPolygon, Polygon

from polepilot.core import geojson
from polepilot.core.errors import InputError, SiteError
from polepilot.core.geometry import Point, Polyline
from polepilot.core.landmark import Landmark, LandmarkKind
from polepilot.core.site_file import Reader, place

LARGEST_FILE = 50_000_000
"""Bytes that a site file may have."""
_KEYS = ("name", "boundary", "islands", "walls", "no_go", "landmarks", "routes", "start")
_LANDMARK_KEYS = ("id", "x", "y", "bits", "segment", "diameter", "shape")


@dataclass(frozen=True, slots=True)
class Route:
    """Named nodes to drive by, in order (Tracking Route)."""

    name: str
    nodes: Polyline
    heading: float | None = None
    """How the robot is to stand at the last node, radians in `map`; None: as it comes."""

    def to_json(self) -> dict[str, Any]:
        """As in SITE.json."""
        document: dict[str, Any] = {"name": self.name, "nodes": [list(p) for p in self.nodes]}
        return document if self.heading is None else {**document, "heading": self.heading}


@dataclass(frozen=True, slots=True)
class Start:
    """Where the robot stands at first; the heading may be unknown."""

    x: float
    y: float
    heading: float | None = None

    @property
    def position(self) -> Point:
        return (self.x, self.y)


@dataclass(frozen=True, slots=True)
class Site:
    """A validated map. Rings do not repeat their first point.

    Made by ``parse_site`` or ``read_site``, which refuse what cannot be used and say where.
    """

    boundary: Polyline
    name: str = ""
    islands: tuple[Polyline, ...] = ()
    walls: tuple[Polyline, ...] = ()
    no_go: tuple[Polyline, ...] = ()
    """Floor that is not to be driven on, as rings. They hide nothing from the camera."""
    landmarks: tuple[Landmark, ...] = ()
    routes: tuple[Route, ...] = ()
    start: Start | None = None
    repairs: tuple[str, ...] = field(default=(), compare=False)
    """What was mended while reading, for the user to see."""

    def floor(self) -> Polygon | MultiPolygon:
        """Where one may drive: the boundary's inside without the islands and the no-go areas.

        Walls have no inside and are not cut out.
        """
        closed = [Polygon(ring) for ring in (*self.islands, *self.no_go)]
        return shapely.difference(Polygon(self.boundary), shapely.union_all(closed))

    def obstacles(self) -> shapely.Geometry:
        """Everything that must not be touched: boundary line, islands, walls, no-go areas."""
        return shapely.union_all(
            [
                LineString([*self.boundary, self.boundary[0]]),
                *(Polygon(ring) for ring in (*self.islands, *self.no_go)),
                *(LineString(wall) for wall in self.walls),
            ]
        )

    def segments(self) -> list[tuple[Point, Point]]:
        """All lines that block the view (boundary, islands, walls) as single segments."""
        rings = [self.boundary, *self.islands]
        pairs = [pair for ring in rings for pair in zip(ring, (*ring[1:], ring[0]), strict=True)]
        return pairs + [pair for wall in self.walls for pair in pairwise(wall)]

    def barriers(self) -> list[tuple[Point, Point]]:
        """All lines that are not to be driven across: `segments` and the rims of no-go areas."""
        rims = [
            pair for ring in self.no_go for pair in zip(ring, (*ring[1:], ring[0]), strict=True)
        ]
        return self.segments() + rims

    def route(self, name: str) -> Route:
        """The route of that name.

        Raises:
            SiteError: there is none; the message lists those that exist.
        """
        for route in self.routes:
            if route.name == name:
                return route
        known = ", ".join(repr(route.name) for route in self.routes) or "none"
        raise SiteError(f"route {name!r} is not on the site: its routes are {known}.")

    def landmarks_by_id(self) -> dict[int, Landmark]:
        return {landmark.id: landmark for landmark in self.landmarks}

    def to_geojson(self) -> dict[str, Any]:
        """The site as a GeoJSON FeatureCollection in local metres, a role per feature."""
        return geojson.to_geojson(self.to_json())

    def to_json(self) -> dict[str, Any]:
        """The SITE.json document."""
        default = LandmarkKind()
        landmarks: list[dict[str, Any]] = []
        for mark in self.landmarks:
            entry: dict[str, Any] = {"id": mark.id, "x": mark.x, "y": mark.y}
            for key in ("bits", "segment", "diameter", "shape"):
                if getattr(mark.kind, key) != getattr(default, key):
                    entry[key] = getattr(mark.kind, key)
            landmarks.append(entry)
        document: dict[str, Any] = {
            "name": self.name,
            "boundary": [list(p) for p in self.boundary],
            "islands": [[list(p) for p in ring] for ring in self.islands],
            "walls": [[list(p) for p in wall] for wall in self.walls],
            "landmarks": landmarks,
            "routes": [route.to_json() for route in self.routes],
        }
        if self.no_go:
            document["no_go"] = [[list(p) for p in ring] for ring in self.no_go]
        if self.start is not None:
            start = [self.start.x, self.start.y]
            document["start"] = start + ([] if self.start.heading is None else [self.start.heading])
        return document


def read_site(path: Path) -> Site:
    """The site in a SITE.json or GeoJSON file.

    Raises:
        SiteError: the file cannot be read, or what it holds cannot be used.
    """
    try:
        if path.stat().st_size > LARGEST_FILE:
            raise SiteError(f"{path}: has more than {LARGEST_FILE // 10**6} MB: expected a site.")
        document = json.loads(path.read_text(encoding="utf-8-sig"))
    except OSError as error:
        raise SiteError(f"{path}: cannot be read: {error.strerror or error}.") from error
    except UnicodeDecodeError as error:
        raise SiteError(f"{path}: is no text: expected SITE.json or GeoJSON.") from error
    except json.JSONDecodeError as error:
        raise SiteError(
            f"{path}: is no JSON at line {error.lineno}, column {error.colno}: {error.msg}."
        ) from error
    except (ValueError, RecursionError) as error:
        raise SiteError(f"{path}: is no JSON that can be read: {error}.") from error
    return parse_site(document, str(path))


def parse_site(document: Any, source: str) -> Site:
    """The site that a SITE.json or GeoJSON document describes.

    Orientation is normalised (rings counter-clockwise); what was mended is in ``Site.repairs``.
    ``source`` is how messages call the document, for example its file name.

    Raises:
        SiteError: what cannot be used, with source, field and place.
    """
    if geojson.is_geojson(document):
        document = geojson.from_geojson(document, source)
    reader = Reader(source)
    fields = {
        key: value
        for key, value in reader.object(document, "the site", _KEYS).items()
        if value is not None
    }
    if "boundary" not in fields:
        raise SiteError(f"{source}: boundary is missing: expected a list of points [x, y].")

    def entries(key: str, expected: str) -> list[tuple[str, Any]]:
        values = reader.array(fields.get(key, []), key, expected)
        return [(f"{key}[{index}]", value) for index, value in enumerate(values)]

    boundary = reader.ring(fields["boundary"], "boundary")
    islands = tuple(reader.ring(v, f) for f, v in entries("islands", "a list of rings"))
    walls = tuple(reader.line(v, f, 2) for f, v in entries("walls", "a list of lines"))
    no_go = tuple(reader.ring(v, f) for f, v in entries("no_go", "a list of rings"))
    landmarks = tuple(_landmark(v, f, reader) for f, v in entries("landmarks", "a list"))
    routes = tuple(_route(v, f, reader) for f, v in entries("routes", "a list of routes"))
    start = _start(fields["start"], reader) if "start" in fields else None
    _check_unique([mark.id for mark in landmarks], "landmarks", "id", reader)
    _check_unique([route.name for route in routes], "routes", "name", reader)
    _check_islands(boundary, islands, reader)
    _check_walls(boundary, walls, reader)
    _check_no_go(boundary, islands, no_go, reader)
    site = Site(
        boundary=boundary,
        name=reader.text(fields.get("name", ""), "name"),
        islands=islands,
        walls=walls,
        no_go=no_go,
        landmarks=landmarks,
        routes=routes,
        start=start,
        repairs=tuple(reader.repairs),
    )
    if start is not None and not shapely.intersects_xy(site.floor(), start.x, start.y):
        raise reader.refuse(
            "start",
            f"{place(start.position)} is not on the floor: expected a place inside the boundary "
            "and outside the islands and the no-go areas.",
            start.position,
        )
    return site


def _landmark(value: Any, name: str, reader: Reader) -> Landmark:
    entry = {k: v for k, v in reader.object(value, name, _LANDMARK_KEYS).items() if v is not None}
    for key in ("id", "x", "y"):
        if key not in entry:
            raise reader.refuse(f"{name}.{key}", "is missing.")
    position = (
        reader.number(entry["x"], f"{name}.x"),
        reader.number(entry["y"], f"{name}.y"),
    )
    kind: dict[str, Any] = {}
    if "bits" in entry:
        kind["bits"] = reader.integer(entry["bits"], f"{name}.bits")
    for key in ("segment", "diameter"):
        if key in entry:
            kind[key] = reader.number(entry[key], f"{name}.{key}")
    if "shape" in entry:
        kind["shape"] = reader.text(entry["shape"], f"{name}.shape")
    try:
        return Landmark(reader.integer(entry["id"], f"{name}.id"), *position, LandmarkKind(**kind))
    except SiteError:
        raise
    except InputError as error:
        raise reader.refuse(f"{name}:", error.message, position) from error


def _route(value: Any, name: str, reader: Reader) -> Route:
    entry = reader.object(value, name, ("name", "nodes", "heading"))
    label = reader.text(entry.get("name"), f"{name}.name")
    if not label.strip():
        raise reader.refuse(f"{name}.name", "is empty: expected a name.")
    nodes = reader.line(entry.get("nodes"), f"{name}.nodes", 1)
    if (heading := entry.get("heading")) is None:
        return Route(label, nodes)
    return Route(label, nodes, reader.angle(heading, f"{name}.heading"))


def _start(value: Any, reader: Reader) -> Start:
    numbers = reader.array(value, "start", "[x, y] or [x, y, heading]")
    if len(numbers) not in (2, 3):
        raise reader.refuse(
            "start", f"has {len(numbers)} numbers: expected [x, y] or [x, y, heading]."
        )
    x, y = reader.point(numbers[:2], "start")
    if len(numbers) == 2:
        return Start(x, y)
    return Start(x, y, reader.angle(numbers[2], "start[2]"))


def _check_unique(values: list[Any], field_name: str, key: str, reader: Reader) -> None:
    seen: dict[Any, int] = {}
    for index, value in enumerate(values):
        if value in seen:
            raise reader.refuse(
                f"{field_name}[{index}].{key}",
                f"is {value!r}, as in {field_name}[{seen[value]}]: expected each {key} once.",
            )
        seen[value] = index


def _check_islands(boundary: Polyline, islands: tuple[Polyline, ...], reader: Reader) -> None:
    """Refuses islands outside; says where they reach over the boundary or over each other."""
    room = Polygon(boundary)
    shapely.prepare(room)
    polygons = [Polygon(ring) for ring in islands]
    for index, polygon in enumerate(polygons):
        if room.covers(polygon):
            continue
        inside = room.intersection(polygon)
        where = islands[index][0]
        if inside.area < 1e-9:
            raise reader.refuse(
                f"islands[{index}]",
                f"lies outside the boundary at {place(where)}: expected it inside.",
                where,
            )
        beyond = polygon.difference(room)
        if beyond.is_empty:
            continue  # but for the last digits it is inside
        outside = beyond.representative_point()
        where = (outside.x, outside.y)
        reader.repairs.append(
            f"islands[{index}]: reaches over the boundary at {place(where)}; "
            "only what lies inside counts."
        )
    tree = shapely.STRtree(polygons)
    pairs = tree.query(polygons, predicate="intersects").T.tolist() if polygons else []
    for first, second in pairs:
        if first >= second:
            continue
        common = polygons[first].intersection(polygons[second])
        if common.area > 1e-9:
            point = common.representative_point()
            reader.repairs.append(
                f"islands[{first}] and islands[{second}]: overlap at "
                f"{place((point.x, point.y))}; taken as one obstacle."
            )
    rest = room.difference(shapely.union_all(polygons))
    if rest.area < 1e-4:
        where = islands[0][0] if islands else boundary[0]
        raise reader.refuse("islands", "leave no floor inside the boundary.", where)


def _check_walls(boundary: Polyline, walls: tuple[Polyline, ...], reader: Reader) -> None:
    room = Polygon(boundary)
    shapely.prepare(room)
    for index, wall in enumerate(walls):
        if not room.intersects(LineString(wall)):
            reader.repairs.append(
                f"walls[{index}]: lies outside the boundary at {place(wall[0])}; no floor is there."
            )


def _check_no_go(
    boundary: Polyline, islands: tuple[Polyline, ...], no_go: tuple[Polyline, ...], reader: Reader
) -> None:
    """Refuses no-go areas that leave nothing to drive on; says which of them change nothing."""
    if not no_go:
        return
    room = Polygon(boundary).difference(shapely.union_all([Polygon(ring) for ring in islands]))
    areas = [Polygon(ring) for ring in no_go]
    for index, area in enumerate(areas):
        if room.intersection(area).area < 1e-9:
            reader.repairs.append(
                f"no_go[{index}]: lies outside the floor at {place(no_go[index][0])}; "
                "it changes nothing."
            )
    if room.difference(shapely.union_all(areas)).area < 1e-4:
        raise reader.refuse("no_go", "leaves no floor inside the boundary.", no_go[0][0])
