"""Nonsense thrown at the eye's kernel, built to stop at every wrong access."""

from __future__ import annotations

from pathlib import Path

from kernel_fuzz import fuzz

from build_hooks import kernel

ROOT = Path(__file__).parents[3]


def test_nonsense_is_looked_at_without_a_wrong_access(tmp_path: Path) -> None:
    library = tmp_path / "kernel.so"
    fuzz(library, kernel.build_sanitized(ROOT, library), seed=1, count=600)
