"""The survey command: pictures and logs in, a table, a document, a site and a drawing out."""

from __future__ import annotations

import json
import math
import re
import xml.etree.ElementTree as ET
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest

from polepilot.commands.main import run
from polepilot.core.geometry import Pose2D
from polepilot.core.landmark import Landmark
from polepilot.core.localization import survey_work
from polepilot.core.localization.odometry import advance
from polepilot.core.localization.survey_align import fit_rigid
from polepilot.core.sim.render import Renderer
from polepilot.core.site import read_site
from polepilot.core.vehicle import Camera

DEMO = Path(__file__).parents[2] / "polepilot" / "demo" / "workshop.json"
MARKS = [
    Landmark(5, 5.9, 1.6),
    Landmark(9, 5.2, 4.8),
    Landmark(14, 3.0, 5.7),
    Landmark(3, 0.6, 4.4),
]
START = Pose2D(2.2, 2.0, 0.5)
PERIOD, SPEED, STEERING = 0.1, 0.25, 0.16
SWEEP = 1.3


@pytest.fixture(scope="module")
def drawn(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A drive on a bow, with the camera sweeping to and fro; the tenth picture is broken."""
    folder = tmp_path_factory.mktemp("drive")
    camera = Camera()
    corners = [(0.0, 0.0), (7.0, 0.0), (7.0, 6.0), (0.0, 6.0)]
    walls = list(zip(corners, corners[1:] + corners[:1], strict=True))
    renderer = Renderer(camera, MARKS, walls, np.random.default_rng(7))
    lines: list[dict[str, Any]] = [{"t": 0.0, "kind": "drive", "speed": 0.0, "steering": 0.0}]
    pose, rate = START, math.radians(50)
    pan, way = -0.4, 1.0
    for index in range(150):
        stamp = round(PERIOD * index, 6)
        name = f"{index:03}.png"
        image = renderer.render(pose.compose(Pose2D(camera.forward, 0.0, pan)), way * rate)
        if index == 9:
            (folder / name).write_text("this is no picture")
        else:
            cv2.imwrite(str(folder / name), image)
        lines.append({"t": stamp, "kind": "pan", "angle": round(pan, 6)})
        lines.append({"t": stamp, "kind": "frame", "file": name})
        if index == 60:
            lines.append({"t": stamp, "kind": "drive", "speed": SPEED, "steering": STEERING})
        if index >= 60:
            pose = advance(pose, SPEED, STEERING, PERIOD, 0.2)
        pan += way * rate * PERIOD
        if not -0.6 <= pan <= SWEEP + 0.6:
            way = -way
            pan += 2 * way * rate * PERIOD
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
        "landmarks": [],
    }
    (folder / "dataset.json").write_text(json.dumps(document))
    (folder / "samples.jsonl").write_text("".join(json.dumps(line) + "\n" for line in lines))
    return folder


@pytest.fixture(scope="module")
def logged(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder of a simulated run on the demo site."""
    folder = tmp_path_factory.mktemp("run")
    words = ["--mode", "scan", "--duration", "70", "--sensing", "measured", "--seed", "3"]
    assert run(["simulate", str(DEMO), *words, "--out", str(folder), "--json"]) == 0
    return folder


def test_pictures_become_a_map(
    drawn: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out, plot = tmp_path / "site.json", tmp_path / "map.svg"
    assert run(["survey", str(drawn), "--out", str(out), "--plot", str(plot), "--json"]) == 0
    document = json.loads(capsys.readouterr().out)
    truth = {mark.id: mark.position for mark in MARKS}
    places = {pole["id"]: (pole["x"], pole["y"]) for pole in document["poles"]}
    assert set(places) == set(truth)
    pose = fit_rigid(places, truth, tuple(truth))
    for number, place in places.items():
        assert math.dist(pose.to_parent(place), truth[number]) < 0.03
    assert document["frame"] == "first pose"
    assert document["pictures"] == 150
    # Pan and picture alternate after the first line: the tenth picture is line 21.
    (note,) = [note for note in document["notes"] if note.startswith("Left out")]
    assert note.startswith(
        "Left out, as they cannot be read: 1 of 150 pictures, the first one samples.jsonl:21: "
    )
    assert "009.png" in note
    assert len(document["path"]) == 150
    assert math.dist(pose.position, START.position) < 0.03
    for pole in document["poles"]:
        assert 0 < pole["sigma"] < 0.1
        assert pole["measured"] is None
    site = read_site(out)
    assert {mark.id for mark in site.landmarks} == set(places)
    for mark in site.landmarks:
        assert math.dist(mark.position, places[mark.id]) < 1e-3
    assert site.start is not None
    assert site.start.position == pytest.approx((0, 0), abs=1e-4)
    ET.parse(plot)


def test_own_logs_and_a_pole_that_was_measured_wrongly(
    logged: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    document = json.loads(DEMO.read_text())
    document["landmarks"][2]["x"] -= 0.3
    wrong = document["landmarks"][2]["id"]
    hand = tmp_path / "hand.json"
    hand.write_text(json.dumps(document))
    out = tmp_path / "better.json"
    words = ["survey", str(logged), "--site", str(hand), "--refine", "--out", str(out)]
    assert run([*words, "--plot", str(tmp_path / "map.png")]) == 0
    shown = capsys.readouterr().out
    assert re.search(rf"pole {wrong} was measured wrongly, or was moved: (29|30|31) cm off", shown)
    assert shown.count("WRONG") == 1
    before, after, true = read_site(hand), read_site(out), read_site(DEMO)
    for mark in after.landmarks:
        assert math.dist(mark.position, true.landmarks_by_id()[mark.id].position) < 0.02
        assert mark.kind == true.landmarks_by_id()[mark.id].kind
    assert [mark.id for mark in after.landmarks] == [mark.id for mark in before.landmarks]
    for part in ("boundary", "islands", "walls", "routes", "start", "name"):
        assert getattr(after, part) == getattr(before, part)
    assert (tmp_path / "map.png").read_bytes().startswith(b"\x89PNG")


def test_a_good_map_is_called_good(logged: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["survey", str(logged / "run.mcap"), "--refine"]) == 0
    shown = capsys.readouterr().out
    assert "no pole contradicts the map." in shown
    assert "WRONG" not in shown


def test_a_fit_that_has_not_settled_writes_no_site(
    drawn: Path,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    solved = survey_work.solve
    monkeypatch.setattr(
        survey_work, "solve", lambda *words: replace(solved(*words), converged=False)
    )
    out = tmp_path / "site.json"
    assert run(["survey", str(drawn), "--out", str(out)]) == 2
    shown = capsys.readouterr()
    assert "has not converged" in shown.err
    assert len(shown.err.strip().splitlines()) == 1
    assert not out.exists()
    assert run(["survey", str(drawn), "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["converged"] is False


def test_anchors_tie_the_survey_to_a_site(
    logged: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    site = read_site(DEMO)
    a, b = (site.landmarks[k] for k in (0, 4))
    bare = tmp_path / "bare.json"
    document = json.loads(DEMO.read_text())
    document["landmarks"], document["start"] = [], None
    bare.write_text(json.dumps(document))
    out = tmp_path / "site.json"
    words = ["survey", str(logged), "--site", str(bare), "--out", str(out)]
    assert run(words) == 2
    assert "nothing ties the survey to the walls" in capsys.readouterr().err
    assert not out.exists()
    anchors = [f"--anchor={mark.id}={mark.x},{mark.y}" for mark in (a, b)]
    assert run([*words, *anchors]) == 0
    for mark in read_site(out).landmarks:
        assert math.dist(mark.position, site.landmarks_by_id()[mark.id].position) < 0.03
    assert read_site(out).boundary == site.boundary


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["--distance", "1", "99", "3"], "pole 99 was never seen"),
        (["--distance", "1", "2", "-3"], "expected two different poles"),
        (["--anchor", "1=2,3"], "expected two or more"),
        (["--anchor", "1=2"], "expected ID=X,Y"),
        (["--anchor", "1=2,3", "--anchor", "1=4,5"], "given twice"),
        (["--plot", "x.gif"], "ends in .svg or .png"),
        (["--site", "nowhere.json"], "nowhere.json: cannot be read"),
        (["--map-sigma", "0"], "map-sigma is 0"),
        (["--ids", "0-99"], "not within 1 to 15"),
    ],
)
def test_mistakes_are_told_in_a_line(
    logged: Path, words: list[str], said: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run(["survey", str(logged), *words]) == 2
    shown = capsys.readouterr()
    assert shown.out == ""
    assert said in shown.err
    assert len(shown.err.strip().splitlines()) == 1


def test_no_recording(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["survey", str(tmp_path / "gone")]) == 2
    assert "expected a folder" in capsys.readouterr().err
    assert run(["survey", str(tmp_path)]) == 2
    assert "dataset.json" in capsys.readouterr().err


def copied(drawn: Path, to: Path, kept: Callable[[dict[str, Any]], bool]) -> list[dict[str, Any]]:
    """All lines of the recording, of which some are written to a folder; its pictures stay."""
    lines = [json.loads(line) for line in (drawn / "samples.jsonl").read_text().splitlines()]
    (to / "dataset.json").write_text((drawn / "dataset.json").read_text())
    for line in lines:
        if line["kind"] == "frame":
            line["file"] = str(drawn / line["file"])
    text = "".join(json.dumps(line) + "\n" for line in lines if kept(line))
    (to / "samples.jsonl").write_text(text)
    return lines


def test_pictures_of_which_nobody_knows_where_they_look(
    drawn: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    copied(drawn, tmp_path, lambda line: line["kind"] != "pan" or line["t"] < 12.0)
    assert run(["survey", str(tmp_path)]) == 0
    assert re.search(
        r"Left out, as nobody knows where the camera pointed: 2\d of 150 pictures, the first one "
        r"samples.jsonl:\d+: no pan reading within 0.25 s\.",
        capsys.readouterr().out,
    )


def test_pictures_without_a_drive(
    drawn: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    lines = copied(drawn, tmp_path, lambda line: line["kind"] != "drive")
    assert run(["survey", str(tmp_path)]) == 2
    assert "expected at least one sample of kind 'drive'" in capsys.readouterr().err
    kept = [line | ({"speed": 0.0} if line["kind"] == "drive" else {}) for line in lines]
    (tmp_path / "samples.jsonl").write_text("".join(json.dumps(line) + "\n" for line in kept))
    assert run(["survey", str(tmp_path)]) == 2
    assert "the robot drove 0.00 m" in capsys.readouterr().err
    kept = [line for line in lines if line["kind"] != "pan"]
    (tmp_path / "samples.jsonl").write_text("".join(json.dumps(line) + "\n" for line in kept))
    assert run(["survey", str(tmp_path)]) == 2
    assert "expected at least one sample of kind 'pan'" in capsys.readouterr().err
