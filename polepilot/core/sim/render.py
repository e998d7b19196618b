"""Pictures of the simulated camera: a 2.5-D room with striped poles.

The room comes from one ray per column against the wall segments; poles are ray-cast as true
cylinders on a finer raster (4 to 8 samples per pixel each way) in linear light and averaged down
by area, as a sensor does. Rolling shutter, motion blur, vignetting, noise and gamma follow.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from polepilot.core.geometry import Point, Pose2D
from polepilot.core.landmark import Landmark
from polepilot.core.observation import Image
from polepilot.core.vehicle import Camera
from polepilot.core.vision.paint import ORANGE, Paint

Colour = tuple[float, float, float]
"""Linear reflectance, blue-green-red."""
Floats = NDArray[Any]
"""float32 throughout; the stubs of OpenCV do not say so."""

SIGHT_MARGIN = 0.10
"""The line of sight ends this far short of a pole's axis: poles standing at a wall are seen."""
_OPEN_SPACE = 80.0
_NEAREST = 0.05
_CODES = 4096


@dataclass(frozen=True, slots=True)
class Look:
    """Light, camera and paint of the simulated world; reflectances and light are linear."""

    light: Colour = (0.92, 1.0, 1.06)
    """Colour of the light, blue-green-red."""
    exposure: float = 1.0
    """Brightness of the picture; above about 1.6 orange begins to clip."""
    ambient: float = 0.55
    """Share of the light that comes from everywhere."""
    light_heading: float = 2.1
    """Where the rest comes from, radians in `map`."""
    bright: Colour = (0.02, 0.20, 0.72)
    dark: Colour = (0.030, 0.030, 0.033)
    vignetting: float = 0.25
    """Loss of light in the corners."""
    noise: float = 2.0
    """Standard deviation in grey levels after gamma (photon noise is about even there)."""
    blur: float = 0.35
    """Of the lens, standard deviation in pixels."""
    wall_height: float = 2.6
    obstacle_height: float = 1.7
    readout: float = 0.025
    """From the first to the last row of the rolling shutter, seconds."""
    exposure_time: float = 0.003
    """How long a row gathers light, seconds."""

    @classmethod
    def painted(cls, paint: Paint) -> Look:
        """The usual light on poles of this paint; no paint gives all light back, or none."""
        if paint == ORANGE:
            return cls()
        blue, green, red = (0.02 + 0.73 * share for share in paint.reflectance)
        return cls(bright=(blue, green, red))


