"""`polepilot simulate` by its contract: files, document, exit status."""

from __future__ import annotations

import json
import math
from importlib.resources import files
from pathlib import Path
from typing import Any

import pytest
from mcap.reader import make_reader

from polepilot.commands.main import run
from polepilot.core.trajectory import position_errors, read_tum

DEMO = Path(str(files("polepilot").joinpath("demo/workshop.json")))
SMALL = {
    "name": "Small",
    "boundary": [[0, 0], [4.2, 0], [4.2, 3.4], [0, 3.4]],
    "landmarks": [
        {"id": 1, "x": 0, "y": 0.6},
        {"id": 2, "x": 0, "y": 2.8},
        {"id": 4, "x": 2.1, "y": 3.4},
        {"id": 7, "x": 4.2, "y": 2.8},
        {"id": 8, "x": 4.2, "y": 0.6},
        {"id": 11, "x": 2.1, "y": 0},
    ],
    "start": [2.0, 1.7, 0.0],
}


def simulate(capfd: pytest.CaptureFixture[str], *words: str) -> Any:
    assert run(["simulate", *words, "--json"]) == 0
    out = capfd.readouterr().out
    assert out.count("\n") == 1
    return json.loads(out)


def test_a_route_by_measured_sensing(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    out = tmp_path / "out"
    words = ("--mode", "route", "--route", "Tour", "--sensing", "measured", "--seed", "3")
    result = simulate(capfd, str(DEMO), *words, "--out", str(out))
    assert set(result) == {
        "outcome", "reason", "position_error", "heading_error", "measured_error",
        "coverage", "contacts", "simulated_s", "wall_s",
    }  # fmt: skip
    assert result["outcome"] == "done"
    assert result["contacts"] == 0
    assert result["position_error"]["mean"] <= 0.04
    real, estimated = read_tum(out / "real.tum"), read_tum(out / "estimated.tum")
    again = position_errors(real, estimated)
    assert again.mean == pytest.approx(result["position_error"]["mean"], abs=1e-4)
    last = json.loads(DEMO.read_text())["routes"][0]["nodes"][-1]
    assert math.dist(real.poses[-1][:2], last) < 0.10
    assert len(read_tum(out / "measured.tum").stamps) > 50
    assert (out / "target.csv").read_text().startswith("t,x,y\n")
    with (out / "run.mcap").open("rb") as file:
        topics = {channel.topic for _, channel, _ in make_reader(file).iter_messages()}
    assert {"site", "plan", "snapshot", "sighting", "result"} <= topics


def test_the_same_seed_gives_the_same_run(
    tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    words = (str(DEMO), "--mode", "scan", "--duration", "8", "--seed", "5")
    first, _ = (simulate(capfd, *words, "--out", str(tmp_path / name)) for name in ("a", "b"))
    assert first["outcome"] == "timeout"
    for file in ("real.tum", "estimated.tum", "measured.tum", "target.csv"):
        assert (tmp_path / "a" / file).read_bytes() == (tmp_path / "b" / file).read_bytes()


@pytest.mark.slow
def test_a_small_room_is_covered_by_rendered_pictures(
    tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    site = tmp_path / "small.json"
    site.write_text(json.dumps(SMALL))
    result = simulate(capfd, str(site), "--mode", "scan", "--out", str(tmp_path / "out"))
    assert result["outcome"] == "done"
    assert result["contacts"] == 0
    assert result["coverage"] >= 0.90
    assert result["position_error"]["mean"] <= 0.04


@pytest.mark.parametrize(
    ("change", "words", "named"),
    [
        ({"landmarks": [{"id": 1, "x": 0, "y": 1}]}, (), "landmarks"),
        ({"boundary": [[0, 0], [4, 3], [4, 0], [0, 3]]}, (), "boundary"),
        ({}, ("--mode", "route", "--route", "Nowhere"), "Nowhere"),
        ({}, ("--seed", "minus"), "seed"),
        ({}, ("--start", "9,9"), "start"),
    ],
)
def test_bad_input_is_one_clear_line(
    change: dict[str, Any],
    words: tuple[str, ...],
    named: str,
    tmp_path: Path,
    capfd: pytest.CaptureFixture[str],
) -> None:
    site = tmp_path / "site.json"
    site.write_text(json.dumps({**SMALL, **change}))
    out = tmp_path / "out"
    status = run(["simulate", str(site), "--mode", "scan", "--out", str(out), *words])
    told = capfd.readouterr()
    assert status == 2
    assert told.out == ""
    assert told.err.count("\n") == 1, told.err
    assert named in told.err
    assert "Traceback" not in told.err


def test_a_start_that_is_asked_for_counts_for_the_robot_too(
    tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    words = ("--mode", "scan", "--sensing", "measured", "--duration", "1")
    simulate(capfd, str(DEMO), *words, "--start", "4,1,2.5", "--out", str(tmp_path))
    first = read_tum(tmp_path / "real.tum").poses[0]
    assert first == pytest.approx((4.0, 1.0, 2.5), abs=0.01)


@pytest.mark.parametrize("name", ["real.tum", "run.mcap"])
def test_a_folder_that_cannot_be_written_is_said_before_the_run(
    tmp_path: Path, capfd: pytest.CaptureFixture[str], name: str
) -> None:
    (tmp_path / name).mkdir()
    assert run(["simulate", str(DEMO), "--mode", "scan", "--out", str(tmp_path), "--json"]) == 2
    told = capfd.readouterr()
    assert told.out == ""
    assert told.err.count("\n") == 1
    assert name in told.err
