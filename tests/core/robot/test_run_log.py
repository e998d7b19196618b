"""Runs replayed from their own logs: whole, cut off, and damaged."""

from __future__ import annotations

import json
import math
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from core.robot.rig import Rig, room
from hypothesis import given, settings
from hypothesis import strategies as st
from mcap.writer import Writer

from polepilot.commands.main import run
from polepilot.core.errors import DatasetError
from polepilot.core.geometry import wrap_angle
from polepilot.core.observation import Odometry, RangeBearing
from polepilot.core.planning.options import PlanOptions
from polepilot.core.planning.route import plan_route
from polepilot.core.robot.dataset import Sighted
from polepilot.core.robot.inputs import KEPT, Inputs
from polepilot.core.robot.log import LogReader, finish_log, read_messages
from polepilot.core.robot.recorder import Recorder
from polepilot.core.robot.replay import replay
from polepilot.core.robot.run_log import find_log, read_run_log
from polepilot.core.robot.snapshot import State
from polepilot.core.trajectory import heading_errors, position_errors, read_tum

Captured = pytest.CaptureFixture[str]


def nothing(_: object) -> list[Any]:
    raise AssertionError("a log holds no pictures to read")


@pytest.fixture(scope="module")
def published(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, dict[float, list[float]]]:
    """The log of a simulated run, and what the robot published while it drove: x, y, heading."""
    folder = tmp_path_factory.mktemp("run")
    site = room()
    rig = Rig(site, seed=5).ready()
    poses: dict[float, list[float]] = {}
    rig.start(plan_route(site, "Across", PlanOptions()), folder / "run.mcap")

    def keep(snapshot: Any) -> None:
        if snapshot.estimate is not None and snapshot.state is State.RUNNING:
            poses[snapshot.stamp] = list(snapshot.estimate.pose)

    assert rig.run(60, lambda _: bool(rig.ended), keep)
    rig.recorder.close()
    return folder / "run.mcap", poses


def test_a_replayed_run_is_the_run(published: tuple[Path, dict[float, list[float]]]) -> None:
    path, poses = published
    recording = read_run_log(path)
    assert recording.notes == ()
    assert sorted(recording.landmarks) == [1, 2, 4, 7, 8, 11]
    result = replay(recording, nothing)
    assert result.frames == sum(isinstance(s, Sighted) for s in recording.samples) > 100
    # The pose is found where the run found it: before the log was opened.
    assert result.estimates[0].stamp < min(poses)
    stamps = np.array(list(poses))
    table = np.array(list(poses.values()))
    table[:, 2] = np.unwrap(table[:, 2])
    gaps, turns = [], []
    for one in result.estimates:
        if stamps[0] < one.stamp < stamps[-1]:
            then = [float(np.interp(one.stamp, stamps, column)) for column in table.T]
            gaps.append(math.dist(then[:2], one.pose.position))
            turns.append(abs(wrap_angle(then[2] - one.pose.heading)))
    assert len(gaps) > 80
    # They differ by what a picture tells that the run had taken but not read yet.
    assert np.mean(gaps) < 0.003
    assert np.percentile(gaps, 90) < 0.005
    assert np.mean(turns) < math.radians(0.15)


def test_the_truth_of_a_simulated_run_comes_along(
    published: tuple[Path, dict[float, list[float]]],
) -> None:
    recording = read_run_log(published[0])
    assert recording.truth is not None
    assert np.ptp(recording.truth.poses[:, 0]) > 2.0


def test_replay_writes_what_it_writes_for_datasets(
    published: tuple[Path, dict[float, list[float]]], tmp_path: Path, capsys: Captured
) -> None:
    folder = published[0].parent
    words = ["replay", str(folder), "--out", str(tmp_path / "out"), "--smooth", "--json"]
    assert run(words) == 0
    captured = capsys.readouterr()
    document = json.loads(captured.out)
    assert captured.err == ""
    assert document["notes"] == []
    assert document["events"][0]["code"] == "fixed"
    estimated = read_tum(tmp_path / "out" / "estimated.tum")
    assert len(estimated.stamps) == document["poses"] > 0.8 * document["frames"]
    assert sorted(path.name for path in (tmp_path / "out").iterdir()) == [
        "deadreckoned.tum",
        "estimated.cov",
        "estimated.tum",
        "measured.tum",
        "smoothed.tum",
    ]
    truth = read_run_log(published[0]).truth
    assert truth is not None
    smoothed = read_tum(tmp_path / "out" / "smoothed.tum")
    assert position_errors(truth, estimated).mean < 0.02
    assert position_errors(truth, smoothed).mean < position_errors(truth, estimated).mean
    assert heading_errors(truth, smoothed).mean < math.radians(0.5)


def test_the_papers_method_on_the_same_log(
    published: tuple[Path, dict[float, list[float]]], tmp_path: Path, capsys: Captured
) -> None:
    words = ["replay", str(published[0]), "--out", str(tmp_path), "--method", "paper"]
    assert run(words) == 0
    assert "poses from" in capsys.readouterr().out
    estimated = read_tum(tmp_path / "estimated.tum")
    truth = read_run_log(published[0]).truth
    assert truth is not None
    ours = replay(read_run_log(published[0]), nothing)
    assert len(ours.estimates) > 80
    table = np.array([e.pose for e in ours.estimates])
    same = np.array([e.stamp for e in ours.estimates])
    theirs = estimated.at(same)
    assert np.abs(theirs.poses[:, :2] - table[np.isin(same, theirs.stamps), :2]).max() > 0.01