class Renderer:
    """Draws what the camera sees; deterministic for a given generator and order of calls.

    Args:
        camera: pinhole; poles stand on the floor, ``camera.mount_height`` below the lens.
        landmarks: poles; flat stickers turn towards the camera (the site knows no direction).
        segments: walls in `map`, metres; they reach from floor to ceiling.
        rng: source of the sensor noise.
    """

    def __init__(
        self,
        camera: Camera,
        landmarks: Sequence[Landmark],
        segments: Sequence[tuple[Point, Point]],
        rng: np.random.Generator,
        look: Look | None = None,
    ) -> None:
        self._camera = camera
        self._landmarks = tuple(landmarks)
        self._look = look = look or Look()
        self._rng = rng
        self._walls = np.asarray(segments, dtype=np.float64).reshape(-1, 2, 2)
        width, height = camera.width, camera.height
        self._columns = np.arange(width, dtype=np.float64)
        self._tangent = (camera.center_x - self._columns) / camera.constant
        self._rows = np.arange(height, dtype=np.float32)[:, None] - np.float32(camera.center_y)
        x = (np.arange(width) - (width - 1) / 2) / (width / 2)
        y = (np.arange(height) - (height - 1) / 2) / (height / 2)
        fall = 1 - look.vignetting * (x[None, :] ** 2 + y[:, None] ** 2) / 2
        gain = look.exposure * np.asarray(look.light) * (_CODES - 1)
        self._gain = (fall[:, :, None] * gain).astype(np.float32)
        self._gamma = _gamma_table()
        # Fresh normal noise for every frame would cost more than all the rest: a bank of it,
        # entered at a random place, repeats only after many frames.
        bank = 4 * width * height * 3 + 8191
        self._noise = np.rint(rng.normal(0.0, 1.0, bank) * look.noise).astype(np.int16)

    def render(
        self,
        camera_pose: Pose2D,
        pan_rate: float = 0.0,
        obstacles: Sequence[tuple[Point, float]] = (),
    ) -> Image:
        """One picture, rows x columns x 3, blue-green-red.

        Args:
            camera_pose: pan axis and looking direction in `map`, at mid exposure of the middle
                row.
            pan_rate: turning rate of the looking direction, rad/s, left positive.
            obstacles: discs (centre, radius) in `map` that stand on the floor like people.
        """
        distance, wall = self._cast(camera_pose)
        picture = self._room(camera_pose, distance, wall)
        slope = self._camera.constant * pan_rate * self._look.readout / self._camera.height
        blur = abs(self._camera.constant * pan_rate * self._look.exposure_time)
        if slope:
            picture = _shear(picture, slope, self._camera.center_y)
        # Painter's algorithm: the far things first.
        things: list[tuple[float, Landmark | tuple[Point, float]]] = [
            (camera_pose.distance_to(mark.position), mark) for mark in self._landmarks
        ]
        things += [(camera_pose.distance_to(disc[0]), disc) for disc in obstacles]
        for away, thing in sorted(things, key=lambda pair: -pair[0]):
            if isinstance(thing, Landmark):
                self._paint_landmark(picture, camera_pose, thing, away, distance, slope)
            else:
                self._paint_obstacle(picture, camera_pose, thing, away, distance, slope)
        if blur > 0.05:
            picture = cv2.filter2D(picture, -1, _box(blur), borderType=cv2.BORDER_REPLICATE)
        if self._look.blur > 0:
            picture = cv2.GaussianBlur(picture, (3, 3), self._look.blur)
        return self._expose(picture)

    def _cast(self, pose: Pose2D) -> tuple[NDArray[np.float64], NDArray[np.intp]]:
        """Horizontal distance to the nearest wall and which wall it is, for every column."""
        distance = np.full(len(self._columns), _OPEN_SPACE)
        if not len(self._walls):
            return distance, np.full(len(self._columns), -1)
        heading = pose.heading + np.arctan(self._tangent)
        cos, sin = np.cos(heading)[:, None], np.sin(heading)[:, None]
        start = self._walls[:, 0] - np.array(pose.position)
        along = self._walls[:, 1] - self._walls[:, 0]
        cross = cos * along[:, 1] - sin * along[:, 0]
        with np.errstate(divide="ignore", invalid="ignore"):
            ray = (start[:, 0] * along[:, 1] - start[:, 1] * along[:, 0]) / cross
            share = (start[:, 0] * sin - start[:, 1] * cos) / cross
        hit = (share >= 0) & (share <= 1) & (ray > 1e-6)
        ray = np.where(hit, ray, _OPEN_SPACE)
        wall = np.argmin(ray, axis=1)
        nearest = ray[np.arange(len(wall)), wall]
        return np.maximum(nearest, _NEAREST), np.where(nearest < _OPEN_SPACE, wall, -1)

    def _room(self, pose: Pose2D, distance: NDArray[np.float64], wall: NDArray[np.intp]) -> Floats:
        """Floor, walls and ceiling in linear light."""
        camera, look = self._camera, self._look
        depth = distance / np.hypot(1.0, self._tangent)
        scale = camera.constant / depth
        foot = (scale * camera.mount_height).astype(np.float32)
        top = (-scale * (look.wall_height - camera.mount_height)).astype(np.float32)
        board = (scale * (camera.mount_height - 0.08)).astype(np.float32)
        rows = self._rows
        floor = np.clip(rows - foot + 0.5, 0, 1)
        ceiling = np.clip(top - rows + 0.5, 0, 1)
        # Walls: brightness by their direction to the light, darker towards the floor, with a
        # skirting board.
        walls = 1 - floor - ceiling
        walls *= 1 - 0.35 * np.clip(rows - board + 0.5, 0, 1)
        walls *= 1 + np.float32(0.10) * np.clip(-rows / 150, -1, 1)
        walls *= self._wall_shade(wall, distance)
        floor *= self._tiles(pose)
        planes = []
        for wall_colour, floor_colour, ceiling_colour in zip(
            (0.42, 0.46, 0.48), (0.17, 0.21, 0.25), (0.66, 0.68, 0.68), strict=True
        ):
            plane = walls * np.float32(wall_colour)
            plane += floor * np.float32(floor_colour)
            plane += ceiling * np.float32(ceiling_colour)
            planes.append(plane)
        merged: Floats = cv2.merge(planes)
        return merged

    def _wall_shade(self, wall: NDArray[np.intp], distance: NDArray[np.float64]) -> Floats:
        look = self._look
        shade = np.full(len(wall), 0.75)
        if len(self._walls):
            along = self._walls[:, 1] - self._walls[:, 0]
            direction = np.arctan2(along[:, 1], along[:, 0])
            lit = look.ambient + (1 - look.ambient) * np.abs(np.sin(direction - look.light_heading))
            tint = 0.92 + 0.16 * np.modf(np.arange(len(direction)) * 0.61803)[0]
            shade = np.where(wall >= 0, (lit * tint)[wall], shade)
        return (shade * (0.85 + 0.15 * np.exp(-distance / 6))).astype(np.float32)

    def _tiles(self, pose: Pose2D) -> Floats:
        """Brightness of a tiled floor; the pattern fades out before it would alias."""
        camera = self._camera
        rows = self._rows
        first = int(np.searchsorted(rows[:, 0], 4.0))
        shade = np.ones((camera.height, camera.width), np.float32)
        if first >= camera.height:
            return shade
        depth = camera.constant * camera.mount_height / rows[first:]
        cos, sin = math.cos(pose.heading), math.sin(pose.heading)
        tangent = self._tangent.astype(np.float32)
        x = pose.x + depth * (cos - sin * tangent)
        y = pose.y + depth * (sin + cos * tangent)
        odd = (np.floor(x * 2) + np.floor(y * 2)).astype(np.int32) & 1
        shade[first:] += odd * (0.16 * np.clip(1.4 - depth / 5, 0, 1))
        return shade

    def _paint_landmark(
        self,
        picture: Floats,
        pose: Pose2D,
        mark: Landmark,
        away: float,
        wall_distance: NDArray[np.float64],
        slope: float,
    ) -> None:
        kind = mark.kind
        radius = kind.diameter / 2
        bearing = pose.bearing_to(mark.position)
        if away <= radius + _NEAREST or abs(bearing) > self._camera.half_view + 0.5:
            return
        near = away - kind.axis_depth
        size = self._camera.constant * kind.segment / near
        fine = 4 if size > 6 else 8
        window = self._window(bearing, away, radius, kind.height, slope)
        if window is None:
            return
        rows, columns = window
        xs, depth, shade = self._surface(
            columns, fine, bearing, away, radius, kind.shape == "flat", pose
        )
        visible = (depth > 0) & self._in_sight(xs, wall_distance, away - SIGHT_MARGIN)
        if not visible.any():
            return
        ys = _samples(rows, fine) - self._camera.center_y
        from_top = (
            kind.height
            - self._camera.mount_height
            + ys[:, None] * (depth[None, :] / self._camera.constant).astype(np.float32)
        )
        index = np.clip(np.floor(from_top / kind.segment) + 1, 0, kind.segments + 1)
        bright = np.array([0, *map(int, mark.code), 0], np.float32)
        cover = np.array([0, *[1] * kind.segments, 0], np.float32)
        index = index.astype(np.intp)
        alpha = cover[index] * visible
        lit = shade.astype(np.float32)
        orange = bright[index] * visible * lit
        patch = cv2.merge([alpha, orange, alpha * lit - orange])
        self._blend(picture, patch, rows, columns, fine, bearing, slope, self._look)

    def _paint_obstacle(
        self,
        picture: Floats,
        pose: Pose2D,
        disc: tuple[Point, float],
        away: float,
        wall_distance: NDArray[np.float64],
        slope: float,
    ) -> None:
        centre, radius = disc
        bearing = pose.bearing_to(centre)
        if away <= radius + _NEAREST or abs(bearing) > math.pi / 2:
            return
        height = self._look.obstacle_height
        window = self._window(bearing, away, radius, height, slope)
        if window is None:
            return
        rows, columns = window
        xs, depth, shade = self._surface(columns, 1, bearing, away, radius, False, pose)
        visible = (depth > 0) & self._in_sight(xs, wall_distance, away - radius)
        scale = self._camera.constant / np.where(depth > 0, depth, 1.0)
        ys = (_samples(rows, 1) - self._camera.center_y)[:, None]
        above = scale * (self._camera.mount_height - height)
        below = scale * self._camera.mount_height
        alpha = np.clip(ys - above + 0.5, 0, 1) * np.clip(below - ys + 0.5, 0, 1) * visible
        # Legs, coat and head in three plain colours.
        part = np.where(ys < scale * (self._camera.mount_height - 1.45), 1.6, 1.0)
        lit = alpha * shade * part
        patch = np.dstack([alpha, lit, np.zeros_like(lit)]).astype(np.float32)
        cloth = replace(self._look, bright=(0.16, 0.11, 0.09))
        self._blend(picture, patch, rows, columns, 1, bearing, slope, cloth)

    def _window(
        self, bearing: float, away: float, radius: float, height: float, slope: float
    ) -> tuple[range, range] | None:
        """Rows and columns of the frame that a standing cylinder may touch."""
        camera = self._camera
        half = math.asin(min(radius / away, 1.0))
        left, right = bearing + half, bearing - half
        limit = 1.45
        if right > limit or left < -limit:
            return None
        first = camera.center_x - camera.constant * math.tan(min(left, limit))
        last = camera.center_x - camera.constant * math.tan(max(right, -limit))
        near = max((away - radius) * math.cos(bearing), _NEAREST)
        scale = camera.constant / near
        top = camera.center_y - scale * max(height - camera.mount_height, 0)
        bottom = camera.center_y + scale * camera.mount_height
        rows = range(max(math.floor(top) - 2, 0), min(math.ceil(bottom) + 3, camera.height))
        lean = abs(slope) * 1.3 * camera.height / 2 + 3
        columns = range(
            max(math.floor(first - lean), -math.ceil(lean)),
            min(math.ceil(last + lean) + 1, camera.width + math.ceil(lean)),
        )
        return (rows, columns) if len(rows) and len(columns) else None

    def _surface(
        self,
        columns: range,
        fine: int,
        bearing: float,
        away: float,
        radius: float,
        flat: bool,
        pose: Pose2D,
    ) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
        """Per fine column: its place, the depth of the surface (0 beside it), the light on it."""
        look = self._look
        xs = _samples(columns, fine).astype(np.float64)
        angle = np.arctan((self._camera.center_x - xs) / self._camera.constant)
        off = angle - bearing
        if flat:
            hit = np.abs(away * np.tan(off)) < radius
            depth = np.where(hit, away / np.cos(off) * np.cos(angle), 0.0)
            return xs, depth, np.full(len(xs), look.ambient + 0.6 * (1 - look.ambient))
        square = radius**2 - (away * np.sin(off)) ** 2
        hit = square > 0
        root = np.sqrt(np.maximum(square, 0))
        depth = np.where(hit, (away * np.cos(off) - root) * np.cos(angle), 0.0)
        normal = (
            bearing
            + pose.heading
            + math.pi
            + np.arcsin(np.clip(-away * np.sin(off) / radius, -1, 1))
        )
        lit = np.maximum(np.cos(normal - look.light_heading), 0)
        return xs, depth, look.ambient + (1 - look.ambient) * lit

    def _in_sight(
        self, xs: NDArray[np.float64], wall_distance: NDArray[np.float64], reach: float
    ) -> NDArray[np.bool_]:
        column = np.clip(np.rint(xs), 0, len(wall_distance) - 1).astype(np.intp)
        seen: NDArray[np.bool_] = wall_distance[column] >= reach
        return seen

    def _blend(
        self,
        picture: Floats,
        patch: Floats,
        rows: range,
        columns: range,
        fine: int,
        bearing: float,
        slope: float,
        look: Look,
    ) -> None:
        """Lay a finely sampled patch (cover, bright light, dark light) over the picture."""
        if slope:
            # Row v is exposed later than the middle row: the pole stands elsewhere by then.
            middle = (self._camera.center_y - rows.start + 0.5) * fine - 0.5
            patch = _shear(patch, slope / math.cos(bearing) ** 2, middle)
        if fine > 1:
            size = (len(columns), len(rows))
            patch = cv2.resize(patch, size, interpolation=cv2.INTER_AREA)
        skip = max(-columns.start, 0)
        end = min(columns.stop, self._camera.width)
        if end <= columns.start + skip:
            return
        patch = patch[:, skip : skip + end - (columns.start + skip)]
        target = picture[rows.start : rows.stop, columns.start + skip : end]
        target *= 1 - patch[:, :, :1]
        target += patch[:, :, 1:2] * np.array(look.bright, np.float32)
        target += patch[:, :, 2:] * np.array(look.dark, np.float32)

    def _expose(self, picture: Floats) -> Image:
        codes = cv2.multiply(picture, self._gain)
        grey = self._gamma.take(codes.astype(np.intp), mode="clip")
        if self._look.noise <= 0:
            return np.asarray(cv2.convertScaleAbs(grey), np.uint8)
        start = int(self._rng.integers(len(self._noise) - grey.size))
        noise = self._noise[start : start + grey.size].reshape(grey.shape)
        # One pass that adds, keeps to 0..255 and makes bytes.
        return np.asarray(cv2.add(grey, noise, dtype=cv2.CV_8U), np.uint8)


