"""The newest picture as JPEG, with what was seen in it."""

from __future__ import annotations

import threading

import cv2
import numpy as np

from polepilot.core.errors import CameraError
from polepilot.core.observation import Image
from polepilot.core.robot.ports import Sighting

_QUALITY = 85
_INK = (255, 144, 30)
_PAPER = (255, 255, 255)
_TEXT = (90, 40, 0)
_FONT = cv2.FONT_HERSHEY_SIMPLEX
_SIZE = 0.45


class Pictures:
    """Encodes a picture once, however many ask for it."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._cached: dict[bool, tuple[Sighting, bytes]] = {}

    def jpeg(self, sighting: Sighting, plain: bool) -> bytes:
        """The picture of ``sighting``; ``plain`` without the detections.

        Raises:
            CameraError: it cannot be encoded.
        """
        with self._lock:
            cached = self._cached.get(plain)
            if cached is not None and cached[0] is sighting:
                return cached[1]
            assert sighting.frame is not None
            image = sighting.frame.image
            picture = image if plain else draw(image, sighting)
            done, data = cv2.imencode(".jpg", picture, [cv2.IMWRITE_JPEG_QUALITY, _QUALITY])
            if not done:
                raise CameraError("the picture cannot be written as JPEG.")
            encoded = data.tobytes()
            self._cached[plain] = (sighting, encoded)
            return encoded


def draw(image: Image, sighting: Sighting) -> Image:
    """A copy with each landmark's strip framed, its number and its range beside it."""
    picture = cv2.cvtColor(image, cv2.COLOR_GRAY2BGR) if image.ndim == 2 else image.copy()
    for detection in sighting.detections:
        half = max(3.0, 0.08 * (detection.bottom - detection.top))
        left, right = round(detection.column - half), round(detection.column + half)
        top, bottom = round(detection.top), round(detection.bottom)
        cv2.rectangle(picture, (left, top), (right, bottom), _INK, 1, cv2.LINE_AA)
        text = f"{detection.id}  {detection.range:.2f} m"
        (width, height), below = cv2.getTextSize(text, _FONT, _SIZE, 1)
        x = max(0, min(right + 4, picture.shape[1] - width - 4))
        y = max(height + 2, min(top + height + 2, picture.shape[0] - below))
        cv2.rectangle(picture, (x - 2, y - height - 2), (x + width + 2, y + below), _PAPER, -1)
        cv2.putText(picture, text, (x, y), _FONT, _SIZE, _TEXT, 1, cv2.LINE_AA)
    return np.asarray(picture, dtype=np.uint8)
