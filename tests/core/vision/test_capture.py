"""Cameras: files, folders, missing and forbidden devices, and one that dies and comes back."""

from __future__ import annotations

import errno
import os
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import cv2
import numpy as np
import pytest

from polepilot.core.errors import CameraError
from polepilot.core.observation import Frame, Image
from polepilot.core.vehicle import Camera
from polepilot.core.vision import sources
from polepilot.core.vision.capture import CameraCapture, fit

CAMERA = Camera(width=80, height=60, rate=30.0)
Start = Callable[..., CameraCapture]


@pytest.fixture
def start() -> Iterator[Start]:
    """Makes captures and closes them."""
    running: list[CameraCapture] = []

    def make(source: int | str, camera: Camera = CAMERA, **options: object) -> CameraCapture:
        running.append(CameraCapture(source, camera, **options))  # type: ignore[arg-type]
        return running[-1]

    yield make
    for capture in running:
        capture.close()
        assert not capture._thread.is_alive()


def gray(level: int, width: int = 160, height: int = 120) -> Image:
    return np.full((height, width, 3), level, np.uint8)


def wait_for_frame(capture: CameraCapture, limit: float = 10.0) -> Frame:
    """The next frame, whatever errors come before it."""
    end = time.monotonic() + limit
    while time.monotonic() < end:
        try:
            frame = capture.read()
        except CameraError:
            frame = None
        if frame is not None:
            return frame
        time.sleep(0.002)
    pytest.fail("no frame came")


def wait_for_error(capture: CameraCapture, limit: float = 10.0) -> CameraError:
    """The next error, whatever frames come before it."""
    end = time.monotonic() + limit
    while time.monotonic() < end:
        try:
            capture.read()
        except CameraError as error:
            return error
        time.sleep(0.002)
    pytest.fail("no error came")


class FakeCamera:
    """A device driver: pictures are handed in, the cable can be pulled."""

    def __init__(self) -> None:
        self.plugged = True
        self.opened = 0
        self.released = 0
        self._next: list[Image] = []
        self._changed = threading.Condition()

    def show(self, *images: Image) -> None:
        with self._changed:
            self._next.extend(images)
            self._changed.notify_all()

    def unplug(self) -> None:
        with self._changed:
            self.plugged = False
            self._changed.notify_all()

    def open(self) -> sources.Stream:
        self.opened += 1
        if not self.plugged:
            raise CameraError("there is no camera fake.", code="camera_missing")
        return FakeStream(self)


class FakeStream:
    live = True

    def __init__(self, camera: FakeCamera) -> None:
        self._camera = camera
        self._image = gray(0)

    def grab(self) -> bool:
        camera = self._camera
        with camera._changed:
            camera._changed.wait_for(lambda: camera._next or not camera.plugged, timeout=0.2)
            if not camera.plugged:
                return False
            if camera._next:
                self._image = camera._next.pop(0)
        return True

    def retrieve(self) -> Image | None:
        return self._image

    def release(self) -> None:
        self._camera.released += 1


def test_video_file_is_played_at_its_rate_and_ends(tmp_path: Path, start: Start) -> None:
    path = tmp_path / "drive.avi"
    writer = cv2.VideoWriter(str(path), cv2.VideoWriter.fourcc(*"MJPG"), 20.0, (160, 120))
    for level in range(0, 200, 20):
        writer.write(gray(level))
    writer.release()

    before = time.monotonic()
    capture = start(str(path), latency=0.03)
    frames = []
    end = ""
    while not end:
        frame = None
        try:
            frame = capture.read()
        except CameraError as error:
            end = error.code
        if frame is not None:
            frames.append(frame)
        time.sleep(0.001)

    assert end == "camera_ended"
    levels = [float(frame.image.mean()) for frame in frames]
    stamps = [frame.stamp for frame in frames]
    assert all(frame.image.shape == (60, 80, 3) for frame in frames)
    # A busy machine may skip pictures, but never shows them twice or out of order.
    assert len(frames) >= 5
    assert np.all(np.diff(levels) > 10)
    assert np.all(np.diff(stamps) > 0)
    # Ten pictures at 20 per second: the last comes at 0.45 s, stamped by the latency earlier.
    assert before + 0.45 - 0.03 <= stamps[-1] <= time.monotonic() - 0.03


