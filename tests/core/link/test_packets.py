"""Framing: golden bytes, round trips, and a parser that takes anything and believes nothing."""

from __future__ import annotations

import itertools

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from polepilot.core.errors import InternalError
from polepilot.core.link.crc import crc16
from polepilot.core.link.packets import (
    MAX_ENCODED,
    MAX_PAYLOAD,
    Packet,
    PacketParser,
    cobs_decode,
    cobs_encode,
)

BYTE = st.integers(0, 255)
PACKETS = st.builds(
    Packet, type=BYTE, seq=BYTE, payload=st.binary(max_size=MAX_PAYLOAD), major=BYTE
)


def test_crc_check_value() -> None:
    assert crc16(b"123456789") == 0x29B1
    assert crc16(b"") == 0xFFFF


def test_golden_packets() -> None:
    assert crc16(bytes((0x01, 0x06, 0x09))) == 0xC023
    assert Packet(type=0x06, seq=9).encode().hex() == "0601060923c000"
    drive = (500).to_bytes(2, "little") + (-250 & 0xFFFF).to_bytes(2, "little") + b"\xd2\x04"
    assert Packet(type=0x03, seq=7, payload=drive).encode().hex() == "0c010307f40106ffd20417c400"


@pytest.mark.parametrize(
    ("data", "encoded"),
    [
        ("", "01"),
        ("00", "0101"),
        ("0000", "010101"),
        ("11220033", "0311220233"),
        ("1100", "021101"),
    ],
)
def test_cobs_examples(data: str, encoded: str) -> None:
    assert cobs_encode(bytes.fromhex(data)).hex() == encoded
    assert cobs_decode(bytes.fromhex(encoded)) == bytes.fromhex(data)


@pytest.mark.parametrize("bad", ["", "00", "05", "0511", "031122ff", "030011", "ff11"])
def test_cobs_refuses_what_it_would_not_write(bad: str) -> None:
    assert cobs_decode(bytes.fromhex(bad)) is None


@settings(deadline=None)
@given(st.binary(max_size=100))
def test_cobs_round_trip(data: bytes) -> None:
    encoded = cobs_encode(data)
    assert 0 not in encoded
    assert cobs_decode(encoded) == data


@settings(deadline=None)
@given(st.binary(min_size=1, max_size=60))
def test_each_cobs_text_has_one_reading(encoded: bytes) -> None:
    data = cobs_decode(encoded)
    assert data is None or cobs_encode(data) == encoded


@settings(deadline=None)
@given(st.lists(PACKETS, max_size=8), st.data())
def test_packets_survive_any_cutting_of_the_stream(
    packets: list[Packet], data: st.DataObject
) -> None:
    stream = b"".join(packet.encode() for packet in packets)
    cuts = data.draw(st.lists(st.integers(0, len(stream)), max_size=6).map(sorted))
    parser = PacketParser()
    found: list[Packet] = []
    for start, end in itertools.pairwise([0, *cuts, len(stream)]):
        found += parser.feed(stream[start:end])
    assert found == packets
    assert parser.errors.total == 0


@settings(deadline=None)
@given(st.lists(st.binary(max_size=200), max_size=6))
def test_garbage_never_raises_and_never_piles_up(pieces: list[bytes]) -> None:
    parser = PacketParser()
    for piece in pieces:
        for packet in parser.feed(piece):
            assert packet.encode() in b"\x00" + b"".join(pieces)
        assert parser.buffered <= MAX_ENCODED


def test_random_garbage_is_not_accepted() -> None:
    """A 16-bit CRC lets one bad frame in 65536 pass; this seed has none in 20000."""
    rng = np.random.default_rng(7)
    parser = PacketParser()
    for _ in range(20000):
        frame = rng.integers(1, 256, size=int(rng.integers(6, MAX_ENCODED))).astype(np.uint8)
        assert parser.feed(frame.tobytes() + b"\x00") == []
    assert parser.errors.total == 20000


@settings(deadline=None)
@given(PACKETS, st.data())
def test_a_flipped_bit_is_found(packet: Packet, data: st.DataObject) -> None:
    encoded = bytearray(packet.encode())
    place = data.draw(st.integers(0, len(encoded) - 1))
    encoded[place] ^= 1 << data.draw(st.integers(0, 7))
    parser = PacketParser()
    assert packet not in parser.feed(bytes(encoded))
    parser.feed(b"\x00")
    assert parser.feed(packet.encode()) == [packet], "out of step after an error"


def test_errors_are_counted_by_kind() -> None:
    parser = PacketParser()
    good = Packet(type=2, seq=1).encode()
    assert parser.feed(b"\x00\x00" + good) == [Packet(type=2, seq=1)]
    assert parser.errors.total == 0, "empty frames resynchronise and are no errors"
    parser.feed(bytes([good[0], good[1] ^ 2]) + good[2:])
    assert parser.errors.crc == 1
    parser.feed(b"\x09\x01\x00")
    parser.feed(cobs_encode(b"\x01\x02") + b"\x00")
    assert parser.errors.cobs == 2
    parser.feed(b"\x01" * 1000)
    parser.feed(b"\x01" * 1000 + b"\x00")
    assert parser.errors.oversize == 1, "one frame, one error"
    assert parser.feed(good) == [Packet(type=2, seq=1)]


def test_the_longest_packet_fits() -> None:
    packet = Packet(type=0x83, seq=255, payload=bytes(MAX_PAYLOAD))
    assert len(packet.encode()) == MAX_ENCODED + 1
    assert PacketParser().feed(packet.encode()) == [packet]
    with pytest.raises(InternalError, match="41 bytes"):
        Packet(type=1, seq=1, payload=bytes(MAX_PAYLOAD + 1))
    with pytest.raises(InternalError, match="seq"):
        Packet(type=1, seq=256)
