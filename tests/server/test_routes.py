"""Every route: what it answers, and what it refuses."""

from __future__ import annotations

import io
import json
import time
from typing import Any

import cv2
import httpx
import numpy as np
import pytest
from mcap.reader import make_reader
from server.fakes import SQUARE, FakeRobot, TestClient, plan_document

from polepilot.core.geometry import Pose2D
from polepilot.server.schemas import About, Snapshot
from polepilot.server.services import Services

API = "/api/v1"


def problem(response: httpx.Response, status: int, code: str) -> dict[str, Any]:
    """The problem document, which every failure is answered with."""
    assert response.status_code == status, response.text
    assert response.headers["content-type"] == "application/problem+json"
    document: dict[str, Any] = response.json()
    assert document["code"] == code
    assert document["status"] == status
    assert document["detail"]
    return document


def until(condition: Any, seconds: float = 5.0) -> None:
    end = time.monotonic() + seconds
    while not condition():
        assert time.monotonic() < end, "waited in vain"
        time.sleep(0.01)


def add_square(client: TestClient, **changes: Any) -> dict[str, Any]:
    response = client.post(f"{API}/sites", json={**SQUARE, **changes})
    assert response.status_code == 201, response.text
    document: dict[str, Any] = response.json()
    return document


class TestAbout:
    def test_says_what_the_robot_is(self, client: TestClient) -> None:
        about = About.model_validate(client.get(f"{API}/about").json())
        assert about.simulated
        assert about.site_id == 1
        assert about.model.vehicle.min_turn_radius == pytest.approx(0.3)

    def test_metrics(self, client: TestClient) -> None:
        text = client.get("/metrics").text
        assert 'polepilot_state{state="ready"} 1.0' in text
        assert "polepilot_loop_ticks_total" in text


