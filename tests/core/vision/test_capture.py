"""Cameras: files, folders, and one that dies and comes back."""

from __future__ import annotations

import itertools
import os
import threading
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from types import SimpleNamespace

import cv2
import numpy as np
import pytest
from capture_waits import next_error, next_frame

from polepilot.core.errors import CameraError
from polepilot.core.observation import Image
from polepilot.core.vehicle import Camera
from polepilot.core.vision import capture as capture_module
from polepilot.core.vision.capture import CameraCapture, describe_fit, fit
from polepilot.core.vision.sources import open_stream
from polepilot.core.vision.stream import Stream

pytestmark = pytest.mark.timeout(60)

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
        capture._thread.join(10)  # a loaded machine takes its time
        assert not capture._thread.is_alive()


def gray(level: int, width: int = 160, height: int = 120) -> Image:
    return np.full((height, width, 3), level, np.uint8)


class FakeCamera:
    """A device driver: pictures are handed in, the cable can be pulled."""

    def __init__(self) -> None:
        self.plugged = True
        self.opened = 0
        self.released = 0
        self._next: list[Image] = []
        self._changed = threading.Condition()
        self._waiting = False

    def show(self, *images: Image) -> None:
        """Hand in pictures; returns when all were taken and the next one is waited for."""
        with self._changed:
            self._next.extend(images)
            self._waiting = False
            self._changed.notify_all()
            assert self._changed.wait_for(lambda: self._waiting, timeout=20)

    def unplug(self) -> None:
        with self._changed:
            self.plugged = False
            self._changed.notify_all()

    def open(self) -> Stream:
        self.opened += 1
        if not self.plugged:
            raise CameraError("there is no camera fake.", code="camera_missing")
        return FakeStream(self)


class Quiet:
    """A stream with nothing to say of itself."""

    live = True
    notes: tuple[str, ...] = ()

    def grab(self) -> bool:
        time.sleep(0.004)
        return True

    def stamp(self) -> float | None:
        return None

    def retrieve(self) -> Image | None:
        return gray(9)

    def release(self) -> None: ...


class FakeStream(Quiet):
    def __init__(self, camera: FakeCamera) -> None:
        self._camera = camera
        self._image = gray(0)

    def grab(self) -> bool:
        camera = self._camera
        with camera._changed:
            if not camera._next:
                camera._waiting = True
                camera._changed.notify_all()
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
    # A busy machine may skip pictures, but never shows them twice or out of order, nor the last.
    assert levels[-1] == pytest.approx(180, abs=5)
    assert np.all(np.diff(levels) > 10)
    assert np.all(np.diff(stamps) > 0)
    # Ten pictures at 20 per second: the last comes at 0.45 s, stamped by the latency earlier.
    assert before + 0.45 - 0.03 <= stamps[-1] <= time.monotonic() - 0.03


def test_folder_of_pictures_in_order_of_names(tmp_path: Path, start: Start) -> None:
    for number in (3, 1, 2):
        cv2.imwrite(str(tmp_path / f"{number:04}.png"), gray(60 * number))
    (tmp_path / "notes.txt").write_text("no picture")
    stream = open_stream(str(tmp_path), rate=100.0, size=(80, 60))
    levels = []
    while stream.grab():
        image = stream.retrieve()
        assert image is not None
        levels.append(int(image[0, 0, 0]))
    stream.release()
    assert levels == [60, 120, 180]

    capture = start(str(tmp_path))
    capture._thread.join(20)
    assert int(next_frame(capture).image[0, 0, 0]) == 180
    assert next_error(capture).code == "camera_ended"


def test_broken_picture_in_a_folder_is_named(tmp_path: Path, start: Start) -> None:
    (tmp_path / "0001.png").write_text("a text file")
    error = next_error(start(str(tmp_path)))
    assert "0001.png: is no picture" in str(error)
    assert error.code == "camera_file"


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
    assert expected in str(next_error(start(str(tmp_path / name))))
    assert capfd.readouterr().err == ""


def test_pipe_is_no_video(tmp_path: Path, start: Start) -> None:
    os.mkfifo(tmp_path / "pipe.avi")
    assert "pipe.avi is no file" in str(next_error(start(str(tmp_path / "pipe.avi"))))


