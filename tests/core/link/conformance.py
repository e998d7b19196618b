"""What every board must do, written against bytes alone.

A test module subclasses :class:`Conformance` and supplies the ``port`` fixture: a
:class:`BoardPort` to one freshly started board. Boards whose pins the test can set subclass
:class:`PinConformance` as well. Times are read from the board's own ``t_ms``, so that an emulator
may run at any speed.
"""

from __future__ import annotations

import itertools
import math
from dataclasses import dataclass
from typing import Protocol, TypeVar

import pytest

from polepilot.core.link.messages import (
    NO_SENSOR,
    Ack,
    AckStatus,
    Arm,
    BoardMessage,
    BoardState,
    Clear,
    Drive,
    Estop,
    Faults,
    Features,
    Heartbeat,
    Hello,
    HelloAck,
    HostMessage,
    MessageType,
    Pan,
    Ping,
    Pong,
    Telemetry,
    decode_board,
)
from polepilot.core.link.packets import Packet, PacketParser

M = TypeVar("M", bound=BoardMessage)
SLACK_MS = 25
"""One telemetry period and a little: nothing can be seen earlier than the next report."""


class BoardPort(Protocol):
    """Bytes to and from a board, and the passing of its time."""

    def send(self, data: bytes) -> None: ...

    def receive(self) -> bytes: ...

    def advance(self, seconds: float) -> None: ...


class PinPort(BoardPort, Protocol):
    """A board whose inputs the test holds."""

    def set_pins(
        self,
        *,
        pan_adc: int | None = None,
        proximity_mm: tuple[int, int, int] | None = None,
        battery_mv: int | None = None,
        stop_button: bool | None = None,
    ) -> None: ...

    def pan_output(self) -> int:
        """Duty of the pan motor; its sign is enough."""
        ...


@dataclass(frozen=True, slots=True)
class Senses:
    """How well a board can tell what its pins say: simulated pins exactly, converters roughly."""

    nearest_mm: int = 0
    farthest_mm: int = NO_SENSOR - 1
    error_mm: int = 0
    battery_error_mv: int = 0

    def sees(self, told: tuple[int, ...], real: tuple[int, ...]) -> bool:
        """Whether ``told`` is what the proximity sensors should tell of ``real``."""
        seen = (min(max(mm, self.nearest_mm), self.farthest_mm) for mm in real)
        return all(abs(a - b) <= self.error_mm for a, b in zip(told, seen, strict=True))


