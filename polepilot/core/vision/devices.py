"""Cameras of this machine (V4L2), set as asked: size, format, lens, exposure, colours."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import cv2
import numpy as np

from polepilot.core.observation import Image
from polepilot.core.vision.device_faults import check_device, explain_device
from polepilot.core.vision.stream import VideoStream

_BUFFERS = 2
"""One would be the newest picture, but a driver without a free buffer passes over every other."""
_MJPG = cv2.VideoWriter.fourcc(*"MJPG")
_END_OF_JPEG = b"\xff\xd9"
_AS_TAKEN = cv2.IMREAD_COLOR | cv2.IMREAD_IGNORE_ORIENTATION
_MANUAL, _AUTOMATIC, _APERTURE_PRIORITY = 1, 0, 3
"""Of V4L2_CID_EXPOSURE_AUTO. Most webcams know the first and the last."""


@dataclass(frozen=True, slots=True)
class CameraControls:
    """How a device is set. A lens that focuses by itself changes the camera constant, and with it
    all ranges; a fixed exposure and white balance keep colours and edges the same."""

    autofocus: bool = False
    focus: int = -1
    """Position of the lens in the driver's own units; -1 leaves it where it is."""
    exposure: float = 0.0
    """Seconds; 0 leaves it to the camera."""
    white_balance: int = 0
    """Colour temperature in kelvin; 0 leaves it to the camera."""


class DeviceStream(VideoStream):
    """Pictures from a device, each with the time at which its driver took it.

    Where the device compresses them, they are decoded here: OpenCV would hand out the torn ones,
    which a crowded USB port makes, with the lost part grey.
    """

    def __init__(self, capture: Any, notes: tuple[str, ...]) -> None:
        super().__init__(capture)
        self.notes = notes
        self._compressed = int(capture.get(cv2.CAP_PROP_FOURCC)) == _MJPG and bool(
            capture.set(cv2.CAP_PROP_CONVERT_RGB, 0)
        )

    def retrieve(self) -> Image | None:
        data = super().retrieve()
        if data is None or not self._compressed:
            return data
        if data.tobytes().rfind(_END_OF_JPEG) < 0:
            return None
        try:
            image = cv2.imdecode(data.ravel(), _AS_TAKEN)
        except cv2.error:
            return None
        return None if image is None else np.asarray(image, dtype=np.uint8)

    def stamp(self) -> float | None:
        seconds = float(self._capture.get(cv2.CAP_PROP_POS_MSEC)) / 1000
        return seconds if seconds > 0 else None


def open_device(
    path: Path, *, rate: float, size: tuple[int, int], controls: CameraControls
) -> DeviceStream:
    """Open a camera of this machine and ask it for pictures of ``size`` (columns, rows).

    Raises:
        CameraError: it cannot be opened; the remedy says what to do.
    """
    check_device(path)
    capture: Any = cv2.VideoCapture(str(path), cv2.CAP_V4L2)
    if not capture.isOpened():
        capture.release()
        raise explain_device(path)
    # The order matters: the compressed format is what makes large pictures fit through USB 2.
    for name, value in (
        (cv2.CAP_PROP_FOURCC, _MJPG),
        (cv2.CAP_PROP_FRAME_WIDTH, size[0]),
        (cv2.CAP_PROP_FRAME_HEIGHT, size[1]),
        (cv2.CAP_PROP_FPS, rate),
        (cv2.CAP_PROP_BUFFERSIZE, _BUFFERS),
    ):
        capture.set(name, value)
    if not capture.isOpened():  # lost while it was being set
        capture.release()
        raise explain_device(path)
    notes = []
    given = (
        int(capture.get(cv2.CAP_PROP_FRAME_WIDTH)),
        int(capture.get(cv2.CAP_PROP_FRAME_HEIGHT)),
    )
    if given != size:
        notes.append(
            f"the camera {path} gives {given[0]}x{given[1]} instead of {size[0]}x{size[1]}."
        )
    notes += [f"the camera {path} {problem}." for problem in _apply(capture, controls)]
    return DeviceStream(capture, tuple(notes))


def _apply(capture: Any, controls: CameraControls) -> list[str]:
    """Set what can be set; returns what the device would not do although somebody asked for it."""
    problems = []
    # Most lenses cannot move at all: no need to say so where nobody wants them to.
    if not capture.set(cv2.CAP_PROP_AUTOFOCUS, int(controls.autofocus)) and controls.autofocus:
        problems.append("has no autofocus")
    if controls.focus >= 0 and not capture.set(cv2.CAP_PROP_FOCUS, controls.focus):
        problems.append(f"does not take the focus {controls.focus}")
    if controls.exposure > 0:
        capture.set(cv2.CAP_PROP_AUTO_EXPOSURE, _MANUAL)
        if not capture.set(cv2.CAP_PROP_EXPOSURE, max(1, round(controls.exposure * 1e4))):
            problems.append(f"does not take the exposure of {controls.exposure} s")
    elif not capture.set(cv2.CAP_PROP_AUTO_EXPOSURE, _APERTURE_PRIORITY):
        capture.set(cv2.CAP_PROP_AUTO_EXPOSURE, _AUTOMATIC)
    capture.set(cv2.CAP_PROP_AUTO_WB, int(controls.white_balance <= 0))
    if controls.white_balance > 0 and not capture.set(
        cv2.CAP_PROP_WB_TEMPERATURE, controls.white_balance
    ):
        problems.append(f"does not take the white balance of {controls.white_balance} K")
    return problems
