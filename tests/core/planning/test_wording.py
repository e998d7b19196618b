"""Lengths as people read them."""

from __future__ import annotations

import pytest

from polepilot.core.planning.wording import in_words, measured_in_words


@pytest.mark.parametrize(
    ("length", "words"),
    [(0.4, "40 cm"), (0.125, "12.5 cm"), (0.0, "0 cm"), (9.99, "999 cm"), (12.34, "12.3 m")],
)
def test_centimetres_below_ten_metres(length: float, words: str) -> None:
    assert in_words(length) == words


def test_measured_lengths_are_whole_centimetres() -> None:
    assert measured_in_words(0.1037) == "10 cm"
    assert measured_in_words(0.0042) == "0.4 cm"
