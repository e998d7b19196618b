"""Recordings read, replayed causally, and refused where they are bad."""

from __future__ import annotations

import json
import math
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from core.localization.generator import FORWARD, WHEELBASE, Recording, record

from polepilot.core.errors import DatasetError, ImageError
from polepilot.core.landmark import Landmark
from polepilot.core.observation import Detection, Odometry, PanReading, RangeBearing
from polepilot.core.robot.dataset import FrameFile, Sighted, read_dataset
from polepilot.core.robot.replay import PanTrack, ReplayResult, replay, smooth, write_results
from polepilot.core.trajectory import (
    Trajectory,
    heading_errors,
    position_errors,
    read_tum,
    write_tum,
)
from polepilot.core.vision.paint import ORANGE, Paint

DOCUMENT: dict[str, Any] = {
    "camera": {
        "constant_px": 600.0,
        "width": 400,
        "height": 300,
        "cx": 199.5,
        "cy": 149.5,
        "forward_m": FORWARD,
        "height_m": 0.4,
        "pan_min_rad": -math.radians(135),
        "pan_max_rad": math.radians(135),
    },
    "vehicle": {"wheelbase_m": WHEELBASE, "track_m": 0.2},
    "landmark": {"bits": 4, "segment_m": 0.05, "diameter_m": 0.07},
    "landmarks": [{"id": 3, "x": 4.0, "y": 0.0}, {"id": 5, "x": 4.0, "y": 3.0}],
}
GOOD = [
    {"t": 0.0, "kind": "drive", "speed": 0.0, "steering": 0.0},
    {"t": 0.1, "kind": "pan", "angle": 0.0},
    {"t": 0.1, "kind": "frame", "file": "a.png"},
]


def write(folder: Path, document: Any = DOCUMENT, lines: Any = GOOD) -> Path:
    folder.mkdir(exist_ok=True)
    (folder / "dataset.json").write_text(json.dumps(document))
    (folder / "samples.jsonl").write_text("".join(json.dumps(line) + "\n" for line in lines))
    (folder / "a.png").write_bytes(b"no picture")
    return folder


class Recorded:
    """A generated recording on disk; pictures are names, looked up instead of read."""

    def __init__(self, folder: Path, recording: Recording) -> None:
        marks = [{"id": m.id, "x": m.x, "y": m.y} for m in recording.landmarks.values()]
        lines: list[dict[str, Any]] = []
        self._seen: dict[float, list[Detection]] = {}
        (folder / "frames").mkdir(parents=True)
        for event in recording.events:
            if isinstance(event, Odometry):
                values = {"speed": event.speed, "steering": event.steering}
                lines.append({"t": event.stamp, "kind": "drive", **values})
                continue
            stamp, measurements = event
            name = f"frames/{stamp:.2f}.png"
            (folder / name).touch()
            pan = recording.pans[stamp]
            lines.append({"t": stamp, "kind": "pan", "angle": pan})
            lines.append({"t": stamp, "kind": "frame", "file": name})
            self._seen[stamp] = [
                Detection(
                    m.landmark, m.range, m.bearing - pan, 0, 0, 0, m.range_sigma, m.bearing_sigma
                )
                for m in measurements
            ]
        write(folder, {**DOCUMENT, "landmarks": marks}, lines)
        write_tum(folder / "truth.tum", recording.truth.keys(), recording.truth.values())

    def see(self, frame: FrameFile) -> list[Detection]:
        return self._seen[frame.stamp]


def test_a_recording_gives_four_files_and_a_good_pose(tmp_path: Path) -> None:
    recorded = Recorded(tmp_path / "run", record(31, 40.0, standing=0.0))
    dataset = read_dataset(tmp_path / "run")
    counts: list[int] = []
    result = replay(dataset, recorded.see, progress=counts.append)
    out = tmp_path / "out"
    write_results(result, out)
    assert sorted(path.name for path in out.iterdir()) == [
        "deadreckoned.tum",
        "estimated.cov",
        "estimated.tum",
        "measured.tum",
    ]
    estimated, reckoned = read_tum(out / "estimated.tum"), read_tum(out / "deadreckoned.tum")
    assert dataset.truth is not None
    assert position_errors(dataset.truth, estimated).mean < 0.02
    assert position_errors(dataset.truth, reckoned).mean > 0.2
    assert position_errors(dataset.truth, read_tum(out / "measured.tum")).mean < 0.05
    assert counts == list(range(1, dataset.frames + 1))
    document = result.to_json()
    assert document["frames"] == dataset.frames
    assert document["poses"] == len(estimated.stamps) > 0.95 * dataset.frames
    assert document["first_pose_t"] == estimated.stamps[0]
    assert document["events"][0]["code"] == "fixed"
    covariance = np.loadtxt(out / "estimated.cov")
    assert covariance.shape == (len(estimated.stamps), 7)
    assert covariance[:, 0] == pytest.approx(estimated.stamps)
    assert (covariance[:, [1, 4, 6]] > 0).all()


