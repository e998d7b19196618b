"""Plans over REST, computed by the planning process."""

from __future__ import annotations

import asyncio
import http.client
import json
import math
import os
import signal
import threading
import time
from collections.abc import Callable
from typing import Any

import httpx
import pytest
from server.conftest import Running
from server.fakes import SQUARE, FakeRobot, TestClient
from shapely import LineString, MultiPolygon, box

from polepilot.core.errors import InputError, PlanError, SiteError
from polepilot.core.geometry import Pose2D
from polepilot.core.vehicle import Vehicle
from polepilot.server.convert import multipolygon_of, plan_of
from polepilot.server.errors import BusyError
from polepilot.server.planner import Planner
from polepilot.server.services import Services

API = "/api/v1"
JOB: dict[str, Any] = {
    "site": SQUARE,
    "mode": "route",
    "route": "Line",
    "options": {"start": [1.0, 1.0, 0.0]},
    "area": None,
}


@pytest.fixture
def square(client: TestClient) -> int:
    """The number of the square site, which the robot works on."""
    site_id: int = client.post(f"{API}/sites", json=SQUARE).json()["id"]
    client.put(f"{API}/robot/site", json={"site_id": site_id})
    return site_id


def test_a_scan(client: TestClient, services: Services, square: int) -> None:
    answer = client.post(f"{API}/plans", json={"site_id": square, "mode": "scan"})
    assert answer.status_code == 201, answer.text
    plan = answer.json()
    assert client.get(f"{API}/plans/{plan['id']}").json() == plan
    assert plan["predicted"]["coverage"] > 0.9
    assert len(plan["gear"]) == len(plan["path"]) - 1
    assert plan["tool_width"] == 0.4
    assert 20 < multipolygon_of(plan["area"]).area < 30
    # What is kept is what can be driven.
    kept = plan_of(services.store.plan(plan["id"]))
    assert kept.path.tolist() == plan["path"]
    assert kept.predicted.coverage == plan["predicted"]["coverage"]


def test_no_go_areas_are_kept_and_not_driven_on(client: TestClient) -> None:
    site = {**SQUARE, "no_go": [[[2.0, 2.0], [3.0, 2.0], [3.0, 3.0], [2.0, 3.0]]]}
    made = client.post(f"{API}/sites", json=site)
    assert made.status_code == 201, made.text
    record = made.json()
    assert client.get(f"{API}/sites/{record['id']}").json()["site"]["no_go"] == site["no_go"]
    plan = client.post(f"{API}/plans", json={"site_id": record["id"], "mode": "scan"}).json()
    assert LineString(plan["path"]).distance(box(2, 2, 3, 3)) >= plan["clearance"] - 1e-6
    assert 0 <= plan["predicted"]["overlap"] < 1


def test_a_route_ends_with_the_heading_asked_for(client: TestClient, square: int) -> None:
    wanted = {"site_id": square, "mode": "route", "route": "Line", "end_heading": math.pi / 2}
    answer = client.post(f"{API}/plans", json=wanted)
    assert answer.status_code == 201, answer.text
    path, gear = answer.json()["path"], answer.json()["gear"]
    (x0, y0), (x1, y1) = path[-2:]
    assert math.atan2((y1 - y0) * gear[-1], (x1 - x0) * gear[-1]) == pytest.approx(1.57, abs=0.06)
    refused = client.post(f"{API}/plans", json={**wanted, "end_heading": "up"})
    assert refused.status_code == 422


def test_a_plan_begins_where_the_robot_stands(
    client: TestClient, robot: FakeRobot, square: int
) -> None:
    robot.pose = Pose2D(3.0, 3.0, 1.0)
    client.post(f"{API}/robot/clear")
    body = {"site_id": square, "mode": "route", "route": "Line"}
    assert client.post(f"{API}/plans", json=body).json()["path"][0] == [3.0, 3.0]
    there = client.post(f"{API}/plans", json={**body, "start": [2.0, 2.0]}).json()
    assert there["path"][0] == [2.0, 2.0]
    # On another site than the robot's, only the drawing can say.
    other = client.post(f"{API}/sites", json=SQUARE).json()["id"]
    elsewhere = client.post(f"{API}/plans", json={**body, "site_id": other}).json()
    assert elsewhere["path"][0] == [1.0, 1.0]


