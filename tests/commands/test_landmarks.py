"""`landmarks print` and `landmarks ids` as people call them."""

from __future__ import annotations

import json
import os
from pathlib import Path

import cv2
import numpy as np
import pytest
from printed import read_pdf, read_svg, rulers

from polepilot.commands.main import run
from polepilot.core.landmark import SUPPORTED_BITS, id_set, parse_ids, spacing
from polepilot.core.vision.paint import COLOURS, Paint

DOCS = Path(__file__).parents[2] / "docs"


@pytest.fixture(autouse=True)
def _here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)


def left_over() -> list[str]:
    return sorted(str(path) for path in Path().rglob("*"))


def test_the_contract(capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["landmarks", "print", "--ids", "1-15", "--out", "a.pdf"]) == 0
    out, err = capsys.readouterr()
    assert err == ""
    assert "60 of A4 with landmarks 1-15, 4 parts each" in out
    assert "30 of A3" in out
    sheets = read_pdf(Path("a.pdf").read_bytes())
    assert len(sheets) == 61
    for sheet in sheets:
        assert rulers(sheet) == [pytest.approx(100, abs=1e-3)]
    again = ["landmarks", "print", "--ids", "1-15", "--bits", "4", "--paper", "A4"]
    assert run([*again, "--out", "b.PDF"]) == 0
    assert Path("a.pdf").read_bytes() == Path("b.PDF").read_bytes()
    assert left_over() == ["a.pdf", "b.PDF"]


def test_svg_is_a_file_per_sheet(capsys: pytest.CaptureFixture[str]) -> None:
    words = ["landmarks", "print", "--ids", "3,9", "--shape", "flat", "--out", "poles.svg"]
    assert run([*words, "--segment", "0.2", "--diameter", "0.1"]) == 0
    out = capsys.readouterr().out
    names = left_over()
    assert names[0] == "poles-01.svg"
    assert len(names) > 9
    assert f"poles-01.svg to {names[-1]}" in out
    for name in names:
        assert rulers(read_svg(Path(name).read_text("utf-8"))) == [pytest.approx(100)]


