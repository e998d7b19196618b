"""What the host's end of the link tells its owner, and how patient it is."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum
from typing import NamedTuple

from polepilot.core.link.messages import Telemetry


class Chunk(NamedTuple):
    """Bytes from the line, and when they came (seconds of the host's clock)."""

    stamp: float
    data: bytes


class LinkState(StrEnum):
    CLOSED = "closed"
    """There is no port."""
    CONNECTING = "connecting"
    """The board has not answered yet, or not any more."""
    IDLE = "idle"
    ARMED = "armed"
    LINK_LOST = "link_lost"
    """The board missed us and stopped; it wants to be armed again."""
    ESTOP = "estop"
    """Latched, by us or by the button; or asked for and not yet acknowledged."""


class LinkEventCode(StrEnum):
    CONNECTED = "connected"
    CLOSED = "closed"
    SILENT = "silent"
    BOARD_RESET = "board_reset"
    VERSION_MISMATCH = "version_mismatch"
    STATE = "state"
    REFUSED = "refused"
    UNANSWERED = "unanswered"


@dataclass(frozen=True, slots=True)
class LinkEvent:
    """Something that the owner should know, log or show."""

    stamp: float
    code: LinkEventCode
    message: str
    state: LinkState
    """After the event."""


@dataclass(frozen=True, slots=True)
class LinkSettings:
    """Periods and patience, seconds."""

    heartbeat_period: float = 0.05
    hello_period: float = 0.25
    ping_period: float = 1.0
    pan_refresh: float = 0.5
    """The board stops the pan motor 1 s after the last PAN."""
    resend_after: float = 0.06
    max_tries: int = 5
    give_up_after: float = 0.4
    """Below the 0.5 s for which a board knows a repetition."""
    silence: float = 0.5
    """Without telemetry for so long: start again with HELLO."""


@dataclass(frozen=True, slots=True)
class TelemetrySample:
    """Telemetry, and when it was."""

    stamp: float
    """When the board measured, on the host's clock."""
    received: float
    """When the host read it."""
    telemetry: Telemetry


@dataclass(frozen=True, slots=True)
class LinkStatistics:
    """Counts since the start; ``lost`` and ``rejected`` are packets of the board."""

    sent: int = 0
    resent: int = 0
    acknowledged: int = 0
    refused: int = 0
    unanswered: int = 0
    received: int = 0
    lost: int = 0
    """Gaps in the board's sequence numbers."""
    rejected: int = 0
    """Bytes that were no packet: bad CRC, bad framing, oversize."""
    crc_errors: int = 0
    board_rejected: int = 0
    """The same, as the board counts it."""
    handshakes: int = 0
    round_trip_ms: float | None = None
    """Of the last PING; the owner's tick is part of it."""
    best_round_trip_ms: float | None = None
    telemetry_rate: float = 0.0
    """Per second, over the last second."""
