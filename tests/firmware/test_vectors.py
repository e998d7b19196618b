"""The Python side of the vectors that C reads too."""

from __future__ import annotations

import gzip
import re

import pytest

from firmware import vectors
from polepilot.core.link.messages import MessageType, decode_board
from polepilot.core.link.packets import Packet, PacketParser
from polepilot.core.sim.board import Board, BoardInputs

LINES = gzip.decompress(vectors.FILE.read_bytes()).decode("ascii").splitlines()


def of_kind(kind: str) -> list[list[str]]:
    return [words[1:] for line in LINES if (words := line.split())[0] == kind]


def unpacked(body: str) -> Packet:
    data = bytes.fromhex(body)
    return Packet(major=data[0], type=data[1], seq=data[2], payload=data[3:])


def test_the_file_is_what_its_seed_says() -> None:
    assert list(vectors.lines()) == LINES, "run python tests/firmware/vectors.py"


def test_there_are_several_thousand() -> None:
    assert len(of_kind("packet")) == vectors.PACKETS
    assert len(of_kind("stream")) == vectors.STREAMS
    assert len(of_kind("board")) == vectors.BOARDS
    assert vectors.FILE.stat().st_size < 200_000


def test_packets() -> None:
    for body, wire in of_kind("packet"):
        assert unpacked(body).encode().hex() == wire
        assert PacketParser().feed(bytes.fromhex(wire)) == [unpacked(body)]


def test_streams() -> None:
    errors = 0
    for stream, count, *bodies in of_kind("stream"):
        parser = PacketParser()
        assert parser.feed(bytes.fromhex(stream)) == [unpacked(body) for body in bodies]
        assert parser.errors.total == int(count)
        errors += int(count)
    assert errors > 500


def test_boards() -> None:
    """Each dialogue once more; every answer is one that a host understands."""
    for script in of_kind("board"):
        replay(script)


def replay(script: list[str]) -> None:
    board, ms, button = Board(), 0, False
    answers: list[str] = []
    for step in script:
        if step[0] != "<":
            assert answers == []
        if step[0] == "+":
            for _ in range(int(step[1:])):
                ms += 1
                inputs = BoardInputs(proximity_mm=(1500, 1500, 1500), stop_button=button)
                board.step(ms / 1000, inputs)
        elif step[0] == "b":
            button = step == "b1"
        elif step[0] == ">":
            board.transmit()
            board.receive(bytes.fromhex(step[1:]), ms / 1000)
            packets = PacketParser().feed(board.transmit())
            answers = [p.encode().hex() for p in packets if p.type != MessageType.TELEMETRY]
        else:
            assert answers.pop(0) == step[1:]
            (packet,) = PacketParser().feed(bytes.fromhex(step[1:]))
            assert packet.seq >= 0
            assert not isinstance(decode_board(packet), int)
    assert answers == []


@pytest.mark.parametrize(("status", "least"), [(0, 500), (1, 50), (2, 300), (3, 100), (4, 50)])
def test_every_answer_occurs(status: int, least: int) -> None:
    pattern = re.compile("^<")
    found = 0
    for script in of_kind("board"):
        for step in filter(pattern.match, script):
            (packet,) = PacketParser().feed(bytes.fromhex(step[1:]))
            found += packet.type == MessageType.ACK and packet.payload[2] == status
    assert found >= least
