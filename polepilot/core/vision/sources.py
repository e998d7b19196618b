"""Where pictures come from: V4L2 devices, network streams, video files, folders of pictures.

A ``Stream`` delivers pictures one after the other and may block; ``capture.CameraCapture`` runs it
in a thread. Everything that cannot be opened says what to do about it.
"""

from __future__ import annotations

import contextlib
import errno
import getpass
import os
import re
import time
from pathlib import Path
from typing import Any, Protocol

import cv2
import numpy as np

from polepilot.core.errors import CameraError
from polepilot.core.observation import Image

PICTURES = frozenset({".png", ".jpg", ".jpeg", ".bmp", ".tif", ".tiff", ".webp"})
_URL = re.compile(r"^(rtsp|rtsps|rtmp|http|https|udp|tcp)://", re.IGNORECASE)
_DEVICES = Path("/dev")
_OPEN_TIMEOUT_MS = 5000
_READ_TIMEOUT_MS = 2000


class Stream(Protocol):
    """An open source of pictures. Used by one thread."""

    live: bool
    """False where the end is the end (a file), True where pictures may come back (a device)."""

    def grab(self) -> bool:
        """Wait for the next picture; False when there is none any more."""
        ...

    def retrieve(self) -> Image | None:
        """The picture that was grabbed, decoded; None where it is broken."""
        ...

    def release(self) -> None: ...


def open_stream(source: int | str, *, rate: float, size: tuple[int, int]) -> Stream:
    """Open a camera.

    Args:
        source: device number, ``/dev/...`` path, address of a network stream, video file, or
            folder of pictures.
        rate: pictures per second, asked of a device; a folder is played at this rate.
        size: columns and rows asked of a device, which takes the nearest that it can.

    Raises:
        CameraError: it cannot be opened; the remedy says what to do.
    """
    _silence()
    if isinstance(source, int) or source.startswith("/dev/"):
        return _open_device(source, rate, size)
    if _URL.match(source):
        return _open_address(source)
    path = Path(source).expanduser()
    if path.is_dir():
        return PictureFolder(path, rate)
    return _open_file(path, rate)


def find_devices() -> list[str]:
    """The video devices of this machine, each with the name that its driver gives."""
    found = []
    for path in sorted(_DEVICES.glob("video*"), key=lambda p: (len(p.name), p.name)):
        name = Path("/sys/class/video4linux") / path.name / "name"
        with contextlib.suppress(OSError):
            found.append(f"{path} ({name.read_text().strip()})")
            continue
        found.append(str(path))
    return found


class _Paced:
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


class VideoStream:
    """Pictures from OpenCV: a device, an address or, paced by ``rate``, a file."""

    def __init__(self, capture: Any, *, rate: float | None = None) -> None:
        self.live = rate is None
        self._capture = capture
        self._pace = None if rate is None else _Paced(rate)

    def grab(self) -> bool:
        if self._pace is not None:
            self._pace.wait()
        return bool(self._capture.grab())

    def retrieve(self) -> Image | None:
        done, image = self._capture.retrieve()
        return np.asarray(image, dtype=np.uint8) if done and image is not None else None

    def release(self) -> None:
        self._capture.release()


class PictureFolder:
    """The pictures of a folder in the order of their names.

    Raises:
        CameraError: the folder holds no picture.
    """

    live = False

    def __init__(self, folder: Path, rate: float) -> None:
        files = [path for path in folder.iterdir() if path.suffix.lower() in PICTURES]
        if not files:
            raise CameraError(
                f"{folder} holds no picture: expected files such as 0001.png.", code="camera_empty"
            )
        self._files = iter(sorted(files))
        self._current = Path()
        self._pace = _Paced(rate)

    def grab(self) -> bool:
        self._pace.wait()
        following = next(self._files, None)
        if following is None:
            return False
        self._current = following
        return True

    def retrieve(self) -> Image | None:
        # Decoding from memory, since imread cannot open every name that a file may have.
        image = cv2.imdecode(np.fromfile(self._current, np.uint8), cv2.IMREAD_COLOR)
        if image is None:
            raise CameraError(f"{self._current} is no readable picture.", code="camera_file")
        return np.asarray(image, dtype=np.uint8)

    def release(self) -> None:
        self._files = iter(())


