"""A board for the calibration of the lens on one sheet of paper, to scale."""

from __future__ import annotations

from collections.abc import Iterable

from polepilot.core.errors import InputError
from polepilot.core.printing.drawing import BLACK, GREY, Box, Drawing, Item, Sheet, Stroke, Text
from polepilot.core.printing.paper import SIZES

Rectangle = tuple[float, float, float, float]
"""Left, top, width, height, metres."""

_EDGE = 8.0
"""White around the board, and what ordinary printers cannot reach, mm."""
_FOOT = 12.0
"""For the ruler and the words below the board, mm."""
_RULER = 100.0
_PAPERS = ("A4", "A3", "A2", "A1", "A0")


def board_drawing(
    title: str, width: float, height: float, black: Iterable[Rectangle], words: str
) -> Drawing:
    """``black`` rectangles on the smallest usual paper that holds ``width`` x ``height`` metres.

    Raises:
        InputError: it fits no paper.
    """
    wide, tall = width * 1000, height * 1000
    across, down = _paper(wide, tall)
    left, top = (across - wide) / 2, (down - _FOOT - tall) / 2 + _EDGE / 4
    items: list[Item] = [
        Box(left + x * 1000, top + y * 1000, w * 1000, h * 1000, BLACK, "code")
        for x, y, w, h in black
    ]
    base = down - _EDGE
    items.append(Stroke(((_EDGE, base), (_EDGE + _RULER, base)), BLACK, 0.2, role="ruler"))
    for half in range(21):
        x = _EDGE + half * _RULER / 20
        length = 1.2 if half % 2 else 2.4
        items.append(Stroke(((x, base), (x, base - length)), BLACK, 0.2))
    items.append(Text(_EDGE, base + 3.2, "Print at 100 %: 100 mm. Glue onto something flat.", 2.4))
    items.append(Text(across - _EDGE, base + 3.2, words, 2.4, "end", ink=GREY))
    return Drawing(title, (Sheet(across, down, title, tuple(items)),))


def _paper(wide: float, tall: float) -> tuple[float, float]:
    for name in _PAPERS:
        short, long = SIZES[name]
        for across, down in ((short, long), (long, short)):
            if wide + 2 * _EDGE <= across and tall + _EDGE + _FOOT <= down:
                return across, down
    raise InputError(
        f"the board is {wide:g} x {tall:g} mm: larger than A0; expected smaller or fewer squares."
    )
