"""Where pictures come from: V4L2 devices, network streams, video files, folders of pictures.

``capture.CameraCapture`` reads them in a thread of its own. Everything that cannot be opened says
what to do about it.
"""

from __future__ import annotations

import time
from pathlib import Path
from typing import Any

import cv2

from polepilot.core.errors import CameraError, ImageError
from polepilot.core.observation import Image
from polepilot.core.vision.addresses import is_address, open_address, shown
from polepilot.core.vision.device_faults import device_path
from polepilot.core.vision.devices import CameraControls, open_device
from polepilot.core.vision.images import read_image
from polepilot.core.vision.stream import Stream, VideoStream, silence

PICTURES = frozenset({".png", ".jpg", ".jpeg", ".bmp", ".tif", ".tiff", ".webp"})


def open_stream(
    source: int | str,
    *,
    rate: float,
    size: tuple[int, int],
    controls: CameraControls | None = None,
) -> Stream:
    """Open a camera.

    Args:
        source: device number, ``/dev/...`` path, address of a network stream, video file, or
            folder of pictures.
        rate: pictures per second, asked of a device; a folder is played at this rate.
        size: columns and rows asked of a device, which takes the nearest that it can.
        controls: how a device is set.

    Raises:
        CameraError: it cannot be opened; the remedy says what to do.
    """
    silence()
    if isinstance(source, int) or source.startswith("/dev/"):
        controls = controls or CameraControls()
        return open_device(device_path(source), rate=rate, size=size, controls=controls)
    if is_address(source):
        return open_address(source)
    path = Path(source).expanduser()
    if path.is_dir():
        return PictureFolder(path, rate)
    return _open_file(path, rate)


def name_of(source: int | str) -> str:
    """``source`` for people and logs; passwords are left out."""
    return str(device_path(source)) if isinstance(source, int) else shown(source)


class _Pace:
    """Lets pictures of a file come when a camera would have delivered them."""

    def __init__(self, rate: float) -> None:
        self._period = 1 / rate
        self._due = time.monotonic()

    def wait(self) -> None:
        delay = self._due - time.monotonic()
        if delay > 0:
            time.sleep(delay)
        # A player that fell behind goes on from now instead of rushing.
        self._due = max(self._due, time.monotonic() - self._period) + self._period


class VideoFile(VideoStream):
    """Pictures of a video file, played at its rate."""

    live = False

    def __init__(self, capture: Any, rate: float) -> None:
        super().__init__(capture)
        self._pace = _Pace(rate)

    def grab(self) -> bool:
        self._pace.wait()
        return super().grab()


class PictureFolder:
    """The pictures of a folder in the order of their names.

    Raises:
        CameraError: the folder cannot be read or holds no picture.
    """

    live = False
    notes: tuple[str, ...] = ()

    def __init__(self, folder: Path, rate: float) -> None:
        try:
            files = [path for path in folder.iterdir() if path.suffix.lower() in PICTURES]
        except OSError as error:
            raise CameraError(
                f"the folder {shown(str(folder))} cannot be read ({error.strerror}).",
                code="camera_missing",
            ) from error
        if not files:
            raise CameraError(
                f"{shown(str(folder))} holds no picture: expected files such as 0001.png.",
                code="camera_empty",
            )
        self._files = iter(sorted(files))
        self._current = Path()
        self._pace = _Pace(rate)

    def grab(self) -> bool:
        self._pace.wait()
        following = next(self._files, None)
        if following is None:
            return False
        self._current = following
        return True

    def stamp(self) -> float | None:
        return None

    def retrieve(self) -> Image | None:
        try:
            # Other threads may be writing to standard error meanwhile.
            return read_image(self._current, quiet=False)
        except ImageError as error:
            raise CameraError(error.message, code="camera_file") from error

    def release(self) -> None:
        self._files = iter(())


def _open_file(path: Path, rate: float) -> VideoFile:
    name = shown(str(path))
    try:
        if not path.is_file() and path.exists():
            raise CameraError(
                f"{name} is no file: expected a device below /dev, an address, a video file or a "
                "folder of pictures.",
                code="camera_file",
            )
        with path.open("rb"):
            pass
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or str(error)
        raise CameraError(
            f"the video file {name} cannot be read ({reason}): expected a device, an "
            "address, a video file or a folder of pictures.",
            code="camera_missing",
        ) from error
    capture: Any = cv2.VideoCapture(str(path), cv2.CAP_FFMPEG)
    if not capture.isOpened():
        capture.release()
        raise CameraError(f"{name} is no video that can be read.", code="camera_file")
    own_rate = float(capture.get(cv2.CAP_PROP_FPS))
    return VideoFile(capture, own_rate if 0 < own_rate <= 240 else rate)
