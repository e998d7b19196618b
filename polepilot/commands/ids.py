"""Ids as people type them after ``--ids``: ``1-15``, ``1,3,7-9``."""

from __future__ import annotations

from polepilot.core import landmark
from polepilot.core.errors import InputError


def parse_ids(text: str, bits: int) -> list[int]:
    """``"1,3,7-9"`` as sorted ids.

    Raises:
        InputError: no such list, or an id that does not fit into ``bits``.
    """
    try:
        return list(landmark.parse_ids(text, bits))
    except InputError as error:
        raise InputError(f"--{error.message}") from error  # its words are our options
