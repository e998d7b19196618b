"""What a disc sweeps along lines, in few polygons: a band along each bend, not one per chord."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import shapely
from numpy.typing import NDArray

from polepilot.core.planning.swept import few_corners

Points = NDArray[np.float64]
Indices = NDArray[np.intp]
Flags = NDArray[np.bool_]
Shapes = NDArray[np.object_]

_GENTLE = 0.35
"""Where a line turns by more than this one band ends and the next begins, radians."""
_MOST_TURN = 1.4
"""A band turns by no more than this in all, so that it cannot overlap itself, radians."""
_LONGEST = 20.0
"""Bends longer than this, in radii of the disc, are cut."""
_SPARE = 0.9
"""On its inner side a bend takes up no more than this share of any of its chords."""
_WHOLE = 3.1
"""A turn beyond this is one back on the same line, radians."""


@dataclass(frozen=True, slots=True, eq=False)
class Bands:
    """Lines cut into bands of a disc of ``radius``: straight ones, and bends in one piece.

    Each band ends with the sector at the corner that follows it; the half discs at the ends of the
    lines are bands of no length.
    """

    radius: float
    shapes: Shapes
    """The polygons."""
    tracks: Shapes
    """The lines of the disc's middle."""
    keys: Points
    """N x 8: where each begins and ends, the turn that follows, and numbers that differ if anything
    between those does; straight ones have zeros there."""

    def keys_near(self, bands: Indices, low: Points, high: Points) -> Points:
        """Keys of bands as they are seen from boxes (M x 2 corners each) beside them: equal ones
        sweep the same of the box."""
        keys = self.keys[bands]
        ends, steps = keys[:, 2:4], keys[:, 2:4] - keys[:, :2]
        straight = (keys[:, 5] == 0) & (np.abs(steps).sum(axis=1) > 0)
        grow = self.radius + 0.001
        with np.errstate(divide="ignore", invalid="ignore"):
            one = (low - grow - keys[:, :2]) / steps
            two = (high + grow - keys[:, :2]) / steps
        flat = steps == 0
        enter = np.where(flat, 0.0, np.minimum(one, two)).max(axis=1).clip(0.0, 1.0)
        leave = np.where(flat, 1.0, np.maximum(one, two)).min(axis=1).clip(0.0, 1.0)
        far = ((ends < low - grow) | (ends > high + grow)).any(axis=1)
        cut = np.column_stack(
            [
                keys[:, :2] + enter[:, None] * steps,
                keys[:, :2] + leave[:, None] * steps,
                np.where(far, 0.0, keys[:, 4]),
                keys[:, 5:],
            ]
        )
        return np.asarray(np.where(straight[:, None], cut, keys))

    def capsules(self, bands: Indices, quad_segs: int) -> Shapes:
        """What is swept along each chord of some bands, with both half discs."""
        coords, rows = shapely.get_coordinates(self.tracks[bands], return_index=True)
        inside = rows[:-1] == rows[1:]
        pairs = np.stack([coords[:-1][inside], coords[1:][inside]], axis=1)
        return np.asarray(
            shapely.buffer(shapely.linestrings(pairs), self.radius, quad_segs=quad_segs)
        )


def bands_of(lines: Sequence[Points], radius: float, quad_segs: int, error: float) -> Bands:
    """The bands that a disc of ``radius`` sweeps along lines, N x 2 points each.

    ``quad_segs``: chords per quarter turn of the disc; ``error``: how far chords of the lines may
    be from them, metres.
    """
    few = [_few(line, error) for line in lines]
    points = np.vstack(few)
    of = np.repeat(np.arange(len(few)), [len(line) for line in few])
    begins = np.flatnonzero(of[:-1] == of[1:])
    steps = points[begins + 1] - points[begins]
    lengths = np.hypot(*steps.T)
    angles = np.arctan2(steps[:, 1], steps[:, 0])
    goes_on = np.r_[begins[1:] == begins[:-1] + 1, False] if len(begins) else np.zeros(0, bool)
    turns = np.where(goes_on, np.roll(angles, -1) - angles, 0.0)
    turns = (turns + math.pi) % math.tau - math.pi
    turns = np.where(np.abs(turns) > _WHOLE, np.copysign(math.pi, turns), turns)
    first = _first_of_bands(lengths, turns, goes_on, radius)
    tips = points[np.flatnonzero(np.r_[True, of[1:] != of[:-1]])]
    tips = np.vstack([tips, points[np.flatnonzero(np.r_[of[1:] != of[:-1], True])]])
    shapes, tracks, keys = _cut(points, begins, first, turns, angles, radius, quad_segs)
    ends = np.column_stack([tips, tips, np.zeros((len(tips), 4))])
    return Bands(
        radius,
        np.concatenate([shapely.buffer(shapely.points(tips), radius, quad_segs=quad_segs), shapes]),
        np.concatenate([shapely.linestrings(np.stack([tips, tips], axis=1)), tracks]),
        np.vstack([ends, keys]),
    )


def _few(line: Points, error: float) -> Points:
    """A line with few corners, none of them twice in a row."""
    line = line[np.r_[True, np.hypot(*np.diff(line, axis=0).T) > 1e-9]]
    return line[few_corners(line, error)]


