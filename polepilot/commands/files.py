"""Files are written whole or not at all."""

from __future__ import annotations

import os
from collections.abc import Mapping
from pathlib import Path

from polepilot.core.errors import InputError


def write_whole(files: Mapping[Path, bytes], option: str = "--out") -> None:
    """Write all of these files, or leave none and no remains.

    Each is written beside its place and moved there when all are complete; a link is followed.
    ``option`` is what an error message calls the place that was asked for.

    Raises:
        InputError: a file cannot be written there.
    """
    parts: dict[Path, Path] = {}
    asked = next(iter(files), Path())
    try:
        for path, data in files.items():
            asked, place = path, path.resolve()
            if place.exists() and not place.is_file():
                raise InputError(f"{option} {path}: cannot be written: is not a file.")
            part = place.with_name(f".{place.name}.{os.getpid()}.part")
            parts[part] = place
            part.write_bytes(data)
        for part, place in parts.items():
            part.replace(place)
    except OSError as error:
        raise InputError(
            f"{option} {asked}: cannot be written: {error.strerror or error}."
        ) from error
    finally:
        for part in parts:
            _remove(part)


def _remove(part: Path) -> None:
    try:
        part.unlink(missing_ok=True)
    except OSError:
        return  # the folder itself is out of reach: then there is no remainder in it either
