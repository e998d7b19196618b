"""The calibration board on paper."""

from __future__ import annotations

import pytest

from polepilot.core.errors import InputError
from polepilot.core.printing.board import board_drawing
from polepilot.core.printing.drawing import Box, Stroke
from polepilot.core.printing.paper import SIZES


@pytest.mark.parametrize(
    ("size", "paper"),
    [
        ((0.27, 0.18), SIZES["A4"][::-1]),
        ((0.18, 0.27), SIZES["A4"]),
        ((0.10, 0.10), SIZES["A4"]),
        ((0.40, 0.25), SIZES["A3"][::-1]),
        ((1.0, 0.7), SIZES["A0"][::-1]),
    ],
)
def test_everything_is_on_the_sheet_to_scale(
    size: tuple[float, float], paper: tuple[float, float]
) -> None:
    width, height = size
    corners = [(0.0, 0.0, 0.03, 0.03), (width - 0.03, height - 0.03, 0.03, 0.03)]
    (sheet,) = board_drawing("Board", width, height, corners, "words").sheets
    assert (sheet.width, sheet.height) == paper
    first, last = (item for item in sheet.items if isinstance(item, Box))
    assert first.width == first.height == pytest.approx(30)
    assert last.x + last.width - first.x == pytest.approx(width * 1000)
    assert last.y + last.height - first.y == pytest.approx(height * 1000)
    assert first.x >= 8
    assert first.y >= 6
    assert last.x + last.width <= sheet.width - 8
    ruler, *ticks = (item for item in sheet.items if isinstance(item, Stroke))
    assert ruler.points[1][0] - ruler.points[0][0] == pytest.approx(100)
    highest = min(y for stroke in ticks for _, y in stroke.points)
    assert highest > last.y + last.height + 1
    assert ruler.points[0][1] < sheet.height - 5


def test_a_board_that_fits_no_paper() -> None:
    with pytest.raises(InputError, match="larger than A0"):
        board_drawing("Board", 1.3, 1.0, [], "")
