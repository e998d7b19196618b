"""The precision command: its document, its drawings, its refusals."""

from __future__ import annotations

import json
import xml.etree.ElementTree as ET
from pathlib import Path

import cv2
import numpy as np
import pytest

from polepilot.commands.main import run
from polepilot.commands.precision_plot import HEAT, draw, labels, png_bytes
from polepilot.core.localization.precision import precision_map
from polepilot.core.localization.precision_grid import CLASSES
from polepilot.core.localization.precision_suggest import suggest
from polepilot.core.site import read_site

DEMO = Path(__file__).parents[2] / "polepilot" / "demo" / "workshop.json"


def answer(capfd: pytest.CaptureFixture[str], *words: str) -> str:
    assert run(["precision", str(DEMO), *words]) == 0
    return capfd.readouterr().out


def test_document(capfd: pytest.CaptureFixture[str]) -> None:
    document = json.loads(answer(capfd, "--resolution", "0.5", "--suggest", "2", "--json"))
    assert (document["columns"], document["rows"], document["resolution"]) == (16, 12, 0.5)
    for key in ("position", "heading", "share", "seen", "reason"):
        assert [len(row) for row in document[key]] == [16] * 12
    values = [value for row in document["position"] for value in row if value is not None]
    assert 0.004 < min(values) < document["mean_position"] < max(values) < 0.06
    assert max(values) == pytest.approx(document["worst_position"], abs=1e-4)
    more = document["suggest"]
    assert len(more["suggestions"]) == 2
    assert more["suggestions"][1]["overall"] < more["before"]["overall"]
    assert more["overall_bound"] < more["suggestions"][1]["overall"]


def test_for_people(capfd: pytest.CaptureFixture[str]) -> None:
    text = answer(capfd, "--suggest", "1")
    assert "cm on average" in text
    assert "at (" in text
    assert "too much in one direction" in text


def test_the_camera_of_the_robot_counts(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    config = tmp_path / "robot.toml"
    config.write_text("[pan]\nminimum_rad = -1.0\nmaximum_rad = 1.0\n")
    narrow = json.loads(answer(capfd, "--config", str(config), "--json"))
    assert narrow["coverage"] < json.loads(answer(capfd, "--json"))["coverage"] - 0.05


def test_fine_is_finer(capfd: pytest.CaptureFixture[str]) -> None:
    assert json.loads(answer(capfd, "--fine", "--json"))["resolution"] <= 0.06


def test_drawings(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    for name in ("map.svg", "map.PNG"):
        answer(capfd, "--suggest", "2", "--plot", str(tmp_path / name))
    root = ET.parse(tmp_path / "map.svg").getroot()
    words = [element.text for element in root.iter() if element.tag.endswith("text")]
    assert {"1", "14", "+1", "+2", "< 0.5", "0.5-0.75", "3-6", "no fix here"} <= set(words)
    image = cv2.imread(str(tmp_path / "map.PNG"))
    assert image is not None
    assert image.shape[1] == 1600


def test_the_picture_shows_the_map() -> None:
    """Colours of the PNG where single spots are, against the map's own figures."""
    site = read_site(DEMO)
    found = precision_map(site, resolution=0.25)
    image = cv2.imdecode(np.frombuffer(png_bytes(draw(site, found)), np.uint8), cv2.IMREAD_COLOR)
    assert image is not None
    right = 0
    cells = np.argwhere(found.fixed & (found.share > 0.5) & (found.weight == 1))
    for row, column in cells:
        x, y = found.x + column * 0.25, found.y + row * 0.25
        pixel = image[round(8 * (8 + (6 - y) * 23)), round(8 * (8 + x * 23))]
        color = HEAT[int(np.searchsorted(CLASSES, found.position[row, column]))]
        expected = [int(color[i : i + 2], 16) for i in (5, 3, 1)]
        right += bool(np.abs(pixel.astype(int) - expected).max() <= 1)
    assert right > 0.95 * len(cells)  # landmarks, their numbers and walls stand on the others


def test_labels_name_every_colour() -> None:
    assert len(labels(0.06)) == len(HEAT) == len(CLASSES) + 1


def test_a_site_without_landmarks_is_drawn() -> None:
    site = read_site(DEMO)
    bare = type(site)(site.boundary, "Bare")
    sheet = draw(bare, precision_map(bare), suggest(bare, 2))
    assert any("no fix anywhere" in getattr(item, "words", "") for item in sheet.items)


@pytest.mark.parametrize(
    ("words", "expected"),
    [
        (["--plot", "map.jpg"], ".svg or .png"),
        (["--resolution", "0"], "--resolution"),
        (["--resolution", "0.001"], "--resolution"),
        (["--resolution", "1", "--fine"], "--fine and --resolution"),
        (["--suggest", "21"], "--suggest"),
        (["--suggest", "-1"], "--suggest"),
        (["--suggest", "0"], "expected 1 to 20 landmarks"),
        (["--suggest", "9"], "ids left"),
        (["--plot", "/nowhere/map.svg"], "--plot"),
        (["--config", "missing.toml"], "missing.toml"),
    ],
)
def test_refusals(words: list[str], expected: str, capfd: pytest.CaptureFixture[str]) -> None:
    assert run(["precision", str(DEMO), *words]) == 2
    error = capfd.readouterr().err
    assert expected in error
    assert error.count("\n") == 1


def test_a_file_that_is_no_site(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "site.json"
    path.write_text("{}")
    assert run(["precision", str(path)]) == 2
    assert "boundary is missing" in capfd.readouterr().err
