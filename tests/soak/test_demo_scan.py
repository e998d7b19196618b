"""Long campaigns, by ``./run soak``: the demo workshop scanned by rendered pictures, whole."""

from __future__ import annotations

import json
from importlib.resources import files
from pathlib import Path

import pytest

from polepilot.commands.main import run

pytestmark = pytest.mark.soak

DEMO = str(files("polepilot").joinpath("demo/workshop.json"))


@pytest.mark.timeout(1200)
@pytest.mark.parametrize("radius", [None, 0.6])
@pytest.mark.parametrize("seed", [1, 2, 3])
def test_scan_of_the_demo_workshop(
    seed: int, radius: float | None, tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    words = [] if radius is None else ["--min-turn-radius", str(radius)]
    command = ["simulate", DEMO, "--mode", "scan", "--seed", str(seed), "--out", str(tmp_path)]
    assert run([*command, *words, "--json"]) == 0
    result = json.loads(capfd.readouterr().out)
    with capfd.disabled():
        print(seed, radius, json.dumps(result))
    assert result["outcome"] == "done"
    assert result["contacts"] == 0
    assert result["coverage"] >= 0.90
    assert result["position_error"]["mean"] <= 0.04