class Bench:
    """A host without any cleverness: sends what it is told, keeps what comes."""

    def __init__(self, port: BoardPort) -> None:
        self.port = port
        self.packets: list[Packet] = []
        self._parser = PacketParser()
        self._seq = 0

    def send(self, message: HostMessage, seq: int | None = None) -> int:
        if seq is None:
            self._seq = (self._seq + 1) & 0xFF
            seq = self._seq
        self.port.send(message.to_packet(seq).encode())
        return seq

    def collect(self, seconds: float) -> list[BoardMessage]:
        """Let time pass; what the board said meanwhile."""
        first = len(self.packets)
        self.port.advance(seconds)
        self.packets += self._parser.feed(self.port.receive())
        assert self._parser.errors.total == 0, "the board sent a bad packet"
        messages: list[BoardMessage] = []
        for packet in self.packets[first:]:
            assert packet.major == 1
            message = decode_board(packet)
            assert not isinstance(message, AckStatus), f"{packet} is not understood: {message!r}"
            messages.append(message)
        return messages

    def wait(self, kind: type[M], seconds: float = 0.3) -> M:
        """The first message of ``kind`` from now on."""
        elapsed = 0.0
        while elapsed < seconds:
            for message in self.collect(0.002):
                if isinstance(message, kind):
                    return message
            elapsed += 0.002
        raise AssertionError(f"no {kind.__name__} within {seconds} s")

    def ask(self, message: HostMessage, seq: int | None = None) -> Ack:
        sent = self.send(message, seq)
        ack = self.wait(Ack)
        assert (ack.seq, ack.type) == (sent, message.TYPE)
        return ack

    def ask_raw(self, packet: Packet) -> Ack:
        self.port.send(packet.encode())
        ack = self.wait(Ack)
        assert (ack.seq, ack.type) == (packet.seq, packet.type)
        return ack

    def hello(self) -> HelloAck:
        self.port.send(b"\x00")
        self.send(Hello())
        return self.wait(HelloAck)

    def armed(self) -> Bench:
        assert self.hello().ok
        assert self.ask(Arm()) == Ack(self._seq, MessageType.ARM, AckStatus.OK, BoardState.ARMED)
        return self

    def telemetry(self) -> Telemetry:
        return self.wait(Telemetry)

    def time_ms(self) -> int:
        """The board's time at which it received a packet, just now."""
        self.send(Ping(0))
        return self.wait(Pong).t_ms

    def drive(self, left: int, right: int, steering: int, seconds: float) -> Telemetry:
        """DRIVE at 50 Hz; the last telemetry."""
        latest: Telemetry | None = None
        for _ in range(round(seconds / 0.02)):
            self.send(Drive(left, right, steering))
            for message in self.collect(0.02):
                if isinstance(message, Telemetry):
                    latest = message
        assert latest is not None
        return latest

    def until(self, state: BoardState, seconds: float = 1.0, alive: bool = False) -> Telemetry:
        """The first telemetry in ``state``."""
        for step in range(round(seconds / 0.002)):
            if alive and step % 40 == 0:
                self.send(Heartbeat())
            for message in self.collect(0.002):
                if isinstance(message, Telemetry) and message.state is state:
                    return message
        raise AssertionError(f"never {state.name}")


