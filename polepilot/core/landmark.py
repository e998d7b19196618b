"""Barcode poles: their code and their size.

A code has 2n+5 segments of equal length, read from the top: two of the bright colour, then
``0 b0 0 b1 0 ... b(n-1) 0`` with the least significant bit nearest the top, then two bright ones
(paper, "Landmark" and Fig. 5). Orange is 1 and black is 0; the one sentence of the paper that
says the opposite contradicts its own figure and example.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field
from functools import cache
from itertools import combinations
from typing import Literal

from polepilot.core.errors import InputError
from polepilot.core.geometry import Point

SUPPORTED_BITS = (4, 5, 6, 8)
Shape = Literal["cylinder", "flat"]
LARGEST_SPACING = 4
"""`id_set` knows sets of ids that differ in up to this many segments."""
_TWENTY_WORDS = (
    *(5, 8, 22, 34, 47, 57, 78, 91, 97, 119),
    *(124, 139, 157, 164, 179, 190, 199, 234, 237, 240),
)
"""Words of eight bits that differ in at least three: twenty is the most there are."""


def encode(landmark_id: int, bits: int = 4) -> str:
    """The segment string of an id, top first: ``encode(13) == "1101000101011"``.

    Raises:
        InputError: the id does not fit into ``bits``, or ``bits`` is not supported.
    """
    _check_bits(bits)
    if not 1 <= landmark_id < 2**bits:
        raise InputError(
            f"landmark id {landmark_id} does not fit into {bits} bits: expected 1 to {2**bits - 1}."
        )
    middle = "0".join(str(landmark_id >> bit & 1) for bit in range(bits))
    return f"110{middle}011"


def decode(code: str) -> int | None:
    """The id of a segment string (top first), or None where it is no legal code.

    The number of bits follows from the length. Id 0 is not used and is no legal code.
    """
    bits, odd = divmod(len(code) - 5, 2)
    if odd or bits not in SUPPORTED_BITS or set(code) - {"0", "1"}:
        return None
    middle = code[2:-2]
    if code[:2] != "11" or code[-2:] != "11" or "1" in middle[::2]:
        return None
    return int(middle[1::2][::-1], 2) or None


def parse_ids(text: str, bits: int = 4) -> tuple[int, ...]:
    """``"1,3,7-9"`` as sorted ids.

    Raises:
        InputError: no such list, an id that does not fit into ``bits``, or ``bits`` is not
            supported.
    """
    _check_bits(bits)
    largest = 2**bits - 1
    chosen: set[int] = set()
    for part in text.split(","):
        first, dash, last = part.strip().partition("-")
        if not (first.isdecimal() and (last.isdecimal() if dash else True)):
            raise InputError(f"ids is {text!r}: expected ids and ranges, as 1-15 or 1,3,7-9.")
        words = (first, last or first)
        low, high = (int(word) if len(word) < 10 else largest + 1 for word in words)
        if not 1 <= low <= high <= largest:
            raise InputError(
                f"ids is {text!r}: {part.strip()!r} is not within 1 to {largest} ({bits} bits)."
            )
        chosen.update(range(low, high + 1))
    return tuple(sorted(chosen))


def spacing(ids: Iterable[int], bits: int = 4) -> int:
    """In how many segments the codes of two of these ids differ at the least.

    With 1, a single segment that is hidden, dirty or glaring turns one landmark into another; with
    2 it gives a code that stands nowhere; with 3 two such segments are noticed. A single id is as
    far from others as can be: ``bits``.

    Raises:
        InputError: an id does not fit into ``bits``, or ``bits`` is not supported.
    """
    chosen = sorted(set(ids))
    for number in chosen:
        encode(number, bits)
    # Fences and ends are the same in all codes: they differ where the bits of the ids do.
    return min(((a ^ b).bit_count() for a, b in combinations(chosen, 2)), default=bits)


@cache
def id_set(bits: int, distance: int = 2) -> tuple[int, ...]:
    """A largest set of ids whose codes differ from each other in at least ``distance`` segments.

    Distance 2: the ids with an odd number of bright bits (a parity bit that leaves out id 0).
    Distances 3 and 4: greedy codes, which are as large as any for 4 to 6 bits and at distance 4;
    for 8 bits at distance 3 greed finds 16 words of 20, so those are listed. Each is moved (one
    word added to all) to where id 0 is not in it and most bits are bright: they make more edges.

    Raises:
        InputError: ``bits`` is not supported, or ``distance`` is not 1 to 4.
    """
    _check_bits(bits)
    if not 1 <= distance <= LARGEST_SPACING:
        raise InputError(f"distance is {distance}: expected 1 to {LARGEST_SPACING} segments.")
    everything = range(2**bits)
    if distance == 1:
        return tuple(everything[1:])
    if distance == 2:
        return tuple(number for number in everything if number.bit_count() % 2)
    words: list[int] = list(_TWENTY_WORDS) if (bits, distance) == (8, 3) else []
    for word in everything:
        if all((word ^ other).bit_count() >= distance for other in words):
            words.append(word)
    moved = (sorted(word ^ step for word in words) for step in everything)
    usable = (chosen for chosen in moved if chosen[0] != 0)
    return tuple(max(usable, key=lambda chosen: sum(word.bit_count() for word in chosen)))


def recommended_ids(bits: int, count: int | None = None) -> tuple[int, ...]:
    """The ids to use: with distance 2, or, where ``count`` is known, with the largest there is.

    Raises:
        InputError: ``bits`` is not supported, or has no ``count`` ids with distance 2.
    """
    largest = id_set(bits)
    if count is None:
        return largest
    if not 1 <= count <= len(largest):
        more = next((n for n in SUPPORTED_BITS if len(id_set(n)) >= count), None)
        hint = f", or {more} bits" if more and count > 0 else ""
        raise InputError(
            f"count is {count}: {bits} bits have {len(largest)} ids that differ in 2 segments;"
            f" expected 1 to {len(largest)}{hint}."
        )
    far = (id_set(bits, distance) for distance in range(LARGEST_SPACING, 1, -1))
    return next(chosen[:count] for chosen in far if len(chosen) >= count)


@dataclass(frozen=True, slots=True)
class LandmarkKind:
    """What the landmarks of a site look like; lengths in metres."""

    bits: int = 4
    segment: float = 0.05
    """Length of one segment."""
    diameter: float = 0.07
    """Thickness of a cylinder, width of a flat sticker."""
    shape: Shape = "cylinder"

    def __post_init__(self) -> None:
        _check_bits(self.bits)
        if not 0.002 <= self.segment <= 10:
            raise InputError(f"segment is {self.segment} m: expected 0.002 to 10 m.")
        if not 0.002 <= self.diameter <= 10:
            raise InputError(f"diameter is {self.diameter} m: expected 0.002 to 10 m.")
        if self.shape not in ("cylinder", "flat"):
            raise InputError(f"shape is {self.shape!r}: expected 'cylinder' or 'flat'.")

    @property
    def segments(self) -> int:
        """How many segments the code has: 2n+5."""
        return 2 * self.bits + 5

    @property
    def height(self) -> float:
        """Length of the whole code, metres: the h1 of Eq. 1."""
        return self.segments * self.segment

    @property
    def axis_depth(self) -> float:
        """How far the axis lies behind the surface that the camera sees, metres."""
        return self.diameter / 2 if self.shape == "cylinder" else 0.0


@dataclass(frozen=True, slots=True)
class Landmark:
    """One pole of a site: number, place of its axis in `map`, and what it looks like."""

    id: int
    x: float
    y: float
    kind: LandmarkKind = field(default_factory=LandmarkKind)

    def __post_init__(self) -> None:
        encode(self.id, self.kind.bits)

    @property
    def position(self) -> Point:
        return (self.x, self.y)

    @property
    def code(self) -> str:
        """Its segment string, top first."""
        return encode(self.id, self.kind.bits)


def _check_bits(bits: int) -> None:
    if bits not in SUPPORTED_BITS:
        raise InputError(f"bits is {bits}: expected one of {SUPPORTED_BITS}.")
