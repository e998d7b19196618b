"""docs/protocol.md says the same as the code."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from polepilot.core.link.messages import (
    AckStatus,
    BoardState,
    Drive,
    Estop,
    Heartbeat,
    Hello,
    HostMessage,
    MessageType,
)

TEXT = (Path(__file__).parents[3] / "docs" / "protocol.md").read_text(encoding="utf-8")


@pytest.mark.parametrize(
    ("start", "message", "seq"),
    [
        ("HELLO 1.0", Hello(), 0),
        ("HEARTBEAT", Heartbeat(), 1),
        ("DRIVE 500", Drive(500, -250, 1234), 7),
        ("ESTOP", Estop(), 9),
    ],
)
def test_byte_examples(start: str, message: HostMessage, seq: int) -> None:
    found = re.search(rf"^\| {re.escape(start)}[^|]*\| `([0-9a-f]+)` \|$", TEXT, re.MULTILINE)
    assert found is not None
    assert found[1] == message.to_packet(seq).encode().hex()


def test_every_type_has_its_row_and_no_other() -> None:
    rows = re.findall(r"^\| ([0-9a-f]{2}) \| ([A-Z_]+) \|", TEXT, re.MULTILINE)
    assert {(int(number, 16), name) for number, name in rows} == {
        (int(kind), kind.name) for kind in MessageType
    }


def test_states_have_their_numbers() -> None:
    rows = re.findall(r"^\| (\d) \| ([A-Z_]+) \|", TEXT, re.MULTILINE)
    assert {(int(number), name) for number, name in rows} == {
        (int(state), state.name) for state in BoardState
    }
    assert len(AckStatus) == 6
