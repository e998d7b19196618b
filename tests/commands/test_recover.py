"""`polepilot recover`: whatever is left of a log, whole."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from mcap.exceptions import McapError
from mcap.reader import make_reader

from polepilot.commands.main import run
from polepilot.core.observation import Odometry
from polepilot.core.robot.recorder import Recorder

Captured = pytest.CaptureFixture[str]


def stamps(path: Path) -> list[float]:
    """With the reader that seeks, which refuses a file without its end."""
    with path.open("rb") as file:
        return [json.loads(m.data)["t"] for _, _, m in make_reader(file).iter_messages()]


@pytest.fixture
def cut(tmp_path: Path) -> Path:
    path = tmp_path / "run.mcap"
    recorder = Recorder(path)
    for number in range(20_000):
        recorder.odometry(Odometry(0.02 * number, 0.1, 0.0), None)
    recorder.close()
    path.write_bytes(path.read_bytes()[: path.stat().st_size // 2])
    return path


def test_what_is_left_is_made_whole(cut: Path, tmp_path: Path, capsys: Captured) -> None:
    before = cut.read_bytes()
    with pytest.raises(McapError):
        stamps(cut)
    out = tmp_path / "whole.mcap"
    assert run(["recover", str(tmp_path), "--out", str(out), "--json"]) == 0
    document = json.loads(capsys.readouterr().out)
    assert "cut off" in document["cut"]
    found = stamps(out)
    assert document["messages"] == len(found) > 5000
    assert found == pytest.approx([0.02 * n for n in range(len(found))], abs=1e-6)
    assert cut.read_bytes() == before
    assert sorted(path.name for path in tmp_path.iterdir()) == ["run.mcap", "whole.mcap"]
    assert run(["recover", str(out), "--out", str(tmp_path / "again.mcap")]) == 0
    assert "whole.mcap: whole." in capsys.readouterr().out


def test_what_is_refused(cut: Path, tmp_path: Path, capsys: Captured) -> None:
    nothing = tmp_path / "nothing.mcap"
    nothing.write_bytes(b"\x89MCAP0\r\n")
    for words, expected in (
        ([str(tmp_path / "gone.mcap"), "--out", "a"], "no such log"),
        ([str(cut), "--out", str(cut)], "another file"),
        ([str(cut), "--out", str(tmp_path)], "another file"),
        ([str(nothing), "--out", str(tmp_path / "a")], "expected the log of a run"),
        ([str(cut), "--out", str(tmp_path / "no" / "a")], "cannot be written"),
    ):
        assert run(["recover", *words]) == 2
        captured = capsys.readouterr()
        assert expected in captured.err
        assert captured.err.count("\n") == 1
        assert captured.out == ""
    assert sorted(path.name for path in tmp_path.iterdir()) == ["nothing.mcap", "run.mcap"]
