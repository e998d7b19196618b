"""The serial port behind a LinkPort: found, opened for us alone, and found again after unplugging.

A device adapter: this module may touch the operating system and read a clock.
"""

from __future__ import annotations

import contextlib
import errno
import fcntl
import grp
import os
import pwd
import termios
import time
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import serial
from serial.tools import list_ports

from polepilot.core.errors import ConfigError, LinkError
from polepilot.core.link.listener import Listener
from polepilot.core.link.report import Chunk

_RETRY_PERIOD = 1.0
"""Between two attempts to open, seconds."""
_RULE = "install the udev rule deploy/99-polepilot.rules and plug it in again"
_MAX_UNSENT = 1024
"""Bytes that the device did not take. Beyond that it takes nothing: old commands are dropped."""


@dataclass(frozen=True, slots=True)
class PortAddress:
    """Which port: a path, or what the USB device says it is."""

    path: str | None = None
    """Such as /dev/ttyUSB0, or a steady name from /dev/serial/by-id/."""
    vendor: int | None = None
    product: int | None = None
    serial_number: str | None = None

    def __post_init__(self) -> None:
        by_usb = (self.vendor, self.product, self.serial_number) != (None, None, None)
        if (self.path is None) != by_usb:
            raise ConfigError(
                "A serial port is named by its path, or by USB vendor, product and serial number."
            )

    @classmethod
    def parse(cls, text: str) -> PortAddress:
        """A path, or ``VID:PID`` or ``VID:PID:SERIAL`` in hexadecimal, such as ``0403:6001``.

        Raises:
            ConfigError: neither of these.
        """
        if text.startswith("/"):
            return cls(path=text)
        vendor, _, rest = text.partition(":")
        product, _, number = rest.partition(":")
        try:
            if len(vendor) != 4 or len(product) != 4:
                raise ValueError(text)
            return cls(
                vendor=int(vendor, 16), product=int(product, 16), serial_number=number or None
            )
        except ValueError:
            raise ConfigError(
                f'Serial port "{text}": expected a path such as /dev/ttyUSB0, '
                "or VID:PID in hexadecimal such as 0403:6001."
            ) from None

    def __str__(self) -> str:
        if self.path is not None:
            return self.path
        ids = f"{_hex4(self.vendor)}:{_hex4(self.product)}"
        return f"{ids}:{self.serial_number}" if self.serial_number else ids

    def find(self) -> str | None:
        """The path of the device that is plugged in now; None where there is none."""
        if self.path is not None:
            return self.path
        for port in sorted(list_ports.comports(), key=lambda port: str(port.device)):
            wanted = (
                (self.vendor, port.vid),
                (self.product, port.pid),
                (self.serial_number, port.serial_number),
            )
            if all(mine is None or mine == its for mine, its in wanted):
                return str(port.device)
        return None


