"""Pictures from files, whole or not at all.

A path may name anything: half a file, a pipe that nobody writes to, a device without end, a few
bytes that claim gigabytes of pixels. Here that is an error which names the file, soon and within
bounded memory; nothing but the error is said, although decoders print warnings of their own.
"""

from __future__ import annotations

import contextlib
import os
import re
import stat
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import IO

import cv2
import numpy as np

from polepilot.core.errors import ImageError
from polepilot.core.observation import Image
from polepilot.core.vision.headers import is_picture, read_header, upright

MAX_PIXELS = 100_000_000
"""Of one picture; 300 MB in colour while it is looked at."""
MAX_BYTES = 512 * 2**20
"""Of one file."""
_MAX_PASSES = 20 * MAX_PIXELS
"""Pixels times scans of a progressive JPEG: ten scans are usual, thousands are an attack."""
_FORMATS = "PNG, JPEG, BMP, WebP, TIFF, GIF or PNM"
_CUT_SHORT = re.compile(rb"premature end|bad huffman|not enough|read error", re.IGNORECASE)


def read_image(path: str | Path, *, quiet: bool = True) -> Image:
    """A picture file as 8 bits: rows x columns x 3 (BGR), or rows x columns if it is grey.

    16-bit pictures are scaled to 8 bits, transparency is left out. The pixels are those that the
    file stores: nothing is resized, and a note in the file that asks to turn them (EXIF) is not
    followed, since camera constant and optical axis belong to the pixels as taken. Of an animation
    the first picture counts.

    Args:
        quiet: catch what decoders print to standard error, which also tells of files cut short.
            It redirects standard error of the whole process for a moment; threads of a service
            that logs there leave it off.

    Raises:
        ImageError: missing, not a file, no picture, not all of it, or too large; names the file.
    """
    name = shown(path)
    data = _read(path, name)
    header = read_header(data)
    if header is None:
        raise ImageError(f"{name}: is no picture that can be read; expected {_FORMATS}.")
    pixels = header.width * header.height
    if pixels > MAX_PIXELS:
        raise ImageError(
            f"{name}: has {header.width} x {header.height} pixels; "
            f"expected at most {MAX_PIXELS // 1_000_000} million in all."
        )
    if not header.complete or pixels * header.scans > _MAX_PASSES:
        raise ImageError(f"{name}: the picture is damaged or ends too early.")
    return _to_eight_bits(_decode(upright(data), name, quiet), name)


def shown(path: str | Path) -> str:
    """``path`` for a message: on one line, whatever characters it has."""
    text = str(path)
    return text if text.isprintable() else ascii(text)


def _read(path: str | Path, name: str) -> bytes:
    """The bytes of an ordinary file that begins like a picture."""
    try:
        _check_kind(Path(path).stat(), name)  # before opening it, which does things to some devices
        # Without waiting: a pipe that has just taken the file's place would hang until written to.
        handle = os.open(path, os.O_RDONLY | os.O_NONBLOCK | os.O_CLOEXEC)
        with os.fdopen(handle, "rb", buffering=0) as file:
            _check_kind(os.fstat(handle), name)
            data = file.read(65536) or b""
            if not data:
                raise ImageError(f"{name}: is empty; expected a picture.")
            if not is_picture(data):
                raise ImageError(f"{name}: is no picture that can be read; expected {_FORMATS}.")
            parts = [data]
            size = len(data)
            while size <= MAX_BYTES and (more := file.read(2**24)):
                parts.append(more)
                size += len(more)
    except FileNotFoundError:
        raise ImageError(f"{name}: no such file; expected a picture.") from None
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or str(error)
        raise ImageError(f"{name}: cannot be read ({reason.lower()}).") from None
    if size > MAX_BYTES:
        raise ImageError(f"{name}: is larger than {MAX_BYTES // 2**20} MiB; expected a picture.")
    return b"".join(parts)


def _check_kind(status: os.stat_result, name: str) -> None:
    if stat.S_ISDIR(status.st_mode):
        raise ImageError(f"{name}: is a directory; expected a picture file.")
    if not stat.S_ISREG(status.st_mode):
        kind = "a pipe" if stat.S_ISFIFO(status.st_mode) else "a device"
        raise ImageError(f"{name}: is {kind}; expected a picture file.")
    if status.st_size > MAX_BYTES:
        raise ImageError(
            f"{name}: is {status.st_size / 2**20:.0f} MiB large; "
            f"expected a picture of at most {MAX_BYTES // 2**20} MiB."
        )


def _decode(data: bytes, name: str, quiet: bool) -> np.ndarray:
    with _silenced() if quiet else contextlib.nullcontext() as said:
        try:
            image = cv2.imdecode(np.frombuffer(data, np.uint8), cv2.IMREAD_UNCHANGED)
        except cv2.error as error:
            if error.code == cv2.Error.StsNoMem:
                raise ImageError(f"{name}: there is not enough memory for it.") from None
            image = None
        warnings = b""
        if said is not None:
            said.seek(0)
            warnings = said.read()
    if image is None or image.size == 0:
        raise ImageError(f"{name}: is no picture that can be read; the file is damaged.")
    if _CUT_SHORT.search(warnings):
        raise ImageError(f"{name}: the picture is damaged or ends too early.")
    decoded: np.ndarray = image
    return decoded


def _to_eight_bits(image: np.ndarray, name: str) -> Image:
    if image.dtype == np.uint16:
        image = cv2.convertScaleAbs(image, alpha=1 / 257)
    if image.dtype != np.uint8:
        raise ImageError(f"{name}: has {image.dtype} pixels; expected 8 or 16 bits per channel.")
    if image.ndim == 2 or image.shape[2] == 3:
        return image
    if image.shape[2] == 4:
        return np.asarray(cv2.cvtColor(image, cv2.COLOR_BGRA2BGR), dtype=np.uint8)
    if image.shape[2] > 4:
        raise ImageError(f"{name}: has {image.shape[2]} channels; expected grey or colour.")
    return np.ascontiguousarray(image[:, :, 0])  # grey, perhaps with transparency


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
