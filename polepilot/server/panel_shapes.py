"""Shapes of the 3D panel: plain arrays in `map`, metres, z up. Knows nothing of viser."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from itertools import pairwise
from typing import NamedTuple

import cv2
import numpy as np
import shapely
from numpy.typing import NDArray
from shapely import Polygon

from polepilot.core.geometry import Point, Pose2D
from polepilot.core.landmark import Landmark
from polepilot.core.observation import PoseEstimate
from polepilot.core.site import Site

Array = NDArray[np.float64]
WALL_HEIGHT = 0.30
_CHI2_95 = 5.991
"""Squared radius that holds 95 % of a plane's normal distribution."""


class Mesh(NamedTuple):
    """V x 3 vertices and F x 3 indices into them."""

    vertices: Array
    faces: NDArray[np.int64]


class Poles(NamedTuple):
    """One striped pole segment per row: centre (N x 3), size (N x 3), bright or dark (N)."""

    positions: Array
    scales: Array
    bright: NDArray[np.bool_]


def walls(site: Site, height: float = WALL_HEIGHT) -> Mesh:
    """All lines of the site raised to ``height``."""
    segments = np.asarray(site.segments(), dtype=float)
    corners = np.concatenate([segments, segments[:, ::-1]], axis=1)
    levels = np.broadcast_to(np.array([0.0, 0.0, height, height])[:, None], (len(corners), 4, 1))
    vertices = np.concatenate([corners, levels], axis=2).reshape(-1, 3)
    first = 4 * np.arange(len(corners))[:, None]
    faces = np.concatenate([first + np.array(corner) for corner in ([0, 1, 2], [0, 2, 3])])
    return Mesh(vertices, faces)


def flat(shape: shapely.Geometry, level: float) -> Mesh:
    """A polygon (holes are kept) as triangles that face up at ``level``."""
    triangles = shapely.constrained_delaunay_triangles(shape).geoms
    corners = np.array(
        [shapely.get_coordinates(shapely.orient_polygons(t))[:3] for t in triangles]
    ).reshape(-1, 2)
    vertices = np.column_stack([corners, np.full(len(corners), level)])
    return Mesh(vertices, np.arange(len(corners)).reshape(-1, 3))


def island_tops(site: Site, level: float = WALL_HEIGHT) -> Mesh | None:
    """The lids of the islands, so that they look solid; None where there are no islands."""
    if not site.islands:
        return None
    return flat(shapely.union_all([Polygon(ring) for ring in site.islands]), level)


def poles(landmarks: Iterable[Landmark]) -> Poles:
    """Every segment of every pole at its true size; scales are for a unit cylinder."""
    positions: list[tuple[float, float, float]] = []
    scales: list[tuple[float, float, float]] = []
    bright: list[bool] = []
    for mark in landmarks:
        kind = mark.kind
        # The code is read from the top, poles stand on the floor.
        for number, segment in enumerate(reversed(mark.code)):
            positions.append((mark.x, mark.y, (number + 0.5) * kind.segment))
            scales.append((kind.diameter, kind.diameter, kind.segment))
            bright.append(segment == "1")
    return Poles(
        np.array(positions, dtype=float).reshape(-1, 3),
        np.array(scales, dtype=float).reshape(-1, 3),
        np.array(bright, dtype=bool),
    )


def cylinder(sides: int = 20) -> Mesh:
    """Diameter 1, height 1, centred on the origin, axis up."""
    angles = np.linspace(0, math.tau, sides, endpoint=False)
    ring = np.column_stack([np.cos(angles) / 2, np.sin(angles) / 2])
    vertices = np.concatenate(
        [
            np.column_stack([ring, np.full(sides, -0.5)]),
            np.column_stack([ring, np.full(sides, 0.5)]),
            [[0, 0, -0.5], [0, 0, 0.5]],
        ]
    )
    here = np.arange(sides)
    there = (here + 1) % sides
    low, high = np.full(sides, 2 * sides), np.full(sides, 2 * sides + 1)
    faces = np.concatenate(
        [
            np.column_stack([here, there, there + sides]),
            np.column_stack([here, there + sides, here + sides]),
            np.column_stack([low, there, here]),
            np.column_stack([high, here + sides, there + sides]),
        ]
    )
    return Mesh(vertices, faces)


def nose(radius: float, level: float) -> Mesh:
    """A flat arrow head from the middle of the body ahead: which way the robot looks."""
    vertices = np.array(
        [
            [radius * 1.25, 0, level],
            [-radius * 0.55, radius * 0.6, level],
            [-radius * 0.2, 0, level],
            [-radius * 0.55, -radius * 0.6, level],
        ]
    )
    return Mesh(vertices, np.array([[0, 1, 2], [0, 2, 3]]))


def circle(radius: float, level: float, sides: int = 36) -> Array:
    """N x 2 x 3 line segments around the origin."""
    angles = np.linspace(0, math.tau, sides + 1)
    points = np.column_stack(
        [radius * np.cos(angles), radius * np.sin(angles), np.full(sides + 1, level)]
    )
    return chain(points)


