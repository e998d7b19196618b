"""What a picture file says about itself: format, size, and whether the file is all there.

Read before anything is decoded: a file of a few kilobytes can claim gigabytes of pixels, and
decoders hand out half a picture without complaint. Only the formats known here are decoded at all.
"""

from __future__ import annotations

import re
import struct
import zlib
from collections.abc import Callable, Iterator
from dataclasses import dataclass

_SIGNATURE = 16
"""Bytes at the start of a file that are enough to tell the formats apart."""


@dataclass(frozen=True, slots=True)
class Header:
    """Columns and rows as the file states them."""

    width: int
    height: int
    complete: bool
    """Whether the file reaches its own end. A decoder may still find something else wrong."""
    scans: int = 1
    """How often a decoder goes over all pixels (progressive JPEG)."""


_BROKEN = (struct.error, IndexError, ValueError, OverflowError)
"""What reading numbers raises where they are missing or point out of the file."""

DAMAGED = Header(0, 0, complete=False)


def is_picture(data: bytes) -> bool:
    """Whether ``data``, a file or its first bytes, begins like a format that is read here."""
    return _reader(data) is not None


def read_header(data: bytes) -> Header | None:
    """The header of a whole file; None for an unknown format, ``DAMAGED`` for a broken one."""
    reader = _reader(data)
    if reader is None:
        return None
    try:
        header = reader(data)
    except _BROKEN:
        return DAMAGED
    return header if header.width > 0 and header.height > 0 else DAMAGED


def _png(data: bytes) -> Header:
    width, height = struct.unpack_from(">4x4sII", data, 8)[1:]
    if data[12:16] != b"IHDR":
        return DAMAGED
    view, at = memoryview(data), 8
    while at + 12 <= len(data):
        length = int.from_bytes(data[at : at + 4], "big")
        end = at + 12 + length
        if end > len(data):
            break
        if zlib.crc32(view[at + 4 : end - 4]) != int.from_bytes(data[end - 4 : end], "big"):
            break
        if data[at + 4 : at + 8] == b"IEND":
            return Header(width, height, complete=True)
        at = end
    return Header(width, height, complete=False)


def _jpeg(data: bytes) -> Header:
    """The frame header, and an end mark after the first scan (one in a thumbnail is no end)."""
    at, width, height = 2, 0, 0
    while data[at] == 0xFF:
        marker = data[at + 1]
        if marker == 0xFF:
            at += 1
            continue
        if 0xC0 <= marker <= 0xCF and marker not in (0xC4, 0xC8, 0xCC):
            height, width = struct.unpack_from(">HH", data, at + 5)
        elif marker == 0xDA:
            complete = data.rfind(b"\xff\xd9", at) > 0
            return Header(width, height, complete, scans=data.count(b"\xff\xda", at))
        at += 2 + int(struct.unpack_from(">H", data, at + 2)[0])
    return DAMAGED


def _bmp(data: bytes) -> Header:
    offset, size = struct.unpack_from("<II", data, 10)
    width: int
    height: int
    if size == 12:
        width, height, _, depth = struct.unpack_from("<HHHH", data, 18)
        packing = 0
    else:
        width, height, _, depth, packing = struct.unpack_from("<iiHHI", data, 18)
    height = abs(height)
    stored = int.from_bytes(data[2:6], "little")
    if packing in (0, 3):  # plain pixels: their number says where the file has to end
        stored = offset + (width * depth + 31) // 32 * 4 * height
    return Header(width, height, complete=len(data) >= stored)


def _webp(data: bytes) -> Header:
    complete = len(data) >= int.from_bytes(data[4:8], "little") + 8
    kind = data[12:16]
    if kind == b"VP8X":
        width = int.from_bytes(data[24:27], "little") + 1
        height = int.from_bytes(data[27:30], "little") + 1
    elif kind == b"VP8L":
        bits = int(struct.unpack_from("<I", data, 21)[0])
        width, height = (bits & 0x3FFF) + 1, (bits >> 14 & 0x3FFF) + 1
    elif kind == b"VP8 ":
        width, height = (int(side) & 0x3FFF for side in struct.unpack_from("<HH", data, 26))
    else:
        return DAMAGED
    return Header(width, height, complete=complete and len(data) >= 30)


