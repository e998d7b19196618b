"""The first sheet: in plain words, what is in the file and how a landmark is made of it."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from polepilot.core.landmark import LandmarkKind, encode, id_set, spacing
from polepilot.core.printing.artwork import (
    LIGHT,
    arrow_up,
    bright_runs,
    ids_in_words,
    joint_letter,
    sheet_items,
)
from polepilot.core.printing.drawing import (
    BLACK,
    GREY,
    PALE,
    Box,
    Ink,
    Item,
    Sheet,
    Stroke,
    Text,
)
from polepilot.core.printing.fonts import wrap
from polepilot.core.printing.pages import Page
from polepilot.core.printing.paper import SIZES, Paper
from polepilot.core.printing.tiles import COLLAR, FOOT, HEADER, MARGIN, RULER_STRIP, Tile

_LARGEST_OWN = (300.0, 432.0)
"""Sheets up to this size carry the instructions themselves; larger ones would be a waste."""
_FIGURE = 66.0
_LEADING = 1.38


@dataclass(frozen=True, slots=True)
class Contents:
    """What the instructions speak of."""

    ids: tuple[int, ...]
    kind: LandmarkKind
    paper: Paper
    pages: tuple[Page, ...]
    inks: tuple[Ink, Ink]
    title: str

    @property
    def tiles(self) -> tuple[Tile, ...]:
        """The tiles of the first landmark, row by row."""
        all_tiles = (placed.tile for page in self.pages for placed in page.placed)
        own = [tile for tile in all_tiles if tile.landmark == self.ids[0]]
        return tuple(sorted(own, key=lambda tile: tile.number))


def instructions(contents: Contents) -> Sheet:
    """The sheet of instructions; its words are as large as they can be, within reason."""
    width, height = _size(contents.paper)
    figure = _FIGURE if width >= 190 else 0.0
    left = MARGIN + RULER_STRIP + 4.0
    room = width - MARGIN - left - (figure + 6.0 if figure else 0.0)
    top, bottom = MARGIN + HEADER + 2.0, height - MARGIN
    size = 4.0
    items = list(_words(contents, left, top, room, size))
    while size > 1.6 and max(item.y for item in items) > bottom:
        size -= 0.1
        items = list(_words(contents, left, top, room, size))
    page = f"sheet 1 of {len(contents.pages) + 1}"
    items_of_sheet: list[Item] = list(sheet_items(width, height, ["Polepilot landmarks"], page))
    items_of_sheet += items
    if figure:
        area = (width - MARGIN - figure, top + 6.0, figure, min(bottom - top, 190.0) - 6.0)
        items_of_sheet += _figure(contents, *area)
    return Sheet(width, height, "How to make the landmarks", tuple(items_of_sheet))


def spacing_in_words(ids: Sequence[int], bits: int) -> str:
    """How far apart these ids are, and what to take instead where they are too near."""
    if len(ids) < 2:
        return ""
    distance = spacing(ids, bits)
    if distance == 1:
        better = id_set(bits)
        listed = ids_in_words(better) if len(better) <= 32 else f"{len(better)} ids"
        return (
            "Some of these ids differ in one segment only: where that segment is hidden or dirty,"
            f" the robot may take one landmark for another. Safer with {bits} bits: {listed}"
            " (--ids safe)."
        )
    noticed = "a hidden or dirty segment" if distance == 2 else f"{distance - 1} wrong segments"
    return (
        f"Any two of these ids differ in at least {distance} segments: {noticed} cannot turn one"
        " of them into another. That helps only if the robot knows which ids exist: draw just"
        " these on the map."
    )


def _size(paper: Paper) -> tuple[float, float]:
    if paper.height is None:
        return SIZES["A4"]
    short, long = sorted((paper.width, paper.height))
    return (short, long) if short <= _LARGEST_OWN[0] and long <= _LARGEST_OWN[1] else SIZES["A4"]


def _words(contents: Contents, left: float, top: float, room: float, size: float) -> Iterator[Text]:
    y = top + 2.0 * size
    title_size = size * 2.0
    for line in wrap(contents.title, title_size, room, bold=True):
        yield Text(left, y, line, title_size, bold=True)
        y += title_size * 1.2
    for line in wrap(_subtitle(contents), size, room):
        yield Text(left, y, line, size, ink=GREY)
        y += size * _LEADING
    y += size * 0.6
    for paragraph in _facts(contents):
        for line in wrap(paragraph, size, room):
            yield Text(left, y, line, size)
            y += size * _LEADING
        y += size * 0.5
    indent = size * 1.7
    for number, (head, body) in enumerate(_steps(contents), start=1):
        y += size * 0.35
        yield Text(left, y, str(number), size, bold=True)
        yield Text(left + indent, y, head, size, bold=True)
        y += size * _LEADING
        for line in wrap(body, size, room - indent):
            yield Text(left + indent, y, line, size)
            y += size * _LEADING


def _subtitle(contents: Contents) -> str:
    kind = contents.kind
    thing = (
        f"for tubes {_mm(kind.diameter)} thick"
        if kind.shape == "cylinder"
        else f"flat stickers {_mm(kind.diameter)} wide"
    )
    return (
        f"{kind.bits} bits: {kind.segments} segments of {_mm(kind.segment)},"
        f" {_mm(kind.height)} from end to end; {thing}"
    )


def _facts(contents: Contents) -> Iterator[str]:
    count, sheets = len(contents.ids), len(contents.pages)
    tiles = contents.tiles
    each = "in one piece" if len(tiles) == 1 else f"in {len(tiles)} parts"
    if count > 1:
        each += " each"
    noun = "landmark" if count == 1 else "landmarks"
    listed = ids_in_words(contents.ids)
    names = "" if contents.title.endswith(listed) else f": {listed}"
    yield (
        f"{count} {noun}, {each}, on {sheets} {'sheet' if sheets == 1 else 'sheets'} of"
        f" {contents.paper.name}{names}."
    )
    words = spacing_in_words(contents.ids, contents.kind.bits)
    if words:
        yield words


def _steps(contents: Contents) -> Iterator[tuple[str, str]]:
    kind, tiles = contents.kind, contents.tiles
    rows, columns = tiles[0].rows, tiles[0].columns
    # Inks that are known by their process colours are our own: orange and black.
    own = contents.inks[1].cmyk is not None
    bright = "orange" if own else "bright"
    looks = "; the orange must look like a traffic cone, not like skin" if own else ""
    yield (
        "Print at 100 %",
        "Choose “actual size”, never “fit to page”. Take matt paper of 120 g/m² or more, or matt"
        " self-adhesive film: gloss mirrors lamps and windows, and a mirrored lamp is neither"
        f" of the two colours. Take the printer's best quality{looks}.",
    )
    yield (
        "Measure the ruler on the sheets",
        "It must be 100 mm long, within half a millimetre. Each percent that it is too short or"
        " too long makes every distance wrong by one percent.",
    )
    cut = "Cut along the solid lines."
    if rows > 1:
        cut = (
            "Cut along the solid lines that run across. Leave the long sides for later: the half"
            " diamonds beside them show how the parts go together."
        )
    if columns > 1:
        cut += " Where a part joins another sideways, cut its left side along the colours."
    yield ("Cut", cut + " The paper above the first colour and below the last one stays on.")
    if columns > 1:
        yield (
            "Join the parts of a row",
            "Glue each part onto the flap at the right of the one before, up to the small arrows;"
            " the edges of the colours must run straight on.",
        )
    if rows > 1:
        letters = joint_letter(0) if rows == 2 else f"{joint_letter(0)} to {joint_letter(rows - 2)}"
        yield (
            "Join the rows" if columns > 1 else "Join the parts",
            "Glue each upper part onto the white strip of the next one: its lower edge lies"
            " exactly on the dashed line, where the colours begin, and the half diamonds"
            f" ({letters}) become whole."
            f" From the first colour to the last it must then be {_mm(kind.height)}; one"
            f" millimetre too much or too little is {0.1 / kind.height:.2g} % of every distance."
            " Then cut the long sides.",
        )
    if kind.shape == "cylinder":
        yield (
            "Wrap the tube",
            f"It is {_mm(kind.diameter)} thick, {_mm(tiles[0].surface.width / 1000)} around; half"
            " a millimetre more or less does no harm. The left edge goes onto the flap, up to the"
            " small arrows. Glue the whole back, so that nothing bulges.",
        )
    else:
        yield (
            "Stick it on something flat",
            "A board or a wall, without bubbles, plumb; the robot measures to its middle line.",
        )
    yield (
        "Set it up",
        "The arrow and the number are at the top: upside down it is another landmark. It stands"
        f" plumb, nothing covers any of it, and no other {bright} thing touches it. Measure"
        " where it stands and draw it on the map.",
    )
    yield (
        "Look after it",
        "Outdoors and in workshops, laminate it matt. Renew it when the colours fade or a segment"
        " is scratched.",
    )


def _figure(contents: Contents, x: float, y: float, width: float, height: float) -> Iterator[Item]:
    """The finished landmark, small: which way is up, its parts, and what to measure."""
    kind, number = contents.kind, contents.ids[0]
    tall, thick = kind.height * 1000, kind.diameter * 1000
    caption = 9.0
    scale = min((height - caption) / (tall + COLLAR + FOOT), 22.0 / thick)
    w, segment = max(thick * scale, 4.0), kind.segment * 1000 * scale
    left, top = x + width * 0.5 - w / 2, y + COLLAR * scale
    foot = top + tall * scale
    above, below = COLLAR * scale, FOOT * scale
    frame = ((left, top - above), (left + w, top - above), (left + w, foot + below))
    dark, bright = contents.inks
    if bright.luminance > LIGHT:
        yield Box(left, top - above, w, above + tall * scale + below, dark)
    yield Box(left, top, w, tall * scale, dark)
    for first, last in bright_runs(encode(number, kind.bits)):
        yield Box(left, top + first * segment, w, (last - first) * segment, bright)
    yield Stroke((*frame, (left, foot + below), frame[0]), GREY, 0.2)
    yield arrow_up(left - 5.0, top + 1.0, 6.0)
    yield Text(left - 5.0, top + 4.2, "top", 2.8, "middle", bold=True)
    measure = left - 12.0
    yield Stroke(((measure, top), (measure, foot)), BLACK, 0.2)
    for end in (top, foot):
        yield Stroke(((measure - 1.5, end), (left - 0.5 if end == foot else measure + 1.5, end)))
    middle = (top + foot) / 2
    yield Text(measure - 1.2, middle, _mm(kind.height), 3.0, "middle", angle=90)
    side = left + w
    for tile in contents.tiles:
        if tile.column:
            continue
        low, high = top + (tile.top + tile.height) * scale, top + tile.top * scale
        name = f"part {tile.number}"
        if tile.columns > 1:
            name = f"parts {tile.number}–{tile.number + tile.columns - 1}"
        named = low - high > 8.0
        if tile.parts > 1 and named:
            yield Text(side + 3.0, (low + high) / 2 + 1.0, name, 2.8)
        if not tile.last_row:
            yield Stroke(((side + 1.0, low), (side + 8.0, low)), PALE, 0.3)
            if named:
                yield Text(side + 9.0, low + 1.0, joint_letter(tile.row), 2.8, bold=True)
    words = f"landmark {number}"
    yield Text(x + width / 2, foot + below + 5.0, words, 2.8, "middle", ink=GREY)


def _mm(metres: float) -> str:
    """A length as it is measured with a ruler."""
    return f"{metres * 1000:.1f}".removesuffix(".0") + " mm"
