"""Hostile picture files: each gives a picture or one clear line, never a crash or a hang."""

from __future__ import annotations

import os
import struct
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import cv2
import numpy as np
import pytest
from picture_zoo import bomb, damaged, refused, zoo
from vision_scenes import picture, pole

from polepilot.commands.main import run
from polepilot.core.errors import ImageError
from polepilot.core.observation import Image
from polepilot.core.vision.images import MAX_BYTES, MAX_PIXELS, read_image

SCENE = np.ascontiguousarray(picture([pole(13, 3.0, 0.1)])[100:200, 80:200])
ZOO = zoo(SCENE)

pytestmark = pytest.mark.timeout(120)


def read(path: Path) -> Image | None:
    """What the file shows; None where it is refused as it should be."""
    try:
        image = read_image(path)
    except ImageError as error:
        message = error.message
    else:
        message = ""
    if message:
        assert message.isprintable()
        assert message.startswith(str(path))
        assert len(message) > len(str(path)) + 10
        return None
    assert image.dtype == np.uint8
    assert image.size > 0
    assert image.ndim == 2 or image.shape[2] == 3
    return image


@pytest.mark.parametrize("name", ZOO)
def test_every_kind_of_file_is_read_as_stored(tmp_path: Path, name: str) -> None:
    path = tmp_path / name
    path.write_bytes(ZOO[name])
    image = read(path)
    assert image is not None
    assert image.shape[:2] == SCENE.shape[:2]
    if not name.startswith("bits"):
        expected = SCENE if image.ndim == 3 else SCENE[:, :, 1]
        if name.startswith("grey"):
            image = image if image.ndim == 2 else image[:, :, 1]
            expected = SCENE[:, :, 1]
            if name == "grey-clear.png":  # another program's weights of the colours
                expected = cv2.cvtColor(SCENE, cv2.COLOR_BGR2GRAY)
        assert np.abs(image.astype(int) - expected).mean() < 6


