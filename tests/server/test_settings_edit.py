"""robot.toml changed in place: what a person wrote stays, and the old file too."""

from __future__ import annotations

import os
import stat
import tomllib
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from polepilot.core.errors import ConfigError
from polepilot.server.settings import load_settings
from polepilot.server.settings_docs import EXAMPLE
from polepilot.server.settings_edit import Changes, as_toml, changed, rewrite

CONSTANT: Changes = {"camera": {"constant_px": 612.25}}


@pytest.mark.parametrize(
    ("before", "after"),
    [
        ("", "[camera]\nconstant_px = 612.25\n"),
        ("# mine\n", "# mine\n\n[camera]\nconstant_px = 612.25\n"),
        ("[camera]\n", "[camera]\nconstant_px = 612.25\n"),
        ("[camera]", "[camera]\nconstant_px = 612.25"),
        (
            "[camera]  # the eye\n  constant_px=600 # from the tape\nwidth = 400\n",
            "[camera]  # the eye\n  constant_px=612.25 # from the tape\nwidth = 400\n",
        ),
        (
            "[camera]\nwidth = 640\n\n# below\n[pan]\nrate_rad_s = 1\n",
            "[camera]\nwidth = 640\nconstant_px = 612.25\n\n# below\n[pan]\nrate_rad_s = 1\n",
        ),
        (
            "[camera]\n  center = [ # columns, rows\n   200,\n   150,\n  ]\n[pan]\n",
            "[camera]\n  center = [ # columns, rows\n   200,\n   150,\n  ]\n"
            "  constant_px = 612.25\n[pan]\n",
        ),
        ("camera.width = 640\n", "camera.width = 640\ncamera.constant_px = 612.25\n"),
        ("camera.constant_px = 5e2\n[pan]\n", "camera.constant_px = 612.25\n[pan]\n"),
        ('[camera]\n"constant_px" = 600', '[camera]\n"constant_px" = 612.25'),
        (
            '[link]\nport = "/dev/a#b=[camera]"\n',
            '[link]\nport = "/dev/a#b=[camera]"\n\n[camera]\nconstant_px = 612.25\n',
        ),
    ],
)
def test_one_line_changes(before: str, after: str) -> None:
    assert changed(before, CONSTANT, "robot.toml") == after
    # A second time there is nothing to do.
    assert changed(after, CONSTANT, "robot.toml") == after


def test_lists_and_several_sections() -> None:
    changes: Changes = {
        "camera": {"center": (201.5, 148.0), "distortion": (-0.2, 0.05, 0.0, 0.0, 0.0)},
        "pan": {"adc_at_minimum": 17},
    }
    before = (
        "[camera]\ncenter = [\n 200, # left\n 150,\n] # the middle\n[pan]\nadc_at_minimum = 3\n"
    )
    assert changed(before, changes, "robot.toml") == (
        "[camera]\ncenter = [201.5, 148.0] # the middle\n"
        "distortion = [-0.2, 0.05, 0.0, 0.0, 0.0]\n[pan]\nadc_at_minimum = 17\n"
    )
    assert tomllib.loads(as_toml(changes))["camera"]["center"] == [201.5, 148.0]


def test_the_example_keeps_everything_else() -> None:
    text = EXAMPLE.read_text(encoding="utf-8")
    after = changed(text, CONSTANT, "robot.toml")
    pairs = zip(text.splitlines(), after.splitlines(), strict=True)
    assert [pair for pair in pairs if pair[0] != pair[1]] == [
        ("constant_px = 600.0", "constant_px = 612.25")
    ]


@pytest.mark.parametrize(
    ("text", "changes", "expected"),
    [
        ("camera = { width = 400 }\n", CONSTANT, "put in by hand: [camera]; constant_px = 612.25."),
        ("camera = { constant_px = 5 }\n", CONSTANT, "put in by hand"),
        ("[camera\n", CONSTANT, "no TOML"),
        ("[camra]\n", CONSTANT, "did you mean camera"),
        ("", {"camera": {"constant_px": -1.0}}, "expected a number more than 1"),
    ],
)
def test_what_cannot_be_changed_is_refused(text: str, changes: Changes, expected: str) -> None:
    with pytest.raises(ConfigError, match=r"^robot\.toml: ") as caught:
        changed(text, changes, "robot.toml")
    assert expected in str(caught.value)
    assert "\n" not in str(caught.value)


def test_the_old_file_is_kept(tmp_path: Path) -> None:
    path = tmp_path / "robot.toml"
    first = "[camera]\nconstant_px = 600 # by the tape\n"
    path.write_text(first)
    path.chmod(0o640)
    kept = rewrite(path, CONSTANT)
    assert kept == tmp_path / "robot.toml.1"
    assert kept.read_text() == first
    assert path.read_text() == "[camera]\nconstant_px = 612.25 # by the tape\n"
    assert stat.S_IMODE(path.stat().st_mode) == 0o640
    assert rewrite(path, CONSTANT) is None
    assert rewrite(path, {"camera": {"constant_px": 613.0}}) == tmp_path / "robot.toml.2"
    assert kept.read_text() == first
    names = {entry.name for entry in tmp_path.iterdir()}
    assert names == {"robot.toml", "robot.toml.1", "robot.toml.2"}


def test_links_and_windows_files(tmp_path: Path) -> None:
    real = tmp_path / "real.toml"
    real.write_bytes(b"\xef\xbb\xbf[camera]\r\nwidth = 400\r\n")
    link = tmp_path / "robot.toml"
    link.symlink_to(real)
    assert rewrite(link, CONSTANT) == tmp_path / "real.toml.1"
    assert link.is_symlink()
    assert real.read_bytes() == b"\xef\xbb\xbf[camera]\r\nwidth = 400\r\nconstant_px = 612.25\r\n"
    assert load_settings(link).camera.constant_px == 612.25


def test_a_failure_changes_nothing(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / "robot.toml"
    path.write_text("[camera]\n")

    def full(*_: object) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(os, "fsync", full)
    with pytest.raises(OSError, match="No space"):
        rewrite(path, CONSTANT)
    assert [entry.name for entry in tmp_path.iterdir()] == ["robot.toml"]
    assert path.read_text() == "[camera]\n"
    with pytest.raises(ConfigError, match="cannot be read"):
        rewrite(tmp_path / "none.toml", CONSTANT)


LINES = st.lists(
    st.sampled_from(
        [
            "# [camera]",
            "",
            "  # constant_px = 5",
            "[camera]",
            "  [camera] # here",
            "[pan]",
            "[server]",
            "width = 400",
            "constant_px = 500.0 # old",
            "camera.height = 300",
            "camera.constant_px = 1e3",
            "center = [\n  199, # a\n  149]",
            "sweep_duty = 0.5",
            'data = """\n[camera]\nconstant_px = 3\n"""',
            "camera = { width = 300 }",
        ]
    ),
    max_size=8,
)


@given(LINES)
@settings(max_examples=300)
def test_whatever_the_file_looks_like(lines: list[str]) -> None:
    text = "\n".join(lines)
    try:
        after = changed(text, CONSTANT, "robot.toml")
    except ConfigError as error:
        assert "\n" not in str(error)  # noqa: PT017
        return
    expected = tomllib.loads(text)
    expected.setdefault("camera", {})["constant_px"] = 612.25
    assert tomllib.loads(after) == expected
    # No comment is lost.
    assert text.count("#") == after.count("#")
