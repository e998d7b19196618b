"""A running service on a free port and a headless Chromium in front of it."""

from __future__ import annotations

import json
import os
import re
import shutil
import signal
import subprocess
import sys
import threading
import time
import urllib.request
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from playwright.sync_api import Browser, Page, Playwright, sync_playwright

PICTURES = os.environ.get("POLEPILOT_PICTURES")
"""A folder for the pictures of the documentation; without it the same pages are looked at, but
briefly."""

CHROMIUM_FLAGS = [
    "--no-sandbox",
    "--disable-quic",
    "--no-first-run",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
]


class Service:
    """``polepilot serve`` as a user would start it, with the simulated robot."""

    def __init__(self, data: Path, *arguments: str) -> None:
        self.data = data
        self._lines: list[str] = []
        command = [sys.executable, "-c", "from polepilot.commands.main import main; main()"]
        self._process = subprocess.Popen(
            [*command, "serve", "--port", "0", "--data", str(data), *arguments],
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
            env={**os.environ, "PYTHONUNBUFFERED": "1"},
        )
        threading.Thread(target=self._collect, daemon=True).start()
        self.url = self._wait_for_address()

    def get(self, path: str) -> Any:
        with urllib.request.urlopen(f"{self.url}/api/v1{path}", timeout=10) as answer:
            return json.load(answer)

    def send(self, path: str, body: Any, method: str = "POST") -> Any:
        request = urllib.request.Request(
            f"{self.url}/api/v1{path}",
            json.dumps(body).encode(),
            {"Content-Type": "application/json"},
            method=method,
        )
        with urllib.request.urlopen(request, timeout=30) as answer:
            return json.load(answer)

    def stop(self) -> int:
        """SIGTERM; the exit status."""
        self._process.send_signal(signal.SIGTERM)
        return self._process.wait(timeout=20)

    def close(self) -> None:
        if self._process.poll() is None:
            self.stop()

    def _collect(self) -> None:
        assert self._process.stdout is not None
        for line in self._process.stdout:
            self._lines.append(line)
        self._process.stdout.close()

    def _wait_for_address(self) -> str:
        deadline = time.monotonic() + 60
        while time.monotonic() < deadline:
            found = re.search(r"(http://127\.0\.0\.1:\d+)", "".join(self._lines))
            if found:
                return found[1]
            if self._process.poll() is not None:
                break
            time.sleep(0.05)
        raise RuntimeError("the service did not start: " + "".join(self._lines))


@pytest.fixture
def service(tmp_path: Path) -> Iterator[Service]:
    running = Service(tmp_path / "data")
    yield running
    running.close()


def chromium(playwright: Playwright, folder: Path, *, three_d: bool = False) -> Browser:
    """A headless Chromium that yields to the robot: in life it runs on another machine."""
    program = shutil.which("chromium")
    assert program, "Chromium is missing: ./run test installs it."
    polite = folder / "chromium"
    polite.write_text(f'#!/bin/sh\nexec nice -n 15 {program} "$@"\n')
    polite.chmod(0o755)
    drawing = ["--use-gl=angle", "--use-angle=swiftshader"] if three_d else ["--disable-gpu"]
    return playwright.chromium.launch(executable_path=str(polite), args=[*CHROMIUM_FLAGS, *drawing])


@pytest.fixture(scope="module")
def browser(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Browser]:
    # Not for the whole session: as long as it lives its event loop counts as running.
    with sync_playwright() as playwright:
        running = chromium(playwright, tmp_path_factory.mktemp("chromium"))
        yield running
        running.close()


class Window:
    """A page as somebody in front of it uses it: real pointer and keyboard events."""

    def __init__(self, browser: Browser, url: str, size: tuple[int, int] = (1440, 900)) -> None:
        self.page: Page = browser.new_page(viewport={"width": size[0], "height": size[1]})
        self.complaints: list[str] = []
        self.page.on("pageerror", lambda error: self.complaints.append(str(error)))
        self.url = url

    def open(self, path: str = "/") -> None:
        self.page.goto(self.url + path)
        self.wait_for("true", timeout=20)

    def snapshot(self) -> Any:
        return self.page.evaluate("window.polepilot.snapshot()")

    def press(self, name: str) -> None:
        self.page.get_by_role("button", name=name, exact=True).first.click()

    def click(self, x: float, y: float, *, twice: bool = False) -> None:
        """A click on the map at a place in metres."""
        px, py = self.page.evaluate("p => window.polepilot.pixelOf(p)", [x, y])
        self.page.mouse.move(px, py, steps=4)
        if twice:
            self.page.mouse.dblclick(px, py)
        else:
            self.page.mouse.click(px, py)
        # Two clicks at once in one place would be taken for a double click.
        self.page.wait_for_timeout(60)

    def draw(self, tool: str, points: list[tuple[float, float]]) -> None:
        """Pick a tool, click each point, end with Enter."""
        self.press(tool)
        for x, y in points:
            self.click(x, y)
        self.page.keyboard.press("Enter")

    def wait_for(self, condition: str, timeout: float = 30.0) -> None:
        """Until ``condition``, a JavaScript expression on the snapshot ``s``, holds."""
        deadline = time.monotonic() + timeout
        question = f"(() => {{ const s = window.polepilot?.snapshot(); return s && {condition}; }})"
        # Asked from outside: the page's own policy forbids what wait_for_function does.
        while not self.page.evaluate(question):
            assert time.monotonic() < deadline, f"{condition}: {self.snapshot()}"
            self.page.wait_for_timeout(50)


@pytest.fixture
def window(browser: Browser, service: Service) -> Iterator[Window]:
    opened = Window(browser, service.url)
    yield opened
    opened.page.close()
    assert opened.complaints == []
