"""What is wrong with a device node, and what to do about it. Rights are played: root has all."""

from __future__ import annotations

import errno
import grp
import os
import pwd
import stat
import subprocess
import sys
from pathlib import Path
from types import SimpleNamespace

import pytest

from polepilot.core.errors import CameraError
from polepilot.core.vision import device_faults
from polepilot.core.vision.device_faults import check_device, find_devices, users_of
from polepilot.core.vision.sources import open_stream

pytestmark = pytest.mark.timeout(60)

CAMERA, OTHER_DATA = 0x04200001, 0x04A00000
VIDEO = 44


@pytest.fixture
def devices(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder that stands for /dev."""
    monkeypatch.setattr(device_faults, "_DEVICES", tmp_path)
    return tmp_path


def test_missing_device_lists_the_cameras(devices: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    for name in ("video0", "video1", "video2", "video3", "video10"):
        (devices / name).touch()

    def capabilities(path: Path) -> int:
        if path.name == "video2":
            raise PermissionError(errno.EACCES, "Permission denied")
        if path.name == "video3":
            raise OSError(errno.ENOTTY, "Inappropriate ioctl for device")
        return OTHER_DATA if path.name == "video1" else CAMERA

    monkeypatch.setattr(device_faults, "_capabilities", capabilities)
    with pytest.raises(CameraError) as caught:
        open_stream(7, rate=15, size=(640, 480))
    assert caught.value.message == f"there is no camera {devices}/video7."
    assert caught.value.code == "camera_missing"
    found = ", ".join(f"{devices}/{name}" for name in ("video0", "video2", "video10"))
    assert caught.value.remedy == f"Found: {found}."


def test_no_device_at_all(devices: Path) -> None:
    assert find_devices() == []
    with pytest.raises(CameraError, match="No video device was found"):
        open_stream(0, rate=15, size=(640, 480))


@pytest.mark.parametrize("path", ["/dev/null", "/dev/zero", "/dev/fd"])
def test_other_device(path: str) -> None:
    with pytest.raises(CameraError, match=f"{path} is no video device"):
        open_stream(path, rate=15, size=(640, 480))


def test_file_in_the_place_of_a_device(devices: Path) -> None:
    (devices / "video0").touch()
    with pytest.raises(CameraError, match="is no video device"):
        open_stream(0, rate=15, size=(640, 480))


@pytest.mark.parametrize(
    ("number", "code", "words"),
    [
        (errno.EBUSY, "camera_busy", "in use by another program. Close that program"),
        (errno.ENODEV, "camera", r"cannot be opened \(No such device\). Unplug it"),
    ],
)
def test_device_that_does_not_open(
    devices: Path, monkeypatch: pytest.MonkeyPatch, number: int, code: str, words: str
) -> None:
    def refuse(*_: object) -> int:
        raise OSError(number, os.strerror(number))

    (devices / "video0").touch()
    monkeypatch.setattr(os, "open", refuse)
    with pytest.raises(CameraError, match=words) as caught:
        check_device(devices / "video0")
    assert caught.value.code == code


def refused(
    monkeypatch: pytest.MonkeyPatch,
    folder: Path,
    *,
    mode: int = 0o660,
    group: int = VIDEO,
    groups: tuple[int, ...] = (1000,),
    members: tuple[str, ...] = (),
) -> CameraError:
    """What robin is told about a device that may not be opened."""

    def refuse(*_: object) -> int:
        raise PermissionError(errno.EACCES, "Permission denied")

    node = SimpleNamespace(st_mode=stat.S_IFCHR | mode, st_gid=group, st_uid=0)
    names = {0: "root", VIDEO: "video", 27: "sudo"}
    (folder / "video0").touch()
    with monkeypatch.context() as patch:
        patch.setattr(os, "open", refuse)
        patch.setattr(Path, "exists", lambda _: True)
        patch.setattr(Path, "stat", lambda _: node)
        patch.setattr(os, "getgroups", lambda: list(groups))
        patch.setattr(os, "getegid", lambda: groups[0])
        patch.setattr(pwd, "getpwuid", lambda _: SimpleNamespace(pw_name="robin"))
        patch.setattr(
            grp, "getgrgid", lambda n: SimpleNamespace(gr_name=names[n], gr_mem=list(members))
        )
        with pytest.raises(CameraError) as caught:
            check_device(folder / "video0")
    assert caught.value.code == "camera_permission"
    assert caught.value.message == f"no permission to use the camera {folder}/video0."
    return caught.value


def test_group_to_join_is_that_of_the_device(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    remedy = refused(monkeypatch, tmp_path).remedy
    assert remedy == "Join the group video: sudo usermod -aG video robin, then log in again."
    assert "usermod -aG sudo robin" in refused(monkeypatch, tmp_path, group=27).remedy
    # A group that has a number only, as in a container.
    assert "usermod -aG 993 robin" in refused(monkeypatch, tmp_path, group=993).remedy


def test_joined_since_the_last_login(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    remedy = refused(monkeypatch, tmp_path, members=("robin",)).remedy
    assert remedy == "robin is in the group video since the last login: log in again."


@pytest.mark.parametrize(("mode", "group"), [(0o600, VIDEO), (0o640, VIDEO), (0o660, 0)])
def test_no_group_that_helps(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, mode: int, group: int
) -> None:
    remedy = refused(monkeypatch, tmp_path, mode=mode, group=group).remedy
    assert "sudo chgrp video" in remedy
    assert stat.filemode(stat.S_IFCHR | mode) in remedy
    assert "usermod" not in remedy


def test_forbidden_by_the_system(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    remedy = refused(monkeypatch, tmp_path, groups=(1000, VIDEO)).remedy
    assert "--device" in remedy
    assert "DeviceAllow" in remedy


def test_who_holds_a_device_is_named(tmp_path: Path) -> None:
    path = tmp_path / "video0"
    path.touch()
    assert users_of(path) == []
    program = f"import sys; f = open({str(path)!r}); print(flush=True); sys.stdin.read()"
    with subprocess.Popen(
        [sys.executable, "-c", program], stdin=subprocess.PIPE, stdout=subprocess.PIPE
    ) as other:
        assert other.stdout is not None
        other.stdout.readline()
        users = users_of(path)
        other.communicate(timeout=30)
    assert len(users) == 1
    assert str(other.pid) in users[0]
    assert "python" in users[0]
