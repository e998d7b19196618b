"""Commands that want an acknowledgement: which goes next, which is repeated, which is given up.

One at a time (stop and wait): a board knows the last command only, and would carry out a
repetition of an earlier one once more. ESTOP is outside of this order and overtakes everything;
a PAN on its way gives way to whatever is newer.
"""

from __future__ import annotations

from dataclasses import dataclass

from polepilot.core.link.messages import (
    Ack,
    AckStatus,
    Arm,
    BoardState,
    Clear,
    Estop,
    HostMessage,
    MessageType,
    Pan,
)
from polepilot.core.link.packets import DELIMITER
from polepilot.core.link.report import LinkEventCode, LinkSettings


class Sender:
    """Numbers messages and collects their bytes."""

    def __init__(self) -> None:
        self.sent = 0
        self.resent = 0
        self._out = bytearray()
        self._seq = 0

    def send(self, message: HostMessage) -> int:
        """Queue ``message`` under the next sequence number, which is returned."""
        seq = self._seq
        self._seq = (seq + 1) & 0xFF
        self._out += message.to_packet(seq).encode()
        self.sent += 1
        return seq

    def resend(self, message: HostMessage, seq: int) -> None:
        self._out += message.to_packet(seq).encode()
        self.sent += 1
        self.resent += 1

    def resynchronise(self) -> None:
        """End whatever half packet the other side may hold."""
        self._out += DELIMITER

    def take(self) -> bytes:
        """All queued bytes; the queue is empty afterwards."""
        data = bytes(self._out)
        self._out.clear()
        return data


@dataclass(slots=True)
class _Pending:
    """A command on its way to be acknowledged."""

    message: HostMessage
    seq: int
    first_sent: float
    last_sent: float
    tries: int = 1


Notice = tuple[LinkEventCode, str]
"""Something to tell the owner."""


