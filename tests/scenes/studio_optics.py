"""Rays: a pinhole camera on a turning pan axis, and a painted pole seen through its lens.

World: x ahead and y left of the direction of the optical axis at mid exposure of the middle row,
z up from the floor, the camera above the origin. Pixel centres are integers.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from scenes.studio_light import Floats, Lighting, Paint

from polepilot.core.landmark import LandmarkKind, encode

Array = Floats


@dataclass(frozen=True, slots=True)
class Eye:
    """A camera at one moment: level or not, turning or not. Pixels, metres, radians, seconds."""

    width: int = 400
    height: int = 300
    constant: float = 600.0
    above: float = 0.40
    pitch: float = 0.0
    roll: float = 0.0
    pan_rate: float = 0.0
    readout: float = 0.0
    """From the first row to the last."""
    exposure: float = 0.0
    blur: float = 0.3
    """Standard deviation of the lens's point spread, pixels."""

    @property
    def center(self) -> tuple[float, float]:
        """Column and row of the optical axis."""
        return (self.width - 1) / 2, (self.height - 1) / 2

    @property
    def smear(self) -> float:
        """Pixels that the picture moves sideways during the exposure."""
        return abs(self.pan_rate) * self.exposure * self.constant

    def yaw(self, rows: Array, late: float = 0.0) -> Array:
        """Where the camera points when ``rows`` are exposed (their middle, ``late`` s later)."""
        when = (rows - self.center[1]) / self.height * self.readout + late
        return np.asarray(self.pan_rate * when)

    def rays(
        self, columns: Array, rows: Array, late: float = 0.0, turn: float = 0.0
    ) -> tuple[Array, Array, Array]:
        """Directions (x, y, z) seen at ``columns`` (n) of ``rows`` (m x 1): each m x n.

        ``turn`` turns them to the left, radians.
        """
        side = (self.center[0] - columns) / self.constant
        rise = (self.center[1] - rows) / self.constant
        cos, sin = math.cos(self.roll), math.sin(self.roll)
        side, rise = side * cos - rise * sin, side * sin + rise * cos
        cos, sin = math.cos(self.pitch), math.sin(self.pitch)
        ahead, rise = cos - rise * sin, sin + rise * cos
        yaw = self.yaw(rows, late) + turn
        cos_yaw, sin_yaw = np.cos(yaw), np.sin(yaw)
        return ahead * cos_yaw - side * sin_yaw, ahead * sin_yaw + side * cos_yaw, rise

    def project(self, points: Array, late: float = 0.0) -> Array:
        """Columns and rows (n x 2) of world points (n x 3)."""
        rows = np.full(len(points), self.center[1])
        pixels = np.empty((len(points), 2))
        for _ in range(5 if self.pan_rate else 1):
            yaw = self.yaw(rows, late)
            ahead = points[:, 0] * np.cos(yaw) + points[:, 1] * np.sin(yaw)
            side = points[:, 1] * np.cos(yaw) - points[:, 0] * np.sin(yaw)
            rise = points[:, 2] - self.above
            cos, sin = math.cos(self.pitch), math.sin(self.pitch)
            ahead, rise = ahead * cos + rise * sin, rise * cos - ahead * sin
            cos, sin = math.cos(self.roll), math.sin(self.roll)
            side, rise = side * cos + rise * sin, rise * cos - side * sin
            pixels[:, 0] = self.center[0] - self.constant * side / ahead
            pixels[:, 1] = self.center[1] - self.constant * rise / ahead
            rows = pixels[:, 1]
        return pixels