class SerialPort:
    """A LinkPort on a serial device that may come and go.

    Opens itself at the first read or write. When the device is gone, ``LinkError`` is raised
    once; later reads return nothing and look for it again once a second. Each successful opening
    raises ``generation`` by one: the owner then starts a new handshake (``HostLink.reset``).
    """

    def __init__(
        self,
        address: PortAddress,
        baud_rate: int = 115200,
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        if baud_rate <= 0:
            raise ConfigError(f"baud rate {baud_rate}: expected a positive number.")
        self._address = address
        self._baud_rate = baud_rate
        self._clock = clock
        self._device: serial.Serial | None = None
        self._listener: Listener | None = None
        self._next_attempt = -float("inf")
        self._told: str | None = None
        """The complaint that the owner already knows."""
        self._unsent = bytearray()
        self.generation = 0
        """How often the port was opened; 0 before the first time."""
        self.dropped = 0
        """Bytes that were never sent because the device did not take them."""

    @property
    def is_open(self) -> bool:
        return self._device is not None

    def read(self) -> list[Chunk]:
        """What has come since the last call, perhaps nothing; never blocks.

        Raises:
            LinkError: the device is missing, busy, forbidden or was unplugged. Raised once for
                each reason; after that the port is quietly looked for again.
        """
        if self._descriptor() is None or self._listener is None:
            return []
        chunks, failure = self._listener.take(), self._listener.failure
        if not chunks and failure is not None:
            raise self._gone(failure) from failure
        return chunks

    def write(self, data: bytes) -> None:
        """Send ``data``; never blocks. What the device does not take now is sent later.

        While there is no device ``data`` is dropped, for stale commands must not be sent late.

        Raises:
            LinkError: as for :meth:`read`.
        """
        descriptor = self._descriptor()
        if descriptor is None:
            return
        if len(self._unsent) + len(data) > _MAX_UNSENT:
            self.dropped += len(self._unsent)
            self._unsent.clear()
        self._unsent += data
        if not self._unsent:
            return
        try:
            # pyserial's own write spins while a non-blocking device takes nothing.
            written = os.write(descriptor, self._unsent)
        except BlockingIOError:
            return
        except OSError as error:
            raise self._gone(error) from error
        del self._unsent[:written]

    def close(self) -> None:
        """Give the device back. A later read would open it again."""
        device, self._device = self._device, None
        listener, self._listener = self._listener, None
        self._unsent.clear()
        if listener is not None:
            listener.stop()
        if device is not None:
            with contextlib.suppress(OSError, serial.SerialException):
                device.close()

    def _descriptor(self) -> int | None:
        if self._device is None:
            self._open()
        return None if self._device is None else int(self._device.fileno())

    def _open(self) -> None:
        """Try to open, unless that was tried just now."""
        now = self._clock()
        if now < self._next_attempt:
            return
        self._next_attempt = now + _RETRY_PERIOD
        path = self._address.find()
        if path is None:
            self._complain(f"No serial device {self._address} is plugged in.", _plugged_in())
            return
        try:
            self._device = serial.Serial(
                path, self._baud_rate, timeout=0, write_timeout=0, exclusive=True
            )
        except (OSError, serial.SerialException, ValueError) as error:
            self._complain(*_explain(path, error))
            return
        _claim(int(self._device.fileno()), path)
        self._listener = Listener(
            int(self._device.fileno()), self._clock, partial(_alive, self._device)
        )
        self._told = None
        self.generation += 1

    def _complain(self, message: str, remedy: str) -> None:
        if message == self._told:
            return
        self._told = message
        raise LinkError(message, remedy=remedy)

    def _gone(self, error: OSError) -> LinkError:
        self.close()
        self._next_attempt = self._clock() + _RETRY_PERIOD
        message = (
            f"The serial device {self._address} was unplugged or has failed ({error.strerror})."
        )
        self._told = None
        return LinkError(message, remedy="Plug it in again; it is looked for once a second.")


def _alive(device: serial.Serial) -> bool:
    """Whether reading nothing means that nothing came, and not that the device left."""
    try:
        return int(device.in_waiting) >= 0
    except OSError:
        return False


def _explain(path: str, error: Exception) -> tuple[str, str]:
    """Why a port cannot be opened, and what to do about it."""
    code = getattr(error, "errno", None)
    if code in (errno.ENOENT, errno.ENODEV, errno.ENXIO):
        return f"There is no serial device {path}.", _plugged_in()
    if code in (errno.EACCES, errno.EPERM):
        return (
            f"No permission to open {path}.",
            _permission(path),
        )
    if code in (errno.EBUSY, errno.EAGAIN):
        return (
            f"{path} is in use by another program.",
            f"Close it (sudo fuser -v {path} names it); ModemManager may hold a new device "
            "for half a minute.",
        )
    if code in (None, errno.ENOTTY, errno.EINVAL):
        return f"{path} is no serial device ({error}).", _plugged_in()
    return f"Cannot open {path}: {error}.", "Check the cable and the path in robot.toml."


def _claim(descriptor: int, path: str) -> None:
    """Keep out programs that heed no lock: from now on the kernel refuses to open it once more.

    Not for a pseudo-terminal: there the mark would outlive a program that is killed.
    """
    if not _is_pseudo(path):
        with contextlib.suppress(OSError):
            fcntl.ioctl(descriptor, termios.TIOCEXCL)


def _is_pseudo(path: str) -> bool:
    return os.path.realpath(path).startswith("/dev/pts/")


def _permission(path: str) -> str:
    """Who may open ``path``, and how to become one of them."""
    try:
        status = Path(path).stat()
        group = grp.getgrgid(status.st_gid)
        user = pwd.getpwuid(os.getuid()).pw_name
    except (OSError, KeyError):
        return f"Add yourself to its group (sudo usermod -aG dialout $USER), or {_RULE}."
    return _advice(status.st_mode, group, user, {os.getgid(), *os.getgroups()})


def _advice(mode: int, group: grp.struct_group, user: str, groups: set[int]) -> str:
    """For a device of ``group``, and a ``user`` whose session has these ``groups``."""
    if group.gr_gid == 0 or mode & 0o060 != 0o060:
        return f"It belongs to its owner alone: {_RULE}, which gives it to the group dialout."
    if user in group.gr_mem and group.gr_gid not in groups:
        return f"You are in its group {group.gr_name}, but this session is older: log in again."
    return (
        f"Add yourself to its group (sudo usermod -aG {group.gr_name} {user}) and log in again, or "
        f"{_RULE}."
    )


def _plugged_in() -> str:
    """What could have been meant."""
    found = [
        f"{port.device} ({_hex4(port.vid)}:{_hex4(port.pid)})"
        if port.vid is not None
        else str(port.device)
        for port in list_ports.comports()
    ]
    if not found:
        return "Check the cable and the board's power; no serial device is plugged in."
    return f"Check the cable; plugged in: {', '.join(sorted(found))}."


def _hex4(value: int | None) -> str:
    return "????" if value is None else f"{value:04x}"
