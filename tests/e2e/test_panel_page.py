"""The 3D panel in a browser, behind the same port as the page."""

from __future__ import annotations

import time
from collections.abc import Iterator
from pathlib import Path

import pytest
from e2e.conftest import PICTURES, Service, chromium
from playwright.sync_api import Browser, sync_playwright

pytestmark = pytest.mark.browser


@pytest.fixture
def browser_3d(tmp_path: Path) -> Iterator[Browser]:
    with sync_playwright() as playwright:
        running = chromium(playwright, tmp_path, three_d=True)
        yield running
        running.close()


def test_the_panel_shows_the_run(service: Service, browser_3d: Browser, tmp_path: Path) -> None:
    folder = Path(PICTURES) if PICTURES else tmp_path
    site = service.get("/sites")[0]["id"]
    plan = service.send("/plans", {"site_id": site, "mode": "route", "route": "Tour"})
    service.send("/missions", {"plan_id": plan["id"]})
    page = browser_3d.new_page(viewport={"width": 1280, "height": 800})
    complaints: list[str] = []
    page.on("pageerror", lambda error: complaints.append(str(error)))
    page.goto(f"{service.url}/viser/")
    page.locator("canvas").first.wait_for(timeout=30_000)
    page.get_by_text("estimated").first.wait_for(timeout=30_000)
    deadline = time.monotonic() + 60
    while service.get("/robot")["state"] != "running" and time.monotonic() < deadline:
        page.wait_for_timeout(200)
    page.wait_for_timeout(20_000 if PICTURES else 3_000)
    page.screenshot(path=folder / "panel.png")
    assert (folder / "panel.png").stat().st_size > 20_000
    assert complaints == []
