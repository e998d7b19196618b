"""Each message: golden bytes, round trip, and nonsense turned into a status."""

from __future__ import annotations

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from polepilot.core.errors import InternalError
from polepilot.core.link.messages import (
    ACKNOWLEDGED,
    NO_SENSOR,
    Ack,
    AckStatus,
    Arm,
    BoardKind,
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
    decode_host,
)
from polepilot.core.link.packets import MAX_PAYLOAD, Packet

U8, U16, U32 = st.integers(0, 0xFF), st.integers(0, 0xFFFF), st.integers(0, 0xFFFFFFFF)
I16, I32 = st.integers(-(1 << 15), (1 << 15) - 1), st.integers(-(1 << 31), (1 << 31) - 1)
STATE = st.sampled_from(BoardState)

HOST = st.one_of(
    st.builds(Hello, major=U8, minor=U8),
    st.just(Heartbeat()),
    st.builds(Drive, left=I16, right=I16, steering=I16),
    st.builds(Pan, rate=I16),
    st.just(Arm()),
    st.just(Estop()),
    st.builds(Clear, key=U16),
    st.builds(Ping, echo=U32),
)
BOARD = st.one_of(
    st.builds(
        HelloAck,
        major=U8,
        minor=U8,
        ok=st.booleans(),
        state=STATE,
        max_payload=U8,
        telemetry_period_ms=U8,
        link_timeout_ms=U16,
        board=st.sampled_from(BoardKind),
        firmware_major=U8,
        firmware_minor=U8,
        features=U8.map(Features),
    ),
    st.builds(Ack, seq=U8, type=U8, status=st.sampled_from(AckStatus), state=STATE),
    st.builds(Pong, t_ms=U32, echo=U32),
    st.builds(
        Telemetry,
        t_ms=U32,
        state=STATE,
        faults=U8.map(Faults),
        last_seq=U8,
        rx_errors=U8,
        odometer=st.tuples(I32, I32),
        duty=st.tuples(I16, I16),
        steering=I16,
        pan_adc=U16,
        proximity_mm=st.tuples(U16, U16, U16),
        battery_mv=U16,
    ),
)


@settings(deadline=None)
@given(HOST, U8)
def test_host_messages_round_trip(message: HostMessage, seq: int) -> None:
    packet = message.to_packet(seq)
    assert (packet.type, packet.seq) == (message.TYPE, seq)
    assert decode_host(packet) == message


@settings(deadline=None)
@given(BOARD, U8)
def test_board_messages_round_trip(message: BoardMessage, seq: int) -> None:
    packet = message.to_packet(seq)
    assert len(packet.payload) <= MAX_PAYLOAD
    assert decode_board(packet) == message


TELEMETRY = Telemetry(
    t_ms=0x01020304,
    state=BoardState.ARMED,
    faults=Faults.PROXIMITY_STOP | Faults.LOW_BATTERY,
    last_seq=7,
    rx_errors=3,
    odometer=(-2, 100000),
    duty=(500, -250),
    steering=1234,
    pan_adc=512,
    proximity_mm=(1500, NO_SENSOR, 80),
    battery_mv=11800,
)


@pytest.mark.parametrize(
    ("message", "payload"),
    [
        (Hello(1, 0), "0100"),
        (Heartbeat(), ""),
        (Drive(500, -250, 1234), "f40106ffd204"),
        (Pan(-1000), "18fc"),
        (Arm(), ""),
        (Estop(), ""),
        (Clear(), "a55a"),
        (Ping(0xDEADBEEF), "efbeadde"),
        (Ack(9, 6, AckStatus.OK, BoardState.ESTOP), "09060004"),
        (Pong(1000, 1), "e803000001000000"),
        (
            HelloAck(
                1, 0, True, BoardState.IDLE, 40, 20, 250, BoardKind.SIMULATED, 2, 3,
                Features.PROXIMITY | Features.PAN,
            ),
            "010001012814fa000502030a",
        ),
        (
            TELEMETRY,
            "04030201" "02060703" "feffffff" "a0860100" "f40106ff" "d204" "0002"
            "dc05ffff5000" "182e",
        ),
    ],
    ids=lambda value: type(value).__name__,
)  # fmt: skip
def test_golden_payloads(message: HostMessage | BoardMessage, payload: str) -> None:
    assert message.pack().hex() == payload


def test_estop_and_drive_on_the_wire() -> None:
    assert Estop().to_packet(9).encode().hex() == "0601060923c000"
    assert Drive(500, -250, 1234).to_packet(7).encode().hex() == "0c010307f40106ffd20417c400"


def test_only_four_commands_are_acknowledged() -> None:
    assert {kind.name for kind in ACKNOWLEDGED} == {"ARM", "PAN", "ESTOP", "CLEAR"}


@settings(deadline=None)
@given(U8, st.binary(max_size=MAX_PAYLOAD))
def test_any_payload_is_a_message_or_a_status(type_: int, payload: bytes) -> None:
    packet = Packet(type=type_, seq=0, payload=payload)
    for decode in (decode_host, decode_board):
        message = decode(packet)
        if not isinstance(message, AckStatus):
            assert message.to_packet(0) == packet


@pytest.mark.parametrize("kind", [*MessageType])
def test_wrong_length_and_unknown_type(kind: MessageType) -> None:
    decode = decode_board if kind & 0x80 else decode_host
    other = decode_host if kind & 0x80 else decode_board
    assert decode(Packet(type=kind, seq=0, payload=bytes(39))) is AckStatus.LENGTH
    assert other(Packet(type=kind, seq=0)) is AckStatus.UNKNOWN_TYPE


def test_values_that_no_field_holds() -> None:
    with pytest.raises(InternalError, match="does not fit"):
        Drive(40000, 0, 0)
    with pytest.raises(InternalError, match="does not fit"):
        Pan(-40000)
    bad_state = Packet(type=0x82, seq=0, payload=bytes((1, 5, 0, 9)))
    assert decode_board(bad_state) is AckStatus.RANGE


def test_missing_proximity_is_none_and_not_far() -> None:
    assert TELEMETRY.ranges == (1.5, None, 0.08)
