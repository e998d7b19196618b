"""Long campaigns, by ``./run soak``: 100,000 pictures of nonsense for the eye's kernel."""

from __future__ import annotations

from pathlib import Path

import pytest
from kernel_fuzz import fuzz

from build_hooks import kernel

pytestmark = pytest.mark.soak

ROOT = Path(__file__).parents[2]


@pytest.mark.timeout(3600)
@pytest.mark.parametrize("seed", range(100, 110))
def test_nonsense(tmp_path: Path, seed: int) -> None:
    library = tmp_path / "kernel.so"
    fuzz(library, kernel.build_sanitized(ROOT, library), seed, 10_000)
