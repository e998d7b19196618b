"""What is drawn on a sheet: tiles of landmarks with their marks, the ruler, the heading.

Nothing but the colour of the code is drawn within the code. Lines lie just outside of what they
bound. White paper above and below the code carries what a person needs: which way is up, which
landmark it is, what is glued where.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import groupby

from polepilot.core.landmark import encode
from polepilot.core.printing.drawing import (
    BLACK,
    GREY,
    PALE,
    WHITE,
    Box,
    Ink,
    Item,
    Role,
    Shape,
    Stroke,
    Text,
)
from polepilot.core.printing.fonts import text_width
from polepilot.core.printing.pages import Placed
from polepilot.core.printing.tiles import (
    FOOT,
    GUTTER,
    HEADER,
    MARGIN,
    RULER_STRIP,
    THIN,
)

RULER = 100.0
"""Length of the ruler on every sheet, mm."""
LIGHT = 0.6
"""A bright colour of more luminance than this has dark paper above and below it."""

_LINE = 0.15
_BLEED = 4.0
"""How far the colours go on into the flap, so that a tube a little too thick shows no white."""
_SMALL = 2.3
_NARROW = 42.0
"""On narrower tiles, the figures of the collar shrink; on thin ones they are stacked."""


def tile_items(placed: Placed, inks: tuple[Ink, Ink]) -> Iterator[Item]:
    """A tile with everything around it; ``inks`` are the dark and the bright colour (0 and 1)."""
    for item in _tile_items(placed, inks):
        if not isinstance(item, Text) or item.words:  # where there is no room, there are no words
            yield item


def _tile_items(placed: Placed, inks: tuple[Ink, Ink]) -> Iterator[Item]:
    tile = placed.tile
    light = inks[1].luminance > LIGHT
    strong, faint = (WHITE, WHITE) if light else (BLACK, GREY)
    if light:
        yield from _dark_ends(placed, inks[0])
    yield from _colours(placed, inks)
    yield from _outline(placed)
    yield from _seam_marks(placed)
    yield from _collar(placed, strong, faint) if tile.first_row else _glue_strip(placed)
    yield _foot(placed, faint) if tile.last_row else _cut_here(placed)


def sheet_items(width: float, height: float, heading: Sequence[str], page: str) -> Iterator[Item]:
    """The heading (the longest choice that fits), the sheet's number, and the ruler."""
    base = MARGIN + HEADER - 2.2
    room = width - 2 * MARGIN - text_width(page, _SMALL, bold=True) - 6
    yield Text(MARGIN, base, _fitting(heading, room), _SMALL, ink=GREY)
    yield Text(width - MARGIN, base, page, _SMALL, "end", bold=True)
    yield from _ruler(MARGIN + RULER_STRIP - 4.0, height - MARGIN - 2.0)


def arrow_up(x: float, y: float, size: float, ink: Ink = BLACK) -> Shape:
    """An arrow of this height standing on (x, y)."""
    half, neck = size * 0.36, size * 0.13
    head = y - size * 0.55
    return Shape(
        (
            *((x, y - size), (x + half, head), (x + neck, head), (x + neck, y)),
            *((x - neck, y), (x - neck, head), (x - half, head)),
        ),
        ink,
    )


def joint_letter(row: int) -> str:
    """How the seam below this row is called: A to Z, then A1 to Z1 and so on."""
    turn, letter = divmod(row, 26)
    return chr(ord("A") + letter) + (str(turn) if turn else "")


def ids_in_words(ids: Sequence[int], dash: str = "–") -> str:
    """``[1, 2, 3, 7]`` as "1–3, 7"."""
    runs: list[list[int]] = []
    for number in sorted(ids):
        if runs and number == runs[-1][-1] + 1:
            runs[-1].append(number)
        else:
            runs.append([number])
    words = []
    for run in runs:
        if len(run) > 2:
            words.append(f"{run[0]}{dash}{run[-1]}")
        else:
            words += map(str, run)
    return ", ".join(words)


def bright_runs(code: str) -> Iterator[tuple[int, int]]:
    """First and last + 1 of the segments that are bright without a break, from the top."""
    start = 0
    for digit, run in groupby(code):
        end = start + len(list(run))
        if digit == "1":
            yield start, end
        start = end


def _colours(placed: Placed, inks: tuple[Ink, Ink]) -> Iterator[Item]:
    """Dark all over, bright runs on it: boxes side by side would show hairlines in between.

    The colours that go on into the flap begin a little inside the code, for the same reason.
    """
    tile = placed.tile
    bleed = min(_BLEED, tile.flap / 2)
    if bleed:
        inside = min(1.0, tile.width)
        yield from _stripes(placed, inks, tile.width - inside, inside + bleed, "bleed")
    yield from _stripes(placed, inks, 0.0, tile.width, "code")


