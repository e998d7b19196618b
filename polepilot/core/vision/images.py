"""Pictures from files, whole or not at all.

OpenCV decodes half a file without complaint and prints warnings of its own; here a picture that
ends too early is an error, and nothing but the error is said.
"""

from __future__ import annotations

import contextlib
import os
import sys
import tempfile
import zlib
from collections.abc import Iterator
from pathlib import Path
from typing import IO

import cv2
import numpy as np

from polepilot.core.errors import ImageError
from polepilot.core.observation import Image

_PNG = b"\x89PNG\r\n\x1a\n"
_JPEG = b"\xff\xd8\xff"


def read_image(path: str | Path) -> Image:
    """A picture file as 8 bits: rows x columns x 3 (BGR), or rows x columns if it is grey.

    16-bit pictures are scaled to 8 bits, transparency is left out, nothing is resized or turned.

    Raises:
        ImageError: missing, a directory, no picture, or not all of it; names the file.
    """
    file = Path(path)
    try:
        data = file.read_bytes()
    except FileNotFoundError:
        raise ImageError(f"{path}: no such file; expected a picture.") from None
    except IsADirectoryError:
        raise ImageError(f"{path}: is a directory; expected a picture file.") from None
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or str(error)
        raise ImageError(f"{path}: cannot be read ({reason.lower()}).") from None
    if not data:
        raise ImageError(f"{path}: is empty; expected a picture.")
    if not _complete(data):
        raise ImageError(f"{path}: the picture is damaged or ends too early.")
    return _to_eight_bits(_decode(data, str(path)), str(path))


def _decode(data: bytes, name: str) -> np.ndarray:
    with _silenced() as said:
        try:
            image = cv2.imdecode(np.frombuffer(data, np.uint8), cv2.IMREAD_UNCHANGED)
        except cv2.error:
            image = None
        said.seek(0)
        warnings = said.read()
    if image is None or image.size == 0:
        raise ImageError(f"{name}: is no picture that can be read; expected PNG, JPEG or BMP.")
    if b"premature end" in warnings.lower():
        raise ImageError(f"{name}: the picture is damaged or ends too early.")
    decoded: np.ndarray = image
    return decoded


def _to_eight_bits(image: np.ndarray, name: str) -> Image:
    if image.dtype == np.uint16:
        image = cv2.convertScaleAbs(image, alpha=1 / 257)
    if image.dtype != np.uint8:
        raise ImageError(f"{name}: has {image.dtype} pixels; expected 8 or 16 bits per channel.")
    if image.ndim == 3 and image.shape[2] in (1, 2):
        image = np.ascontiguousarray(image[:, :, 0])
    elif image.ndim == 3 and image.shape[2] == 4:
        image = cv2.cvtColor(image, cv2.COLOR_BGRA2BGR)
    return image


def _complete(data: bytes) -> bool:
    """Whether the file reaches its own end mark; True for formats that OpenCV checks itself."""
    if data.startswith(_PNG):
        return _complete_png(data)
    if data.startswith(_JPEG):
        return _complete_jpeg(data)
    if data.startswith(b"BM") and len(data) >= 54:
        return len(data) >= int.from_bytes(data[2:6], "little")
    if data.startswith(b"RIFF") and data[8:12] == b"WEBP":
        return len(data) >= int.from_bytes(data[4:8], "little") + 8
    return True


def _complete_png(data: bytes) -> bool:
    """All chunks up to IEND are there and their checksums agree."""
    at = len(_PNG)
    while at + 12 <= len(data):
        length = int.from_bytes(data[at : at + 4], "big")
        body = data[at + 4 : at + 8 + length]
        check = data[at + 8 + length : at + 12 + length]
        if len(check) < 4 or zlib.crc32(body) != int.from_bytes(check, "big"):
            return False
        if body[:4] == b"IEND":
            return True
        at += 12 + length
    return False


def _complete_jpeg(data: bytes) -> bool:
    """An end mark follows the scan (one inside a thumbnail does not count)."""
    at = 2
    while at + 4 <= len(data) and data[at] == 0xFF:
        marker = data[at + 1]
        if marker == 0xFF:
            at += 1
            continue
        if marker == 0xDA:
            return data.rfind(b"\xff\xd9", at) > 0
        at += 2 + int.from_bytes(data[at + 2 : at + 4], "big")
    return False


@contextlib.contextmanager
def _silenced() -> Iterator[IO[bytes]]:
    """Catch what the C libraries print to standard error meanwhile."""
    with tempfile.TemporaryFile() as caught:
        sys.stderr.flush()
        saved = os.dup(2)
        try:
            os.dup2(caught.fileno(), 2)
            yield caught
        finally:
            os.dup2(saved, 2)
            os.close(saved)
