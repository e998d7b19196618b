"""Where codes that are too tall for the paper are cut."""

from __future__ import annotations

import math
from itertools import pairwise

import pytest
from hypothesis import given
from hypothesis import strategies as st

from polepilot.core.landmark import SUPPORTED_BITS
from polepilot.core.printing.tiles import Surface, seams


@given(st.sampled_from(SUPPORTED_BITS), st.floats(2, 400), st.floats(60, 500), st.floats(-30, 0))
def test_no_fewer_rows_would_do(bits: int, segment: float, room: float, less: float) -> None:
    """Never more rows than cutting anywhere needs, but for the fineness of the cuts."""
    surface = Surface(100.0, segment, 2 * bits + 5, closed=True)

    def tallest(first: bool, last: bool) -> float:
        return room + less * (first + last)

    tops = seams(surface, tallest)
    edges = [*tops, surface.height]
    for index, (top, bottom) in enumerate(pairwise(edges)):
        first, last = index == 0, index == len(tops) - 1
        assert bottom - top <= tallest(first, last) + 1e-5
    finest = segment if segment < 20 else 5.0 + room / 60
    least = (surface.height - 2 * less) / room
    assert len(tops) <= math.ceil((surface.height - 2 * less) / (room - finest)) + 1e-9
    assert len(tops) >= math.floor(least)


def test_short_segments_are_never_cut() -> None:
    surface = Surface(50.0, 19.0, 21, closed=False)
    for top in seams(surface, lambda *_: 100.0):
        assert top % 19.0 == pytest.approx(0)
