"""Long campaigns, by ``./run soak``: ten million inputs of nonsense for the firmware's core, and
ten minutes of libFuzzer, which finds its own."""

from __future__ import annotations

import subprocess
from pathlib import Path

import pytest
from firmware.boards import BUILD, make
from firmware.test_core import fuzz

pytestmark = pytest.mark.soak


@pytest.mark.timeout(3600)
@pytest.mark.parametrize("seed", range(100, 110))
def test_nonsense(seed: int) -> None:
    fuzz(seed, 1_000_000)


@pytest.mark.timeout(3600)
def test_libfuzzer(tmp_path: Path) -> None:
    make("libfuzzer", of="tests")
    done = subprocess.run(
        [BUILD / "tests" / "libfuzzer", "-max_total_time=600", "-max_len=600", "-seed=1", tmp_path],
        cwd=tmp_path,
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr[-6000:]
    print(done.stderr.splitlines()[-1])
