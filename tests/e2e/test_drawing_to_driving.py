"""From a drawing with real pointer events to turning wheels and back."""

from __future__ import annotations

import json
import math
import time
import urllib.request
from itertools import pairwise
from typing import Any

import pytest
from e2e.conftest import Service, Window

pytestmark = pytest.mark.browser

BOUNDARY = [(0.0, 0.0), (6.0, 0.0), (6.0, 5.0), (0.0, 5.0)]
ISLAND = [(2.6, 2.2), (3.4, 2.2), (3.4, 2.8), (2.6, 2.8)]
NO_GO = [(5.2, 4.3), (5.7, 4.3), (5.7, 4.7), (5.2, 4.7)]
LANDMARKS = [(0.0, 1.0), (0.0, 4.0), (3.0, 5.0), (6.0, 4.0), (6.0, 1.0), (3.0, 0.0)]
ROUTE = [(1.6, 1.2), (4.4, 1.2), (4.6, 3.6)]


def draw_site(window: Window) -> None:
    """A new site with everything that a route needs."""
    window.open("/draw")
    window.press("New site")
    window.draw("Draw boundary", BOUNDARY)
    window.draw("Draw island", ISLAND)
    window.draw("Draw wall", [(1.0, 3.4), (1.8, 3.4)])
    window.draw("Draw no-go area", NO_GO)
    window.press("Place landmark")
    for x, y in LANDMARKS:
        window.click(x, y)
    window.draw("Draw route", ROUTE)
    window.press("Set start")
    window.click(1.0, 1.2)
    window.page.keyboard.press("Enter")
    window.press("Save")


def saved_site(service: Service) -> dict[str, Any]:
    """The newest site, as soon as the server has it."""
    deadline = time.monotonic() + 10
    while time.monotonic() < deadline:
        sites = service.get("/sites")
        if len(sites) > 1:
            newest = max(sites, key=lambda site: int(site["id"]))
            record: dict[str, Any] = service.get(f"/sites/{newest['id']}")
            return record
        time.sleep(0.1)
    raise AssertionError("the drawing was not saved")


def test_draw_then_track_the_route(window: Window, service: Service) -> None:
    draw_site(window)
    site = saved_site(service)["site"]
    assert len(site["boundary"]) == 4
    assert len(site["islands"]) == 1
    assert len(site["walls"]) == 1
    assert len(site["no_go"]) == 1
    assert len(site["landmarks"]) == len(LANDMARKS)
    last = site["routes"][0]["nodes"][-1]
    assert math.dist(last, ROUTE[-1]) < 0.1

    window.press("Check this site")
    window.press("Track route")
    name = site["routes"][0]["name"]
    start = window.page.get_by_role("button", name=f"Track route “{name}”")
    start.wait_for(timeout=20_000)
    load = window.page.get_by_role("button", name="Load this site on the robot")
    if load.count():
        load.click()
    start.click()
    window.wait_for("s.state === 'running'", timeout=30)
    window.wait_for("s.mission === null", timeout=180)
    real = window.snapshot()["real"]
    run = service.get("/runs")[0]
    assert run["outcome"] == "done", run
    assert math.dist((real["x"], real["y"]), last) < 0.10


def test_stop_in_the_middle_of_a_run(window: Window, service: Service) -> None:
    window.open("/check")
    window.press("Scan area")
    start = window.page.get_by_role("button", name="Scan this area")
    start.wait_for(timeout=30_000)
    start.click()
    window.wait_for(
        "s.state === 'running' && Math.abs(s.command.speed) > 0.15 && s.mission.travelled > 1",
        timeout=90,
    )
    # Watched by the page itself: the stream's stamps are simulated time.
    window.page.evaluate(
        """() => {
            window.seen = [];
            const take = () => { const s = window.polepilot.snapshot();
                const last = window.seen.at(-1);
                if (s && (!last || s.stamp > last.stamp))
                    window.seen.push({stamp: s.stamp, state: s.state, real: s.real});
                requestAnimationFrame(take); };
            take();
        }"""
    )
    window.page.wait_for_timeout(300)
    window.press("STOP")
    window.wait_for("s.state === 'stopped'", timeout=5)
    window.page.wait_for_timeout(1200)
    seen = window.page.evaluate("window.seen")
    stopped = next(s["stamp"] for s in seen if s["state"] == "stopped")
    moving = [
        b["stamp"]
        for a, b in pairwise(seen)
        if math.dist((a["real"]["x"], a["real"]["y"]), (b["real"]["x"], b["real"]["y"])) > 0.002
    ]
    assert any(stamp < stopped for stamp in moving), "the robot was not driving"
    assert max(moving) - stopped <= 0.3
    assert window.snapshot()["command"]["speed"] == 0

    # Nothing moves until the stop is released and somebody resumes; then the job goes on.
    window.press("Release stop")
    window.wait_for("s.state === 'paused'", timeout=5)
    before = window.snapshot()["mission"]["travelled"]
    window.press("Resume")
    window.wait_for(f"s.state === 'running' && s.mission.travelled > {before} + 0.3", timeout=30)


def test_undo_redo_and_a_conflict_lose_nothing(window: Window, service: Service) -> None:
    draw_site(window)
    record = saved_site(service)
    window.draw("Draw island", [(4.6, 1.8), (5.2, 1.8), (5.2, 2.4)])
    window.press("Undo")
    window.press("Redo")
    # Somebody else saves first.
    site = dict(record["site"], name="Changed elsewhere")
    path = f"/sites/{record['id']}"
    request = urllib.request.Request(
        f"{service.url}/api/v1{path}",
        json.dumps(site).encode(),
        {"Content-Type": "application/json", "If-Match": f'"v{record["version"]}"'},
        method="PUT",
    )
    with urllib.request.urlopen(request, timeout=10) as answer:
        assert answer.status == 200
    window.press("Save")
    dialog = window.page.get_by_role("dialog")
    dialog.wait_for(timeout=5000)
    assert len(service.get(path)["site"]["islands"]) == 1, "theirs was overwritten"
    dialog.get_by_role("button").first.wait_for()