def _stripes(
    placed: Placed, inks: tuple[Ink, Ink], left: float, width: float, role: Role
) -> Iterator[Item]:
    tile, segment = placed.tile, placed.tile.surface.segment
    x, y, end = placed.x + left, placed.y, tile.top + tile.height
    yield Box(x, y, width, tile.height, inks[0], role)
    for first, last in bright_runs(encode(tile.landmark, tile.surface.bits)):
        top, bottom = max(first * segment, tile.top), min(last * segment, end)
        if bottom - top > 1e-9:
            yield Box(x, y + top - tile.top, width, bottom - top, inks[1], role)


def _outline(placed: Placed) -> Iterator[Item]:
    """Where to cut (solid), just outside of the code; where colours begin at a seam (dashed)."""
    tile, half = placed.tile, _LINE / 2
    left, right = placed.x - half, placed.x + tile.width + tile.flap + half
    top = placed.y - tile.above
    end = placed.y + tile.height
    bottom = end + FOOT if tile.last_row else end + half
    yield _line((left, top), (left, bottom))
    yield _line((right, top), (right, bottom))
    yield _line((left, top), (right, top))
    reach = GUTTER - 1.0
    yield _line((left, bottom), (right, bottom))
    if not tile.last_row:
        yield _line((left - reach, bottom), (left, bottom))
        yield _line((right, bottom), (right + reach, bottom))
    if not tile.first_row:
        edge = placed.y - half
        yield _line((left - reach, edge), (right + reach, edge), dash=0.8)


def _line(a: tuple[float, float], b: tuple[float, float], dash: float = 0.0) -> Stroke:
    return Stroke((a, b), GREY, _LINE, dash)


def _seam_marks(placed: Placed) -> Iterator[Item]:
    """Half diamonds that become whole where two rows meet; arrows where the flap begins."""
    tile, y, end = placed.tile, placed.y, placed.y + placed.tile.height
    outer = placed.x + tile.width + tile.flap
    places = []
    if tile.column == 0:
        places.append(placed.x - GUTTER / 2)
    if tile.last_column:
        places.append(outer + GUTTER / 2)
    for x in places:
        if not tile.last_row:
            yield Shape(((x - 2, end), (x + 2, end), (x, end - 2.6)))
            yield Text(x, end - 3.4, joint_letter(tile.row), 2.6, "middle", bold=True)
        if not tile.first_row:
            yield Shape(((x - 2, y), (x + 2, y), (x, y + 2.6)))
            yield Text(x, y + 5.4, joint_letter(tile.row - 1), 2.6, "middle", bold=True)
    if not tile.flap:
        return
    edge = placed.x + tile.width
    yield Shape(((edge - 1.1, y - 2.6), (edge + 1.1, y - 2.6), (edge, y - 0.4)), GREY)
    yield Shape(((edge - 1.1, end + 2.6), (edge + 1.1, end + 2.6), (edge, end + 0.4)), GREY)
    bleed = min(_BLEED, tile.flap / 2)
    white = tile.flap - bleed
    choices = ["glue: the left edge comes onto this flap, up to the arrows", "glue flap", "glue"]
    if not tile.last_column:
        choices[0] = f"glue: part {tile.number + 1} comes onto this flap, up to the arrows"
    size = min(_SMALL, white * 0.6)
    words = _fitting(choices, tile.height - 2, size)
    x = edge + bleed + white / 2 + size * 0.35
    yield Text(x, y + tile.height / 2, words, size, "middle", angle=90, ink=GREY)


def _dark_ends(placed: Placed, dark: Ink) -> Iterator[Item]:
    """White paper beside a light colour would hide where the code begins and ends."""
    tile, inside = placed.tile, min(1.0, placed.tile.height)
    width = tile.width + tile.flap
    if tile.first_row:
        top = placed.y - tile.above
        yield Box(placed.x, top, width, tile.above + inside, dark, "bleed")
    if tile.last_row:
        top = placed.y + tile.height - inside
        yield Box(placed.x, top, width, inside + tile.below, dark, "bleed")


