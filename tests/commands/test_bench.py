"""The `bench vision` contract of the command line."""

from __future__ import annotations

import json
import os
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest
from vision_scenes import picture, pole

from polepilot.commands import bench
from polepilot.commands.main import run
from polepilot.core.landmark import Landmark
from polepilot.core.observation import Image
from polepilot.core.sim import render
from polepilot.core.vehicle import Camera

KEYS = {"frames", "ours_ms", "aruco_ms", "ratio"}
SCENE = picture([pole(13, 3.0, 0.1)])


def measured(folder: Path | None, capsys: pytest.CaptureFixture[str]) -> dict[str, Any]:
    words = [] if folder is None else ["--frames", str(folder)]
    assert run(["bench", "vision", *words, "--json"]) == 0
    out, err = capsys.readouterr()
    assert err == ""
    result: dict[str, Any] = json.loads(out)
    assert set(result) >= KEYS
    assert result["ours_ms"] > 0
    assert result["ratio"] == pytest.approx(result["ours_ms"] / result["aruco_ms"])
    return result


def refused(folder: Path, capsys: pytest.CaptureFixture[str]) -> str:
    assert run(["bench", "vision", "--frames", str(folder), "--json"]) == 2
    out, err = capsys.readouterr()
    assert out == ""
    assert err.count("\n") == 1
    return err


def write(path: Path, image: Image = SCENE) -> Path:
    assert cv2.imwrite(str(path), image)
    return path


def test_a_folder_of_mixed_sizes_and_formats(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    write(tmp_path / "a.png")
    write(tmp_path / "b.JPG", cv2.resize(SCENE, (640, 480)))
    write(tmp_path / "c.bmp", SCENE[:1, :1])
    write(tmp_path / "d.pgm", np.ascontiguousarray(SCENE[:, :, 1]))
    (tmp_path / "truth.json").write_text("{}")
    result = measured(tmp_path, capsys)
    assert result["frames"] == 4
    assert result["source"] == str(tmp_path)


def test_without_a_folder_it_says_what_it_looked_at(capsys: pytest.CaptureFixture[str]) -> None:
    result = measured(None, capsys)
    assert result["frames"] == 60
    assert "simulator" in result["source"]


def test_for_people(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    write(tmp_path / "a.png")
    assert run(["bench", "vision", "--frames", str(tmp_path)]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert [line.split()[0] for line in lines] == ["1", "ours", "ArUco", "ratio"]


def test_both_see_the_same_pictures_in_turns(monkeypatch: pytest.MonkeyPatch) -> None:
    calls: list[str] = []
    sizes: list[tuple[int, ...]] = []

    def ours(image: Image) -> None:
        calls.append("ours")
        sizes.append(image.shape[:2])

    shapes = [(4, 6, 3), (5, 7, 3), (4, 6, 3)]
    images = [np.zeros(shape, np.uint8) for shape in shapes]
    monkeypatch.setattr(bench, "_ours", lambda _: {(4, 6): ours, (5, 7): ours})
    monkeypatch.setattr(bench, "_aruco", lambda: lambda _: calls.append("aruco"))
    duel = bench.Duel()
    duel.add(images)
    assert duel.frames == 3
    assert len(duel.ours) == len(duel.aruco) == 3 * bench._ROUNDS
    timed = calls[2 * bench._WARM_UP :]
    pairs = list(zip(timed[::2], timed[1::2], strict=True))
    assert all(set(pair) == {"ours", "aruco"} for pair in pairs)
    assert {pair[0] for pair in pairs} == {"ours", "aruco"}
    assert sizes[-3:] == [shape[:2] for shape in shapes]


def test_many_pictures_are_held_in_parts(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    for index in range(5):
        write(tmp_path / f"{index}.png")
    monkeypatch.setattr(bench, "_BATCH", 2 * SCENE.nbytes)
    files = bench.picture_files(tmp_path)
    assert [len(batch) for batch in bench._batches(files)] == [2, 2, 1]
    assert measured(tmp_path, capsys)["frames"] == 5


def test_the_bench_uses_one_thread(capsys: pytest.CaptureFixture[str]) -> None:
    before = cv2.getNumThreads()
    try:
        cv2.setNumThreads(2)
        measured(None, capsys)
        assert cv2.getNumThreads() == 1
    finally:
        cv2.setNumThreads(before)


def test_folders_without_pictures(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert "holds no picture" in refused(tmp_path, capsys)
    (tmp_path / "notes.txt").write_text("hello")
    (tmp_path / "deeper").mkdir()
    write(tmp_path / "deeper" / "a.png")
    assert "holds no picture" in refused(tmp_path, capsys)
    assert "expected a folder" in refused(tmp_path / "none", capsys)
    assert "expected a folder" in refused(write(tmp_path / "a.png"), capsys)


def test_every_unreadable_picture_is_named(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    good = [write(tmp_path / "a.png"), write(tmp_path / "z.png")]
    bad = [tmp_path / name for name in ("cut.png", "link.png", "text.jpg", "folder.png")]
    bad[0].write_bytes(good[0].read_bytes()[:5000])
    bad[1].symlink_to(tmp_path / "gone.png")
    bad[2].write_text("hello")
    bad[3].mkdir()
    said = refused(tmp_path, capsys)
    assert all(str(path) in said for path in bad)
    assert not any(str(path) in said for path in good)


def test_a_pipe_among_the_pictures_does_not_hang(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    os.mkfifo(tmp_path / "pipe.png")
    assert "pipe.png" in refused(tmp_path, capsys)


def test_the_rendered_set_is_always_the_same() -> None:
    first, second = bench.rendered_set(2), bench.rendered_set(2)
    assert all(np.array_equal(a, b) for a, b in zip(first, second, strict=True))
    assert not np.array_equal(first[0], first[1])


def test_no_landmark_stands_twice_in_a_rendered_picture(monkeypatch: pytest.MonkeyPatch) -> None:
    rooms: list[list[int]] = []

    class Looked(render.Renderer):
        def __init__(self, camera: Camera, marks: list[Landmark], *rest: Any) -> None:
            rooms.append([mark.id for mark in marks])
            super().__init__(camera, marks, *rest)

        def render(self, *_: Any) -> Image:  # the picture itself does not matter here
            return SCENE

    monkeypatch.setattr(render, "Renderer", Looked)
    bench.rendered_set()
    assert len(rooms) == 60
    assert all(len(set(ids)) == 3 and set(ids) <= set(range(1, 16)) for ids in rooms)
    assert {number for ids in rooms for number in ids} == set(range(1, 16))
