"""The serial port adapter over pseudo terminals: what a USB device does, without one."""

from __future__ import annotations

import errno
import grp
import os
import subprocess
import sys
import threading
import time
import tty
from collections.abc import Iterator
from pathlib import Path

import pytest

from polepilot.core.errors import ConfigError, LinkError
from polepilot.core.link import usb
from polepilot.core.link.protocol import HostLink
from polepilot.core.link.report import LinkState
from polepilot.core.link.usb import PortAddress, SerialPort
from polepilot.core.sim.board import Board, BoardInputs


class Plug:
    """A device that can be plugged in under one steady path, and pulled out."""

    def __init__(self, path: Path) -> None:
        self.path = path
        self.master = -1

    def insert(self) -> None:
        self.master, slave = os.openpty()
        tty.setraw(slave)
        os.set_blocking(self.master, False)
        self.path.symlink_to(os.ttyname(slave))
        self._slave = slave

    def remove(self) -> None:
        self.path.unlink(missing_ok=True)
        for descriptor in (self.master, self._slave):
            os.close(descriptor)
        self.master = -1

    def read(self) -> bytes:
        try:
            return os.read(self.master, 4096)
        except (BlockingIOError, OSError):
            return b""


@pytest.fixture
def plug(tmp_path: Path) -> Iterator[Plug]:
    plug = Plug(tmp_path / "ttyBoard")
    plug.insert()
    yield plug
    if plug.master >= 0:
        plug.remove()


class Hand:
    """A clock that only the test moves."""

    def __init__(self) -> None:
        self.time = 0.0

    def __call__(self) -> float:
        return self.time


def read_until(port: SerialPort, wanted: bytes) -> bytes:
    data = b""
    deadline = time.monotonic() + 5
    while len(data) < len(wanted) and time.monotonic() < deadline:
        data += b"".join(chunk.data for chunk in port.read())
    return data


def read_for(port: SerialPort, seconds: float) -> None:
    """Somebody who reads in every tick: what happens to the device is noticed by then."""
    deadline = time.monotonic() + seconds
    while time.monotonic() < deadline:
        port.read()
        time.sleep(0.005)


def test_bytes_pass_both_ways_unchanged(plug: Plug) -> None:
    port = SerialPort(PortAddress(path=str(plug.path)))
    everything = bytes(range(256))
    assert port.read() == []
    assert port.generation == 1
    port.write(everything)
    assert plug.read() == everything
    os.write(plug.master, everything)
    assert read_until(port, everything) == everything
    port.close()


def test_a_second_program_is_told_that_the_port_is_in_use(plug: Plug) -> None:
    first = SerialPort(PortAddress(path=str(plug.path)))
    first.read()
    second = SerialPort(PortAddress(path=str(plug.path)))
    with pytest.raises(LinkError, match="in use by another program"):
        second.read()
    first.close()


def test_missing_device_is_told_once_and_found_later(plug: Plug) -> None:
    plug.remove()
    clock = Hand()
    port = SerialPort(PortAddress(path=str(plug.path)), clock=clock)
    with pytest.raises(LinkError, match="no serial device") as told:
        port.read()
    assert "Check the cable" in told.value.remedy
    for _ in range(5):
        clock.time += 1.0
        assert port.read() == []
        port.write(b"nobody hears this")
    plug.insert()
    assert port.read() == []
    assert port.generation == 0, "tried again within a second"
    clock.time += 1.0
    port.read()
    assert port.generation == 1
    assert plug.read() == b"", "bytes from before the device came were sent late"
    port.close()


def test_unplugging_raises_once_and_plugging_in_opens_again(plug: Plug) -> None:
    clock = Hand()
    port = SerialPort(PortAddress(path=str(plug.path)), clock=clock)
    port.read()
    plug.remove()
    with pytest.raises(LinkError, match="unplugged"):
        read_for(port, 2.0)
    assert not port.is_open
    assert port.read() == []
    plug.insert()
    clock.time += 1.0
    port.read()
    assert (port.is_open, port.generation) == (True, 2)
    port.close()


def test_writing_to_an_unplugged_device_raises_too(plug: Plug) -> None:
    port = SerialPort(PortAddress(path=str(plug.path)))
    port.write(b"x")
    plug.remove()
    with pytest.raises(LinkError, match="unplugged"):
        port.write(b"y")