@pytest.mark.parametrize("share", [0.4, 0.6, 0.8])
def test_a_log_that_was_cut_off_comes_back_as_far_as_it_goes(
    published: tuple[Path, dict[float, list[float]]],
    tmp_path: Path,
    capsys: Captured,
    share: float,
) -> None:
    whole = published[0].read_bytes()
    cut = tmp_path / "cut.mcap"
    cut.write_bytes(whole[: int(share * len(whole))])
    assert run(["replay", str(cut), "--out", str(tmp_path / "out"), "--json"]) == 0
    captured = capsys.readouterr()
    (note,) = json.loads(captured.out)["notes"]
    assert captured.err == note + "\n"
    assert "cut.mcap: cut off or damaged after" in note
    part, all_of_it = (replay(read_run_log(p), nothing) for p in (cut, published[0]))
    count = len(part.estimates)
    assert (share - 0.25) * len(all_of_it.estimates) < count < len(all_of_it.estimates)
    for one, other in zip(part.estimates, all_of_it.estimates, strict=False):
        assert (one.stamp, one.pose) == (other.stamp, other.pose)


_WRITER = """
import sys, time
from pathlib import Path
from polepilot.core.observation import Odometry
from polepilot.core.robot.recorder import Recorder
recorder = Recorder(Path(sys.argv[1]))
for number in range(10**9):
    recorder.odometry(Odometry(0.02 * number, 0.1, 0.0), 0.5)
    if number == 20000:
        print("written", flush=True)
    if number > 20000:
        time.sleep(0.001)
"""


def test_a_killed_writer_leaves_a_log_that_can_be_read(tmp_path: Path) -> None:
    path = tmp_path / "run.mcap"
    writer = subprocess.Popen(
        [sys.executable, "-c", _WRITER, str(path)], stdout=subprocess.PIPE, text=True
    )
    assert writer.stdout is not None
    assert writer.stdout.readline() == "written\n"
    patience = time.monotonic() + 60
    while path.stat().st_size < 100_000:  # the thread that writes has a queue before it
        assert time.monotonic() < patience
        time.sleep(0.02)
    writer.send_signal(signal.SIGKILL)
    writer.wait()
    writer.stdout.close()
    reader = LogReader(path)
    stamps = [json.loads(data)["t"] for _, _, data in reader]
    assert len(stamps) > 1000
    assert stamps == pytest.approx([0.02 * n for n in range(len(stamps))], abs=1e-5)
    assert "cut off" in reader.cut
    assert finish_log(path)
    again = LogReader(path)
    assert sum(1 for _ in again) == len(stamps)
    assert again.cut == ""


def message(path: Path, *messages: tuple[str, Any]) -> Path:
    """A log with these messages."""
    with path.open("wb") as file:
        writer = Writer(file)
        writer.start()
        channels: dict[str, int] = {}
        for channel, document in messages:
            if channel not in channels:
                channels[channel] = writer.register_channel(channel, "json", 0)
            data = document if isinstance(document, bytes) else json.dumps(document).encode()
            writer.add_message(channels[channel], 0, data, 0)
        writer.finish()
    return path


ROBOT = {
    "vehicle": {"wheelbase": 0.2, "track": 0.2},
    "camera": {"constant": 600.0, "width": 400, "height": 300, "forward": 0.1},
    "pan": {"minimum": -2.356, "maximum": 2.356},
    "localizer": {"method": "paper", "tolerance": 0.3},
}
SITE = {
    "boundary": [[0, 0], [6, 0], [6, 4]],
    "landmarks": [{"id": 1, "x": 1, "y": 1}, {"id": 2, "x": 5, "y": 1}],
}
GO = ("odometry", {"t": 1.0, "speed": 0.0, "steering": 0.0, "pan": 0.1})
SEEN = {
    "landmark": 1,
    "range": 2.0,
    "bearing": 0.1,
    "range_sigma": 0.01,
    "bearing_sigma": 0.001,
    "pan": 0.1,
}


def sighting(stamp: float, **changes: Any) -> tuple[str, Any]:
    return "sighting", {"t": stamp, "measurements": [SEEN | changes]}


def test_what_the_robot_was_is_in_the_log(tmp_path: Path) -> None:
    path = message(
        tmp_path / "a.mcap", ("robot", ROBOT), ("site", SITE), GO, sighting(1.1, range=None)
    )
    recording = read_run_log(path)
    assert recording.settings.method == "paper"
    assert recording.settings.tolerance == 0.3
    assert recording.camera.width == 400
    assert recording.truth is None
    (seen,) = [s for s in recording.samples if isinstance(s, Sighted)]
    assert seen.measurements[0].range == seen.measurements[0].range_sigma == math.inf


