"""Landmarks cut into tiles that fit on paper.

Millimetres. The surface of a landmark is its code unrolled: as wide as the tube's circumference
(or the flat sticker), as tall as the code. A tile is a rectangle of that surface with what is
needed around it: a collar at the landmark's top and foot, a strip to glue at the top of every
other tile, a flap to glue at the right where something follows, and gutters for marks that are cut
away.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass

from polepilot.core.landmark import LandmarkKind

MARGIN = 8.0
"""What ordinary printers cannot reach, at each edge of the sheet."""
RULER_STRIP = 12.0
"""At the left of each sheet, for the ruler."""
HEADER = 5.0
GUTTER = 6.0
"""At the left and right of a tile, for marks."""
COLLAR, FOOT = 13.0, 7.0
"""White paper above and below the code, which stays on the landmark."""
BELOW_SEAM = 4.0
THIN, WORDS_BESIDE = 20.0, 27.0
"""Thinner tiles have their words beside them, in a wider column."""
_FINEST_CUT = 5.0
_NEAR_A_BORDER = 10.0
_WHOLE_SEGMENTS = 20.0
"""Segments shorter than this are never cut."""
_TINY = 1e-6


@dataclass(frozen=True, slots=True)
class Surface:
    """The code of a kind of landmark, unrolled."""

    width: float
    segment: float
    segments: int
    closed: bool
    """Whether the right edge meets the left one, around a tube."""

    @classmethod
    def of(cls, kind: LandmarkKind) -> Surface:
        closed = kind.shape == "cylinder"
        width = kind.diameter * 1000 * (math.pi if closed else 1.0)
        return cls(width, kind.segment * 1000, kind.segments, closed)

    @property
    def height(self) -> float:
        return self.segment * self.segments

    @property
    def bits(self) -> int:
        return (self.segments - 5) // 2


@dataclass(frozen=True, slots=True)
class Tile:
    """A rectangle of a landmark's surface. Rows count from the top, columns from the left."""

    landmark: int
    surface: Surface
    row: int
    rows: int
    column: int
    columns: int
    left: float
    top: float
    width: float
    height: float
    overlap: float

    @property
    def number(self) -> int:
        """Which part of the landmark it is, from 1, row by row."""
        return self.row * self.columns + self.column + 1

    @property
    def parts(self) -> int:
        return self.rows * self.columns

    @property
    def first_row(self) -> bool:
        return self.row == 0

    @property
    def last_row(self) -> bool:
        return self.row == self.rows - 1

    @property
    def last_column(self) -> bool:
        return self.column == self.columns - 1

    @property
    def above(self) -> float:
        """Paper above the code: the collar, or the strip under the tile above."""
        return COLLAR if self.first_row else self.overlap

    @property
    def below(self) -> float:
        return FOOT if self.last_row else BELOW_SEAM

    @property
    def flap(self) -> float:
        """Paper at the right that goes under the left edge of what follows."""
        return self.overlap if self.surface.closed or not self.last_column else 0.0

    @property
    def outer_width(self) -> float:
        words = WORDS_BESIDE if self.width < THIN else 0.0
        return self.width + self.flap + 2 * GUTTER + words

    @property
    def outer_height(self) -> float:
        return self.above + self.height + self.below


def cut(
    surface: Surface, across: float, down: float, overlap: float
) -> Iterator[tuple[int, int, int, int, float, float, float, float]]:
    """Row, rows, column, columns, left, top, width, height of each part, row by row.

    ``across`` and ``down`` are what a sheet has room for.
    """
    room = across - 2 * GUTTER
    with_flap = room - overlap
    columns = max(1, math.ceil(surface.width / with_flap - _TINY))
    if columns > 1 and not surface.closed and surface.width <= room + (columns - 2) * with_flap:
        columns -= 1  # the last one needs no flap, and may be wider for that
    width = min(surface.width / columns, with_flap)
    last = surface.width - (columns - 1) * width

    def tallest(first: bool, last: bool) -> float:
        above, below = COLLAR if first else overlap, FOOT if last else BELOW_SEAM
        return down - above - below

    tops = seams(surface, tallest)
    for row, (top, bottom) in enumerate(zip(tops, (*tops[1:], surface.height), strict=True)):
        for column in range(columns):
            size = (column * width, top, last if column == columns - 1 else width, bottom - top)
            yield row, len(tops), column, columns, *size


def seams(surface: Surface, tallest: Callable[[bool, bool], float]) -> tuple[float, ...]:
    """Where the rows of tiles begin, from the top of the code, 0 first.

    ``tallest(first, last)`` is how much of the code fits on one tile. As few rows as possible,
    then as many seams as possible where two segments meet, none close beside such a border.
    """
    cells = 1
    if surface.segment >= _WHOLE_SEGMENTS:
        finest = max(_FINEST_CUT, tallest(False, False) / 60)
        cells = max(1, math.ceil(surface.segment / finest))
    cell, count = surface.segment / cells, surface.segments * cells
    best: list[tuple[int, int]] = [(0, 0)]
    before = [0]
    for end in range(1, count + 1):
        last = end == count
        reach = math.floor(tallest(False, last) / cell + _TINY)
        starts = list(range(end - 1, max(end - reach, 1) - 1, -1))
        if end * cell <= tallest(True, last) + _TINY:
            starts.append(0)
        own = 0 if last else _blemish(end, cells, cell)
        found: tuple[tuple[int, int], int] | None = None
        for start in starts:
            cost = (best[start][0] + 1, best[start][1] + own)
            if found is None or cost < found[0]:
                found = (cost, start)
        assert found is not None, "a cell is shorter than any tile"
        best.append(found[0])
        before.append(found[1])
    tops: list[float] = []
    at = count
    while at:
        at = before[at]
        tops.append(at * cell)
    return tuple(reversed(tops))


def _blemish(at: int, cells: int, cell: float) -> int:
    """How ugly a seam at this cell is: 0 between segments, more inside, most just beside."""
    inside = at % cells
    if inside == 0:
        return 0
    return 1 if min(inside, cells - inside) * cell >= _NEAR_A_BORDER else 5
