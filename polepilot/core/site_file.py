"""The fields of a site document: types, numbers, points, lines and rings, checked one by one.

Everything here raises ``SiteError`` with one sentence that names the source, the field and, where
there is one, the place on the map. Nothing here knows what the fields mean; ``site`` does.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Mapping
from typing import Any

import shapely
from shapely import Polygon

from polepilot.core.errors import SiteError
from polepilot.core.geometry import Point, Polyline, wrap_angle

LARGEST = 100_000.0
"""No coordinate of a site is farther from the origin than this, metres."""
MOST_POINTS = 200_000
"""No line of a site has more points than this."""
SAME = 1e-6
"""Points nearer to each other than this are one point, metres."""
SMALLEST_AREA = 1e-4
"""A ring around less than this has no inside, m²."""
_NUDGE = 1e-3
"""How far a point is moved where a ring touches itself, metres."""


class Reader:
    """Reads the fields of one document; ``source`` is how messages call it."""

    def __init__(self, source: str) -> None:
        self.source = source
        self.repairs: list[str] = []

    def refuse(self, field: str, problem: str, where: Point | None = None) -> SiteError:
        """The error to raise: "SOURCE: FIELD PROBLEM"."""
        return SiteError(f"{self.source}: {field} {problem}", where=where)

    def object(self, value: Any, field: str, known: Iterable[str]) -> Mapping[str, Any]:
        """A JSON object that has no keys other than ``known``."""
        if not isinstance(value, dict):
            raise self.refuse(field, f"is {kind_of(value)}: expected an object.")
        known = tuple(known)
        unknown = [str(key) for key in value if key not in known]
        if unknown:
            names = ", ".join(repr(key[:40]) for key in unknown[:5])
            raise self.refuse(
                field, f"has unknown keys: {names}; expected only {', '.join(known)}."
            )
        return value

    def array(self, value: Any, field: str, expected: str) -> list[Any]:
        if not isinstance(value, list | tuple):
            raise self.refuse(field, f"is {kind_of(value)}: expected {expected}.")
        if len(value) > MOST_POINTS:
            raise self.refuse(
                field, f"has {len(value)} entries: expected no more than {MOST_POINTS}."
            )
        return list(value)

    def text(self, value: Any, field: str, longest: int = 200) -> str:
        if not isinstance(value, str):
            raise self.refuse(field, f"is {kind_of(value)}: expected a text.")
        if len(value) > longest:
            raise self.refuse(
                field, f"has {len(value)} characters: expected no more than {longest}."
            )
        return value

    def number(self, value: Any, field: str, largest: float = LARGEST) -> float:
        """A finite number no larger than ``largest``."""
        if isinstance(value, bool) or not isinstance(value, int | float):
            raise self.refuse(field, f"is {kind_of(value)}: expected a number.")
        if not -largest <= value <= largest:  # catches NaN, and integers too large for a float
            shown = "too large" if isinstance(value, int) else f"{value:g}"
            raise self.refuse(
                field, f"is {shown}: expected a finite number from {-largest:g} to {largest:g}."
            )
        return float(value)

    def angle(self, value: Any, field: str) -> float:
        """Radians, as a direction in (-pi, pi]."""
        return wrap_angle(self.number(value, field, largest=1000.0))

    def integer(self, value: Any, field: str) -> int:
        number = self.number(value, field)
        if number != int(number):
            raise self.refuse(field, f"is {value!r}: expected a whole number.")
        return int(number)

    def point(self, value: Any, field: str) -> Point:
        pair = self.array(value, field, "a point [x, y]")
        if len(pair) != 2:
            raise self.refuse(field, f"has {len(pair)} numbers: expected a point [x, y].")
        return (self.number(pair[0], f"{field}[0]"), self.number(pair[1], f"{field}[1]"))

    def line(self, value: Any, field: str, least: int) -> Polyline:
        """Points of which no two neighbours are the same; at least ``least`` of them."""
        raw = self.array(value, field, "a list of points [x, y]")
        points = [self.point(entry, f"{field}[{index}]") for index, entry in enumerate(raw)]
        kept = points[:1]
        dropped = []
        for point in points[1:]:
            if same(point, kept[-1]):
                dropped.append(point)
            else:
                kept.append(point)
        self._say_dropped(field, dropped)
        if len(kept) < least:
            raise self.refuse(
                field,
                f"has {len(kept)} different points: expected at least {least}.",
                kept[0] if kept else None,
            )
        return tuple(kept)

    def ring(self, value: Any, field: str) -> Polyline:
        """A simple counter-clockwise ring around some area, first point not repeated."""
        raw = self.array(value, field, "a list of points [x, y]")
        if len(raw) > 1 and raw[0] == raw[-1]:
            raw = raw[:-1]  # a closed ring, as many programs write it
        if len(raw) < 3:
            raise self.refuse(field, f"has {len(raw)} points: expected at least 3.")
        points = list(self.line(raw, field, 3))
        dropped = []
        while len(points) > 3 and same(points[0], points[-1]):
            dropped.append(points.pop())
        self._say_dropped(field, dropped)
        points = self._simple(points, field)
        area = signed_area(points)
        if abs(area) < SMALLEST_AREA:
            raise self.refuse(
                field, f"encloses no area near {place(points[0])}: expected a room.", points[0]
            )
        return tuple(points if area > 0 else points[::-1])

    def _say_dropped(self, field: str, dropped: list[Point]) -> None:
        if not dropped:
            return
        where = place(dropped[0])
        if len(dropped) == 1:
            self.repairs.append(f"{field}: a repeated point at {where} was dropped.")
        else:
            self.repairs.append(
                f"{field}: {len(dropped)} repeated points were dropped, the first at {where}."
            )

    def _simple(self, points: list[Point], field: str) -> list[Point]:
        """The ring, mended where it touches itself in a point; refused where it crosses itself."""
        for _ in range(20):
            polygon = Polygon(points)
            if polygon.is_valid:
                return points
            reason = shapely.is_valid_reason(polygon)
            found = re.search(r"\[(\S+) (\S+)\]", reason)
            where = (float(found[1]), float(found[2])) if found else points[0]
            if polygon.convex_hull.area < SMALLEST_AREA:
                raise self.refuse(field, f"encloses no area near {place(where)}.", where)
            mended = _separate(points, where) if reason.startswith("Ring Self") else None
            if mended is None:
                raise self.refuse(
                    field,
                    f"crosses itself at {place(where)}: expected a simple outline.",
                    where,
                )
            points = mended
            self.repairs.append(
                f"{field}: touches itself at {place(where)}; a point there was moved by 1 mm."
            )
        raise self.refuse(
            field, f"touches itself in too many places, one is {place(where)}.", where
        )


def _separate(points: list[Point], where: Point) -> list[Point] | None:
    """The ring with one of its points at ``where`` moved so that nothing touches there."""
    for index in [i for i, point in enumerate(points) if math.dist(point, where) < 1e-5]:
        for step in range(16):
            angle = step * math.tau / 16 + 0.1
            moved = (
                points[index][0] + _NUDGE * math.cos(angle),
                points[index][1] + _NUDGE * math.sin(angle),
            )
            trial = [*points[:index], moved, *points[index + 1 :]]
            reason = shapely.is_valid_reason(Polygon(trial))
            if reason == "Valid Geometry":
                return trial
            found = re.search(r"\[(\S+) (\S+)\]", reason)
            elsewhere = found and math.dist((float(found[1]), float(found[2])), where) > 3 * _NUDGE
            if reason.startswith("Ring Self") and elsewhere:
                return trial
    return None


def signed_area(points: list[Point] | Polyline) -> float:
    """Of a ring, counter-clockwise positive, m²."""
    x0, y0 = points[0]
    total = sum(
        (a[0] - x0) * (b[1] - y0) - (b[0] - x0) * (a[1] - y0)
        for a, b in zip(points, (*points[1:], points[0]), strict=True)
    )
    return 0.5 * float(total)


def same(a: Point, b: Point) -> bool:
    return abs(a[0] - b[0]) < SAME and abs(a[1] - b[1]) < SAME


def place(point: Point) -> str:
    """A place as messages write it: "(1.23, 4.50)"."""
    return f"({point[0]:.2f}, {point[1]:.2f})"


def kind_of(value: Any) -> str:
    """What a JSON value is, in words."""
    if value is None:
        return "null"
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, str):
        return f"the text {value[:40]!r}"
    if isinstance(value, int | float):
        return f"the number {value:g}" if abs(value) < 1e300 else "a number"
    if isinstance(value, dict):
        return "an object"
    return "a list" if isinstance(value, list | tuple) else f"a {type(value).__name__}"
