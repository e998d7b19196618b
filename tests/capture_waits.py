"""Waiting for what a camera's thread delivers, for the tests of cameras."""

from __future__ import annotations

import contextlib
import time

import pytest

from polepilot.core.errors import CameraError
from polepilot.core.observation import Frame
from polepilot.core.vision.capture import CameraCapture


def next_frame(capture: CameraCapture, limit: float = 15.0) -> Frame:
    """The next picture, whatever errors come before it."""
    end = time.monotonic() + limit
    while time.monotonic() < end:
        with contextlib.suppress(CameraError):
            frame = capture.read()
            if frame is not None:
                return frame
        time.sleep(0.002)
    pytest.fail("no picture came")


def next_error(capture: CameraCapture, limit: float = 15.0) -> CameraError:
    """The next error, whatever pictures come before it."""
    end = time.monotonic() + limit
    while time.monotonic() < end:
        try:
            capture.read()
        except CameraError as error:
            return error
        time.sleep(0.002)
    pytest.fail("no error came")
