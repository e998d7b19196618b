"""`polepilot evaluate` as people and programs call it."""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from core.robot.rig import ROOM
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from polepilot.commands.main import run
from polepilot.core.robot.run_points import read_run, read_targets
from polepilot.core.trajectory import write_tum

Captured = pytest.CaptureFixture[str]


def write(path: Path, offset: float, *, start: float = 0.0, count: int = 101) -> Path:
    """A straight drive of ten seconds, ``offset`` to the left of where it was."""
    stamps = [start + 0.1 * n for n in range(count)]
    write_tum(path, stamps, [(0.2 * (t - start), offset, 0.0) for t in stamps])
    return path


def answer(words: list[str], capsys: Captured) -> Any:
    assert run(["evaluate", *words, "--json"]) == 0
    return json.loads(capsys.readouterr().out)


def refusal(words: list[str], capsys: Captured) -> str:
    assert run(["evaluate", *words]) == 2
    captured = capsys.readouterr()
    assert captured.out == ""
    assert captured.err.count("\n") == 1
    return captured.err


@pytest.fixture(scope="module")
def simulated(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("simulated")
    site = folder / "room.json"
    site.write_text(json.dumps(ROOM))
    out = folder / "run"
    words = ["simulate", str(site), "--mode", "route", "--route", "Across", "--out", str(out)]
    assert run([*words, "--sensing", "measured", "--seed", "3"]) == 0
    return out


def test_trajectories_against_the_truth(tmp_path: Path, capsys: Captured) -> None:
    truth = write(tmp_path / "truth.tum", 0.0)
    files = [write(tmp_path / "estimated.tum", 0.02), write(tmp_path / "measured.tum", -0.05)]
    words = [*map(str, files), "--truth", str(truth)]
    document = answer(words, capsys)
    assert document["alignment"] == "none"
    names = [one["name"] for one in document["trajectories"]]
    assert names == ["estimated", "measured"]
    means = [one["position"]["mean"] for one in document["trajectories"]]
    assert means == pytest.approx([0.02, 0.05])
    assert document["trajectories"][0]["nees"] is None
    document = answer([*words, "--align", "se2"], capsys)
    first = document["trajectories"][0]
    assert first["position"]["mean"] == pytest.approx(0.02)
    assert first["aligned"]["position"]["mean"] == pytest.approx(0, abs=1e-6)
    assert first["aligned"]["y"] == pytest.approx(-0.02)


def test_the_table_says_whether_anything_is_aligned(tmp_path: Path, capsys: Captured) -> None:
    truth = write(tmp_path / "truth.tum", 0.0)
    words = ["evaluate", str(write(tmp_path / "a.tum", 0.02)), "--truth", str(truth)]
    assert run(words) == 0
    text = capsys.readouterr().out
    assert "Nothing is aligned" in text
    row = next(line for line in text.splitlines() if line.startswith("a "))
    assert row.split() == ["a", *["2.00"] * 4, *["0.00"] * 4]
    assert run([*words, "--align", "se2"]) == 0
    assert "a (aligned)" in capsys.readouterr().out


def test_covariances_beside_the_trajectory(tmp_path: Path, capsys: Captured) -> None:
    truth = write(tmp_path / "truth.tum", 0.0)
    estimated = write(tmp_path / "estimated.tum", 0.02)
    lines = [f"{0.1 * n} 1e-4 0 0 1e-4 0 1e-4\n" for n in range(101)]
    (tmp_path / "estimated.cov").write_text("".join(lines))
    words = [str(estimated), "--truth", str(truth)]
    (one,) = answer(words, capsys)["trajectories"]
    assert one["nees"]["mean"] == pytest.approx(4.0, rel=1e-3)
    assert one["nees"]["inside_95"] == 1.0
    other = tmp_path / "other.cov"
    other.write_text("".join(line.replace("1e-4", "1e-6") for line in lines))
    (one,) = answer([*words, "--cov", str(other)], capsys)["trajectories"]
    assert one["nees"]["mean"] == pytest.approx(400.0, rel=1e-3)
    assert one["nees"]["inside_95"] == 0.0


def test_a_simulated_run(simulated: Path, tmp_path: Path, capsys: Captured) -> None:
    """From its files with covariances and map from its log, and from its log alone."""
    capsys.readouterr()
    document = answer([str(simulated), "--plot", str(tmp_path / "a.svg")], capsys)
    one = document["trajectories"][0]
    assert one["name"] == "estimated"
    assert 0 < one["position"]["mean"] < 0.03
    assert one["nees"]["poses"] > 200
    assert (tmp_path / "a.svg").stat().st_size < 400_000
    logged = answer([str(simulated / "run.mcap")], capsys)["trajectories"]
    assert [o["name"] for o in logged] == ["estimated", "measured"]
    for here, there in zip(logged, document["trajectories"], strict=True):
        assert here["position"]["mean"] == pytest.approx(there["position"]["mean"], rel=0.1)
    assert one["nees"]["mean"] == pytest.approx(logged[0]["nees"]["mean"], rel=0.02)
    points = read_run(simulated)
    assert {number for number, _ in points.landmarks} == {1, 2, 4, 7, 8, 11}
    assert len(points.targets) > 1


def test_a_simulated_run_as_a_picture(simulated: Path, tmp_path: Path, capsys: Captured) -> None:
    assert run(["evaluate", str(simulated), "--plot", str(tmp_path / "a.png")]) == 0
    assert (tmp_path / "a.png").read_bytes().startswith(b"\x89PNG")


def test_a_replayed_run_needs_the_truth(simulated: Path, tmp_path: Path, capsys: Captured) -> None:
    assert run(["replay", str(simulated), "--out", str(tmp_path / "out")]) == 0
    capsys.readouterr()
    assert "give --truth" in refusal([str(tmp_path / "out")], capsys)
    words = [str(tmp_path / "out"), "--truth", str(simulated / "real.tum")]
    document = answer(words, capsys)
    names = [one["name"] for one in document["trajectories"]]
    assert names == ["estimated", "measured", "deadreckoned"]
    assert document["trajectories"][0]["nees"]["poses"] > 50


def test_a_log_that_was_cut_off(simulated: Path, tmp_path: Path, capsys: Captured) -> None:
    data = (simulated / "run.mcap").read_bytes()
    (tmp_path / "run.mcap").write_bytes(data[: len(data) // 2])
    assert run(["evaluate", str(tmp_path), "--json"]) == 0
    captured = capsys.readouterr()
    document = json.loads(captured.out)
    assert "cut off" in document["notes"][0]
    assert captured.err == document["notes"][0] + "\n"


def test_what_is_refused(tmp_path: Path, capsys: Captured) -> None:
    truth = str(write(tmp_path / "truth.tum", 0.0))
    good = str(write(tmp_path / "a.tum", 0.0))
    later = str(write(tmp_path / "later.tum", 0.0, start=100.0))
    empty = tmp_path / "empty.tum"
    empty.write_text("# nothing\n")
    assert "expected a trajectory (.tum), the log" in refusal([str(tmp_path / "gone")], capsys)
    assert "gone.tum" in refusal([str(tmp_path / "gone.tum"), "--truth", truth], capsys)
    assert "holds no poses" in refusal([str(empty), "--truth", truth], capsys)
    assert "shares no time" in refusal([later, "--truth", truth], capsys)
    assert f"{empty}: holds no true poses" in refusal([good, "--truth", str(empty)], capsys)
    assert "give --truth" in refusal([good], capsys)
    assert ".svg or .png" in refusal([good, "--truth", truth, "--plot", "a.pdf"], capsys)
    assert "one run alone" in refusal([good, str(tmp_path), "--truth", truth], capsys)
    targets = tmp_path / "target.csv"
    targets.write_text("t,x,y\n1,2\n")
    words = [good, "--truth", truth, "--target", str(targets)]
    assert "target.csv:2: expected three" in refusal(words, capsys)
    targets.write_text("t,x,y\n1,2,nan\n")
    assert "target.csv:2" in refusal(words, capsys)


def test_a_later_trajectory_that_shares_no_time_is_left_out(
    tmp_path: Path, capsys: Captured
) -> None:
    truth = str(write(tmp_path / "truth.tum", 0.0))
    files = [str(write(tmp_path / "a.tum", 0.01)), str(write(tmp_path / "b.tum", 0.0, start=50))]
    assert run(["evaluate", *files, "--truth", truth, "--json"]) == 0
    captured = capsys.readouterr()
    assert [one["name"] for one in json.loads(captured.out)["trajectories"]] == ["a"]
    assert captured.err == "b: left out: shares no time with the true poses.\n"


def test_targets_are_told_once(tmp_path: Path) -> None:
    path = tmp_path / "target.csv"
    path.write_text("t,x,y\n0,1,2\n1,1,2\n2,1,3\n\n3,1,2\n")
    assert read_targets(path).tolist() == [[1, 2], [1, 3], [1, 2]]
    assert np.isfinite(read_targets(path)).all()
    assert math.isclose(read_targets(path)[1, 1], 3.0)


@settings(
    deadline=None, max_examples=80, suppress_health_check=[HealthCheck.function_scoped_fixture]
)
@given(data=st.data())
def test_damaged_files_are_one_line_of_error_or_a_table(
    tmp_path: Path, capsys: Captured, data: st.DataObject
) -> None:
    write(tmp_path / "truth.tum", 0.0, count=20)
    write(tmp_path / "estimated.tum", 0.02, count=20)
    lines = [f"{0.1 * n} 1e-4 0 0 1e-4 0 1e-4\n" for n in range(20)]
    (tmp_path / "estimated.cov").write_text("".join(lines))
    (tmp_path / "target.csv").write_text("t,x,y\n0,1,1\n1,2,2\n")
    path = tmp_path / data.draw(st.sampled_from(sorted(p.name for p in tmp_path.iterdir())))
    content = bytearray(path.read_bytes())
    place = data.draw(st.integers(0, len(content) - 1))
    junk = st.sampled_from([b"nan", b"inf", b"1e308", b"1e-320", b"-", b"\xff", b"\n", b'"', b""])
    content[place : place + data.draw(st.integers(0, 6))] = data.draw(junk | st.binary(max_size=4))
    path.write_bytes(bytes(content))
    words = ["evaluate", str(tmp_path / "estimated.tum"), "--truth", str(tmp_path / "truth.tum")]
    status = run([*words, "--target", str(tmp_path / "target.csv"), "--align", "se2", "--json"])
    captured = capsys.readouterr()
    if status == 0:
        position = json.loads(captured.out)["trajectories"][0]["position"]
        assert all(math.isfinite(value) for value in position.values())
    else:
        assert status == 2
        assert captured.err.count("\n") == 1
        assert captured.out == ""
