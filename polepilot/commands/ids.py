"""Ids as people type them: ``1-15``, ``1,3,7-9``."""

from __future__ import annotations

from polepilot.core.errors import InputError


def parse_ids(text: str, bits: int) -> list[int]:
    """``"1,3,7-9"`` as sorted ids.

    Raises:
        InputError: no such list, or an id that does not fit into ``bits``.
    """
    largest = 2**bits - 1
    chosen: set[int] = set()
    for part in text.split(","):
        first, dash, last = part.strip().partition("-")
        if not (first.isdecimal() and (last.isdecimal() if dash else True)):
            raise InputError(f"--ids is {text!r}: expected ids and ranges, as 1-15 or 1,3,7-9.")
        low, high = int(first), int(last) if dash else int(first)
        if not 1 <= low <= high <= largest:
            raise InputError(
                f"--ids is {text!r}: {part.strip()!r} is not within 1 to {largest} ({bits} bits)."
            )
        chosen.update(range(low, high + 1))
    return sorted(chosen)
