"""Long campaigns, by ``./run soak``: plans on the final set of maps, on random maps, on bad sites.

With ``POLEPILOT_RESULTS=docs/results`` the figures are kept for docs/planning.md. A quarter of an
hour on two cores.
"""

from __future__ import annotations

import json
import os
from pathlib import Path

import numpy as np
import pytest
from plans import fuzz, growth
from plans.final import CLEARANCE, TOOL, campaign, missed, planned, table
from plans.scorer import judge
from plans.sets import FINAL, by_lot

pytestmark = pytest.mark.soak


@pytest.mark.timeout(3600)
def test_final_set(capfd: pytest.CaptureFixture[str]) -> None:
    result = campaign(list(FINAL), dev=False)
    if folder := os.environ.get("POLEPILOT_RESULTS"):
        (Path(folder) / "plans.json").write_text(json.dumps(result, indent=1) + "\n")
    with capfd.disabled():
        for radius, rows in result.items():
            print(f"\nturning radius {radius} m\n{table(rows)}")
    assert not missed(result)


@pytest.mark.timeout(3600)
@pytest.mark.parametrize("radius", [0.0, 0.6])
def test_random_maps_touch_nothing_and_can_be_driven(radius: float) -> None:
    for seed in range(60):
        site = by_lot(np.random.default_rng(70_000 + seed))
        found = judge(f"{seed}", site, planned(site, radius), TOOL, CLEARANCE, radius)
        assert found.contacts == 0, found
        assert found.corners == 0, found
        assert found.crooked == 0, found
        assert found.parts, found
        assert found.coverage >= 99.0, found


@pytest.mark.timeout(2 * 3600)
def test_bad_sites_are_refused_or_planned_on(capfd: pytest.CaptureFixture[str]) -> None:
    wrong = []
    for seed in range(2_000):
        found = fuzz.outcome(seed)
        if words := fuzz.wrong_with(found):
            wrong.append(f"seed {seed} ({found.kind}) {words}")
    assert not wrong


@pytest.mark.timeout(1800)
def test_time_grows_with_the_size(capfd: pytest.CaptureFixture[str]) -> None:
    result = growth.measured()
    if folder := os.environ.get("POLEPILOT_RESULTS"):
        (Path(folder) / "plan-growth.json").write_text(json.dumps(result, indent=1) + "\n")
    with capfd.disabled():
        print(f"\n{growth.table(result)}")
    for row in result.values():
        assert row["exponent"] <= growth.LARGEST_EXPONENT
