"""The robot in its simulated world: driving, stopping, getting lost and found."""

from __future__ import annotations

import json
import math
from pathlib import Path

import pytest
from core.robot.rig import Rig, room
from mcap.reader import make_reader

from polepilot.core.errors import RefusedError
from polepilot.core.geometry import Pose2D
from polepilot.core.planning.coverage import plan_scan
from polepilot.core.planning.options import PlanOptions
from polepilot.core.planning.route import plan_route
from polepilot.core.robot.recorder import Recorder
from polepilot.core.robot.snapshot import State
from polepilot.core.sim.obstacle import Obstacle
from polepilot.core.site import Start
from polepilot.core.vehicle import RobotModel

VEHICLE = RobotModel().vehicle
OPTIONS = PlanOptions.from_vehicle(VEHICLE)


def on_the_way(tmp_path: Path, **changes: object) -> Rig:
    site = room(**changes)
    rig = Rig(site).ready()
    return rig.start(plan_route(site, "Across", OPTIONS), tmp_path / "run.mcap")


def stands_within(rig: Rig, seconds: float) -> bool:
    return rig.run(seconds, lambda _: rig.world.wheels_standing)


def test_tracks_a_route_to_its_last_node(tmp_path: Path) -> None:
    rig = on_the_way(tmp_path)
    assert rig.run(60, lambda s: s.mission is None)
    assert rig.ended[0].outcome == "done"
    assert rig.world.truth.distance_to((4.8, 2.0)) < 0.10
    assert rig.world.contacts == 0
    assert rig.snapshot.state is State.READY


def test_first_pose_within_one_sweep() -> None:
    rig = Rig(room())
    pan = rig.settings.model.pan
    sweep = (pan.maximum - pan.minimum) / pan.rate
    assert rig.run(sweep, lambda s: s.estimate is not None)


def test_stop_stands_within_three_tenths_and_keeps_the_mission(tmp_path: Path) -> None:
    rig = on_the_way(tmp_path)
    rig.run(2.0)
    rig.robot.stop("Somebody pressed STOP.")
    assert stands_within(rig, 0.3)
    where = rig.world.truth
    rig.run(3.0)
    assert rig.snapshot.state is State.STOPPED
    assert rig.snapshot.mission is not None
    assert rig.world.truth.distance_to(where.position) < 0.01
    rig.robot.clear()
    rig.run(1.0)
    assert rig.snapshot.state is State.PAUSED
    assert rig.world.wheels_standing
    rig.robot.resume()
    assert rig.run(60, lambda s: s.mission is None)
    assert rig.ended[0].outcome == "done"


def test_pause_and_resume(tmp_path: Path) -> None:
    rig = on_the_way(tmp_path)
    rig.robot.pause()
    assert stands_within(rig, 0.5)
    rig.run(2.0)
    assert rig.snapshot.state is State.PAUSED
    rig.robot.resume()
    assert rig.run(60, lambda s: s.mission is None)
    assert rig.ended[0].outcome == "done"


def test_a_pulled_cable_stops_the_wheels_and_nothing_restarts_by_itself(tmp_path: Path) -> None:
    rig = on_the_way(tmp_path)
    rig.run(1.0)
    rig.world.link.plugged = False
    assert stands_within(rig, 0.6)
    rig.run(2.0)
    assert rig.snapshot.link.state == "closed"
    rig.world.link.plugged = True
    rig.run(3.0)
    assert rig.world.wheels_standing
    assert rig.snapshot.link.state == "idle"
    assert rig.snapshot.state is State.PAUSED
    rig.robot.resume()
    assert rig.run(60, lambda s: s.mission is None)
    assert rig.ended[0].outcome == "done"


def test_without_a_camera_it_stops_and_says_so(tmp_path: Path) -> None:
    rig = on_the_way(tmp_path, routes=[{"name": "Across", "nodes": [[5, 2], [1, 1], [5, 3]]}])
    rig.world.sensor.plugged = False
    assert rig.run(30, lambda s: s.state is State.LOST)
    assert stands_within(rig, 0.5)
    assert "camera_fault" in rig.codes()
    rig.world.sensor.plugged = True
    assert rig.run(15, lambda s: s.state is State.RUNNING)


def test_the_red_button_on_the_robot_counts_as_stop(tmp_path: Path) -> None:
    rig = on_the_way(tmp_path)
    rig.world.stop_button = True
    assert stands_within(rig, 0.3)
    rig.run(0.5)
    assert rig.snapshot.state is State.STOPPED
    rig.world.stop_button = False
    rig.run(0.5)
    rig.robot.clear()
    rig.run(1.0)
    assert rig.snapshot.state is State.PAUSED


def test_lifted_elsewhere_it_notices_and_finds_itself(tmp_path: Path) -> None:
    rig = on_the_way(tmp_path)
    rig.run(1.0)
    rig.robot.pause()
    rig.run(1.0)
    rig.world.place(Pose2D(4.0, 1.0, 2.0))
    assert rig.run(20, lambda s: "refixed" in {event.code for event in s.events})
    estimate = rig.snapshot.estimate
    assert estimate is not None
    assert rig.world.truth.distance_to(estimate.pose.position) < 0.05


