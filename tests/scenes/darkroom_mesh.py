"""The darkroom's geometry: a camera, a pole as a mesh, and the exact area of what is drawn.

Nothing is sampled here. Every polygon edge is cut at the borders of the pixels that it crosses,
and each piece adds the area that it bounds to its pixel, so that a pixel's value is the true mean
over its square (the way good font rasterizers draw).

World: x along the optical axis at mid exposure of the middle row (levelled), y left, z up, the
origin on the floor below the camera. Pixels: centres are integers, columns to the right.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import acos, atan2, cos, hypot, sin

import numpy as np
from numpy.typing import NDArray

from polepilot.core.landmark import encode

Array = NDArray[np.float64]

CONSTANT = 600.0
WIDTH, HEIGHT = 400, 300
CENTER = ((WIDTH - 1) / 2, (HEIGHT - 1) / 2)
CAMERA_HEIGHT = 0.40
VALUES = 4
"""What a canvas sums: blue, green, red and cover."""
RADIUS = 0.035
SEGMENT = 0.05
POLE_HEIGHT = 13 * SEGMENT


@dataclass(frozen=True, slots=True)
class View:
    """How the camera looks while one picture is taken. Radians, seconds."""

    pitch: float = 0.0
    """Nose down positive."""
    roll: float = 0.0
    """Right side down positive."""
    pan_rate: float = 0.0
    """To the left positive."""
    readout: float = 0.0
    """From the mid exposure of the first row to that of the row after the last."""
    exposure: float = 0.0

    def yaw(self, row: Array | float) -> Array:
        """Where the camera points, left positive, at the mid exposure of ``row``."""
        return np.asarray(self.pan_rate * self.readout * (np.asarray(row) - CENTER[1]) / HEIGHT)

    def rotation(self, yaw: float = 0.0) -> Array:
        """Columns: the camera's forward, left and up axes in the world."""
        cy, sy = cos(yaw), sin(yaw)
        cp, sp = cos(self.pitch), sin(self.pitch)
        cr, sr = cos(self.roll), sin(self.roll)
        turn = np.array([[cy, -sy, 0], [sy, cy, 0], [0, 0, 1]])
        nod = np.array([[cp, 0, sp], [0, 1, 0], [-sp, 0, cp]])
        tilt = np.array([[1, 0, 0], [0, cr, -sr], [0, sr, cr]])
        return np.asarray(turn @ nod @ tilt)

    def project(self, points: Array) -> Array:
        """World points (..., 3) to pixels (..., 2), each at the instant when its row is taken."""
        base = self.rotation()
        local = rays = points - np.array([0.0, 0.0, CAMERA_HEIGHT])
        row: Array = np.full(points.shape[:-1], CENTER[1])
        moving = self.pan_rate * self.readout != 0
        for _ in range(4 if moving else 1):
            yaw = self.yaw(row)
            c, s = np.cos(yaw), np.sin(yaw)
            x = c * rays[..., 0] + s * rays[..., 1]
            y = -s * rays[..., 0] + c * rays[..., 1]
            local = np.stack([x, y, rays[..., 2]], axis=-1) @ base
            row = CENTER[1] - CONSTANT * local[..., 2] / local[..., 0]
        column = CENTER[0] - CONSTANT * local[..., 1] / local[..., 0]
        return np.stack([column, row], axis=-1)


@dataclass(frozen=True, slots=True)
class Stand:
    """Where a pole stands, and its number."""

    id: int
    range: float
    bearing: float

    @property
    def foot(self) -> tuple[float, float]:
        """Its axis on the floor."""
        return self.range * cos(self.bearing), self.range * sin(self.bearing)

    def outline(self, view: View, count: int = 12) -> Array:
        """The silhouette of the whole pole as a closed polygon of pixels, clockwise."""
        arc = _arc(self, count)
        top = view.project(_ring(self, arc, POLE_HEIGHT))
        bottom = view.project(_ring(self, arc, 0.0))
        left = view.project(_side(self, arc[0], 12))
        right = view.project(_side(self, arc[-1], 12))
        return np.concatenate([top, right[1:-1], bottom[::-1], left[1:-1][::-1]])


@dataclass(frozen=True, slots=True)
class Mesh:
    """Quads between ``corners[i, j]`` and ``corners[i + 1, j + 1]``, in pixels."""

    corners: Array
    """(rows + 1, facets + 1, 2)."""
    bright: NDArray[np.bool_]
    """(rows,): which runs of segments are orange, top first."""
    facing: Array
    """(facets,): direction of each facet's normal from the line to the camera, right positive."""


def code_bands(landmark_id: int) -> tuple[list[float], list[bool]]:
    """Heights of the borders of a landmark's bands, top first, and which bands are orange."""
    code = encode(landmark_id)
    cuts = [0] + [i for i in range(1, 13) if code[i] != code[i - 1]] + [13]
    return [POLE_HEIGHT - SEGMENT * cut for cut in cuts], [code[cut] == "1" for cut in cuts[:-1]]


def post_mesh(stand: Stand, view: View, heights: list[float], bright: list[bool]) -> Mesh:
    """The visible half of a banded post; negative heights give its mirror image in the floor."""
    width = CONSTANT * 2 * RADIUS / stand.range
    arc = _arc(stand, int(np.clip(1.5 * width, 10, 36)))
    rings = np.stack([_ring(stand, arc, height) for height in heights])
    to_camera = atan2(-stand.foot[1], -stand.foot[0])
    middle = (arc[1:] + arc[:-1]) / 2
    return Mesh(view.project(rings), np.array(bright), middle - to_camera)


def pole_mesh(stand: Stand, view: View) -> Mesh:
    """The visible half of a landmark, cut at the borders between orange and black."""
    return post_mesh(stand, view, *code_bands(stand.id))


