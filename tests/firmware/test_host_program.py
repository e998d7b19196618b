"""The host program by its contract: `polepilot-board --link PATH`, in real time, until it is ended.

Nothing here asserts how fast the computer is; times are the board's own.
"""

from __future__ import annotations

import contextlib
import os
import select
import signal
import subprocess
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import pytest
from core.link.conformance import SLACK_MS, Bench, Conformance
from firmware.boards import CHIPS, HOST, StepPort, chip_board, make

from polepilot.core.errors import LinkError
from polepilot.core.link.messages import (
    NO_SENSOR,
    BoardKind,
    BoardState,
    Drive,
    Features,
    Heartbeat,
    Hello,
    Ping,
    Telemetry,
)
from polepilot.core.link.packets import PacketParser
from polepilot.core.link.usb import PortAddress, SerialPort
from polepilot.core.sim.board import BoardInputs
from polepilot.core.sim.board_process import LINK, BoardProcess

Begin = Callable[..., subprocess.Popen[bytes]]


class RealPort:
    """A BoardPort on a serial line, as any program opens it; time is the computer's."""

    def __init__(self, path: Path) -> None:
        self._descriptor = os.open(path, os.O_RDWR | os.O_NOCTTY | os.O_NONBLOCK)
        self._came = bytearray()

    def send(self, data: bytes) -> None:
        assert os.write(self._descriptor, data) == len(data)

    def receive(self) -> bytes:
        data = bytes(self._came)
        self._came.clear()
        return data

    def advance(self, seconds: float) -> None:
        end = time.monotonic() + seconds
        while (rest := end - time.monotonic()) > 0:
            if select.select([self._descriptor], [], [], rest)[0]:
                self._came += os.read(self._descriptor, 4096)

    def close(self) -> None:
        os.close(self._descriptor)


@pytest.fixture
def begin(tmp_path: Path) -> Iterator[Begin]:
    """Starts the program on ``tmp_path / "line"``."""
    make("host", of="host")
    programs: list[subprocess.Popen[bytes]] = []

    def start(*options: str) -> subprocess.Popen[bytes]:
        program = subprocess.Popen([HOST, "--link", str(tmp_path / "line"), *options])
        programs.append(program)
        end = time.monotonic() + 20
        while not (tmp_path / "line").exists():
            assert program.poll() is None
            assert time.monotonic() < end
            time.sleep(0.01)
        return program

    yield start
    for program in programs:
        program.kill()
        program.wait()


@pytest.fixture
def line(tmp_path: Path) -> Path:
    return tmp_path / "line"


@pytest.mark.soak
class TestConformanceInRealTime(Conformance):
    @pytest.fixture
    def port(self, begin: Begin, line: Path) -> Iterator[RealPort]:
        begin()
        port = RealPort(line)
        yield port
        port.close()


def test_without_inputs_it_says_so(begin: Begin, line: Path) -> None:
    begin()
    bench = Bench(RealPort(line))
    about = bench.hello()
    assert about.board is BoardKind.HOST
    assert not about.features & (Features.ENCODERS | Features.PROXIMITY)
    told = bench.telemetry()
    assert told.proximity_mm == (NO_SENSOR, NO_SENSOR, NO_SENSOR)
    assert (told.battery_mv, told.pan_adc) == (12000, 512)


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGINT])
def test_it_ends_cleanly(begin: Begin, line: Path, number: int) -> None:
    program = begin()
    assert line.is_symlink()
    assert str(line.resolve()).startswith("/dev/pts/")
    program.send_signal(number)
    assert program.wait(10) == 0
    assert not line.is_symlink()


def test_an_old_link_is_replaced_and_a_file_is_not(begin: Begin, line: Path) -> None:
    line.symlink_to("/nowhere/at/all")
    begin().terminate()
    end = time.monotonic() + 10
    while line.is_symlink() and time.monotonic() < end:
        time.sleep(0.01)
    line.write_text("precious")
    refused = subprocess.run([HOST, "--link", line], capture_output=True, text=True, check=False)
    assert refused.returncode == 2
    assert refused.stderr.count("\n") == 1
    assert line.read_text() == "precious"


@pytest.mark.parametrize(
    "words",
    [
        [],
        ["--link"],
        ["--link", "x", "more"],
        ["--nonsense"],
        ["--link", "/nowhere/x"],
        ["--link", "x", "--hard-limits", "1,2"],
        ["--link", "x", "--features", "16"],
        ["--link", "x", "--pan-ends", "0,5000"],
    ],
)
def test_bad_usage_is_status_2(words: list[str], tmp_path: Path) -> None:
    make("host", of="host")
    done = subprocess.run(
        [HOST, *words], cwd=tmp_path, capture_output=True, text=True, timeout=10, check=False
    )
    assert done.returncode == 2
    assert done.stderr
    assert list(tmp_path.iterdir()) == []


def test_a_line_that_nobody_reads_does_not_age(begin: Begin, line: Path) -> None:
    """Whoever opens it later hears of now, not of minutes ago."""
    begin()
    time.sleep(1.0)
    first = RealPort(line)
    first.advance(0.1)
    parser = PacketParser()
    stamps = [p.payload[:4] for p in parser.feed(first.receive()) if p.type == 0x83]
    assert parser.errors.total == 0
    assert 0 < len(stamps) < 40
    first.close()


