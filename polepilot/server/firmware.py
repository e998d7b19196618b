"""The firmware's C core as a program of this computer, built where it is out of date."""

from __future__ import annotations

import shutil
import subprocess
from pathlib import Path

import structlog

from polepilot.core.errors import InputError

FOLDER = Path(__file__).resolve().parents[2] / "firmware"
_PROGRAM = "build/host/polepilot-board"

log = structlog.get_logger("polepilot.firmware")


def host_program(folder: Path = FOLDER) -> Path:
    """The program's path, after ``make -C firmware host``.

    Raises:
        InputError: the sources are not there, as in an installed package, or cannot be compiled.
    """
    if not (folder / "Makefile").is_file():
        raise InputError(
            f"--board host: the firmware's sources are not in {folder}.",
            remedy="Run it from a checkout of the repository.",
        )
    program = folder / _PROGRAM
    if shutil.which("make") is None or shutil.which("cc") is None:
        if program.is_file():
            log.warning("make or cc is missing: the firmware is taken as it was built before")
            return program
        raise InputError(
            "--board host: the firmware has to be compiled, and make or cc is missing.",
            remedy="Install them (Debian: apt-get install make gcc libc6-dev).",
        )
    done = subprocess.run(
        ["make", "-C", str(folder), "host"], capture_output=True, text=True, check=False
    )
    if done.returncode != 0:
        reason = next((line for line in done.stderr.splitlines() if "error" in line), "see make")
        raise InputError(f"--board host: make -C {folder} host has failed: {reason.strip()}")
    return program
