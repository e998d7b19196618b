"""How well a standing robot will know its pose, at every spot of a site.

One sweep of the camera is summed up in the information matrix of everything that it reads, weighted
as `fix` does. Its inverse is the covariance of the pose. A spot's figure is the root mean square
over the headings at which the robot may stand there and `fix` would answer; where `fix` would
refuse at every heading, the spot has a reason and no figure.
"""

from __future__ import annotations

import math
from collections import OrderedDict
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
import shapely
from numpy.typing import NDArray

from polepilot.core.errors import InputError
from polepilot.core.landmark import Landmark
from polepilot.core.localization.precision_grid import PrecisionMap, Reason
from polepilot.core.localization.precision_sight import Bools, Floats, Sight, Stands, Sweep, Walls
from polepilot.core.site import Site

COARSE_SPOTS = 1200
"""So many spots, about, make the map that is redrawn while a landmark is dragged."""
FINE_SPOTS = 20_000
MOST_SPOTS = 200_000
_STEPS = tuple(
    step * 10.0**power
    for power in range(-3, 4)
    for step in (1.0, 1.5, 2.0, 2.5, 3.0, 4.0, 5.0, 7.0)
)
_BLOCK = 16_384
"""Stands that are worked on at once, at most."""
_TESTS = 2_000_000
"""Stands times wall segments that are worked on at once, roughly: bounds the memory."""
_CACHE_BYTES = 64_000_000
_SLIVER = 1e-6
"""Cells with less floor than this share are left out."""
_CERTAIN = 1e-9
"""A determinant below this share of the diagonal's product is that of a singular matrix."""