def _tiff(data: bytes) -> Header:
    """The first picture of the file; all of its strips or tiles have to lie inside the file."""
    tags = {tag: values for tag, _, values in _tiff_tags(data)}
    starts = tags.get(_STRIPS) or tags.get(_TILES) or ()
    lengths = tags.get(_STRIP_LENGTHS) or tags.get(_TILE_LENGTHS) or (0,) * len(starts)
    complete = len(starts) == len(lengths) > 0 and all(
        first + length <= len(data) for first, length in zip(starts, lengths, strict=True)
    )
    return Header(tags.get(_COLUMNS, (0,))[0], tags.get(_ROWS, (0,))[0], complete)


def upright(data: bytes) -> bytes:
    """The same file without the remark that asks a TIFF decoder to turn the picture."""
    if _reader(data) is not _tiff:
        return data
    try:
        found = [at for tag, at, values in _tiff_tags(data) if tag == _TURN and values != (1,)]
    except _BROKEN:
        return data
    changed = bytearray(data)
    for at in found:
        struct.pack_into("<H" if data[:2] == b"II" else ">H", changed, at, 1)
    return bytes(changed) if found else data


_COLUMNS, _ROWS, _TURN = 256, 257, 274
_STRIPS, _STRIP_LENGTHS, _TILES, _TILE_LENGTHS = 273, 279, 324, 325
_TAGS = {_COLUMNS, _ROWS, _TURN, _STRIPS, _STRIP_LENGTHS, _TILES, _TILE_LENGTHS}


def _tiff_tags(data: bytes) -> Iterator[tuple[int, int, tuple[int, ...]]]:
    """Tag, place of its values and the values, of the tags that count here; BigTIFF too."""
    order = "<" if data[:2] == b"II" else ">"
    big = struct.unpack_from(order + "H", data, 2)[0] == 43
    start = int(struct.unpack_from(order + ("Q" if big else "I"), data, 8 if big else 4)[0])
    count = int(struct.unpack_from(order + ("Q" if big else "H"), data, start)[0])
    start, entry, room = (start + 8, 20, 8) if big else (start + 2, 12, 4)
    for at in range(start, min(start + count * entry, len(data)), entry):
        tag, kind = struct.unpack_from(order + "HH", data, at)
        number = int(struct.unpack_from(order + ("Q" if big else "I"), data, at + 4)[0])
        letter = {1: "B", 3: "H", 4: "I", 16: "Q"}.get(kind)
        if letter is None or tag not in _TAGS or number > len(data):
            continue
        form = f"{order}{number}{letter}"
        place = at + entry - room
        if struct.calcsize(form) > room:
            place = int(struct.unpack_from(order + ("Q" if big else "I"), data, place)[0])
        yield tag, place, struct.unpack_from(form, data, place)


def _gif(data: bytes) -> Header:
    width, height = struct.unpack_from("<HH", data, 6)
    return Header(width, height, complete=data.rstrip(b"\0").endswith(b";"))


def _pnm(data: bytes) -> Header:
    """Portable maps: text (P1 to P3) or bytes (P4 to P6) after a head of words and remarks."""
    kind = data[1:2]
    words = 2 if kind in b"14" else 3
    word = rb"(?:\s|#[^\n]*\n)+(\d{1,9})"
    found = re.match(rb"P\d" + word * words + rb"\s", data[:4096])
    if found is None:
        return DAMAGED
    width, height = int(found[1]), int(found[2])
    if kind in b"123":
        return Header(width, height, complete=True)  # the decoder misses words by itself
    if kind == b"4":
        needed = (width + 7) // 8 * height
    else:
        needed = width * height * (3 if kind == b"6" else 1) * (1 if int(found[3]) < 256 else 2)
    return Header(width, height, complete=len(data) >= found.end() + needed)


_READERS: tuple[tuple[re.Pattern[bytes], Callable[[bytes], Header]], ...] = (
    (re.compile(rb"\x89PNG\r\n\x1a\n"), _png),
    (re.compile(rb"\xff\xd8\xff"), _jpeg),
    (re.compile(rb"BM"), _bmp),
    (re.compile(rb"RIFF....WEBP", re.DOTALL), _webp),
    (re.compile(rb"II[*+]\0|MM\0[*+]"), _tiff),
    (re.compile(rb"GIF8[79]a"), _gif),
    (re.compile(rb"P[1-6][\s#]"), _pnm),
)


def _reader(data: bytes) -> Callable[[bytes], Header] | None:
    start = data[:_SIGNATURE]
    return next((read for pattern, read in _READERS if pattern.match(start)), None)
