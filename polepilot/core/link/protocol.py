"""The host's end of the link: fed bytes and time, it returns bytes and events.

No port, no thread, no clock. The owner calls, in each tick:

    link.receive(port.read(), now)
    link.drive(left, right, steering)        # as long as the wheels shall turn
    port.write(link.poll(now))
    for event in link.events(): ...

The rules it keeps: nothing but ESTOP is sent before the versions agree; commands that need an
acknowledgement go one at a time and are repeated with the same sequence number, so that the board
can tell a repetition from a new command; ESTOP overtakes everything and is repeated for ever;
arming is always somebody's explicit wish.
"""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass

from polepilot.core.errors import RefusedError
from polepilot.core.link.clockmap import ClockMap
from polepilot.core.link.messages import (
    MAX_DUTY,
    Ack,
    AckStatus,
    Arm,
    BoardState,
    Clear,
    Drive,
    Estop,
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
from polepilot.core.link.packets import DELIMITER, MAJOR, Packet, PacketParser
from polepilot.core.link.report import (
    LinkEvent,
    LinkEventCode,
    LinkSettings,
    LinkState,
    LinkStatistics,
    TelemetrySample,
)

__all__ = [
    "HostLink",
    "LinkEvent",
    "LinkEventCode",
    "LinkSettings",
    "LinkState",
    "LinkStatistics",
    "TelemetrySample",
]

MAX_STEERING = 9000
"""Centidegrees; a front wheel at right angles. The board has its own, smaller limit."""


@dataclass(slots=True)
class _Pending:
    """A command on its way to be acknowledged."""

    message: HostMessage
    seq: int
    first_sent: float
    last_sent: float
    tries: int = 1

    @property
    def name(self) -> str:
        return self.message.TYPE.name


class HostLink:
    """One session after the other with one board. Starts CONNECTING."""

    def __init__(self, settings: LinkSettings | None = None) -> None:
        self._settings = settings or LinkSettings()
        self._parser = PacketParser()
        self._out = bytearray()
        self._events: list[LinkEvent] = []
        self._samples: deque[TelemetrySample] = deque(maxlen=200)
        self._arrivals: deque[float] = deque(maxlen=400)
        self._clock = ClockMap()
        self._now = 0.0
        self._seq = 0

        self._open = True
        self._board: HelloAck | None = None
        self._board_state: BoardState | None = None
        self._latest: TelemetrySample | None = None
        self._heard = 0.0
        self._shown_state = LinkState.CONNECTING
        self._mismatch_told = False

        self._hello_seq: int | None = None
        self._next_hello = 0.0
        self._next_heartbeat = 0.0
        self._next_ping = 0.0
        self._ping: tuple[int, float] | None = None
        self._ping_count = 0

        self._estop_wanted = False
        self._estop: _Pending | None = None
        self._arm_wanted = False
        self._clear_wanted = False
        self._pending: _Pending | None = None
        self._drive: Drive | None = None
        self._pan_wanted: int | None = None
        self._pan_acknowledged: int | None = None
        self._next_pan = 0.0

        self._sent = self._resent = self._acknowledged = self._refused = self._unanswered = 0
        self._received = self._lost = self._board_rejected = self._handshakes = 0
        self._board_seq: int | None = None
        self._board_rx_errors: int | None = None
        self._round_trip: float | None = None
        self._best_round_trip: float | None = None

    # ---- what the owner can see -------------------------------------------------------------

    @property
    def state(self) -> LinkState:
        if not self._open:
            return LinkState.CLOSED
        if self._board is None or self._board_state is None:
            return LinkState.CONNECTING
        if self._estop_wanted:
            return LinkState.ESTOP
        return LinkState[self._board_state.name]

    @property
    def ready(self) -> bool:
        """The versions agree and the board talks; not yet that it is armed."""
        return self._open and self._board is not None

    @property
    def armed(self) -> bool:
        return self.state is LinkState.ARMED

    @property
    def estop_pending(self) -> bool:
        """ESTOP is asked for and not acknowledged; also without a port."""
        return self._estop_wanted

    @property
    def board(self) -> HelloAck | None:
        """Who answered the handshake of this session."""
        return self._board

    @property
    def features(self) -> Features:
        return Features.NONE if self._board is None else self._board.features

    @property
    def telemetry(self) -> TelemetrySample | None:
        """The latest, however old it is."""
        return self._latest

    def telemetry_age(self, now: float) -> float | None:
        """Seconds since the latest telemetry was read; None before the first one."""
        return None if self._latest is None else now - self._latest.received

    def samples(self) -> list[TelemetrySample]:
        """Telemetry since the last call, oldest first; at most the last 200."""
        samples = list(self._samples)
        self._samples.clear()
        return samples

    def events(self) -> list[LinkEvent]:
        """What happened since the last call, oldest first."""
        events, self._events = self._events, []
        return events

    @property
    def statistics(self) -> LinkStatistics:
        recent = [stamp for stamp in self._arrivals if stamp > self._now - 1.0]
        return LinkStatistics(
            sent=self._sent,
            resent=self._resent,
            acknowledged=self._acknowledged,
            refused=self._refused,
            unanswered=self._unanswered,
            received=self._received,
            lost=self._lost,
            rejected=self._parser.errors.total,
            crc_errors=self._parser.errors.crc,
            board_rejected=self._board_rejected,
            handshakes=self._handshakes,
            round_trip_ms=self._round_trip,
            best_round_trip_ms=self._best_round_trip,
            telemetry_rate=float(len(recent)),
        )

    # ---- what the owner can ask for ----------------------------------------------------------

    def drive(self, left: int, right: int, steering: int) -> None:
        """Duties (per mille) and steering angle (centidegrees), sent once at the next poll.

        Values beyond the range are clamped. To keep the wheels turning call it at 20 Hz or more:
        the board stops them 250 ms after the last one. Not sent unless the board is armed.
        """
        self._drive = Drive(
            _clamp(left, MAX_DUTY), _clamp(right, MAX_DUTY), _clamp(steering, MAX_STEERING)
        )

    def pan(self, rate: int) -> None:
        """Duty of the pan motor (per mille, left positive), kept up until the next call.

        Kept over a new handshake as well; not sent while the board is stopped or lost.
        """
        self._pan_wanted = _clamp(rate, MAX_DUTY)

    def arm(self) -> None:
        """Let the wheels turn.

        Raises:
            RefusedError: no board, or a latched stop.
        """
        self._require_board("arm")
        if self.state is LinkState.ESTOP:
            raise RefusedError(
                "The emergency stop is latched.", remedy="Clear it, then arm.", code="estop"
            )
        self._arm_wanted = self.state is not LinkState.ARMED

    def disarm(self) -> None:
        """Back to IDLE, by a new handshake; a latched stop stays latched, unlike with CLEAR."""
        self._arm_wanted = False
        if self.state in (LinkState.ARMED, LinkState.LINK_LOST) or self._is_pending(Arm):
            self._disconnect()
            self._next_hello = self._now

    def estop(self) -> None:
        """Stop and stay stopped. Works in every state, before the handshake too.

        Sent at the next poll and repeated until the board acknowledges it.
        """
        self._estop_wanted = True
        self._estop = None
        self._arm_wanted = self._clear_wanted = False
        self._drive = None
        self._pending = None

    def clear(self) -> None:
        """End a latched stop; the board becomes IDLE. Nothing happens in any other state.

        Raises:
            RefusedError: no board.
        """
        self._require_board("clear the stop")
        self._clear_wanted = self.state is LinkState.ESTOP

    def reset(self, now: float) -> None:
        """The port was opened, again or for the first time: start with a handshake."""
        self._now = now
        self._open = True
        self._parser.clear()
        self._out.clear()
        self._disconnect()
        self._next_hello = now
        self._next_heartbeat = now
        self._show_state(now)

    def port_lost(self, now: float, reason: str) -> None:
        """The port is gone: nothing is sent until :meth:`reset`. A wanted ESTOP stays wanted."""
        self._now = now
        if not self._open:
            return
        self._open = False
        self._out.clear()
        self._disconnect()
        self._event(now, LinkEventCode.CLOSED, reason)
        self._shown_state = self.state

    # ---- bytes in ----------------------------------------------------------------------------

    def receive(self, data: bytes, now: float) -> None:
        """Bytes from the port, perhaps none, perhaps nonsense."""
        self._now = now
        for packet in self._parser.feed(data):
            self._received += 1
            self._take(packet, now)
        self._show_state(now)

    def _take(self, packet: Packet, now: float) -> None:
        if packet.major != MAJOR:
            if packet.type == MessageType.HELLO_ACK:
                self._tell_mismatch(now, packet.major)
            return
        message = decode_board(packet)
        if isinstance(message, AckStatus):
            return
        if isinstance(message, HelloAck):
            self._take_hello_ack(message, packet.seq, now)
            return
        self._count_gap(packet.seq)
        if self._board is None:
            if isinstance(message, Ack):
                self._take_estop_ack(message)
            return
        if isinstance(message, Telemetry):
            self._take_telemetry(message, now)
        elif isinstance(message, Ack):
            self._board_state = message.state
            self._take_ack(message, now)
        elif isinstance(message, Pong):
            self._take_pong(message, now)

    def _take_hello_ack(self, message: HelloAck, seq: int, now: float) -> None:
        if self._board is not None or seq != self._hello_seq:
            return
        if not message.ok or message.major != MAJOR:
            self._tell_mismatch(now, message.major)
            return
        self._board = message
        self._board_state = message.state
        self._hello_seq = None
        self._mismatch_told = False
        self._heard = now
        self._next_ping = now
        self._next_pan = now
        self._handshakes += 1
        self._event(
            now,
            LinkEventCode.CONNECTED,
            f"Board {message.board.name.lower()}, firmware "
            f"{message.firmware_major}.{message.firmware_minor}.",
        )
        self._shown_state = self.state

    def _tell_mismatch(self, now: float, major: int) -> None:
        if self._mismatch_told:
            return
        self._mismatch_told = True
        self._event(
            now,
            LinkEventCode.VERSION_MISMATCH,
            f"The board speaks version {major} of the link protocol, this program version "
            f"{MAJOR}: install the firmware that belongs to it.",
        )

    def _count_gap(self, seq: int) -> None:
        """The board numbers all that it sends except HELLO_ACK, which repeats our number."""
        if self._board_seq is not None:
            self._lost += (seq - self._board_seq - 1) & 0xFF
        self._board_seq = seq

    def _take_telemetry(self, message: Telemetry, now: float) -> None:
        if self._clock.went_back(message.t_ms):
            self._event(now, LinkEventCode.BOARD_RESET, "The board has restarted.")
            self._disconnect()
            self._next_hello = now
            return
        self._heard = now
        self._board_state = message.state
        stamp = self._clock.to_host(message.t_ms, now)
        self._latest = TelemetrySample(stamp=stamp, received=now, telemetry=message)
        self._samples.append(self._latest)
        self._arrivals.append(now)
        if self._board_rx_errors is not None:
            self._board_rejected += (message.rx_errors - self._board_rx_errors) & 0xFF
        self._board_rx_errors = message.rx_errors

    def _take_estop_ack(self, ack: Ack) -> bool:
        pending = self._estop
        if pending is None or ack.type != MessageType.ESTOP or ack.seq != pending.seq:
            return False
        if ack.state is BoardState.ESTOP:
            self._estop = None
            self._estop_wanted = False
            self._acknowledged += 1
        return True

    def _take_ack(self, ack: Ack, now: float) -> None:
        if self._take_estop_ack(ack):
            return
        pending = self._pending
        if pending is None or ack.seq != pending.seq or ack.type != pending.message.TYPE:
            return
        self._pending = None
        self._acknowledged += 1
        # A replayed status may be older than the state beside it: ARM was taken, and lost again.
        overtaken = isinstance(pending.message, Arm) and ack.state is not BoardState.ARMED
        if isinstance(pending.message, Pan):
            accepted = ack.status is AckStatus.OK
            self._pan_acknowledged = pending.message.rate if accepted else None
            self._next_pan = now + self._settings.pan_refresh
        elif ack.status is not AckStatus.OK or overtaken:
            self._refused += 1
            self._event(
                now,
                LinkEventCode.REFUSED,
                f"The board did not take {pending.name}: "
                f"{_REASONS[ack.status] if not overtaken else _state_reason(ack.state)}",
            )

    def _take_pong(self, message: Pong, now: float) -> None:
        if self._ping is None or message.echo != self._ping[0]:
            return
        self._round_trip = (now - self._ping[1]) * 1000
        best = self._best_round_trip
        self._best_round_trip = self._round_trip if best is None else min(best, self._round_trip)
        self._ping = None

    # ---- bytes out ---------------------------------------------------------------------------

    def poll(self, now: float) -> bytes:
        """What to write to the port now; empty while it is closed."""
        self._now = now
        if not self._open:
            return b""
        if self._board is not None and now - self._heard > self._settings.silence:
            self._event(now, LinkEventCode.SILENT, f"No telemetry for {now - self._heard:.1f} s.")
            self._disconnect()
            self._next_hello = now
        self._poll_estop(now)
        if self._board is None:
            self._poll_hello(now)
        else:
            self._poll_session(now)
        self._show_state(now)
        out = bytes(self._out)
        self._out.clear()
        return out

    def _poll_estop(self, now: float) -> None:
        if not self._estop_wanted:
            return
        if self._estop is None:
            self._out += DELIMITER
            self._estop = self._send_command(Estop(), now)
        elif now - self._estop.last_sent >= self._settings.resend_after:
            if self._estop.tries == self._settings.max_tries:
                self._tell_unanswered(self._estop, now)
            self._resend(self._estop, now)

    def _poll_hello(self, now: float) -> None:
        if now < self._next_hello:
            return
        self._next_hello = now + self._settings.hello_period
        self._out += DELIMITER
        self._hello_seq = self._send(Hello())

    def _poll_session(self, now: float) -> None:
        state = self.state
        self._poll_pending(now, state)
        if self._drive is not None and state is LinkState.ARMED:
            self._send(self._drive)
        self._drive = None
        if now >= self._next_ping:
            self._next_ping = now + self._settings.ping_period
            self._ping_count = (self._ping_count + 1) & 0xFFFFFFFF
            self._ping = (self._ping_count, now)
            self._send(Ping(self._ping_count))
        if now >= self._next_heartbeat:
            self._next_heartbeat = now + self._settings.heartbeat_period
            self._send(Heartbeat())

    def _poll_pending(self, now: float, state: LinkState) -> None:
        """One command at a time, or the board could not tell a repetition from a new one."""
        pending = self._pending
        if isinstance(pending and pending.message, Pan) and self._pan_superseded():
            pending = self._pending = None
        if pending is not None:
            settings = self._settings
            if now - pending.last_sent < settings.resend_after:
                return
            too_old = now - pending.first_sent >= settings.give_up_after
            if pending.tries < settings.max_tries and not too_old:
                self._resend(pending, now)
                return
            self._pending = None
            if isinstance(pending.message, Pan):
                self._next_pan = now + settings.pan_refresh
            self._tell_unanswered(pending, now)
        if self._estop_wanted:
            return
        if self._clear_wanted:
            self._clear_wanted = False
            self._pending = self._send_command(Clear(), now)
        elif self._arm_wanted:
            self._arm_wanted = False
            self._pending = self._send_command(Arm(), now)
        elif state in (LinkState.IDLE, LinkState.ARMED):
            self._poll_pan(now)

    def _pan_superseded(self) -> bool:
        """A pan on its way that is not worth repeating: something newer waits."""
        assert self._pending is not None
        message = self._pending.message
        newer = isinstance(message, Pan) and message.rate != self._pan_wanted
        return newer or self._arm_wanted or self._clear_wanted

    def _poll_pan(self, now: float) -> None:
        wanted = self._pan_wanted
        if wanted is None:
            return
        changed = wanted != self._pan_acknowledged and self._pan_acknowledged is not None
        renew = wanted != 0 or self._pan_acknowledged != 0
        if changed or (renew and now >= self._next_pan):
            self._pan_acknowledged = None
            self._next_pan = now
            self._pending = self._send_command(Pan(wanted), now)

    # ---- helpers -----------------------------------------------------------------------------

    def _send(self, message: HostMessage) -> int:
        seq = self._seq
        self._seq = (seq + 1) & 0xFF
        self._out += message.to_packet(seq).encode()
        self._sent += 1
        return seq

    def _send_command(self, message: HostMessage, now: float) -> _Pending:
        return _Pending(message, self._send(message), first_sent=now, last_sent=now)

    def _resend(self, pending: _Pending, now: float) -> None:
        pending.tries += 1
        pending.last_sent = now
        self._out += pending.message.to_packet(pending.seq).encode()
        self._sent += 1
        self._resent += 1

    def _tell_unanswered(self, pending: _Pending, now: float) -> None:
        self._unanswered += 1
        self._event(
            now,
            LinkEventCode.UNANSWERED,
            f"The board did not answer {pending.name} ({pending.tries} times sent).",
        )

    def _is_pending(self, kind: type[HostMessage]) -> bool:
        return self._pending is not None and isinstance(self._pending.message, kind)

    def _disconnect(self) -> None:
        """Forget the session and all that was asked for in it, except ESTOP and pan."""
        self._board = None
        self._board_state = None
        self._board_seq = None
        self._board_rx_errors = None
        self._clock.forget()
        self._hello_seq = None
        self._ping = None
        self._arm_wanted = self._clear_wanted = False
        self._pending = None
        self._drive = None
        self._pan_acknowledged = None

    def _require_board(self, what: str) -> None:
        if not self.ready:
            raise RefusedError(
                f"Cannot {what}: the board does not answer.",
                remedy="Check its cable and power.",
                code="link_not_ready",
            )

    def _event(self, now: float, code: LinkEventCode, message: str) -> None:
        self._events.append(LinkEvent(now, code, message, self.state))

    def _show_state(self, now: float) -> None:
        state = self.state
        if state is not self._shown_state:
            self._shown_state = state
            self._event(now, LinkEventCode.STATE, f"The board is {state.value}.")


_REASONS = {
    AckStatus.OK: "ok",
    AckStatus.VERSION: "another version of the protocol.",
    AckStatus.NOT_READY: "not in its present state.",
    AckStatus.LENGTH: "wrong length.",
    AckStatus.UNKNOWN_TYPE: "it does not know that command.",
    AckStatus.RANGE: "value out of range.",
}


def _state_reason(state: BoardState) -> str:
    return f"it is {state.name} by now."


def _clamp(value: int, limit: int) -> int:
    return max(-limit, min(limit, value))
