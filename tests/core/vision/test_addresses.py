"""Network cameras: a server that streams, stops, stalls, refuses and comes back."""

from __future__ import annotations

import contextlib
import socket
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator
from typing import Any

import cv2
import numpy as np
import pytest
from capture_waits import next_error, next_frame

from polepilot.core.errors import CameraError
from polepilot.core.vehicle import Camera
from polepilot.core.vision import addresses
from polepilot.core.vision.addresses import is_address, open_address, shown
from polepilot.core.vision.capture import CameraCapture

pytestmark = pytest.mark.timeout(60)

CAMERA = Camera(width=80, height=60, rate=60.0)
RATE = 25.0
STREAM = b"HTTP/1.0 200 OK\r\nContent-Type: multipart/x-mixed-replace; boundary=next\r\n\r\n"


class Server:
    """A network camera on this machine. Picture n is grey with level n; ``sent`` says when."""

    def __init__(self, port: int = 0, *, answer: bytes = STREAM, backlog: int = 0) -> None:
        self.answer = answer
        self.backlog = backlog
        self.dripping = 0.0  # seconds between the bytes of the answer
        self.stalled = threading.Event()
        self.sent: dict[int, float] = {}
        self.requests: list[bytes] = []
        self._lines: list[socket.socket] = []
        self._door = socket.create_server(("127.0.0.1", port))
        self.port = self._door.getsockname()[1]
        self._lock = threading.Lock()
        self._closed = False
        # Daemons: whatever fails, the process can end.
        self._threads = [threading.Thread(target=self._welcome, daemon=True)]
        self._threads[0].start()

    def address(self, who: str = "") -> str:
        return f"http://{who}127.0.0.1:{self.port}/live"

    def close(self) -> None:
        self.stalled.set()
        with self._lock:  # nobody is let in from now on
            self._closed = True
            lines = (self._door, *self._lines)
        for line in lines:
            with contextlib.suppress(OSError):
                line.shutdown(socket.SHUT_RDWR)
            line.close()
        for thread in self._threads:
            thread.join(timeout=10)
            assert not thread.is_alive()

    def _welcome(self) -> None:
        with contextlib.suppress(OSError):
            while True:
                line, _ = self._door.accept()
                with self._lock:
                    if self._closed:
                        line.close()
                        return
                    self._lines.append(line)
                    thread = threading.Thread(target=self._serve, args=(line,), daemon=True)
                    self._threads.append(thread)
                    thread.start()

    def _serve(self, line: socket.socket) -> None:
        with contextlib.suppress(OSError):
            self.requests.append(line.recv(4096))
            if self.dripping:
                for byte in self.answer:
                    line.sendall(bytes([byte]))
                    if self.stalled.wait(self.dripping):
                        return
            line.sendall(self.answer)
            if self.answer is not STREAM:
                if self.answer:
                    line.shutdown(socket.SHUT_WR)
                return
            # No level comes twice.
            for number in range(250):
                if number >= self.backlog and self.stalled.wait(1 / RATE):
                    return
                picture = np.full((120, 160, 3), number, np.uint8)
                data = cv2.imencode(".jpg", picture)[1].tobytes()
                self.sent[number] = time.monotonic()
                head = b"--next\r\nContent-Type: image/jpeg\r\nContent-Length: %d\r\n\r\n"
                line.sendall(head % len(data) + data + b"\r\n")


Serve = Callable[..., Server]
Watch = Callable[..., CameraCapture]


@pytest.fixture
def serve() -> Iterator[Serve]:
    """Makes servers and closes them, whatever became of the test."""
    with contextlib.ExitStack() as stack:

        def make(*args: int, **options: Any) -> Server:
            made = Server(*args, **options)
            stack.callback(made.close)
            return made

        yield make


@pytest.fixture
def server(serve: Serve) -> Server:
    return serve()


@pytest.fixture
def watch() -> Iterator[Watch]:
    """Makes captures and closes them, before the servers."""
    with contextlib.ExitStack() as stack:

        def make(address: str, **options: Any) -> CameraCapture:
            made = CameraCapture(address, CAMERA, **options)
            stack.callback(made.close)
            return made

        yield make


@pytest.fixture
def quick(monkeypatch: pytest.MonkeyPatch) -> None:
    """Does not wait as long for cameras as on a robot."""
    monkeypatch.setattr(addresses, "_OPEN_TIMEOUT", 0.6)
    monkeypatch.setattr(addresses, "_READ_TIMEOUT", 0.6)
    monkeypatch.setattr(addresses, "_PROBE_TIMEOUT", 0.6)


