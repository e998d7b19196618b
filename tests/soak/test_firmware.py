"""Long campaigns, by ``./run soak``: ten million inputs of nonsense for the firmware's core."""

from __future__ import annotations

import pytest
from firmware.test_core import fuzz

pytestmark = pytest.mark.soak


@pytest.mark.timeout(3600)
@pytest.mark.parametrize("seed", range(100, 110))
def test_nonsense(seed: int) -> None:
    fuzz(seed, 1_000_000)