class TestSites:
    def test_the_first_start_has_the_demo_site(self, client: TestClient) -> None:
        (site,) = client.get(f"{API}/sites").json()
        assert (site["id"], site["name"], site["version"]) == (1, "Demo workshop", 1)

    def test_add_and_get(self, client: TestClient) -> None:
        record = add_square(client)
        got = client.get(f"{API}/sites/{record['id']}")
        assert got.headers["etag"] == '"v1"'
        assert got.json() == record
        assert record["site"]["boundary"] == SQUARE["boundary"]
        # What is answered can be sent back as it is.
        assert client.post(f"{API}/sites/check", json=record["site"]).json()["ok"]

    def test_a_changed_site_keeps_its_old_versions(self, client: TestClient) -> None:
        address = f"{API}/sites/{add_square(client)['id']}"
        changed = client.put(
            address, json={**SQUARE, "name": "Later"}, headers={"If-Match": '"v1"'}
        )
        assert changed.status_code == 200
        assert changed.headers["etag"] == '"v2"'
        assert [v["version"] for v in client.get(f"{address}/versions").json()] == [1, 2]
        assert client.get(f"{address}/versions/1").json()["name"] == "Square"
        assert client.get(address).json()["name"] == "Later"
        problem(client.get(f"{address}/versions/3"), 404, "no_version")

    def test_edits_of_an_old_version_are_refused(self, client: TestClient) -> None:
        address = f"{API}/sites/{add_square(client)['id']}"
        problem(client.put(address, json=SQUARE), 428, "if_match_required")
        problem(client.delete(address), 428, "if_match_required")
        for tag in ('"v7"', 'W/"v1"', "v1", '"x"'):
            problem(client.put(address, json=SQUARE, headers={"If-Match": tag}), 412, "conflict")
            problem(client.delete(address, headers={"If-Match": tag}), 412, "conflict")
        assert client.put(address, json=SQUARE, headers={"If-Match": "*"}).status_code == 200

    def test_delete(self, client: TestClient) -> None:
        address = f"{API}/sites/{add_square(client)['id']}"
        assert client.delete(address, headers={"If-Match": '"v1"'}).status_code == 204
        problem(client.get(address), 404, "no_site")
        assert len(client.get(f"{API}/sites").json()) == 1

    def test_the_site_that_the_robot_works_on_stays(self, client: TestClient) -> None:
        response = client.delete(f"{API}/sites/1", headers={"If-Match": '"v1"'})
        problem(response, 409, "site_in_use")

    def test_a_crossing_boundary_is_refused_with_its_place(self, client: TestClient) -> None:
        bow = {"boundary": [[0, 0], [4, 4], [4, 0], [0, 3]]}
        document = problem(client.post(f"{API}/sites", json=bow), 422, "bad_site")
        x, y = document["where"]
        assert 0 <= x <= 4
        assert 0 <= y <= 4
        check = client.post(f"{API}/sites/check", json=bow).json()
        assert not check["ok"]
        assert check["problems"][0]["where"] == document["where"]

    @pytest.mark.parametrize(
        ("body", "code"),
        [
            (b"", "bad_json"),
            (b"[]", "bad_json"),
            (b"{", "bad_json"),
            (b'{"boundary": \xff}', "bad_json"),
            (b"[" * 100_000, "bad_json"),
            (b'{"boundary": [[0, NaN]]}', "bad_input"),
            (b'{"boundary": [[0, 0], [1e999, 0], [1, 1]]}', "bad_site"),
            (b'{"boundary": "no"}', "bad_site"),
            (b'{"name": "\\ud800", "boundary": [[0, 0], [4, 0], [4, 3]]}', "bad_input"),
        ],
    )
    def test_what_is_no_site_is_refused(self, client: TestClient, body: bytes, code: str) -> None:
        document = problem(client.post(f"{API}/sites", content=body), 422, code)
        assert document["remedy"]
        assert "unicode" not in document["detail"]

    def test_geojson_comes_back_the_same(self, client: TestClient) -> None:
        record = add_square(client)
        geojson = client.get(f"{API}/sites/{record['id']}.geojson").json()
        assert geojson["type"] == "FeatureCollection"
        again = client.post(f"{API}/sites", json=geojson)
        assert again.json()["site"] == record["site"]

    def test_a_full_disk_is_said_and_harms_nothing(
        self, client: TestClient, services: Services
    ) -> None:
        record = add_square(client)
        database = services.store._db
        pages = database.execute("PRAGMA page_count").fetchone()[0]
        database.execute(f"PRAGMA max_page_count = {pages}")
        walls = [[[1 + 0.001 * n, 1], [2, 2 + 0.001 * n]] for n in range(2000)]
        large = {**SQUARE, "walls": walls}
        etag = {"If-Match": f'"v{record["version"]}"'}
        address = f"{API}/sites/{record['id']}"
        for _ in range(2):
            document = problem(client.put(address, json=large, headers=etag), 507, "disk_full")
            assert "room" in document["remedy"]
        assert client.get(address).json() == record
        database.execute("PRAGMA max_page_count = 1000000")
        assert client.put(address, json=large, headers=etag).status_code == 200

    def test_one_key_adds_one_site(self, client: TestClient) -> None:
        headers = {"Idempotency-Key": "abc"}
        first = client.post(f"{API}/sites", json=SQUARE, headers=headers).json()
        second = client.post(f"{API}/sites", json=SQUARE, headers=headers).json()
        assert first == second
        other = client.post(f"{API}/sites", json={**SQUARE, "name": "B"}, headers=headers)
        problem(other, 422, "idempotency_key_reused")

    @pytest.mark.parametrize("site_id", ["0", "-1", "x", "99999999999999999999", "1.5"])
    def test_numbers_that_are_none(self, client: TestClient, site_id: str) -> None:
        document = problem(client.get(f"{API}/sites/{site_id}"), 422, "bad_input")
        assert "site_id" in document["detail"]

    def test_too_large_a_body(self, client: TestClient) -> None:
        body = b'{"name": "' + b"x" * (6 * 1024 * 1024) + b'"}'
        problem(client.post(f"{API}/sites", content=body), 413, "too_large")

        def pieces() -> Any:
            for _ in range(6 * 16):
                yield b" " * 65536

        problem(client.post(f"{API}/sites", content=pieces()), 413, "too_large")