def test_the_replay_is_causal(tmp_path: Path) -> None:
    recorded = Recorded(tmp_path / "run", record(32, 20.0))
    dataset = read_dataset(tmp_path / "run")
    whole = replay(dataset, recorded.see)
    lines = (tmp_path / "run" / "samples.jsonl").read_text().splitlines()
    cut = [line for line in lines if json.loads(line)["t"] <= 12.0]
    (tmp_path / "run" / "samples.jsonl").write_text("\n".join(cut))
    part = replay(read_dataset(tmp_path / "run"), recorded.see)
    assert len(part.estimates) > 50
    for a, b in zip(whole.estimates, part.estimates, strict=False):
        assert a.stamp == b.stamp
        assert a.pose == b.pose


def test_what_was_measured_is_carried_along_for_as_long_as_it_takes(tmp_path: Path) -> None:
    """Nothing is seen any more: 1.2 m are driven, and then it stands."""
    marks = {n: Landmark(n, *at) for n, at in enumerate([(4.0, 0.0), (4.0, 3.0), (0.0, 3.0)], 1)}
    samples: list[Any] = []
    for tick in range(600):
        now = 0.1 * tick
        samples += [Odometry(now, 0.3 if 5.0 <= now < 9.0 else 0.0, 0.0), PanReading(now, 0.0)]
        seen = [
            RangeBearing(now, n, math.dist(m.position, (FORWARD, 0.0)), bearing, 0.01, 0.001)
            for n, m in marks.items()
            for bearing in [math.atan2(m.y, m.x - FORWARD)]
        ]
        samples.append(Sighted(now, tuple(seen) if now < 5.0 else (), 0.0))
    dataset = read_dataset(write(tmp_path / "run"))
    result = replay(replace(dataset, landmarks=marks, samples=tuple(samples)), lambda _: [])
    assert result.measured[-1][1].distance_to((1.2, 0.0)) < 0.05
    assert result.measured[-1][1].distance_to(result.estimates[-1].pose.position) < 0.05


def test_looking_back_is_better_than_looking_ahead(tmp_path: Path) -> None:
    recorded = Recorded(tmp_path / "run", record(31, 40.0, standing=0.0))
    dataset = read_dataset(tmp_path / "run")
    result = replay(dataset, recorded.see)
    write_results(result, tmp_path / "out", smooth(dataset, result))
    estimated = read_tum(tmp_path / "out" / "estimated.tum")
    smoothed = read_tum(tmp_path / "out" / "smoothed.tum")
    assert smoothed.stamps == pytest.approx(estimated.stamps)
    assert dataset.truth is not None
    ahead, back = (position_errors(dataset.truth, track) for track in (estimated, smoothed))
    assert back.mean < 0.8 * ahead.mean
    assert back.max < ahead.max
    turned = [heading_errors(dataset.truth, track).mean for track in (smoothed, estimated)]
    assert turned[0] < turned[1]


def test_what_is_smoothed_does_not_jump_clocks(tmp_path: Path) -> None:
    recorded = Recorded(tmp_path / "run", record(33, 35.0))
    path = tmp_path / "run" / "samples.jsonl"
    lines = [json.loads(line) for line in path.read_text().splitlines()]
    path.write_text("\n".join(json.dumps(n) for n in lines if not 9.0 < n["t"] < 14.0))
    dataset = read_dataset(tmp_path / "run")
    result = replay(dataset, recorded.see)
    assert len(result.found) == 2
    smoothed = smooth(dataset, result)
    assert [stamp for stamp, _ in smoothed] == [e.stamp for e in result.estimates]
    track = Trajectory(np.array([t for t, _ in smoothed]), np.array([p for _, p in smoothed]))
    assert dataset.truth is not None
    assert position_errors(dataset.truth, track).mean < 0.02