class Conformance:
    """The rules that bytes alone can check. Override ``port``."""

    @pytest.fixture
    def port(self) -> BoardPort:
        raise NotImplementedError

    @pytest.fixture
    def bench(self, port: BoardPort) -> Bench:
        return Bench(port)

    # ---- handshake

    def test_hello_says_what_the_board_is(self, bench: Bench) -> None:
        seq = 200
        bench.port.send(Hello().to_packet(seq).encode())
        answer = bench.wait(HelloAck)
        assert (answer.major, answer.ok, answer.state) == (1, True, BoardState.IDLE)
        assert answer.max_payload == 40
        assert (answer.telemetry_period_ms, answer.link_timeout_ms) == (20, 250)
        assert [p.seq for p in bench.packets if p.type == MessageType.HELLO_ACK] == [seq]

    def test_half_a_packet_before_hello_does_not_matter(self, bench: Bench) -> None:
        bench.port.send(Estop().to_packet(1).encode()[:4])
        assert bench.hello().state is BoardState.IDLE

    @pytest.mark.parametrize("message", [Arm(), Pan(500), Clear()])
    def test_nothing_but_estop_before_hello(self, bench: Bench, message: HostMessage) -> None:
        ack = bench.ask(message)
        assert (ack.status, ack.state) == (AckStatus.NOT_READY, BoardState.IDLE)
        assert bench.drive(500, 500, 0, 0.1).duty == (0, 0)

    def test_another_major_version_stays_outside(self, bench: Bench) -> None:
        bench.send(Hello(2, 0))
        answer = bench.wait(HelloAck)
        assert (answer.ok, answer.major) == (False, 1)
        assert bench.ask(Arm()).status is AckStatus.NOT_READY
        bench.port.send(Packet(major=2, type=MessageType.HELLO, seq=9, payload=b"\2\0").encode())
        assert not bench.wait(HelloAck).ok
        assert bench.ask_raw(Packet(major=2, type=MessageType.ARM, seq=3)).status is (
            AckStatus.VERSION
        )
        assert bench.hello().ok, "the right version is welcome afterwards"

    def test_hello_ends_a_session(self, bench: Bench) -> None:
        bench.armed().drive(500, 500, 0, 0.3)
        assert bench.hello().state is BoardState.IDLE
        assert bench.telemetry().duty == (0, 0)

    # ---- telemetry

    def test_telemetry_comes_fifty_times_a_second(self, bench: Bench) -> None:
        bench.hello()
        start = bench.telemetry().t_ms
        stamps = [m.t_ms for m in bench.collect(2.0) if isinstance(m, Telemetry)]
        assert len(stamps) == pytest.approx((stamps[-1] - start) / 20, abs=2)
        gaps = [b - a for a, b in itertools.pairwise(stamps)]
        assert max(gaps) <= 30
        numbers = [p.seq for p in bench.packets if p.type == MessageType.TELEMETRY]
        assert all((b - a) & 0xFF == 1 for a, b in itertools.pairwise(numbers))

    def test_last_seq_and_rx_errors(self, bench: Bench) -> None:
        bench.hello()
        bench.send(Heartbeat(), seq=77)
        before = bench.telemetry()
        assert before.last_seq == 77
        good = bytearray(Heartbeat().to_packet(78).encode())
        good[2] ^= 0x10
        bench.port.send(bytes(good))
        bench.port.send(b"\x30\x01\x00")
        bench.port.send(b"\x01" * 60 + b"\x00")
        after = bench.collect(0.06)[-1]
        assert isinstance(after, Telemetry)
        assert (after.rx_errors - before.rx_errors) & 0xFF == 3
        assert after.last_seq == 77
        assert all(packet.type == MessageType.TELEMETRY for packet in bench.packets[-2:])

    def test_ping_is_answered(self, bench: Bench) -> None:
        bench.send(Ping(0xCAFEBABE))
        pong = bench.wait(Pong)
        assert pong.echo == 0xCAFEBABE
        assert bench.telemetry().t_ms - pong.t_ms <= SLACK_MS

    # ---- commands that make no sense

    def test_unknown_type_and_wrong_length(self, bench: Bench) -> None:
        bench.hello()
        for unknown in (0x00, 0x09, 0x55, 0x81, 0xFF):
            ack = bench.ask_raw(Packet(type=unknown, seq=unknown))
            assert ack.status is AckStatus.UNKNOWN_TYPE
        for kind in (*(k for k in MessageType if k < 0x80 and k is not MessageType.ESTOP),):
            ack = bench.ask_raw(Packet(type=kind, seq=4, payload=bytes(7)))
            assert ack.status is AckStatus.LENGTH
            assert ack.state is BoardState.IDLE

    def test_clear_wants_its_key(self, bench: Bench) -> None:
        bench.hello()
        bench.ask(Estop())
        ack = bench.ask(Clear(0x5AA4))
        assert (ack.status, ack.state) == (AckStatus.RANGE, BoardState.ESTOP)
        ack = bench.ask(Clear())
        assert (ack.status, ack.state) == (AckStatus.OK, BoardState.IDLE)

    # ---- driving

    def test_wheels_turn_only_when_armed(self, bench: Bench) -> None:
        bench.hello()
        assert bench.drive(600, 600, 500, 0.2).duty == (0, 0)
        assert bench.ask(Arm()).state is BoardState.ARMED
        assert bench.telemetry().duty == (0, 0), "a DRIVE from before ARM was kept"
        moving = bench.drive(600, -400, 1234, 1.0)
        assert (moving.duty, moving.steering) == ((600, -400), 1234)
        assert moving.state is BoardState.ARMED

    def test_ranges_are_clamped(self, bench: Bench) -> None:
        moving = bench.armed().drive(32767, -32768, 0, 1.2)
        assert moving.duty == (1000, -1000)
        assert 1234 <= bench.drive(0, 0, 32767, 0.3).steering <= 9000

    def test_duty_rises_gradually_but_not_slower_than_the_rule(self, bench: Bench) -> None:
        bench.armed()
        start = bench.time_ms()
        duties = []
        for _ in range(60):
            bench.send(Drive(1000, 1000, 0))
            duties += [
                (m.t_ms - start, m.duty[0]) for m in bench.collect(0.02) if isinstance(m, Telemetry)
            ]
        assert duties[0][1] < 1000, "no slew limit"
        assert duties[-1][1] == 1000
        for elapsed, duty in duties:
            assert duty >= min(1000, elapsed - 2 * SLACK_MS)

    def test_without_packets_the_link_is_lost(self, bench: Bench) -> None:
        bench.armed().drive(500, 500, 0, 0.6)
        bench.send(Drive(500, 500, 0))
        last = bench.time_ms()
        lost = bench.until(BoardState.LINK_LOST)
        assert 250 <= lost.t_ms - last <= 250 + SLACK_MS
        assert lost.duty == (0, 0)
        assert bench.drive(500, 500, 0, 0.2).duty == (0, 0), "driving again without ARM"
        assert bench.ask(Pan(300)).status is AckStatus.NOT_READY
        assert bench.ask(Arm()) == Ack(bench._seq, MessageType.ARM, AckStatus.OK, BoardState.ARMED)
        assert bench.drive(500, 500, 0, 0.6).duty == (500, 500)

    def test_link_is_lost_from_armed_only(self, bench: Bench) -> None:
        bench.hello()
        assert {m.state for m in bench.collect(0.6) if isinstance(m, Telemetry)} == {
            BoardState.IDLE
        }

    def test_without_drive_the_wheels_stop_though_the_link_lives(self, bench: Bench) -> None:
        bench.armed().drive(500, 500, 0, 0.6)
        before = bench.time_ms()
        bench.send(Drive(500, 500, 0))
        after = bench.time_ms()
        stopped: Telemetry | None = None
        for _ in range(12):
            bench.send(Heartbeat())
            for message in bench.collect(0.05):
                if isinstance(message, Telemetry):
                    assert message.state is BoardState.ARMED
                    if message.duty == (0, 0) and stopped is None:
                        stopped = message
        assert stopped is not None
        assert stopped.t_ms >= before + 250
        assert stopped.t_ms <= after + 250 + SLACK_MS
        assert bench.drive(500, 500, 0, 0.6).duty == (500, 500), "no new ARM is needed"

    def test_the_servo_returns_to_its_centre_after_the_wheels_stand(self, bench: Bench) -> None:
        """A robot that still rolls must not swerve."""
        assert bench.armed().drive(500, 500, 1500, 0.5).steering == 1500
        start = bench.time_ms()
        for _ in range(26):
            bench.send(Heartbeat())
            for message in bench.collect(0.05):
                if isinstance(message, Telemetry) and message.t_ms - start >= 300:
                    assert message.duty == (0, 0)
                    if message.t_ms - start < 900:
                        assert message.steering == 1500
        assert bench.telemetry().steering == 0

    def test_hello_centres_the_servo_at_once(self, bench: Bench) -> None:
        bench.armed().drive(0, 0, 3000, 0.3)
        bench.hello()
        assert bench.telemetry().steering == 0

    def test_motors_are_not_plugged(self, bench: Bench) -> None:
        """However fast the direction is changed, the duty takes its way through zero."""
        bench.armed().drive(1000, 1000, 0, 1.2)
        duties = []
        for _ in range(40):
            bench.send(Drive(-1000, -1000, 0))
            duties += [m.duty[0] for m in bench.collect(0.02) if isinstance(m, Telemetry)]
        assert duties[-1] == -1000
        assert duties == sorted(duties, reverse=True)
        assert len([duty for duty in duties if -1000 < duty < 1000]) >= 3, "too sudden"

    def test_a_motor_is_reversed_only_when_it_has_nearly_stopped(self, bench: Bench) -> None:
        """A motor that follows its duty with 80 ms of lag turns by less than a fifth of its full
        speed when the supply is reversed, and no more than 0.2 s are lost by that."""
        bench.armed().drive(1000, -1000, 0, 1.2)
        start = then = bench.time_ms()
        speeds = [1.0, -1.0]
        turned: list[int | None] = [None, None]
        while then - start < 1000:
            bench.send(Drive(-1000, 1000, 0))
            for message in bench.collect(0.02):
                if not isinstance(message, Telemetry):
                    continue
                share = -math.expm1(-(message.t_ms - then) / 80)
                then = message.t_ms
                for side, duty in enumerate(message.duty):
                    speeds[side] += share * (duty / 1000 - speeds[side])
                    if duty * (-1, 1)[side] > 0 and turned[side] is None:
                        turned[side] = then
                        assert abs(speeds[side]) < 0.2, "plugged"
        for at in turned:
            assert at is not None, "never reversed"
            # The ramp down takes a second at most by the rule for slew limits.
            assert at - start <= 1000 + 200 + SLACK_MS
        assert bench.drive(-1000, 1000, 0, 0.4).duty == (-1000, 1000)

    def test_nor_is_it_after_a_stop(self, bench: Bench) -> None:
        """A stop takes the duty away at once; the wheels roll on for a while."""
        bench.armed().drive(1000, 1000, 0, 1.2)
        start = bench.time_ms()
        bench.ask(Estop())
        bench.ask(Clear())
        assert bench.ask(Arm()).state is BoardState.ARMED
        seen = []
        for _ in range(20):
            bench.send(Drive(-1000, -1000, 0))
            seen += [m for m in bench.collect(0.02) if isinstance(m, Telemetry)]
        backward = [m.t_ms - start for m in seen if m.duty[0] < 0]
        assert backward, "never reversed"
        assert 100 <= backward[0] <= 200 + 2 * SLACK_MS

    def test_the_servo_turns_gradually(self, bench: Bench) -> None:
        """At most 400 degrees per second, and at the far end within a third of a second."""
        bench.armed()
        for wanted in (4000, -4000):
            before = bench.drive(0, 0, -wanted, 0.4)
            assert before.steering == -wanted
            start, last = bench.time_ms(), before
            seen = []
            while not seen or seen[-1].t_ms - start < 340:
                bench.send(Drive(0, 0, wanted))
                seen += [m for m in bench.collect(0.02) if isinstance(m, Telemetry)]
            for message in seen:
                # One millisecond more: time is cut to whole ones.
                reach = 40 * (message.t_ms - last.t_ms + 1)
                assert abs(message.steering - last.steering) <= reach, "too sudden"
                last = message
            assert last.steering == wanted

    # ---- emergency stop

    def test_estop_stops_at_once_and_is_latched(self, bench: Bench) -> None:
        bench.armed().drive(1000, 1000, 0, 1.2)
        assert bench.ask(Estop()).state is BoardState.ESTOP
        assert bench.telemetry().duty == (0, 0)
        ack = bench.ask(Arm())
        assert (ack.status, ack.state) == (AckStatus.NOT_READY, BoardState.ESTOP)
        assert bench.ask(Pan(300)).status is AckStatus.NOT_READY
        assert bench.drive(500, 500, 0, 0.2).duty == (0, 0)
        assert bench.hello().state is BoardState.ESTOP, "HELLO must not clear a stop"
        assert bench.ask(Clear()).state is BoardState.IDLE
        assert bench.drive(500, 500, 0, 0.2).duty == (0, 0), "CLEAR must not arm"

    def test_estop_works_before_hello_and_from_any_version(self, bench: Bench) -> None:
        ack = bench.ask_raw(Packet(major=7, type=MessageType.ESTOP, seq=1))
        assert (ack.status, ack.state) == (AckStatus.OK, BoardState.ESTOP)
        assert bench.hello().state is BoardState.ESTOP

    def test_estop_is_never_a_repetition(self, bench: Bench) -> None:
        """Even with the number of the last command it stops again after a CLEAR."""
        bench.hello()
        bench.ask(Estop(), seq=9)
        bench.ask(Clear(), seq=10)
        assert bench.ask(Estop(), seq=9).state is BoardState.ESTOP

    # ---- repetitions

    def test_a_repetition_is_answered_and_not_carried_out(self, bench: Bench) -> None:
        bench.hello()
        assert bench.ask(Arm(), seq=50).state is BoardState.ARMED
        bench.until(BoardState.LINK_LOST)
        again = bench.ask(Arm(), seq=50)
        assert (again.status, again.state) == (AckStatus.OK, BoardState.LINK_LOST)
        assert bench.ask(Arm(), seq=51).state is BoardState.ARMED

    def test_after_half_a_second_it_is_a_new_command(self, bench: Bench) -> None:
        bench.hello()
        bench.ask(Arm(), seq=50)
        bench.until(BoardState.LINK_LOST)
        bench.collect(0.4)
        assert bench.ask(Arm(), seq=50).state is BoardState.ARMED

    def test_hello_clears_the_memory(self, bench: Bench) -> None:
        bench.hello()
        bench.ask(Arm(), seq=50)
        assert bench.hello().state is BoardState.IDLE
        assert bench.ask(Arm(), seq=50).state is BoardState.ARMED

    def test_a_refusal_is_repeated_too(self, bench: Bench) -> None:
        assert bench.ask(Arm(), seq=50).status is AckStatus.NOT_READY
        assert bench.ask(Arm(), seq=50).status is AckStatus.NOT_READY
        bench.hello()
        assert bench.ask(Clear(1), seq=51).status is AckStatus.RANGE
        assert bench.ask(Clear(1), seq=51).status is AckStatus.RANGE

    def test_same_number_but_another_payload_is_a_new_command(self, bench: Bench) -> None:
        bench.hello()
        bench.ask(Estop())
        assert bench.ask(Clear(1), seq=60).state is BoardState.ESTOP
        assert bench.ask(Clear(), seq=60).state is BoardState.IDLE


