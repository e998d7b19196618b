"""Tiles put on sheets of paper: as few sheets, and as few seams, as possible. Millimetres."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field

from polepilot.core.errors import InputError
from polepilot.core.landmark import LandmarkKind
from polepilot.core.printing.paper import LARGEST, SMALLEST, Paper
from polepilot.core.printing.tiles import (
    GUTTER,
    HEADER,
    MARGIN,
    RULER_STRIP,
    Surface,
    Tile,
    cut,
)

BETWEEN = 3.0
"""Between tiles one above the other."""
MOST_SHEETS = 1000

_SEAM_COST = 0.25
"""What one more tile costs, in sheets: gluing takes time, and every seam adds an error."""
_LOOK_BACK = 30
"""How many sheets stay open for tiles that would still fit."""
_ROLL_LENGTH = 2000.0
"""A roll is cut about here, unless a single landmark is longer."""
_TINY = 1e-6


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
        parts = list(cut(surface, across, down, overlap))
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
