from __future__ import annotations

import numpy as np
import pytest
from vision_scenes import CAMERA, picture, pole

from polepilot.core.landmark import LandmarkKind, encode
from polepilot.core.observation import Image
from polepilot.core.sim.render import Look
from polepilot.core.vision.paper import PaperDetector

PAPER = PaperDetector(CAMERA, dict.fromkeys(range(1, 16), LandmarkKind()))
ORANGE = (20, 110, 230)


def drawn(code: str, unit: int, top: int, left: int, wide: int, image: Image) -> Image:
    """A code of whole pixels, painted into a picture."""
    for index, bit in enumerate(code):
        rows = slice(top + index * unit, top + (index + 1) * unit)
        image[rows, left : left + wide] = ORANGE if bit == "1" else (30, 30, 30)
    return image


def blank() -> Image:
    return np.full((300, 400, 3), 160, np.uint8)


def test_eq_1_as_printed() -> None:
    # 65 cm at 300 cm are 130 pixels where C is 600.
    found = PAPER.detect(drawn(encode(13), 10, 80, 100, 14, blank()))
    assert [one.id for one in found] == [13]
    assert found[0].range == pytest.approx(3.0)
    assert found[0].column == 106
    assert (found[0].top, found[0].bottom) == (79.5, 209.5)


def test_a_clean_near_landmark() -> None:
    found = PAPER.detect(picture([pole(13, 2.5, 0.0)], look=Look(noise=0.0)))
    assert [one.id for one in found] == [13]
    # To the surface, with whole pixels: within two pixels of 156, and 3.5 cm short.
    assert found[0].range == pytest.approx(2.5 - 0.035, rel=2 / 150)


def test_half_of_the_maximum_hides_the_far_one() -> None:
    image = drawn(encode(13), 12, 60, 100, 14, blank())
    image = drawn(encode(7), 4, 120, 250, 6, image)
    assert [one.id for one in PAPER.detect(image)] == [13]


def test_unequal_end_bars_are_rejected() -> None:
    assert PAPER.detect(drawn("1" + encode(13), 10, 80, 100, 14, blank())) == []


def test_pictures_without_orange() -> None:
    assert PAPER.detect(blank()) == []
    assert PAPER.detect(np.zeros((30, 40), np.uint8)) == []
    assert PAPER.detect(np.full((1, 1, 3), ORANGE, np.uint8)) == []
