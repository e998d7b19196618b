"""docs/planning.md: its tables are what was measured, its pictures are what the code draws."""

from __future__ import annotations

import json
import re
from pathlib import Path
from xml.etree import ElementTree

from plans.report import DOCS, PENDING, RESULTS, TABLES, filled
from plans.sets import FINAL

PAGE = (DOCS / "planning.md").read_text("utf-8")


def test_the_tables_of_the_page_are_the_measurements() -> None:
    assert filled(PAGE) == PAGE, "PYTHONPATH=tests python -m plans.report"
    assert set(re.findall(r"<!-- table: ([\w-]+) -->", PAGE)) == set(TABLES)


def test_the_measurements_are_of_the_whole_final_set() -> None:
    measured = json.loads((RESULTS / "plans.json").read_text())
    assert list(measured) == ["0", "0.6"]
    for rows in measured.values():
        assert [row["map"] for row in rows] == list(FINAL)
    assert f"{len(FINAL)} maps" in PAGE


def test_pictures_and_links_of_the_page_are_there_and_small() -> None:
    links = re.findall(r"\]\(([^)#]+)\)", PAGE)
    pictures = [link for link in links if link.startswith("images/")]
    assert len(pictures) >= 4
    for link in links:
        path = DOCS / link
        assert path.exists(), link
        if link in pictures:
            assert path.stat().st_size < 400_000
            ElementTree.parse(path)


def test_modules_that_the_page_names_exist() -> None:
    root = DOCS.parent
    for name in re.findall(r"`((?:core|tests)/[\w/]+\.py)`", PAGE):
        assert (root / name).exists() or (root / "polepilot" / name).exists(), name


def test_a_page_without_measurements_says_so(tmp_path: Path) -> None:
    assert PENDING in filled(PAGE, tmp_path)
