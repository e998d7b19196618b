"""The firmware's programs for tests: built when they are asked for, and ports to them."""

from __future__ import annotations

import fcntl
import shutil
import subprocess
from dataclasses import replace
from pathlib import Path

import pytest

from polepilot.core.sim.board import BoardInputs
from polepilot.core.sim.board_process import LINK, BoardProcess

FIRMWARE = Path(__file__).parents[2] / "firmware"
BUILD = FIRMWARE / "build"
HOST = BUILD / "host" / "polepilot-board"
BAUD = 250_000
PIC_BAUD = 115_200
AVRS = ("atmega328p", "atmega2560")
PIC = "pic18f4550"
CHIPS = (*AVRS, PIC)
TOOLS = {
    "host": ("make", "cc"),
    "tests": ("make", "cc"),
    "avr": ("make", "avr-gcc", "avr-objcopy", "avr-size"),
    "simavr": ("make", "cc"),
    "pic": ("make", "gcc", "g++", "bison", "flex", "dpkg-source", "gpasm", "gplink"),
    "gpsim": ("make", "cc", "c++", "pkg-config", "gpsim"),
    "check": ("make", "cc", "cppcheck"),
}
PACKAGES = (
    "make gcc libc6-dev gcc-avr avr-libc simavr libsimavr-dev libelf-dev cppcheck gpsim-dev "
    "libglib2.0-dev pkg-config g++ bison flex libboost-dev zlib1g-dev dpkg-dev gputils"
)
NOTHING_NEAR = (1500, 1500, 1500)


def make(*targets: str, of: str) -> str:
    """``make -C firmware targets``; what it said. One at a time, for tests run side by side."""
    missing = [tool for tool in TOOLS[of] if shutil.which(tool) is None]
    if missing:
        pytest.fail(f"{missing} missing: use ./run test, or apt-get install {PACKAGES}")
    BUILD.mkdir(exist_ok=True)
    with (BUILD / "lock").open("w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        done = subprocess.run(
            ["make", "-C", str(FIRMWARE), *targets],
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
            check=False,
        )
    assert done.returncode == 0, done.stdout[-6000:]
    return done.stdout


def host_board() -> BoardProcess:
    """The C core as a Linux program, in step with the test."""
    make("host", of="host")
    return BoardProcess([str(HOST), "--link", LINK, "--in-step", "--features", "14"])


def avr_board(chip: str) -> BoardProcess:
    """The machine code for ``chip`` in simavr."""
    make(chip, of="avr")
    make("simavr", of="simavr")
    program = BUILD / "simavr" / "polepilot-board"
    return BoardProcess([str(program), LINK, chip, str(BUILD / chip / "polepilot.elf"), str(BAUD)])


def pic_board() -> BoardProcess:
    """The machine code for the PIC18F4550 in gpsim."""
    make("pic", of="pic")
    make("gpsim", of="gpsim")
    program = BUILD / "gpsim" / "polepilot-board"
    built = BUILD / PIC / "polepilot.hex"
    lines = (line.split() for line in built.with_suffix(".map").read_text("utf-8").splitlines())
    main_loop = next(words[1] for words in lines if words[:1] == ["_board_pass"])
    return BoardProcess([str(program), LINK, str(built), main_loop, str(PIC_BAUD)])


def chip_board(chip: str) -> BoardProcess:
    """The machine code for ``chip`` in its emulator."""
    return pic_board() if chip == PIC else avr_board(chip)


class StepPort:
    """A port for the conformance suite: the board's time goes on as the test says.

    Args:
        settle: seconds that the board may need to notice its pins.
    """

    def __init__(self, board: BoardProcess, settle: float = 0.002) -> None:
        self.board = board
        self.inputs = BoardInputs(proximity_mm=NOTHING_NEAR)
        self._settle = settle
        self._ticks = 0

    @property
    def now(self) -> float:
        return self._ticks * 0.001

    def send(self, data: bytes) -> None:
        self.board.receive(data, self.now)

    def receive(self) -> bytes:
        return self.board.transmit()

    def advance(self, seconds: float) -> None:
        """In steps after which the serial line's buffer is far from full."""
        rest = round(seconds / 0.001)
        while rest > 0:
            step = min(rest, 500)
            rest -= step
            self._ticks += step
            self.board.step(self.now, self.inputs)

    def set_pins(
        self,
        *,
        pan_adc: int | None = None,
        proximity_mm: tuple[int, int, int] | None = None,
        battery_mv: int | None = None,
        stop_button: bool | None = None,
    ) -> None:
        pins = {
            "pan_adc": pan_adc,
            "proximity_mm": proximity_mm,
            "battery_mv": battery_mv,
            "stop_button": stop_button,
        }
        self.inputs = replace(self.inputs, **{k: v for k, v in pins.items() if v is not None})
        self.advance(self._settle)

    def pan_output(self) -> int:
        return self.board.outputs.pan
