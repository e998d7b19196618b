"""The `detect` contract of the command line."""

from __future__ import annotations

import json
import math
import re
import weakref
from pathlib import Path

import cv2
import numpy as np
import pytest
from vision_scenes import picture, pole

from polepilot.commands.detect import parse_center
from polepilot.commands.ids import parse_ids
from polepilot.commands.main import run
from polepilot.core.errors import InputError
from polepilot.core.landmark import LandmarkKind
from polepilot.core.observation import Image
from polepilot.core.sim.render import Look
from polepilot.core.vision import images
from polepilot.core.vision.images import read_image
from polepilot.core.vision.paint import Paint

KEYS = {"id", "range", "bearing", "column", "top", "bottom", "range_sigma", "bearing_sigma"}


@pytest.fixture
def near(tmp_path: Path) -> str:
    path = tmp_path / "near.png"
    cv2.imwrite(str(path), picture([pole(13, 3.0, 0.1)]))
    return str(path)


@pytest.fixture
def empty(tmp_path: Path) -> str:
    path = tmp_path / "empty.jpg"
    cv2.imwrite(str(path), picture([]))
    return str(path)


def test_json_is_one_document(near: str, empty: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["detect", near, empty, near, "--json"]) == 0
    out, err = capsys.readouterr()
    assert err == ""
    frames = json.loads(out)["frames"]
    assert [frame["file"] for frame in frames] == [near, empty, near]
    assert frames[0]["detections"] == frames[2]["detections"]
    assert frames[1]["detections"] == []
    (found,) = frames[0]["detections"]
    assert set(found) == KEYS
    assert found["id"] == 13
    assert found["range"] == pytest.approx(3.0, rel=0.005)
    assert found["bearing"] == pytest.approx(0.1, abs=0.002)
    assert 0 < found["range_sigma"] < 0.05
    assert 0 < found["bearing_sigma"] < 0.01


