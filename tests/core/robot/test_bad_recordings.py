"""Recordings that are wrong somewhere: refused with file and line, or replayed without a lie.

A lie is a pose that is called tracking and is farther from the truth than its own sigmas allow.
"""

from __future__ import annotations

import copy
import json
import math
import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from core.localization.generator import FORWARD, record
from core.robot.test_replay import Recorded
from hypothesis import HealthCheck, example, given, settings
from hypothesis import strategies as st

from polepilot.commands.main import run
from polepilot.core.errors import DatasetError, ImageError
from polepilot.core.geometry import Point, Pose2D, wrap_angle
from polepilot.core.observation import Detection, PoseEstimate, Status
from polepilot.core.robot.dataset import FrameFile, read_dataset
from polepilot.core.robot.replay import ReplayResult, replay, smooth

Lines = list[dict[str, Any]]
See = Callable[[FrameFile], list[Detection]]

SIGMAS = 5.0
"""A pose may be off by so many of its sigmas, along its worst direction."""
SLACK = 0.02
"""Metres besides: what a healthy recording is off by."""


class Bench:
    """One healthy recording, and copies of it to be spoilt."""

    def __init__(self, folder: Path) -> None:
        self.recording = record(77, 26.0, standing=4.0)
        self.recorded = Recorded(folder / "good", self.recording)
        self.folder = folder / "good"
        self.lines: Lines = [
            json.loads(line) for line in (self.folder / "samples.jsonl").read_text().splitlines()
        ]
        self.document = json.loads((self.folder / "dataset.json").read_text())
        self.bad = folder / "bad"
        shutil.copytree(self.folder, self.bad)
        # Pictures are found by their names, whatever has become of their times.
        self.truth = {f"{stamp:.2f}.png": pose for stamp, pose in self.recording.truth.items()}
        self.seen = {
            f"{stamp:.2f}.png": self.recorded.see(FrameFile(stamp, Path(), 0))
            for stamp in self.recording.truth
        }

    def spoil(self, text: str, document: Any = None) -> Path:
        (self.bad / "samples.jsonl").write_text(text)
        (self.bad / "dataset.json").write_text(json.dumps(document or self.document))
        return self.bad

    def see(self, frame: FrameFile) -> list[Detection]:
        return self.seen[frame.path.name]

    def check(self, folder: Path, see: See | None = None) -> ReplayResult | str:
        """The replay, found honest; or the refusal, found to name the file."""
        try:
            dataset = read_dataset(folder)
        except DatasetError as error:
            refusal = str(error)
        else:
            refusal = ""
        if refusal:
            assert str(folder / "samples.jsonl") in refusal or "dataset.json" in refusal
            return refusal
        result = replay(dataset, see or self.see)
        names = {
            frame.stamp: frame.path.name
            for frame in dataset.samples
            if isinstance(frame, FrameFile)
        }
        lies = [one for one in result.estimates if self.lie(one, self.truth[names[one.stamp]])]
        assert not lies, [(one.stamp, one.pose, one.position_sigma) for one in lies[:3]]
        return result

    @staticmethod
    def lie(estimate: PoseEstimate, truth: Pose2D) -> bool:
        off = math.dist(estimate.pose.position, truth.position)
        turned = abs(wrap_angle(estimate.pose.heading - truth.heading))
        return estimate.status is Status.TRACKING and (
            off > SIGMAS * estimate.position_sigma + SLACK
            or turned > SIGMAS * estimate.heading_sigma + SLACK
        )


@pytest.fixture(scope="module")
def bench(tmp_path_factory: pytest.TempPathFactory) -> Bench:
    return Bench(tmp_path_factory.mktemp("bad"))


def text_of(lines: Lines) -> str:
    return "".join(json.dumps(line) + "\n" for line in lines)


def test_the_healthy_recording_is_replayed(bench: Bench) -> None:
    result = bench.check(bench.spoil(text_of(bench.lines)))
    assert isinstance(result, ReplayResult)
    assert len(result.estimates) > 0.9 * result.frames


WRONG = (math.nan, math.inf, -math.inf, None, True, "1", [], {}, 1e300, 10**400, -(10**30))


@settings(deadline=None, max_examples=60, suppress_health_check=[HealthCheck.too_slow])
@given(st.data())
def test_a_wrong_value_is_refused_with_its_line(bench: Bench, data: st.DataObject) -> None:
    lines = copy.deepcopy(bench.lines)
    index = data.draw(st.integers(0, len(lines) - 1))
    key = data.draw(st.sampled_from(sorted(lines[index])))
    how = data.draw(st.sampled_from([*WRONG, "gone"]))
    if how == "gone":
        del lines[index][key]
    else:
        lines[index][key] = how
    refusal = bench.check(bench.spoil(text_of(lines)))
    assert isinstance(refusal, str)
    # A time that is too large for its place shows in the line after it.
    assert any(f"samples.jsonl:{index + n}:" in refusal for n in (1, 2))