def test_folder_of_pictures_in_order_of_names(tmp_path: Path, start: Start) -> None:
    for number in (3, 1, 2):
        cv2.imwrite(str(tmp_path / f"{number:04}.png"), gray(60 * number))
    (tmp_path / "notes.txt").write_text("no picture")
    capture = start(str(tmp_path), Camera(width=80, height=60, rate=5.0))
    levels = [int(wait_for_frame(capture).image[0, 0, 0]) for _ in range(3)]
    assert levels == [60, 120, 180]
    assert wait_for_error(capture).code == "camera_ended"


def test_broken_picture_in_a_folder_is_named(tmp_path: Path, start: Start) -> None:
    (tmp_path / "0001.png").write_text("a text file")
    error = wait_for_error(start(str(tmp_path)))
    assert "0001.png is no readable picture" in str(error)


@pytest.mark.parametrize(
    ("name", "content", "expected"),
    [
        ("absent.avi", None, "absent.avi cannot be read (No such file or directory)"),
        ("text.avi", b"no video at all\n" * 50, "text.avi is no video"),
        ("empty.avi", b"", "empty.avi is no video"),
    ],
)
def test_file_that_is_no_video(
    tmp_path: Path, start: Start, name: str, content: bytes | None, expected: str,
    capfd: pytest.CaptureFixture[str],
) -> None:  # fmt: skip
    if content is not None:
        (tmp_path / name).write_bytes(content)
    assert expected in str(wait_for_error(start(str(tmp_path / name))))
    assert capfd.readouterr().err == ""


def test_empty_folder(tmp_path: Path, start: Start) -> None:
    assert "holds no picture" in str(wait_for_error(start(str(tmp_path))))


def test_missing_device_lists_those_found(
    tmp_path: Path, start: Start, monkeypatch: pytest.MonkeyPatch
) -> None:
    for name in ("video0", "video2", "video10"):
        (tmp_path / name).touch()
    monkeypatch.setattr(sources, "_DEVICES", tmp_path)
    error = wait_for_error(start(7))
    assert error.message == f"there is no camera {tmp_path}/video7."
    found = ", ".join(f"{tmp_path}/{name}" for name in ("video0", "video2", "video10"))
    assert error.remedy == f"Found: {found}."


def test_no_device_at_all(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sources, "_DEVICES", tmp_path)
    with pytest.raises(CameraError, match="No video device was found"):
        sources.open_stream(0, rate=15, size=(640, 480))


@pytest.mark.parametrize(
    ("number", "code", "remedy"),
    [
        (errno.EACCES, "camera_permission", "sudo usermod -aG video robin"),
        (errno.EBUSY, "camera_busy", "Close that program"),
        (errno.ENODEV, "camera", "plug it in again"),
    ],
)
def test_device_that_may_not_be_opened(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, number: int, code: str, remedy: str
) -> None:
    def refuse(*_: object) -> int:
        raise OSError(number, os.strerror(number))

    (tmp_path / "video0").touch()
    monkeypatch.setattr(sources, "_DEVICES", tmp_path)
    monkeypatch.setattr(sources, "_user", lambda: "robin")
    monkeypatch.setattr(os, "open", refuse)
    with pytest.raises(CameraError) as caught:
        sources.open_stream(0, rate=15, size=(640, 480))
    assert caught.value.code == code
    assert remedy in caught.value.remedy


