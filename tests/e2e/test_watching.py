"""Many watch, some badly: the robot's loop does not care; phones, pictures."""

from __future__ import annotations

import base64
import os
import socket
import time
from pathlib import Path
from typing import Any

import pytest
from e2e.conftest import PICTURES, Service, Window
from playwright.sync_api import Browser

pytestmark = pytest.mark.browser


def settled_loop(service: Service, seconds: float) -> Any:
    time.sleep(seconds)
    return service.get("/robot")["loop"]


def never_reading(service: Service) -> socket.socket:
    """A WebSocket client that says hello and then never reads a byte."""
    host, port = service.url.removeprefix("http://").split(":")
    client = socket.create_connection((host, int(port)))
    client.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
    key = base64.b64encode(os.urandom(16)).decode()
    client.sendall(
        f"GET /api/v1/stream HTTP/1.1\r\nHost: {host}:{port}\r\nOrigin: {service.url}\r\n"
        f"Upgrade: websocket\r\nConnection: Upgrade\r\nSec-WebSocket-Key: {key}\r\n"
        "Sec-WebSocket-Version: 13\r\n\r\n".encode()
    )
    return client


def test_watchers_do_not_slow_the_loop(browser: Browser, service: Service) -> None:
    alone = settled_loop(service, 6)
    stuck = never_reading(service)
    windows = [Window(browser, service.url) for _ in range(3)]
    for window in windows:
        window.open("/drive")
    watched = settled_loop(service, 8)
    windows.pop().page.close()
    one_gone = settled_loop(service, 4)
    for window in windows:
        window.page.close()
    stuck.close()
    print(f"loop alone {alone}, watched {watched}, one gone {one_gone}")
    for loop in (alone, watched, one_gone):
        # Fifty ticks a second where nothing else runs; beside other tests and three browsers on
        # the same two cores less, but nobody is waited for: that would be seconds.
        assert loop["rate"] > 20
        assert loop["lateness_p99"] < 0.5


def test_a_phone_has_stop_and_no_sideways_scrolling(browser: Browser, service: Service) -> None:
    phone = Window(browser, service.url, (390, 844))
    for place in ("draw", "check", "drive", "prove", "setup"):
        phone.open(f"/{place}")
        phone.page.wait_for_timeout(300)
        width = phone.page.evaluate("document.documentElement.scrollWidth")
        assert width <= 390, place
        box = phone.page.get_by_role("button", name="STOP", exact=True).bounding_box()
        assert box is not None
        assert min(box["width"], box["height"]) >= 64, place
        assert box["y"] + box["height"] <= 844, place
        assert box["x"] + box["width"] <= 390, place
    assert phone.complaints == []
    phone.page.close()


def test_pictures_of_a_scan(window: Window, service: Service, tmp_path: Path) -> None:
    folder = Path(PICTURES) if PICTURES else tmp_path
    window.open("/check")
    window.press("Scan area")
    start = window.page.get_by_role("button", name="Scan this area")
    start.wait_for(timeout=30_000)
    window.page.screenshot(path=folder / "check.png")
    start.click()
    window.wait_for("s.state === 'running'", timeout=60)
    window.page.goto(f"{service.url}/drive")
    window.wait_for(f"s.mission && s.mission.travelled > {45 if PICTURES else 1}", timeout=400)
    window.page.wait_for_timeout(800)
    window.page.screenshot(path=folder / "drive.png")
    assert (folder / "drive.png").stat().st_size > 20_000
    shown = window.page.get_by_role("complementary", name="Drive").inner_text()
    assert "Estimated" in shown
