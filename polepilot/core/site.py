"""The drawn map: boundary, islands, walls, landmarks, routes, start. Metres in `map`."""

from __future__ import annotations

from dataclasses import dataclass, field
from itertools import pairwise
from typing import Any

import shapely
from shapely import LineString, MultiPolygon, Polygon

from polepilot.core.errors import SiteError
from polepilot.core.geometry import Point, Polyline
from polepilot.core.landmark import Landmark, LandmarkKind

LARGEST = 100_000.0
"""No coordinate of a site is farther from the origin than this, metres."""


@dataclass(frozen=True, slots=True)
class Route:
    """Named nodes to drive by, in order (Tracking Route)."""

    name: str
    nodes: Polyline


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
    landmarks: tuple[Landmark, ...] = ()
    routes: tuple[Route, ...] = ()
    start: Start | None = None
    repairs: tuple[str, ...] = field(default=(), compare=False)
    """What was mended while reading, for the user to see."""

    def floor(self) -> Polygon | MultiPolygon:
        """The boundary's inside without the islands. Walls have no inside and are not cut out."""
        return shapely.difference(
            Polygon(self.boundary), shapely.union_all([Polygon(ring) for ring in self.islands])
        )

    def obstacles(self) -> shapely.Geometry:
        """Everything that must not be touched: boundary line, islands, walls."""
        return shapely.union_all(
            [
                LineString([*self.boundary, self.boundary[0]]),
                *(Polygon(ring) for ring in self.islands),
                *(LineString(wall) for wall in self.walls),
            ]
        )

    def segments(self) -> list[tuple[Point, Point]]:
        """All lines that block the view (boundary, islands, walls) as single segments."""
        rings = [self.boundary, *self.islands]
        pairs = [pair for ring in rings for pair in zip(ring, (*ring[1:], ring[0]), strict=True)]
        return pairs + [pair for wall in self.walls for pair in pairwise(wall)]

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
            "routes": [{"name": r.name, "nodes": [list(p) for p in r.nodes]} for r in self.routes],
        }
        if self.start is not None:
            start = [self.start.x, self.start.y]
            document["start"] = start + ([] if self.start.heading is None else [self.start.heading])
        return document
