"""The microcontroller, simulated: answers the bytes of the link as the firmware does.

It keeps every rule of ``docs/protocol.md`` by itself, whatever the host says: two deadlines, the
latched stop, ranges, slew limits, soft reversal, end stops of the pan motor, the stop before an
obstacle (`board_guard`). Time is an argument, seconds of the simulated world.
"""

from __future__ import annotations

import math
from collections import deque

from polepilot.core.link.messages import (
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
    MessageType,
    Pan,
    Ping,
    Pong,
    Telemetry,
    decode_host,
)
from polepilot.core.link.packets import MAJOR, MAX_PAYLOAD, MINOR, Packet, PacketParser
from polepilot.core.sim.board_guard import LINK_TIMEOUT_MS, BoardGuard
from polepilot.core.sim.board_pins import BoardInputs, BoardOutputs, BoardSettings

__all__ = ["Board", "BoardInputs", "BoardOutputs", "BoardSettings", "Faults"]

TELEMETRY_PERIOD_MS = 20
DUPLICATE_MS = 500
"""For so long a command with type, seq and payload of the last one is a repetition of it."""
_MAX_UNSENT = 4096
"""Bytes that wait to be read; telemetry that does not fit is dropped, as by a UART."""


class Board:
    """One board from power-up on.

    Args:
        reset: why it has just started; shown as a fault until CLEAR.
    """

    def __init__(
        self,
        settings: BoardSettings | None = None,
        *,
        now: float = 0.0,
        reset: Faults = Faults.NONE,
        kind: BoardKind = BoardKind.SIMULATED,
        firmware: tuple[int, int] = (1, 0),
    ) -> None:
        self._settings = settings or BoardSettings()
        self._kind = kind
        self._firmware = firmware
        self.executed: deque[Arm | Pan | Estop | Clear] = deque(maxlen=1000)
        """The last acknowledged commands that were carried out, without repetitions; for tests."""
        self.power_up(now, reset)

    def power_up(self, now: float, reset: Faults = Faults.NONE) -> None:
        """Start anew, as after loss of power: all outputs safe, nothing remembered."""
        self._started = now
        self._ms = 0
        self._guard = BoardGuard(self._settings, reset)
        self._parser = PacketParser()
        self._unsent = bytearray()
        self._last_seq = 0
        self._telemetry_seq = 0
        self._telemetry_due = TELEMETRY_PERIOD_MS
        self._last_command: tuple[int, int, bytes, int, AckStatus] | None = None

    @property
    def state(self) -> BoardState:
        return self._guard.state

    @property
    def faults(self) -> Faults:
        return self._guard.faults

    @property
    def outputs(self) -> BoardOutputs:
        """As of the last step or received byte."""
        return self._guard.outputs

    # ---- the three things a board does -------------------------------------------------------

    def receive(self, data: bytes, now: float) -> None:
        """Bytes from the host. Deadlines that passed before they came are kept first."""
        self._advance(now)
        for packet in self._parser.feed(data):
            self._guard.heard()
            self._last_seq = packet.seq
            self._handle(packet)
        self._guard.actuate()

    def step(self, now: float, inputs: BoardInputs) -> BoardOutputs:
        """One pass of the main loop: read the pins, keep the deadlines, set the outputs."""
        self._guard.inputs = inputs
        self._advance(now)
        self._guard.actuate()
        if self._ms >= self._telemetry_due:
            behind = self._ms - self._telemetry_due
            self._telemetry_due += TELEMETRY_PERIOD_MS * (behind // TELEMETRY_PERIOD_MS + 1)
            self._send_telemetry()
        return self.outputs

    def transmit(self) -> bytes:
        """Bytes for the host since the last call."""
        data = bytes(self._unsent)
        self._unsent.clear()
        return data

    def _advance(self, now: float) -> None:
        # A thousandth of a millisecond of slack, so that 0.25 s in floats is 250 ms.
        self._ms = max(self._ms, math.floor((now - self._started) * 1000 + 1e-3))
        self._guard.advance(self._ms)

    # ---- packets -----------------------------------------------------------------------------

    def _handle(self, packet: Packet) -> None:
        if packet.type == MessageType.ESTOP:
            self._handle_estop(packet)
            return
        if packet.type == MessageType.HELLO and packet.major != MAJOR:
            self._greet(packet.seq, ok=False)
            return
        if packet.major != MAJOR:
            self._acknowledge(packet, AckStatus.VERSION)
            return
        message = decode_host(packet)
        if isinstance(message, AckStatus):
            self._acknowledge(packet, message)
        elif isinstance(message, Hello):
            self._greet(packet.seq, ok=message.major == MAJOR)
        elif isinstance(message, Ping):
            self._send(Pong(self._t_ms(), message.echo), packet.seq)
        elif isinstance(message, Drive):
            self._guard.drive(message)
        elif isinstance(message, Arm | Pan | Clear):
            self._handle_command(packet, message)
        else:
            assert isinstance(message, Heartbeat | Estop)

    def _greet(self, seq: int, ok: bool) -> None:
        """HELLO: a new session begins with everything off; only a latched stop outlives it."""
        self._last_command = None
        self._guard.hello(ok)
        answer = HelloAck(
            major=MAJOR,
            minor=MINOR,
            ok=ok,
            state=self.state,
            max_payload=MAX_PAYLOAD,
            telemetry_period_ms=TELEMETRY_PERIOD_MS,
            link_timeout_ms=LINK_TIMEOUT_MS,
            board=self._kind,
            firmware_major=self._firmware[0],
            firmware_minor=self._firmware[1],
            features=self._settings.features,
        )
        self._send(answer, seq)

    def _handle_estop(self, packet: Packet) -> None:
        """Always carried out: from any version, of any length, before HELLO, repeated or not."""
        self._guard.stop(BoardState.ESTOP)
        good = packet.major != MAJOR or not packet.payload
        status = AckStatus.OK if good else AckStatus.LENGTH
        if self._replayed(packet) is None:
            self.executed.append(Estop())
        self._remember(packet, status)
        self._acknowledge(packet, status)

    def _handle_command(self, packet: Packet, message: Arm | Pan | Clear) -> None:
        status = self._replayed(packet)
        if status is None:
            status = self._guard.execute(message)
            if status is AckStatus.OK:
                self.executed.append(message)
            self._remember(packet, status)
        self._acknowledge(packet, status)

    def _replayed(self, packet: Packet) -> AckStatus | None:
        """The status of the command that ``packet`` repeats; None for a new one."""
        if self._last_command is None:
            return None
        type_, seq, payload, at, status = self._last_command
        same = (type_, seq, payload) == (packet.type, packet.seq, packet.payload)
        return status if same and self._ms - at < DUPLICATE_MS else None

    def _remember(self, packet: Packet, status: AckStatus) -> None:
        self._last_command = (packet.type, packet.seq, packet.payload, self._ms, status)

    def _acknowledge(self, packet: Packet, status: AckStatus) -> None:
        self._send(Ack(packet.seq, packet.type, status, self.state), packet.seq)

    def _send_telemetry(self) -> None:
        inputs, outputs, features = self._guard.inputs, self.outputs, self._settings.features
        none = (NO_SENSOR, NO_SENSOR, NO_SENSOR)
        message = Telemetry(
            t_ms=self._t_ms(),
            state=self.state,
            faults=self.faults,
            last_seq=self._last_seq,
            rx_errors=self._parser.errors.total & 0xFF,
            odometer=inputs.odometer if Features.ENCODERS in features else (0, 0),
            duty=(outputs.left, outputs.right),
            steering=outputs.steering,
            pan_adc=inputs.pan_adc,
            proximity_mm=inputs.proximity_mm if Features.PROXIMITY in features else none,
            battery_mv=inputs.battery_mv,
        )
        self._send(message, self._telemetry_seq)
        self._telemetry_seq = (self._telemetry_seq + 1) & 0xFF

    def _t_ms(self) -> int:
        return self._ms & 0xFFFFFFFF

    def _send(self, message: BoardMessage, seq: int) -> None:
        encoded = message.to_packet(seq).encode()
        if len(self._unsent) + len(encoded) <= _MAX_UNSENT:
            self._unsent += encoded
