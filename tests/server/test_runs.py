"""A run's log: read for the screen, read when it was cut off, and finished afterwards."""

from __future__ import annotations

import json
import time
from pathlib import Path

import pytest
from mcap.exceptions import McapError
from mcap.reader import make_reader
from server.conftest import BASE
from server.fakes import FakeRobot, TestClient, fake_services, plan_document
from shapely import MultiPolygon, box

from polepilot.core.geometry import Pose2D
from polepilot.core.robot.log import finish_log, read_messages
from polepilot.core.robot.recorder import Recorder
from polepilot.core.site import Site
from polepilot.server.app import create_app
from polepilot.server.convert import coordinates_of, multipolygon_of, plan_of
from polepilot.server.runs import MOST_MOMENTS, missed_area, read_track, travelled
from polepilot.server.store import PlanRow

PLAN = plan_of(PlanRow(1, 1, 1, "scan", None, None, 0.0, plan_document("scan")))


def write_log(path: Path, moments: int, *, length: float = 1.0) -> None:
    """A drive of ``length`` metres straight along the plan, ten ticks a second."""
    recorder = Recorder(path, wall_start=1000.0, witness=lambda: Pose2D(0.5, 0.5, 0.1))
    robot = FakeRobot()
    robot.load_site(Site(boundary=((0, 0), (9, 0), (9, 9))))
    robot.start(PLAN, 1, recorder)
    for number in range(moments):
        robot.pose = Pose2D(1.0 + length * number / (moments - 1), 1.0, 0.0)
        robot.step(number / 10)
    recorder.close()


def test_a_track_shares_its_moments(tmp_path: Path) -> None:
    write_log(tmp_path / "run.mcap", 21)
    track = read_track(tmp_path / "run.mcap")
    assert track["t"] == pytest.approx([number / 10 for number in range(21)])
    assert track["real"] == [[0.5, 0.5, 0.1]] * 21
    assert track["estimated"][-1] == pytest.approx([2.0, 1.0, 0.0, 0.02])
    assert track["target"][3] == [2.0, 1.0]
    assert [moment[0] for moment in track["measured"]] == track["t"]
    assert track["events"][0]["code"] == "mission_started"
    assert travelled(tmp_path / "run.mcap") == pytest.approx((1.0, 2.0))


def test_a_long_track_is_thinned_but_ends_where_the_run_did(tmp_path: Path) -> None:
    count = 2 * MOST_MOMENTS + 3
    write_log(tmp_path / "run.mcap", count)
    track = read_track(tmp_path / "run.mcap")
    assert MOST_MOMENTS / 2 < len(track["t"]) <= MOST_MOMENTS
    assert track["t"][-1] == pytest.approx((count - 1) / 10)
    assert track["estimated"][-1][0] == pytest.approx(2.0)
    assert len(track["real"]) == len(track["t"])


def test_no_log_is_an_empty_track(tmp_path: Path) -> None:
    track = read_track(tmp_path / "run.mcap")
    assert track["t"] == track["events"] == []
    (tmp_path / "run.mcap").write_bytes(b"")
    assert read_track(tmp_path / "run.mcap")["t"] == []
    (tmp_path / "run.mcap").write_bytes(b"no such format at all, but long enough to look at")
    assert read_track(tmp_path / "run.mcap")["t"] == []
    assert not finish_log(tmp_path / "run.mcap")
    assert (tmp_path / "run.mcap").exists()


@pytest.mark.parametrize("share", [0.3, 0.6, 0.95])
def test_a_log_that_was_cut_off(tmp_path: Path, share: float) -> None:
    path = tmp_path / "run.mcap"
    write_log(path, 3000)
    whole = list(read_messages(path))
    path.write_bytes(path.read_bytes()[: int(share * path.stat().st_size)])
    rest = list(read_messages(path))
    assert rest == whole[: len(rest)]
    assert len(rest) > (share - 0.2) * len(whole)
    with pytest.raises(McapError), path.open("rb") as file:
        list(make_reader(file).iter_messages())
    assert finish_log(path)
    assert list(read_messages(path)) == rest
    with path.open("rb") as file:
        # The reader that seeks opens it again, and the stamps are still those of the run.
        messages = list(make_reader(file).iter_messages(topics=["snapshot"]))
    assert len(messages) == sum(channel == "snapshot" for channel, _, _ in rest)
    assert messages[10][2].log_time == pytest.approx(1001.0e9)
    assert [file.name for file in tmp_path.iterdir()] == ["run.mcap"]


def test_what_a_log_says_was_missed(tmp_path: Path) -> None:
    """Half of the strip was driven; the other half is missing, up to the tool's radius."""
    path = tmp_path / "run.mcap"
    write_log(path, 101, length=1.0)
    missed = missed_area(path, PLAN)
    assert 0.8 * 0.4 <= missed.area <= 1.0 * 0.4
    # A round tool leaves the corners at the start, and bulges at the end.
    assert missed.intersection(box(1.2, 0.8, 1.95, 1.2)).area < 0.01
    assert missed.intersection(box(2.25, 0.8, 3, 1.2)).area == pytest.approx(0.3, rel=0.03)


def test_areas_survive_json() -> None:
    holed = box(0, 0, 4, 4) - box(1, 1, 2, 2)
    area = MultiPolygon([holed, box(6, 0, 7, 1)])
    again = multipolygon_of(json.loads(json.dumps(coordinates_of(area))))
    assert again.equals(area)
    assert multipolygon_of([]).is_empty
    bow = multipolygon_of([[[[0, 0], [2, 2], [2, 0], [0, 2]]]])
    assert bow.is_valid
    assert bow.area == pytest.approx(2.0)


def test_a_run_that_the_power_cut_ended_is_mended(tmp_path: Path) -> None:
    data = tmp_path / "data"
    before = fake_services(data)
    site = before.store.add_site(
        {"name": "S", "boundary": [[0, 0], [9, 0], [9, 9]], "landmarks": []}
    )
    before.store.set_setting("site", str(site.id))
    plan = before.store.add_plan(site, "scan", None, None, plan_document("scan"))
    run, _ = before.store.add_run(plan.id)
    write_log(before.log_path(run.id), 500)
    path = before.log_path(run.id)
    path.write_bytes(path.read_bytes()[:-3000])
    before.store.close()
    before._folder.release()

    with TestClient(create_app(fake_services(data)), base_url=BASE) as client:
        end = time.monotonic() + 5
        while (record := client.get(f"/api/v1/runs/{run.id}").json())["coverage"] is None:
            assert record["outcome"] == "interrupted"
            assert time.monotonic() < end
            time.sleep(0.01)
        assert 0.4 < record["coverage"] < 0.75
        assert record["travelled"] > 0.5
        assert multipolygon_of(record["missed"]).area == pytest.approx(
            (1 - record["coverage"]) * 0.8, rel=0.02
        )
        assert len(client.get(f"/api/v1/runs/{run.id}/track").json()["t"]) > 100