@settings(deadline=None, max_examples=40)
@given(st.data())
def test_a_line_that_is_cut_is_refused_with_its_number(bench: Bench, data: st.DataObject) -> None:
    text = text_of(bench.lines)
    index = data.draw(st.integers(0, len(bench.lines) - 1))
    start = len(text_of(bench.lines[:index]))
    length = len(json.dumps(bench.lines[index]))
    place = start + data.draw(st.integers(1, length - 1))
    refusal = bench.check(bench.spoil(text[:place] + data.draw(st.sampled_from(["", "\n", "\0"]))))
    assert isinstance(refusal, str)
    assert f"samples.jsonl:{index + 1}: no valid JSON" in refusal


@settings(deadline=None, max_examples=25)
@given(st.data())
def test_lines_out_of_order_are_refused(bench: Bench, data: st.DataObject) -> None:
    lines = copy.deepcopy(bench.lines)
    first, second = sorted(
        data.draw(st.lists(st.integers(0, len(lines) - 1), min_size=2, max_size=2, unique=True))
    )
    lines[first], lines[second] = lines[second], lines[first]
    outcome = bench.check(bench.spoil(text_of(lines)))
    if lines[first]["t"] != lines[second]["t"]:
        assert isinstance(outcome, str)
        assert "expected rising times" in outcome


@settings(deadline=None, max_examples=25, suppress_health_check=[HealthCheck.too_slow])
@given(
    place=st.floats(0.05, 0.95),
    jump=st.sampled_from([-1000.0, -3.0, -0.1, 0.6, 3.0, 60.0, 1e6, 1e11]),
)
@example(place=0.5, jump=0.6)
def test_a_clock_that_jumps(bench: Bench, place: float, jump: float) -> None:
    """Back: refused, with the line. Forward: the pose is given up and found anew."""
    lines = copy.deepcopy(bench.lines)
    begin = int(place * len(lines))
    while lines[begin]["t"] == lines[begin - 1]["t"]:
        begin += 1
    for line in lines[begin:]:
        line["t"] += jump
    outcome = bench.check(bench.spoil(text_of(lines)))
    if jump < 0:
        assert isinstance(outcome, str)
        assert f"samples.jsonl:{begin + 1}: t = " in outcome
        return
    assert isinstance(outcome, ReplayResult)
    assert "clock_jump" in [event.code for event in outcome.events]
    smoothed = smooth(read_dataset(bench.bad), outcome)
    assert len(smoothed) == len(outcome.estimates)


@settings(deadline=None, max_examples=25, suppress_health_check=[HealthCheck.too_slow])
@given(place=st.floats(0.1, 0.9), seconds=st.floats(0.6, 8.0))
def test_a_stretch_that_is_missing(bench: Bench, place: float, seconds: float) -> None:
    """The robot drove on while nothing was recorded."""
    begin = place * bench.lines[-1]["t"]
    kept = [line for line in bench.lines if not begin <= line["t"] < begin + seconds]
    outcome = bench.check(bench.spoil(text_of(kept)))
    assert isinstance(outcome, ReplayResult)
    if begin + seconds < bench.lines[-1]["t"]:
        assert "clock_jump" in [event.code for event in outcome.events]


@settings(deadline=None, max_examples=15, suppress_health_check=[HealthCheck.too_slow])
@given(share=st.floats(0.05, 0.9), seed=st.integers(0, 99))
def test_pictures_that_cannot_be_read_are_left_out(bench: Bench, share: float, seed: int) -> None:
    rng = np.random.default_rng(seed)
    broken = {name for name in bench.seen if rng.random() < share}

    def see(frame: FrameFile) -> list[Detection]:
        if frame.path.name in broken:
            raise ImageError(f"{frame.path}: is no picture.")
        return bench.see(frame)

    outcome = bench.check(bench.folder, see)
    assert isinstance(outcome, ReplayResult)
    skipped = [event for event in outcome.events if event.code == "frame_skipped"]
    assert len(skipped) == len(broken)
    assert all("samples.jsonl:" in event.text for event in skipped)


