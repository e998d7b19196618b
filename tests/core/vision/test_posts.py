"""Striped posts that are nearly landmarks."""

from __future__ import annotations

from dataclasses import replace

import cv2
import numpy as np
import pytest
from vision_scenes import CAMERA

from polepilot.core.landmark import LandmarkKind, encode
from polepilot.core.observation import Image
from polepilot.core.vision.detector import LandmarkDetector
from polepilot.core.vision.paint import ORANGE

KINDS = dict.fromkeys(range(1, 16), LandmarkKind())
FINE = 4
"""Pixels that are drawn for one of the picture, each way."""
SEGMENTS = 13
BUSY = (7, 11, 13, 14, 15)
"""Numbers with at least three bright bits."""


def place(away: float) -> tuple[float, float]:
    """The row in which the code of a post begins so many metres away, and the rows of a segment."""
    unit = CAMERA.constant * 0.05 / away
    return CAMERA.center_y + CAMERA.constant / away * 0.4 - SEGMENTS * unit, unit


def draw(
    rng: np.random.Generator, away: float, number: int, first: int = 0, off: float = 0.0
) -> Image:
    """A picture of a post with the code ``number``.

    Args:
        rng: decides all that is not said.
        away: metres.
        number: of the code.
        first: segment with which the post begins; if not 0 a wall of about the paint's colour is
            behind its upper end.
        off: segments by which the borders of its bands are off, standard deviation.
    """
    top, unit = place(away)
    paint = (np.array(ORANGE.bgr) / 255) ** 2.2 * rng.uniform(0.5, 1)
    wall = paint * np.array([rng.uniform(0.7, 1.6), rng.uniform(0.7, 1.4), rng.uniform(0.7, 1.1)])
    drawn = np.full((CAMERA.height * FINE, CAMERA.width * FINE, 3), rng.uniform(0.05, 0.5))
    if first > 0:
        drawn[int(max(top - 3 * unit, 0)) * FINE : int((top + 3 * unit) * FINE), 600:1000] = wall
    across = (np.arange(drawn.shape[1]) + 0.5 - 800) / (0.7 * unit * FINE)
    on = np.abs(across) < 1
    shade = 0.45 + 0.55 * np.sqrt(1 - across[on] ** 2)
    code = encode(number, 4)
    borders = np.arange(SEGMENTS + 1) + off * rng.standard_normal(SEGMENTS + 1)
    for k in range(first, SEGMENTS):
        rows = slice(*(round((top + borders[end] * unit) * FINE) for end in (k, k + 1)))
        drawn[rows, on] = (paint if code[k] == "1" else np.full(3, 0.006)) * shade[:, None]
    blurred = cv2.GaussianBlur(drawn, (0, 0), FINE * rng.uniform(0.3, 0.6))
    small = cv2.resize(blurred, None, fx=1 / FINE, fy=1 / FINE, interpolation=cv2.INTER_AREA)
    light = 255 * small ** (1 / 2.2) + rng.normal(0, 1.5, small.shape)
    return np.clip(light, 0, 255).astype(np.uint8)


@pytest.mark.parametrize("shown", [2.0, 1.1, 0.9])
def test_a_wall_is_no_end_bar(shown: float) -> None:
    """``shown``: segments of what passes for the upper bar that the picture leaves."""
    rng = np.random.default_rng(20)
    read = 0
    for _ in range(60):
        away = float(rng.uniform(3.0, 9.0))
        top, unit = place(away)
        image = draw(rng, away, int(rng.integers(1, 16)), first=2)
        cut = max(round(top + (2 - shown) * unit), 0) if shown < 2 else 0
        camera = replace(CAMERA, height=CAMERA.height - cut, center_y=CAMERA.center_y - cut)
        read += bool(LandmarkDetector(camera, KINDS).detect(np.ascontiguousarray(image[cut:])))
    assert read <= 3


@pytest.mark.parametrize(("off", "least", "most"), [(0.0, 99, 100), (0.2, 0, 10)])
def test_bands_are_as_long_as_segments(off: float, least: int, most: int) -> None:
    """However many bright bits they would make, if they are near enough to be measured."""
    rng = np.random.default_rng(21)
    detector = LandmarkDetector(CAMERA, KINDS)
    posts = [draw(rng, rng.uniform(4.5, 7), int(rng.choice(BUSY)), off=off) for _ in range(100)]
    assert least <= sum(bool(detector.detect(image)) for image in posts) <= most