class TestRobot:
    def test_snapshot(self, client: TestClient) -> None:
        snapshot = Snapshot.model_validate(client.get(f"{API}/robot").json())
        assert snapshot.state == "ready"
        assert snapshot.pose is not None
        assert snapshot.pose.position_sigma == pytest.approx(0.02)
        assert snapshot.real is not None
        assert snapshot.proximity == (None, 1.2, None)
        assert snapshot.events[0].text == "Grüße vom Roboter"

    def test_stop_latches_until_cleared(self, client: TestClient) -> None:
        assert client.post(f"{API}/robot/stop").json()["state"] == "stopped"
        assert client.post(f"{API}/robot/stop").status_code == 200
        assert client.get(f"{API}/robot").json()["state"] == "stopped"
        assert client.post(f"{API}/robot/clear").json()["state"] == "ready"

    def test_choose_a_site(self, client: TestClient, services: Services, robot: FakeRobot) -> None:
        site_id = add_square(client)["id"]
        response = client.put(f"{API}/robot/site", json={"site_id": site_id})
        assert response.json()["site_id"] == site_id
        assert robot.calls[-1] == "load_site Square"
        assert client.get(f"{API}/about").json()["site_id"] == site_id
        assert services.store.setting("site") == str(site_id)
        problem(client.put(f"{API}/robot/site", json={"site_id": 99}), 404, "no_site")

    def test_a_changed_site_is_taken_over(self, client: TestClient, robot: FakeRobot) -> None:
        site = client.get(f"{API}/sites/1").json()["site"]
        before = len(robot.calls)
        site["name"] = "Only the name"
        client.put(f"{API}/sites/1", json=site, headers={"If-Match": '"v1"'})
        assert robot.calls[before:] == []
        site["landmarks"].pop()
        client.put(f"{API}/sites/1", json=site, headers={"If-Match": '"v2"'})
        assert robot.calls[before:] == ["load_site Only the name"]

    def test_unknown_fields_are_refused(self, client: TestClient) -> None:
        response = client.put(f"{API}/robot/site", json={"site_id": 1, "sight": 2})
        assert "sight" in problem(response, 422, "bad_input")["detail"]

    def test_camera(self, client: TestClient, robot: FakeRobot) -> None:
        problem(client.get(f"{API}/camera.jpg"), 404, "no_picture")
        robot.see(None)
        until(lambda: client.get(f"{API}/robot").status_code == 200)
        problem(client.get(f"{API}/camera.jpg"), 404, "no_picture")
        robot.see(np.full((300, 400, 3), 128, np.uint8))
        until(lambda: client.get(f"{API}/camera.jpg").status_code == 200)
        drawn = client.get(f"{API}/camera.jpg")
        plain = client.get(f"{API}/camera.jpg?plain=1")
        assert drawn.headers["content-type"] == "image/jpeg"
        pictures = [
            cv2.imdecode(np.frombuffer(answer.content, np.uint8), cv2.IMREAD_COLOR)
            for answer in (drawn, plain)
        ]
        assert pictures[0].shape == (300, 400, 3)
        assert np.ptp(pictures[1]) < 4
        assert np.ptp(pictures[0]) > 50


class TestSimulation:
    def test_obstacles(self, client: TestClient) -> None:
        disc = {"x": 2.0, "y": 1.0, "radius": 0.25}
        assert client.get(f"{API}/simulation").json() == {"obstacles": []}
        put = client.put(f"{API}/simulation", json={"obstacles": [disc]})
        assert put.json() == {"obstacles": [disc]}
        assert client.get(f"{API}/robot").json()["obstacles"] == [disc]
        bad = client.put(f"{API}/simulation", json={"obstacles": [{**disc, "radius": -1}]})
        assert "radius" in problem(bad, 422, "bad_input")["detail"]

    def test_place(self, client: TestClient) -> None:
        place = {"x": 3.0, "y": 2.0, "heading": 1.0}
        assert client.post(f"{API}/simulation/place", json=place).json()["real"] == place

    def test_hardware_is_not_simulated(self, tmp_path: Any) -> None:
        from server.conftest import BASE
        from server.fakes import fake_services

        from polepilot.server.app import create_app

        app = create_app(fake_services(tmp_path / "real", simulated=False))
        with TestClient(app, base_url=BASE) as client:
            problem(client.get(f"{API}/simulation"), 409, "not_simulated")
            place = client.post(f"{API}/simulation/place", json={"x": 0, "y": 0})
            problem(place, 409, "not_simulated")
            assert client.get(f"{API}/robot").json()["real"] is None


