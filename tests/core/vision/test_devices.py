"""Cameras of this machine, by a driver that is played: fake_v4l2.c answers OpenCV's calls."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
import textwrap
from collections.abc import Callable
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest

COMPILER = shutil.which("cc") or shutil.which("gcc")
SIZES = ((640, 480), (1280, 720), (1600, 1200))

pytestmark = [
    # A machine without a compiler fails: `./run test` installs one.
    pytest.mark.skipif(not sys.platform.startswith("linux"), reason="Video4Linux"),
    pytest.mark.timeout(60),
]

Play = Callable[[str], dict[str, Any]]

_START = """
import json, sys, time
from pathlib import Path
from polepilot.core.errors import CameraError
from polepilot.core.vehicle import Camera
from polepilot.core.vision import device_faults
from polepilot.core.vision.capture import CameraCapture
from polepilot.core.vision.devices import CameraControls
from polepilot.core.vision.sources import open_stream

folder = Path(sys.argv[1])
device_faults._DEVICES = folder
state = (folder / "state").write_text
out = {}

def until(what, limit=15):
    end = time.monotonic() + limit
    while time.monotonic() < end:
        if (found := what()):
            return found
        time.sleep(0.002)
    raise SystemExit("it did not happen")

def frame():
    try:
        return capture.read()
    except CameraError:
        return None

def error():
    try:
        capture.read()
    except CameraError as error:
        return error
"""


@pytest.fixture(scope="session")
def driver(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The played driver, compiled, beside the pictures that it shows."""
    folder = tmp_path_factory.mktemp("camera")
    source = Path(__file__).with_name("fake_v4l2.c")
    library = folder / "fake_v4l2.so"
    assert COMPILER is not None
    subprocess.run(
        [COMPILER, "-shared", "-fPIC", "-O1", "-o", library, source, "-ldl", "-lpthread"],
        check=True,
        timeout=50,
    )
    for number, (width, height) in enumerate(SIZES):
        picture = np.full((height, width, 3), 60 * (number + 1), np.uint8)
        cv2.imwrite(str(folder / f"{width}x{height}.jpg"), picture)
    return library


@pytest.fixture
def play(driver: Path, tmp_path: Path) -> Play:
    """Runs a program with the camera ``video7``; gives what it wrote to ``out``, and the log."""

    def run(program: str) -> dict[str, Any]:
        (tmp_path / "video7").touch()
        (tmp_path / "state").touch()
        (tmp_path / "log").touch()
        done = subprocess.run(
            [
                sys.executable,
                "-c",
                f"{_START}\n{textwrap.dedent(program)}\nprint(json.dumps(out))",
                tmp_path,
            ],
            env={
                **os.environ,
                "LD_PRELOAD": str(driver),
                "FAKE_CAMERA": "/video7",
                "FAKE_STATE": str(tmp_path / "state"),
                "FAKE_LOG": str(tmp_path / "log"),
                "FAKE_PICTURES": str(driver.parent),
            },
            capture_output=True,
            text=True,
            timeout=50,
        )
        assert done.returncode == 0, done.stderr
        words = [line.split() for line in (tmp_path / "log").read_text().splitlines()]
        log = {" ".join(line[:-1]): int(line[-1]) for line in words}
        return {**json.loads(done.stdout), "log": log}

    return run


FOCUS_AUTO, FOCUS = "control 009a090c", "control 009a090a"
EXPOSURE_AUTO, EXPOSURE = "control 009a0901", "control 009a0902"
WHITE_AUTO, WHITE = "control 0098090c", "control 0098091a"


def test_asked_for_size_rate_and_few_buffers(play: Play) -> None:
    seen = play("""
        stream = open_stream(7, rate=15, size=(1600, 1200))
        assert stream.grab()
        out["shape"] = stream.retrieve().shape
        out["level"] = float(stream.retrieve().mean())
        out["notes"] = stream.notes
        stream.release()
    """)
    assert seen["shape"] == [1200, 1600, 3]
    assert seen["level"] == pytest.approx(180, abs=2)
    assert seen["notes"] == []
    log = seen["log"]
    assert log["rate"] == 15
    assert log["buffers"] == 2
    # Nobody asked for anything: the lens is held, the rest is automatic.
    assert log[FOCUS_AUTO] == 0
    assert log[EXPOSURE_AUTO] == 3
    assert log[WHITE_AUTO] == 1
    assert FOCUS not in log
    assert EXPOSURE not in log
    assert WHITE not in log


