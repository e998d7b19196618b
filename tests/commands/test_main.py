"""The command line as a whole: what is no command, and failures that are nobody's mistake."""

from __future__ import annotations

import errno

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
