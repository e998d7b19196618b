"""Long campaigns, by ``./run soak``: the localizer's final judgement, figures printed.

With ``POLEPILOT_RESULTS=docs/results`` the figures are kept for docs/localization.md; with
``POLEPILOT_RECORDINGS`` a folder keeps the recordings. An hour on two cores, 20 GB of disk.
"""

from __future__ import annotations

import json
import os
from pathlib import Path

import pytest
from recordings.final import FINAL, LIMITS, campaign, missed, table
from recordings.scenario import KINDS

pytestmark = pytest.mark.soak


@pytest.mark.timeout(3 * 3600)
def test_final_recordings(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    keep = Path(os.environ.get("POLEPILOT_RECORDINGS", tmp_path))
    result = campaign(tuple(LIMITS), FINAL, keep)
    folder = os.environ.get("POLEPILOT_RESULTS")
    if folder:
        path = Path(folder) / "localization.json"
        path.write_text(json.dumps(result, indent=1) + "\n")
    with capfd.disabled():
        print(f"\n{table(result)}")
        print("\n".join(["short of the target:", *missed(result, target=True)]))
    assert not missed(result)


@pytest.mark.timeout(3600)
@pytest.mark.parametrize("kind", KINDS)
def test_many_seeds_without_pictures(
    kind: str, tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    """What three recordings cannot tell: twenty, by the detector's errors instead of pictures."""
    kinds = [one for one in KINDS if one == kind]
    result = campaign(kinds, range(100, 120), tmp_path, measured=True)
    with capfd.disabled():
        print(f"\n{table(result)}")
    assert not missed(result)
