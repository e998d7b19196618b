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

from polepilot.core.errors import InternalError


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
        free = floor.buffer(-self.radius, quad_segs=self.quadrant)
        if not things:
            return free
        around = shapely.buffer(np.array(things), self.radius, quad_segs=self.quadrant)
        return free.difference(shapely.union_all(around))

    def ground(self, places: shapely.Geometry) -> shapely.Geometry:
        """What it takes up of the floor while `base_link` goes everywhere in ``places``."""
        ground = places.buffer(self.radius, quad_segs=self.quadrant)
        if ground.is_valid:
            return ground
        # Where arcs nearly touch each other GEOS may let them cross, and fill what lies between.
        rims = [shapely.get_coordinates(rim) for rim in shapely.get_parts(places.boundary)]
        sides = np.concatenate([np.stack([rim[:-1], rim[1:]], axis=1) for rim in rims])
        discs = shapely.buffer(shapely.linestrings(sides), self.radius, quad_segs=self.quadrant)
        return shapely.union_all([places, *discs])