def test_a_plan_for_another_site_begins_as_the_simulated_robot_will_stand_there(
    client: TestClient, square: int
) -> None:
    """A drawn start has no heading; the robot is put there looking along x."""
    # The first wall to scan along is on the left of this start: a free heading would begin west.
    other = client.post(f"{API}/sites", json={**SQUARE, "start": [1, 1.2]}).json()["id"]
    plan = client.post(f"{API}/plans", json={"site_id": other, "mode": "scan"}).json()
    (ax, ay), (bx, by) = plan["path"][:2]
    assert [ax, ay] == [1.0, 1.2]
    along = (bx - ax) * plan["gear"][0]
    assert along > 0
    assert abs(by - ay) < 0.5 * along


def test_a_plan_that_begins_the_other_way_round_is_refused(
    client: TestClient, robot: FakeRobot, square: int
) -> None:
    plan = client.post(f"{API}/plans", json={"site_id": square, "mode": "scan"}).json()
    robot.pose = Pose2D(1.0, 1.0, math.pi)
    client.post(f"{API}/robot/clear")
    refused = client.post(f"{API}/missions", json={"plan_id": plan["id"]})
    assert refused.status_code == 409, refused.text
    assert refused.json()["code"] == "elsewhere"
    assert "turned" in refused.json()["detail"]
    assert client.get(f"{API}/runs").json() == []
    again = client.post(f"{API}/plans", json={"site_id": square, "mode": "scan"}).json()
    assert client.post(f"{API}/missions", json={"plan_id": again["id"]}).status_code == 201


@pytest.mark.parametrize(
    ("changes", "status", "word"),
    [
        ({"site_id": 77}, 404, "site"),
        ({"mode": "route", "route": "Nowhere"}, 422, "Nowhere"),
        ({"mode": "route"}, 422, "route"),
        ({"mode": "walk"}, 422, "mode"),
        ({"start": [50.0, 50.0]}, 422, "start"),
        ({"start": [1.0]}, 422, "start"),
        ({"tool_width": 0}, 422, "tool_width"),
        ({"tool_width": 0.001}, 422, "tool_width"),
        ({"clearance": -0.1}, 422, "clearance"),
        ({"width": 1}, 422, "width"),
        ({"site_id": True}, 422, "site_id"),
        ({"site_id": "1"}, 422, "site_id"),
        ({"pending_of": 9}, 404, "run"),
    ],
)
def test_what_cannot_be_planned(
    client: TestClient, square: int, changes: dict[str, Any], status: int, word: str
) -> None:
    body = {"site_id": square, "mode": "scan", **changes}
    answer = client.post(f"{API}/plans", json=body)
    assert answer.status_code == status, answer.text
    assert answer.headers["content-type"] == "application/problem+json"
    assert word in answer.json()["detail"]


def test_what_a_run_left_is_planned(client: TestClient, robot: FakeRobot, square: int) -> None:
    plan = client.post(f"{API}/plans", json={"site_id": square, "mode": "scan"}).json()
    run = client.post(f"{API}/missions", json={"plan_id": plan["id"]}).json()
    pending = {"site_id": square, "mode": "scan", "pending_of": run["id"]}
    refused = client.post(f"{API}/plans", json=pending)
    assert (refused.status_code, refused.json()["code"]) == (409, "run_active")
    robot.missed = MultiPolygon([box(3, 2, 4, 3)])
    client.post(f"{API}/mission/end")
    end = time.monotonic() + 5
    while client.get(f"{API}/runs/{run['id']}").json()["outcome"] is None:
        assert time.monotonic() < end
    rest = client.post(f"{API}/plans", json=pending)
    assert rest.status_code == 201, rest.text
    document = rest.json()
    assert document["pending_of"] == run["id"]
    assert multipolygon_of(document["area"]).area == pytest.approx(1.0, rel=0.05)
    assert document["predicted"]["length"] < plan["predicted"]["length"] / 3
    wrong = client.post(f"{API}/plans", json={**pending, "site_id": 1})
    assert wrong.status_code == 422
    assert "pending_of" in wrong.json()["detail"]


