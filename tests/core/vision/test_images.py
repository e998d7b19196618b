from __future__ import annotations

from pathlib import Path

import cv2
import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from vision_scenes import picture, pole

from polepilot.core.errors import ImageError
from polepilot.core.vision.images import read_image

COLOUR = picture([pole(13, 3.0, 0.1)])


def write(path: Path, image: np.ndarray) -> Path:
    assert cv2.imwrite(str(path), image)
    return path


@pytest.mark.parametrize("name", ["a.png", "a.bmp", "a.tiff", "a.webp"])
def test_colour_files_come_back_as_they_are(tmp_path: Path, name: str) -> None:
    read = read_image(write(tmp_path / name, COLOUR))
    assert read.dtype == np.uint8
    assert read.shape == COLOUR.shape
    if name != "a.webp":
        assert np.array_equal(read, COLOUR)


def test_jpeg_is_close(tmp_path: Path) -> None:
    read = read_image(write(tmp_path / "a.jpg", COLOUR))
    assert read.shape == COLOUR.shape
    assert np.abs(read.astype(int) - COLOUR).mean() < 5


def test_grey_sixteen_bits_and_transparency(tmp_path: Path) -> None:
    grey = COLOUR[:, :, 1]
    assert np.array_equal(read_image(write(tmp_path / "g.png", grey)), grey)
    deep = COLOUR.astype(np.uint16) * 257
    assert np.array_equal(read_image(write(tmp_path / "d.png", deep)), COLOUR)
    clear = cv2.cvtColor(COLOUR, cv2.COLOR_BGR2BGRA)
    assert np.array_equal(read_image(write(tmp_path / "c.png", clear)), COLOUR)


@pytest.mark.parametrize("name", ["a.png", "a.jpg", "a.bmp", "a.webp"])
@pytest.mark.parametrize("share", [0.1, 0.5, 0.95])
def test_truncated_files_are_errors(
    tmp_path: Path, name: str, share: float, capfd: pytest.CaptureFixture[str]
) -> None:
    path = write(tmp_path / name, COLOUR)
    data = path.read_bytes()
    path.write_bytes(data[: int(len(data) * share)])
    with pytest.raises(ImageError) as caught:
        read_image(path)
    assert str(path) in str(caught.value)
    assert "\n" not in str(caught.value)
    assert capfd.readouterr() == ("", "")


def test_other_things_are_errors(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    text = tmp_path / "text.png"
    text.write_text("no picture\n" * 50)
    empty = tmp_path / "empty.png"
    empty.touch()
    for path, word in (
        (text, "no picture"),
        (empty, "empty"),
        (tmp_path, "directory"),
        (tmp_path / "missing.png", "no such file"),
    ):
        with pytest.raises(ImageError, match=word) as caught:
            read_image(path)
        assert str(path) in str(caught.value)
    assert capfd.readouterr() == ("", "")


def test_a_damaged_png_is_an_error(tmp_path: Path) -> None:
    path = write(tmp_path / "a.png", COLOUR)
    data = bytearray(path.read_bytes())
    data[len(data) // 2] ^= 0xFF
    path.write_bytes(data)
    with pytest.raises(ImageError, match="damaged"):
        read_image(path)


@settings(
    deadline=None, max_examples=60, suppress_health_check=[HealthCheck.function_scoped_fixture]
)
@given(
    st.sampled_from([b"", b"\x89PNG\r\n\x1a\n", b"\xff\xd8\xff", b"BM", b"RIFF"]),
    st.binary(max_size=400),
)
def test_random_bytes_are_an_error(tmp_path: Path, start: bytes, rest: bytes) -> None:
    path = tmp_path / "random.png"
    path.write_bytes(start + rest)
    with pytest.raises(ImageError):
        read_image(path)
