"""Landmarks cut into tiles that fit on paper, and the tiles put on as few sheets as possible.

Millimetres. The surface of a landmark is its code unrolled: as wide as the tube's circumference
(or the flat sticker), as tall as the code. A tile is a rectangle of that surface with what is
needed around it: a collar at the landmark's top and foot, a strip to glue at the top of every
other tile, a flap to glue at the right where something follows, and gutters for marks that are cut
away.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, field

from polepilot.core.errors import InputError
from polepilot.core.landmark import LandmarkKind
from polepilot.core.printing.paper import LARGEST, SMALLEST, Paper

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
BETWEEN = 3.0
"""Between tiles one above the other."""
THIN, WORDS_BESIDE = 20.0, 27.0
"""Thinner tiles have their words beside them, in a wider column."""
MOST_SHEETS = 1000

_FINEST_CUT = 5.0
_NEAR_A_BORDER = 10.0
_WHOLE_SEGMENTS = 20.0
"""Segments shorter than this are never cut."""
_SEAM_COST = 0.25
"""What one more tile costs, in sheets: gluing takes time, and every seam adds an error."""
_LOOK_BACK = 30
"""How many sheets stay open for tiles that would still fit."""
_ROLL_LENGTH = 2000.0
"""A roll is cut about here, unless a single landmark is longer."""
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


@dataclass(frozen=True, slots=True)
class Placed:
    """A tile on a sheet; (x, y) is the top left corner of its part of the code."""

    tile: Tile
    x: float
    y: float


@dataclass(frozen=True, slots=True)
class Page:
    """A sheet of paper with its tiles."""

    width: float
    height: float
    placed: tuple[Placed, ...]


@dataclass(slots=True)
class _Column:
    x: float
    width: float
    bottom: float = 0.0
    """How far down it is full, from the top of the content."""


@dataclass(slots=True)
class _OpenPage:
    columns: list[_Column] = field(default_factory=list)
    placed: list[Placed] = field(default_factory=list)


def arrange(
    ids: Sequence[int], kind: LandmarkKind, paper: Paper, overlap: float
) -> tuple[Page, ...]:
    """The sheets for these landmarks, upright or sideways, whichever needs less paper and glue.

    Raises:
        InputError: more sheets than anybody would print.
    """
    surface = Surface.of(kind)
    _refuse_absurd(len(ids), surface, paper)
    best: tuple[float, tuple[Page, ...]] | None = None
    for width, height in _ways_up(paper):
        across = width - 2 * MARGIN - RULER_STRIP
        down = height - 2 * MARGIN - HEADER
        parts = list(_cut(surface, across, down, overlap))
        tiles = [Tile(number, surface, *part, overlap) for number in ids for part in parts]
        if paper.height is None:
            tallest = max(tile.outer_height for tile in tiles)
            down = min(down, max(_ROLL_LENGTH, tallest))
        for order in (tiles, sorted(tiles, key=lambda tile: -tile.outer_height)):
            pages = _pack(order, across, down)
            cost = len(pages) + _SEAM_COST * len(tiles)
            if best is None or cost < best[0] - _TINY:
                sized = (
                    (width, _used(page) if paper.height is None else height, page) for page in pages
                )
                best = (cost, tuple(Page(w, h, tuple(page)) for w, h, page in sized))
    assert best is not None
    if len(best[1]) > MOST_SHEETS:
        raise _too_many(len(best[1]), paper)
    return best[1]


def _ways_up(paper: Paper) -> Iterator[tuple[float, float]]:
    if paper.height is None:
        yield paper.width, LARGEST
        return
    short, long = sorted((paper.width, paper.height))
    yield short, long
    if short != long:
        yield long, short


def _used(placed: Iterable[Placed]) -> float:
    """How long a piece of the roll has to be."""
    bottom = max(p.y + p.tile.height + p.tile.below for p in placed)
    return max(bottom + MARGIN, SMALLEST)


def _cut(
    surface: Surface, across: float, down: float, overlap: float
) -> Iterator[tuple[int, int, int, int, float, float, float, float]]:
    """Row, rows, column, columns, left, top, width, height of each part, row by row."""
    room = across - 2 * GUTTER
    with_flap = room - overlap
    columns = max(1, math.ceil(surface.width / with_flap - _TINY))
    if columns > 1 and not surface.closed and surface.width <= room + (columns - 2) * with_flap:
        columns -= 1  # the last one needs no flap
    width = surface.width / columns

    def tallest(first: bool, last: bool) -> float:
        above, below = COLLAR if first else overlap, FOOT if last else BELOW_SEAM
        return down - above - below

    tops = seams(surface, tallest)
    for row, (top, bottom) in enumerate(zip(tops, (*tops[1:], surface.height), strict=True)):
        for column in range(columns):
            size = (column * width, top, width, bottom - top)
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


def _pack(tiles: Iterable[Tile], across: float, down: float) -> list[list[Placed]]:
    """First fit: each tile goes below others in a column, beside them, or on a new sheet."""
    pages: list[_OpenPage] = []
    for tile in tiles:
        for page in pages[-_LOOK_BACK:]:
            column = _column_for(tile, page, across, down)
            if column is not None:
                break
        else:
            page, column = _OpenPage(), _Column(0.0, tile.outer_width)
            page.columns.append(column)
            pages.append(page)
        start = column.bottom + (BETWEEN if column.bottom else 0.0)
        column.bottom = start + tile.outer_height
        page.placed.append(
            Placed(
                tile,
                MARGIN + RULER_STRIP + column.x + GUTTER,
                MARGIN + HEADER + start + tile.above,
            )
        )
    return [page.placed for page in pages]


def _column_for(tile: Tile, page: _OpenPage, across: float, down: float) -> _Column | None:
    for column in page.columns:
        fits = column.bottom + BETWEEN + tile.outer_height <= down + _TINY
        if fits and tile.outer_width <= column.width + _TINY:
            return column
    x = sum(column.width for column in page.columns)
    if x + tile.outer_width > across + _TINY:
        return None
    page.columns.append(_Column(x, tile.outer_width))
    return page.columns[-1]


def _refuse_absurd(count: int, surface: Surface, paper: Paper) -> None:
    """Before any time is spent: more surface than the sheets could hold."""
    area = count * surface.width * surface.height
    sheet = paper.width * (paper.height if paper.height is not None else LARGEST)
    if area > MOST_SHEETS * sheet:
        raise _too_many(math.ceil(area / sheet), paper)


def _too_many(sheets: int, paper: Paper) -> InputError:
    return InputError(
        f"this would need {sheets:,} sheets of {paper.name}: expected at most {MOST_SHEETS:,};"
        " choose larger paper, fewer ids or a smaller landmark."
    )
