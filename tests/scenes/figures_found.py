"""The first picture of docs/vision.md: what is found in a plain room and among orange things."""

from __future__ import annotations

import math

import cv2
import numpy as np
from scenes.campaign import CAMERA, KINDS
from scenes.studio import scene
from scenes.truth import Family

from polepilot.core.observation import Detection, Image
from polepilot.core.vision.detector import LandmarkDetector

SHOWN: tuple[tuple[Family, int], ...] = (("clean", 231), ("photo", 205))
_SCALE = 2
_GAP = 8
_GREEN, _WHITE = (90, 240, 90), (255, 255, 255)


def found() -> Image:
    """Two pictures side by side, enlarged, with what the detector reads in them."""
    detector = LandmarkDetector(CAMERA, KINDS)
    sides = []
    for family, seed in SHOWN:
        image = scene(family, seed).image
        sides.append(_drawn(image, detector.detect(image)))
    gap = np.full((sides[0].shape[0], _GAP, 3), 255, np.uint8)
    return np.hstack([sides[0], gap, sides[1]])


def _drawn(image: Image, answers: list[Detection]) -> Image:
    large = cv2.resize(image, None, fx=_SCALE, fy=_SCALE, interpolation=cv2.INTER_CUBIC)
    canvas: Image = np.asarray(large, np.uint8)
    for index, one in enumerate(answers):
        half = CAMERA.constant * 0.035 / one.range + 2
        left, right = (round(_SCALE * (one.column + side * half + 0.5)) for side in (-1, 1))
        top, bottom = (round(_SCALE * (row + 0.5)) for row in (one.top - 1, one.bottom + 1))
        cv2.rectangle(canvas, (left, top), (right, bottom), _GREEN, 2, cv2.LINE_AA)
        words = (f"No. {one.id}", f"{one.range:.3f} m", f"{math.degrees(one.bearing):+.2f} deg")
        # Side by side they have no room: every second one stands above.
        _label(canvas, words, (left + right) // 2, top - 66 if index % 2 else bottom + 8)
    return canvas


def _label(canvas: Image, words: tuple[str, ...], middle: int, top: int) -> None:
    """Lines of white text on a darkened field, within the picture."""
    font, size, line = cv2.FONT_HERSHEY_SIMPLEX, 0.6, 19
    wide = max(cv2.getTextSize(text, font, size, 1)[0][0] for text in words) + 8
    tall = line * len(words) + 6
    x = min(max(middle - wide // 2, 2), canvas.shape[1] - wide - 2)
    y = min(max(top, 2), canvas.shape[0] - tall - 2)
    field = canvas[y : y + tall, x : x + wide]
    field[:] = field // 4
    for index, text in enumerate(words):
        at = x + 4, y + line * (index + 1) - 3
        cv2.putText(canvas, text, at, font, size, _WHITE, 1, cv2.LINE_AA)
