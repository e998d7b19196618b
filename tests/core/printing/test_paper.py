from __future__ import annotations

from itertools import pairwise

import pytest

from polepilot.core.errors import InputError
from polepilot.core.printing.paper import SIZES, parse_paper


@pytest.mark.parametrize("name", SIZES)
def test_names_are_known_in_any_spelling(name: str) -> None:
    for text in (name, name.lower(), f" {name.upper()} "):
        paper = parse_paper(text)
        assert (paper.name, paper.width, paper.height) == (name, *SIZES[name])


def test_a_sizes_follow_from_each_other() -> None:
    """Half of a sheet is the next size, and A0 is a square metre (ISO 216, to a millimetre)."""
    for larger, smaller in pairwise(("A0", "A1", "A2", "A3", "A4", "A5")):
        assert SIZES[smaller] == (SIZES[larger][1] // 2, SIZES[larger][0])
    assert SIZES["A0"][0] * SIZES["A0"][1] == pytest.approx(1e6, rel=1e-3)


def test_inches() -> None:
    assert SIZES["Letter"] == pytest.approx((8.5 * 25.4, 11 * 25.4))
    assert SIZES["Legal"] == pytest.approx((8.5 * 25.4, 14 * 25.4))
    assert SIZES["Tabloid"] == pytest.approx((11 * 25.4, 17 * 25.4))


@pytest.mark.parametrize("text", ["330x483", "330.0 x 483 mm", "330×483"])
def test_any_size_in_millimetres(text: str) -> None:
    paper = parse_paper(text)
    assert (paper.width, paper.height) == (330.0, 483.0)


@pytest.mark.parametrize("text", ["roll-610", "roll 610", "Roll:610mm", "roll610"])
def test_rolls_have_no_height(text: str) -> None:
    paper = parse_paper(text)
    assert (paper.width, paper.height) == (610.0, None)


@pytest.mark.parametrize(
    "text",
    [
        "",
        "A6",
        "B4",
        "x",
        "210x",
        "-210x297",
        "nanxnan",
        "1e3x297",
        "A4 A4",
        "roll",
        "139x300",
        "300x5001",
        "roll-9999",
        "0x0",
        "99999999999x297",
        "210x297x3",
        "²10x297",
    ],
)
def test_other_paper_is_refused_in_one_sentence(text: str) -> None:
    with pytest.raises(InputError, match=r"^paper .*expected") as caught:
        parse_paper(text)
    assert "\n" not in str(caught.value)
