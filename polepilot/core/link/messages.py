"""Messages: what packets mean. One frozen dataclass per row of the protocol table.

Field values are those on the wire, in the units that the names say; metres and radians begin at
`calibration`. ``docs/protocol.md`` is the table.
"""

from __future__ import annotations

import struct
from dataclasses import dataclass
from enum import IntEnum, IntFlag
from typing import ClassVar, Self

from polepilot.core.errors import InternalError
from polepilot.core.link.packets import MAJOR, MINOR, Packet

CLEAR_KEY = 0x5AA5
NO_SENSOR = 0xFFFF
"""In place of a distance: there is no such sensor."""
MAX_DUTY = 1000
"""Per mille: full duty."""


class MessageType(IntEnum):
    """Second byte of a body; answers and reports of the board have the high bit set."""

    HELLO = 0x01
    HEARTBEAT = 0x02
    DRIVE = 0x03
    PAN = 0x04
    ARM = 0x05
    ESTOP = 0x06
    CLEAR = 0x07
    PING = 0x08
    HELLO_ACK = 0x81
    ACK = 0x82
    TELEMETRY = 0x83
    PONG = 0x84


class BoardState(IntEnum):
    IDLE = 1
    ARMED = 2
    LINK_LOST = 3
    ESTOP = 4


class AckStatus(IntEnum):
    """What became of a command."""

    OK = 0
    VERSION = 1
    NOT_READY = 2
    LENGTH = 3
    UNKNOWN_TYPE = 4
    RANGE = 5


class BoardKind(IntEnum):
    PIC18F4550 = 1
    ATMEGA328P = 2
    ATMEGA2560 = 3
    HOST = 4
    SIMULATED = 5


class Faults(IntFlag):
    """Why a board does less than it is told, or how it came to restart."""

    NONE = 0
    STOP_BUTTON = 1 << 0
    PROXIMITY_STOP = 1 << 1
    LOW_BATTERY = 1 << 2
    PAN_STUCK = 1 << 3
    WATCHDOG_RESET = 1 << 4
    BROWN_OUT_RESET = 1 << 5
    RECEIVE_OVERFLOW = 1 << 6


class Features(IntFlag):
    """What a board has; a missing encoder is not a standstill."""

    NONE = 0
    ENCODERS = 1 << 0
    PROXIMITY = 1 << 1
    BATTERY = 1 << 2
    PAN = 1 << 3


class _Layout:
    """How a message lies in its payload: ``struct`` format, little-endian, no padding."""

    __slots__ = ()
    TYPE: ClassVar[MessageType]
    LAYOUT: ClassVar[struct.Struct] = struct.Struct("<")

    def _values(self) -> tuple[int, ...]:
        return ()

    @classmethod
    def _from_values(cls, values: tuple[int, ...]) -> Self:
        return cls(*values)

    def __post_init__(self) -> None:
        self.pack()

    def pack(self) -> bytes:
        """The payload.

        Raises:
            InternalError: a value that its field cannot hold.
        """
        try:
            return self.LAYOUT.pack(*self._values())
        except struct.error as error:
            raise InternalError(f"{self!r} does not fit its packet: {error}") from error

    @classmethod
    def unpack(cls, payload: bytes) -> Self | AckStatus:
        """The message in ``payload``, or the status that says why there is none."""
        if len(payload) != cls.LAYOUT.size:
            return AckStatus.LENGTH
        try:
            return cls._from_values(cls.LAYOUT.unpack(payload))
        except ValueError:
            return AckStatus.RANGE

    def to_packet(self, seq: int) -> Packet:
        return Packet(type=self.TYPE, seq=seq, payload=self.pack())


@dataclass(frozen=True, slots=True)
class Hello(_Layout):
    """Host: which version it speaks. Opens a session; the board becomes IDLE."""

    TYPE = MessageType.HELLO
    LAYOUT = struct.Struct("<BB")
    major: int = MAJOR
    minor: int = MINOR

    def _values(self) -> tuple[int, ...]:
        return (self.major, self.minor)


@dataclass(frozen=True, slots=True)
class Heartbeat(_Layout):
    """Host: still here."""

    TYPE = MessageType.HEARTBEAT


@dataclass(frozen=True, slots=True)
class Drive(_Layout):
    """Host: duty of the rear wheels (per mille, forward positive) and the steering angle
    (centidegrees, left positive). Not acknowledged; the next one replaces it."""

    TYPE = MessageType.DRIVE
    LAYOUT = struct.Struct("<hhh")
    left: int
    right: int
    steering: int

    def _values(self) -> tuple[int, ...]:
        return (self.left, self.right, self.steering)


@dataclass(frozen=True, slots=True)
class Pan(_Layout):
    """Host: duty of the pan motor, per mille, left positive."""

    TYPE = MessageType.PAN
    LAYOUT = struct.Struct("<h")
    rate: int

    def _values(self) -> tuple[int, ...]:
        return (self.rate,)


@dataclass(frozen=True, slots=True)
class Arm(_Layout):
    """Host: let the wheels turn from now on."""

    TYPE = MessageType.ARM


@dataclass(frozen=True, slots=True)
class Estop(_Layout):
    """Host: stop, and stay stopped until CLEAR."""

    TYPE = MessageType.ESTOP


@dataclass(frozen=True, slots=True)
class Clear(_Layout):
    """Host: end a latched stop; the key keeps an accident from doing it."""

    TYPE = MessageType.CLEAR
    LAYOUT = struct.Struct("<H")
    key: int = CLEAR_KEY

    def _values(self) -> tuple[int, ...]:
        return (self.key,)