@pytest.mark.parametrize(
    ("messages", "expected"),
    [
        ([GO], "holds no 'robot' message"),
        ([("robot", ROBOT), GO, sighting(1.1)], "holds no 'site' message"),
        ([("robot", ROBOT), ("site", SITE), GO], "holds no sightings"),
        ([("robot", b"\xff")], "message 1: is no text"),
        ([("robot", ROBOT), ("site", b'{"boundary":')], r"message 2: no valid JSON"),
        ([("robot", [])], "message 1: robot: expected an object"),
        ([("robot", ROBOT | {"pan": {}}), ("site", SITE), GO, sighting(1.1)], "'minimum'"),
        (
            [("robot", ROBOT), ("site", {**SITE, "landmarks": SITE["landmarks"] * 2})],
            r"landmarks\[2\].id is 1, as in landmarks\[0\]",
        ),
        ([("robot", ROBOT), ("site", SITE), GO, sighting(math.nan)], "message 4.*t is nan"),
        ([("robot", ROBOT), ("site", SITE), GO, sighting(1.1, range=-1)], "range is -1"),
        ([("robot", ROBOT), ("site", SITE), GO, sighting(1.1, bearing=math.inf)], "bearing is inf"),
        ([("robot", ROBOT), ("site", SITE), GO, ("sighting", {"t": 2})], "'measurements'"),
        (
            [("robot", ROBOT), ("site", SITE), GO, ("odometry", GO[1] | {"t": -5.0})],
            r"message 4.*the clock has jumped back",
        ),
        ([("odometry", GO[1] | {"steering": 2.0})], "message 1: odometry: steering is 2.0"),
        ([], "it has no messages"),
    ],
)
def test_bad_logs_are_named(tmp_path: Path, messages: Any, expected: str) -> None:
    with pytest.raises(DatasetError, match=expected):
        read_run_log(message(tmp_path / "bad.mcap", *messages))


@pytest.mark.parametrize("data", [b"", b"\x89MCAP", b"something else altogether"])
def test_files_that_are_no_logs(tmp_path: Path, capsys: Captured, data: bytes) -> None:
    path = tmp_path / "run.mcap"
    path.write_bytes(data)
    assert run(["replay", str(path), "--out", str(tmp_path / "out")]) == 2
    captured = capsys.readouterr()
    assert captured.out == ""
    assert captured.err.count("\n") == 1
    assert "expected the log of a run (MCAP)" in captured.err
    assert not (tmp_path / "out").exists()


def test_what_cannot_be_found(tmp_path: Path) -> None:
    assert find_log(tmp_path) is None
    assert find_log(tmp_path / "gone.mcap") is None
    with pytest.raises(DatasetError, match="cannot be read"):
        read_run_log(tmp_path / "gone.mcap")
    assert list(read_messages(tmp_path / "gone.mcap")) == []


@settings(deadline=None, max_examples=80)
@given(data=st.data())
def test_damage_is_an_error_or_a_shorter_log(
    published: tuple[Path, dict[float, list[float]]],
    tmp_path_factory: pytest.TempPathFactory,
    data: st.DataObject,
) -> None:
    """Bytes overwritten anywhere: what is read is what was written, up to the damage."""
    whole = bytearray(published[0].read_bytes())
    place = data.draw(st.integers(0, len(whole) - 1))
    junk = data.draw(st.binary(min_size=1, max_size=12))
    whole[place : place + len(junk)] = junk
    path = tmp_path_factory.mktemp("damaged") / "run.mcap"
    path.write_bytes(bytes(whole[: data.draw(st.integers(place, len(whole)))]))
    intact = [(channel, content) for channel, _, content in read_messages(published[0])]
    reader = LogReader(path)
    found = [(channel, content) for channel, _, content in reader]
    assert found == intact[: len(found)]
    assert reader.cut or len(found) == len(intact)
    shutil.rmtree(path.parent)


def test_a_log_begins_with_what_came_before_it(tmp_path: Path) -> None:
    inputs = Inputs()
    seen = [RangeBearing(0.0, 1, 2.0, 0.1, 0.01, 0.001)]
    for number in range(3000):
        inputs.add_odometry(Odometry(0.02 * number, 0.0, 0.0), None)
    inputs.add_sighting(59.9, seen, None)
    recorder = Recorder(tmp_path / "run.mcap")
    inputs.record(recorder)
    inputs.add_odometry(Odometry(60.0, 0.1, 0.0), 0.2)
    inputs.end()
    inputs.add_odometry(Odometry(60.1, 0.1, 0.0), 0.2)
    recorder.close()
    written = [(c, json.loads(d)) for c, _, d in read_messages(tmp_path / "run.mcap")]
    assert written[0][1]["t"] == pytest.approx(59.98 - KEPT, abs=0.1)
    assert [c for c, _ in written[-2:]] == ["sighting", "odometry"]
    assert written[-1][1] == {"t": 60.0, "speed": 0.1, "steering": 0.0, "pan": 0.2}
    inputs.clear()
    again = Recorder(tmp_path / "again.mcap")
    inputs.record(again)
    again.close()
    assert list(read_messages(tmp_path / "again.mcap")) == []