def test_pipe_in_a_folder_of_pictures_does_not_hang(tmp_path: Path, start: Start) -> None:
    os.mkfifo(tmp_path / "0001.png")
    assert "0001.png: is a pipe" in str(next_error(start(str(tmp_path))))


def test_empty_folder(tmp_path: Path, start: Start) -> None:
    assert "holds no picture" in str(next_error(start(str(tmp_path))))


def test_only_the_newest_picture_is_delivered(start: Start) -> None:
    fake = FakeCamera()
    seconds = itertools.count(100.0)  # slow enough that none is thinned out
    capture = start("fake", opener=fake.open, clock=lambda: next(seconds))
    fake.show(gray(50), gray(100), gray(150))
    assert int(next_frame(capture).image[0, 0, 0]) == 150


def test_faster_camera_is_thinned_to_the_rate(start: Start) -> None:
    now = 100.0
    decoded: list[float] = []
    finished = threading.Event()

    class Quick(Quiet):
        """A hundred pictures within a second."""

        def grab(self) -> bool:
            nonlocal now
            now += 0.01
            if now < 101.0:
                return True
            finished.set()
            return False

        def retrieve(self) -> Image | None:
            decoded.append(now)
            return super().retrieve()

    camera = Camera(width=80, height=60, rate=20.0)
    start("fake", camera, opener=Quick, clock=lambda: now, backoff=(30.0,))
    assert finished.wait(20)
    assert 18 <= len(decoded) <= 22
    assert np.all(np.abs(np.diff(decoded) - 0.05) < 0.025)


def test_close_does_not_wait_for_a_driver_that_hangs(start: Start) -> None:
    woken = threading.Event()

    class Hanging(Quiet):
        def grab(self) -> bool:
            return not woken.wait(50)

    capture = start("fake", opener=Hanging)
    capture.close()
    assert capture._thread.is_alive()
    woken.set()


def test_camera_that_dies_and_comes_back(start: Start) -> None:
    fake = FakeCamera()
    capture = start("fake", opener=fake.open, backoff=(0.01, 0.02))
    fake.show(gray(10))
    next_frame(capture)

    fake.unplug()
    error = next_error(capture)
    assert error.code in ("camera_gone", "camera_missing")
    while fake.opened < 4:
        time.sleep(0.005)
    assert next_error(capture).code == "camera_missing"

    fake.plugged = True
    fake.show(gray(200))
    frame = next_frame(capture)
    while int(frame.image[0, 0, 0]) != 200:
        frame = next_frame(capture)
    capture.close()
    capture._thread.join(10)
    assert fake.released == 2


def test_silent_camera_says_since_when(start: Start) -> None:
    now = 100.0
    silent = threading.Event()

    class Silent(Quiet):
        def grab(self) -> bool:
            return not silent.wait(10)

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


@pytest.mark.parametrize(
    ("columns", "rows", "words"),
    [
        (1600, 1200, ""),
        (400, 300, ""),
        (1366, 1024, ""),  # a pixel and a half: nothing to speak of
        (1280, 720, "lose 25% at left and right"),
        (1280, 1024, "lose 6% at top and bottom"),
        (320, 240, "smaller than the 400x300"),
        (1, 5000, "smaller"),
        (5000, 1, "smaller"),
    ],
)
def test_what_is_lost_is_told(columns: int, rows: int, words: str) -> None:
    told = describe_fit(columns, rows, 400, 300)
    assert words in told
    assert bool(told) == bool(words)
    if told:
        assert f"{columns}x{rows}" in told
    assert fit(np.zeros((rows, columns, 3), np.uint8), 400, 300).shape == (300, 400, 3)


