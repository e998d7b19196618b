"""What each landmark of a site tells a standing robot, at many spots and headings at once.

For every stand (a spot and a heading) of a block: whether one sweep of the camera reads the
landmark, and how much its range and bearing then say about the pose: the information matrix
JᵀWJ, with the weights that `fix` gives the same measurement.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from polepilot.core import detector_model as detector
from polepilot.core.errors import InputError
from polepilot.core.geometry import Point
from polepilot.core.landmark import Landmark
from polepilot.core.localization.fix import FixSettings
from polepilot.core.vehicle import Camera, PanUnit

Floats = NDArray[np.float64]
Bools = NDArray[np.bool_]

MOST_HEADINGS = 72


@dataclass(frozen=True, slots=True)
class Sweep:
    """One turn of the camera over its pan range, seen from a robot that stands.

    Raises:
        InputError: impossible numbers.
    """

    camera: Camera = field(default_factory=Camera)
    pan: PanUnit = field(default_factory=PanUnit)
    fix: FixSettings = field(default_factory=FixSettings)
    headings: int = 8
    """In how many directions, evenly spread, the robot may stand at a spot: the camera does not
    look backward, so what it sees depends on them."""
    readings: int = 1
    """How often each landmark is read in the sweep. Only the detector's own noise averages out;
    one reading is what can be promised, as part of that noise repeats in successive pictures."""

    def __post_init__(self) -> None:
        if not 1 <= self.headings <= MOST_HEADINGS:
            raise InputError(f"headings is {self.headings}: expected 1 to {MOST_HEADINGS}.")
        if not 1 <= self.readings <= 1000:
            raise InputError(f"readings is {self.readings}: expected 1 to 1000.")

    @property
    def directions(self) -> Floats:
        """The headings, radians."""
        return np.linspace(0.0, math.tau, self.headings, endpoint=False, dtype=np.float64)


class Sight(NamedTuple):
    """One landmark as M stands see it."""

    seen: Bools
    """Read in the sweep, as far as walls and the picture are concerned."""
    information: Floats
    """6 x M: xx, xy, yy, xh, yh, hh of `base_link`'s information; zero where not seen."""


class Walls:
    """Everything that blocks the view, as segments between numbered corners."""

    def __init__(self, segments: Sequence[tuple[Point, Point]]) -> None:
        ends = np.asarray(segments, float).reshape(-1, 2, 2)
        corners, numbers = np.unique(ends.reshape(-1, 2), axis=0, return_inverse=True)
        self._corners: Floats = corners
        self._first, self._last = numbers.reshape(-1, 2).T
        step = ends[:, 1] - ends[:, 0]
        self._matrix = np.stack([-step[:, 1], step[:, 0]], axis=1)
        self._offset: Floats = (self._matrix * ends[:, 0]).sum(axis=1)

    def sides(self, points: Floats) -> Floats:
        """On which side of each segment's line each of M points lies, and how far: S x M."""
        result: Floats = self._matrix @ points.T - self._offset[:, None]
        return result

    def blocked(self, points: Floats, sides: Floats, end: Point | Floats, short: Floats) -> Bools:
        """Whether a segment stands between each of M points and its end.

        Args:
            sides: ``self.sides(points)``, which serves many ends.
            end: one place for all, or M x 2.
            short: which share of the line, at its end, does not count: M.
        """
        ends = np.asarray(end, float).reshape(-1, 2)
        away = (ends - points).T
        # Corners on either side of the line of sight ...
        turned = np.stack([-away[1], away[0]])
        corners = self._corners @ turned
        corners -= (turned * points.T).sum(axis=0)
        crossed = corners[self._first] * corners[self._last] <= 0
        # ... and both ends of that line on either side of the segment.
        there = self.sides(ends)
        there = there + short * (sides - there)
        result: Bools = np.any(crossed & (sides * there <= 0), axis=0)
        return result


