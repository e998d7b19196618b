"""Charts: lines, dots and words on a sheet, saved as SVG (sharp at any size) or PNG.

Coordinates are points of the sheet, y down; a `Field` maps data to them. White behind everything,
so that a chart reads on light and dark pages alike.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from html import escape
from itertools import groupby
from pathlib import Path
from typing import Literal

import cv2
import numpy as np
from numpy.typing import NDArray

from polepilot.core.errors import InputError
from polepilot.core.trajectory import Array

INK, SOFT, FAINT = "#1b2127", "#6e7781", "#d8dee4"
MEASURED, ESTIMATED, TARGET = "#e69f00", "#0072b2", "#009e73"
SERIES = (ESTIMATED, "#d55e00", "#cc79a7", "#56b4e9", TARGET)
"""Colours that people with any colour vision tell apart."""

Anchor = Literal["start", "middle", "end"]
_FONT = "system-ui, 'Segoe UI', Roboto, 'Liberation Sans', 'DejaVu Sans', Helvetica, sans-serif"
_SCALE = 2
"""Pixels of a PNG per point."""
_PART = 16
"""OpenCV draws in parts of a pixel."""


@dataclass(frozen=True, slots=True, eq=False)
class _Line:
    points: Array
    color: str
    width: float
    dashed: bool


@dataclass(frozen=True, slots=True)
class _Dot:
    x: float
    y: float
    color: str
    radius: float
    hollow: bool


@dataclass(frozen=True, slots=True)
class _Text:
    x: float
    y: float
    words: str
    color: str
    size: float
    anchor: Anchor


@dataclass(slots=True)
class Chart:
    """A sheet that is drawn on, later things above earlier ones."""

    width: float
    height: float
    title: str
    """For those who cannot see it."""
    parts: list[_Line | _Dot | _Text] = field(default_factory=list)

    def line(
        self, points: Array, color: str = INK, width: float = 1.0, *, dashed: bool = False
    ) -> None:
        """A polyline, n x 2."""
        if len(points) > 1:
            self.parts.append(_Line(np.asarray(points, float), color, width, dashed))

    def dot(
        self, x: float, y: float, color: str, radius: float = 1.6, *, hollow: bool = False
    ) -> None:
        self.parts.append(_Dot(x, y, color, radius, hollow))

    def cross(self, x: float, y: float, color: str, size: float = 3.0) -> None:
        for way in (1.0, -1.0):
            ends = np.array([(x - size, y - way * size), (x + size, y + way * size)])
            self.line(ends, color, 1.2)

    def text(
        self,
        x: float,
        y: float,
        words: str,
        color: str = INK,
        size: float = 12.0,
        anchor: Anchor = "start",
    ) -> None:
        """Words whose base line is at ``y``."""
        self.parts.append(_Text(x, y, words, color, size, anchor))

    def save(self, path: Path) -> None:
        """Write ``path``, as its ending says, whole or not at all.

        Raises:
            InputError: another ending than .svg or .png, or the file cannot be written.
        """
        data = self.encoded(path)
        part = path.with_name(f".{path.name}.part")
        try:
            part.write_bytes(data)
            part.replace(path)
        except OSError as error:
            part.unlink(missing_ok=True)
            raise InputError(f"{path}: cannot be written: {error.strerror or error}.") from error

    def encoded(self, path: Path) -> bytes:
        """The bytes of a file called ``path``."""
        ending = path.suffix.lower()
        if ending == ".svg":
            return self.svg().encode("utf-8")
        if ending == ".png":
            return self.png()
        raise InputError(f"{path}: expected a name that ends in .svg or .png.")

    def svg(self) -> str:
        body = "\n".join(_as_svg(list(parts)) for _, parts in groupby(self.parts, _look))
        return (
            f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {self.width:g} {self.height:g}" '
            f'width="{self.width:g}" height="{self.height:g}" font-family="{_FONT}" role="img">'
            f"\n<title>{escape(self.title)}</title>\n"
            f'<rect width="{self.width:g}" height="{self.height:g}" rx="6" fill="#ffffff"/>\n'
            f"{body}\n</svg>\n"
        )

    def png(self) -> bytes:
        size = (round(self.height * _SCALE), round(self.width * _SCALE), 3)
        image = np.full(size, 255, np.uint8)
        for part in self.parts:
            _on_image(image, part)
        _, data = cv2.imencode(".png", image)
        return data.tobytes()


@dataclass(frozen=True, slots=True)
class Field:
    """A part of a chart with a scale on each side."""

    on: Chart
    left: float
    top: float
    width: float
    height: float
    x: tuple[float, float]
    """Data at the left and at the right border."""
    y: tuple[float, float]
    """Data at the lower and at the upper border."""

    @classmethod
    def to_scale(
        cls, on: Chart, left: float, top: float, width: float, height: float, points: Array
    ) -> Field:
        """A map: one metre is as long either way, and all of ``points`` (n x 2) are inside."""
        low, high = points.min(axis=0), points.max(axis=0)
        middle, span = (low + high) / 2, np.maximum(high - low, 0.1) * 1.08
        per_point = float(max(span[0] / width, span[1] / height))
        half_x, half_y = per_point * width / 2, per_point * height / 2
        x, y = float(middle[0]), float(middle[1])
        return cls(on, left, top, width, height, (x - half_x, x + half_x), (y - half_y, y + half_y))

    def at(self, points: Array) -> Array:
        """Where data (n x 2) lies on the chart."""
        points = np.asarray(points, float).reshape(-1, 2)
        across = (points[:, 0] - self.x[0]) / (self.x[1] - self.x[0])
        up = (points[:, 1] - self.y[0]) / (self.y[1] - self.y[0])
        return np.stack(
            [self.left + self.width * across, self.top + self.height * (1 - up)], axis=1
        )

    def frame(self, across: str, up: str) -> None:
        """Borders, scales and what they count."""
        right, bottom = self.left + self.width, self.top + self.height
        for value in steps(*self.y):
            y = float(self.at(np.array([(self.x[0], value)]))[0, 1])
            self.on.line(np.array([(self.left, y), (right, y)]), FAINT)
            self.on.text(self.left - 6, y + 4, f"{value:g}", SOFT, 11, "end")
        for value in steps(*self.x):
            x = float(self.at(np.array([(value, self.y[0])]))[0, 0])
            self.on.line(np.array([(x, bottom), (x, bottom + 4)]), SOFT)
            self.on.text(x, bottom + 16, f"{value:g}", SOFT, 11, "middle")
        corners = [(self.left, self.top), (self.left, bottom), (right, bottom)]
        self.on.line(np.array(corners), SOFT)
        self.on.text(right, bottom + 30, across, SOFT, 11, "end")
        self.on.text(self.left - 30, self.top - 8, up, SOFT, 11)

    def line(self, points: Array, color: str, width: float = 1.2, *, dashed: bool = False) -> None:
        """A line through data (n x 2)."""
        self.on.line(self.at(points), color, width, dashed=dashed)


def steps(low: float, high: float) -> list[float]:
    """Some five round numbers from ``low`` to ``high``."""
    rough = (high - low) / 5
    size = 10.0 ** math.floor(math.log10(rough))
    step = next(size * f for f in (1, 2, 5, 10) if size * f >= rough)
    first = math.ceil(low / step - 1e-9)
    return [round(n * step, 10) + 0.0 for n in range(first, math.floor(high / step + 1e-9) + 1)]


def _look(part: _Line | _Dot | _Text) -> tuple[object, ...]:
    """What neighbours in the list of parts have in common if one element can draw them all."""
    if isinstance(part, _Dot) and not part.hollow:
        return part.color, part.radius
    if isinstance(part, _Line):
        return part.color, part.width, part.dashed
    return (id(part),)


def _as_svg(parts: list[_Line | _Dot | _Text]) -> str:
    """Parts of one look as one element."""
    part = parts[0]
    if isinstance(part, _Text):
        return (
            f'<text x="{_n(part.x)}" y="{_n(part.y)}" font-size="{part.size:g}" '
            f'fill="{part.color}" text-anchor="{part.anchor}">{escape(part.words)}</text>'
        )
    if isinstance(part, _Dot) and part.hollow:
        return (
            f'<circle cx="{_n(part.x)}" cy="{_n(part.y)}" r="{part.radius:g}" fill="none" '
            f'stroke="{part.color}" stroke-width="1"/>'
        )
    if isinstance(part, _Dot):
        # A line of no length with round ends.
        path = "".join(f"M{_n(p.x)} {_n(p.y)}h0" for p in parts if isinstance(p, _Dot))
        width, more = 2 * part.radius, ' stroke-linecap="round"'
    else:
        lines = [p.points for p in parts if isinstance(p, _Line)]
        path = "".join("M" + "L".join(f"{_n(x)} {_n(y)}" for x, y in line) for line in lines)
        width, more = part.width, ' stroke-linejoin="round"'
        more += ' stroke-dasharray="6 4"' if part.dashed else ""
    return f'<path d="{path}" fill="none" stroke="{part.color}" stroke-width="{width:g}"{more}/>'


def _on_image(image: NDArray[np.uint8], part: _Line | _Dot | _Text) -> None:
    red, green, blue = (int(part.color[i : i + 2], 16) for i in (1, 3, 5))
    color = (blue, green, red)
    if isinstance(part, _Line):
        points = _dashes(part.points) if part.dashed else [part.points]
        shapes = [np.round(one * _SCALE * _PART).astype(np.int32) for one in points]
        thick = max(1, round(part.width * _SCALE))
        cv2.polylines(image, shapes, False, color, thick, cv2.LINE_AA, 4)
    elif isinstance(part, _Dot):
        center = (round(part.x * _SCALE * _PART), round(part.y * _SCALE * _PART))
        radius = max(1, round(part.radius * _SCALE * _PART))
        cv2.circle(image, center, radius, color, _SCALE if part.hollow else -1, cv2.LINE_AA, 4)
    else:
        # OpenCV's letters are 21 units high at scale 1, and ASCII.
        words = part.words.encode("ascii", "replace").decode("ascii")
        scale = part.size * _SCALE / 28
        (wide, _), _ = cv2.getTextSize(words, cv2.FONT_HERSHEY_SIMPLEX, scale, 1)
        left = part.x * _SCALE - wide * {"start": 0.0, "middle": 0.5, "end": 1.0}[part.anchor]
        place = (round(left), round(part.y * _SCALE))
        cv2.putText(image, words, place, cv2.FONT_HERSHEY_SIMPLEX, scale, color, 1, cv2.LINE_AA)


def _dashes(points: Array) -> list[Array]:
    """A line cut into dashes of 6 points with gaps of 4."""
    along = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(points, axis=0).T))])
    starts = np.arange(0.0, along[-1], 10.0)
    cut = []
    for start in starts:
        end = min(start + 6.0, float(along[-1]))
        inside = along[(along > start) & (along < end)]
        at = np.concatenate([[start], inside, [end]])
        cut.append(np.stack([np.interp(at, along, points[:, i]) for i in (0, 1)], axis=1))
    return cut


def _n(value: float) -> str:
    return f"{value:.1f}".removesuffix(".0")