def test_file_that_is_no_device_is_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "video0").touch()
    monkeypatch.setattr(sources, "_DEVICES", tmp_path)
    with pytest.raises(CameraError, match="delivers no pictures"):
        sources.open_stream(0, rate=15, size=(640, 480))
    with pytest.raises(CameraError, match="is no video device"):
        sources.open_stream("/dev/null", rate=15, size=(640, 480))


def test_address_without_camera_does_not_show_the_password() -> None:
    # A process of its own, since FFmpeg takes its log level from the first use in a process.
    program = """
from polepilot.core.errors import CameraError
from polepilot.core.vision.sources import open_stream
try:
    open_stream("rtsp://robin:secret@127.0.0.1:9/live", rate=15, size=(640, 480))
except CameraError as error:
    print(error)
"""
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True)
    assert done.stderr == ""
    assert "no pictures from rtsp://...@127.0.0.1:9/live. Check address" in done.stdout


def test_only_the_newest_picture_is_delivered(start: Start) -> None:
    fake = FakeCamera()
    capture = start(0, Camera(width=80, height=60, rate=240.0), opener=fake.open)
    wait_for_frame(capture)
    for level in (50, 100, 150):
        fake.show(gray(level))
        time.sleep(0.05)
    assert int(wait_for_frame(capture).image[0, 0, 0]) == 150


def test_faster_camera_is_thinned_to_the_rate(start: Start) -> None:
    class Quick:
        live = True
        decoded = 0

        def grab(self) -> bool:
            time.sleep(0.004)
            return True

        def retrieve(self) -> Image:
            self.decoded += 1
            return gray(9)

        def release(self) -> None: ...

    quick = Quick()
    capture = start(0, Camera(width=80, height=60, rate=20.0), opener=lambda: quick)
    begin = time.monotonic()
    time.sleep(0.6)
    elapsed = time.monotonic() - begin
    capture.close()
    assert 1 <= quick.decoded <= 1.4 * 20 * elapsed + 2


def test_camera_that_dies_and_comes_back(start: Start) -> None:
    fake = FakeCamera()
    capture = start("fake", opener=fake.open, backoff=(0.01, 0.02))
    fake.show(gray(10))
    wait_for_frame(capture)

    fake.unplug()
    error = wait_for_error(capture)
    assert error.code in ("camera_gone", "camera_missing")
    while fake.opened < 4:
        time.sleep(0.005)
    assert wait_for_error(capture).code == "camera_missing"

    fake.plugged = True
    fake.show(gray(200))
    frame = wait_for_frame(capture)
    while int(frame.image[0, 0, 0]) != 200:
        frame = wait_for_frame(capture)
    capture.close()
    assert fake.released == 2


def test_silent_camera_says_since_when(start: Start) -> None:
    now = 100.0
    silent = threading.Event()

    class Silent:
        live = True

        def grab(self) -> bool:
            return not silent.wait(10)

        def retrieve(self) -> Image | None:
            return None

        def release(self) -> None: ...

    capture = start("fake", opener=Silent, clock=lambda: now)
    now = 101.9
    assert capture.read() is None
    now = 102.6
    with pytest.raises(CameraError, match="no picture from fake for 3 s"):
        capture.read()
    silent.set()


def test_fit_averages_and_keeps_pixels_square() -> None:
    fine = np.zeros((1200, 1600, 3), np.uint8)
    fine[::2] = 200
    assert np.all(fit(fine, 400, 300) == 100)

    # 16:9 for a 4:3 picture: the sides are cut, the middle column stays the middle.
    wide = np.zeros((720, 1280), np.uint8)
    wide[:, 639:641] = 255
    small = fit(wide, 400, 300)
    assert small.shape == (300, 400)
    weights = small[150].astype(float)
    assert float((weights * np.arange(400)).sum() / weights.sum()) == pytest.approx(199.5)

    same = gray(3, 400, 300)
    assert fit(same, 400, 300) is same
    assert fit(gray(7, 40, 30), 400, 300).shape == (300, 400, 3)
