"""The replay command on pictures: drawn, written, detected, localized."""

from __future__ import annotations

import json
import math
import shutil
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest

from polepilot.commands.main import run
from polepilot.core.geometry import Pose2D
from polepilot.core.landmark import Landmark
from polepilot.core.sim.render import Renderer
from polepilot.core.trajectory import read_tum
from polepilot.core.vehicle import Camera

POSE = Pose2D(3.0, 2.5, 0.4)
MARKS = [Landmark(5, 6.0, 2.2), Landmark(9, 5.2, 4.8), Landmark(14, 3.0, 5.7)]


@pytest.fixture(scope="module")
def recording(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A standing robot whose camera turns from right to left; the tenth picture is broken."""
    folder = tmp_path_factory.mktemp("recording")
    camera = Camera()
    corners = [(0.0, 0.0), (7.0, 0.0), (7.0, 6.0), (0.0, 6.0)]
    walls = list(zip(corners, corners[1:] + corners[:1], strict=True))
    renderer = Renderer(camera, MARKS, walls, np.random.default_rng(7))
    lines: list[dict[str, Any]] = [{"t": 0.0, "kind": "drive", "speed": 0.0, "steering": 0.0}]
    rate = math.radians(45)
    for index in range(40):
        stamp = round(0.08 * index, 6)
        pan = -0.6 + rate * stamp
        name = f"{index:02}.png"
        image = renderer.render(POSE.compose(Pose2D(camera.forward, 0.0, pan)), rate)
        if index == 9:
            (folder / name).write_text("this is no picture")
        else:
            cv2.imwrite(str(folder / name), image)
        lines.append({"t": stamp, "kind": "pan", "angle": pan})
        lines.append({"t": stamp, "kind": "frame", "file": name})
    document = {
        "camera": {
            "constant_px": camera.constant,
            "width": camera.width,
            "height": camera.height,
            "cx": camera.center_x,
            "cy": camera.center_y,
            "forward_m": camera.forward,
            "height_m": camera.mount_height,
            "pan_min_rad": -math.radians(135),
            "pan_max_rad": math.radians(135),
        },
        "vehicle": {"wheelbase_m": 0.2, "track_m": 0.2},
        "landmark": {"bits": 4, "segment_m": 0.05, "diameter_m": 0.07},
        "landmarks": [{"id": m.id, "x": m.x, "y": m.y} for m in MARKS],
    }
    (folder / "dataset.json").write_text(json.dumps(document))
    (folder / "samples.jsonl").write_text("".join(json.dumps(line) + "\n" for line in lines))
    return folder


def test_pictures_become_a_pose(
    recording: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run(["replay", str(recording), "--out", str(tmp_path / "out"), "--json"]) == 0
    document = json.loads(capsys.readouterr().out)
    assert document["frames"] == 40
    assert document["poses"] > 10
    codes = [event["code"] for event in document["events"]]
    assert codes == ["frame_skipped", "fixed"]
    poses = read_tum(tmp_path / "out" / "estimated.tum").poses
    assert len(poses) == document["poses"]
    assert math.dist(poses[-1, :2], POSE.position) < 0.04
    assert abs(poses[-1, 2] - POSE.heading) < math.radians(0.7)


def test_smoothed_poses_are_written_too(
    recording: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run(["replay", str(recording), "--out", str(tmp_path), "--smooth", "--json"]) == 0
    document = json.loads(capsys.readouterr().out)
    poses = read_tum(tmp_path / "smoothed.tum").poses
    assert len(poses) == document["poses"]
    # A robot that stands, looked back upon, stands.
    assert np.ptp(poses[:, :2], axis=0).max() < 0.002
    assert math.dist(poses[0, :2], POSE.position) < 0.04


def test_a_table_is_printed_without_json(
    recording: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run(["replay", str(recording), "--out", str(tmp_path), "--method", "paper"]) == 0
    text = capsys.readouterr().out
    assert "poses from 40 pictures" in text
    assert "samples.jsonl:21: picture left out" in text


@pytest.mark.parametrize(
    ("arguments", "expected"),
    [
        (["--method", "magic"], "expected 'ekf' or 'paper'"),
    ],
)
def test_what_is_not_offered_is_refused(
    recording: Path,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
    arguments: list[str],
    expected: str,
) -> None:
    out = tmp_path / "out"
    assert run(["replay", str(recording), "--out", str(out), *arguments]) == 2
    captured = capsys.readouterr()
    assert expected in captured.err
    assert captured.out == ""
    assert not out.exists()


def test_a_recording_whose_pictures_are_all_unusable_is_refused(
    recording: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    folder = tmp_path / "run"
    shutil.copytree(recording, folder)
    document = json.loads((folder / "dataset.json").read_text())
    document["camera"]["width"] = 640
    (folder / "dataset.json").write_text(json.dumps(document))
    assert run(["replay", str(folder), "--out", str(tmp_path / "out"), "--json"]) == 2
    captured = capsys.readouterr()
    assert captured.out == ""
    assert captured.err.count("\n") == 1
    assert "samples.jsonl:3: " in captured.err
    assert "400 x 300 pixels: expected 640 x 300" in captured.err
    assert not (tmp_path / "out").exists()


def test_a_missing_recording_is_one_clear_line(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run(["replay", str(tmp_path / "gone"), "--out", str(tmp_path / "out")]) == 2
    error = capsys.readouterr().err
    assert error.count("\n") == 1
    assert "dataset.json" in error
