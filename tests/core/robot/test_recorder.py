from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
from mcap.exceptions import EndOfFile, McapError
from mcap.reader import make_reader
from mcap.stream_reader import StreamReader

from polepilot.core.geometry import Pose2D
from polepilot.core.observation import Frame, PoseEstimate, RangeBearing, Status
from polepilot.core.robot.recorder import Recorder
from polepilot.core.robot.snapshot import Event, Snapshot, State


def snapshot(seq: int) -> Snapshot:
    pose = Pose2D(seq * 0.01, 1.0, 0.5)
    estimate = PoseEstimate(seq * 0.02, pose, np.diag([1e-4, 1e-4, 1e-5]), Status.TRACKING)
    return Snapshot(seq=seq, stamp=seq * 0.02, state=State.RUNNING, reason="", estimate=estimate)


def read(path: Path) -> list[tuple[str, dict[str, Any]]]:
    with path.open("rb") as file:
        return [
            (channel.topic, json.loads(message.data))
            for _, channel, message in make_reader(file).iter_messages()
        ]


def test_every_position_is_in_the_log(tmp_path: Path) -> None:
    path = tmp_path / "run.mcap"
    recorder = Recorder(path, wall_start=1000.0, witness=lambda: Pose2D(1.0, 2.0, 3.0))
    for seq in range(500):
        recorder.snapshot(snapshot(seq))
    recorder.event(Event(1, 0.1, "started", "info", "Going."))
    recorder.sighting(
        0.2,
        [RangeBearing(0.2, 7, 3.0, 0.1, 0.01, 0.001)],
        Frame(0.2, np.zeros((30, 40, 3), np.uint8)),
    )
    recorder.close()
    messages = read(path)
    positions = [m["estimated"] for topic, m in messages if topic == "snapshot"]
    assert [round(p[0] / 0.01) for p in positions] == list(range(500))
    assert all(m["real"] == [1.0, 2.0, 3.0] for topic, m in messages if topic == "snapshot")
    topics = {topic for topic, _ in messages}
    assert topics == {"snapshot", "event", "sighting", "picture"}


def test_a_cut_log_gives_back_what_was_written(tmp_path: Path) -> None:
    path = tmp_path / "run.mcap"
    recorder = Recorder(path)
    for seq in range(3000):
        recorder.snapshot(snapshot(seq))
    recorder.close()
    whole = path.read_bytes()
    cut = tmp_path / "cut.mcap"
    cut.write_bytes(whole[: len(whole) // 2])
    count = 0
    with cut.open("rb") as file:
        records = StreamReader(file).records
        try:
            for record in records:
                count += type(record).__name__ == "Message"
        except (McapError, EndOfFile):
            pass
    assert count > 1000


def test_a_full_disk_is_reported_and_stops_nothing() -> None:
    recorder = Recorder(Path("/dev/full"))
    for seq in range(20000):
        recorder.snapshot(snapshot(seq))
    recorder.close()
    assert isinstance(recorder.error, OSError)