def test_round_trip(begin: Begin, line: Path) -> None:
    """PING by way of a pseudo-terminal; the figures are printed, not asserted."""
    begin()
    port = RealPort(line)
    bench = Bench(port)
    bench.hello()
    parser, trips = PacketParser(), []
    for number in range(300):
        began = time.perf_counter()
        port.send(Ping(number).to_packet(number & 0xFF).encode())
        while not any(packet.type == 0x84 for packet in parser.feed(port.receive())):
            port.advance(0.0001)
            assert time.perf_counter() - began < 10
        trips.append((time.perf_counter() - began) * 1000)
    median, p99 = np.percentile(trips, [50, 99])
    print(f"PING over a pty: median {median:.2f} ms, p99 {p99:.2f} ms")


def test_unplugging_stops_the_wheels_and_wants_arm_again(begin: Begin, line: Path) -> None:
    """The cable is pulled by closing the line; a new handshake finds a board that stands."""
    begin()
    port = RealPort(line)
    moving = Bench(port).armed().drive(400, 400, 0, 0.5)
    if moving.state is BoardState.ARMED:  # unless the computer stood still for 250 ms
        assert moving.duty == (400, 400)
    port.close()
    time.sleep(0.5)
    again = Bench(RealPort(line))
    told = again.telemetry()
    assert (told.state, told.duty) == (BoardState.LINK_LOST, (0, 0))
    assert again.hello().state is BoardState.IDLE
    assert again.drive(400, 400, 0, 0.1).duty == (0, 0)


def test_the_projects_serial_port_finds_it_again(begin: Begin, line: Path) -> None:
    """`SerialPort` on the line, the program ended and started anew meanwhile."""
    program = begin()
    port = SerialPort(PortAddress.parse(str(line)))

    def answered() -> bool:
        parser = PacketParser()
        end = time.monotonic() + 10
        while time.monotonic() < end:
            try:
                port.write(Hello().to_packet(1).encode())
                for chunk in port.read():
                    if any(packet.type == 0x81 for packet in parser.feed(chunk.data)):
                        return True
            except LinkError:
                pass
            time.sleep(0.05)
        return False

    assert answered()
    program.terminate()
    program.wait(10)
    begin()
    assert answered()
    assert port.generation == 2
    port.close()


@pytest.mark.parametrize("seed", [1, 2])
def test_unplugged_at_any_moment_the_wheels_stand_within_300_ms(seed: int) -> None:
    """Fifty moments, in the board's own time: the last byte may cut a packet anywhere."""
    make("host", of="host")
    rng = np.random.default_rng(seed)
    for _ in range(25):
        with contextlib.closing(BoardProcess([str(HOST), "--link", LINK, "--in-step"])) as board:
            unplug(board, rng)


@pytest.mark.soak
@pytest.mark.parametrize("chip", CHIPS)
def test_machine_code_unplugged_at_fifty_moments(chip: str) -> None:
    rng = np.random.default_rng(3)
    for _ in range(50):
        with contextlib.closing(chip_board(chip)) as board:
            unplug(board, rng, 300)


def unplug(board: BoardProcess, rng: np.random.Generator, limit_ms: int = 250 + SLACK_MS) -> None:
    """A chip's line takes a millisecond for each packet: ``limit_ms`` leaves room for those."""
    port = StepPort(board, 0.015)
    port.advance(0.01)
    bench = Bench(port).armed()
    bench.drive(1000, 700, 0, 0.3)
    for _ in range(rng.integers(1, 40)):
        bench.send(Heartbeat() if rng.random() < 0.5 else Drive(1000, 700, 500))
        bench.collect(float(rng.integers(1, 30)) / 1000)
    before, wait_ms = bench.time_ms(), int(rng.integers(0, 20))
    bench.collect(wait_ms / 1000)
    assert board.outputs.left > 0
    last = Drive(1000, 1000, 0).to_packet(9).encode()
    port.send(last[: rng.integers(0, len(last) + 1)])
    standing = [m for m in bench.collect(0.6) if isinstance(m, Telemetry) and m.duty == (0, 0)]
    assert standing[0].t_ms - (before + wait_ms) <= limit_ms
    assert standing[-1].state is BoardState.LINK_LOST
    assert (board.outputs.left, board.outputs.right) == (0, 0)


def test_a_program_that_ends_is_a_link_error(tmp_path: Path) -> None:
    with pytest.raises(LinkError, match=r"cannot be started"):
        BoardProcess([str(tmp_path / "nothing")])
    make("host", of="host")
    with pytest.raises(LinkError, match=r"has ended \(usage"):
        BoardProcess([str(HOST), "--nonsense"])
    board = BoardProcess([str(HOST), "--link", LINK, "--in-step"])
    board._program.kill()
    with pytest.raises(LinkError, match="has ended"):
        board.step(1.0, BoardInputs())
    board.close()
    board.close()
    assert board.transmit() == b""