class PrecisionField:
    """The spots of one site at one resolution. It remembers what each landmark tells at them, so
    that moving one landmark costs no more than that landmark."""

    def __init__(self, site: Site, sweep: Sweep | None = None, resolution: float | None = None):
        """``resolution`` None: as coarse as for a map that is redrawn all the time.

        Raises:
            InputError: ``resolution`` is not positive, makes too many spots, or the robot has
                room at none.
        """
        self.sweep = sweep or Sweep()
        self.resolution = coarse_resolution(site) if resolution is None else resolution
        if not (math.isfinite(self.resolution) and self.resolution > 0):
            raise InputError(f"resolution is {resolution} m: expected more than 0.")
        floor = site.floor()
        x0, y0, x1, y1 = floor.bounds
        across, along = ((x1 - x0) / self.resolution, (y1 - y0) / self.resolution)
        if not (max(across, 1.0) * max(along, 1.0) <= MOST_SPOTS):
            raise InputError(
                f"resolution is {self.resolution:g} m: this site would have more than {MOST_SPOTS}"
                " spots; expected a coarser one."
            )
        columns, rows = max(1, math.ceil(across)), max(1, math.ceil(along))
        # The grid's middle is the floor's middle: what is symmetric stays so.
        self.x = 0.5 * (x0 + x1 - (columns - 1) * self.resolution)
        self.y = 0.5 * (y0 + y1 - (rows - 1) * self.resolution)
        self._weight, self.spots = self._cells(floor, columns, rows)
        self._inside: Bools = self._weight > 0
        walls = Walls(site.segments())
        directions = np.tile(self.sweep.directions, len(self.spots))
        places = np.repeat(self.spots, self.sweep.headings, axis=0)
        poses = np.concatenate([places, directions[:, None]], axis=1)
        block = min(_BLOCK, _TESTS // len(site.segments()))
        step = max(1, block // self.sweep.headings) * self.sweep.headings
        self._blocks = [
            Stands(poses[i : i + step], self.sweep, walls) for i in range(0, len(poses), step)
        ]
        self._memory: OrderedDict[Landmark, list[Sight]] = OrderedDict()
        stands = sum(map(len, self._blocks))
        if not any(block.possible.any() for block in self._blocks):
            raise InputError(
                f"resolution is {self.resolution:g} m: at no spot of that grid the robot has room;"
                " expected a finer one."
            )
        self._room = _CACHE_BYTES // (stands * (6 * 8 + 1))

    def _cells(self, floor: shapely.Geometry, columns: int, rows: int) -> tuple[Floats, Floats]:
        """Which share of each cell is floor, and the spots of those cells that have some.

        A spot is the cell's middle, or where that is no floor, some place of the cell that is.
        """
        xs = self.x + self.resolution * np.arange(columns)
        ys = self.y + self.resolution * np.arange(rows)
        half = 0.5 * self.resolution
        grid = np.stack(np.meshgrid(xs, ys), axis=-1)
        x, y = grid[..., 0], grid[..., 1]
        boxes = shapely.box(x - half, y - half, x + half, y + half)
        shapely.prepare(floor)
        weight = shapely.covers(floor, boxes).astype(float)
        edge = shapely.intersects(floor, boxes) & (weight == 0)
        cut = shapely.intersection(floor, boxes[edge])
        share = shapely.area(cut) / self.resolution**2
        weight[edge] = np.where(share > _SLIVER, share, 0.0)
        elsewhere = ~shapely.contains_xy(floor, x[edge], y[edge]) & (share > _SLIVER)
        points = shapely.point_on_surface(cut[elsewhere])
        places = grid[edge]
        places[elsewhere] = np.stack([shapely.get_x(points), shapely.get_y(points)], axis=-1)
        grid[edge] = places
        return weight, grid[weight > 0]

    @property
    def weights(self) -> Floats:
        """Of each spot, which share of its cell is floor."""
        return self._weight[self._inside]

    @property
    def possible(self) -> Bools:
        """Whether the robot can stand there: spots x headings."""
        return np.concatenate([block.possible for block in self._blocks]).reshape(
            -1, self.sweep.headings
        )

    def precision(self, landmarks: Sequence[Landmark]) -> PrecisionMap:
        """The map for these landmarks."""
        parts = [
            _judge(*self._told(index, landmarks), block.possible, self.sweep)
            for index, block in enumerate(self._blocks)
        ]
        figures = [np.concatenate(column) for column in zip(*parts, strict=True)]
        position, heading, share, seen = (self._laid(values, np.nan) for values in figures[:4])
        return PrecisionMap(
            x=float(self.x),
            y=float(self.y),
            resolution=float(self.resolution),
            position=position,
            heading=heading,
            share=np.nan_to_num(share),
            seen=np.nan_to_num(seen),
            reason=self._laid(figures[4], Reason.OUTSIDE).astype(np.uint8),
            weight=self._weight,
            limit=self.sweep.fix.max_position_sigma,
        )

    def information(self, landmarks: Sequence[Landmark]) -> Floats:
        """Of one sweep, 6 (xx, xy, yy, xh, yh, hh) x spots x headings."""
        told = [self._told(index, landmarks)[0] for index in range(len(self._blocks))]
        return np.concatenate(told, axis=1).reshape(6, -1, self.sweep.headings)

    def alone(self, mark: Landmark) -> Floats:
        """`information` of one landmark that no other one hides, remembered no longer."""
        told = [block.sight(mark).information for block in self._blocks]
        return np.concatenate(told, axis=1).reshape(6, -1, self.sweep.headings)

    def _told(self, index: int, landmarks: Sequence[Landmark]) -> tuple[Floats, Floats]:
        """Information and number of landmarks at the stands of one block."""
        return _sum(self._blocks[index], landmarks, [self._sight(index, m) for m in landmarks])

    def _sight(self, index: int, mark: Landmark) -> Sight:
        known = self._memory.get(mark)
        if known is not None:
            self._memory.move_to_end(mark)
            return known[index]
        if self._room < 2:
            return self._blocks[index].sight(mark)
        known = self._memory[mark] = [block.sight(mark) for block in self._blocks]
        while len(self._memory) > self._room:
            self._memory.popitem(last=False)
        return known[index]

    def _laid(self, values: NDArray[Any], outside: float) -> NDArray[Any]:
        laid = np.full(self._inside.shape, outside)
        laid[self._inside] = values
        return laid


def precision_map(
    site: Site, sweep: Sweep | None = None, resolution: float | None = None
) -> PrecisionMap:
    """Expected error at every spot of a site, with the landmarks that it has.

    Args:
        resolution: metres from spot to spot; None is `coarse_resolution`.

    Raises:
        InputError: ``resolution`` cannot be used for this site.
    """
    return PrecisionField(site, sweep, resolution).precision(site.landmarks)


def precision_at(
    site: Site, poses: Floats, sweep: Sweep | None = None
) -> tuple[Floats, NDArray[np.uint8]]:
    """What `fix` will say of its own error at given poses of `base_link`.

    Args:
        poses: M x 3: x, y, heading; metres and radians.

    Returns:
        covariances, M x 3 x 3 (m, rad), nan where there would be no fix; and the `Reason` of each.
    """
    sweep = sweep or Sweep()
    stands = Stands(np.asarray(poses, float).reshape(-1, 3), sweep, Walls(site.segments()))
    sights = [stands.sight(mark) for mark in site.landmarks]
    information, count = _sum(stands, site.landmarks, sights)
    verdict = _verdict(information, count, stands.possible, sweep)
    covariances = np.full((len(stands), 3, 3), np.nan)
    matrices = information[np.array([[0, 1, 3], [1, 2, 4], [3, 4, 5]])]
    fixed = verdict.reason == Reason.FIX
    covariances[fixed] = np.linalg.inv(matrices.transpose(2, 0, 1)[fixed])
    return covariances, verdict.reason


def coarse_resolution(site: Site) -> float:
    """A round number of metres that makes about `COARSE_SPOTS` spots."""
    return round_resolution(site, COARSE_SPOTS)


def fine_resolution(site: Site) -> float:
    """A round number of metres that makes about `FINE_SPOTS` spots."""
    return round_resolution(site, FINE_SPOTS)


def round_resolution(site: Site, spots: int) -> float:
    """The finest round step that makes no more than about ``spots`` spots on the floor, metres.

    Where the floor is a small part of its bounding box, that counts: a tenth of it at least.
    """
    floor = site.floor()
    x0, y0, x1, y1 = floor.bounds
    area = max(floor.area, 0.1 * (x1 - x0) * (y1 - y0))
    wanted = math.sqrt(area / spots)
    return next((step for step in _STEPS if step >= 0.999 * wanted), _STEPS[-1])


def _sum(
    stands: Stands, landmarks: Sequence[Landmark], sights: Sequence[Sight]
) -> tuple[Floats, Floats]:
    """Information of all landmarks together, and how many of them are read, at each stand."""
    total, count = np.zeros((6, len(stands))), np.zeros(len(stands))
    for sight, free in zip(sights, stands.uncovered(landmarks), strict=True):
        read = sight.seen & free
        total += sight.information * read
        count += read
    return total, count


class _Verdict(NamedTuple):
    """What `fix` would say at each stand."""

    position: Floats
    """Variance along the worst direction; meaningless where ``reason`` is not FIX."""
    heading: Floats
    reason: NDArray[np.uint8]


def _verdict(information: Floats, count: Floats, possible: Bools, sweep: Sweep) -> _Verdict:
    xx, xy, yy, xh, yh, hh = information
    # The inverse of a symmetric 3 x 3 matrix, by its cofactors.
    a, b, d = yy * hh - yh * yh, xh * yh - xy * hh, xx * hh - xh * xh
    c, e = xy * yh - xh * yy, xx * yy - xy * xy
    determinant = xx * a + xy * b + xh * c
    regular = (count >= 2) & (determinant > _CERTAIN * xx * yy * hh)
    scale = np.where(regular, determinant, np.inf)
    half, apart = 0.5 * (a + d), np.hypot(0.5 * (a - d), b)
    position, heading = (half + apart) / scale, e / scale
    settings = sweep.fix
    sharp = (position <= settings.max_position_sigma**2) & (
        heading <= settings.max_heading_sigma**2
    )
    reason = np.select(
        [~possible, count == 0, count == 1, regular & sharp],
        [Reason.OUTSIDE, Reason.NONE, Reason.ONE_LANDMARK, Reason.FIX],
        Reason.ONE_DIRECTION,
    )
    return _Verdict(position, heading, reason.astype(np.uint8))


def _judge(
    information: Floats, count: Floats, possible: Bools, sweep: Sweep
) -> tuple[Floats, Floats, Floats, Floats, NDArray[Any]]:
    """Figures per spot: what `fix` would say at each stand, averaged over the headings."""
    verdict = _verdict(information, count, possible, sweep)
    good = verdict.reason == Reason.FIX

    def mean(values: Floats, where: Bools) -> Floats:
        chosen = where.reshape(-1, sweep.headings)
        number = chosen.sum(axis=1)
        total = np.where(chosen, values.reshape(-1, sweep.headings), 0.0).sum(axis=1)
        result: Floats = np.where(number > 0, total / np.maximum(number, 1), np.nan)
        return result

    share = mean(good.astype(float), possible)
    # The nearest that it comes to a fix at any heading.
    code = np.where(possible, verdict.reason, 0).reshape(-1, sweep.headings).max(axis=1)
    reason = np.where(share > 0, Reason.FIX, np.where(np.isnan(share), Reason.OUTSIDE, code))
    return (
        np.sqrt(mean(verdict.position, good)),
        np.sqrt(mean(verdict.heading, good)),
        share,
        mean(count, possible),
        reason,
    )
