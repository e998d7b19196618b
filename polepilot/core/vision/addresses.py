"""Network cameras: RTSP, HTTP and the like, opened through FFmpeg and explained when they fail.

FFmpeg says no more than that it failed; a second look at the address tells an unknown name from a
camera that is switched off, a wrong port or a wrong password. Nothing said here shows who may use
the camera: names and passwords stay out of messages and logs.
"""

from __future__ import annotations

import errno
import re
import socket
import time
from typing import Any
from urllib.parse import SplitResult, urlsplit

import cv2

from polepilot.core.errors import CameraError
from polepilot.core.vision.stream import VideoStream

_PORTS = {"rtsp": 554, "rtsps": 322, "rtmp": 1935, "http": 80, "https": 443, "udp": 0, "tcp": 0}
_SCHEME = re.compile(r"^([a-z][a-z0-9+.-]*)://?", re.IGNORECASE)
_OPEN_TIMEOUT = 5.0
_READ_TIMEOUT = 2.0
_PROBE_TIMEOUT = 2.0
_AWAY = 1.0
"""Seconds without a picture after which those that come next may have waited somewhere."""
_WAITED = 0.005
"""Seconds; a picture that took less to come had been waiting."""
_CATCH_UP = 2.0
"""Seconds after which a picture is taken as it is: decoding is slower than the camera."""


def is_address(source: str) -> bool:
    """Whether ``source`` names something on the network rather than a file."""
    return _SCHEME.match(source) is not None


def shown(source: str) -> str:
    """``source`` for people and logs: without password, on one line."""
    text = without_password(source)
    return text if text.isprintable() else ascii(text)


def without_password(source: str) -> str:
    """``source`` without name and password, and of an address without what follows ``?`` or ``=``,
    where some cameras have them too."""
    scheme = _SCHEME.match(source)
    start = scheme.group() if scheme else ""
    rest = source[len(start) :]
    if "@" in rest and (scheme or ":" in rest.partition("@")[0]):
        # Up to the last @: a password may hold one, and slashes too.
        rest = "..." + rest[rest.rindex("@") :]
    if scheme:
        cut = re.search(r"[?=&;]", rest)
        rest = rest[: cut.start()] + "..." if cut else rest
    return start + rest


def open_address(address: str) -> AddressStream:
    """Open a network stream.

    Raises:
        CameraError: there are no pictures from there, and as far as can be found out why.
    """
    scheme = _SCHEME.match(address)
    if scheme is None or scheme[1].lower() not in _PORTS or "://" not in address:
        raise CameraError(
            f"{shown(address)} is no address of a camera: expected rtsp://, http:// or the like.",
            code="camera_address",
        )
    capture: Any = cv2.VideoCapture(
        address,
        cv2.CAP_FFMPEG,
        [
            cv2.CAP_PROP_OPEN_TIMEOUT_MSEC,
            round(_OPEN_TIMEOUT * 1000),
            cv2.CAP_PROP_READ_TIMEOUT_MSEC,
            round(_READ_TIMEOUT * 1000),
            # More threads would each hold a picture back.
            cv2.CAP_PROP_N_THREADS,
            1,
        ],
    )
    if not capture.isOpened():
        capture.release()
        raise _explain(address)
    return AddressStream(capture)


class AddressStream(VideoStream):
    """Pictures from the network: those that waited in a queue are passed over.

    While a stream is opened, and whenever the network or this program had stopped for a while,
    pictures pile up on the way. They come without a wait between them, and they are old.
    """

    def __init__(self, capture: Any) -> None:
        super().__init__(capture)
        self._last: float | None = None

    def grab(self) -> bool:
        begin, computed = time.monotonic(), time.thread_time()
        behind = self._last is None
        first = begin
        while True:
            if not super().grab():
                return False
            end = time.monotonic()
            # Decoding happens in this thread; what is left of the time was spent waiting.
            waited = (end - begin) - (time.thread_time() - computed)
            away = self._last is not None and end - self._last > _AWAY
            self._last = end
            if away:
                behind = True
            elif waited >= _WAITED:
                behind = False
            if not behind or end - first > _CATCH_UP:
                return True
            begin, computed = end, time.thread_time()


