"""Network cameras: RTSP, HTTP and the like, opened through FFmpeg and explained when they fail.

FFmpeg says no more than that it failed; a second look at the address tells an unknown name from a
camera that is switched off, a wrong port or a wrong password. Nothing said here shows who may use
the camera: names and passwords stay out of messages and logs.
"""

from __future__ import annotations

import errno
import queue
import re
import socket
import threading
import time
from typing import Any
from urllib.parse import SplitResult, urlsplit

import cv2

from polepilot.core.errors import CameraError
from polepilot.core.vision.catching_up import CatchingUp, sleeps_of_thread
from polepilot.core.vision.stream import VideoStream

_PORTS = {"rtsp": 554, "rtsps": 322, "rtmp": 1935, "http": 80, "https": 443, "udp": 0, "tcp": 0}
_SCHEME = re.compile(r"^([a-z][a-z0-9+.-]*)://?", re.IGNORECASE)
_OPEN_TIMEOUT = 5.0
_READ_TIMEOUT = 2.0
_PROBE_TIMEOUT = 2.0
"""Seconds for each step of finding out what is wrong: the name, the port, the answer."""


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

    It is given up after 13 s at the latest: 2 for the name, 5 to open, 6 to find out what is wrong.

    Raises:
        CameraError: there are no pictures from there, and as far as can be found out why.
    """
    scheme = _SCHEME.match(address)
    if scheme is None or scheme[1].lower() not in _PORTS or "://" not in address:
        raise CameraError(
            f"{shown(address)} is no address of a camera: expected rtsp://, http:// or the like.",
            code="camera_address",
        )
    if _name_hangs(address):
        # FFmpeg's own limit does not hold while it looks up a name.
        raise _explain(address)
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
        self._catching_up = CatchingUp()

    def grab(self) -> bool:
        self._catching_up.ask(time.monotonic())
        while True:
            begin, computed, sleeps = time.monotonic(), time.thread_time(), sleeps_of_thread()
            if not super().grab():
                return False
            end = time.monotonic()
            # Decoding happens in this thread; what is left of the time was spent waiting.
            computed = time.thread_time() - computed
            slept = sleeps_of_thread() > sleeps
            if not self._catching_up.is_old(begin, end, computed=computed, slept=slept):
                return True


def _look_up(host: str, port: int) -> list[Any]:
    """The places of ``host``, as of ``socket.getaddrinfo``, which has no time limit of its own.

    Raises:
        TimeoutError: no answer within ``_PROBE_TIMEOUT``.
        OSError: as ``socket.getaddrinfo``.
    """
    answers: queue.SimpleQueue[list[Any] | OSError] = queue.SimpleQueue()

    def ask() -> None:
        try:
            answers.put(socket.getaddrinfo(host, port, type=socket.SOCK_STREAM))
        except OSError as error:
            answers.put(error)
        except UnicodeError:  # a label that is empty or too long
            answers.put(socket.gaierror(socket.EAI_NONAME, "no name"))

    threading.Thread(target=ask, name="name", daemon=True).start()
    try:
        answer = answers.get(timeout=_PROBE_TIMEOUT)
    except queue.Empty:
        raise TimeoutError("the name is not answered for") from None
    if isinstance(answer, OSError):
        raise answer
    return answer


def _name_hangs(address: str) -> bool:
    """Whether nobody says where the camera is. FFmpeg's time limit stands still meanwhile."""
    try:
        parts = urlsplit(address)
        host = parts.hostname
    except ValueError:
        return False
    if not host or ("@" in address and "@" not in parts.netloc):
        return False
    try:
        _look_up(host, 0)
    except TimeoutError:
        return True
    except OSError:
        pass  # FFmpeg will not find it either, and as soon
    return False


def _connect(host: str, port: int) -> socket.socket:
    """A line to the first of the places of ``host`` that answers, within twice
    ``_PROBE_TIMEOUT``."""
    places = _look_up(host, port)
    end = time.monotonic() + _PROBE_TIMEOUT
    failure: OSError = TimeoutError("timed out")
    for place in places:
        left = end - time.monotonic()
        if left <= 0:
            break
        try:
            # By number: it is not looked up again.
            return socket.create_connection(place[4][:2], left)
        except OSError as error:
            failure = error
    raise failure


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
        with _connect(host, port) as line:
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
    """The first line of the answer to a request without a password, as far as it comes within
    ``_PROBE_TIMEOUT``; "" if there is none."""
    scheme = parts.scheme.lower()
    if scheme not in ("http", "rtsp"):
        return ""
    host = parts.netloc.rpartition("@")[2]
    query = f"?{parts.query}" if parts.query else ""
    if scheme == "http":
        request = f"GET {parts.path or '/'}{query} HTTP/1.0\r\nHost: {host}\r\n\r\n"
    else:
        request = f"DESCRIBE rtsp://{host}{parts.path}{query} RTSP/1.0\r\nCSeq: 1\r\n\r\n"
    end = time.monotonic() + _PROBE_TIMEOUT
    answer = b""
    try:
        line.settimeout(_PROBE_TIMEOUT)
        line.sendall(request.encode("utf-8"))
        # The limit is for all of it: a camera may send a byte now and then.
        while b"\n" not in answer and len(answer) < 200 and (left := end - time.monotonic()) > 0:
            line.settimeout(left)
            piece = line.recv(200)
            if not piece:
                break
            answer += piece
    except OSError:
        if not answer:
            return ""
    return answer[:200].partition(b"\n")[0].decode("latin-1").strip()


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