def _open_device(source: int | str, rate: float, size: tuple[int, int]) -> Stream:
    path = _DEVICES / f"video{source}" if isinstance(source, int) else Path(source)
    _check_device(path)
    # OpenCV knows V4L2 devices by number; /dev/v4l/by-id/... leads there.
    number = re.fullmatch(r"video(\d+)", path.resolve().name)
    if number is None:
        raise CameraError(
            f"{path} is no video device: expected /dev/video0 or the like.", remedy=_list_devices()
        )
    capture: Any = cv2.VideoCapture(int(number.group(1)), cv2.CAP_V4L2)
    if not capture.isOpened():
        capture.release()
        raise _explain_silent_device(path)
    # The order matters: the compressed format is what makes large pictures fit through USB 2.
    for name, value in (
        (cv2.CAP_PROP_FOURCC, cv2.VideoWriter.fourcc(*"MJPG")),
        (cv2.CAP_PROP_FRAME_WIDTH, size[0]),
        (cv2.CAP_PROP_FRAME_HEIGHT, size[1]),
        (cv2.CAP_PROP_FPS, rate),
        (cv2.CAP_PROP_BUFFERSIZE, 1),
    ):
        capture.set(name, value)
    return VideoStream(capture)


def _check_device(path: Path) -> None:
    """Find out why a device cannot be used before OpenCV hides the reason."""
    if not path.exists():
        raise CameraError(
            f"there is no camera {path}.", remedy=_list_devices(), code="camera_missing"
        )
    try:
        os.close(os.open(path, os.O_RDWR | os.O_NONBLOCK))
    except OSError as error:
        if error.errno in (errno.EACCES, errno.EPERM):
            raise CameraError(
                f"no permission to use the camera {path}.",
                remedy=f"Join the group video: sudo usermod -aG video {_user()}, then log in "
                "again.",
                code="camera_permission",
            ) from error
        if error.errno == errno.EBUSY:
            raise _busy(path) from error
        raise CameraError(
            f"the camera {path} cannot be opened ({error.strerror}).",
            remedy="Unplug it and plug it in again.",
        ) from error


def _explain_silent_device(path: Path) -> CameraError:
    if _users_of(path):
        return _busy(path)
    return CameraError(
        f"the camera {path} delivers no pictures to OpenCV.",
        remedy=f"Many cameras have a second device for other data. {_list_devices()}",
        code="camera_unusable",
    )


def _busy(path: Path) -> CameraError:
    users = ", ".join(_users_of(path)) or "another program"
    return CameraError(
        f"the camera {path} is in use by {users}.",
        remedy="Close that program.",
        code="camera_busy",
    )


def _users_of(path: Path) -> list[str]:
    """Programs that hold ``path`` open, as far as this user may know."""
    target, found = path.resolve(), []
    for process in Path("/proc").glob("[0-9]*"):
        if int(process.name) == os.getpid():
            continue
        with contextlib.suppress(OSError):
            if any(link.resolve() == target for link in (process / "fd").iterdir()):
                found.append(f"{(process / 'comm').read_text().strip()} ({process.name})")
    return found


def _list_devices() -> str:
    found = find_devices()
    if not found:
        return "No video device was found on this machine: check cable and power."
    return f"Found: {', '.join(found)}."


def _user() -> str:
    try:
        return getpass.getuser()
    except (KeyError, OSError):
        return "USER"


def _open_address(address: str) -> Stream:
    capture: Any = cv2.VideoCapture(
        address,
        cv2.CAP_FFMPEG,
        [
            cv2.CAP_PROP_OPEN_TIMEOUT_MSEC,
            _OPEN_TIMEOUT_MS,
            cv2.CAP_PROP_READ_TIMEOUT_MSEC,
            _READ_TIMEOUT_MS,
        ],
    )
    if not capture.isOpened():
        capture.release()
        raise CameraError(
            f"no pictures from {_without_password(address)}.",
            remedy="Check address, name and password, and that the camera is on the network.",
            code="camera_missing",
        )
    return VideoStream(capture)


def _without_password(address: str) -> str:
    return re.sub(r"//[^/@]*@", "//...@", address)


def _open_file(path: Path, rate: float) -> Stream:
    try:
        with path.open("rb"):
            pass
    except OSError as error:
        raise CameraError(
            f"the video file {path} cannot be read ({error.strerror}): expected a device, an "
            "address, a video file or a folder of pictures.",
            code="camera_missing",
        ) from error
    capture: Any = cv2.VideoCapture(str(path), cv2.CAP_FFMPEG)
    if not capture.isOpened():
        capture.release()
        raise CameraError(f"{path} is no video that can be read.", code="camera_file")
    own_rate = float(capture.get(cv2.CAP_PROP_FPS))
    return VideoStream(capture, rate=own_rate if 0 < own_rate <= 240 else rate)


def _silence() -> None:
    """Keep OpenCV and FFmpeg from writing to standard error: our errors say it better."""
    cv2.utils.logging.setLogLevel(cv2.utils.logging.LOG_LEVEL_SILENT)
    os.environ.setdefault("OPENCV_FFMPEG_LOGLEVEL", "-8")
    # A device that hangs is given up after this many seconds instead of ten.
    os.environ.setdefault("OPENCV_VIDEOIO_V4L_SELECT_TIMEOUT", "2")