@settings(deadline=None, max_examples=15, suppress_health_check=[HealthCheck.too_slow])
@given(share=st.floats(0.0, 0.4), seed=st.integers(0, 99))
def test_numbers_that_are_not_on_the_map(bench: Bench, share: float, seed: int) -> None:
    """What is read as an unknown landmark is left out, and said; the rest counts."""
    rng = np.random.default_rng(seed)

    def see(frame: FrameFile) -> list[Detection]:
        return [
            Detection(15 if rng.random() < share else d.id, *list(_rest(d)))
            for d in bench.see(frame)
        ]

    outcome = bench.check(bench.folder, see)
    assert isinstance(outcome, ReplayResult)
    if share > 0.1:
        assert "landmark_unknown" in [event.code for event in outcome.events]


def _rest(d: Detection) -> tuple[float, ...]:
    return (d.range, d.bearing, d.column, d.top, d.bottom, d.range_sigma, d.bearing_sigma)


@pytest.mark.parametrize("ghost", [(4.0, 3.0), (1.0, 5.0), (7.5, 1.5)])
def test_two_poles_that_bear_one_number(bench: Bench, ghost: Point) -> None:
    """Another pole with the number of one on the map, somewhere else."""
    number = 4

    def see(frame: FrameFile) -> list[Detection]:
        pose = bench.truth[frame.path.name]
        camera = pose.ahead(FORWARD)
        pan = bench.recording.pans[frame.stamp]
        away = math.dist(camera, ghost)
        inside = wrap_angle(
            math.atan2(ghost[1] - camera[1], ghost[0] - camera[0]) - pose.heading - pan
        )
        seen = list(bench.see(frame))
        if abs(inside) < math.radians(18) and away > 1.65:
            seen.append(Detection(number, away, inside, 0, 0, 0, 0.004 * away, 0.001))
        return seen

    assert isinstance(bench.check(bench.folder, see), ReplayResult)


def test_two_entries_of_one_landmark(bench: Bench) -> None:
    document = copy.deepcopy(bench.document)
    document["landmarks"][2]["id"] = document["landmarks"][0]["id"]
    refusal = bench.check(bench.spoil(text_of(bench.lines), document))
    assert "landmarks[2]: landmark id 1 occurs twice" in str(refusal)
    document = copy.deepcopy(bench.document)
    document["landmarks"][2] |= {key: document["landmarks"][1][key] for key in "xy"}
    refusal = bench.check(bench.spoil(text_of(bench.lines), document))
    assert "2 and 3 stand in the same place" in str(refusal)


@pytest.mark.parametrize(
    ("name", "content", "expected"),
    [
        ("samples.jsonl", None, "samples.jsonl: no such file"),
        ("dataset.json", None, "dataset.json"),
        ("samples.jsonl", b"", "samples.jsonl: expected at least one sample"),
        ("dataset.json", b"", "dataset.json:1: no valid JSON"),
        ("samples.jsonl", b"\xff\xfe\x00", "samples.jsonl: cannot be read as text"),
        ("truth.tum", b"0 0 0\n", "truth.tum:1: expected eight"),
        ("truth.tum", b"0 0 0 0 0 0 0 nan\n", "truth.tum:1: expected eight"),
        ("frames/4.00.png", None, "there is no picture"),
    ],
)
def test_files_that_are_missing_or_empty(
    bench: Bench,
    capsys: pytest.CaptureFixture[str],
    tmp_path: Path,
    name: str,
    content: bytes | None,
    expected: str,
) -> None:
    folder = tmp_path / "spoilt"
    shutil.copytree(bench.folder, folder)
    (folder / name).unlink()
    if content is not None:
        (folder / name).write_bytes(content)
    assert run(["replay", str(folder), "--out", str(tmp_path / "out"), "--json"]) == 2
    captured = capsys.readouterr()
    assert captured.out == ""
    assert captured.err.count("\n") == 1
    assert expected in captured.err
    assert not (tmp_path / "out").exists()


@settings(deadline=None, max_examples=60)
@given(st.data())
def test_any_bytes_are_one_line_of_error_or_a_replay(bench: Bench, data: st.DataObject) -> None:
    """Random damage to either file never ends in a traceback."""
    folder = bench.spoil(text_of(bench.lines[:60]))
    path = folder / data.draw(st.sampled_from(["dataset.json", "samples.jsonl"]))
    content = bytearray(path.read_bytes())
    place = data.draw(st.integers(0, len(content) - 1))
    junk = data.draw(st.binary(max_size=8) | st.sampled_from([b"-", b"9", b"e9", b'"', b"}", b"["]))
    content[place : place + data.draw(st.integers(0, 8))] = junk
    path.write_bytes(bytes(content))
    try:
        dataset = read_dataset(folder)
    except DatasetError as error:
        refusal = str(error)
    else:
        refusal = ""
    if refusal:
        assert str(folder) in refusal
        assert "\n" not in refusal.strip()
        return
    replay(dataset, lambda frame: bench.seen.get(frame.path.name, []))