def test_a_person_in_the_way_is_passed_on_the_left(tmp_path: Path) -> None:
    site = room(
        boundary=[[0, 0], [9, 0], [9, 6], [0, 6]],
        landmarks=[
            {"id": number, "x": x, "y": y}
            for number, x, y in (
                (1, 0, 1), (2, 0, 5), (4, 4.5, 6), (7, 9, 5), (8, 9, 1), (11, 4.5, 0),
            )
        ],
        routes=[{"name": "Across", "nodes": [[7.5, 3.0]]}],
        start=[1.0, 3.0, 0.0],
    )  # fmt: skip
    rig = Rig(site).ready()
    person = Obstacle(4.0, 3.0, 0.22)
    rig.world.add_obstacle(person)
    rig.start(plan_route(site, "Across", OPTIONS), tmp_path / "run.mcap")
    beside: list[float] = []

    def watch(_: object) -> None:
        if abs(rig.world.truth.x - 4.0) < 0.1:
            beside.append(rig.world.truth.y)

    assert rig.run(120, lambda s: s.mission is None, watch)
    assert rig.ended[0].outcome == "done"
    assert rig.world.truth.distance_to((7.5, 3.0)) < 0.10
    assert rig.world.closest_obstacle >= 0.15
    assert min(beside) > 3.0, "it was passed on the right"


def test_what_a_scan_left_becomes_the_next_plan(tmp_path: Path) -> None:
    site = room()
    rig = Rig(site).ready()
    whole = plan_scan(site, OPTIONS)
    rig.start(whole, tmp_path / "first.mcap")
    half = rig.run(400, lambda s: s.mission is not None and (s.mission.coverage or 0) > 0.5)
    assert half
    rig.robot.end()
    first = rig.ended[0]
    assert first.outcome == "paused"
    assert first.coverage is not None
    assert first.missed.area == pytest.approx((1 - first.coverage) * whole.area.area, abs=0.15)

    rig.recorder.close()
    with (tmp_path / "first.mcap").open("rb") as file:
        positions = [
            json.loads(message.data)["estimated"]
            for _, channel, message in make_reader(file).iter_messages(topics=["snapshot"])
        ]
    assert len(positions) > 1000
    assert all(position is not None for position in positions)

    rig.run(1.0)
    estimate = rig.snapshot.estimate
    assert estimate is not None
    here = Start(*estimate.pose)
    rest = plan_scan(site, PlanOptions.from_vehicle(VEHICLE, start=here), area=first.missed)
    assert rest.predicted.length < 0.7 * whole.predicted.length
    rig.start(rest, tmp_path / "second.mcap", run_id=2)
    assert rig.run(600, lambda s: s.mission is None)
    second = rig.ended[1]
    assert second.outcome == "done"
    left = second.missed.area
    assert 1 - left / whole.area.area > 0.97
    assert rig.world.contacts == 0


def test_refuses_what_it_cannot_do(tmp_path: Path) -> None:
    site = room(landmarks=[{"id": 1, "x": 0, "y": 1}])
    rig = Rig(site)
    rig.run(1.0)
    recorder = Recorder(tmp_path / "run.mcap")
    plan = plan_route(site, "Across", OPTIONS)  # planning needs no landmarks
    with pytest.raises(RefusedError, match="landmark") as refusal:
        rig.robot.start(plan, 1, recorder)
    assert refusal.value.code == "no_landmarks"
    recorder.close()
    for command in (rig.robot.pause, rig.robot.resume, rig.robot.end):
        with pytest.raises(RefusedError):
            command()


def test_refuses_a_plan_that_starts_elsewhere(tmp_path: Path) -> None:
    site = room()
    rig = Rig(site, pose=Pose2D(4.0, 1.0, 0.0)).ready()
    recorder = Recorder(tmp_path / "run.mcap")
    with pytest.raises(RefusedError) as refusal:
        rig.robot.start(plan_route(site, "Across", OPTIONS), 1, recorder)
    recorder.close()
    assert refusal.value.code == "elsewhere"
    assert rig.snapshot.mission is None


def test_shutdown_stops_the_wheels_and_closes_the_log(tmp_path: Path) -> None:
    rig = on_the_way(tmp_path)
    rig.robot.shutdown(rig.now)
    rig.world.advance(rig.now + 0.3)
    assert rig.world.wheels_standing
    assert rig.ended[0].outcome == "paused"
    with (tmp_path / "run.mcap").open("rb") as file:
        topics = {channel.topic for _, channel, _ in make_reader(file).iter_messages()}
    assert {"site", "plan", "snapshot", "result"} <= topics


def test_rendered_pictures_drive_it_as_well(tmp_path: Path) -> None:
    site = room()
    rig = Rig(site, rendered=True).ready()
    rig.start(plan_route(site, "Across", OPTIONS), tmp_path / "run.mcap")
    errors: list[float] = []

    def watch(snapshot: object) -> None:
        estimate = rig.snapshot.estimate
        if estimate is not None:
            errors.append(math.dist(estimate.pose.position, rig.world.truth.position))

    assert rig.run(60, lambda s: s.mission is None, watch)
    assert rig.ended[0].outcome == "done"
    assert sum(errors) / len(errors) <= 0.04
    assert rig.world.truth.distance_to((4.8, 2.0)) < 0.10