def test_nothing_left(client: TestClient, square: int) -> None:
    plan = client.post(f"{API}/plans", json={"site_id": square, "mode": "scan"}).json()
    run = client.post(f"{API}/missions", json={"plan_id": plan["id"]}).json()
    client.post(f"{API}/mission/end")
    end = time.monotonic() + 5
    while client.get(f"{API}/runs/{run['id']}").json()["outcome"] is None:
        assert time.monotonic() < end
    body = {"site_id": square, "mode": "scan", "pending_of": run["id"]}
    answer = client.post(f"{API}/plans", json=body)
    assert (answer.status_code, answer.json()["code"]) == (422, "nothing_pending")


class TestProcess:
    """The process that plans, on its own."""

    def test_survives_what_it_is_told(self) -> None:
        async def ask() -> None:
            planner = Planner(Vehicle())
            try:
                with pytest.raises(SiteError, match="Nowhere"):
                    await planner.plan({**JOB, "route": "Nowhere"})
                with pytest.raises(PlanError, match="tool_width"):
                    await planner.plan({**JOB, "options": {"tool_width": 1e9}})
                with pytest.raises(InputError):
                    await planner.plan({**JOB, "site": {"boundary": []}})
                process = planner._process
                assert (await planner.plan(JOB))["nodes"]
                assert planner._process is process
            finally:
                await planner.close()

        asyncio.run(ask())

    def test_a_killed_process_is_replaced(self) -> None:
        async def ask() -> None:
            planner = Planner(Vehicle())
            try:
                await planner.warm_up()
                assert planner._process is not None
                first = planner._process.pid
                waiting = asyncio.create_task(planner.plan(JOB))
                await asyncio.sleep(0)
                os.kill(first, signal.SIGKILL)
                with pytest.raises(BusyError):
                    await waiting
                assert (await planner.plan(JOB))["path"]
                assert planner._process.pid != first
            finally:
                await planner.close()

        asyncio.run(ask())

    def test_a_plan_that_takes_too_long(self, monkeypatch: pytest.MonkeyPatch) -> None:
        monkeypatch.setattr("polepilot.server.planner.TIMEOUT", 0.05)

        async def ask() -> None:
            planner = Planner(Vehicle())
            try:
                with pytest.raises(BusyError, match="was not ready"):
                    await planner.plan(JOB)
                monkeypatch.setattr("polepilot.server.planner.TIMEOUT", 60)
                assert (await planner.plan(JOB))["path"]
            finally:
                await planner.close()

        asyncio.run(ask())


def test_a_plan_that_nobody_waits_for_is_given_up(serve: Callable[..., Running]) -> None:
    running = serve()
    began, given_up = threading.Event(), threading.Event()

    async def endless(_: Any) -> Any:
        began.set()
        try:
            await asyncio.sleep(60)
        except asyncio.CancelledError:
            given_up.set()
            raise

    running.services.planner.plan = endless  # type: ignore[method-assign]
    body = json.dumps({"site_id": 1, "mode": "scan"})
    # Whoever asks leaves once the plan has begun, however long that took on a busy machine.
    client = http.client.HTTPConnection(running.url.removeprefix("http://"), timeout=60)
    client.request("POST", f"{API}/plans", body, {"Content-Type": "application/json"})
    assert began.wait(30)
    client.close()
    assert given_up.wait(30)


def test_the_end_of_the_service_is_an_answer_to_who_waits_for_a_plan(
    serve: Callable[..., Running],
) -> None:
    running = serve()
    answers: list[httpx.Response] = []
    # So fine a tool keeps the planner busy for much longer than the service takes to end.
    body = {"site_id": 1, "mode": "scan", "tool_width": 0.05}

    def ask() -> None:
        answers.append(httpx.post(f"{running.url}{API}/plans", json=body, timeout=20))

    asker = threading.Thread(target=ask)
    asker.start()
    time.sleep(1.0)
    assert running.stop()
    asker.join(5)
    assert answers, "the connection was cut"
    assert answers[0].status_code == 503
    assert answers[0].json()["code"] == "shutting_down"
