"""Tiles cover the code without gaps, fit on the paper, and need few sheets."""

from __future__ import annotations

import math
from collections import defaultdict

import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from polepilot.core.errors import InputError
from polepilot.core.landmark import SUPPORTED_BITS, LandmarkKind, Shape
from polepilot.core.printing.pages import Page, arrange
from polepilot.core.printing.paper import SIZES, Paper, parse_paper
from polepilot.core.printing.tiles import GUTTER, MARGIN, Tile

A4 = parse_paper("A4")

kinds = st.builds(
    LandmarkKind,
    bits=st.sampled_from(SUPPORTED_BITS),
    segment=st.floats(0.002, 0.3),
    diameter=st.floats(0.002, 0.4),
    shape=st.sampled_from(["cylinder", "flat"]),
)
papers = st.one_of(
    st.sampled_from(sorted(SIZES)).map(parse_paper),
    st.tuples(st.floats(140, 2000), st.floats(140, 2000)).map(lambda size: Paper("own", *size)),
    st.floats(140, 2000).map(lambda width: Paper("roll", width, None)),
)


def tiles_of(pages: tuple[Page, ...]) -> dict[int, list[Tile]]:
    found: dict[int, list[Tile]] = defaultdict(list)
    for page in pages:
        for placed in page.placed:
            found[placed.tile.landmark].append(placed.tile)
    return {number: sorted(tiles, key=lambda t: t.number) for number, tiles in found.items()}


@settings(max_examples=150)
@given(kinds, papers, st.floats(5, 40), st.sets(st.integers(1, 15), min_size=1, max_size=5))
def test_tiles_cover_the_code_and_fit_the_paper(
    kind: LandmarkKind, paper: Paper, overlap: float, ids: set[int]
) -> None:
    try:
        pages = arrange(sorted(ids), kind, paper, overlap)
    except InputError as error:
        assume("sheets" not in str(error))
        raise
    found = tiles_of(pages)
    assert set(found) == ids
    width = kind.diameter * 1000 * (math.pi if kind.shape == "cylinder" else 1)
    for tiles in found.values():
        assert [tile.number for tile in tiles] == list(range(1, tiles[0].parts + 1))
        grid = {(tile.row, tile.column): tile for tile in tiles}
        for (row, column), tile in grid.items():
            # Each tile begins exactly where its neighbours end.
            assert tile.left == pytest.approx(
                0 if column == 0 else grid[row, column - 1].left + grid[row, column - 1].width
            )
            assert tile.top == pytest.approx(
                0 if row == 0 else grid[row - 1, column].top + grid[row - 1, column].height
            )
            assert tile.width > 0
            assert tile.height > 0
        last = tiles[-1]
        assert last.left + last.width == pytest.approx(width)
        assert last.top + last.height == pytest.approx(kind.height * 1000)
    for page in pages:
        sides = {round(page.width, 6), round(page.height, 6)}
        if paper.height is not None:
            assert sides == {round(paper.width, 6), round(paper.height, 6)}
        else:
            assert page.width == paper.width
            assert page.height <= 5000
        taken = []
        for placed in page.placed:
            tile = placed.tile
            box = (
                placed.x - GUTTER,
                placed.y - tile.above,
                placed.x + tile.width + tile.flap + GUTTER,
                placed.y + tile.height + tile.below,
            )
            assert box[0] >= MARGIN - 1e-6
            assert box[1] >= MARGIN - 1e-6
            assert box[2] <= page.width - MARGIN + 1e-6
            assert box[3] <= page.height - MARGIN + 1e-6
            for other in taken:
                apart = (
                    box[2] <= other[0] + 1e-6
                    or other[2] <= box[0] + 1e-6
                    or box[3] <= other[1] + 1e-6
                    or other[3] <= box[1] + 1e-6
                )
                assert apart
            taken.append(box)


@pytest.mark.parametrize(
    ("kind", "paper", "count", "sheets", "parts"),
    [
        (LandmarkKind(), "A4", 15, 60, 4),
        (LandmarkKind(), "Letter", 15, 60, 4),
        (LandmarkKind(), "A3", 15, 30, 2),
        (LandmarkKind(), "A1", 15, 8, 1),
        (LandmarkKind(), "A0", 15, 4, 1),
        (LandmarkKind(shape="flat"), "A4", 15, 23, 3),
        (LandmarkKind(shape="flat"), "A3", 15, 10, 2),
        (LandmarkKind(segment=0.01, diameter=0.03, shape="flat"), "A4", 8, 2, 1),
        (LandmarkKind(bits=8, segment=0.12, diameter=0.17), "roll-914", 3, 3, 1),
    ],
)
def test_few_sheets(kind: LandmarkKind, paper: str, count: int, sheets: int, parts: int) -> None:
    pages = arrange(range(1, count + 1), kind, parse_paper(paper), 10.0)
    assert len(pages) == sheets
    assert {tile.parts for tiles in tiles_of(pages).values() for tile in tiles} == {parts}


def test_wide_paper_is_shared() -> None:
    """Flat stickers stand side by side on A4."""
    pages = arrange([1, 2], LandmarkKind(shape="flat"), A4, 10.0)
    assert len({placed.x for placed in pages[0].placed}) == 2
    assert (pages[0].width, pages[0].height) == (210, 297)


def test_a_tube_lies_sideways_on_a4() -> None:
    pages = arrange([1], LandmarkKind(), A4, 10.0)
    assert {(page.width, page.height) for page in pages} == {(297.0, 210.0)}


def test_seams_lie_between_segments_where_that_costs_no_sheet() -> None:
    pages = arrange([1], LandmarkKind(shape="flat"), A4, 10.0)
    assert [tile.top / 50 for tile in tiles_of(pages)[1]] == [0, 5, 10]
    # A tube on A4 needs four sheets: three seams, of which one has to be inside a segment, and
    # that one keeps away from its ends.
    pages = arrange([1], LandmarkKind(), A4, 10.0)
    inside = [tile.top % 50 for tile in tiles_of(pages)[1] if tile.top % 50]
    assert len(inside) == 1
    assert 10 <= inside[0] <= 40


@pytest.mark.parametrize("shape", ["cylinder", "flat"])
def test_absurd_sizes_are_refused_at_once(shape: Shape) -> None:
    giant = LandmarkKind(bits=8, segment=10.0, diameter=10.0, shape=shape)
    with pytest.raises(InputError, match=r"would need [\d,]+ sheets of A4: expected at most 1,000"):
        arrange(range(1, 256), giant, A4, 10.0)


def test_many_sheets_are_refused() -> None:
    with pytest.raises(InputError, match=r"would need 1,\d{3} sheets"):
        arrange(range(1, 256), LandmarkKind(bits=8, diameter=0.05), A4, 10.0)