def cross(size: float, level: float) -> Array:
    """2 x 2 x 3 line segments: a cross around the origin."""
    half = size / 2
    return np.array(
        [
            [[-half, -half, level], [half, half, level]],
            [[-half, half, level], [half, -half, level]],
        ]
    )


def ellipse(estimate: PoseEstimate, level: float, sides: int = 36) -> Array:
    """N x 2 x 3 line segments around the place that holds the robot with 95 % probability."""
    values, axes = np.linalg.eigh(estimate.covariance[:2, :2])
    radii = np.sqrt(np.maximum(values, 0) * _CHI2_95)
    angles = np.linspace(0, math.tau, sides + 1)
    plane = (axes * radii) @ np.stack([np.cos(angles), np.sin(angles)])
    points = np.column_stack([plane.T + estimate.pose.position, np.full(sides + 1, level)])
    return chain(points)


def chain(points: Array) -> Array:
    """N-1 x 2 x 3 line segments through N x 3 points."""
    return np.stack([points[:-1], points[1:]], axis=1)


def rays(eye: tuple[float, float, float], ends: Sequence[tuple[float, float, float]]) -> Array:
    """N x 2 x 3 line segments from the camera to what it sees."""
    return np.array([[eye, end] for end in ends], dtype=float).reshape(-1, 2, 3)


def yaw(angle: float) -> tuple[float, float, float, float]:
    """Quaternion (w, x, y, z) of a turn to the left about the vertical axis."""
    return (math.cos(angle / 2), 0.0, 0.0, math.sin(angle / 2))


LOOK_AHEAD = (0.5, -0.5, 0.5, -0.5)
"""Quaternion that turns a computer vision camera (z ahead, y down) to look along x, z up."""


class Covered:
    """The floor that the tool has passed over, as a picture of the site seen from above.

    A raster costs the same after an hour as after a minute, unlike a growing outline.

    Args:
        low, high: corners of the site, metres.
        color: red, green, blue, alpha of covered floor, 0 to 255.
    """

    CELL = 0.02
    LARGEST = 1024

    def __init__(self, low: Point, high: Point, color: tuple[int, int, int, int]) -> None:
        width, height = high[0] - low[0], high[1] - low[1]
        self.cell = max(self.CELL, width / self.LARGEST, height / self.LARGEST)
        columns = max(1, math.ceil(width / self.cell))
        rows = max(1, math.ceil(height / self.cell))
        self.size = (columns * self.cell, rows * self.cell)
        self.center = (low[0] + self.size[0] / 2, low[1] + self.size[1] / 2)
        self._low = low
        self._mask = np.zeros((rows, columns), np.uint8)
        self._color = color
        self._last: Point | None = None
        self.changed = True

    def clear(self) -> None:
        self._mask[:] = 0
        self._last = None
        self.changed = True

    def lift(self) -> None:
        """The next ``sweep`` begins a new stroke."""
        self._last = None

    def sweep(self, point: Point, tool_width: float) -> None:
        """Cover the way from the last point to this one."""
        start = self._last or point
        self._last = point
        # Eight binary places of a cell, so that slow movement does not snap to cells.
        a, b = self._to_cell(start), self._to_cell(point)
        thickness = max(1, round(tool_width / self.cell))
        cv2.line(self._mask, a, b, 255, thickness, cv2.LINE_8, 8)
        self.changed = True

    @property
    def share(self) -> float:
        """Share of the picture that is covered."""
        return float(np.count_nonzero(self._mask)) / self._mask.size

    def picture(self) -> NDArray[np.uint8]:
        """Rows x columns x 4 (RGBA), south in the first row; clears ``changed``."""
        self.changed = False
        image = np.zeros((*self._mask.shape, 4), np.uint8)
        image[self._mask > 0] = self._color
        return image

    def _to_cell(self, point: Point) -> tuple[int, int]:
        return (
            round(((point[0] - self._low[0]) / self.cell - 0.5) * 256),
            round(((point[1] - self._low[1]) / self.cell - 0.5) * 256),
        )


class Trail:
    """The way that was driven, thinned: a point every ``step`` metres, the newest ``most``."""

    def __init__(self, step: float = 0.03, most: int = 3000) -> None:
        self._step = step
        self._most = most
        self._points: list[tuple[float, float]] = []
        self.changed = True

    def clear(self) -> None:
        self._points.clear()
        self.changed = True

    def add(self, pose: Pose2D) -> None:
        if self._points and pose.distance_to(self._points[-1]) < self._step:
            return
        self._points.append(pose.position)
        if len(self._points) > self._most:
            # In steps, so that not every point pays for moving all others.
            del self._points[: self._most // 4]
        self.changed = True

    def segments(self, level: float, longest: float = 1.0) -> Array:
        """N x 2 x 3 line segments; jumps (the pose was fixed anew) are not drawn."""
        self.changed = False
        pairs = [
            ((*a, level), (*b, level))
            for a, b in pairwise(self._points)
            if math.dist(a, b) <= longest
        ]
        return np.array(pairs, dtype=float).reshape(-1, 2, 3)
