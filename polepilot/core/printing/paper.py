"""Paper: the names by which people buy it, in millimetres."""

from __future__ import annotations

import re
from dataclasses import dataclass

from polepilot.core.errors import InputError

SMALLEST, LARGEST = 140.0, 5000.0
"""Sides of a sheet: the ruler has to fit, and PDF readers stop at 5.08 m."""

SIZES: dict[str, tuple[float, float]] = {
    "A0": (841.0, 1189.0),
    "A1": (594.0, 841.0),
    "A2": (420.0, 594.0),
    "A3": (297.0, 420.0),
    "A4": (210.0, 297.0),
    "A5": (148.0, 210.0),
    "Letter": (215.9, 279.4),
    "Legal": (215.9, 355.6),
    "Tabloid": (279.4, 431.8),
}
_BY_NAME = {name.lower(): name for name in SIZES}
_SHEET = re.compile(r"(\d{1,5}(?:\.\d+)?)\s*[x×]\s*(\d{1,5}(?:\.\d+)?)\s*(?:mm)?")
_ROLL = re.compile(r"roll[\s:-]*(\d{1,5}(?:\.\d+)?)\s*(?:mm)?")


@dataclass(frozen=True, slots=True)
class Paper:
    """A sheet (either way up), or with ``height`` None a roll that is cut where it is full."""

    name: str
    width: float
    height: float | None

    def __post_init__(self) -> None:
        for side in (self.width, self.height):
            if side is not None and not SMALLEST <= side <= LARGEST:
                raise InputError(
                    f"paper {self.name}: a side of {side:g} mm; expected"
                    f" {SMALLEST:g} to {LARGEST:g} mm."
                )


def parse_paper(text: str) -> Paper:
    """``"A4"``, ``"Letter"``, ``"420x594"`` (mm) or ``"roll-610"`` (a roll's width, mm).

    Raises:
        InputError: anything else, or sides that are too short or too long.
    """
    plain = text.strip().lower()
    if plain in _BY_NAME:
        name = _BY_NAME[plain]
        return Paper(name, *SIZES[name])
    if found := _SHEET.fullmatch(plain):
        width, height = float(found[1]), float(found[2])
        return Paper(f"{width:g} x {height:g} mm", width, height)
    if found := _ROLL.fullmatch(plain):
        width = float(found[1])
        return Paper(f"a roll {width:g} mm wide", width, None)
    raise InputError(
        f"paper is {text!r}: expected {', '.join(SIZES)}, a size in mm as 420x594,"
        " or a roll's width in mm as roll-610."
    )
