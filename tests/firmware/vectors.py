"""Byte vectors that C and Python share: ``python tests/firmware/vectors.py`` writes them anew.

One per line of ``firmware/tests/vectors.txt.gz``, bytes in hexadecimal:

    packet BODY WIRE              a body without its CRC, and the whole packet on the line
    stream BYTES ERRORS BODY...   what a receiver makes of a stream: how many frames it throws away,
                                  and the bodies of the packets in it
    board STEP...                 a board from power-up on: +MS time passes, b1 and b0 the button,
                                  >BYTES come in, <BYTES one answer (telemetry is left out)
"""

from __future__ import annotations

import gzip
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from polepilot.core.link.messages import (
    Arm,
    Clear,
    Drive,
    Estop,
    Heartbeat,
    Hello,
    HostMessage,
    MessageType,
    Pan,
    Ping,
)
from polepilot.core.link.packets import Packet, PacketParser
from polepilot.core.sim.board import Board, BoardInputs

FILE = Path(__file__).parents[2] / "firmware" / "tests" / "vectors.txt.gz"
SEED = 1789
PACKETS, STREAMS, BOARDS = 2000, 1500, 500
FREE = BoardInputs(proximity_mm=(1500, 1500, 1500))


def lines() -> Iterator[str]:
    """All vectors."""
    rng = np.random.default_rng(SEED)
    for _ in range(PACKETS):
        packet = _packet(rng)
        yield f"packet {_body(packet).hex()} {packet.encode().hex()}"
    for _ in range(STREAMS):
        data = _stream(rng)
        parser = PacketParser()
        found = [_body(packet).hex() for packet in parser.feed(data)]
        yield " ".join(["stream", data.hex(), str(parser.errors.total), *found])
    for _ in range(BOARDS):
        yield " ".join(["board", *_dialogue(rng)])


def _body(packet: Packet) -> bytes:
    return bytes((packet.major, packet.type, packet.seq)) + packet.payload


def _packet(rng: np.random.Generator) -> Packet:
    """Any; zeros are frequent, for they are what stuffing is about."""
    size = int(rng.integers(0, 41)) if rng.random() < 0.2 else int(rng.integers(0, 9))
    payload = rng.integers(0, 256, size) * (rng.random(size) < rng.random())
    type_, seq = (int(value) for value in rng.integers(0, 256, 2))
    return Packet(type=type_, seq=seq, payload=payload.astype(np.uint8).tobytes(), major=1)


def _stream(rng: np.random.Generator) -> bytes:
    """Packets after each other, with what lines do to them."""
    data = bytearray(b"".join(_packet(rng).encode() for _ in range(rng.integers(1, 4))))
    for _ in range(rng.integers(0, 4)):
        place = int(rng.integers(0, len(data)))
        match int(rng.integers(0, 5)):
            case 0:
                data[place] ^= 1 << int(rng.integers(0, 8))
            case 1:
                del data[place : place + int(rng.integers(1, 4))]
            case 2:
                data[place:place] = data[place : place + 5]
            case 3:
                data[place:place] = bytes(int(rng.integers(1, 4)))
            case _:
                data[place:place] = bytes([int(rng.integers(1, 256))]) * int(rng.integers(1, 60))
        if not data:
            return b"\x00"
    return bytes(data)


def _dialogue(rng: np.random.Generator) -> Iterator[str]:
    board, ms, inputs = Board(), 0, FREE
    sent: list[bytes] = []
    for step in range(rng.integers(4, 14)):
        choice = rng.random()
        if step == 0 and choice < 0.8:
            data = Hello().to_packet(step).encode()
            board.receive(data, 0.0)
            yield f">{data.hex()}"
            yield f"<{board.transmit().hex()}"
        elif choice < 0.3:
            wait = int(rng.choice([1, 5, 40, 249, 250, 251, 499, 500, 501]))
            for _ in range(wait):
                ms += 1
                board.step(ms / 1000, inputs)
            yield f"+{wait}"
        elif choice < 0.36:
            pressed = not inputs.stop_button
            inputs = BoardInputs(proximity_mm=FREE.proximity_mm, stop_button=pressed)
            ms += 1
            board.step(ms / 1000, inputs)
            yield f"b{pressed:d}"
            yield "+1"
        else:
            data = sent[-1] if sent and rng.random() < 0.3 else _command(rng)
            sent.append(data)
            yield f">{data.hex()}"
            board.transmit()
            board.receive(data, ms / 1000)
            for packet in PacketParser().feed(board.transmit()):
                if packet.type != MessageType.TELEMETRY:
                    yield f"<{packet.encode().hex()}"


def _command(rng: np.random.Generator) -> bytes:
    seq = int(rng.integers(0, 256))
    value = int(rng.integers(-2000, 2000))
    messages: list[HostMessage] = [
        *(Hello(), Hello(), Hello(2), Hello(1, 7), Heartbeat(), Arm(), Arm(), Arm(), Estop()),
        *(Clear(), Clear(), Clear(value & 0xFFFF), Ping(value & 0xFFFFFFFF), Pan(value), Pan(0)),
        Drive(value, -value, value),
    ]
    if rng.random() < 0.8:
        return messages[int(rng.integers(len(messages)))].to_packet(seq).encode()
    size = int(rng.integers(0, 9))
    payload = rng.integers(0, 256, size).astype(np.uint8).tobytes()
    kind = int(rng.choice([1, 2, 3, 4, 5, 6, 7, 8, 9, 0x81, 0x55, 0]))
    major = 1 if rng.random() < 0.7 else int(rng.integers(0, 256))
    return Packet(type=kind, seq=seq, payload=payload, major=major).encode()


def main() -> None:
    """Write the file, whole or not at all."""
    fresh = FILE.with_suffix(".new")
    with fresh.open("wb") as raw, gzip.GzipFile("", "wb", 9, raw, mtime=0) as packed:
        packed.write(("\n".join(lines()) + "\n").encode("ascii"))
    fresh.replace(FILE)
    print(f"{FILE}: {FILE.stat().st_size} bytes")


if __name__ == "__main__":
    main()
