"""Conversations at a real terminal, beside the firmware's C core on a real serial line."""

from __future__ import annotations

import fcntl
import os
import re
import select
import signal
import subprocess
import sys
import termios
import time
from collections.abc import Iterator
from pathlib import Path

import pytest
from firmware.boards import HOST, make

from polepilot.core.link.messages import BoardState, MessageType, Telemetry, decode_board
from polepilot.core.link.packets import PacketParser

COMMAND = [sys.executable, "-c", "from polepilot.commands.main import main; main()"]
PATIENCE = 60.0
"""Seconds of a busy computer."""


class AtTerminal:
    """A command at a terminal, and somebody who types."""

    def __init__(self, *words: str) -> None:
        self._master, slave = os.openpty()
        self.program = subprocess.Popen(
            [*COMMAND, *words],
            stdin=slave,
            stdout=slave,
            stderr=slave,
            start_new_session=True,
            # Its own terminal, so that Ctrl-C reaches it.
            preexec_fn=lambda: fcntl.ioctl(0, termios.TIOCSCTTY, 0),
        )
        os.close(slave)
        self.said = ""
        self._read = 0

    def until(self, pattern: str) -> str:
        """Read on until ``pattern`` was said; returns what matched."""
        end = time.monotonic() + PATIENCE
        while (found := re.search(pattern, self.said[self._read :])) is None:
            assert time.monotonic() < end, f"no {pattern!r} in {self.said[self._read :]!r}"
            assert self._more(), f"ended without {pattern!r}: {self.said[self._read :]!r}"
        self._read += found.end()
        return found[0]

    def type(self, text: str) -> None:
        os.write(self._master, text.encode())

    def end(self) -> int:
        """The exit status, everything read."""
        end = time.monotonic() + PATIENCE
        while time.monotonic() < end and self._more():
            pass
        return self.program.wait(PATIENCE)

    def close(self) -> None:
        self.program.kill()
        self.program.wait()
        os.close(self._master)

    def _more(self) -> bool:
        if not select.select([self._master], [], [], 0.2)[0]:
            return self.program.poll() is None
        try:
            self.said += os.read(self._master, 4096).decode().replace("\r\n", "\n")
        except OSError:
            return False
        return True


@pytest.fixture
def line(tmp_path: Path) -> Iterator[Path]:
    """The firmware as a program, which keeps a journal of what it obeyed."""
    make("host", of="host")
    path, journal = tmp_path / "line", tmp_path / "journal"
    program = subprocess.Popen([HOST, "--link", str(path), "--journal", str(journal)])
    end = time.monotonic() + 20
    while not path.exists():
        assert time.monotonic() < end
        time.sleep(0.01)
    yield path
    program.kill()
    program.wait()


def obeyed(line: Path) -> list[int]:
    """Types of the messages that the board obeyed, in order."""
    return [int(body[2:4], 16) for body in (line.parent / "journal").read_text().split()]


def state_of(line: Path) -> BoardState:
    """What the board says of itself once nobody is there."""
    parser, descriptor = PacketParser(), os.open(line, os.O_RDWR | os.O_NOCTTY)
    try:
        while True:
            for packet in parser.feed(os.read(descriptor, 4096)):
                message = decode_board(packet)
                if isinstance(message, Telemetry):
                    return message.state
    finally:
        os.close(descriptor)


def test_doctor_asks_before_each_output(line: Path) -> None:
    person = AtTerminal("doctor", "--link", str(line))
    try:
        person.until("ok   stop by link")
        before = obeyed(line).count(MessageType.ARM)
        person.until(r"hold it. \[Enter/s\]")
        person.type("s\n")
        person.until(r"to the right. \[Enter/s\]")
        person.type("s\n")
        person.until("wheels in the air")
        assert obeyed(line).count(MessageType.DRIVE) == 0
        person.type("y\n")
        person.until("left wheel forward")
        person.type("y\n")
        person.until("Did it do that")
        assert obeyed(line).count(MessageType.ARM) == before + 1
        person.type("y\n")
        person.until("ok   left wheel forward: driven and seen")
        driven = obeyed(line).count(MessageType.DRIVE)
        assert driven > 0
        for _ in range(7):
            person.until("Twitch: .*")
            person.type("\n")
        person.until(r"All that was checked is well.* not tried")
        assert person.end() == 0
        assert obeyed(line).count(MessageType.DRIVE) == driven
        assert state_of(line) in (BoardState.IDLE, BoardState.LINK_LOST)
    finally:
        person.close()


def guided_to_a_motion(line: Path) -> AtTerminal:
    """A calibration whose left wheel has just been allowed to turn for ten seconds."""
    person = AtTerminal("calibrate", "drive", str(line))
    for question in (
        "on the box",
        "left rear wheel",
        "Did the left",
        "right rear",
        "Did the right",
    ):
        person.until(question)
        person.type("y\n")
    person.until("run for ten seconds")
    person.type("y\n")
    end = time.monotonic() + PATIENCE
    first = obeyed(line).count(MessageType.DRIVE)
    while obeyed(line).count(MessageType.DRIVE) < first + 10:
        assert time.monotonic() < end
        time.sleep(0.02)
    return person


def test_any_key_stops_a_motion(line: Path) -> None:
    person = guided_to_a_motion(line)
    try:
        person.type(" ")
        person.until("Stopped: stopped by you")
        assert obeyed(line)[-1] != MessageType.DRIVE
        assert MessageType.ESTOP in obeyed(line)
        person.until("shall the stop end")
        person.type("n\n")
        assert person.end() == 2
        assert "Ended by you; nothing was changed." in person.said
    finally:
        person.close()
    assert state_of(line) is BoardState.ESTOP


@pytest.mark.parametrize("how", ["keys", "signal"])
def test_ctrl_c_stops_everything(line: Path, how: str) -> None:
    person = guided_to_a_motion(line)
    try:
        if how == "keys":
            person.type("\x03")
        else:
            person.program.send_signal(signal.SIGINT)
        assert person.end() == 130
        assert "Traceback" not in person.said
    finally:
        person.close()
    assert MessageType.ESTOP in obeyed(line)
    assert state_of(line) is BoardState.ESTOP


def test_a_killed_program_leaves_standing_wheels(line: Path) -> None:
    person = guided_to_a_motion(line)
    person.close()
    time.sleep(0.5)
    assert state_of(line) is BoardState.LINK_LOST