@dataclass(frozen=True, slots=True)
class Pole:
    """A landmark in the world. ``range`` and ``bearing`` are of its axis at half of its height."""

    id: int
    range: float
    bearing: float
    kind: LandmarkKind
    paint: Paint
    lean: tuple[float, float] = (0.0, 0.0)
    """How far its top leans forward and left, radians."""
    turn: float = 0.0
    """Of a flat sticker away from the camera, radians."""
    fade: float = 0.0
    """By how much more light its top gets than its middle, as a share."""

    @property
    def axis(self) -> Array:
        """Unit vector upwards."""
        up = np.array([math.tan(self.lean[0]), math.tan(self.lean[1]), 1.0])
        return np.asarray(up / np.linalg.norm(up))

    @property
    def foot(self) -> Array:
        """Where the code begins, at the floor."""
        half = self.kind.height / 2
        middle = np.array(
            [self.range * math.cos(self.bearing), self.range * math.sin(self.bearing), half]
        )
        return np.asarray(middle - half * self.axis)

    @property
    def facing(self) -> float:
        """Azimuth of the direction towards the camera, or of a sticker's normal."""
        return self.bearing + math.pi + self.turn

    def surface(self, across: Array, heights: Array) -> Array:
        """World points on the side that faces the camera (n x 3).

        ``across`` runs from -1 at one silhouette to 1 at the other.
        """
        radius = self.kind.diameter / 2
        ahead = np.array([math.cos(self.facing), math.sin(self.facing), 0.0])
        ahead -= self.axis * (ahead @ self.axis)
        ahead /= np.linalg.norm(ahead)
        left = np.cross(self.axis, ahead)
        depth = np.sqrt(1 - across**2) * radius if self.kind.shape == "cylinder" else 0 * across
        return np.asarray(
            self.foot
            + np.outer(heights, self.axis)
            + np.outer(depth, ahead)
            + np.outer(across * radius, left)
        )

    def outline(self, eye: Eye) -> Array:
        """Pixels (n x 2) round the code, at the middle of the exposure."""
        across = np.tile(np.linspace(-1, 1, 7), 2)
        heights = np.repeat([0.0, self.kind.height], 7)
        sides = np.repeat([-1.0, 1.0], 9)
        levels = np.tile(np.linspace(0, self.kind.height, 9), 2)
        return eye.project(
            np.concatenate([self.surface(across, heights), self.surface(sides, levels)])
        )


@dataclass(frozen=True, slots=True, eq=False)
class Layer:
    """Something seen in a part of the picture, blur of lens and motion included.

    ``color`` (rows x columns x 3) is already multiplied by ``cover`` (rows x columns, 0 to 1).
    """

    top: int
    left: int
    color: Floats
    cover: Floats

    def onto(self, picture: Floats) -> None:
        """Puts this in front of what ``picture`` shows."""
        rows = slice(self.top, self.top + self.cover.shape[0])
        columns = slice(self.left, self.left + self.cover.shape[1])
        picture[rows, columns] *= 1 - self.cover[..., None]
        picture[rows, columns] += self.color


def spread(fine: Floats, steps: int, sigma: float) -> Floats:
    """Samples (rows x columns x channels), ``steps`` to a pixel each way, to blurred pixels.

    Exactly the area of a pixel, blurred by a Gaussian of ``sigma`` pixels.
    """
    reach = math.ceil(0.5 + 3.5 * sigma)
    offsets = np.arange(-reach * steps, (reach + 1) * steps)
    place = (offsets - (steps - 1) / 2) / steps
    sigma = max(sigma, 1e-3)
    below = np.array([math.erf((p - 0.5) / sigma / math.sqrt(2)) for p in place])
    above = np.array([math.erf((p + 0.5) / sigma / math.sqrt(2)) for p in place])
    taps = ((above - below) / (above - below).sum()).astype(np.float32)
    pad = reach * steps
    for _ in range(2):
        count = fine.shape[0] // steps
        padded = np.pad(fine, ((pad, pad), (0, 0), (0, 0)), mode="edge")
        out = np.zeros((count, *fine.shape[1:]), np.float32)
        for index, tap in enumerate(taps):
            if tap > 1e-7:
                out += tap * padded[index : index + count * steps : steps]
        fine = out.swapaxes(0, 1)
    return fine


def see(pole: Pole, eye: Eye, lighting: Lighting) -> Layer:
    """The landmark as the eye sees it; cropped to the picture."""
    outline = pole.outline(eye)
    margin = math.ceil(3.5 * eye.blur + 1) + 1
    left = max(int(np.floor(outline[:, 0].min() - eye.smear / 2)) - margin, 0)
    right = min(int(np.ceil(outline[:, 0].max() + eye.smear / 2)) + margin + 1, eye.width)
    top = max(int(np.floor(outline[:, 1].min())) - margin, 0)
    bottom = min(int(np.ceil(outline[:, 1].max())) + margin + 1, eye.height)
    if right <= left or bottom <= top:
        raise ValueError(f"landmark {pole.id} lies outside of the picture.")
    thick = np.ptp(outline[:, 0]) - eye.smear
    steps = 4 if thick > 6 else 6 if thick > 3 else 8
    columns = left - 0.5 + (np.arange((right - left) * steps) + 0.5) / steps
    rows = top - 0.5 + (np.arange((bottom - top) * steps) + 0.5) / steps
    times = max(math.ceil(eye.smear / 0.75), 1) if eye.smear > 0.02 else 1
    moved = eye.smear / times
    layers = np.zeros((len(rows), len(columns), 4), np.float32)
    for index in range(times):
        late = ((index + 0.5) / times - 0.5) * eye.exposure
        layers += _samples(pole, eye, lighting, columns, rows[:, None], late, steps, moved)
    pixels = spread(layers / times, steps, eye.blur)
    return Layer(top, left, np.ascontiguousarray(pixels[..., :3]), pixels[..., 3].copy())