def test_pictures_come_as_they_are_sent(server: Server, watch: Watch) -> None:
    capture = watch(server.address(), latency=0.0)
    levels = []
    for _ in range(20):
        frame = next_frame(capture)
        level = round(float(frame.image.mean()))
        levels.append(level)
        assert server.sent[level] <= frame.stamp <= time.monotonic()
        assert frame.image.shape == (60, 80, 3)
    assert np.all(np.diff(levels) > 0)


def test_pictures_come_in_order_after_those_that_waited(serve: Serve) -> None:
    """The first hundred are sent at once. How many are old, only this machine's load says."""
    stream = open_address(serve(backlog=100).address())
    levels = []
    for _ in range(5):
        assert stream.grab()
        image = stream.retrieve()
        assert image is not None
        levels.append(round(float(image.mean())))
    stream.release()
    assert np.all(np.diff(levels) > 0)


@pytest.mark.usefixtures("quick")
def test_server_that_dies_and_comes_back(server: Server, serve: Serve, watch: Watch) -> None:
    capture = watch(server.address("robin:secret@"), backoff=(0.05, 0.1))
    next_frame(capture)
    server.close()
    codes, said = set(), ""
    while "camera_refused" not in codes:
        error = next_error(capture)
        codes.add(error.code)
        said += str(error)
        time.sleep(0.002)
    assert codes <= {"camera_gone", "camera_refused", "camera_missing", "camera_silent"}
    assert "secret" not in said
    again = serve(server.port)
    assert next_frame(capture).image.shape == (60, 80, 3)
    assert again.requests


@pytest.mark.usefixtures("quick")
def test_server_that_stalls(server: Server, watch: Watch) -> None:
    capture = watch(server.address(), silence=0.3, backoff=(0.05, 0.1))
    next_frame(capture)
    server.stalled.set()  # the line stays open, and nothing comes
    assert next_error(capture).code in ("camera_silent", "camera_gone")