def test_a_device_that_takes_nothing_neither_blocks_nor_gets_old_commands(plug: Plug) -> None:
    port = SerialPort(PortAddress(path=str(plug.path)))
    started = time.monotonic()
    for _ in range(400):
        port.write(b"\x55" * 100)
    assert time.monotonic() - started < 2
    assert port.dropped > 0
    while plug.read():
        pass
    port.write(b"")
    assert len(plug.read()) <= 1024
    port.close()


def test_a_file_is_no_serial_device(tmp_path: Path) -> None:
    path = tmp_path / "file"
    path.write_text("no port")
    with pytest.raises(LinkError, match="is no serial device"):
        SerialPort(PortAddress(path=str(path))).read()


@pytest.mark.parametrize(
    ("code", "text"),
    [(13, "dialout"), (16, "ModemManager"), (2, "Check the cable")],
)
def test_errors_say_what_to_do(
    monkeypatch: pytest.MonkeyPatch, plug: Plug, code: int, text: str
) -> None:
    def refuse(*_args: object, **_kwargs: object) -> None:
        raise usb.serial.SerialException(code, "refused")

    monkeypatch.setattr(usb.serial, "Serial", refuse)
    with pytest.raises(LinkError) as told:
        SerialPort(PortAddress(path=str(plug.path))).read()
    assert text in told.value.remedy


@pytest.mark.parametrize(
    ("mode", "members", "groups", "text"),
    [
        (0o660, [], {100}, "sudo usermod -aG dialout ann) and log in again"),
        (0o660, ["ann"], {100}, "this session is older: log in again"),
        (0o660, ["ann"], {100, 20}, "install the udev rule"),
        (0o600, ["ann"], {100}, "belongs to its owner alone: install the udev rule"),
    ],
)
def test_permission_is_explained_by_who_owns_it(
    mode: int, members: list[str], groups: set[int], text: str
) -> None:
    dialout = grp.struct_group(("dialout", "x", 20, members))
    assert text in usb._advice(mode, dialout, "ann", groups)


def test_the_kernel_keeps_others_out(plug: Plug, monkeypatch: pytest.MonkeyPatch) -> None:
    """Programs that heed no lock as well; root may always."""
    monkeypatch.setattr(usb, "_is_pseudo", lambda _: False)
    device = plug.path.resolve()
    device.chmod(0o666)
    port = SerialPort(PortAddress(path=str(plug.path)))

    def opens() -> bool:
        script = (
            "import os, sys\n"
            "if os.getuid() == 0: os.setgroups([]); os.setgid(65534); os.setuid(65534)\n"
            "try: os.open(sys.argv[1], os.O_RDWR | os.O_NOCTTY)\n"
            "except OSError as error: sys.exit(error.errno)\n"
        )
        done = subprocess.run([sys.executable, "-I", "-c", script, device], check=False)
        assert done.returncode in (0, errno.EBUSY)
        return done.returncode == 0

    assert opens()
    port.read()
    assert not opens()
    port.close()


class FakePort:
    def __init__(self, device: str, vid: int | None, pid: int | None, number: str | None) -> None:
        self.device, self.vid, self.pid, self.serial_number = device, vid, pid, number


def test_finds_the_port_by_what_the_device_says(monkeypatch: pytest.MonkeyPatch) -> None:
    ports = [
        FakePort("/dev/ttyS0", None, None, None),
        FakePort("/dev/ttyUSB1", 0x0403, 0x6001, "B"),
        FakePort("/dev/ttyUSB0", 0x0403, 0x6001, "A"),
        FakePort("/dev/ttyACM0", 0x2341, 0x0043, None),
    ]
    monkeypatch.setattr(usb.list_ports, "comports", lambda: ports)
    assert PortAddress.parse("0403:6001").find() == "/dev/ttyUSB0"
    assert PortAddress.parse("0403:6001:B").find() == "/dev/ttyUSB1"
    assert PortAddress.parse("2341:0043").find() == "/dev/ttyACM0"
    assert PortAddress.parse("1234:5678").find() is None
    assert str(PortAddress.parse("0403:6001:B")) == "0403:6001:B"
    with pytest.raises(LinkError, match="1234:5678") as told:
        SerialPort(PortAddress.parse("1234:5678")).read()
    assert "/dev/ttyACM0 (2341:0043)" in told.value.remedy