@pytest.mark.parametrize("name", refused(SCENE))
def test_other_kinds_are_refused(
    tmp_path: Path, name: str, capfd: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / name
    path.write_bytes(refused(SCENE)[name])
    assert run(["detect", str(path), "--json"]) == 2
    out, err = capfd.readouterr()
    assert out == ""
    assert err.startswith(str(path))
    assert err.count("\n") == 1


@pytest.mark.parametrize("name", [n for n in ZOO if not n.startswith("several")])
def test_half_files_are_errors(
    tmp_path: Path, name: str, capfd: pytest.CaptureFixture[str]
) -> None:
    rng = np.random.default_rng(1)
    data = ZOO[name]
    path = tmp_path / name
    # The last two bytes may be padding.
    for length in (0, 1, 5, *rng.integers(6, min(200, len(data) - 2), 4), len(data) // 2):
        path.write_bytes(data[:length])
        assert read(path) is None, length
    assert capfd.readouterr() == ("", "")


@pytest.mark.parametrize("name", ZOO)
def test_damaged_files_give_a_picture_or_an_error(
    tmp_path: Path, name: str, capfd: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / name
    for data in damaged(ZOO[name], np.random.default_rng(2), 16):
        path.write_bytes(data)
        read(path)
    assert capfd.readouterr() == ("", "")


@pytest.mark.parametrize(
    "shape",
    [(1, 1), (1, 10_000), (10_000, 1), (2, 3, 3), (1, 1, 3), (1, 10_000, 3), (10_000, 1, 4)],
)
@pytest.mark.parametrize("kind", [np.uint8, np.uint16])
@pytest.mark.parametrize("detector", ["default", "paper"])
def test_odd_shapes_are_looked_at(
    tmp_path: Path,
    shape: tuple[int, ...],
    kind: type[np.generic],
    detector: str,
    capfd: pytest.CaptureFixture[str],
) -> None:
    rng = np.random.default_rng(3)
    path = tmp_path / "odd.png"
    cv2.imwrite(str(path), rng.integers(0, np.iinfo(kind).max, shape).astype(kind))
    assert run(["detect", str(path), "--detector", detector, "--json"]) == 0
    assert '"detections": []' in capfd.readouterr().out


def test_forty_megapixels_are_looked_at(tmp_path: Path) -> None:
    small = np.random.default_rng(4).integers(0, 255, (257, 386, 3), dtype=np.uint8)
    path = tmp_path / "large.jpg"
    cv2.imwrite(str(path), cv2.resize(small, (7728, 5152)))
    program = (
        "import resource, sys; from polepilot.commands.main import run\n"
        f"status = run(['detect', {str(path)!r}, '--json'])\n"
        "print(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss // 1024, file=sys.stderr)\n"
        "sys.exit(status)"
    )
    done = subprocess.run(
        [sys.executable, "-c", program], capture_output=True, text=True, timeout=100
    )
    assert done.returncode == 0, done.stderr
    # 120 MB of pixels: a handful of working copies, not dozens.
    assert int(done.stderr) < 1000


@pytest.mark.parametrize(
    ("data", "words"),
    [
        (bomb(46_000, 46_000), "46000 x 46000 pixels"),
        (bomb(2**31 - 1, 2**31 - 1), "2147483647 x 2147483647 pixels"),
        (bomb(MAX_PIXELS + 1, 1)[:60], "pixels; expected at most 100 million"),
        (b"P5\n99999 99999\n255\n" + bytes(99), "99999 x 99999 pixels"),
        (b"GIF89a\xff\xff\xff\xff\0\0\0;", "65535 x 65535 pixels"),
    ],
)
def test_a_few_bytes_that_claim_gigabytes(tmp_path: Path, data: bytes, words: str) -> None:
    path = tmp_path / "bomb"
    path.write_bytes(data)
    with pytest.raises(ImageError, match=words):
        read_image(path)


@pytest.mark.parametrize("at", [8, 16, 24, 28, 36, 44])
def test_numbers_of_a_big_tiff_that_point_nowhere(tmp_path: Path, at: int) -> None:
    entry = struct.pack("<HHQQ", 257, 16, 3, 48)
    data = bytearray(b"II+\0\x08\0\0\0" + struct.pack("<QQ", 16, 1) + entry + bytes(24))
    data[at : at + 8] = b"\xff" * 8
    path = tmp_path / "big.tiff"
    path.write_bytes(data)
    with pytest.raises(ImageError, match="damaged"):
        read_image(path)


def test_progressive_without_end(tmp_path: Path) -> None:
    data = ZOO["progressive.jpg"]
    scan = data.rindex(b"\xff\xda")
    path = tmp_path / "scans.jpg"
    # Claims the largest size of a JPEG that is within bounds, and goes over it a thousand times.
    frame = data.index(b"\xff\xc2")
    large = data[: frame + 5] + b"\x27\x00\x27\x00" + data[frame + 9 : scan]
    path.write_bytes(large + data[scan:-2] * 1000 + data[-2:])
    with pytest.raises(ImageError, match="damaged"):
        read_image(path)


def pipe(folder: Path) -> Path:
    os.mkfifo(folder / "pipe.png")
    return folder / "pipe.png"


def loop(folder: Path) -> Path:
    (folder / "loop.png").symlink_to(folder / "loop.png")
    return folder / "loop.png"


def sparse(folder: Path) -> Path:
    with (folder / "sparse.png").open("wb") as file:
        file.write(ZOO["colour.png"])
        file.truncate(MAX_BYTES + 1)
    return folder / "sparse.png"


def two_lines(folder: Path) -> Path:
    return folder / "one\ntwo\x1b[31m.png"


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda _: Path("/dev/zero"), "is a device"),
        (lambda _: Path("/dev/null"), "is a device"),
        (lambda folder: folder, "is a directory"),
        (lambda folder: folder / "absent.png", "no such file"),
        (lambda folder: folder / ("x" * 300), "name too long"),
        (lambda folder: folder / "a\0b", "cannot be read"),
        (pipe, "is a pipe"),
        (loop, "symbolic links"),
        (sparse, "MiB large"),
        (two_lines, r"one\\ntwo\\x1b\[31m.png'?: no such file"),
    ],
)
def test_paths_that_are_no_pictures(
    tmp_path: Path, make: Callable[[Path], Path], words: str
) -> None:
    with pytest.raises(ImageError, match=words) as caught:
        read_image(make(tmp_path))
    assert caught.value.message.isprintable()


def test_a_file_that_may_not_be_read(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(*_: object) -> int:
        raise PermissionError(13, "Permission denied")

    path = tmp_path / "secret.png"
    path.write_bytes(ZOO["colour.png"])
    monkeypatch.setattr(os, "open", refuse)
    with pytest.raises(ImageError, match=r"secret.png: cannot be read \(permission denied\)"):
        read_image(path)