def test_close_does_not_wait_for_a_camera_that_never_answers(
    serve: Serve, watch: Watch, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(addresses, "_OPEN_TIMEOUT", 50.0)
    server = serve()
    server.answer = b" "
    server.dripping = 50.0
    capture = watch(server.address())
    capture.close()
    assert capture._thread.is_alive()  # it waits on, alone, until the server is closed


@pytest.mark.usefixtures("quick")
@pytest.mark.parametrize("answer", [b"HTTP/1.0 200 OK " * 12, STREAM + b"--next" * 100])
def test_answer_that_drips_is_given_up(serve: Serve, answer: bytes) -> None:
    """Each byte comes in time, and all of them would take a minute."""
    server = serve(answer=answer)
    server.dripping = 0.25
    begin = time.monotonic()
    with pytest.raises(CameraError):
        open_address(server.address())
    assert time.monotonic() - begin < 20


@pytest.mark.usefixtures("quick")
def test_name_that_is_never_answered_for(monkeypatch: pytest.MonkeyPatch) -> None:
    answered = threading.Event()

    def hang(*_: object, **__: object) -> list[Any]:
        answered.wait(50)
        return []

    monkeypatch.setattr(socket, "getaddrinfo", hang)
    with pytest.raises(CameraError, match=r"cam\.invalid does not answer") as caught:
        open_address("rtsp://robin:secret@cam.invalid/live")
    assert not answered.is_set()
    answered.set()
    assert caught.value.code == "camera_missing"
    assert "secret" not in str(caught.value)


@pytest.mark.usefixtures("quick")
@pytest.mark.parametrize(
    ("answer", "code", "words"),
    [
        (b"HTTP/1.0 401 Unauthorized\r\n\r\n", "camera_permission", "asks for a name and a pass"),
        (b"HTTP/1.1 403 Forbidden\r\n\r\n", "camera_permission", "asks for a name and a pass"),
        (b"HTTP/1.0 404 Not Found\r\n\r\n", "camera_missing", "has no such path"),
        (b"HTTP/1.0 503 Busy\r\n\r\n", "camera_missing", "answers with status 503"),
        (b"HTTP/1.0 200 OK\r\nContent-Type: text/html\r\n\r\n<p>Hello", "camera_missing", "no vid"),
        (b"\x00\xff\x17 what is this\r\n", "camera_silent", "sends no pictures"),
        (b"", "camera_silent", "can be reached, but sends no pictures"),
    ],
)
@pytest.mark.parametrize("scheme", ["http", "rtsp"])
def test_server_that_answers_otherwise(
    serve: Serve, scheme: str, answer: bytes, code: str, words: str
) -> None:
    server = serve(answer=answer.replace(b"HTTP", scheme.upper().encode()))
    with pytest.raises(CameraError) as caught:
        open_address(server.address("robin:s3cret@").replace("http", scheme))
    assert caught.value.code == code
    assert words in str(caught.value)
    assert f"no pictures from {scheme}://...@127.0.0.1:{server.port}/live: " in str(caught.value)
    assert "s3cret" not in str(caught.value)
    # The second look does not send the password again, least of all in the clear.
    assert b"Authorization" not in server.requests[-1]


@pytest.mark.parametrize("scheme", ["http", "rtsp"])
def test_nobody_listens(scheme: str) -> None:
    with socket.create_server(("127.0.0.1", 0)) as door:
        port = door.getsockname()[1]
    with pytest.raises(
        CameraError, match=f"127.0.0.1 refuses connections to port {port}"
    ) as caught:
        open_address(f"{scheme}://robin:s3cret@127.0.0.1:{port}/live")
    assert "s3cret" not in str(caught.value)
    assert caught.value.code == "camera_refused"


@pytest.mark.parametrize(
    ("error", "words"),
    [
        (socket.gaierror(-2, "Name or service not known"), "the name cam.invalid is not known"),
        (TimeoutError("timed out"), "cam.invalid does not answer"),
        (OSError(113, "No route to host"), "cam.invalid does not answer"),
        (OSError(101, "Network is unreachable"), r"cannot be reached \(Network is unreachable\)"),
    ],
)
def test_way_to_the_camera(monkeypatch: pytest.MonkeyPatch, error: OSError, words: str) -> None:
    class Closed:
        def isOpened(self) -> bool:  # noqa: N802 - OpenCV's name
            return False

        def release(self) -> None: ...

    place = (socket.AF_INET, socket.SOCK_STREAM, 6, "", ("192.0.2.1", 554))

    def look_up(*_: object, **__: object) -> list[Any]:
        if isinstance(error, socket.gaierror):
            raise error
        return [place]

    def fail(*_: object) -> socket.socket:
        raise error

    monkeypatch.setattr(socket, "getaddrinfo", look_up)
    monkeypatch.setattr(cv2, "VideoCapture", lambda *_: Closed())
    monkeypatch.setattr(socket, "create_connection", fail)
    with pytest.raises(CameraError, match=words) as caught:
        open_address("rtsp://robin:secret@cam.invalid/live")
    assert "secret" not in str(caught.value)


@pytest.mark.parametrize(
    "address",
    [
        "rtsp:/cam/live",
        "gopher://cam/live",
        "rtsp://",
        "rtsp://robin:12/34@cam/live",
        "rtsp://robin:pa#ss@cam/live",
        "http://cam:99999/live",
    ],
)
@pytest.mark.usefixtures("quick")
def test_no_address(address: str) -> None:
    with pytest.raises(CameraError, match="is no address of a camera") as caught:
        open_address(address)
    for part in ("robin", "12/34", "pa#ss"):
        assert part not in str(caught.value)


@pytest.mark.parametrize(
    ("source", "expected"),
    [
        ("rtsp://cam:554/live", "rtsp://cam:554/live"),
        ("rtsp://robin:secret@cam/live", "rtsp://...@cam/live"),
        ("RTSP://robin:se@cr/et@cam/live", "RTSP://...@cam/live"),
        ("http://cam/video?user=robin&pwd=secret", "http://cam/video..."),
        ("rtsp://cam/user=robin_password=secret_channel=1.sdp", "rtsp://cam/user..."),
        ("robin:secret@cam/live", "...@cam/live"),
        ("drive.avi", "drive.avi"),
        ("/home/robin/what?.avi", "/home/robin/what?.avi"),
        ("two\nlines", "'two\\nlines'"),
    ],
)
def test_what_people_see_of_an_address(source: str, expected: str) -> None:
    assert shown(source) == expected


def test_what_is_an_address() -> None:
    assert is_address("rtsp://cam/live")
    assert is_address("srt://cam:9000")
    assert not is_address("drive.avi")
    assert not is_address("/dev/video0")
    assert not is_address("C:drive.avi")


def test_nothing_but_the_error_is_said() -> None:
    # A process of its own, since FFmpeg takes its log level from the first use in a process.
    program = """
from polepilot.core.errors import CameraError
from polepilot.core.vision.sources import open_stream
try:
    open_stream("rtsp://robin:secret@127.0.0.1:9/live", rate=15, size=(640, 480))
except CameraError as error:
    print(error)
"""
    done = subprocess.run(
        [sys.executable, "-c", program], capture_output=True, text=True, timeout=50
    )
    assert done.stderr == ""
    assert "no pictures from rtsp://...@127.0.0.1:9/live: 127.0.0.1 refuses" in done.stdout
    assert "secret" not in done.stdout