class PinConformance:
    """The rules that need hands on the board's inputs. Override ``port``, and ``senses`` where the
    pins are real ones."""

    senses = Senses()

    @pytest.fixture
    def port(self) -> PinPort:
        raise NotImplementedError

    @pytest.fixture
    def bench(self, port: PinPort) -> Bench:
        return Bench(port)

    def test_the_button_stops_and_holds_off_clear(self, bench: Bench, port: PinPort) -> None:
        bench.armed().drive(800, 800, 0, 1.0)
        port.set_pins(stop_button=True)
        stopped = bench.until(BoardState.ESTOP)
        assert stopped.duty == (0, 0)
        assert Faults.STOP_BUTTON in stopped.faults
        assert bench.ask(Clear()).state is BoardState.ESTOP
        port.set_pins(stop_button=False)
        bench.collect(0.05)
        assert bench.telemetry().state is BoardState.ESTOP, "released is not cleared"
        assert bench.ask(Clear()).state is BoardState.IDLE
        assert Faults.STOP_BUTTON not in bench.telemetry().faults

    @pytest.mark.parametrize("sensor", [0, 1, 2])
    def test_an_obstacle_stops_forward_motion_only(
        self, bench: Bench, port: PinPort, sensor: int
    ) -> None:
        bench.armed().drive(800, 800, 0, 1.0)
        near = [1500, 1500, 1500]
        near[sensor] = 50
        port.set_pins(proximity_mm=(near[0], near[1], near[2]))
        blocked = bench.drive(800, 800, 0, 0.06)
        assert blocked.duty == (0, 0)
        assert Faults.PROXIMITY_STOP in blocked.faults
        assert self.senses.sees(blocked.proximity_mm, tuple(near)), blocked.proximity_mm
        assert blocked.state is BoardState.ARMED
        assert bench.drive(-400, -400, 0, 0.6).duty == (-400, -400), "backing out must work"
        port.set_pins(proximity_mm=(1500, 1500, 1500))
        free = bench.drive(300, 300, 0, 1.0)
        assert free.duty == (300, 300)
        assert Faults.PROXIMITY_STOP not in free.faults

    def test_a_sensor_that_is_not_there_stops_nothing(self, bench: Bench, port: PinPort) -> None:
        port.set_pins(proximity_mm=(NO_SENSOR, NO_SENSOR, NO_SENSOR))
        assert bench.armed().drive(300, 300, 0, 0.6).duty == (300, 300)

    def test_low_battery_is_told(self, bench: Bench, port: PinPort) -> None:
        bench.hello()
        assert Faults.LOW_BATTERY not in bench.telemetry().faults
        port.set_pins(battery_mv=8000)
        bench.collect(0.03)
        low = bench.telemetry()
        assert Faults.LOW_BATTERY in low.faults
        assert abs(low.battery_mv - 8000) <= self.senses.battery_error_mv

    def test_nothing_moves_before_hello(self, bench: Bench, port: PinPort) -> None:
        bench.ask(Pan(500))
        bench.ask(Arm())
        assert bench.drive(800, 800, 0, 0.3).duty == (0, 0)
        assert port.pan_output() == 0

    def test_pan_stops_by_itself(self, bench: Bench, port: PinPort) -> None:
        bench.hello()
        assert bench.ask(Pan(400)).status is AckStatus.OK
        bench.send(Heartbeat())
        bench.collect(0.1)
        assert port.pan_output() > 0
        for _ in range(12):
            bench.send(Heartbeat())
            bench.collect(0.1)
        assert port.pan_output() == 0, "one second without PAN"
        bench.ask(Pan(-400))
        assert port.pan_output() < 0
        bench.collect(0.3)
        assert port.pan_output() == 0, "a silent link"

    def test_the_pan_motor_is_not_plugged(self, bench: Bench, port: PinPort) -> None:
        bench.hello()
        for adc in (500, 510, 520, 530):
            port.set_pins(pan_adc=adc)
            assert bench.ask(Pan(1000)).status is AckStatus.OK
            bench.collect(0.1)
        assert port.pan_output() == 1000
        start = bench.time_ms()
        bench.ask(Pan(-1000))
        outputs = [port.pan_output()]
        while bench.time_ms() - start < 150:
            outputs.append(port.pan_output())
        assert min(outputs) >= 0, "a reversed supply on a motor that turns"
        bench.ask(Pan(-1000))
        bench.collect(0.24)
        assert port.pan_output() < 0

    def test_pan_stops_at_its_ends(self, bench: Bench, port: PinPort) -> None:
        assert Features.PAN in bench.hello().features
        for adc, outwards in ((2, -500), (1021, 500)):
            port.set_pins(pan_adc=adc)
            bench.ask(Pan(outwards))
            assert port.pan_output() == 0
            bench.ask(Pan(-outwards))
            assert port.pan_output() * outwards < 0

    def test_a_stuck_pan_motor_is_switched_off(self, bench: Bench, port: PinPort) -> None:
        bench.hello()
        port.set_pins(pan_adc=500)
        for _ in range(8):
            bench.ask(Pan(800))
            bench.collect(0.2)
        assert Faults.PAN_STUCK in bench.telemetry().faults
        assert port.pan_output() == 0
        bench.ask(Pan(-800))
        assert port.pan_output() < 0, "the other way is worth a try"
        bench.collect(0.03)
        assert Faults.PAN_STUCK not in bench.telemetry().faults

    def test_estop_stops_the_pan_motor(self, bench: Bench, port: PinPort) -> None:
        bench.hello()
        bench.ask(Pan(800))
        bench.ask(Estop())
        assert port.pan_output() == 0
