from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from polepilot.core.landmark import encode
from polepilot.core.vision.code import read_code

BRIGHT = np.array([0.02, 0.2, 0.7])
DARK = np.array([0.03, 0.03, 0.035])


def levels(code: str) -> np.ndarray:
    return np.array([BRIGHT if bit == "1" else DARK for bit in code])


@settings(deadline=None)
@given(st.integers(1, 15), st.floats(0.01, 1.4), st.floats(0.6, 1.0))
def test_any_brightness_with_light_that_changes_along_the_pole(
    number: int, light: float, end: float
) -> None:
    lit = levels(encode(number)) * light * np.linspace(1, end, 13)[:, None]
    assert read_code(lit).id == number


@pytest.mark.parametrize("segment", range(13))
def test_a_segment_between_the_colours_is_rejected(segment: int) -> None:
    lit = levels(encode(13))
    lit[segment] = (BRIGHT + DARK) / 2
    reading = read_code(lit)
    assert reading.id is None
    assert reading.why


def test_a_grey_segment_is_rejected() -> None:
    lit = levels(encode(13))
    lit[5] = 0.4
    assert read_code(lit).id is None


def test_fences_must_be_dark() -> None:
    code = list(encode(13))
    code[4] = "1"
    assert read_code(levels("".join(code))).id is None


def test_end_bars_must_be_equal() -> None:
    lit = levels(encode(13))
    lit[-2:] *= 0.3
    assert read_code(lit).id is None


def test_black_and_white_is_not_orange_and_black() -> None:
    lit = np.repeat(levels(encode(13))[:, 2:], 3, axis=1)
    assert read_code(lit).id is None
    assert read_code(lit[:, :1]).id == 13


def test_nothing_to_see() -> None:
    assert read_code(np.zeros((13, 3))).why == "no contrast"