def _first_of_bands(lengths: Points, turns: Points, goes_on: Flags, radius: float) -> Flags:
    """Which segments begin a band."""
    if not len(lengths):
        return np.zeros(0, bool)
    bends = goes_on & (np.abs(turns) <= _GENTLE)
    needed = np.where(bends, radius * np.tan(np.abs(turns) / 2), 0.0)
    tight = np.r_[0.0, needed[:-1]] + needed > _SPARE * lengths
    bends &= ~tight & ~np.r_[tight[1:], False]
    first = np.r_[True, ~bends[:-1]]
    spent = np.r_[0.0, np.where(bends, np.abs(turns), 0.0)[:-1]] / _MOST_TURN
    spent = np.cumsum(spent + np.r_[0.0, lengths[:-1]] / (_LONGEST * radius))
    starts = np.flatnonzero(first)
    spent = np.floor(spent - np.repeat(spent[starts], np.diff(np.r_[starts, len(first)])))
    return np.asarray(first | np.r_[False, spent[1:] != spent[:-1]])


def _cut(
    points: Points,
    begins: Indices,
    first: Flags,
    turns: Points,
    angles: Points,
    radius: float,
    quad_segs: int,
) -> tuple[Shapes, Shapes, Points]:
    """Polygons, middle lines and keys of the bands that begin at the segments ``first``."""
    if not len(begins):
        return np.zeros(0, object), np.zeros(0, object), np.zeros((0, 8))
    starts = np.flatnonzero(first)
    counts = np.diff(np.r_[starts, len(begins)])
    # The corners of each band: where it begins, and where each of its segments ends.
    sizes = counts + 1
    heads = np.cumsum(sizes) - sizes
    band = np.repeat(np.arange(len(sizes)), sizes)
    place = np.arange(len(band)) - heads[band]
    segment = starts[band] + np.maximum(place - 1, 0)
    corner = begins[segment] + (place > 0)
    turn = np.where(place > 0, turns[segment], 0.0)
    last = place == counts[band]
    coords = points[corner]
    back = (2 * heads + counts)[band] - np.arange(len(band))  # the same band from its end
    came, disc = angles[segment], (radius, quad_segs)
    sides = [
        _side(coords, came, turn, last, 1.0, *disc),
        _side(coords[back], came[back], turn[back], last[back], -1.0, *disc),
    ]
    many = [np.bincount(band[rows], minlength=len(sizes)) for _, rows in sides]
    ring = np.zeros((sum(len(rows) for _, rows in sides), 2))
    offset = np.cumsum(many[0] + many[1]) - many[0] - many[1]
    leads = [np.zeros_like(many[0]), many[0]]
    for (spots, rows), lead, count in zip(sides, leads, many, strict=True):
        at = (offset + lead - np.cumsum(count) + count)[band[rows]] + np.arange(len(rows))
        ring[at] = spots
    owner = np.repeat(np.arange(len(sizes)), many[0] + many[1])
    shapes = shapely.polygons(shapely.linearrings(ring, indices=owner))
    inner = (place > 0) & ~last
    weight = np.where(inner, 1.0 + place * 0.618, 0.0)[:, None] * coords
    ends = heads + counts
    keys = np.column_stack(
        [
            coords[heads],
            coords[ends],
            turn[ends],
            counts - 1.0,
            np.add.reduceat(weight, heads, axis=0),
        ]
    )
    return np.asarray(shapes), np.asarray(shapely.linestrings(coords, indices=band)), keys


def _side(
    coords: Points,
    angles: Points,
    turn: Points,
    last: Flags,
    side: float,
    radius: float,
    quad_segs: int,
) -> tuple[Points, Indices]:
    """The outline of bands on one side (1: left), and at which of the corners each point is.

    Left sides run forward, right ones backward; ``angles`` is the direction in which each corner
    is come to.
    """
    outer = turn * side < 0
    # Back on the same line: half a disc, whose last point the other side has as well.
    whole = outer & last & (np.abs(turn) > _WHOLE)
    chords = np.ceil(np.abs(turn) / (math.pi / 2 / quad_segs) - 1e-9).astype(np.intp)
    middle = outer & last & ~whole
    sizes = np.where(outer, chords + 1, 1) + middle - whole
    rows = np.repeat(np.arange(len(coords)), sizes)
    place = np.arange(len(rows)) - np.repeat(np.cumsum(sizes) - sizes, sizes)
    if side > 0:
        share = place / np.maximum(chords, 1)[rows]
        tip = middle[rows] & (place == sizes[rows] - 1)
    else:
        share = 1 - (place - middle[rows] + whole[rows]) / np.maximum(chords, 1)[rows]
        tip = middle[rows] & (place == 0)
    bent = np.where(outer[rows], turn[rows] * share, np.where(last, 0.0, turn / 2)[rows])
    across = angles[rows] + bent + side * math.pi / 2
    out = np.where(outer | last, radius, radius / np.cos(turn / 2))[rows]
    out = np.where(tip, 0.0, out)
    return coords[rows] + out[:, None] * np.stack([np.cos(across), np.sin(across)], axis=1), rows
