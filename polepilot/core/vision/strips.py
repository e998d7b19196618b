"""Where landmarks may be: columns in which bright and dark runs have the proportions of a code.

All runs of all columns are looked at together. A code of N segments begins and ends with a bright
run two segments long; the bright runs between are one segment long and sit at odd places. Columns
that agree form one strip.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from polepilot.core.landmark import SUPPORTED_BITS

Ints = NDArray[np.intp]
Bytes = NDArray[np.uint8]

_SHORTEST_SEGMENT = 1.2
"""Pixels; shorter segments cannot be told apart."""
_SLACK = 0.28
"""Share of a segment by which a run may miss its length or its place."""
_ROUNDING = 0.85
"""Pixels by which whole-pixel runs may miss besides."""
_LEAST_CONTRAST = 0.2
"""Of the darker end bar over the brightest fence, as a share of the former."""
_MOST_STRIPS = 40
"""Strips that are looked at closer, the widest first."""
_MOST_HITS = 4000
"""Columns that are looked at closer in one picture; a picture full of stripes has no landmark."""


@dataclass(frozen=True, slots=True)
class Strip:
    """Neighbouring columns that show one code: whole pixels, good to about a pixel."""

    bits: int
    first: int
    last: int
    """Columns, both included."""
    top: float
    bottom: float
    """Outer edges of the code (a pixel's edges lie at its centre +- 0.5)."""
    columns: int
    """How many columns agreed."""


def find_strips(mask: Bytes, signal: Bytes, bits: Iterable[int]) -> list[Strip]:
    """All strips for codes of these bits.

    Args:
        mask: rows x columns, non-zero = bright.
        signal: grey levels from which the mask was made.
        bits: which codes to look for.
    """
    column, start, end = _runs(mask)
    strips: list[Strip] = []
    for number in sorted(set(bits)):
        assert number in SUPPORTED_BITS
        hits = _contrasting(signal, *_match(column, start, end, number), number)
        if len(hits[0]):
            strips += _group(*hits, number)
    strips.sort(key=lambda strip: -strip.columns)
    return strips[:_MOST_STRIPS]


def _runs(mask: Bytes) -> tuple[Ints, Ints, Ints]:
    """Column, first row and row after the last of every bright run, column by column."""
    rows, columns = mask.shape
    flat = np.zeros((columns, rows + 1), np.bool_)
    np.not_equal(mask.T, 0, out=flat[:, 1:])
    line = flat.ravel()
    change = np.flatnonzero(line[1:] != line[:-1]) + 1
    if len(change) % 2:
        change = np.append(change, line.size)
    start, end = change[0::2], change[1::2]
    column = start // (rows + 1)
    offset = column * (rows + 1) + 1
    return column, start - offset, end - offset


def _match(column: Ints, start: Ints, end: Ints, bits: int) -> tuple[Ints, Ints, Ints]:
    """Column, top and bottom of every sequence of runs that looks like a code."""
    segments = 2 * bits + 5
    length = end - start
    found: list[tuple[Ints, Ints, Ints]] = []
    for runs in range(3, bits + 3):
        span = runs - 1
        if len(start) <= span:
            break
        top, bottom = start[:-span], end[span:]
        unit = (bottom - top) / segments
        slack = _SLACK * unit + _ROUNDING
        good = (column[:-span] == column[span:]) & (unit >= _SHORTEST_SEGMENT)
        good &= np.abs(length[:-span] - 2 * unit) <= slack
        good &= np.abs(length[span:] - 2 * unit) <= slack
        index = np.flatnonzero(good)
        for inner in range(1, span):
            if not len(index):
                break
            step, room = unit[index], slack[index]
            run = index + inner
            middle = ((start[run] + end[run]) / 2 - top[index]) / step
            # Bits sit at segments 3, 5, ...: their middles at 3.5, 5.5, ...
            place = np.clip(np.rint((middle - 3.5) / 2), 0, bits - 1) * 2 + 3.5
            fits = np.abs(middle - place) * step <= room
            fits &= np.abs(length[run] - step) <= room
            index = index[fits]
        if len(index):
            found.append((column[index], start[index], end[index + span]))
    if not found:
        return (np.empty(0, np.intp),) * 3
    merged = [np.concatenate(part) for part in zip(*found, strict=True)]
    order = np.argsort(merged[0], kind="stable")[:_MOST_HITS]
    return merged[0][order], merged[1][order], merged[2][order]


def _contrasting(
    signal: Bytes, column: Ints, top: Ints, bottom: Ints, bits: int
) -> tuple[Ints, Ints, Ints]:
    """Leave out what only noise has striped: end bars must clearly outshine all fences."""
    segments = 2 * bits + 5
    places = np.concatenate([[0.5, 1.5], np.arange(2, segments - 2, 2) + 0.5])
    places = np.concatenate([places, [segments - 1.5, segments - 0.5]])
    rows = top[:, None] + places * ((bottom - top) / segments)[:, None]
    # A landmark is at least about three columns wide: their mean is less noisy than one.
    last = signal.shape[1] - 1
    light = sum(
        signal[rows.astype(np.intp), np.clip(column + side, 0, last)[:, None]].astype(np.int32)
        for side in (-1, 0, 1)
    )
    assert isinstance(light, np.ndarray)
    ends = np.minimum(light[:, :2].max(axis=1), light[:, -2:].max(axis=1))
    good = ends - light[:, 2:-2].max(axis=1) > _LEAST_CONTRAST * ends
    return column[good], top[good], bottom[good]


def _group(column: Ints, top: Ints, bottom: Ints, bits: int) -> list[Strip]:
    """Join neighbouring columns whose codes begin and end at the same height."""
    segments = 2 * bits + 5
    open_groups: list[list[int]] = []
    done: list[list[int]] = []
    columns, tops, bottoms = column.tolist(), top.tolist(), bottom.tolist()
    for at in range(len(columns)):
        room = 0.5 * (bottoms[at] - tops[at]) / segments + 1.0
        still: list[list[int]] = []
        for group in open_groups:
            (still if columns[at] - columns[group[-1]] <= 3 else done).append(group)
        open_groups = still
        for group in open_groups:
            last = group[-1]
            if abs(tops[at] - tops[last]) <= room and abs(bottoms[at] - bottoms[last]) <= room:
                group.append(at)
                break
        else:
            open_groups.append([at])
    return [
        Strip(
            bits=bits,
            first=columns[group[0]],
            last=columns[group[-1]],
            top=float(np.median(top[group])) - 0.5,
            bottom=float(np.median(bottom[group])) - 0.5,
            columns=len({columns[at] for at in group}),
        )
        for group in done + open_groups
    ]
