"""An open source of pictures, which may block; a thread of its own reads it."""

from __future__ import annotations

import os
from typing import Any, Protocol

import cv2
import numpy as np

from polepilot.core.observation import Image


class Stream(Protocol):
    """An open source of pictures. Used by one thread."""

    live: bool
    """False where the end is the end (a file), True where pictures may come back (a device)."""
    notes: tuple[str, ...]
    """What the source does otherwise than asked, a sentence each."""

    def grab(self) -> bool:
        """Wait for the next picture; False when there is none any more."""
        ...

    def stamp(self) -> float | None:
        """When the grabbed picture was taken, on the clock of ``time.monotonic``; None if the
        source does not know."""
        ...

    def retrieve(self) -> Image | None:
        """The picture that was grabbed, decoded; None where it is broken."""
        ...

    def release(self) -> None: ...


class VideoStream:
    """Pictures from OpenCV. Live; what is played from a file overrides that."""

    live = True
    notes: tuple[str, ...] = ()

    def __init__(self, capture: Any) -> None:
        self._capture = capture

    def grab(self) -> bool:
        return bool(self._capture.grab())

    def stamp(self) -> float | None:
        return None

    def retrieve(self) -> Image | None:
        try:
            done, image = self._capture.retrieve()
        except cv2.error:
            return None  # a picture that was damaged on its way
        return np.asarray(image, dtype=np.uint8) if done and image is not None else None

    def release(self) -> None:
        self._capture.release()


def silence() -> None:
    """Keep OpenCV and FFmpeg from writing to standard error: our errors say it better."""
    cv2.utils.logging.setLogLevel(cv2.utils.logging.LOG_LEVEL_SILENT)
    os.environ.setdefault("OPENCV_FFMPEG_LOGLEVEL", "-8")
    # A device that hangs is given up after this many seconds instead of ten.
    os.environ.setdefault("OPENCV_VIDEOIO_V4L_SELECT_TIMEOUT", "2")
