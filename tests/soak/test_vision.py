"""Long campaigns, by ``./run soak``: the detector's final judgement, figures printed.

With ``POLEPILOT_RESULTS=docs/results`` the figures are kept for docs/vision.md. An hour or two on
two cores.
"""

from __future__ import annotations

import os
from pathlib import Path

import pytest
from scenes.campaign import table
from scenes.final import campaign, missed, write

pytestmark = pytest.mark.soak


@pytest.mark.timeout(6 * 3600)
@pytest.mark.parametrize("program", ["studio", "darkroom"])
def test_final_set(program: str, capfd: pytest.CaptureFixture[str]) -> None:
    results = campaign(program)
    folder = os.environ.get("POLEPILOT_RESULTS")
    with capfd.disabled():
        for detector, result in results.items():
            print(f"\n{program}, {detector}\n{table(result)}")
            if folder:
                write(result, Path(folder), program, detector)
    ours, papers = results["default"], results["paper"]
    assert not missed(ours)
    for family, row in papers.items():
        assert ours[family].get("read", 0) >= row.get("read", 0), family