def _explain(address: str) -> CameraError:
    """Why there are no pictures, found out step by step: name, port, answer."""
    try:
        parts = urlsplit(address)
        scheme, host = parts.scheme.lower(), parts.hostname or ""
        port = parts.port or _PORTS[scheme]
    except ValueError:
        scheme, host, port = "", "", 0
    failed = f"no pictures from {shown(address)}:"
    if scheme == "udp":
        return CameraError(
            f"{failed} nothing arrives.",
            remedy="Check that the camera sends to this machine and port.",
            code="camera_missing",
        )
    # An @ after the host's place: the password holds a character that ends it too early.
    if not host or port == 0 or ("@" in address and "@" not in parts.netloc):
        return CameraError(
            f"{shown(address)} is no address of a camera: expected rtsp://HOST:PORT/PATH or the "
            "like; special characters in a password are written as %XX.",
            code="camera_address",
        )
    try:
        with socket.create_connection((host, port), _PROBE_TIMEOUT) as line:
            line.settimeout(_PROBE_TIMEOUT)
            answer = _ask(line, parts)
    except socket.gaierror:
        return CameraError(
            f"{failed} the name {host} is not known on this network.",
            remedy="Check its spelling, or use the camera's number such as 192.168.1.20.",
            code="camera_address",
        )
    except ConnectionRefusedError:
        return CameraError(
            f"{failed} {host} refuses connections to port {port}.",
            remedy="Check the port, and that the camera's streaming is switched on.",
            code="camera_refused",
        )
    except OSError as error:
        silent = isinstance(error, TimeoutError) or error.errno == errno.EHOSTUNREACH
        reason = "does not answer" if silent else f"cannot be reached ({error.strerror})"
        return CameraError(
            f"{failed} {host} {reason}.",
            remedy="Check that the camera is switched on and on the same network.",
            code="camera_missing",
        )
    return _explain_answer(failed, answer)


def _ask(line: socket.socket, parts: SplitResult) -> str:
    """The first line of the answer to a request without a password; "" if there is none."""
    scheme = parts.scheme.lower()
    if scheme not in ("http", "rtsp"):
        return ""
    host = parts.netloc.rpartition("@")[2]
    query = f"?{parts.query}" if parts.query else ""
    if scheme == "http":
        request = f"GET {parts.path or '/'}{query} HTTP/1.0\r\nHost: {host}\r\n\r\n"
    else:
        request = f"DESCRIBE rtsp://{host}{parts.path}{query} RTSP/1.0\r\nCSeq: 1\r\n\r\n"
    try:
        line.sendall(request.encode("utf-8"))
        with line.makefile("rb") as answer:
            return answer.readline(200).decode("latin-1").strip()
    except OSError:
        return ""


def _explain_answer(failed: str, answer: str) -> CameraError:
    status = re.match(r"(?:HTTP|RTSP)/\d\.\d (\d{3})", answer)
    number = int(status[1]) if status else 0
    if number in (401, 403):
        return CameraError(
            f"{failed} the camera asks for a name and a password ({number}).",
            remedy="Check both in camera.source: rtsp://NAME:PASSWORD@HOST/...",
            code="camera_permission",
        )
    if number == 404:
        return CameraError(
            f"{failed} the camera has no such path (404).",
            remedy="Its manual names the path of its stream.",
            code="camera_missing",
        )
    if number >= 300:
        reason = f"the camera answers with status {number}."
    elif number:
        reason = "what it sends is no video that can be read."
    else:
        reason = "it can be reached, but sends no pictures."
    return CameraError(
        f"{failed} {reason}",
        remedy="Check the address, and that the camera is not streaming to somebody else.",
        code="camera_silent" if not number else "camera_missing",
    )
