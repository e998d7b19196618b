"""The service with hardware in its robot.toml, as far as that goes without any: a board behind a
pseudo terminal, and a camera that is a folder of pictures."""

from __future__ import annotations

import math
import os
import threading
import time
import tty
from collections.abc import Callable, Iterator
from contextlib import suppress
from pathlib import Path

import cv2
import numpy as np
import pytest
from e2e.conftest import Service

from polepilot.core.geometry import Pose2D
from polepilot.core.sim.board import Board, BoardInputs, BoardOutputs
from polepilot.core.sim.render import Renderer
from polepilot.core.site import parse_site
from polepilot.core.vehicle import Camera

TRUE_POSE = Pose2D(1.5, 2.0, 0.0)
SITE = {
    "name": "Bench",
    "boundary": [[0, 0], [6, 0], [6, 4], [0, 4]],
    # Three poles in one picture: the camera of this bench does not turn.
    "landmarks": [
        {"id": 4, "x": 4.6, "y": 2.6},
        {"id": 7, "x": 5.6, "y": 1.2},
        {"id": 2, "x": 5.0, "y": 2.0},
    ],
    "routes": [{"name": "On", "nodes": [[3.0, 2.0]]}],
    "start": [*TRUE_POSE],
}


class BoardOnAWire:
    """A board in real time at the far end of a serial line."""

    def __init__(self, path: Path) -> None:
        self.outputs = BoardOutputs()
        self._master, slave = os.openpty()
        tty.setraw(slave)
        os.set_blocking(self._master, False)
        path.symlink_to(os.ttyname(slave))
        self._slave = slave
        self._stop = threading.Event()
        self._thread = threading.Thread(target=self._run, daemon=True)
        self._thread.start()

    def close(self) -> None:
        self._stop.set()
        self._thread.join()
        os.close(self._master)
        os.close(self._slave)

    def _run(self) -> None:
        board, began = Board(), time.monotonic()
        straight_ahead = BoardInputs(pan_adc=512)
        while not self._stop.wait(0.005):
            now = time.monotonic() - began
            with suppress(BlockingIOError):
                board.receive(os.read(self._master, 4096), now)
            self.outputs = board.step(now, straight_ahead)
            if data := board.transmit():
                os.write(self._master, data)


@pytest.fixture
def board(tmp_path: Path) -> Iterator[BoardOnAWire]:
    running = BoardOnAWire(tmp_path / "ttyBoard")
    yield running
    running.close()


@pytest.fixture
def hardware(tmp_path: Path, board: BoardOnAWire) -> Iterator[Service]:
    site = parse_site(SITE, "bench")
    camera = Camera()
    renderer = Renderer(camera, site.landmarks, site.segments(), np.random.default_rng(1))
    pictures = tmp_path / "pictures"
    pictures.mkdir()
    cv2.imwrite(str(pictures / "0000.png"), renderer.render(camera.pose_on(TRUE_POSE), 0.0))
    for number in range(1, 1200):
        (pictures / f"{number:04}.png").hardlink_to(pictures / "0000.png")
    config = tmp_path / "robot.toml"
    config.write_text(
        f'[camera]\nsource = "{pictures}"\n[link]\nboard = "serial"\n'
        f'port = "{tmp_path / "ttyBoard"}"\n[server]\npanel = false\n'
    )
    running = Service(tmp_path / "data", "--config", str(config))
    yield running
    running.close()


def wait(condition: Callable[[], object], seconds: float = 20.0) -> None:
    deadline = time.monotonic() + seconds
    while not condition():
        assert time.monotonic() < deadline
        time.sleep(0.05)


def test_a_picture_and_a_serial_line_drive_wheels(hardware: Service, board: BoardOnAWire) -> None:
    assert hardware.get("/about")["simulated"] is False
    site = hardware.send("/sites", SITE)["id"]
    hardware.send("/robot/site", {"site_id": site}, "PUT")
    wait(lambda: hardware.get("/robot")["pose"])
    state = hardware.get("/robot")
    assert math.dist((state["pose"]["x"], state["pose"]["y"]), TRUE_POSE.position) < 0.05
    assert abs(state["pose"]["heading"]) < 0.02
    assert state["link"]["state"] == "idle"
    assert state["real"] is None

    plan = hardware.send("/plans", {"site_id": site, "mode": "route", "route": "On"})
    assert board.outputs.left == 0
    hardware.send("/missions", {"plan_id": plan["id"]})
    wait(lambda: board.outputs.left > 100 and board.outputs.right > 100)
    hardware.send("/robot/stop", {})
    wait(lambda: board.outputs.left == 0 and board.outputs.right == 0, 0.5)
    assert hardware.get("/robot")["state"] == "stopped"
    assert hardware.stop() == 0