def _arc(stand: Stand, count: int) -> Array:
    """Azimuths from the left to the right tangent, evenly wide as seen from the camera."""
    half = acos(RADIUS / hypot(*stand.foot))
    to_camera = atan2(-stand.foot[1], -stand.foot[0])
    steps = np.linspace(-1, 1, count + 1)
    # Seen from the camera its right is at growing azimuth: the normals turn counter-clockwise.
    return to_camera + np.arcsin(np.clip(steps * sin(half), -1, 1))


def _ring(stand: Stand, arc: Array, height: float) -> Array:
    x, y = stand.foot
    return np.stack(
        [x + RADIUS * np.cos(arc), y + RADIUS * np.sin(arc), np.full(arc.shape, height)], axis=-1
    )


def _side(stand: Stand, azimuth: float, count: int) -> Array:
    x, y = stand.foot
    heights = np.linspace(POLE_HEIGHT, 0, count)
    return np.stack(
        [
            np.full(count, x + RADIUS * cos(azimuth)),
            np.full(count, y + RADIUS * sin(azimuth)),
            heights,
        ],
        axis=-1,
    )


class Canvas:
    """A window of the picture, ``scale`` times finer, that sums value times covered area."""

    def __init__(self, column: int, row: int, width: int, height: int, scale: int):
        """``column, row``: the window's first pixel; sizes in whole pixels of the picture."""
        self.column, self.row, self.scale = column, row, scale
        self.shape = (height * scale, width * scale)
        self._sum = np.zeros((VALUES, self.shape[0] * (self.shape[1] + 1)))

    def to_canvas(self, pixels: Array) -> Array:
        """Positions in the picture to positions whose whole numbers are the fine borders."""
        return np.asarray((pixels + 0.5 - np.array([self.column, self.row])) * self.scale)

    def add_mesh(self, corners: Array, values: Array) -> None:
        """Fill quad (i, j) of a grid of pixel positions with ``values[i, j]``."""
        grid = self.to_canvas(corners)
        rows, facets, count = values.shape
        across = np.zeros((rows + 1, facets, count))
        across[:-1] -= values
        across[1:] += values
        down = np.zeros((rows, facets + 1, count))
        down[:, :-1] += values
        down[:, 1:] -= values
        self._add_edges(
            np.concatenate([grid[:, :-1].reshape(-1, 2), grid[:-1].reshape(-1, 2)]),
            np.concatenate([grid[:, 1:].reshape(-1, 2), grid[1:].reshape(-1, 2)]),
            np.concatenate([across.reshape(-1, count), down.reshape(-1, count)]),
        )

    def add_polygon(self, corners: Array, value: Array) -> None:
        """Fill a simple polygon of pixel positions, in either sense of rotation."""
        points = self.to_canvas(corners)
        following = np.roll(points, -1, axis=0)
        turn = np.sum(points[:, 0] * following[:, 1] - following[:, 0] * points[:, 1])
        weight = -np.sign(turn) * np.broadcast_to(value, (len(points), len(value)))
        self._add_edges(points, following, weight)

    def _add_edges(self, start: Array, end: Array, weight: Array) -> None:
        """Add to each pixel the area right of every edge times its weight, down positive."""
        used = np.any(weight != 0, axis=1) & (start[:, 1] != end[:, 1])
        start, end, weight = start[used], end[used], weight[used]
        high, wide = self.shape
        if not len(start):
            return
        cuts = [np.zeros(len(start)), np.ones(len(start))]
        owners = [np.arange(len(start))] * 2
        for axis in (0, 1):
            a, b = start[:, axis], end[:, axis]
            first = np.floor(np.minimum(a, b)).astype(int) + 1
            number = np.maximum(np.ceil(np.maximum(a, b)).astype(int) - first, 0)
            owner = np.repeat(np.arange(len(a)), number)
            line = (
                first[owner] + np.arange(len(owner)) - np.repeat(np.cumsum(number) - number, number)
            )
            cuts.append((line - a[owner]) / (b[owner] - a[owner]))
            owners.append(owner)
        cut, owner = np.concatenate(cuts), np.concatenate(owners)
        order = np.argsort(owner + 0.999999 * np.clip(cut, 0, 1), kind="stable")
        cut, owner = cut[order], owner[order]
        same = owner[1:] == owner[:-1]
        owner, t0, t1 = owner[:-1][same], cut[:-1][same], cut[1:][same]
        step = end - start
        x0, y0 = (start[owner] + t0[:, None] * step[owner]).T
        x1, y1 = (start[owner] + t1[:, None] * step[owner]).T
        row = np.floor((y0 + y1) / 2).astype(int)
        middle = np.clip((x0 + x1) / 2, 0, wide)
        column = np.minimum(np.floor(middle).astype(int), wide - 1)
        inside = (row >= 0) & (row < high) & (y0 != y1)
        row, column, middle = row[inside], column[inside], middle[inside]
        area = (y1 - y0)[inside]
        place = row * (wide + 1) + column
        size = self._sum.shape[1]
        here = area * (column + 1 - middle)
        right = area * (middle - column)
        owner = owner[inside]
        for k in range(len(self._sum)):
            w = weight[owner, k]
            self._sum[k] += np.bincount(place, here * w, size)
            self._sum[k] += np.bincount(place + 1, right * w, size)

    def image(self) -> NDArray[np.float32]:
        """(rows, columns, values) of the fine window: the mean over each fine pixel."""
        high, wide = self.shape
        total = np.cumsum(self._sum.reshape(-1, high, wide + 1), axis=2)[:, :, :wide]
        return np.ascontiguousarray(total.transpose(1, 2, 0).astype(np.float32))
