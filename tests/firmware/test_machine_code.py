"""What only machine code can show: the watchdog, a loss of power, the line's pace, in simavr
and gpsim."""

from __future__ import annotations

from collections.abc import Iterator

import pytest
from core.link.conformance import Bench
from firmware.boards import CHIPS, StepPort, chip_board

from polepilot.core.link.messages import (
    Arm,
    BoardKind,
    BoardState,
    Clear,
    Drive,
    Faults,
    Heartbeat,
    Pan,
    Telemetry,
)
from polepilot.core.link.packets import PacketParser
from polepilot.core.sim.board import BoardOutputs

STILL = BoardOutputs(0, 0, 0, 0)


@pytest.fixture(params=CHIPS)
def port(request: pytest.FixtureRequest) -> Iterator[StepPort]:
    board = chip_board(request.param)
    port = StepPort(board, 0.015)
    port.advance(0.01)
    yield port
    board.close()


def test_kind(port: StepPort, request: pytest.FixtureRequest) -> None:
    chip = request.node.callspec.params["port"]
    assert Bench(port).hello().board is BoardKind[chip.upper()]


def test_pins_do_what_telemetry_says(port: StepPort) -> None:
    bench = Bench(port).armed()
    bench.ask(Pan(-600))
    for left, right, steering in ((800, -300, 2000), (-1000, 1000, -4500), (55, 0, 7)):
        told = bench.drive(left, right, steering, 1.2)
        pins = port.board.outputs
        assert (told.duty, told.steering) == ((left, right), steering)
        assert pins.left == pytest.approx(left, abs=4)
        assert pins.right == pytest.approx(right, abs=4)
        assert pins.steering == pytest.approx(steering, abs=5)


def test_pins_are_off_until_hello(port: StepPort) -> None:
    port.send(Drive(1000, 1000, 4500).to_packet(1).encode() + Arm().to_packet(2).encode())
    for _ in range(100):
        port.advance(0.002)
        assert port.board.outputs == STILL


@pytest.mark.parametrize("after_ms", [0, 3, 61, 117])
def test_a_hung_main_loop_resets_and_the_pins_are_safe(port: StepPort, after_ms: int) -> None:
    """Interrupts go on, as when a loop never ends: only the watchdog can tell."""
    bench = Bench(port).armed()
    assert bench.ask(Pan(700)).status == 0
    bench.drive(1000, 1000, 2000, 1.0)
    port.advance(after_ms / 1000)
    assert port.board.outputs.left > 990
    hung = port.now
    port.board.hang()
    port.advance(0.1)
    assert port.board.outputs.left > 990, "it did not hang"
    while port.board.outputs != STILL:
        port.send(Drive(1000, 1000, 2000).to_packet(1).encode())
        port.advance(0.002)
        assert port.now - hung < 0.3
    assert port.board.starts == 2
    # Only now: the reset has cut a packet short, perhaps within a byte.
    port.advance(0.001)
    port.receive()
    fresh = Bench(port)
    told = fresh.telemetry()
    assert told.state is BoardState.IDLE
    assert Faults.WATCHDOG_RESET in told.faults
    assert told.t_ms < 500, "time begins anew"
    assert fresh.drive(1000, 1000, 0, 0.3).duty == (0, 0)
    assert fresh.hello().ok
    fresh.ask(Clear())
    assert fresh.telemetry().faults == Faults.NONE
    assert fresh.ask(Arm()).state is BoardState.ARMED


def test_a_healthy_board_is_never_reset(port: StepPort) -> None:
    bench = Bench(port).armed()
    for _ in range(50):
        bench.drive(500, -500, 0, 0.1)
        bench.collect(0.1)
    assert port.board.starts == 1


def test_loss_of_power_forgets_everything(port: StepPort) -> None:
    bench = Bench(port).armed()
    bench.drive(500, 500, 0, 0.5)
    port.board.power_cycle()
    assert port.board.outputs == STILL
    port.receive()
    port.advance(0.05)
    told = Bench(port).telemetry()
    assert (told.state, told.faults) == (BoardState.IDLE, Faults.NONE)
    assert told.t_ms < 100


def test_a_line_full_of_packets_is_read_to_the_last(port: StepPort) -> None:
    """Back to back as fast as simavr hands bytes over, which is 40 % of the line's pace."""
    bench = Bench(port).armed()
    before = bench.telemetry()
    for i in range(400):
        bench.send(Drive(i, -i, 4 * i))
    bench.send(Heartbeat(), seq=200)
    waited = 0
    while (told := bench.telemetry()).last_seq != 200:
        waited += 1
        assert waited < 50
    assert told.rx_errors == before.rx_errors
    assert told.steering == 4 * 399
    assert Faults.RECEIVE_OVERFLOW not in told.faults


def test_time_is_the_crystals(port: StepPort) -> None:
    bench = Bench(port)
    bench.hello()
    first, began = bench.time_ms(), port.now
    for _ in range(100):
        bench.send(Heartbeat())
        assert any(isinstance(m, Telemetry) for m in bench.collect(0.1))
    assert (bench.time_ms() - first) / 1000 == pytest.approx(port.now - began, abs=0.004)


def test_half_a_packet_before_a_reset_is_ended(port: StepPort) -> None:
    """The first byte of a fresh start is a zero, so that the host is in step at once."""
    port.board.power_cycle()
    port.receive()
    port.advance(0.1)
    parser = PacketParser()
    parser.feed(b"\x20\x01\x83")
    parser.feed(port.receive())
    assert parser.errors.total == 1