class CommandQueue:
    """What the owner wants of the board, and how far each wish has come."""

    def __init__(self, settings: LinkSettings, sender: Sender) -> None:
        self._settings = settings
        self._sender = sender
        self._estop: _Pending | None = None
        self._pending: _Pending | None = None
        self._pan_acknowledged: int | None = None
        self._next_pan = 0.0
        self.estop_wanted = False
        self.arm_wanted = False
        self.clear_wanted = False
        self.pan_wanted: int | None = None
        self.acknowledged = 0
        self.refused = 0
        self.unanswered = 0

    @property
    def arming(self) -> bool:
        """ARM is wanted or on its way."""
        return self.arm_wanted or self._is_pending(Arm)

    def want_estop(self) -> None:
        if not self.estop_wanted:
            self._estop = None
        self.estop_wanted = True
        self._pending = None
        self.arm_wanted = self.clear_wanted = False

    def forget(self) -> None:
        """The session is over: all wishes with it, except ESTOP and pan."""
        self._pending = None
        self.arm_wanted = self.clear_wanted = False
        self._pan_acknowledged = None
        self._next_pan = 0.0

    # ---- out ---------------------------------------------------------------------------------

    def poll_estop(self, now: float) -> list[Notice]:
        """Allowed in every session and outside of one; repeated until acknowledged."""
        if not self.estop_wanted:
            return []
        pending = self._estop
        if pending is None:
            self._sender.resynchronise()
            self._estop = self._send(Estop(), now)
            return []
        if now - pending.last_sent < self._settings.resend_after:
            return []
        self._resend(pending, now)
        return self._unanswered(pending) if pending.tries == self._settings.max_tries + 1 else []

    def poll(self, now: float, state: BoardState) -> list[Notice]:
        """The other commands, within a session."""
        if self._is_pending(Pan) and self._pan_superseded():
            self._pending = None
        notices: list[Notice] = []
        pending = self._pending
        if pending is not None:
            if now - pending.last_sent < self._settings.resend_after:
                return []
            if self._worth_repeating(pending, now):
                self._resend(pending, now)
                return []
            self._pending = None
            self._next_pan = now + self._settings.pan_refresh
            notices = self._unanswered(pending)
        if not self.estop_wanted:
            self._send_next(now, state)
        return notices

    def _worth_repeating(self, pending: _Pending, now: float) -> bool:
        """Few tries, and young enough for the board to know it as a repetition."""
        young = now - pending.first_sent < self._settings.give_up_after
        return young and pending.tries < self._settings.max_tries

    def _send_next(self, now: float, state: BoardState) -> None:
        if self.clear_wanted:
            self.clear_wanted = False
            self._pending = self._send(Clear(), now)
        elif self.arm_wanted:
            self.arm_wanted = False
            self._pending = self._send(Arm(), now)
        elif state in (BoardState.IDLE, BoardState.ARMED):
            self._send_pan(now)
        else:
            # A stopped board has switched the pan motor off and takes no PAN.
            self._pan_acknowledged = None
            self._next_pan = now

    def _send_pan(self, now: float) -> None:
        wanted, current = self.pan_wanted, self._pan_acknowledged
        if wanted is None or (wanted == 0 and current == 0):
            return
        changed = current is not None and wanted != current
        if changed or now >= self._next_pan:
            self._pan_acknowledged = None
            self._next_pan = now
            self._pending = self._send(Pan(wanted), now)

    def _pan_superseded(self) -> bool:
        assert self._pending is not None
        message = self._pending.message
        newer = isinstance(message, Pan) and message.rate != self.pan_wanted
        return newer or self.arm_wanted or self.clear_wanted

    # ---- in ----------------------------------------------------------------------------------

    def take_estop_ack(self, ack: Ack) -> bool:
        """Whether ``ack`` was for the ESTOP on its way."""
        pending = self._estop
        if pending is None or ack.type != MessageType.ESTOP or ack.seq != pending.seq:
            return False
        if ack.state is BoardState.ESTOP:
            self._estop = None
            self.estop_wanted = False
            self.acknowledged += 1
        return True

    def take_ack(self, ack: Ack, now: float) -> list[Notice]:
        """Any acknowledgement of this session; those of given-up commands mean nothing."""
        if self.take_estop_ack(ack):
            return []
        pending = self._pending
        if pending is None or ack.seq != pending.seq or ack.type != pending.message.TYPE:
            return []
        self._pending = None
        self.acknowledged += 1
        if isinstance(pending.message, Pan):
            accepted = ack.status is AckStatus.OK
            self._pan_acknowledged = pending.message.rate if accepted else None
            self._next_pan = now + self._settings.pan_refresh
            return []
        # A replayed status can be older than the state beside it: armed, and lost again since.
        overtaken = isinstance(pending.message, Arm) and ack.state is not BoardState.ARMED
        if ack.status is AckStatus.OK and not overtaken:
            return []
        self.refused += 1
        reason = (
            f"it is {ack.state.name} by now."
            if ack.status is AckStatus.OK
            else _REASONS[ack.status]
        )
        name = pending.message.TYPE.name
        return [(LinkEventCode.REFUSED, f"The board did not take {name}: {reason}")]

    # ---- helpers -----------------------------------------------------------------------------

    def _is_pending(self, kind: type[HostMessage]) -> bool:
        return self._pending is not None and isinstance(self._pending.message, kind)

    def _send(self, message: HostMessage, now: float) -> _Pending:
        return _Pending(message, self._sender.send(message), first_sent=now, last_sent=now)

    def _resend(self, pending: _Pending, now: float) -> None:
        pending.tries += 1
        pending.last_sent = now
        self._sender.resend(pending.message, pending.seq)

    def _unanswered(self, pending: _Pending) -> list[Notice]:
        self.unanswered += 1
        name = pending.message.TYPE.name
        return [(LinkEventCode.UNANSWERED, f"The board does not answer {name}.")]


_REASONS = {
    AckStatus.VERSION: "it speaks another version of the protocol.",
    AckStatus.NOT_READY: "not in its present state, or the stop button is pressed.",
    AckStatus.LENGTH: "wrong length.",
    AckStatus.UNKNOWN_TYPE: "it does not know that command.",
    AckStatus.RANGE: "value out of range.",
}