def test_nothing_seen_is_nothing_smoothed(tmp_path: Path) -> None:
    dataset = read_dataset(write(tmp_path / "run"))
    assert smooth(dataset, replay(dataset, lambda _: [])) == []


def test_an_unreadable_picture_is_left_out_and_said(tmp_path: Path) -> None:
    dataset = read_dataset(write(tmp_path / "run"))

    def see(frame: FrameFile) -> list[Detection]:
        raise ImageError(f"{frame.path.name}: not a picture.")

    result = replay(dataset, see)
    assert [event.code for event in result.events] == ["frame_skipped"]
    assert "samples.jsonl:3" in result.events[0].text
    assert result.to_json()["first_pose_t"] is None


def test_a_picture_that_is_told_twice_is_one_witness(tmp_path: Path) -> None:
    later = [{**line, "t": 0.2} for line in GOOD[1:]]
    once = read_dataset(write(tmp_path / "once", lines=[*GOOD, *later]))
    twice = read_dataset(
        write(tmp_path / "twice", lines=[*GOOD, GOOD[2], GOOD[2], *later, GOOD[2] | later[1]])
    )
    assert once.notes == ()
    assert twice.notes == (
        "samples.jsonl:4: a picture of the same moment as the one before; 3 of this kind left out.",
    )
    assert [s.stamp for s in twice.samples] == [s.stamp for s in once.samples]


def test_a_clock_that_jumps_gives_up_the_pose(tmp_path: Path) -> None:
    recorded = Recorded(tmp_path / "run", record(33, 35.0))
    path = tmp_path / "run" / "samples.jsonl"
    lines = [json.loads(line) for line in path.read_text().splitlines()]
    path.write_text("\n".join(json.dumps(n) for n in lines if not 9.0 < n["t"] < 14.0))
    result = replay(read_dataset(tmp_path / "run"), recorded.see)
    codes = [event.code for event in result.events]
    assert "clock_jump" in codes
    assert "refixed" in codes
    jump = next(event.stamp for event in result.events if event.code == "clock_jump")
    first = next(e.stamp for e in result.estimates if e.stamp >= jump)
    refixed = next(event.stamp for event in result.events if event.code == "refixed")
    assert first == refixed


def test_results_are_written_whole_or_not_at_all(tmp_path: Path) -> None:
    blocked = tmp_path / "out"
    blocked.write_text("a file where a folder should be")
    with pytest.raises(DatasetError, match="cannot be written"):
        write_results(ReplayResult(), blocked)
    assert blocked.read_text() == "a file where a folder should be"


def test_the_pan_angle_is_carried_on_but_never_back() -> None:
    track = PanTrack(-2.356, 2.356)
    assert track.at(0.0) is None
    for index in range(10):
        track.add(PanReading(0.02 * index, 0.785 * 0.02 * index))
    angle, sigma = track.at(0.19) or (0.0, 0.0)
    assert angle == pytest.approx(0.785 * 0.19, abs=1e-6)
    assert sigma < math.radians(0.1)
    assert track.at(1.0) is None


def test_near_its_end_the_pan_may_have_turned() -> None:
    track = PanTrack(-2.356, 2.356)
    for index in range(6):
        track.add(PanReading(0.02 * index, 2.35 - 0.785 * 0.02 * (5 - index)))
    angle, sigma = track.at(0.115) or (0.0, 0.0)
    assert angle <= 2.356
    assert sigma > math.radians(0.5)


LANDMARK: dict[str, Any] = DOCUMENT["landmark"]


def changed(**changes: Any) -> dict[str, Any]:
    return {**DOCUMENT, **changes}