def _collar(placed: Placed, strong: Ink, faint: Ink) -> Iterator[Item]:
    """Above the first row: which way is up, and the landmark's number in large figures."""
    tile, x, y = placed.tile, placed.x, placed.y
    number = str(tile.landmark)
    part = f" · part {tile.number} of {tile.parts}" if tile.parts > 1 else ""
    name = f"landmark {number}"
    if tile.width < THIN:
        size = min(6.0, 0.9 * tile.width / text_width(number, 1.0, bold=True))
        middle = x + tile.width / 2
        yield Text(middle, y - 7.0, number, size, "middle", bold=True, ink=strong)
        yield arrow_up(middle, y - 1.5, min(5.0, 1.3 * tile.width), strong)
        yield _beside(placed, y - 4.0, [f"TOP · {name}{part}", f"TOP · {number}{part}", "TOP"])
        return
    base, scale = y - 3.5, min(1.0, tile.width / _NARROW)
    yield arrow_up(x + 4.2 * scale, base, 7.5 * scale, strong)
    yield Text(x + 8.5 * scale, base, "TOP", 4.2 * scale, bold=True, ink=strong)
    start = x + 10.5 * scale + text_width("TOP", 4.2 * scale, bold=True)
    end = x + tile.width - 2.0 * scale
    yield Text(end, base, number, 9.0 * scale, "end", bold=True, ink=strong)
    end -= text_width(number, 9.0 * scale, bold=True) + 2.0
    choices = [f"{name} · {tile.surface.bits} bits{part}", f"{name}{part}"]
    words = _fitting(choices, end - start)
    if words:
        yield Text((start + end) / 2, base, words, _SMALL, "middle", ink=faint)
    else:  # in a line of their own, above the number
        choices += [part.removeprefix(" · "), f"{tile.number}/{tile.parts}" if part else ""]
        words = _fitting(choices, tile.width - 2)
        yield Text(x + tile.width / 2, y - 10.9, words, 2.0, "middle", ink=faint)


def _foot(placed: Placed, ink: Ink) -> Item:
    """Below the last row."""
    tile = placed.tile
    words = _fitting([f"landmark {tile.landmark} · bottom", "bottom"], tile.width)
    x, y = placed.x + tile.width / 2, placed.y + tile.height + 4.6
    return Text(x, y, words, _SMALL, "middle", ink=ink)


def _cut_here(placed: Placed) -> Item:
    """Below every other row: where its edge goes."""
    tile = placed.tile
    below = f"part {tile.number + tile.columns}"
    choices = [
        f"cut here: this edge goes onto {below}, where its colours begin",
        f"cut here, glue onto {below}",
        "cut here",
    ]
    words = _fitting(choices, tile.width - 4, 2.2)
    x, y = placed.x + tile.width / 2, placed.y + tile.height + 3.0
    return Text(x, y, words, 2.2, "middle", ink=GREY)


def _glue_strip(placed: Placed) -> Iterator[Item]:
    """Above every other row: what it is, and what is glued onto it."""
    tile, x, y = placed.tile, placed.x, placed.y
    above = f"part {tile.number - tile.columns}"
    part = f"part {tile.number} of {tile.parts}"
    name = f"landmark {tile.landmark} · {part}"
    choices = [
        f"{name} · glue: {above} comes onto this strip, up to where the colours begin",
        f"{name} · glue: {above} comes onto this strip",
        f"{name} · glue under {above}",
        name,
        f"{tile.landmark}: {part}",
        f"{tile.landmark}: {tile.number}/{tile.parts}",
    ]
    base = y - tile.above / 2 + 0.35 * _SMALL
    arrow = min(5.0, tile.above - 1.5, 1.3 * tile.width)
    yield arrow_up(x + min(3.0, tile.width / 2), y - (tile.above - arrow) / 2, arrow, PALE)
    if tile.width < THIN:
        yield _beside(placed, base, choices)
    else:
        words = _fitting(choices, tile.width - 7.0)
        yield Text(x + 6.0, base, words, _SMALL, ink=GREY)


def _beside(placed: Placed, base: float, choices: Sequence[str]) -> Text:
    """Words to the right of a narrow tile, in its column: they are cut away."""
    tile = placed.tile
    x = tile.width + tile.flap + 1.5
    words = _fitting(choices, tile.outer_width - GUTTER - x)
    return Text(placed.x + x, base, words, _SMALL, ink=GREY)


def _ruler(x: float, bottom: float) -> Iterator[Item]:
    """Ten centimetres upright, for the codes stand upright too; the scale marks are to the left."""
    role: Role = "ruler"
    top = bottom - RULER
    yield Stroke(((x, top), (x, bottom)), BLACK, 0.2, role=role)
    for half in range(21):
        y = bottom - half * RULER / 20
        length = 1.4 if half % 2 else 3.0 if half % 10 else 4.0
        yield Stroke(((x - length, y), (x, y)), BLACK, 0.2)
    for number in (0, 5, 10):
        y = bottom - number * RULER / 10
        yield Text(x + 0.8, y + 0.8, str(number), 2.2)
    words = "Print at 100 %: this ruler must be 100 mm long."
    yield Text(x - 5.2, bottom - 4.0, words, 2.3, angle=90, ink=GREY)


def _fitting(choices: Sequence[str], width: float, size: float = _SMALL) -> str:
    """The first choice that is not longer than ``width``; nothing where none fits."""
    return next((words for words in choices if text_width(words, size) <= width), "")
