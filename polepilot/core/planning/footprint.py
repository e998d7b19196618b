"""What of the floor a robot takes up, and where it can stand without touching anything.

So far a disc around `base_link`, as wide as the clearance asks for. Whoever plans asks only these
questions of it, so that an outline that turns with the robot can take its place.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import shapely
from numpy.typing import NDArray

from polepilot.core.errors import InternalError

_TREMBLE = 1000.0
"""Outlines whose corners turn by more than this in all are taken off in steps, radians."""
_STEPS = (0.025, 0.125)
"""The first of those steps, as shares of the whole."""
_SHARP = 0.35
"""Outlines are cut where they turn by more than this, radians."""
_MOST_TURN = 1.4
"""And so that no piece turns by more than this, radians."""


@dataclass(frozen=True, slots=True)
class Footprint:
    """A disc of ``radius`` metres whose middle is `base_link`.

    ``chord``: how far the chords of a rounded outline may be inside of the arc, metres.
    """

    radius: float
    chord: float

    def __post_init__(self) -> None:
        if not (self.radius >= 0 and self.chord > 0):
            raise InternalError(f"a footprint of radius {self.radius} m, chord {self.chord} m.")

    @property
    def width(self) -> float:
        """The narrowest passage that it gets through, metres."""
        return 2 * self.radius

    @property
    def quadrant(self) -> int:
        """Segments per quarter turn that keep chords within ``chord``."""
        if self.radius <= 2 * self.chord:
            return 4
        half = math.acos(1 - self.chord / self.radius)
        return max(8, min(128, math.ceil(math.pi / 4 / half)))

    def places(
        self, floor: shapely.Geometry, things: Sequence[shapely.Geometry] = ()
    ) -> shapely.Geometry:
        """Where `base_link` may be on ``floor`` so that neither its edge nor ``things`` (lines,
        points) are touched."""
        calm, rest = calmed(floor, self.radius, self.chord / 2)
        disc = self if rest == self.radius else Footprint(rest, self.chord / 2)
        free = calm.buffer(-rest, quad_segs=disc.quadrant)
        if not things:
            return free
        around = shapely.buffer(np.array(things), self.radius, quad_segs=self.quadrant)
        return free.difference(shapely.union_all(around))

    def ground(self, places: shapely.Geometry) -> shapely.Geometry:
        """What it takes up of the floor while `base_link` goes everywhere in ``places``."""
        # Of whole outlines GEOS may fill what lies between two stretches that nearly touch; it does
        # not of short ones that hardly bend, and does not when they are united.
        rims = [_short_bends(rim) for rim in shapely.get_parts(shapely.boundary(places))]
        around = shapely.buffer(np.concatenate(rims), self.radius, quad_segs=self.quadrant)
        return shapely.union_all([places, *around])


def calmed(floor: shapely.Geometry, radius: float, chord: float) -> tuple[shapely.Geometry, float]:
    """A floor less a part of ``radius`` if its outline trembles, and what of it is still to be
    taken off.

    All at once that takes time by the square of how many corners are within ``radius``; what is
    left of them after a few millimetres is calm. ``chord``: how far arcs may be inside, metres.
    """
    rest = radius
    if sum(_turned(rim).sum() for rim in shapely.get_parts(shapely.boundary(floor))) > _TREMBLE:
        for share in _STEPS:
            disc = Footprint(share * radius, chord / len(_STEPS))
            floor = floor.buffer(-disc.radius, quad_segs=disc.quadrant)
            rest -= disc.radius
    return floor, rest


def _turned(rim: shapely.LineString) -> NDArray[np.float64]:
    """By how much a line turns at each of its inner points, radians."""
    steps = np.diff(shapely.get_coordinates(rim), axis=0)
    turns = np.diff(np.arctan2(steps[:, 1], steps[:, 0]))
    return np.asarray(np.abs((turns + math.pi) % math.tau - math.pi))


def _short_bends(rim: shapely.LineString) -> NDArray[np.object_]:
    """A line in pieces without sharp corners, each of which turns by little in all."""
    points, turns = shapely.get_coordinates(rim), _turned(rim)
    sharp = turns > _SHARP
    piece = np.floor(np.cumsum(np.where(sharp, 0.0, turns)) / _MOST_TURN) + np.cumsum(sharp)
    cuts = np.r_[0, np.flatnonzero(np.diff(np.r_[0.0, piece])) + 1, len(points) - 1]
    sizes = np.diff(cuts) + 1
    rows = np.repeat(np.arange(len(sizes)), sizes)
    places = np.arange(len(rows)) - rows  # each piece begins with the last point of the one before
    return np.asarray(shapely.linestrings(points[places], indices=rows))