@pytest.mark.parametrize(
    ("document", "lines", "expected"),
    [
        ([], GOOD, "expected an object"),
        (changed(vehicle={"track_m": 0.2}), GOOD, "vehicle: the field 'wheelbase_m' is missing"),
        (changed(vehicle={"wheelbase_m": -1, "track_m": 0.2}), GOOD, "wheelbase_m is -1"),
        (changed(vehicle={"wheelbase_m": 1e-300, "track_m": 0.2}), GOOD, "wheelbase_m is 1e-300"),
        (changed(camera=DOCUMENT["camera"] | {"forward_m": 1e9}), GOOD, "forward_m is 1000000000"),
        (changed(landmarks=[{"id": 16, "x": 0, "y": 0}]), GOOD, r"landmarks\[0\].*does not fit"),
        (changed(landmarks=DOCUMENT["landmarks"] * 2), GOOD, "id 3 occurs twice"),
        (changed(landmark={"bits": 7, "segment_m": 1, "diameter_m": 1}), GOOD, "landmark: bits"),
        (changed(landmark=LANDMARK | {"bright": "beige"}), GOOD, "landmark: bright is 'beige'"),
        (changed(landmark=LANDMARK | {"bright": 3}), GOOD, "landmark: bright is 3: expected a te"),
        (DOCUMENT, [GOOD[1], GOOD[0], GOOD[2]], r"samples.jsonl:2.*expected rising"),
        (DOCUMENT, [{"t": math.nan, "kind": "pan", "angle": 0}], r":1: sample: t is nan"),
        (DOCUMENT, [{"t": 0, "kind": "pan", "angle": math.inf}], r":1: sample: angle is inf"),
        (DOCUMENT, [{"t": 0, "kind": "gyro"}], r":1: kind is 'gyro'"),
        (DOCUMENT, [{"t": 0, "kind": "frame", "file": "b.png"}], r":1: there is no picture"),
        (DOCUMENT, [{"t": 0, "kind": "drive", "speed": 0}], "'steering' is missing"),
        (DOCUMENT, GOOD[:2], "at least one sample of kind 'frame'"),
        (DOCUMENT, GOOD[1:], "at least one sample of kind 'drive'"),
        (DOCUMENT, [GOOD[0], GOOD[2]], "at least one sample of kind 'pan'"),
        (DOCUMENT, ["word"], "expected an object"),
        (changed(vehicle={"wheelbase_m": 10**400, "track_m": 1}), GOOD, "finite number"),
        (changed(landmark={"bits": 10**400}), GOOD, "whole number"),
        (DOCUMENT, [{"t": 10**400, "kind": "pan", "angle": 0}], ":1: sample: t is 1000"),
        (DOCUMENT, [{"t": 0, "kind": "frame", "file": "x" * 300}], ":1: there is no picture"),
    ],
)
def test_bad_recordings_are_named(tmp_path: Path, document: Any, lines: Any, expected: str) -> None:
    with pytest.raises(DatasetError, match=expected):
        read_dataset(write(tmp_path / "run", document, lines))


@pytest.mark.parametrize("text", ["[" * 100_000, "9" * 5000, '{"t": ' + "9" * 5000 + "}"])
def test_endless_json_is_refused(tmp_path: Path, text: str) -> None:
    folder = write(tmp_path / "run")
    (folder / "samples.jsonl").write_text(json.dumps(GOOD[0]) + "\n" + text)
    with pytest.raises(DatasetError, match=r"samples\.jsonl:2: no JSON that can be read"):
        read_dataset(folder)
    (folder / "dataset.json").write_text(text)
    with pytest.raises(DatasetError, match=r"dataset\.json: no JSON that can be read"):
        read_dataset(folder)


def test_landmarks_of_another_colour(tmp_path: Path) -> None:
    folder = write(tmp_path / "run", changed(landmark=LANDMARK | {"bright": "green"}))
    assert read_dataset(folder).paint == Paint.parse("green")
    assert read_dataset(write(tmp_path / "run")).paint == ORANGE


def test_lines_end_where_the_file_says(tmp_path: Path) -> None:
    folder = write(tmp_path / "run")
    note = json.dumps({**GOOD[1], "note": "a\u2028b"}, ensure_ascii=False)
    lines = [json.dumps(GOOD[0]), note, json.dumps(GOOD[2])]
    (folder / "samples.jsonl").write_bytes("\r\n".join(["\ufeff" + lines[0], *lines[1:]]).encode())
    assert len(read_dataset(folder).samples) == 3


def test_missing_and_broken_files_are_named(tmp_path: Path) -> None:
    with pytest.raises(DatasetError, match="expected a folder"):
        read_dataset(tmp_path / "nothing")
    with pytest.raises(DatasetError, match=r"dataset\.json: no such file"):
        read_dataset(tmp_path)
    folder = write(tmp_path / "run")
    (folder / "dataset.json").write_text("{\n  oops")
    with pytest.raises(DatasetError, match=r"dataset\.json:2: no valid JSON"):
        read_dataset(folder)
    write(folder)
    (folder / "samples.jsonl").write_text('{"t": 0, "kind": "pan", "angle": 0}\n{"t": 1,\n')
    with pytest.raises(DatasetError, match=r"samples\.jsonl:2: no valid JSON"):
        read_dataset(folder)