class TestMissions:
    def test_a_run_from_start_to_record(
        self, client: TestClient, robot: FakeRobot, route_plan: int
    ) -> None:
        response = client.post(f"{API}/missions", json={"plan_id": route_plan})
        assert response.status_code == 201, response.text
        run = response.json()
        assert run["outcome"] is None
        mission = client.get(f"{API}/robot").json()["mission"]
        assert (mission["run_id"], mission["plan_id"]) == (run["id"], route_plan)
        assert (mission["site_id"], mission["route"]) == (1, "Tour")
        assert client.post(f"{API}/mission/pause").json()["state"] == "paused"
        assert client.post(f"{API}/mission/resume").json()["state"] == "running"
        again = client.post(f"{API}/missions", json={"plan_id": route_plan})
        problem(again, 409, "mission_active")
        other = add_square(client)["id"]
        problem(client.put(f"{API}/robot/site", json={"site_id": other}), 409, "mission_active")
        until(lambda: robot.pose.x > 1.1)
        assert client.post(f"{API}/mission/end").json()["mission"] is None
        until(lambda: client.get(f"{API}/runs/{run['id']}").json()["outcome"] == "paused")
        record = client.get(f"{API}/runs/{run['id']}").json()
        assert record["travelled"] == 1.25
        assert record["plan"]["path"] == plan_document()["path"]
        assert record["missed"] == []
        assert [r["id"] for r in client.get(f"{API}/runs").json()] == [run["id"]]

        track = client.get(f"{API}/runs/{run['id']}/track").json()
        assert len(track["t"]) == len(track["real"]) == len(track["estimated"]) > 5
        assert track["estimated"][-1][0] > track["estimated"][0][0]
        assert [event["code"] for event in track["events"]] == ["mission_started"]
        log = client.get(f"{API}/runs/{run['id']}/log")
        topics = {
            channel.topic for _, channel, _ in make_reader(io.BytesIO(log.content)).iter_messages()
        }
        assert {"site", "plan", "snapshot", "event"} <= topics

    def test_without_a_mission_there_is_nothing_to_pause(self, client: TestClient) -> None:
        for word in ("pause", "resume", "end"):
            problem(client.post(f"{API}/mission/{word}"), 409, "no_mission")

    def test_one_key_starts_one_run(self, client: TestClient, route_plan: int) -> None:
        body, headers = {"plan_id": route_plan}, {"Idempotency-Key": "go"}
        first = client.post(f"{API}/missions", json=body, headers=headers)
        second = client.post(f"{API}/missions", json=body, headers=headers)
        assert first.status_code == second.status_code == 201
        assert first.json()["id"] == second.json()["id"]
        client.post(f"{API}/mission/end")
        until(lambda: client.get(f"{API}/runs").json()[0]["outcome"] is not None)
        third = client.post(f"{API}/missions", json=body, headers=headers)
        assert third.json()["id"] == first.json()["id"]
        assert client.get(f"{API}/robot").json()["mission"] is None

    def test_what_the_robot_refuses_leaves_no_run(
        self, client: TestClient, services: Services, route_plan: int
    ) -> None:
        body, headers = {"plan_id": route_plan}, {"Idempotency-Key": "later"}
        client.post(f"{API}/robot/stop")
        refused = client.post(f"{API}/missions", json=body, headers=headers)
        assert problem(refused, 409, "estop_latched")["remedy"] == "Release it."
        assert client.get(f"{API}/runs").json() == []
        assert not list((services.log_path(1).parent.parent).iterdir())
        client.post(f"{API}/robot/clear")
        assert client.post(f"{API}/missions", json=body, headers=headers).status_code == 201

    def test_a_plan_of_an_old_version(self, client: TestClient, route_plan: int) -> None:
        site = client.get(f"{API}/sites/1").json()["site"]
        client.put(f"{API}/sites/1", json=site, headers={"If-Match": '"v1"'})
        problem(client.post(f"{API}/missions", json={"plan_id": route_plan}), 409, "site_changed")

    def test_a_plan_of_another_site(self, client: TestClient, services: Services) -> None:
        site = services.store.site(add_square(client)["id"])
        plan = services.store.add_plan(site, "route", "Line", None, plan_document())
        problem(client.post(f"{API}/missions", json={"plan_id": plan.id}), 409, "site_not_loaded")

    def test_one_landmark_is_too_few_to_drive_by(
        self, client: TestClient, services: Services
    ) -> None:
        site_id = add_square(client, landmarks=[{"id": 1, "x": 0, "y": 1}])["id"]
        client.put(f"{API}/robot/site", json={"site_id": site_id})
        plan = services.store.add_plan(
            services.store.site(site_id), "route", "Line", None, plan_document()
        )
        problem(client.post(f"{API}/missions", json={"plan_id": plan.id}), 409, "no_landmarks")

    def test_one_landmark_is_named_before_the_site_is_loaded(
        self, client: TestClient, services: Services
    ) -> None:
        site = services.store.site(add_square(client, landmarks=[])["id"])
        plan = services.store.add_plan(site, "route", "Line", None, plan_document())
        problem(client.post(f"{API}/missions", json={"plan_id": plan.id}), 409, "no_landmarks")

    def test_an_edit_during_a_mission_waits_for_its_end(
        self, client: TestClient, robot: FakeRobot, route_plan: int
    ) -> None:
        client.post(f"{API}/missions", json={"plan_id": route_plan})
        site = client.get(f"{API}/sites/1").json()["site"]
        site["landmarks"].pop()
        response = client.put(f"{API}/sites/1", json=site, headers={"If-Match": '"v1"'})
        assert response.status_code == 200
        assert not robot.calls[-1].startswith("load_site")
        client.post(f"{API}/mission/end")
        until(lambda: robot.calls[-1].startswith("load_site"))

    def test_nothing_there(self, client: TestClient) -> None:
        problem(client.post(f"{API}/missions", json={"plan_id": 5}), 404, "no_plan")
        problem(client.get(f"{API}/plans/5"), 404, "no_plan")
        for rest in ("", "/track", "/log"):
            problem(client.get(f"{API}/runs/5{rest}"), 404, "no_run")
        problem(client.get(f"{API}/nothing"), 404, "not_found")
        problem(client.delete(f"{API}/about"), 405, "method_not_allowed")


