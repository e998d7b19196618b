"""The core in C: its unit tests, the shared vectors and a sample of nonsense, with sanitizers; the
compiler's analyzer and cppcheck; how much of each chip is taken."""

from __future__ import annotations

import re
import subprocess

import pytest
from firmware.boards import BUILD, CHIPS, FIRMWARE, PIC, make


def test_unit_tests_and_vectors() -> None:
    said = make("test", of="tests")
    checks = re.search(r"^core: (\d+) checks$", said, re.MULTILINE)
    assert checks is not None
    assert int(checks[1]) > 10_000
    assert "vectors: 2000 packets, 1500 streams, 500 boards" in said


@pytest.mark.parametrize("seed", [1, 2])
def test_nonsense(seed: int) -> None:
    fuzz(seed, 10_000)


def fuzz(seed: int, count: int) -> None:
    make("fuzz", of="tests")
    done = subprocess.run(
        [BUILD / "tests" / "fuzz", str(seed), str(count)],
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr[-6000:]
    figures = re.fullmatch(r"fuzz: (\d+) inputs, (\d+) ended armed, (\d+) moving\n", done.stdout)
    assert figures is not None
    inputs, armed, moving = map(int, figures.groups())
    assert inputs == count
    assert armed > count / 50, "so few get through that nothing is tested"
    assert moving > count / 500


def test_analyzer_and_cppcheck_are_content() -> None:
    make("check", of="check")


def test_each_deviation_from_misra_is_told_with_its_reason() -> None:
    rules = re.findall(
        r"^misra-c2012-([\d.]+)", (FIRMWARE / "tests/misra.txt").read_text(), re.MULTILINE
    )
    page = (FIRMWARE / "README.md").read_text("utf-8")
    told = re.findall(r"^\| (\d+\.\d+) \| [^|]+ \| [^|]{20,} \|$", page, re.MULTILINE)
    assert len(rules) >= 1
    assert sorted(told) == sorted(rules)


def test_what_the_stand_ins_name_is_what_the_compilers_name() -> None:
    """A register's name that only tests/xc8 had would compile nowhere else."""
    names = re.findall(
        r"REGISTER\(0x\w+, (\w+)\)", (FIRMWARE / "hal/pic18f4550/registers.h").read_text()
    )
    stand_in = (FIRMWARE / "tests/xc8/xc.h").read_text()
    declared = re.findall(r"\b[A-Z]\w+\b", " ".join(re.findall(r"uint8_t (.*);", stand_in)))
    assert sorted(names) == sorted(declared)


@pytest.mark.parametrize("chip", CHIPS)
def test_half_of_the_chip_is_free(chip: str) -> None:
    said = make(chip, of="pic" if chip == PIC else "avr")
    shares = re.search(
        rf"^{chip}: flash \d+ of \d+ bytes \((\d+) %\), RAM \d+ of \d+ bytes \((\d+) %\)$",
        said,
        re.MULTILINE,
    )
    assert shares is not None, said
    assert max(map(int, shares.groups())) <= 50