@pytest.mark.parametrize("text", ["ttyUSB0", "", "0403", "0403:60", "04g3:6001", ":", "COM3"])
def test_an_address_that_is_none(text: str) -> None:
    with pytest.raises(ConfigError):
        PortAddress.parse(text)


class BoardThread:
    """A board on the other end of the plug, in real time."""

    def __init__(self, plug: Plug) -> None:
        self.board = Board(now=time.monotonic())
        self._plug = plug
        self._halt = threading.Event()
        self._thread = threading.Thread(target=self._run)
        self._thread.start()

    def _run(self) -> None:
        while not self._halt.wait(0.002):
            now = time.monotonic()
            self.board.receive(self._plug.read(), now)
            self.board.step(now, BoardInputs())
            data = self.board.transmit()
            if data:
                os.write(self._plug.master, data)

    def stop(self) -> None:
        self._halt.set()
        self._thread.join()


def run(link: HostLink, port: SerialPort, until: LinkState, seconds: float = 10.0) -> None:
    """The owner's loop, as the robot has it."""
    deadline = time.monotonic() + seconds
    generation = port.generation
    while link.state is not until:
        now = time.monotonic()
        assert now < deadline, f"still {link.state}, not {until}"
        try:
            chunks = port.read()
            if port.generation != generation:
                generation = port.generation
                link.reset(now)
            for chunk in chunks:
                link.receive(chunk.data, chunk.stamp)
            port.write(link.poll(now))
        except LinkError as error:
            link.port_lost(now, str(error))
        time.sleep(0.005)


def test_a_board_on_a_real_port_is_connected_armed_stopped_and_replugged(plug: Plug) -> None:
    port = SerialPort(PortAddress(path=str(plug.path)))
    link = HostLink()
    board = BoardThread(plug)
    try:
        run(link, port, LinkState.IDLE)
        link.arm()
        run(link, port, LinkState.ARMED)
    finally:
        board.stop()
    plug.remove()
    run(link, port, LinkState.CLOSED)
    plug.insert()
    board = BoardThread(plug)
    try:
        run(link, port, LinkState.IDLE)
        link.estop()
        run(link, port, LinkState.ESTOP)
        assert link.statistics.handshakes == 2
    finally:
        board.stop()
        port.close()


def test_after_replugging_nothing_is_armed_by_itself(plug: Plug) -> None:
    """An owner who goes on to ask for motion finds a board that stands."""
    port = SerialPort(PortAddress(path=str(plug.path)))
    link = HostLink()
    board = BoardThread(plug)
    try:
        run(link, port, LinkState.IDLE)
        link.arm()
        run(link, port, LinkState.ARMED)
        link.drive(500, 500, 0)
        link.arm()  # on its way when the cable is pulled
    finally:
        board.stop()
    plug.remove()
    run(link, port, LinkState.CLOSED)
    link.drive(500, 500, 0)
    plug.insert()
    board = BoardThread(plug)
    try:
        run(link, port, LinkState.IDLE)
        end = time.monotonic() + 0.5
        while time.monotonic() < end:
            link.drive(500, 500, 0)
            for chunk in port.read():
                link.receive(chunk.data, chunk.stamp)
            port.write(link.poll(time.monotonic()))
            assert link.state is LinkState.IDLE
            assert board.board.outputs.left == 0
            time.sleep(0.005)
        assert not board.board.executed
    finally:
        board.stop()
        port.close()


def test_bytes_are_stamped_when_they_come_not_when_they_are_read(plug: Plug) -> None:
    port = SerialPort(PortAddress(path=str(plug.path)))
    port.read()
    sent = []
    for byte in b"abc":
        sent.append(time.monotonic())
        os.write(plug.master, bytes([byte]))
        time.sleep(0.1)
    chunks = port.read()
    assert [chunk.data for chunk in chunks] == [b"a", b"b", b"c"]
    for chunk, moment in zip(chunks, sent, strict=True):
        assert 0 <= chunk.stamp - moment < 0.09
    port.close()
