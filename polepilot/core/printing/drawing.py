"""A drawing to scale: sheets of paper with boxes, strokes, shapes and words on them.

Millimetres; the origin is the sheet's top left corner, x to the right, y down. Nothing here knows
what is drawn, nor in which file format it will be written: `pdf` and `svg` do that.
"""

from __future__ import annotations

import re
from dataclasses import dataclass, field
from typing import Literal

from polepilot.core.errors import InputError

Anchor = Literal["start", "middle", "end"]
Role = Literal["code", "bleed", "ruler", ""]
Place = tuple[float, float]

_HEX = re.compile(r"#[0-9a-fA-F]{6}")


@dataclass(frozen=True, slots=True)
class Ink:
    """A colour: ``#rrggbb``, and where it is known how to print it, four process inks (0 to 1)."""

    rgb: str
    cmyk: tuple[float, float, float, float] | None = None

    def __post_init__(self) -> None:
        if not _HEX.fullmatch(self.rgb):
            raise InputError(f"colour is {self.rgb!r}: expected #rrggbb, as #ff6a00.")

    @property
    def channels(self) -> tuple[float, float, float]:
        """Red, green and blue, 0 to 1."""
        red, green, blue = (int(self.rgb[i : i + 2], 16) / 255 for i in (1, 3, 5))
        return red, green, blue

    @property
    def light(self) -> tuple[float, float, float]:
        """Linear light of red, green and blue, 0 to 1."""
        red, green, blue = (
            c / 12.92 if c <= 0.04045 else ((c + 0.055) / 1.055) ** 2.4 for c in self.channels
        )
        return red, green, blue

    @property
    def luminance(self) -> float:
        """Relative luminance of the linear light, 0 (black) to 1 (white)."""
        return sum(w * c for w, c in zip((0.2126, 0.7152, 0.0722), self.light, strict=True))


BLACK = Ink("#000000", (0.0, 0.0, 0.0, 1.0))
GREY = Ink("#6b6b6b", (0.0, 0.0, 0.0, 0.65))
PALE = Ink("#b3b3b3", (0.0, 0.0, 0.0, 0.35))
WHITE = Ink("#ffffff", (0.0, 0.0, 0.0, 0.0))


@dataclass(frozen=True, slots=True)
class Box:
    """A filled rectangle without an outline. ``role`` says what it is to whoever reads the file."""

    x: float
    y: float
    width: float
    height: float
    ink: Ink
    role: Role = ""


@dataclass(frozen=True, slots=True)
class Stroke:
    """A line through points; ``dash`` is the length of dashes and gaps, 0 for a solid line."""

    points: tuple[Place, ...]
    ink: Ink = BLACK
    width: float = 0.2
    dash: float = 0.0
    role: Role = ""


@dataclass(frozen=True, slots=True)
class Shape:
    """A filled polygon."""

    points: tuple[Place, ...]
    ink: Ink = BLACK


@dataclass(frozen=True, slots=True)
class Text:
    """One line of words in the typeface of `fonts`; (x, y) is on the base line.

    ``size`` is the height of the font, mm; ``angle`` turns the line counter-clockwise around
    (x, y), degrees.
    """

    x: float
    y: float
    words: str
    size: float = 2.6
    anchor: Anchor = "start"
    bold: bool = False
    angle: float = 0.0
    ink: Ink = BLACK


Item = Box | Stroke | Shape | Text


@dataclass(frozen=True, slots=True)
class Sheet:
    """One sheet of paper; items are drawn in their order."""

    width: float
    height: float
    title: str
    items: tuple[Item, ...]


@dataclass(frozen=True, slots=True)
class Drawing:
    """A file's worth of sheets."""

    title: str
    sheets: tuple[Sheet, ...] = field(default=())
