"""The simulated board against the suite that every board must pass, and what only it has."""

from __future__ import annotations

import math
from dataclasses import replace

import pytest
from core.link.conformance import Bench, Conformance, PinConformance
from hypothesis import given, settings
from hypothesis import strategies as st

from polepilot.core.errors import InternalError
from polepilot.core.link.messages import (
    Arm,
    BoardState,
    Clear,
    Drive,
    Estop,
    Faults,
    Features,
    Heartbeat,
    Hello,
    Pan,
)
from polepilot.core.sim.board import Board, BoardInputs, BoardSettings
from polepilot.core.vehicle import PanUnit, RobotModel

NOTHING_NEAR = (1500, 1500, 1500)


class SimulatedPort:
    """Steps the board every 2 ms of its own time."""

    def __init__(self, board: Board | None = None, start: float = 0.0) -> None:
        self.board = board or Board(now=start)
        self.inputs = BoardInputs(proximity_mm=NOTHING_NEAR)
        self._start = start
        self._ticks = 0

    @property
    def now(self) -> float:
        return self._start + self._ticks * 0.002

    def send(self, data: bytes) -> None:
        self.board.receive(data, self.now)

    def receive(self) -> bytes:
        return self.board.transmit()

    def advance(self, seconds: float) -> None:
        for _ in range(round(seconds / 0.002)):
            self._ticks += 1
            self.board.step(self.now, self.inputs)

    def set_pins(
        self,
        *,
        pan_adc: int | None = None,
        proximity_mm: tuple[int, int, int] | None = None,
        battery_mv: int | None = None,
        stop_button: bool | None = None,
    ) -> None:
        given_pins = {
            "pan_adc": pan_adc,
            "proximity_mm": proximity_mm,
            "battery_mv": battery_mv,
            "stop_button": stop_button,
        }
        self.inputs = replace(self.inputs, **{k: v for k, v in given_pins.items() if v is not None})
        self.advance(0.002)

    def pan_output(self) -> int:
        return self.board.outputs.pan


@pytest.fixture
def port() -> SimulatedPort:
    return SimulatedPort()


class TestConformance(Conformance):
    @pytest.fixture
    def port(self) -> SimulatedPort:
        return SimulatedPort(start=1234.5)


class TestPins(PinConformance):
    @pytest.fixture
    def port(self) -> SimulatedPort:
        return SimulatedPort()


def test_deadlines_are_kept_though_the_board_is_only_stepped_now_and_then() -> None:
    """Bytes that come late do not undo a deadline that passed before them."""
    board = Board()
    board.receive(Hello().to_packet(0).encode() + Arm().to_packet(1).encode(), 0.0)
    board.receive(Drive(500, 500, 0).to_packet(2).encode(), 0.1)
    board.step(0.3, BoardInputs())
    assert board.outputs.left == 500
    board.receive(Drive(500, 500, 0).to_packet(3).encode(), 0.4)
    assert board.state is BoardState.LINK_LOST
    assert board.outputs.left == 0


def test_the_servo_returns_to_its_centre_after_the_wheels_stand(port: SimulatedPort) -> None:
    bench = Bench(port)
    assert bench.armed().drive(500, 500, 1500, 0.5).steering == 1500
    for step in range(12):
        bench.send(Heartbeat())
        bench.collect(0.1)
        if step == 5:
            assert port.board.outputs.left == 0
            assert port.board.outputs.steering == 1500
    assert port.board.outputs.steering == 0


def test_a_restarted_board_tells_why_until_clear() -> None:
    port = SimulatedPort(Board(reset=Faults.WATCHDOG_RESET))
    bench = Bench(port)
    bench.hello()
    assert bench.telemetry().faults == Faults.WATCHDOG_RESET
    bench.ask(Clear())
    assert bench.telemetry().faults == Faults.NONE


def test_loss_of_power_forgets_everything(port: SimulatedPort) -> None:
    bench = Bench(port)
    bench.armed().drive(500, 500, 0, 0.3)
    port.board.power_up(port.now)
    assert port.board.outputs.left == 0
    assert bench.telemetry().t_ms <= 20
    assert bench.ask(Arm()).state is BoardState.IDLE


def test_time_wraps_after_49_days() -> None:
    start = 0.0
    port = SimulatedPort(Board(now=start), start=start)
    port._ticks = ((1 << 32) - 100) // 2
    bench = Bench(port)
    stamps = [bench.telemetry().t_ms for _ in range(10)]
    assert max(stamps) > (1 << 32) - 100
    assert stamps[-1] < 200