def test_lens_exposure_and_white_balance_are_held(play: Play) -> None:
    seen = play("""
        controls = CameraControls(focus=10, exposure=0.004, white_balance=4600)
        open_stream(7, rate=30, size=(640, 480), controls=controls).release()
    """)
    log = seen["log"]
    assert (log[FOCUS_AUTO], log[FOCUS]) == (0, 10)
    assert (log[EXPOSURE_AUTO], log[EXPOSURE]) == (1, 40)  # units of 0.1 ms
    assert (log[WHITE_AUTO], log[WHITE]) == (0, 4600)


def test_another_size_is_told_and_cut(play: Play) -> None:
    seen = play("""
        out["told"] = []
        capture = CameraCapture(
            7, Camera(), capture_size=(1280, 960), notice=out["told"].append
        )
        out["shape"] = until(frame).image.shape
        capture.close()
    """)
    assert seen["shape"] == [300, 400, 3]
    assert "video7 gives 1280x720 instead of 1280x960" in seen["told"][0]
    assert "lose 25% at left and right" in seen["told"][1]


def test_pictures_are_stamped_by_the_driver(play: Play) -> None:
    seen = play("""
        stream = open_stream(7, rate=30, size=(640, 480))
        stamps, ages = [], []
        for _ in range(30):
            assert stream.grab()
            stamps.append(stream.stamp())
            ages.append(time.monotonic() - stamps[-1])
            stream.retrieve()
        time.sleep(0.5)  # two more pile up meanwhile
        assert stream.grab()
        out["waited"] = time.monotonic() - stream.stamp()
        out["stamps"], out["ages"] = stamps, ages
        stream.release()
    """)
    # The played driver stamps the beginning of a picture and hands it over a period later, at the
    # earliest.
    assert min(seen["ages"]) >= 0.033
    assert min(np.diff(seen["stamps"])) >= 0.033
    assert seen["waited"] > 0.4


def test_unplugged_and_plugged_in_again(play: Play) -> None:
    seen = play("""
        capture = CameraCapture(7, Camera(), backoff=(0.02,))
        until(frame)
        state("gone")
        out["first"] = until(error).code
        (folder / "video7").rename(folder / "away")
        out["missing"] = str(until(lambda: (e := error()) and e.code == "camera_missing" and e))
        (folder / "away").rename(folder / "video7")
        state("")
        until(frame)
        capture.close()
    """)
    assert seen["first"] in ("camera_gone", "camera")
    assert "there is no camera" in seen["missing"]
    assert "No video device was found" in seen["missing"]


def test_silent_camera(play: Play) -> None:
    seen = play("""
        capture = CameraCapture(7, Camera(), silence=0.3, backoff=(0.02,))
        until(frame)
        state("still")
        out["silent"] = until(error).code
        out["stopped"] = str(until(lambda: (e := error()) and e.code == "camera_gone" and e))
        state("")
        until(frame)
        state("still")
        capture.close()
    """)
    assert seen["silent"] in ("camera_silent", "camera_gone")
    assert "has stopped sending pictures" in seen["stopped"]


def test_torn_pictures_are_not_delivered(play: Play) -> None:
    seen = play("""
        capture = CameraCapture(7, Camera(rate=60), capture_size=(640, 480), backoff=(0.02,))
        until(frame)
        state("damaged")
        out["error"] = until(lambda: (e := error()) and e.code == "camera_broken" and str(e))
        state("")
        out["level"] = float(until(frame).image.mean())
        capture.close()
    """)
    assert "nothing but damaged pictures" in seen["error"]
    assert seen["level"] == pytest.approx(60, abs=2)


@pytest.mark.parametrize(
    ("state", "code", "words"),
    [
        ("busy", "camera_busy", "is in use by another program"),
        ("other data", "camera_unusable", "gives no pictures: many cameras have a second device"),
        ("gone", "camera", "cannot be opened (No such device)"),
    ],
)
def test_device_that_refuses(play: Play, state: str, code: str, words: str) -> None:
    seen = play(f"""
        state("{state}")
        try:
            open_stream(7, rate=30, size=(640, 480))
        except CameraError as error:
            out["code"], out["text"] = error.code, str(error)
    """)
    assert seen["code"] == code
    assert words in seen["text"]