class TestFaults:
    def test_our_own_mistake_is_a_problem_too(
        self, client: TestClient, services: Services, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        def broken() -> None:
            raise ZeroDivisionError

        monkeypatch.setattr(services.store, "sites", broken)
        response = client.get(f"{API}/sites")
        assert "ZeroDivision" not in problem(response, 500, "internal")["detail"]
        assert response.headers["x-content-type-options"] == "nosniff"

    def test_a_robot_that_does_not_answer(
        self, client: TestClient, robot: FakeRobot, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        monkeypatch.setattr("polepilot.server.runner.COMMAND_TIMEOUT", 0.2)
        robot.step_takes = 1.0
        time.sleep(0.1)
        response = client.post(f"{API}/mission/pause")
        problem(response, 503, "robot_not_answering")
        robot.step_takes = 0.0
        until(lambda: client.post(f"{API}/robot/stop").status_code == 200)
        # The command that nobody waited for any more was not carried out later.
        assert "pause" not in robot.calls


def test_place_is_json(client: TestClient, robot: FakeRobot) -> None:
    """A pose that is no number is shown as none, not as broken JSON."""
    robot.pose = Pose2D(float("nan"), 0.0, 0.0)
    until(lambda: client.get(f"{API}/robot").json()["pose"] is None)
    json.loads(client.get(f"{API}/robot").text, parse_constant=lambda name: pytest.fail(name))