def _samples(
    pole: Pole,
    eye: Eye,
    lighting: Lighting,
    columns: Array,
    rows: Array,
    late: float,
    steps: int,
    moved: float,
) -> Floats:
    """Light (multiplied by the cover) and cover for every sample: rows x columns x 4.

    Edges are weighed by the share of the sample's own small area (and of the way ``moved`` by the
    camera, pixels) that lies inside, so that no edge is rounded to a sample.
    """
    kind, radius = pole.kind, pole.kind.diameter / 2
    rays = eye.rays(columns, rows, late)
    ahead = np.array([math.cos(pole.facing), math.sin(pole.facing), 0.0])
    ahead -= pole.axis * (ahead @ pole.axis)
    ahead /= np.linalg.norm(ahead)
    base = np.stack([ahead, np.cross(pole.axis, ahead), pole.axis])
    origin = base @ (np.array([0.0, 0.0, eye.above]) - pole.foot)
    toward = [sum(base[k, i] * rays[i] for i in range(3)) for k in range(3)]
    flat = toward[0] ** 2 + toward[1] ** 2
    small = 1.0 / (eye.constant * steps)
    if kind.shape == "cylinder":
        root = np.sqrt(flat)
        aside = (origin[0] * toward[1] - origin[1] * toward[0]) / root
        half = origin[0] * toward[0] + origin[1] * toward[1]
        inside = np.sqrt(np.maximum(radius**2 - aside**2, 0.0))
        along = (-half / root - inside) / root
        across = np.clip((origin[1] + along * toward[1]) / radius, -1.0, 1.0)
        width = pole.range * (small + moved / eye.constant)
        cover = np.clip((radius - np.abs(aside)) / width + 0.5, 0.0, 1.0)
    else:
        along = -origin[0] / toward[0]
        beside = origin[1] + along * toward[1]
        across = np.clip(beside / radius, -1.0, 1.0)
        width = pole.range * (small + moved / eye.constant) / math.cos(pole.turn)
        cover = np.clip((radius - np.abs(beside)) / width + 0.5, 0.0, 1.0)
    height = origin[2] + along * toward[2]
    tall = pole.range * small
    low = np.clip(height - tall / 2, 0.0, kind.height)
    high = np.clip(height + tall / 2, 0.0, kind.height)
    cover *= (high - low) / tall
    levels = np.arange(kind.segments + 1) * kind.segment
    code = np.array([c == "1" for c in encode(pole.id, kind.bits)[::-1]], float)
    summed = np.concatenate([[0.0], np.cumsum(code) * kind.segment])
    bright = (np.interp(high, levels, summed) - np.interp(low, levels, summed)) / np.maximum(
        high - low, 1e-9
    )
    light, shine = _shading(pole, lighting)
    place = ((across + 1) * (len(light) - 1) / 2 + 0.5).astype(np.int16)
    weight = cover * (1.0 + pole.fade * (height / kind.height * 2 - 1))
    dark, orange = pole.paint.dark, pole.paint.bright
    out = np.empty((*cover.shape, 4), np.float32)
    # Light on black and what orange adds to it, both known for every place across.
    out[..., :3] = (light * dark + shine).astype(np.float32)[place]
    out[..., :3] += bright[..., None] * (light * (orange - dark)).astype(np.float32)[place]
    out[..., :3] *= weight[..., None]
    out[..., 3] = cover
    return out


def _shading(pole: Pole, lighting: Lighting) -> tuple[Array, Array]:
    """Light that falls on the landmark and that it mirrors, from one side to the other: n x 3."""
    across = np.linspace(-1.0, 1.0, 1025)
    curved = np.arcsin(across) if pole.kind.shape == "cylinder" else 0.0 * across
    azimuth = pole.facing + curved
    shine = np.zeros((len(across), 3))
    for lamp in lighting.lamps:
        # Half way between lamp and camera, in the plane of the floor: a streak along the pole.
        back = pole.bearing + math.pi
        half = lamp.direction[:2] + np.array([math.cos(back), math.sin(back)])
        length = float(np.linalg.norm(half))
        if length > 0.05:
            facing = np.cos(azimuth - math.atan2(half[1], half[0]))
            mirrored = np.maximum(facing, 0.0) ** pole.paint.sharpness
            shine += pole.paint.gloss * np.outer(mirrored, lamp.color)
    return lighting.on_vertical(azimuth), shine