def test_json_is_one_document(capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["landmarks", "print", "--bits", "5", "--out", "a.pdf", "--json"]) == 0
    out, err = capsys.readouterr()
    assert err == ""
    document = json.loads(out)
    assert document["files"] == ["a.pdf"]
    assert document["sheets"] == len(read_pdf(Path("a.pdf").read_bytes()))
    assert document["spacing"] == 2
    assert len(document["ids"]) == 16
    assert document["parts"] > 1
    assert run(["landmarks", "print", "--ids", "7", "--out", "a.pdf", "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["spacing"] is None


def test_colours_are_as_asked(capsys: pytest.CaptureFixture[str]) -> None:
    colors = ["--bright", "#ffffff", "--dark", "#102030"]
    assert run(["landmarks", "print", "--ids", "1", *colors, "--out", "a.svg"]) == 0
    sheet = read_svg(Path("a-2.svg").read_text("utf-8"))
    assert {color for _, color in sheet.boxes} == {(1, 1, 1), (16 / 255, 32 / 255, 48 / 255)}


@pytest.mark.parametrize(
    "bright", [*COLOURS, " Green ", "#00A041", "#808080", "#a08080", "#303030", "beige", "#12", ""]
)
def test_bright_is_what_detect_takes(bright: str, capsys: pytest.CaptureFixture[str]) -> None:
    cv2.imwrite("a.png", np.zeros((30, 40, 3), np.uint8))
    taken = run(["detect", "a.png", "--bright", bright])
    told = capsys.readouterr().err
    assert run(["landmarks", "print", "--ids", "1", "--bright", bright, "--out", "a.svg"]) == taken
    assert capsys.readouterr().err == told
    if bright in COLOURS:
        assert taken == 0
        sheet = read_svg(Path("a-2.svg").read_text("utf-8"))
        printed = {tuple(round(255 * c) for c in color) for _, color in sheet.boxes}
        assert Paint.parse(bright).bgr[::-1] in printed


def test_orange_is_printed_with_the_printers_own_inks() -> None:
    written = []
    for number, options in enumerate([[], ["--bright", "orange"], ["--bright", "#FF6600"]]):
        out = Path(f"{number}.pdf")
        assert run(["landmarks", "print", "--ids", "1", *options, "--out", str(out)]) == 0
        written.append(out.read_bytes())
    assert written[0] == written[1] == written[2]
    assert run(["landmarks", "print", "--ids", "1", "--bright", "red", "--out", "r.pdf"]) == 0
    assert Path("r.pdf").read_bytes() != written[0]


@pytest.mark.parametrize(("ids", "warned"), [("1-5", True), ("1,2,4", False), ("9", False)])
def test_ids_that_are_too_near_are_said(
    ids: str, warned: bool, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run(["landmarks", "print", "--ids", ids, "--bits", "5", "--out", "a.pdf"]) == 0
    err = capsys.readouterr().err
    assert err.count("\n") == warned
    assert ("--ids safe" in err) == warned


def test_the_better_set_has_as_many_ids(capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["landmarks", "print", "--ids", "1-6", "--bits", "6", "--out", "a.pdf"]) == 0
    err = capsys.readouterr().err
    assert "--ids safe --count 6" in err
    ids = [int(text) for text in err[err.index("(") + 1 : err.index(")")].split(",")]
    assert len(ids) == 6
    assert spacing(ids, 6) == 3
    safe = ["--ids", "safe", "--count", "6", "--bits", "6"]
    assert run(["landmarks", "print", *safe, "--out", "a.pdf", "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["ids"] == ids


@pytest.mark.parametrize(
    ("options", "named"),
    [
        (["--paper", "A9"], "--paper"),
        (["--paper", "10x10"], "--paper"),
        (["--ids", "0-3"], "--ids"),
        (["--ids", "1-16"], "--ids"),
        (["--ids", ""], "--ids"),
        (["--ids", "3-1"], "--ids"),
        (["--ids", "1-3", "--count", "2"], "--count"),
        (["--count", "9"], "--count"),
        (["--count", "0"], "--count"),
        (["--bits", "7"], "--bits"),
        (["--bits", "999999999"], "--bits"),
        (["--segment", "0"], "--segment"),
        (["--segment", "nan"], "--segment"),
        (["--diameter", "11"], "--diameter"),
        (["--diameter", "-0.07"], "--diameter"),
        (["--diameter", "inf"], "--diameter"),
        (["--diameter", "9"], "sheets of A4"),
        (["--shape", "cone"], "--shape"),
        (["--overlap", "1"], "--overlap"),
        (["--bright", "beige"], "--bright"),
        (["--bright", "#a08080"], "--bright"),
        (["--dark", "#12345"], "--dark"),
        (["--bright", "#000000"], "--bright"),
        (["--out", "a.png"], "--out"),
        (["--out", "pdf"], "--out"),
        (["--out", "missing/a.pdf"], "--out missing/a.pdf"),
        (["--out", "missing/a.svg"], "--out missing/a-01.svg"),
        (["--out", "x" * 300 + ".pdf"], "--out"),
    ],
)
def test_bad_input_is_one_line_and_no_file(
    options: list[str], named: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run(["landmarks", "print", "--out", "a.pdf", *options]) == 2
    out, err = capsys.readouterr()
    assert out == ""
    assert err.count("\n") == 1
    assert named in err
    assert left_over() == []


def test_a_folder_in_the_way(capsys: pytest.CaptureFixture[str]) -> None:
    Path("a.pdf").mkdir()
    assert run(["landmarks", "print", "--out", "a.pdf"]) == 2
    assert "not a file" in capsys.readouterr().err
    Path("b-05.svg").mkdir()
    assert run(["landmarks", "print", "--out", "b.svg"]) == 2
    assert "b-05.svg" in capsys.readouterr().err
    assert left_over() == ["a.pdf", "b-05.svg"]


def test_an_old_file_stays_where_the_new_one_fails(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    Path("a.pdf").write_bytes(b"old")

    def full(self: Path, data: bytes) -> int:
        with self.open("wb") as file:
            file.write(data[:100])
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(Path, "write_bytes", full)
    assert run(["landmarks", "print", "--out", "a.pdf"]) == 2
    assert "No space left" in capsys.readouterr().err
    assert Path("a.pdf").read_bytes() == b"old"
    assert left_over() == ["a.pdf"]


def test_a_link_is_followed_and_the_umask_holds() -> None:
    Path("real").mkdir()
    Path("a.pdf").symlink_to(Path("real/b.pdf"))
    before = os.umask(0o027)
    try:
        assert run(["landmarks", "print", "--ids", "1", "--out", "a.pdf"]) == 0
    finally:
        os.umask(before)
    assert Path("a.pdf").is_symlink()
    assert Path("real/b.pdf").read_bytes().startswith(b"%PDF")
    assert Path("real/b.pdf").stat().st_mode & 0o777 == 0o640


@pytest.mark.parametrize(
    ("options", "count", "apart"),
    [
        ([], 16, 2),
        (["--bits", "4"], 8, 2),
        (["--count", "4"], 4, 3),
        (["--bits", "8", "--count", "16"], 16, 4),
        (["--bits", "8", "--count", "17"], 17, 3),
        (["--bits", "8", "--distance", "3"], 20, 3),
        (["--bits", "6", "--distance", "1"], 63, 1),
        (["--bits", "6", "--distance", "3", "--count", "5"], 5, 3),
    ],
)
def test_recommended_ids(
    options: list[str], count: int, apart: int, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run(["landmarks", "ids", *options]) == 0
    first, second = capsys.readouterr().out.splitlines()
    assert len(first.split(",")) == count
    assert f"{count} ids" in second
    assert f"differ in {apart} segment" in second
    assert run(["landmarks", "ids", *options, "--json"]) == 0
    document = json.loads(capsys.readouterr().out)
    assert document["ids"] == [int(text) for text in first.split(",")]
    assert document["spacing"] == spacing(document["ids"], document["bits"]) == apart


@pytest.mark.parametrize(
    "options",
    [
        ["--bits", "3"],
        ["--distance", "5"],
        ["--distance", "0"],
        ["--count", "17"],
        ["--distance", "3", "--count", "5"],
        ["--distance", "3", "--count", "0"],
    ],
)
def test_impossible_sets(options: list[str], capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["landmarks", "ids", *options]) == 2
    out, err = capsys.readouterr()
    assert out == ""
    assert err.startswith("--")
    assert err.count("\n") == 1
    assert "expected" in err


def test_the_pictures_of_the_docs_are_what_is_printed() -> None:
    """Mend them with the command that stands below them in docs/landmarks.md."""
    assert run(["landmarks", "print", "--ids", "13", "--shape", "flat", "--out", "a.svg"]) == 0
    for number in (1, 2):
        committed = (DOCS / "images" / f"landmark-{number}.svg").read_text("utf-8")
        assert Path(f"a-{number}.svg").read_text("utf-8") == committed


def test_the_table_of_the_docs_is_true() -> None:
    page = (DOCS / "landmarks.md").read_text("utf-8")
    rows = [line.strip("| ").split(" | ") for line in page.splitlines() if line[:4] in ROWS]
    table = {int(row[0]): row[1:] for row in rows if len(row) == 5 and "cm" not in row[1]}
    assert set(table) == set(SUPPORTED_BITS)
    for bits, cells in table.items():
        for distance, cell in enumerate(cells, start=1):
            size, _, listed = cell.partition(": ")
            assert int(size) == len(id_set(bits, distance))
            if listed:
                assert parse_ids(listed, bits) == id_set(bits, distance)


ROWS = {f"| {bits} " for bits in SUPPORTED_BITS}
