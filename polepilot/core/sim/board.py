"""The microcontroller, simulated: answers the bytes of the link as the firmware does.

It keeps every rule of ``docs/protocol.md`` by itself, whatever the host says: two deadlines, the
latched stop, ranges, slew limits, end stops of the pan motor, the stop before an obstacle. Time
is an argument, seconds of the simulated world.
"""

from __future__ import annotations

import math
from collections import deque
from dataclasses import dataclass

from polepilot.core.errors import InternalError
from polepilot.core.link.messages import (
    CLEAR_KEY,
    MAX_DUTY,
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
from polepilot.core.vehicle import RobotModel

LINK_TIMEOUT_MS = 250
"""Without any valid packet: LINK_LOST, motors off."""
DRIVE_TIMEOUT_MS = 250
"""Without DRIVE: wheels off, heartbeats or not."""
STEERING_TIMEOUT_MS = 1000
"""Without DRIVE: the servo returns to its centre, long after the wheels stand."""
PAN_TIMEOUT_MS = 1000
"""Without PAN: the pan motor stops."""
TELEMETRY_PERIOD_MS = 20
DUPLICATE_MS = 500
"""For so long a command with type, seq and payload of the last one is a repetition of it."""
_PAN_MARGIN = 8
"""ADC counts between the pan motor's end stops and the ends of its potentiometer."""
_MAX_UNSENT = 4096
"""Bytes that wait to be read; telemetry that does not fit is dropped, as by a UART."""


@dataclass(frozen=True, slots=True)
class BoardSettings:
    """What is compiled into one robot's firmware."""

    features: Features = Features.PROXIMITY | Features.BATTERY | Features.PAN
    """By default no encoders: the paper's robot counts time, not turns."""
    max_steering: int = 4500
    """Centidegrees."""
    slew: int = 4000
    """Largest change of a duty, per mille per second."""
    hard_limits_mm: tuple[int, int, int] = (107, 100, 107)
    """Left, centre, right: nearer than this to the sensor nothing turns forward."""
    pan_low: int = 8
    """ADC counts: at or below, the pan motor turns only back."""
    pan_high: int = 1015
    pan_rising: bool = True
    """Whether the counts rise as the camera turns left."""
    pan_stuck_ms: int = 1000
    pan_stuck_counts: int = 3
    pan_stuck_duty: int = 300
    """At this duty or more, fewer counts in that time mean a stuck motor."""
    low_battery_mv: int = 9900
    battery_hysteresis_mv: int = 200

    def __post_init__(self) -> None:
        if self.slew < 1000:
            raise InternalError(f"slew limit {self.slew} per mille per second, at least 1000")

    @classmethod
    def from_model(
        cls,
        model: RobotModel,
        features: Features = Features.PROXIMITY | Features.BATTERY | Features.PAN,
    ) -> BoardSettings:
        """For this body: the hard limit is measured from the disc that holds it.

        A sensor sits inside or ahead of that disc; along its direction the edge is at the
        positive root of ``|(forward, 0) + r (cos a, sin a)| = body_radius``.
        """
        radius, proximity = model.vehicle.body_radius, model.proximity
        limits = []
        for angle in proximity.angles:
            along = proximity.forward * math.cos(angle)
            discriminant = along**2 - proximity.forward**2 + radius**2
            edge = max(0.0, -along + math.sqrt(discriminant)) if discriminant > 0 else 0.0
            limits.append(round((edge + proximity.hard_limit) * 1000))
        left, center, right = limits
        ends = sorted((model.pan.adc_at_minimum, model.pan.adc_at_maximum))
        return cls(
            features=features,
            hard_limits_mm=(left, center, right),
            pan_low=ends[0] + _PAN_MARGIN,
            pan_high=ends[1] - _PAN_MARGIN,
            pan_rising=model.pan.adc_at_minimum < model.pan.adc_at_maximum,
        )


@dataclass(frozen=True, slots=True)
class BoardInputs:
    """What the pins say."""

    pan_adc: int = 512
    proximity_mm: tuple[int, int, int] = (NO_SENSOR, NO_SENSOR, NO_SENSOR)
    """Left, centre, right, from each sensor; its greatest range where nothing is in sight."""
    battery_mv: int = 12000
    odometer: tuple[int, int] = (0, 0)
    """Encoder counts since power-up, left and right."""
    stop_button: bool = False


@dataclass(frozen=True, slots=True)
class BoardOutputs:
    """What the motors get."""

    left: int = 0
    """Duty, per mille, forward positive."""
    right: int = 0
    steering: int = 0
    """Centidegrees, left positive."""
    pan: int = 0
    """Duty, per mille, left positive."""

    @property
    def steering_angle(self) -> float:
        """Radians."""
        return math.radians(self.steering / 100)


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
        self._parser = PacketParser()
        self._unsent = bytearray()
        self._inputs = BoardInputs()
        self._state = BoardState.IDLE
        self._ready = False
        self._reset_faults = reset
        self._low_battery = False
        self._last_seq = 0
        self._telemetry_seq = 0
        self._telemetry_due = TELEMETRY_PERIOD_MS
        self._last_command: tuple[int, int, bytes, int, AckStatus] | None = None
        self._packet_ms = 0
        self._drive_ms: int | None = None
        self._drive = Drive(0, 0, 0)
        self._steering = 0
        self._left = self._right = 0.0
        self._slewed_at = now
        self._pan_ms = 0
        self._pan = 0
        self._pan_stuck = 0
        """Sign of the direction in which the pan motor did not move; 0 while it does."""
        self._pan_mark = (0, 0)
        """Potentiometer and time when the pan motor was last seen to move."""

    @property
    def state(self) -> BoardState:
        return self._state

    @property
    def faults(self) -> Faults:
        faults = self._reset_faults
        if self._inputs.stop_button:
            faults |= Faults.STOP_BUTTON
        if self._blocked():
            faults |= Faults.PROXIMITY_STOP
        if self._low_battery:
            faults |= Faults.LOW_BATTERY
        if self._pan_stuck:
            faults |= Faults.PAN_STUCK
        return faults

    @property
    def outputs(self) -> BoardOutputs:
        """As of the last step or received byte."""
        return BoardOutputs(
            left=_whole(self._left),
            right=_whole(self._right),
            steering=self._steering,
            pan=self._pan_output(),
        )

    # ---- the three things a board does -------------------------------------------------------

    def receive(self, data: bytes, now: float) -> None:
        """Bytes from the host. Deadlines that passed before they came are kept first."""
        self._advance(now)
        for packet in self._parser.feed(data):
            self._packet_ms = self._ms
            self._last_seq = packet.seq
            self._handle(packet)
        self._limit()

    def step(self, now: float, inputs: BoardInputs) -> BoardOutputs:
        """One pass of the main loop: read the pins, keep the deadlines, set the outputs."""
        self._inputs = inputs
        self._advance(now)
        self._slew(now)
        self._watch_battery()
        self._watch_pan()
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

    # ---- deadlines and outputs ---------------------------------------------------------------

    def _advance(self, now: float) -> None:
        """Let time pass: whatever has had its time without a command returns to its default."""
        # A thousandth of a millisecond of slack, so that 0.25 s in floats is 250 ms.
        self._ms = max(self._ms, math.floor((now - self._started) * 1000 + 1e-3))
        if self._inputs.stop_button:
            self._stop(BoardState.ESTOP)
        silent = self._ms - self._packet_ms >= LINK_TIMEOUT_MS
        if silent:
            self._pan = 0
            if self._state is BoardState.ARMED:
                self._stop(BoardState.LINK_LOST)
        if self._drive_ms is not None:
            age = self._ms - self._drive_ms
            if age >= DRIVE_TIMEOUT_MS:
                self._halt()
            if age >= STEERING_TIMEOUT_MS:
                self._steering = 0
                self._drive_ms = None
        if self._ms - self._pan_ms >= PAN_TIMEOUT_MS:
            self._pan = 0
        self._limit()

    def _halt(self) -> None:
        """Wheels off at once; the servo stays, or a robot that still rolls would swerve."""
        self._drive = Drive(0, 0, 0)
        self._left = self._right = 0.0

    def _stop(self, state: BoardState) -> None:
        self._state = state
        self._halt()
        self._pan = 0

    def _blocked(self) -> bool:
        if Features.PROXIMITY not in self._settings.features:
            return False
        pairs = zip(self._inputs.proximity_mm, self._settings.hard_limits_mm, strict=True)
        return any(reading < limit for reading, limit in pairs)

    def _limit(self) -> None:
        """Nothing turns forward before an obstacle, not even to slow down gently."""
        if self._blocked():
            self._left = min(self._left, 0.0)
            self._right = min(self._right, 0.0)

    def _slew(self, now: float) -> None:
        reach = self._settings.slew * max(0.0, now - self._slewed_at)
        self._slewed_at = now
        self._left = _approach(self._left, self._drive.left, reach)
        self._right = _approach(self._right, self._drive.right, reach)
        self._limit()

    def _pan_output(self) -> int:
        adc, settings = self._inputs.pan_adc, self._settings
        rising = self._pan if settings.pan_rising else -self._pan
        at_low = rising < 0 and adc <= settings.pan_low
        at_high = rising > 0 and adc >= settings.pan_high
        if Features.PAN not in settings.features or at_low or at_high:
            return 0
        return 0 if self._pan * self._pan_stuck > 0 else self._pan

    def _watch_pan(self) -> None:
        settings = self._settings
        output, adc = self._pan_output(), self._inputs.pan_adc
        moved = abs(adc - self._pan_mark[0]) >= settings.pan_stuck_counts
        if moved or abs(output) < settings.pan_stuck_duty:
            self._pan_mark = (adc, self._ms)
        elif self._ms - self._pan_mark[1] >= settings.pan_stuck_ms:
            self._pan_stuck = 1 if output > 0 else -1

    def _watch_battery(self) -> None:
        settings, level = self._settings, self._inputs.battery_mv
        if Features.BATTERY not in settings.features:
            return
        more = settings.battery_hysteresis_mv if self._low_battery else 0
        self._low_battery = level < settings.low_battery_mv + more

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
            self._handle_drive(message)
        elif isinstance(message, Arm | Pan | Clear):
            self._handle_command(packet, message)
        else:
            assert isinstance(message, Heartbeat | Estop)

    def _greet(self, seq: int, ok: bool) -> None:
        """HELLO: a new session begins with everything off; only a latched stop outlives it."""
        self._ready = ok
        self._last_command = None
        self._stop(BoardState.ESTOP if self._state is BoardState.ESTOP else BoardState.IDLE)
        self._steering = 0
        self._drive_ms = None
        self._pan_stuck = 0
        answer = HelloAck(
            major=MAJOR,
            minor=MINOR,
            ok=ok,
            state=self._state,
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
        self._stop(BoardState.ESTOP)
        good = packet.major != MAJOR or not packet.payload
        status = AckStatus.OK if good else AckStatus.LENGTH
        if self._replayed(packet) is None:
            self.executed.append(Estop())
        self._remember(packet, status)
        self._acknowledge(packet, status)

    def _handle_drive(self, message: Drive) -> None:
        if self._state is not BoardState.ARMED:
            return
        limit = self._settings.max_steering
        self._drive = Drive(_clamp(message.left, MAX_DUTY), _clamp(message.right, MAX_DUTY), 0)
        self._steering = _clamp(message.steering, limit)
        self._drive_ms = self._ms

    def _handle_command(self, packet: Packet, message: Arm | Pan | Clear) -> None:
        status = self._replayed(packet)
        if status is None:
            status = self._execute(message)
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

    def _execute(self, message: Arm | Pan | Clear) -> AckStatus:
        if isinstance(message, Clear) and message.key != CLEAR_KEY:
            return AckStatus.RANGE
        if not self._ready:
            return AckStatus.NOT_READY
        if isinstance(message, Clear):
            return self._execute_clear()
        if isinstance(message, Arm):
            return self._execute_arm()
        return self._execute_pan(message)

    def _execute_clear(self) -> AckStatus:
        if self._inputs.stop_button:
            return AckStatus.NOT_READY
        if self._state is not BoardState.LINK_LOST:
            self._stop(BoardState.IDLE)
        self._reset_faults = Faults.NONE
        self._pan_stuck = 0
        return AckStatus.OK

    def _execute_arm(self) -> AckStatus:
        if self._state is BoardState.ESTOP:
            return AckStatus.NOT_READY
        if self._state is not BoardState.ARMED:
            self._halt()
        self._state = BoardState.ARMED
        return AckStatus.OK

    def _execute_pan(self, message: Pan) -> AckStatus:
        if self._state not in (BoardState.IDLE, BoardState.ARMED):
            return AckStatus.NOT_READY
        self._pan = _clamp(message.rate, MAX_DUTY)
        self._pan_ms = self._ms
        if self._pan * self._pan_stuck <= 0:
            self._pan_stuck = 0
        return AckStatus.OK

    def _acknowledge(self, packet: Packet, status: AckStatus) -> None:
        self._send(Ack(packet.seq, packet.type, status, self._state), packet.seq)

    def _send_telemetry(self) -> None:
        inputs, outputs, features = self._inputs, self.outputs, self._settings.features
        none = (NO_SENSOR, NO_SENSOR, NO_SENSOR)
        message = Telemetry(
            t_ms=self._t_ms(),
            state=self._state,
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


def _clamp(value: int, limit: int) -> int:
    return max(-limit, min(limit, value))


def _approach(value: float, target: float, reach: float) -> float:
    return min(value + reach, target) if value < target else max(value - reach, target)


def _whole(value: float) -> int:
    """Towards zero: a duty that is ramping down never shows more than it is."""
    return math.trunc(value + math.copysign(1e-6, value))
