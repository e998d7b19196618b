"""The command line as a whole: what is no command, and failures that are nobody's mistake."""

from __future__ import annotations

import errno
import os
import subprocess
import sys
from pathlib import Path

import pytest

from polepilot.commands import main


@pytest.mark.parametrize("words", [[], ["bench"], ["fly"], ["bench", "fly"], ["plan"]])
def test_bad_usage_is_one_line(words: list[str], capsys: pytest.CaptureFixture[str]) -> None:
    assert main.run(words) == 2
    captured = capsys.readouterr()
    assert captured.out == ""
    assert captured.err.count("\n") == 1
    assert "--help" in captured.err
    assert len(captured.err) < 120


def test_help_is_no_error(capsys: pytest.CaptureFixture[str]) -> None:
    assert main.run(["--help"]) == 0
    assert "simulate" in capsys.readouterr().out


def test_a_failing_disk_is_one_line(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def full(**_: object) -> None:
        raise OSError(errno.ENOSPC, "No space left on device", "run.mcap")

    monkeypatch.setattr(main, "app", full)
    assert main.run(["simulate"]) == 1
    assert capsys.readouterr().err == "run.mcap: No space left on device.\n"


def test_names_that_are_no_text_are_shown_all_the_same(tmp_path: Path) -> None:
    words = [sys.executable, "-c", "from polepilot.commands.main import main; main()"]
    done = subprocess.run(
        [*words, "landmarks", "print", "--ids", "1", "--out", b"a\xff\xc3\xa9.pdf"],
        cwd=tmp_path,
        env={**os.environ, "PYTHONIOENCODING": "utf-8:strict"},
        capture_output=True,
        timeout=60,
        check=False,
    )
    assert (done.returncode, done.stderr) == (0, b"")
    assert done.stdout.startswith("a\\udcffé.pdf: 1 sheet".encode())
    (made,) = tmp_path.iterdir()
    assert os.fsencode(made.name) == b"a\xff\xc3\xa9.pdf"