@pytest.mark.parametrize(
    ("columns", "rows"), [(1600, 1200), (1280, 720), (1280, 1024), (1366, 768)]
)
def test_one_constant_holds_in_both_directions(columns: int, rows: int) -> None:
    """A square of the world stays a square, and the middle of the lens the middle."""
    image = np.zeros((rows, columns), np.uint8)
    middle_x, middle_y, half = columns // 2, rows // 2, rows // 4
    image[middle_y - half : middle_y + half, middle_x - half : middle_x + half] = 255
    small = fit(image, 400, 300).astype(float) / 255
    across, down = small.sum(axis=1).max(), small.sum(axis=0).max()
    scale = max(400 / columns, 300 / rows)
    assert across == pytest.approx(2 * half * scale, rel=1e-3)
    assert down == pytest.approx(across, rel=1e-3)
    assert (small.sum(axis=0) * np.arange(400)).sum() / small.sum() == pytest.approx(199.5, abs=0.3)
    assert (small.sum(axis=1) * np.arange(300)).sum() / small.sum() == pytest.approx(149.5, abs=0.3)


def test_another_shape_and_other_notes_are_told_once(start: Start) -> None:
    told: list[str] = []

    class Wide(Quiet):
        notes = ("the camera fake has no autofocus.",)

        def retrieve(self) -> Image | None:
            return gray(5, 1280, 720)

    capture = start("fake", opener=Wide, notice=told.append)
    for _ in range(3):
        next_frame(capture)
    assert told[0] == "the camera fake has no autofocus."
    assert "1280x720 pixels lose 25%" in told[1]
    assert len(told) == 2


def test_stamp_of_the_driver_counts(start: Start, monkeypatch: pytest.MonkeyPatch) -> None:
    """A picture that waited for its turn is as old as its driver says."""

    class Late(Quiet):
        def stamp(self) -> float | None:
            return 49.7

    monkeypatch.setattr(capture_module, "time", SimpleNamespace(monotonic=lambda: 50.0))
    # The robot's clock starts anywhere.
    capture = start("fake", opener=Late, latency=0.04, clock=lambda: 1050.0)
    assert next_frame(capture).stamp == pytest.approx(1050.0 - 0.3 - 0.04)


@pytest.mark.parametrize("stamp", [1.0e9, -5.0, 1.0])
def test_stamp_of_another_clock_does_not_count(start: Start, stamp: float) -> None:
    class Odd(Quiet):
        def stamp(self) -> float | None:
            return stamp if stamp > 1 else time.monotonic() + stamp * 3

    before = time.monotonic()
    frame = next_frame(start("fake", opener=Odd, latency=0.04))
    assert before - 0.04 <= frame.stamp <= time.monotonic() - 0.04


def test_a_damaged_picture_is_passed_over_and_many_are_told(start: Start) -> None:
    class Torn(Quiet):
        pictures = 0

        def retrieve(self) -> Image | None:
            self.pictures += 1
            return None if self.pictures % 2 else gray(7)

    capture = start("fake", Camera(width=80, height=60, rate=240.0), opener=Torn)
    for _ in range(3):
        assert int(next_frame(capture).image[0, 0, 0]) == 7

    class Broken(Quiet):
        def retrieve(self) -> Image | None:
            return None

    capture = start("fake", Camera(width=80, height=60, rate=240.0), opener=Broken)
    error = next_error(capture)
    assert error.code == "camera_broken"
    assert "nothing but damaged pictures" in error.message


def test_a_fault_of_a_library_does_not_end_the_thread_nor_show_the_password(start: Start) -> None:
    opened = 0
    said = threading.Event()

    class Faulty(Quiet):
        def grab(self) -> bool:
            raise RuntimeError("rtsp://robin:secret@cam/live\nfailed")

    def opener() -> Stream:
        nonlocal opened
        opened += 1
        if opened == 1:
            return Faulty()
        assert said.wait(20)
        return Quiet()

    capture = start("rtsp://robin:secret@cam/live", opener=opener, backoff=(0.01,))
    error = next_error(capture)
    said.set()
    assert str(error) == "the camera rtsp://...@cam/live failed (rtsp://...@cam/live failed)."
    next_frame(capture)


def test_messages_of_a_silent_address_do_not_show_the_password(start: Start) -> None:
    now = 100.0
    silent = threading.Event()

    class Silent(Quiet):
        def grab(self) -> bool:
            return not silent.wait(10)

    capture = start("http://robin:s@ecret@cam/live?pwd=secret", opener=Silent, clock=lambda: now)
    now = 110.0
    with pytest.raises(CameraError, match=r"from http://\.\.\.@cam/live\.\.\. for 10 s"):
        capture.read()
    silent.set()