def test_an_unread_board_does_not_pile_up_bytes(port: SimulatedPort) -> None:
    port.advance(10.0)
    assert len(port.receive()) <= 4096
    port.advance(0.1)
    Bench(port).telemetry()


def test_board_without_features_reports_none_of_them() -> None:
    port = SimulatedPort(Board(BoardSettings(features=Features.NONE)))
    port.inputs = BoardInputs(proximity_mm=(10, 10, 10), battery_mv=1000, odometer=(5, 5))
    bench = Bench(port)
    moving = bench.armed().drive(300, 300, 0, 0.6)
    assert moving.proximity_mm == (0xFFFF, 0xFFFF, 0xFFFF)
    assert moving.odometer == (0, 0)
    assert (moving.faults, moving.duty) == (Faults.NONE, (300, 300))
    bench.ask(Pan(500))
    assert port.pan_output() == 0


def test_hard_limits_are_measured_from_the_body() -> None:
    """8 cm ahead of the disc: 2 cm of it lie ahead of the centre sensor, 2.65 cm at 45 degrees."""
    limits = BoardSettings.from_model(RobotModel()).hard_limits_mm
    assert limits == (107, 100, 107)
    assert limits == BoardSettings().hard_limits_mm
    for limit, angle in zip(limits, RobotModel().proximity.angles, strict=True):
        reach = limit / 1000 - 0.08
        tip = (0.12 + reach * math.cos(angle), reach * math.sin(angle))
        assert math.hypot(*tip) == pytest.approx(0.14, abs=0.001)


def test_pan_ends_follow_the_potentiometer() -> None:
    assert BoardSettings.from_model(RobotModel()) == BoardSettings()
    mirrored = RobotModel(pan=PanUnit(adc_at_minimum=900, adc_at_maximum=100))
    fitted = BoardSettings.from_model(mirrored)
    assert (fitted.pan_low, fitted.pan_high, fitted.pan_rising) == (108, 892, False)
    port = SimulatedPort(Board(fitted))
    bench = Bench(port)
    bench.hello()
    port.set_pins(pan_adc=100)
    bench.ask(Pan(500))
    assert port.pan_output() == 0, "left is where the counts fall"
    bench.ask(Pan(-500))
    bench.collect(0.1)
    assert port.pan_output() == -500


@pytest.mark.parametrize("name", ["duty_slew", "pan_slew", "steering_slew"])
def test_a_slew_limit_slower_than_the_rule_is_refused(name: str) -> None:
    with pytest.raises(InternalError, match=f"{name} is 0 a millisecond, at least 1"):
        BoardSettings(**{name: 0})


MESSAGES = st.one_of(
    st.builds(Drive, st.integers(-1500, 1500), st.integers(-1500, 1500), st.integers(-9000, 9000)),
    st.builds(Pan, st.integers(-1500, 1500)),
    st.sampled_from([Arm(), Estop(), Clear(), Clear(1), Hello(), Hello(2, 0), Heartbeat()]),
)
STEPS = st.lists(
    st.tuples(MESSAGES | st.binary(max_size=20), st.integers(0, 400), st.booleans()), max_size=30
)


@settings(deadline=None, max_examples=200)
@given(STEPS)
def test_whatever_comes_the_outputs_are_safe(
    steps: list[tuple[Drive | Pan | Arm | bytes, int, bool]],
) -> None:
    """Wheels turn only while armed, in range, fed by a DRIVE younger than 250 ms, and never
    forward before an obstacle."""
    board = Board()
    now = 0.0
    last_drive = -1.0
    for seq, (message, wait_ms, near) in enumerate(steps):
        if isinstance(message, bytes):
            data = message
        else:
            data = b"\x00" + message.to_packet(seq & 0xFF).encode()
            if isinstance(message, Drive):
                last_drive = now
        board.receive(data, now)
        inputs = BoardInputs(proximity_mm=(50, 1500, 1500) if near else NOTHING_NEAR)
        for _ in range(1 + wait_ms // 10):
            now += 0.01
            outputs = board.step(now, inputs)
            moving = outputs.left != 0 or outputs.right != 0
            if moving:
                assert board.state is BoardState.ARMED
                assert now - last_drive < 0.25 + 1e-6
            assert max(abs(outputs.left), abs(outputs.right), abs(outputs.pan)) <= 1000
            assert abs(outputs.steering) <= 4500
            if near:
                assert outputs.left <= 0
                assert outputs.right <= 0
            if board.state in (BoardState.ESTOP, BoardState.LINK_LOST):
                assert outputs.pan == 0
