"""Precision maps over REST, computed by a process of their own."""

from __future__ import annotations

import asyncio
import os
import signal
import time
from typing import Any, cast

import pytest
from server.fakes import SQUARE, TestClient

from polepilot.core.errors import InputError, SiteError
from polepilot.core.vehicle import RobotModel
from polepilot.server.errors import BusyError
from polepilot.server.precision import Precision
from polepilot.server.routes.common import while_waited_for
from polepilot.server.services import Services

SITES = "/api/v1/sites"
POLES = [{"id": i, "x": x, "y": y} for i, x, y in [(1, 0, 1), (2, 6, 4), (4, 3, 0), (7, 2, 5)]]


def ask(client: TestClient, path: str, **body: Any) -> dict[str, Any]:
    answer = client.post(f"{SITES}{path}/precision", json=body)
    assert answer.status_code == 200, answer.text
    document: dict[str, Any] = answer.json()
    return document


def test_the_map_of_a_kept_site(client: TestClient) -> None:
    found = ask(client, "/1")
    assert (found["columns"], found["rows"], found["resolution"]) == (40, 30, 0.2)
    assert len(found["position"]) == 30
    assert all(len(row) == 40 for row in found["reason"])
    for key in ("position", "heading"):
        for values, reasons in zip(found[key], found["reason"], strict=True):
            assert [value is None for value in values] == [reason != 0 for reason in reasons]
    assert 0.005 < found["mean_position"] < 0.03
    assert found["classes"] == sorted(found["classes"])
    assert found["suggest"] is None


def test_landmarks_that_are_not_kept(client: TestClient) -> None:
    site = client.post(SITES, json=SQUARE).json()["id"]
    two = ask(client, f"/{site}")
    four = ask(client, f"/{site}", landmarks=POLES)
    none = ask(client, f"/{site}", landmarks=[])
    assert four["overall"] < 0.7 * two["overall"]
    assert none["mean_position"] is None
    assert none["coverage"] == 0
    assert len(client.get(f"{SITES}/{site}").json()["site"]["landmarks"]) == 2


def test_a_drawing_that_is_not_kept(client: TestClient) -> None:
    before = client.get(SITES).json()
    drawn = ask(client, "", site={**SQUARE, "landmarks": POLES})
    site = client.post(SITES, json=SQUARE).json()["id"]
    assert drawn == ask(client, f"/{site}", landmarks=POLES)
    assert len(client.get(SITES).json()) == len(before) + 1


def test_resolution_and_detail(client: TestClient) -> None:
    assert ask(client, "/1", resolution=0.5)["resolution"] == 0.5
    assert ask(client, "/1", detail="fine")["resolution"] < 0.1


def test_suggestions(client: TestClient) -> None:
    found = ask(client, "", site=SQUARE, suggest=2)
    more = found["suggest"]
    first, second = more["suggestions"]
    assert first["id"] not in (1, 2)
    assert second["overall"] < first["overall"] < more["before"]["overall"]
    assert more["overall_bound"] < second["overall"]
    assert 0 < more["gain"] <= more["gain_bound"]


@pytest.mark.parametrize(
    ("path", "body", "status", "word"),
    [
        ("/77", {}, 404, "site"),
        ("/1", {"detail": "finest"}, 422, "detail"),
        ("/1", {"resolution": 0}, 422, "resolution"),
        ("/1", {"resolution": 0.001}, 422, "resolution"),
        ("/1", {"suggest": 21}, 422, "suggest"),
        ("/1", {"suggest": True}, 422, "suggest"),
        ("/1", {"suggest": 9}, 422, "ids left"),
        ("/1", {"landmarks": [{"id": 1, "x": 1}]}, 422, "y"),
        ("/1", {"landmarks": [POLES[0], POLES[0]]}, 422, "landmarks[1].id"),
        ("/1", {"landmarks": [{**POLES[0], "bits": 7}]}, 422, "bits"),
        ("/1", {"poles": []}, 422, "poles"),
        ("", {}, 422, "site"),
        ("", {"site": {}}, 422, "boundary"),
        ("", {"site": {"boundary": [[0, 0], [1, 1], [1, 0], [0, 1]]}}, 422, "boundary"),
    ],
)
def test_refusals(
    client: TestClient, path: str, body: dict[str, Any], status: int, word: str
) -> None:
    answer = client.post(f"{SITES}{path}/precision", json=body)
    assert answer.status_code == status, answer.text
    assert answer.headers["content-type"] == "application/problem+json"
    assert word in answer.json()["detail"]


def test_a_map_while_a_landmark_is_dragged(client: TestClient) -> None:
    """100 ms are allowed for a site like the demo with ten poles, over HTTP, JSON and a process of
    its own; the best of ten, since others use this machine too."""
    marks = [*client.get(f"{SITES}/1").json()["site"]["landmarks"]]
    marks += [{"id": 3, "x": 5.0, "y": 6.0}, {"id": 5, "x": 3.5, "y": 2.5}]
    ask(client, "/1", landmarks=marks)
    taken = []
    for step in range(10):
        marks[0] = {**marks[0], "y": 0.9 + 0.05 * step}
        began = time.perf_counter()
        ask(client, "/1", landmarks=marks)
        taken.append(time.perf_counter() - began)
    assert min(taken) < 0.1, taken


def test_the_process_is_not_started_before_it_is_needed(
    client: TestClient, services: Services
) -> None:
    assert services.precision._process is None
    ask(client, "/1")
    process = services.precision._process
    assert process is not None
    ask(client, "/1")
    assert services.precision._process is process


class TestProcess:
    def test_survives_what_it_is_told_and_is_replaced(self) -> None:
        async def use() -> None:
            precision = Precision(RobotModel())
            try:
                with pytest.raises(SiteError, match="boundary"):
                    await precision.map({})
                with pytest.raises(InputError, match="resolution"):
                    await precision.map(SQUARE, resolution=1e-6)
                assert precision._process is not None
                first = precision._process.pid
                waiting = asyncio.create_task(precision.map(SQUARE, detail="fine", suggest=4))
                await asyncio.sleep(0)
                os.kill(first, signal.SIGKILL)
                with pytest.raises(BusyError):
                    await waiting
                assert (await precision.map(SQUARE))["rows"]
                assert precision._process.pid != first
            finally:
                await precision.close()
            with pytest.raises(BusyError, match="shutting down"):
                await precision.map(SQUARE)

        asyncio.run(use())

    def test_a_map_that_takes_too_long(self, monkeypatch: pytest.MonkeyPatch) -> None:
        monkeypatch.setattr("polepilot.server.precision.TIMEOUT", 0.02)

        async def use() -> None:
            precision = Precision(RobotModel())
            try:
                with pytest.raises(BusyError, match="was not ready"):
                    await precision.map(SQUARE, detail="fine")
            finally:
                await precision.close()

        asyncio.run(use())


def test_what_nobody_waits_for_any_more_is_given_up() -> None:
    class Gone:
        async def is_disconnected(self) -> bool:
            return True

    class Here:
        async def is_disconnected(self) -> bool:
            return False

    ended: list[str] = []

    async def work(seconds: float) -> str:
        try:
            await asyncio.sleep(seconds)
        except asyncio.CancelledError:
            ended.append("given up")
            raise
        return "done"

    async def both() -> tuple[Any, Any]:
        left = await while_waited_for(cast("Any", Gone()), work(60.0))
        return left, await while_waited_for(cast("Any", Here()), work(0.4))

    begin = time.monotonic()
    left, waited = asyncio.run(both())
    assert (left.status_code, waited, ended) == (503, "done", ["given up"])
    assert time.monotonic() - begin < 30.0
