"""Pictures in which commands draw what they found: where they may go, and the files' bytes."""

from __future__ import annotations

import os
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from polepilot.core.errors import InputError

if TYPE_CHECKING:
    from polepilot.core.observation import Image

_LARGEST = {".png": 1_000_000, ".jpg": 65_500, ".jpeg": 65_500}
"""Rows or columns that the encoders take, by the end of the file's name."""


def place_for(out: Path, files: Sequence[str], option: str = "--annotate") -> Path:
    """``out``, if it can be the one drawing of all ``files``.

    Raises:
        InputError: no name of a picture, or that of one of ``files``.
    """
    return _checked([out], files, option)[0]


def place_for_each(out: Path, files: Sequence[str], option: str = "--annotate") -> list[Path]:
    """Where what was found in each of ``files`` is drawn: ``out``, of several OUT-1.png, ...

    Raises:
        InputError: no name of a picture, or that of one of ``files``.
    """
    if len(files) == 1 or not out.suffix:
        return _checked([out], files, option)
    numbers = range(1, len(files) + 1)
    return _checked([out.with_stem(f"{out.stem}-{number}") for number in numbers], files, option)


def encoded(picture: Image, out: Path, option: str = "--annotate") -> bytes:
    """``picture`` (rows x columns x 3 BGR, or grey) as the file ``out``, PNG or JPEG by its name.

    Raises:
        InputError: such a file cannot hold so large a picture.
    """
    import cv2

    suffix = out.suffix.lower()
    rows, columns = picture.shape[:2]
    if max(rows, columns) > _LARGEST[suffix]:  # the encoder would print lines of its own
        raise InputError(
            f"{option} {out}: the drawing has {columns} x {rows} pixels: expected at most "
            f"{_LARGEST[suffix]} each way in such a file."
        )
    try:
        done, data = cv2.imencode(suffix, picture)
    except cv2.error:
        done = False
    if not done:
        raise InputError(f"{option} {out}: the drawing is too large to be written as such a file.")
    return data.tobytes()


def real(path: str | Path) -> str:
    """The name that all names of a file lead to; links are followed, there or not."""
    return os.path.realpath(path)


def _checked(drawings: list[Path], files: Sequence[str], option: str) -> list[Path]:
    taken = {real(file) for file in files}
    for drawing in drawings:
        if drawing.suffix.lower() not in _LARGEST:
            raise InputError(
                f"{option} {drawing}: expected a file whose name ends with .png or .jpg."
            )
        if real(drawing) in taken:
            raise InputError(f"{option} {drawing}: is a picture to look at; expected a new file.")
    return drawings