class Stands:
    """M poses of `base_link` at which the robot stands and looks around."""

    def __init__(self, poses: Floats, sweep: Sweep, walls: Walls) -> None:
        """``poses`` is M x 3: x, y, heading."""
        self._sweep = sweep
        self._walls = walls
        self._heading = poses[:, 2]
        self._arm = sweep.camera.forward * np.stack([np.cos(poses[:, 2]), np.sin(poses[:, 2])])
        bases = poses[:, :2]
        self._eye = bases + self._arm.T
        self._sides = walls.sides(self._eye)
        nothing = np.zeros(len(bases))
        self.possible: Bools = ~walls.blocked(bases, walls.sides(bases), self._eye, nothing)
        """Whether the camera is on the robot's side of every wall."""

    def __len__(self) -> int:
        return len(self._heading)

    def sight(self, mark: Landmark) -> Sight:
        """What the landmark tells at every stand, other landmarks left aside."""
        sweep, kind = self._sweep, mark.kind
        camera = sweep.camera
        dx, dy, distance = self._toward(mark)
        # Beyond the end of the pan range it is seen off the picture's middle.
        pan = sweep.pan
        middle, half = 0.5 * (pan.minimum + pan.maximum), 0.5 * (pan.maximum - pan.minimum)
        bearing = np.arctan2(dy, dx) - self._heading - middle
        bearing -= math.tau * np.round(bearing / math.tau)
        beyond = np.maximum(np.abs(bearing) - half, 0.0)
        across = min(camera.center_x, camera.width - 1 - camera.center_x) - detector.BORDER
        cosine = np.cos(beyond)
        seen: Bools = beyond <= math.atan2(across, camera.constant)
        seen &= (distance - kind.axis_depth) * cosine >= detector.nearest_depth(camera, kind)
        seen &= (distance >= detector.NEAREST) & (distance <= detector.farthest(kind))
        information = np.zeros((6, len(distance)))
        chosen = np.flatnonzero(seen)
        short = np.minimum(detector.SIGHT_MARGIN / distance[chosen], 1.0)
        hidden = self._walls.blocked(
            self._eye[chosen], self._sides[:, chosen], mark.position, short
        )
        seen[chosen[hidden]] = False
        chosen = chosen[~hidden]
        information[:, chosen] = self._information(
            mark, dx[chosen], dy[chosen], distance[chosen], cosine[chosen], self._arm[:, chosen]
        )
        return Sight(seen, information)

    def uncovered(self, landmarks: Sequence[Landmark]) -> list[Bools]:
        """For each landmark, where no other one stands in front of it."""
        toward = [self._toward(mark) for mark in landmarks]
        result = []
        for index, (dx, dy, distance) in enumerate(toward):
            free = np.ones(len(self), bool)
            for other, (ox, oy, near) in zip(landmarks, toward, strict=True):
                if other is landmarks[index]:
                    continue
                aside = np.abs(ox * dy - oy * dx) < 0.5 * other.kind.diameter * distance
                ahead = np.flatnonzero(aside & (near < distance))
                free[ahead[ox[ahead] * dx[ahead] + oy[ahead] * dy[ahead] > 0]] = False
            result.append(free)
        return result

    def _toward(self, mark: Landmark) -> tuple[Floats, Floats, Floats]:
        dx, dy = mark.x - self._eye[:, 0], mark.y - self._eye[:, 1]
        distance: Floats = np.sqrt(dx * dx + dy * dy)
        return dx, dy, np.maximum(distance, 1e-6)

    def _information(
        self, mark: Landmark, dx: Floats, dy: Floats, distance: Floats, cosine: Floats, arm: Floats
    ) -> Floats:
        """JᵀWJ of one range and one bearing, as `fix` has them."""
        sweep, settings = self._sweep, self._sweep.fix
        sigma = detector.range_sigma(sweep.camera, mark.kind, distance, cosine)
        by_range = 1.0 / (sigma**2 / sweep.readings + settings.survey_sigma**2)
        floor = settings.bearing_floor**2 + (settings.survey_sigma / distance) ** 2
        by_bearing = 1.0 / (detector.BEARING_SIGMA**2 / sweep.readings + floor)
        ux, uy = dx / distance, dy / distance
        h = ux * arm[1] - uy * arm[0]
        bx, by = uy / distance, -ux / distance
        bh = -(uy * arm[1] + ux * arm[0]) / distance - 1.0
        return np.stack(
            [
                by_range * ux * ux + by_bearing * bx * bx,
                by_range * ux * uy + by_bearing * bx * by,
                by_range * uy * uy + by_bearing * by * by,
                -by_range * ux * h + by_bearing * bx * bh,
                -by_range * uy * h + by_bearing * by * bh,
                by_range * h * h + by_bearing * bh * bh,
            ]
        )