def test_names_are_given_back_as_they_were_given(
    near: str, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(Path(near).parent)
    given = ["./near.png", f".//{Path(near).parent.name}/../near.png", near]
    (Path(near).parent / Path(near).parent.name).mkdir()
    assert run(["detect", *given, "--json"]) == 0
    frames = json.loads(capsys.readouterr().out)["frames"]
    assert [frame["file"] for frame in frames] == given


def test_options_change_the_answer(near: str, capsys: pytest.CaptureFixture[str]) -> None:
    def ask(*options: str) -> list[dict[str, float]]:
        assert run(["detect", near, "--json", *options]) == 0
        found: list[dict[str, float]] = json.loads(capsys.readouterr().out)["frames"][0][
            "detections"
        ]
        return found

    (plain,) = ask()
    (double,) = ask("--camera-constant", "1200", "--shape", "flat")
    assert double["range"] == pytest.approx(2 * plain["range"], rel=0.03)
    (moved,) = ask("--center", "159.5,149.5")
    assert moved["bearing"] < plain["bearing"] - math.radians(3)
    assert ask("--ids", "1-12,14") == []
    assert ask("--bits", "8") == []
    (bigger,) = ask("--segment", "0.1", "--diameter", "0.14")
    assert bigger["range"] == pytest.approx(2 * plain["range"], rel=0.03)
    (paper,) = ask("--detector", "paper")
    assert paper["id"] == 13


def test_eight_bits(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "eight.png"
    cv2.imwrite(str(path), picture([pole(201, 4.0, 0.0, LandmarkKind(bits=8))]))
    assert run(["detect", str(path), "--bits", "8", "--ids", "1-255", "--json"]) == 0
    (found,) = json.loads(capsys.readouterr().out)["frames"][0]["detections"]
    assert found["id"] == 201


def test_a_table_for_people(near: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["detect", near]) == 0
    out = capsys.readouterr().out
    assert re.search(r"\b13\b.*\b(29[89]|30[012])\.\d\b.*\+5\.7\d", out)


def test_every_unreadable_file_is_named(
    near: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    text = tmp_path / "text.png"
    text.write_text("hello")
    missing = tmp_path / "missing.png"
    cut = tmp_path / "cut.png"
    cut.write_bytes(Path(near).read_bytes()[:5000])
    assert run(["detect", near, str(text), str(missing), str(cut), "--json"]) == 2
    out, err = capsys.readouterr()
    assert out == ""
    assert err.count("\n") == 1
    assert str(near) not in err
    for path in (text, missing, cut):
        assert str(path) in err


@pytest.mark.parametrize(
    "options",
    [
        ["--center", "1"],
        ["--center", "a,b"],
        ["--center", "nan,1"],
        ["--ids", "0-3"],
        ["--ids", "7-3"],
        ["--ids", "16"],
        ["--ids", "x"],
        ["--ids", ""],
        ["--bits", "7"],
        ["--camera-constant", "0"],
        ["--camera-constant", "nan"],
        ["--segment", "-1"],
        ["--shape", "ball"],
        ["--detector", "best"],
        ["--bright", "beige"],
        ["--bright", "green", "--detector", "paper"],
        ["--annotate", "seen.gif"],
        ["--annotate", "seen"],
        ["--annotate", "no/such/folder/seen.png"],
        ["--no-such-option"],
    ],
)
def test_bad_options(near: str, options: list[str], capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["detect", near, *options]) == 2
    out, err = capsys.readouterr()
    assert out == ""
    assert err.count("\n") == 1
    assert options[0] in err


def test_lists_of_ids_and_centres() -> None:
    assert parse_ids("1-15", 4) == list(range(1, 16))
    assert parse_ids("1, 3,7-9,3", 4) == [1, 3, 7, 8, 9]
    assert parse_center("199.5, -3") == (199.5, -3.0)
    with pytest.raises(InputError, match="CX,CY"):
        parse_center("1,2,3")


def greens(path: Path) -> int:
    """Pixels of the colour that what was found is drawn with."""
    drawn = cv2.imread(str(path))
    assert drawn is not None
    return int(((drawn[:, :, 1] > 200) & (drawn[:, :, 0] < 120) & (drawn[:, :, 2] < 120)).sum())


@pytest.mark.parametrize("detector", ["default", "paper"])
def test_annotate(
    near: str, tmp_path: Path, detector: str, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "seen.png"
    options = ["--detector", detector, "--annotate", str(out), "--json"]
    assert run(["detect", near, *options]) == 0
    assert set(json.loads(capsys.readouterr().out)["frames"][0]["detections"][0]) == KEYS
    assert greens(out) > 1000


def test_annotate_numbers_several(near: str, empty: str, tmp_path: Path) -> None:
    (tmp_path / "out").mkdir()
    assert run(["detect", near, empty, "--annotate", str(tmp_path / "out" / "seen.jpg")]) == 0
    names = sorted(path.name for path in (tmp_path / "out").iterdir())
    assert names == ["seen-1.jpg", "seen-2.jpg"]
    assert greens(tmp_path / "out" / "seen-1.jpg") > 10 * greens(tmp_path / "out" / "seen-2.jpg")


def test_annotate_spares_what_it_looks_at(
    near: str, empty: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    before = Path(near).read_bytes()
    assert run(["detect", near, "--annotate", near]) == 2
    assert "is a picture to look at" in capsys.readouterr().err
    (tmp_path / "a-2.png").write_bytes(before)
    files = [empty, str(tmp_path / "a-2.png")]
    assert run(["detect", *files, "--annotate", str(tmp_path / "a.png")]) == 2
    assert Path(near).read_bytes() == (tmp_path / "a-2.png").read_bytes() == before
    assert not (tmp_path / "a-1.png").exists()


def test_a_drawing_too_large_for_its_file_is_told_in_one_line(
    near: str, tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    tall = tmp_path / "tall.png"
    cv2.imwrite(str(tall), np.zeros((70_000, 3, 3), np.uint8))
    out = tmp_path / "out"
    out.mkdir()
    assert run(["detect", near, str(tall), "--annotate", str(out / "t.jpg")]) == 2
    said = capfd.readouterr()
    assert said.out == ""
    assert said.err.count("\n") == 1
    assert f"--annotate {out / 't-2.jpg'}: the drawing has 640 x 70" in said.err
    assert list(out.iterdir()) == []
    assert run(["detect", str(tall), "--annotate", str(out / "t.png")]) == 0


def test_pictures_are_held_one_at_a_time(
    near: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    alive: list[weakref.ref[Image]] = []
    most = 0

    def watched(path: str) -> Image:
        nonlocal most
        image = read_image(path)
        alive.append(weakref.ref(image))
        most = max(most, sum(one() is not None for one in alive))
        return image

    monkeypatch.setattr(images, "read_image", watched)
    out = tmp_path / "seen.png"
    assert run(["detect", *[near] * 12, "--annotate", str(out), "--json"]) == 0
    assert len(alive) == 12
    assert most <= 2
    assert len(list(tmp_path.glob("seen-*.png"))) == 12


def test_one_unreadable_picture_leaves_no_drawing(
    near: str, empty: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "out"
    out.mkdir()
    (out / "seen-1.png").write_bytes(b"old")
    bad = [str(tmp_path / "gone.png"), str(tmp_path / "lost.png")]
    files = [near, bad[0], empty, bad[1]]
    assert run(["detect", *files, "--annotate", str(out / "seen.png")]) == 2
    said = capsys.readouterr()
    assert said.out == ""
    assert said.err.count("\n") == 1
    assert all(name in said.err for name in bad)
    assert [path.name for path in out.iterdir()] == ["seen-1.png"]
    assert (out / "seen-1.png").read_bytes() == b"old"


def test_links_in_a_circle_are_one_line(
    near: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    circle = tmp_path / "circle.png"
    circle.symlink_to(circle)
    assert run(["detect", near, "--annotate", str(circle)]) == 2
    assert run(["detect", str(circle), "--annotate", str(tmp_path / "seen.png")]) == 2
    lines = capsys.readouterr().err.splitlines()
    assert len(lines) == 2
    assert all("circle.png" in line for line in lines)
    assert circle.is_symlink()


def test_names_are_no_markup(
    near: str,
    empty: str,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    here = Path(near).parent
    monkeypatch.chdir(here)
    monkeypatch.setenv("COLUMNS", "200")
    names = ["a[/b]/r0.png", "[red]y.png", ":smile:.png", "end\\.png"]
    for name in names:
        (here / name).parent.mkdir(parents=True, exist_ok=True)
        (here / name).write_bytes(Path(near).read_bytes())
    (here / "[bold]:smile:none.jpg").write_bytes(Path(empty).read_bytes())
    assert run(["detect", *names, "[bold]:smile:none.jpg"]) == 0
    out = capsys.readouterr().out
    for name in names:
        assert f" {name} " in out
    assert out.count("[bold]:smile:none.jpg") == 2


def test_where_nothing_is_found_the_table_says_what_was_rejected(
    near: str, empty: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run(["detect", empty, near, "--ids", "1-12"]) == 0
    out = capsys.readouterr().out
    assert f"{empty}: no landmarks; no candidate." in out
    assert re.search(rf"{re.escape(near)}: no landmarks; \d candidates? rejected: .*no lan", out)


def test_another_colour(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "green.png"
    cv2.imwrite(str(path), picture([pole(6, 3.0, 0.1)], look=Look.painted(Paint.parse("green"))))
    for bright, ids in (("#00a040", [6]), ("green", [6]), ("orange", [])):
        assert run(["detect", str(path), "--bright", bright, "--json"]) == 0
        found = json.loads(capsys.readouterr().out)["frames"][0]["detections"]
        assert [one["id"] for one in found] == ids