@dataclass(frozen=True, slots=True)
class Ping(_Layout):
    TYPE = MessageType.PING
    LAYOUT = struct.Struct("<I")
    echo: int

    def _values(self) -> tuple[int, ...]:
        return (self.echo,)


@dataclass(frozen=True, slots=True)
class HelloAck(_Layout):
    """Board: what it is. ``ok`` is False where it does not speak the host's major version."""

    TYPE = MessageType.HELLO_ACK
    LAYOUT = struct.Struct("<6BH4B")
    major: int
    minor: int
    ok: bool
    state: BoardState
    max_payload: int
    telemetry_period_ms: int
    link_timeout_ms: int
    board: BoardKind
    firmware_major: int
    firmware_minor: int
    features: Features

    def _values(self) -> tuple[int, ...]:
        return (
            self.major,
            self.minor,
            int(self.ok),
            self.state,
            self.max_payload,
            self.telemetry_period_ms,
            self.link_timeout_ms,
            self.board,
            self.firmware_major,
            self.firmware_minor,
            self.features,
        )

    @classmethod
    def _from_values(cls, values: tuple[int, ...]) -> HelloAck:
        if values[2] > 1:
            raise ValueError("ok is neither 0 nor 1")
        return cls(
            major=values[0],
            minor=values[1],
            ok=bool(values[2]),
            state=BoardState(values[3]),
            max_payload=values[4],
            telemetry_period_ms=values[5],
            link_timeout_ms=values[6],
            board=BoardKind(values[7]),
            firmware_major=values[8],
            firmware_minor=values[9],
            features=Features(values[10]),
        )


@dataclass(frozen=True, slots=True)
class Ack(_Layout):
    """Board: what became of the command with this ``seq`` and ``type``, and its state now."""

    TYPE = MessageType.ACK
    LAYOUT = struct.Struct("<4B")
    seq: int
    type: int
    """Any byte: an unknown type is answered too."""
    status: AckStatus
    state: BoardState

    def _values(self) -> tuple[int, ...]:
        return (self.seq, self.type, self.status, self.state)

    @classmethod
    def _from_values(cls, values: tuple[int, ...]) -> Ack:
        seq, type_, status, state = values
        return cls(seq, type_, AckStatus(status), BoardState(state))


@dataclass(frozen=True, slots=True)
class Pong(_Layout):
    TYPE = MessageType.PONG
    LAYOUT = struct.Struct("<II")
    t_ms: int
    echo: int

    def _values(self) -> tuple[int, ...]:
        return (self.t_ms, self.echo)


@dataclass(frozen=True, slots=True)
class Telemetry(_Layout):
    """Board: everything it measures and does, fifty times a second."""

    TYPE = MessageType.TELEMETRY
    LAYOUT = struct.Struct("<I4B2i3h5H")
    t_ms: int
    """Since power-up; wraps after 49 days."""
    state: BoardState
    faults: Faults
    last_seq: int
    """Of the last packet that was received well."""
    rx_errors: int
    """Packets thrown away, modulo 256."""
    odometer: tuple[int, int]
    """Encoder counts, left and right."""
    duty: tuple[int, int]
    """As applied to the motors now, per mille."""
    steering: int
    """As applied to the servo now, centidegrees, left positive."""
    pan_adc: int
    proximity_mm: tuple[int, int, int]
    """Left, centre, right; ``NO_SENSOR`` where there is none."""
    battery_mv: int

    @property
    def ranges(self) -> tuple[float | None, float | None, float | None]:
        """The three proximity readings in metres from the sensor; None where there is none."""
        left, center, right = (
            None if value == NO_SENSOR else value / 1000 for value in self.proximity_mm
        )
        return left, center, right

    def _values(self) -> tuple[int, ...]:
        return (
            self.t_ms,
            self.state,
            self.faults,
            self.last_seq,
            self.rx_errors,
            *self.odometer,
            *self.duty,
            self.steering,
            self.pan_adc,
            *self.proximity_mm,
            self.battery_mv,
        )

    @classmethod
    def _from_values(cls, values: tuple[int, ...]) -> Telemetry:
        return cls(
            t_ms=values[0],
            state=BoardState(values[1]),
            faults=Faults(values[2]),
            last_seq=values[3],
            rx_errors=values[4],
            odometer=(values[5], values[6]),
            duty=(values[7], values[8]),
            steering=values[9],
            pan_adc=values[10],
            proximity_mm=(values[11], values[12], values[13]),
            battery_mv=values[14],
        )


HostMessage = Hello | Heartbeat | Drive | Pan | Arm | Estop | Clear | Ping
BoardMessage = HelloAck | Ack | Telemetry | Pong
Message = HostMessage | BoardMessage

_HOST: dict[int, type[HostMessage]] = {
    kind.TYPE: kind for kind in (Hello, Heartbeat, Drive, Pan, Arm, Estop, Clear, Ping)
}
_BOARD: dict[int, type[BoardMessage]] = {
    kind.TYPE: kind for kind in (HelloAck, Ack, Telemetry, Pong)
}

ACKNOWLEDGED = frozenset({MessageType.ARM, MessageType.PAN, MessageType.ESTOP, MessageType.CLEAR})
"""Commands that the host repeats until it has an ACK."""


def decode_host(packet: Packet) -> HostMessage | AckStatus:
    """What the host says in ``packet``, or the status with which a board answers nonsense."""
    kind = _HOST.get(packet.type)
    return AckStatus.UNKNOWN_TYPE if kind is None else kind.unpack(packet.payload)


def decode_board(packet: Packet) -> BoardMessage | AckStatus:
    """What the board says in ``packet``, or why that cannot be understood."""
    kind = _BOARD.get(packet.type)
    return AckStatus.UNKNOWN_TYPE if kind is None else kind.unpack(packet.payload)
