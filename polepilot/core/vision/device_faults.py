"""What is wrong with a camera of this machine (V4L2), found out from its device node.

OpenCV says no more than that it failed. A look at the device itself, before and after, tells what
is wrong and what to do about it.
"""

from __future__ import annotations

import contextlib
import errno
import fcntl
import grp
import os
import pwd
import stat
import struct
from pathlib import Path

from polepilot.core.errors import CameraError

_DEVICES = Path("/dev")
_QUERY_CAPABILITIES = 0x80685600
_REQUEST_BUFFERS = 0xC0145608
_CAPTURES = 0x00000001 | 0x00001000
"""Capability bits: pictures in one plane or in several."""
_NO_VIDEO = (errno.ENOTTY, errno.EINVAL, errno.EISDIR)
"""What a file that is no video device answers."""


def device_path(source: int | str) -> Path:
    """The device node that a number or a path means."""
    return _DEVICES / f"video{source}" if isinstance(source, int) else Path(source)


def find_devices() -> list[str]:
    """The cameras of this machine, each with the name that its driver gives."""
    found = []
    for path in sorted(_DEVICES.glob("video*"), key=lambda p: (len(p.name), p.name)):
        try:
            if not _capabilities(path) & _CAPTURES:
                continue  # many cameras have a second device, for other data
        except OSError as error:
            if error.errno in _NO_VIDEO:
                continue
        name = Path("/sys/class/video4linux") / path.name / "name"
        try:
            found.append(f"{path} ({name.read_text().strip()})")
        except OSError:
            found.append(str(path))
    return found


def check_device(path: Path) -> None:
    """Find out why a device cannot be used before OpenCV hides the reason.

    Raises:
        CameraError: missing, forbidden, busy, or no camera; the remedy says what to do.
    """
    if not path.exists():
        raise CameraError(
            f"there is no camera {path}.", remedy=_list_devices(), code="camera_missing"
        )
    try:
        capabilities = _capabilities(path)
    except OSError as error:
        raise _refusal(path, error) from error
    if not capabilities & _CAPTURES:
        raise CameraError(
            f"{path} gives no pictures: many cameras have a second device, for other data.",
            remedy=_list_devices(),
            code="camera_unusable",
        )


def _capabilities(path: Path) -> int:
    """What the device can do (V4L2).

    Raises:
        OSError: it cannot be opened, or is no video device (ENOTTY).
    """
    handle = os.open(path, os.O_RDWR | os.O_NONBLOCK | os.O_CLOEXEC)
    try:
        answer = bytearray(104)
        fcntl.ioctl(handle, _QUERY_CAPABILITIES, answer)
    finally:
        os.close(handle)
    everything, of_this_node = struct.unpack_from("=II", answer, 84)
    return int(of_this_node if everything & 0x80000000 else everything)


def _refusal(path: Path, error: OSError) -> CameraError:
    if error.errno in (errno.EACCES, errno.EPERM):
        return CameraError(
            f"no permission to use the camera {path}.",
            remedy=_how_to_be_allowed(path),
            code="camera_permission",
        )
    if error.errno == errno.EBUSY:
        return _busy(path)
    if error.errno in _NO_VIDEO:
        return CameraError(
            f"{path} is no video device: expected /dev/video0 or the like.",
            remedy=_list_devices(),
            code="camera_unusable",
        )
    return CameraError(
        f"the camera {path} cannot be opened ({error.strerror}).",
        remedy="Unplug it and plug it in again.",
    )


def _how_to_be_allowed(path: Path) -> str:
    status = path.stat()
    user, group = _name_of_user(), _name_of_group(status.st_gid)
    if status.st_mode & 0o060 != 0o060 or status.st_gid == 0:
        return (
            f"It belongs to {_name_of_group(status.st_gid)} as {stat.filemode(status.st_mode)}: "
            f"sudo chgrp video {path}; sudo chmod 660 {path} (a udev rule makes it last)."
        )
    if status.st_gid in (*os.getgroups(), os.getegid()):
        return (
            "Its rights allow it, the system does not: a container needs "
            f"--device {path}, a service unit DeviceAllow=char-video4linux rw."
        )
    with contextlib.suppress(KeyError):
        if user in grp.getgrgid(status.st_gid).gr_mem:
            return f"{user} is in the group {group} since the last login: log in again."
    return f"Join the group {group}: sudo usermod -aG {group} {user}, then log in again."


def explain_device(path: Path) -> CameraError:
    """Why OpenCV could not open a device that is there and may be used."""
    try:
        busy = _is_busy(path)
    except OSError as error:
        return _refusal(path, error)
    if busy or users_of(path):
        return _busy(path)
    return CameraError(
        f"the camera {path} delivers no pictures to OpenCV.",
        remedy=f"Unplug it and plug it in again, or take another. {_list_devices()}",
        code="camera_unusable",
    )


def _is_busy(path: Path) -> bool:
    """Whether another program streams from the device: asked by giving back no buffers at all."""
    handle = os.open(path, os.O_RDWR | os.O_NONBLOCK | os.O_CLOEXEC)
    try:
        fcntl.ioctl(handle, _REQUEST_BUFFERS, bytearray(struct.pack("=5I", 0, 1, 1, 0, 0)))
    except OSError as error:
        return error.errno == errno.EBUSY
    finally:
        os.close(handle)
    return False


def _busy(path: Path) -> CameraError:
    users = ", ".join(users_of(path)) or "another program"
    return CameraError(
        f"the camera {path} is in use by {users}.",
        remedy="Close that program.",
        code="camera_busy",
    )


def users_of(path: Path) -> list[str]:
    """Programs that hold ``path`` open, as far as this user may know."""
    target, found = str(path.resolve()), []
    for process in Path("/proc").glob("[0-9]*"):
        if int(process.name) == os.getpid():
            continue
        with contextlib.suppress(OSError):
            if any(str(link.readlink()) == target for link in (process / "fd").iterdir()):
                found.append(f"{(process / 'comm').read_text().strip()} ({process.name})")
    return found


def _list_devices() -> str:
    found = find_devices()
    if not found:
        return "No video device was found on this machine: check cable and power."
    return f"Found: {', '.join(found)}."


def _name_of_user() -> str:
    try:
        return pwd.getpwuid(os.geteuid()).pw_name
    except KeyError:
        return "USER"


def _name_of_group(number: int) -> str:
    try:
        return grp.getgrgid(number).gr_name
    except KeyError:
        return str(number)
