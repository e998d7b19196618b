"""The plan command: its document, its drawing, its refusals."""

from __future__ import annotations

import json
import math
import xml.etree.ElementTree as ET
from pathlib import Path

import pytest
import typer
from typer.testing import CliRunner

from polepilot.commands.plan import plan
from polepilot.core.errors import InputError

DEMO = str(Path(__file__).parents[2] / "polepilot" / "demo" / "workshop.json")

app = typer.Typer()
app.command()(plan)


def run(*words: str) -> str:
    result = CliRunner().invoke(app, list(words), catch_exceptions=False)
    assert result.exit_code == 0
    return result.stdout


def test_scan_document(tmp_path: Path) -> None:
    drawing = tmp_path / "plan.svg"
    document = json.loads(
        run(DEMO, "--mode", "scan", "--min-turn-radius", "0", "--plot", str(drawing), "--json")
    )
    assert len(document["gear"]) == len(document["path"]) - 1
    assert document["path"][0] == [1.0, 1.2]
    assert document["parts"][0]["first"] == 0
    assert document["parts"][-1]["last"] == len(document["path"]) - 1
    assert document["predicted"]["coverage"] > 0.98
    assert document["predicted"]["reversals"] == 0
    assert document["runtime"] > 0
    root = ET.parse(drawing).getroot()
    assert root.tag.endswith("svg")
    assert len(list(root.iter())) > 40


def test_default_turning_radius_and_start() -> None:
    document = json.loads(run(DEMO, "--start", "4,1,3.1", "--json"))
    assert document["path"][0] == [4.0, 1.0]
    assert document["predicted"]["reversals"] > 0
    assert document["predicted"]["coverage"] > 0.97


def test_route_and_summary() -> None:
    document = json.loads(run(DEMO, "--mode", "route", "--route", "Tour", "--json"))
    assert [part["kind"] for part in document["parts"]] == ["route"]
    text = run(DEMO, "--mode", "route", "--route", "Tour")
    assert "length" in text
    assert "coverage" not in text
    assert "coverage" in run(DEMO, "--min-turn-radius", "0")


def test_the_heading_at_the_end_of_a_route() -> None:
    words = (DEMO, "--mode", "route", "--route", "Tour", "--min-turn-radius", "0", "--json")
    for heading in (0.0, -2.0):
        document = json.loads(run(*words, "--end-heading", str(heading)))
        (x0, y0), (x1, y1) = document["path"][-2:]
        assert math.atan2(y1 - y0, x1 - x0) == pytest.approx(heading, abs=0.01)


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["nowhere.json"], "cannot be read"),
        ([DEMO, "--mode", "route"], "--route is missing: the site's routes are 'Tour'"),
        ([DEMO, "--mode", "route", "--route", "X"], f"^{DEMO}: route 'X' is not on the site"),
        ([DEMO, "--clearance", "9"], f"^{DEMO}: the robot fits nowhere .* clearance of 900 cm"),
        ([DEMO, "--start", "99,1"], f"^{DEMO}: the start .* is not on the floor"),
        ([DEMO, "--route", "Tour"], "expected --mode route"),
        ([DEMO, "--end-heading", "1"], "--end-heading is given with --mode scan"),
        ([DEMO, "--start", "1;2"], "--start is '1;2'"),
        ([DEMO, "--start", "nan,2"], "expected X,Y"),
        ([DEMO, "--tool-width", "nan"], "^--tool-width is nan"),
        ([DEMO, "--clearance", "-1"], "^--clearance is -1"),
        ([DEMO, "--min-turn-radius", "0", "--plot", "/nowhere/x.svg"], "cannot be written"),
    ],
)
def test_refusals(words: list[str], message: str) -> None:
    with pytest.raises(InputError, match=message):
        CliRunner().invoke(app, words, catch_exceptions=False)
