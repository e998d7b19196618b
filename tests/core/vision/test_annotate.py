"""Drawings of what was found: legible, inside the picture, and right about the reasons."""

from __future__ import annotations

from itertools import combinations
from typing import Any

import cv2
import numpy as np
import pytest
from vision_scenes import CAMERA, picture, pole

from polepilot.core.landmark import LandmarkKind, encode
from polepilot.core.observation import Detection, Image
from polepilot.core.sim.render import Look as Paints
from polepilot.core.vision import annotate as module
from polepilot.core.vision.annotate import FOUND, REJECTED, annotate, summary
from polepilot.core.vision.detector import (
    OUT_OF_PLACE,
    TWICE,
    Found,
    LandmarkDetector,
    Look,
    Rejected,
)
from polepilot.core.vision.kernel import REASONS, Strip

ALL = LandmarkDetector(CAMERA, dict.fromkeys(range(1, 16), LandmarkKind()))
Box = tuple[float, float, float, float]


class Pen:
    """Stands in for OpenCV's and remembers what was written where."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch) -> None:
        self.words: list[tuple[str, Box]] = []
        self._write = cv2.putText
        monkeypatch.setattr(module.cv2, "putText", self.write)

    def write(self, canvas: Image, text: str, at: tuple[int, int], *rest: Any) -> None:
        font, size, _, thickness, _ = rest
        (width, height), _ = cv2.getTextSize(text, font, size, thickness)
        self.words.append((text, (at[0], at[1] - height, at[0] + width, at[1])))
        self._write(canvas, text, at, *rest)

    @property
    def text(self) -> str:
        return "\n".join(text for text, _ in self.words)


@pytest.fixture
def pen(monkeypatch: pytest.MonkeyPatch) -> Pen:
    return Pen(monkeypatch)


def strip(number: int, column: float, row: float, unit: float, lean: float = 0.0) -> Strip:
    code = encode(number).encode()
    return Strip(
        id=number, bits=4, column=column, row=row, unit=unit, lean=lean, width=1.4 * unit, code=code
    )


def found(one: Strip) -> Found:
    seen = Detection(one.id, 3.0, 0.1, one.column, one.row - 20, one.row + 20, 0.01, 0.001)
    return Found(seen, one)


def crowd(seed: int, width: int, height: int) -> Look:
    """Three landmarks and thirty candidates anywhere, also beyond the edge."""
    rng = np.random.default_rng(seed)

    def anywhere(number: int) -> Strip:
        unit = rng.uniform(1.3, height / 16)
        at = rng.uniform(0, width), rng.uniform(0, height)
        return strip(number, *at, unit, rng.uniform(-0.1, 0.1))

    reasons = rng.choice(REASONS[1:], 30)
    return Look(
        tuple(found(anywhere(n)) for n in (3, 7, 13)),
        tuple(Rejected(anywhere(5), str(reason)) for reason in reasons),
    )


@pytest.mark.parametrize(
    ("size", "scale"),
    [((400, 300), 3), ((160, 120), 4), ((640, 480), 2), ((1600, 1200), 1), ((2592, 1944), 1)],
)
def test_words_are_inside_and_not_on_each_other(
    size: tuple[int, int], scale: int, pen: Pen
) -> None:
    width, height = size
    for seed in range(3):
        pen.words.clear()
        image = np.full((height, width, 3), 120, np.uint8)
        sheet = annotate(image, crowd(seed, width, height), "crowd.png")
        assert sheet.shape[1] == max(width * scale, 640)
        assert sheet.shape[0] > height * scale
        for _, (left, top, right, bottom) in pen.words:
            assert left >= 0
            assert top >= 0
            assert right <= sheet.shape[1]
            assert bottom <= sheet.shape[0]
        for (_, a), (_, b) in combinations(pen.words, 2):
            assert a[2] <= b[0] or b[2] <= a[0] or a[3] <= b[1] or b[3] <= a[1]
        for number in (3, 7, 13):
            assert f"No. {number}" in pen.text
        assert "3 landmarks; 30 candidates rejected" in pen.text


def test_everything_is_said(pen: Pen) -> None:
    look = Look((found(strip(13, 120, 150, 8)),), (Rejected(strip(6, 300, 150, 8), "cut off"),))
    sheet = annotate(np.zeros((300, 400, 3), np.uint8), look, "näme.png")
    assert "n?me.png, 400 x 300 pixels, 3 times as large: 1 landmark; 1 candidate" in pen.text
    assert "No. 13\n300.0 +/- 1.0 cm\n+5.73 +/- 0.06 deg" in pen.text
    assert "a (No. 6?): cut off" in pen.text
    for colour, here in ((FOUND, slice(0, 600)), (REJECTED, slice(600, 1200))):
        drawn = (np.abs(sheet[:900].astype(int) - colour) < 40).all(axis=2)
        assert drawn[:, here].sum() > 500
        assert drawn.sum() == drawn[:, here].sum()


def test_segments_are_drawn_as_they_were_read() -> None:
    sheet = annotate(np.full((300, 400), 90, np.uint8), Look((found(strip(13, 200, 150, 10)),), ()))
    bars = []
    for segment in range(13):
        row = round(3 * (150 + (segment - 6) * 10 + 0.5))
        left = sheet[row, 500:575]
        white, black = ((left == shade).all(axis=1).sum() for shade in (255, 0))
        bars.append("1" if white > black else "0")
        assert max(white, black) >= 5
    assert "".join(bars) == encode(13)


@pytest.mark.parametrize("shape", [(5, 7), (1, 1, 3), (3000, 1, 3), (1, 3000), (0, 4, 3), (4, 0)])
def test_any_size_can_be_drawn(shape: tuple[int, ...], pen: Pen) -> None:
    image = np.full(shape, 128, np.uint8)
    look = Look((found(strip(13, 2, 2, 2)),), (Rejected(strip(6, 1, 1, 1.5), "cut off"),))
    sheet = annotate(image, look, "folder/with_a_long_name" * 9)
    assert sheet.shape[2] == 3
    assert "300.0 +/- 1.0 cm" in pen.text
    assert all(right <= sheet.shape[1] for _, (_, _, right, _) in pen.words)


def test_the_picture_itself_stays_as_it_is() -> None:
    image = picture([pole(13, 3.0, 0.1)])
    before = image.copy()
    annotate(image, ALL.examine(image))
    assert (image == before).all()


def test_summaries() -> None:
    one = strip(6, 10, 10, 2)
    assert summary(Look((), ())) == "no landmarks; no candidate"
    assert summary(Look((found(one),), ())) == "1 landmark; no other candidate"
    rejected = tuple(Rejected(one, reason) for reason in ("cut off", "no contrast", "no contrast"))
    assert summary(Look((found(one), found(one)), rejected)) == (
        "2 landmarks; 3 candidates rejected: no contrast (2), cut off"
    )


def test_looks_agree_with_detections() -> None:
    for poles in ([], [pole(13, 3.0, 0.1)], [pole(2, 2.5, 0.2), pole(9, 5.0, -0.2)]):
        image = picture(poles)
        look = ALL.examine(image)
        assert [one.detection for one in look.found] == ALL.detect(image)
        assert [one.strip.id for one in look.found] == [one.id for one in ALL.detect(image)]


def test_reasons_are_true() -> None:
    image = picture([pole(13, 3.0, 0.0)])
    some = LandmarkDetector(CAMERA, dict.fromkeys((1, 2), LandmarkKind()))
    look = some.examine(image)
    assert look.found == ()
    assert [one.reason for one in look.rejected if one.strip.id == 13] == [
        "no landmark of this site"
    ]
    grey = picture([pole(13, 3.0, 0.0)], look=Paints(dark=(0.5, 0.5, 0.5)))
    assert ALL.examine(grey).found == ()


def test_nothing_stands_under_the_floor() -> None:
    look = ALL.examine(np.asarray(np.roll(picture([pole(13, 9.0, 0.0)]), 75, axis=0)))
    assert look.found == ()
    assert [one.reason for one in look.rejected if one.strip.id == 13] == [OUT_OF_PLACE]


def test_the_same_number_twice() -> None:
    poles = [pole(13, 3.0, 0.15), pole(13, 5.0, -0.15)]
    look = ALL.examine(picture(poles))
    assert [one.strip.id for one in look.found] == [13]
    assert [one.reason for one in look.rejected if one.strip.id == 13] == [TWICE]
