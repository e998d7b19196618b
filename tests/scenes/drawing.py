"""Pictures for documents as SVG: text, lines, axes, and pixels that stay sharp at any size.

White behind everything, so that they read on light and dark pages alike. Coordinates are points of
the drawing, y down; an `Axes` maps data to them.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from html import escape
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

INK, SOFT, FAINT = "#1f2328", "#6e7781", "#d8dee4"
ORANGE, BLUE, GREEN, RED = "#d9660a", "#0b62b8", "#1a7f37", "#c0262d"
_FONT = "system-ui, 'Segoe UI', Roboto, 'Liberation Sans', 'DejaVu Sans', Helvetica, sans-serif"
_LEVELS = 8
"""Grey levels that make one colour of `Drawing.pixels`: fewer colours make smaller files."""

Numbers = Sequence[float] | NDArray[np.floating[Any]]


@dataclass(slots=True)
class Drawing:
    """A sheet that is drawn on, later things above earlier ones."""

    width: float
    height: float
    title: str
    """For those who cannot see it."""
    parts: list[str] = field(default_factory=list)

    def text(
        self,
        x: float,
        y: float,
        words: str,
        *,
        color: str = INK,
        size: float = 13,
        anchor: str = "start",
        bold: bool = False,
        turn: float = 0.0,
    ) -> None:
        """Words whose base line is at ``y``; ``anchor``: start, middle or end."""
        more = ' font-weight="600"' if bold else ""
        if turn:
            more += f' transform="rotate({turn:g} {_n(x)} {_n(y)})"'
        self.parts.append(
            f'<text x="{_n(x)}" y="{_n(y)}" font-size="{size:g}" fill="{color}" '
            f'text-anchor="{anchor}"{more}>{escape(words)}</text>'
        )

    def line(
        self,
        points: Sequence[tuple[float, float]],
        *,
        color: str = INK,
        width: float = 1.0,
        dash: str = "",
        fill: str = "none",
        opacity: float = 1.0,
    ) -> None:
        """A polyline, or a filled shape."""
        path = "M" + "L".join(f"{_n(x)} {_n(y)}" for x, y in points)
        more = f' stroke-dasharray="{dash}"' if dash else ""
        more += f' opacity="{opacity:g}"' if opacity < 1 else ""
        self.parts.append(
            f'<path d="{path}" fill="{fill}" stroke="{color}" stroke-width="{width:g}" '
            f'stroke-linejoin="round"{more}/>'
        )

    def box(
        self,
        x: float,
        y: float,
        width: float,
        height: float,
        *,
        fill: str = "none",
        color: str = "none",
        line: float = 1.0,
        opacity: float = 1.0,
        corner: float = 0.0,
    ) -> None:
        """A rectangle."""
        more = f' rx="{corner:g}"' if corner else ""
        more += f' opacity="{opacity:g}"' if opacity < 1 else ""
        self.parts.append(
            f'<rect x="{_n(x)}" y="{_n(y)}" width="{_n(width)}" height="{_n(height)}" '
            f'fill="{fill}" stroke="{color}" stroke-width="{line:g}"{more}/>'
        )

    def dot(self, x: float, y: float, color: str, radius: float = 2.4) -> None:
        """A filled circle."""
        self.parts.append(f'<circle cx="{_n(x)}" cy="{_n(y)}" r="{radius:g}" fill="{color}"/>')

    def arrow(self, start: tuple[float, float], end: tuple[float, float], color: str) -> None:
        """A line with a head at its end."""
        x, y = np.array(end) - np.array(start)
        length = float(np.hypot(x, y))
        along, aside = np.array([x, y]) / length, np.array([-y, x]) / length
        tip = np.array(end)
        wings = tip - 8 * along + 3.5 * aside, tip - 8 * along - 3.5 * aside
        neck = tip - 6 * along
        self.line([start, (float(neck[0]), float(neck[1]))], color=color, width=1.4)
        corners = [(float(p[0]), float(p[1])) for p in (tip, *wings, tip)]
        self.line(corners, color="none", fill=color)

    def pixels(
        self, image: NDArray[np.uint8], x: float, y: float, across: float, down: float
    ) -> None:
        """A picture (rows x columns x BGR) with pixels of ``across`` x ``down`` points."""
        coarse = (image[..., ::-1].astype(int) // _LEVELS) * _LEVELS + _LEVELS // 2
        paths: dict[str, list[str]] = {}
        for row in range(coarse.shape[0]):
            start = 0
            for column in range(1, coarse.shape[1] + 1):
                if column < coarse.shape[1] and (coarse[row, column] == coarse[row, start]).all():
                    continue
                red, green, blue = coarse[row, start]
                run = f"M{start} {row}h{column - start}"
                paths.setdefault(f"#{red:02x}{green:02x}{blue:02x}", []).append(run)
                start = column
        self.parts.append(
            f'<g transform="translate({_n(x)} {_n(y + down / 2)}) scale({across:g} {down:g})" '
            'stroke-width="1.04" fill="none" shape-rendering="crispEdges">'
        )
        self.parts += [f'<path stroke="{c}" d="{"".join(runs)}"/>' for c, runs in paths.items()]
        self.parts.append("</g>")

    def save(self, path: Path) -> None:
        """Writes the file."""
        head = (
            f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {self.width:g} {self.height:g}" '
            f'width="{self.width:g}" height="{self.height:g}" font-family="{_FONT}" role="img">'
            f"<title>{escape(self.title)}</title>"
            f'<rect width="{self.width:g}" height="{self.height:g}" rx="6" fill="#ffffff"/>'
        )
        path.write_text("\n".join([head, *self.parts, "</svg>"]) + "\n", encoding="utf-8")


@dataclass(frozen=True, slots=True)
class Axes:
    """A field of a drawing with a scale on each side."""

    on: Drawing
    left: float
    top: float
    width: float
    height: float
    x: tuple[float, float]
    """Data at the left and at the right border."""
    y: tuple[float, float]
    """Data at the lower and at the upper border."""
    logarithmic: bool = False
    """Both ways."""

    def at(self, x: float, y: float) -> tuple[float, float]:
        """Where data lies in the drawing."""
        return (
            self.left + self.width * self._share(x, self.x),
            self.top + self.height * (1 - self._share(y, self.y)),
        )

    def _share(self, value: float, ends: tuple[float, float]) -> float:
        low, high = ends
        if self.logarithmic:
            return float(np.log(value / low) / np.log(high / low))
        return (value - low) / (high - low)

    def frame(self, across: str = "", up: str = "") -> None:
        """The borders to the left and below, and what they count."""
        corners = [(0.0, 0.0), (0.0, self.height), (self.width, self.height)]
        self.on.line([(self.left + x, self.top + y) for x, y in corners], color=SOFT)
        if across:
            middle = self.left + self.width / 2
            place = self.top + self.height + 34
            self.on.text(middle, place, across, color=SOFT, size=12, anchor="middle")
        if up:
            middle = self.top + self.height / 2
            self.on.text(self.left - 40, middle, up, color=SOFT, size=12, anchor="middle", turn=-90)

    def ticks_x(self, values: Sequence[float], labels: Sequence[str] = ()) -> None:
        """Marks along the lower border."""
        for index, value in enumerate(values):
            x, y = self.at(value, self.y[0])
            self.on.line([(x, y), (x, y + 4)], color=SOFT)
            words = labels[index] if labels else f"{value:g}"
            self.on.text(x, y + 17, words, color=SOFT, size=12, anchor="middle")

    def ticks_y(self, values: Sequence[float], labels: Sequence[str] = ()) -> None:
        """Marks along the left border, with faint lines across."""
        for index, value in enumerate(values):
            x, y = self.at(self.x[0], value)
            self.on.line([(x, y), (x + self.width, y)], color=FAINT)
            words = labels[index] if labels else f"{value:g}"
            self.on.text(x - 6, y + 4, words, color=SOFT, size=12, anchor="end")

    def curve(
        self, x: Numbers, y: Numbers, color: str, *, width: float = 1.6, dash: str = ""
    ) -> None:
        """A line through data."""
        points = [self.at(float(a), float(b)) for a, b in zip(x, y, strict=True)]
        self.on.line(points, color=color, width=width, dash=dash)

    def dots(self, x: Numbers, y: Numbers, color: str, radius: float = 2.4) -> None:
        """Circles at data."""
        for a, b in zip(x, y, strict=True):
            self.on.dot(*self.at(float(a), float(b)), color, radius)

    def steps(self, x: Numbers, y: Numbers, color: str, *, width: float = 1.2) -> None:
        """A level per datum, one wide, with the field below it tinted."""
        points = [
            self.at(float(a) + side, float(b))
            for a, b in zip(x, y, strict=True)
            for side in (-0.5, 0.5)
        ]
        base = self.at(self.x[0], self.y[0])[1]
        shape = [(points[0][0], base), *points, (points[-1][0], base)]
        self.on.line(shape, color="none", fill=color, opacity=0.18)
        self.on.line(points, color=color, width=width)


def _n(value: float) -> str:
    return f"{value:.2f}".rstrip("0").rstrip(".")
