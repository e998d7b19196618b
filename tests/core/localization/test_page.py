"""docs/localization.md: its tables are what was measured, its drawings what the code draws."""

from __future__ import annotations

import json
import math
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from paper_figures import claims, table1, two_poles
from paper_figures.__main__ import DOCS, RUN, TABLES, filled, main

from polepilot.core.observation import Detection
from polepilot.core.robot.ports import Sighting

PAGE = (DOCS / "localization.md").read_text("utf-8")
PAPER = json.loads((DOCS / "results" / "paper.json").read_text("utf-8"))


def test_the_tables_of_the_page_are_the_measurements() -> None:
    assert filled(PAGE, DOCS / "results") == PAGE, "PYTHONPATH=tests python -m paper_figures --fill"
    assert set(re.findall(r"<!-- table: ([\w-]+) -->", PAGE)) == set(TABLES)


def test_pictures_and_links_of_the_page_are_there_and_small() -> None:
    links = re.findall(r"\]\(([^)#]+)\)", PAGE)
    assert sum(link.startswith("images/") for link in links) == 3
    for link in links:
        assert (DOCS / link).is_file(), link
        assert (DOCS / link).stat().st_size < 250_000, link


def test_table_1_to_the_last_digit_or_one_beside_it() -> None:
    document = table1.document()
    assert document == PAPER["table1"]
    for name, printed in table1.PRINTED.items():
        for key, step in (("K", 1e-3), ("X", 1e-2), ("P", 1e-3)):
            ours = [row[key] for row in document["axes"][name]]
            assert ours == pytest.approx(list(printed[key]), abs=1.01 * step)
    assert document["gains"]["as printed"] == pytest.approx(1 / 7, abs=1e-3)
    assert document["gains"]["textbook"] == pytest.approx(1 / 3, abs=1e-3)


def test_two_landmarks_leave_one_place() -> None:
    document = two_poles.document()
    assert json.loads(json.dumps(document)) == PAPER["two_poles"]
    off = sorted(abs(one["off_deg"]) for one in document["solutions"])
    assert off[0] == pytest.approx(0, abs=1e-6)
    assert off[1] == pytest.approx(163, abs=0.5)
    right = min(document["solutions"], key=lambda one: abs(one["off_deg"]))
    assert (right["x"], right["y"]) == pytest.approx(two_poles.TRUE.position)
    printed, one_mended, both_mended = document["misprinted"]
    assert printed == pytest.approx((1.5, 2.412), abs=1e-3)
    assert one_mended == pytest.approx((1.5, 0.912), abs=1e-3)
    assert both_mended == pytest.approx(two_poles.TRUE.position)
    # Errors were drawn from the sigmas that the fix was told: 3 numbers, 3 on average.
    assert document["noisy"]["nees_mean"] == pytest.approx(3.0, abs=0.25)


def test_the_drawing_shows_both_places() -> None:
    svg = two_poles.draw().svg()
    assert "R1: " in svg
    assert "R2: " in svg


class Pole:
    """A sensor that sees one landmark five metres away, for ever."""

    def read(self) -> Sighting | None:
        return Sighting(0.0, (Detection(1, 5.0, 0.1, 0, 0, 0, 0.01, 0.001),))

    def expect(self, _: Any) -> None:
        raise AssertionError(self)

    def close(self) -> None:
        raise AssertionError(self)


def test_ranges_as_in_table_2() -> None:
    sensor = claims.TableTwo(Pole(), np.random.default_rng(1))
    errors = []
    for _ in range(5000):
        sighting = sensor.read()
        assert sighting is not None
        (seen,) = sighting.detections
        errors.append(seen.range / 5.0 - 1.0)
    assert np.mean(np.abs(errors)) == pytest.approx(claims.TABLE_2, rel=0.05)
    assert seen.range_sigma / 5.0 == pytest.approx(np.std(errors), rel=0.05)
    printed = [(254, 255), (339, 340), (724, 730), (240, 237), (238, 234), (193, 191)]
    assert np.mean([abs(a / b - 1) for a, b in printed]) == pytest.approx(claims.TABLE_2, abs=1e-4)


def test_a_run_is_measured_picture_by_picture(tmp_path: Path) -> None:
    """A first stretch of the route, with our method in our world."""
    arrived = claims.drive("ours", "ekf", 1, tmp_path / RUN, longest=25.0)
    assert not arrived
    points = list(claims.pictures(tmp_path / RUN / "run.mcap"))
    assert len(points) > 50
    figures = claims.figures(points)
    assert figures["estimated_mean_cm"] < figures["measured_mean_cm"]
    better = 100 * (1 - figures["estimated_mean_cm"] / figures["measured_mean_cm"])
    assert figures["improvement_percent"] == pytest.approx(better)
    assert all(math.isfinite(value) for value in figures.values())


def test_nothing_measured_is_no_table(tmp_path: Path) -> None:
    for make in TABLES.values():
        assert make(tmp_path) == ""
    page = "a\n<!-- table: accuracy -->\nold\n<!-- end -->\nb\n"
    assert filled(page, tmp_path) == "a\n<!-- table: accuracy -->\n<!-- end -->\nb\n"


def test_the_final_accuracy(tmp_path: Path) -> None:
    row = {
        "position_mean_cm": 0.84,
        "position_p95_cm": 1.96,
        "heading_mean_deg": 0.2,
        "heading_p95_deg": 1.3,
        "poses_percent": 96.0,
        "nees_mean": 2.5,
        "nees_inside_percent": 97.25,
    }
    (tmp_path / "localization.json").write_text(json.dumps({"room": row, "another": {}}))
    lines = TABLES["accuracy"](tmp_path).splitlines()
    assert len(lines) == 3
    assert "| 2 / 4.5 → 0.9 / 2 | **0.8 / 2.0** |" in lines[2]
    assert "**0.20 / 1.30** (missed)" in lines[2]
    assert "96.0 % (missed)" in lines[2]
    assert {line.count("|") for line in lines} == {lines[0].count("|")}


def test_one_command_fills_the_page(tmp_path: Path) -> None:
    (tmp_path / "results").mkdir()
    (tmp_path / "results" / "paper.json").write_text(json.dumps(PAPER))
    text = "a\n<!-- table: table1 -->\n<!-- end -->\n<!-- table: claims -->\nx\n<!-- end -->\n"
    (tmp_path / "localization.md").write_text(text)
    main(["--docs", str(tmp_path), "--fill"])
    page = (tmp_path / "localization.md").read_text()
    assert "| x, k = 1 | 130.24 |" in page
    assert "| as our simulator | default |" in page
    assert "\nx\n" not in page
