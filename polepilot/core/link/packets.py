"""Packets: a body of major version, type, sequence number and payload, guarded and framed.

On the wire a packet is ``COBS(body + CRC) 00``; COBS (consistent overhead byte stuffing) removes
every zero from the body, so that a zero ends a packet and nothing else does. After any
disturbance the next zero puts both sides in step again.
"""

from __future__ import annotations

from dataclasses import dataclass

from polepilot.core.errors import InternalError
from polepilot.core.link.crc import crc16

MAJOR = 1
"""Version of the protocol in the first byte of each body; another one is not understood."""
MINOR = 0
MAX_PAYLOAD = 40
HEADER_SIZE = 3
CRC_SIZE = 2
MIN_BODY = HEADER_SIZE + CRC_SIZE
MAX_BODY = HEADER_SIZE + MAX_PAYLOAD + CRC_SIZE
MAX_ENCODED = MAX_BODY + 1
"""Of a framed body, without the zero at its end: bodies this short need one extra byte."""
DELIMITER = b"\x00"


@dataclass(frozen=True, slots=True)
class Packet:
    """One packet, its payload not yet understood."""

    type: int
    seq: int
    payload: bytes = b""
    major: int = MAJOR

    def __post_init__(self) -> None:
        for name in ("type", "seq", "major"):
            if not 0 <= getattr(self, name) <= 0xFF:
                raise InternalError(f"packet {name} {getattr(self, name)} does not fit one byte")
        if len(self.payload) > MAX_PAYLOAD:
            raise InternalError(f"payload of {len(self.payload)} bytes, at most {MAX_PAYLOAD}")

    def encode(self) -> bytes:
        """The bytes for the wire, the zero at the end included."""
        body = bytes((self.major, self.type, self.seq)) + self.payload
        return cobs_encode(body + crc16(body).to_bytes(CRC_SIZE, "little")) + DELIMITER


def cobs_encode(data: bytes) -> bytes:
    """``data`` without zeros: each is replaced by the distance to the next one.

    Raises:
        InternalError: 254 bytes or more, which no packet has and this encoder does not split.
    """
    if len(data) >= 0xFE:
        raise InternalError(f"{len(data)} bytes are too many for one frame")
    return b"".join(bytes((len(block) + 1,)) + block for block in data.split(b"\x00"))


def cobs_decode(data: bytes) -> bytes | None:
    """The inverse of :func:`cobs_encode`; None where ``data`` is no such encoding."""
    if not data:
        return None
    blocks: list[bytes] = []
    start = 0
    while start < len(data):
        code = data[start]
        end = start + code
        if code in (0, 0xFF) or end > len(data):
            return None
        block = data[start + 1 : end]
        if 0 in block:
            return None
        blocks.append(block)
        start = end
    return b"\x00".join(blocks)


@dataclass(frozen=True, slots=True)
class ParserErrors:
    """What a parser has thrown away since it was made."""

    crc: int = 0
    cobs: int = 0
    """Bad stuffing, or a body too short to be one."""
    oversize: int = 0

    @property
    def total(self) -> int:
        return self.crc + self.cobs + self.oversize


class PacketParser:
    """Finds packets in a byte stream that may hold anything.

    Never raises, and never holds more than one packet's worth of bytes.
    """

    def __init__(self) -> None:
        self._buffer = bytearray()
        self._skipping = False
        self._crc = 0
        self._cobs = 0
        self._oversize = 0

    @property
    def errors(self) -> ParserErrors:
        return ParserErrors(self._crc, self._cobs, self._oversize)

    @property
    def buffered(self) -> int:
        """Bytes of an unfinished packet."""
        return len(self._buffer)

    def clear(self) -> None:
        """Forget an unfinished packet; the counts stay."""
        self._buffer.clear()
        self._skipping = False

    def feed(self, data: bytes) -> list[Packet]:
        """The packets that ``data`` completes, in order."""
        packets: list[Packet] = []
        *complete, rest = data.split(DELIMITER)
        for piece in complete:
            self._take(piece)
            packet = self._finish()
            if packet is not None:
                packets.append(packet)
        self._take(rest)
        return packets

    def _take(self, piece: bytes) -> None:
        if self._skipping:
            return
        if len(self._buffer) + len(piece) > MAX_ENCODED:
            self._buffer.clear()
            self._skipping = True
            self._oversize += 1
            return
        self._buffer += piece

    def _finish(self) -> Packet | None:
        """The packet that a zero has ended. Empty frames resynchronise and are no error."""
        encoded = bytes(self._buffer)
        skipped = self._skipping
        self.clear()
        if skipped or not encoded:
            return None
        body = cobs_decode(encoded)
        if body is None or len(body) < MIN_BODY:
            self._cobs += 1
            return None
        content = body[:-CRC_SIZE]
        if crc16(content) != int.from_bytes(body[-CRC_SIZE:], "little"):
            self._crc += 1
            return None
        return Packet(
            major=content[0], type=content[1], seq=content[2], payload=content[HEADER_SIZE:]
        )
