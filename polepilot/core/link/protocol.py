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

from polepilot.core.errors import RefusedError
from polepilot.core.link.clockmap import ClockMap
from polepilot.core.link.commands import CommandQueue, Notice, Sender
from polepilot.core.link.messages import (
    MAX_DUTY,
    Ack,
    AckStatus,
    BoardState,
    Drive,
    Features,
    Heartbeat,
    Hello,
    HelloAck,
    MessageType,
    Ping,
    Pong,
    Telemetry,
    decode_board,
)
from polepilot.core.link.packets import MAJOR, Packet, PacketParser
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


class HostLink:
    """One session after the other with one board. Starts CONNECTING."""

    def __init__(self, settings: LinkSettings | None = None) -> None:
        self._settings = settings or LinkSettings()
        self._parser = PacketParser()
        self._sender = Sender()
        self._commands = CommandQueue(self._settings, self._sender)
        self._events: list[LinkEvent] = []
        self._samples: deque[TelemetrySample] = deque(maxlen=200)
        self._arrivals: deque[float] = deque(maxlen=400)
        self._trips: deque[float] = deque(maxlen=200)
        self._clock = ClockMap()
        self._now = 0.0

        self._open = True
        self._board: HelloAck | None = None
        self._board_state: BoardState | None = None
        self._latest: TelemetrySample | None = None
        self._heard = 0.0
        self._shown_state = LinkState.CONNECTING
        self._mismatch_told = False
        self._drive: Drive | None = None

        self._hello_seq: int | None = None
        self._next_hello = 0.0
        self._next_heartbeat = 0.0
        self._next_ping = 0.0
        self._ping: tuple[int, float] | None = None
        self._ping_count = 0

        self._received = self._lost = self._board_rejected = self._handshakes = 0
        self._telemetry_seq: int | None = None
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
        if self._commands.estop_wanted:
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
        return self._commands.estop_wanted

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

    def round_trips(self) -> list[float]:
        """Of the PINGs answered since the last call, milliseconds; at most the last 200."""
        trips = list(self._trips)
        self._trips.clear()
        return trips

    def events(self) -> list[LinkEvent]:
        """What happened since the last call, oldest first."""
        events, self._events = self._events, []
        return events

    @property
    def statistics(self) -> LinkStatistics:
        recent = [stamp for stamp in self._arrivals if stamp > self._now - 1.0]
        errors = self._parser.errors
        return LinkStatistics(
            sent=self._sender.sent,
            resent=self._sender.resent,
            acknowledged=self._commands.acknowledged,
            refused=self._commands.refused,
            unanswered=self._commands.unanswered,
            received=self._received,
            lost=self._lost,
            rejected=errors.total,
            crc_errors=errors.crc,
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
        self._commands.pan_wanted = _clamp(rate, MAX_DUTY)

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
        self._commands.arm_wanted = self.state is not LinkState.ARMED

    def disarm(self) -> None:
        """Back to IDLE, by a new handshake; a latched stop stays latched, unlike with CLEAR."""
        if self.state in (LinkState.ARMED, LinkState.LINK_LOST) or self._commands.arming:
            self._disconnect()

    def estop(self) -> None:
        """Stop and stay stopped. Works in every state, before the handshake too.

        Sent at the next poll and repeated until the board acknowledges it.
        """
        self._drive = None
        self._commands.want_estop()

    def clear(self) -> None:
        """End a latched stop; the board becomes IDLE. Nothing happens in any other state.

        Raises:
            RefusedError: no board.
        """
        self._require_board("clear the stop")
        self._commands.clear_wanted = self.state is LinkState.ESTOP

    def reset(self, now: float) -> None:
        """The port was opened, again or for the first time: start with a handshake."""
        self._now = now
        self._open = True
        self._parser.clear()
        self._sender.take()
        self._disconnect()
        self._next_heartbeat = now
        self._show_state(now)

    def port_lost(self, now: float, reason: str) -> None:
        """The port is gone: nothing is sent until :meth:`reset`. A wanted ESTOP stays wanted."""
        self._now = now
        if not self._open:
            return
        self._open = False
        self._sender.take()
        self._disconnect()
        self._shown_state = self.state
        self._event(now, LinkEventCode.CLOSED, reason)

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
        elif self._board is None:
            # Before the versions agree nothing counts but the answer to ESTOP.
            if isinstance(message, Ack):
                self._commands.take_estop_ack(message)
        elif isinstance(message, Telemetry):
            self._take_telemetry(message, packet.seq, now)
        elif isinstance(message, Ack):
            self._board_state = message.state
            self._tell(now, self._commands.take_ack(message, now))
        else:
            self._take_pong(message, now)

    def _take_hello_ack(self, message: HelloAck, seq: int, now: float) -> None:
        if self._board is not None or seq != self._hello_seq:
            return
        if not message.ok or message.major != MAJOR:
            self._tell_mismatch(now, message.major)
            return
        self._board = message
        self._board_state = message.state
        self._mismatch_told = False
        self._heard = now
        self._next_ping = now
        self._handshakes += 1
        self._shown_state = self.state
        self._event(
            now,
            LinkEventCode.CONNECTED,
            f"Board {message.board.name.lower()}, firmware "
            f"{message.firmware_major}.{message.firmware_minor}.",
        )

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

    def _take_telemetry(self, message: Telemetry, seq: int, now: float) -> None:
        if self._clock.went_back(message.t_ms):
            self._disconnect()
            self._event(now, LinkEventCode.BOARD_RESET, "The board has restarted.")
            return
        self._heard = now
        self._board_state = message.state
        stamp = self._clock.to_host(message.t_ms, now)
        self._latest = TelemetrySample(stamp=stamp, received=now, telemetry=message)
        self._samples.append(self._latest)
        self._arrivals.append(now)
        if self._telemetry_seq is not None:
            self._lost += (seq - self._telemetry_seq - 1) & 0xFF
        self._telemetry_seq = seq
        if self._board_rx_errors is not None:
            self._board_rejected += (message.rx_errors - self._board_rx_errors) & 0xFF
        self._board_rx_errors = message.rx_errors

    def _take_pong(self, message: Pong, now: float) -> None:
        if self._ping is None or message.echo != self._ping[0]:
            return
        self._round_trip = (now - self._ping[1]) * 1000
        self._trips.append(self._round_trip)
        best = self._best_round_trip
        self._best_round_trip = self._round_trip if best is None else min(best, self._round_trip)
        self._ping = None

    # ---- bytes out ---------------------------------------------------------------------------

    def poll(self, now: float) -> bytes:
        """What to write to the port now; empty while it is closed."""
        self._now = now
        if not self._open:
            return b""
        silence = now - self._heard
        if self._board is not None and silence > self._settings.silence:
            self._disconnect()
            self._event(now, LinkEventCode.SILENT, f"No telemetry for {silence:.1f} s.")
        self._tell(now, self._commands.poll_estop(now))
        if self._board is None or self._board_state is None:
            self._poll_hello(now)
        else:
            self._tell(now, self._commands.poll(now, self._board_state))
            self._poll_stream(now)
        self._show_state(now)
        return self._sender.take()

    def _poll_hello(self, now: float) -> None:
        if now < self._next_hello:
            return
        self._next_hello = now + self._settings.hello_period
        self._sender.resynchronise()
        self._hello_seq = self._sender.send(Hello())

    def _poll_stream(self, now: float) -> None:
        """What goes out without an acknowledgement."""
        if self._drive is not None and self.armed:
            self._sender.send(self._drive)
        self._drive = None
        if now >= self._next_ping:
            self._next_ping = now + self._settings.ping_period
            self._ping_count = (self._ping_count + 1) & 0xFFFFFFFF
            self._ping = (self._ping_count, now)
            self._sender.send(Ping(self._ping_count))
        if now >= self._next_heartbeat:
            self._next_heartbeat = now + self._settings.heartbeat_period
            self._sender.send(Heartbeat())

    # ---- helpers -----------------------------------------------------------------------------

    def _disconnect(self) -> None:
        """Forget the session and all that was asked for in it, except ESTOP and pan."""
        self._board = None
        self._board_state = None
        self._telemetry_seq = None
        self._board_rx_errors = None
        self._clock.forget()
        self._hello_seq = None
        self._next_hello = -float("inf")
        self._ping = None
        self._drive = None
        self._commands.forget()

    def _require_board(self, what: str) -> None:
        if not self.ready:
            raise RefusedError(
                f"Cannot {what}: the board does not answer.",
                remedy="Check its cable and power.",
                code="link_not_ready",
            )

    def _tell(self, now: float, notices: list[Notice]) -> None:
        for code, message in notices:
            self._event(now, code, message)

    def _event(self, now: float, code: LinkEventCode, message: str) -> None:
        self._events.append(LinkEvent(now, code, message, self.state))

    def _show_state(self, now: float) -> None:
        state = self.state
        if state is not self._shown_state:
            self._shown_state = state
            self._event(now, LinkEventCode.STATE, _STATES[state])


_STATES = {
    LinkState.CLOSED: "The line to the board is closed.",
    LinkState.CONNECTING: "Looking for the board.",
    LinkState.IDLE: "The board is ready; its motors are off.",
    LinkState.ARMED: "The board lets the motors run.",
    LinkState.LINK_LOST: "The board missed us and has stopped the motors.",
    LinkState.ESTOP: "The board is stopped until somebody releases it.",
}


def _clamp(value: int, limit: int) -> int:
    return max(-limit, min(limit, value))
