"""``replay`` on recordings of a program apart from the simulator, and that program itself.

Short ones: the whole judgement is ``python -m recordings.final`` and the soak test.
"""

from __future__ import annotations

import json
import math
from pathlib import Path

import numpy as np
import pytest
from recordings.final import LIMITS
from recordings.motion import COUNTS, drive
from recordings.painter import Painter, code
from recordings.recording import read_told, recording, write
from recordings.scenario import (
    HALF_SWEEP,
    KINDS,
    LIFTED_BY,
    MOVED_BY,
    POTENTIOMETER_BEND,
    Kind,
    bent,
    draw,
)
from recordings.sights import sights
from recordings.verdict import Verdict, figures, judge

from polepilot.core.landmark import LandmarkKind, encode
from polepilot.core.robot.dataset import read_dataset
from polepilot.core.vehicle import Camera
from polepilot.core.vision.detector import LandmarkDetector

EVERY = dict.fromkeys(range(1, 16), LandmarkKind())


@pytest.fixture(scope="module")
def keep(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("recordings")


@pytest.mark.parametrize("number", range(1, 16))
def test_the_painter_knows_the_code(number: int) -> None:
    assert "".join(map(str, reversed(code(number)))) == encode(number)


@pytest.mark.parametrize("kind", KINDS)
def test_the_robot_drives_within_the_place_and_as_its_faults_say(kind: Kind) -> None:
    scenario = draw(kind, 2)
    course = drive(scenario)
    for value, size in zip((course.x, course.y), scenario.size, strict=True):
        assert value.min() > 0.1
        assert value.max() < size - 0.1
    length = np.hypot(np.diff(course.x), np.diff(course.y)).sum()
    assert 8.0 < length < 40.0
    t, speeds, steerings = np.array(course.commands).T
    told = speeds[np.clip(np.searchsorted(t, course.t, "right") - 1, 0, None)] * 0.005
    scale = (length - (LIFTED_BY if kind == "lifted" else 0.0)) / np.abs(told).sum()
    if scenario.kind != "push":
        slipping = 0.97 if kind == "slip" else 1.0
        assert scale == pytest.approx(scenario.robot.speed_scale * slipping, abs=0.02)
    assert np.abs(steerings).max() < math.radians(35)
    assert course.first_motion >= scenario.stands
    assert np.abs(course.pan).max() <= HALF_SWEEP
    turns = np.abs(np.diff(course.pan)) / 0.005
    assert math.radians(28) < np.median(turns) < math.radians(62)


@pytest.mark.parametrize("seed", range(4))
def test_the_potentiometer_is_as_crooked_as_it_should_be(seed: int) -> None:
    scenario = draw("room", seed)
    angles = np.linspace(-HALF_SWEEP, HALF_SWEEP, 1001)
    off = bent(angles, scenario.robot.bend)
    assert np.abs(off).max() == pytest.approx(POTENTIOMETER_BEND * 2 * HALF_SWEEP, rel=0.01)
    assert np.abs(np.polyfit(angles, off, 1)).max() < 1e-4
    course = drive(scenario)
    t, said = np.array(course.readings).T
    true = np.interp(t, course.t, course.pan)
    step = 2 * HALF_SWEEP / COUNTS
    assert np.allclose(said / step, np.rint(said / step), atol=0.51)
    # At its ends the converter can say no more.
    inside = np.abs(true) < HALF_SWEEP - math.radians(1.5)
    left = (said - true - bent(true, scenario.robot.bend))[inside]
    assert np.abs(left).max() < 2.5 * step


def test_a_recording_is_a_dataset_and_says_what_it_hides(keep: Path) -> None:
    folder = recording("moved", 0, keep, pictures=False)
    dataset, told = read_dataset(folder), read_told(folder)
    assert dataset.truth is not None
    assert dataset.truth.stamps[-1] - dataset.truth.stamps[0] == pytest.approx(90.0)
    assert 1070 <= dataset.frames <= 1080
    assert len(told.sights) == dataset.frames
    scenario = draw("moved", 0)
    off = {
        pole.id: math.dist(dataset.landmarks[pole.id].position, (pole.x, pole.y))
        for pole in scenario.poles
    }
    assert told.moved is not None
    assert off.pop(told.moved[0]) == pytest.approx(MOVED_BY, abs=0.03)
    assert max(off.values()) < 0.025
    # Made once: the second time it is there already, and the same.
    before = (folder / "samples.jsonl").stat().st_mtime_ns
    assert recording("moved", 0, keep, pictures=False) == folder
    assert (folder / "samples.jsonl").stat().st_mtime_ns == before


def test_the_same_seed_gives_the_same_recording(tmp_path: Path) -> None:
    for name in ("a", "b"):
        (tmp_path / name).mkdir()
        write(draw("push", 3), tmp_path / name, pictures=True, limit=3)
    names = ("dataset.json", "samples.jsonl", "truth.tum", "told.json", "frames/00002.png")
    for name in names:
        assert (tmp_path / "a" / name).read_bytes() == (tmp_path / "b" / name).read_bytes(), name
    rows = [json.loads(line) for line in (tmp_path / "a/samples.jsonl").read_text().splitlines()]
    assert [row["t"] for row in rows] == sorted(row["t"] for row in rows)


@pytest.mark.parametrize("kind", ["room", "corridor", "yard", "hidden"])
def test_pictures_show_what_the_truth_says(kind: Kind) -> None:
    scenario = draw(kind, 0)
    course = drive(scenario)
    shown = sights(scenario, course)
    painter = Painter(scenario, course)
    detector = LandmarkDetector(Camera(), EVERY)
    near = [
        index
        for index, row in enumerate(shown)
        if any(sight.whole and sight.range < 6.0 and sight.smear < 4.0 for sight in row)
    ]
    ranges, bearings, due = [], [], 0
    for index in near[:: max(len(near) // 25, 1)]:
        found = {one.id: one for one in detector.detect(painter.paint(index))}
        for sight in shown[index]:
            if sight.hidden:
                assert sight.id not in found
            if sight.whole and sight.range < 6.0 and sight.smear < 4.0:
                due += 1
                if sight.id in found:
                    ranges.append(found[sight.id].range / sight.range - 1)
                    bearings.append(found[sight.id].bearing - sight.bearing)
    assert due >= 15
    assert len(ranges) >= 0.85 * due
    # Were the picture drawn from another place than the truth says, it would show in the mean.
    assert abs(np.mean(ranges)) < 0.001
    assert np.std(ranges) < 0.005
    assert abs(np.mean(bearings)) < math.radians(0.03)
    assert np.std(bearings) < math.radians(0.1)


@pytest.mark.parametrize("kind", ["room", "corridor", "yard", "three"])
def test_replay_knows_where_the_robot_was(kind: Kind, keep: Path) -> None:
    row = figures([judge(kind, 0, keep, measured=True)])
    mean, p95 = (floor for floor, _ in LIMITS[kind][:2])
    assert row["position_mean_cm"] <= mean
    assert row["position_p95_cm"] <= p95
    assert row["poses_percent"] >= 97.0
    assert row["nees_mean"] <= 4.5
    assert row["reckoned_mean_cm"] > 5 * row["position_mean_cm"]
    assert not row["false_reports"]


def test_a_moved_pole_is_named_with_where_it_went(keep: Path) -> None:
    verdict = judge("moved", 1, keep, measured=True)
    assert verdict.moved_after is not None
    assert verdict.moved_after <= 2.0
    assert verdict.moved_error is not None
    assert verdict.moved_error <= 0.10
    assert not verdict.false_reports


def test_a_lifted_robot_finds_itself_again(keep: Path) -> None:
    verdict = judge("lifted", 1, keep, measured=True)
    assert verdict.recovery is not None
    assert verdict.recovery <= 3.0
    assert not verdict.false_reports


def test_a_robot_that_never_moves_owes_no_pose() -> None:
    row = figures([Verdict("room", 1, microseconds=1.0)])
    assert math.isnan(row["poses_percent"])
    assert math.isnan(row["whole_read_percent"])
    assert math.isnan(row["by_seed"][0]["poses_percent"])