def _samples(pixels: range, fine: int) -> Floats:
    """Positions of ``fine`` samples per pixel; centres of pixels are integers."""
    steps = (np.arange(len(pixels) * fine, dtype=np.float32) + 0.5) / fine
    return steps + np.float32(pixels.start - 0.5)


def _shear(picture: Floats, slope: float, middle: float) -> Floats:
    """Move row v to the right by ``slope`` * (v - middle)."""
    matrix = np.array([[1.0, slope, -slope * middle], [0.0, 1.0, 0.0]])
    moved: Floats = cv2.warpAffine(
        picture,
        matrix,
        (picture.shape[1], picture.shape[0]),
        flags=cv2.INTER_LINEAR,
        borderMode=cv2.BORDER_REPLICATE,
    )
    return moved


def _box(length: float) -> Floats:
    """A horizontal kernel that averages over ``length`` pixels, fractions included."""
    half = math.ceil((length - 1) / 2) if length > 1 else 1
    offset = np.abs(np.arange(-half, half + 1))
    weight = np.clip(length / 2 + 0.5 - offset, 0, 1) if length > 1 else np.array([0, 1, 0])
    kernel: Floats = (weight / weight.sum()).astype(np.float32)[None, :]
    return kernel


def _gamma_table() -> NDArray[np.int16]:
    """Linear light in 12 bits to sRGB grey levels."""
    linear = np.arange(_CODES) / (_CODES - 1)
    curve = np.where(linear <= 0.0031308, 12.92 * linear, 1.055 * linear ** (1 / 2.4) - 0.055)
    table: NDArray[np.int16] = np.rint(curve * 255).astype(np.int16)
    return table
