"""Files are written whole or not at all."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path

from polepilot.core.errors import InputError


def write_whole(files: Mapping[Path, bytes], option: str = "--out") -> None:
    """Write all of these files, or leave none and no remains: ``whole_files``, all at once.

    Raises:
        InputError: a file cannot be written there.
    """
    with whole_files(option) as write:
        for path, data in files.items():
            write(path, data)


@contextmanager
def whole_files(option: str = "--out") -> Iterator[Callable[[Path, bytes], None]]:
    """A function that takes files one by one; all of them appear at the end, or none does.

    Each is written beside its place and moved there when all are complete; a link is followed.
    Where the block ends in an error no remains are left. ``option`` is what an error message calls
    the place that was asked for.

    Raises:
        InputError: a file cannot be written there.
    """
    parts: dict[Path, tuple[Path, Path]] = {}

    def write(path: Path, data: bytes) -> None:
        with _naming(option, path):
            place = path.resolve()
            if place.exists() and not place.is_file():
                raise InputError(f"{option} {path}: cannot be written: is not a file.")
            part = place.with_name(f".{place.name}.{os.getpid()}.part")
            parts[part] = path, place
            part.write_bytes(data)

    try:
        yield write
        for part, (path, place) in parts.items():
            with _naming(option, path):
                part.replace(place)
    finally:
        for part in parts:
            _remove(part)


@contextmanager
def _naming(option: str, path: Path) -> Iterator[None]:
    try:
        yield
    except (OSError, RuntimeError) as error:  # links in a circle are a RuntimeError
        why = getattr(error, "strerror", None) or error
        raise InputError(f"{option} {path}: cannot be written: {why}.") from error


def _remove(part: Path) -> None:
    try:
        part.unlink(missing_ok=True)
    except OSError:
        return  # the folder itself is out of reach: then there is no remainder in it either
