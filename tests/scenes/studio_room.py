"""A plain room: floor, walls, ceiling, skirting board, doors and cupboards, nothing orange."""

from __future__ import annotations

import colorsys
import math
from collections.abc import Sequence
from functools import cache

import cv2
import numpy as np
from numpy.typing import NDArray
from scenes.studio_light import Floats, Lighting, Rng
from scenes.studio_optics import Eye, Pole


@cache
def clouds(seed: int) -> Floats:
    """Smooth random field, 512 x 512 and periodic, mean 0 and standard deviation 1."""
    rng = np.random.default_rng(1000 + seed)
    total = np.zeros((512, 512), np.float32)
    for cells, weight in ((4, 1.0), (16, 0.6), (64, 0.5), (256, 0.6)):
        coarse = rng.standard_normal((cells, cells)).astype(np.float32)
        coarse = np.pad(coarse, 2, mode="wrap")
        fine = cv2.resize(
            coarse, None, fx=512 / cells, fy=512 / cells, interpolation=cv2.INTER_CUBIC
        )
        start = 2 * 512 // cells
        total += weight * fine[start : start + 512, start : start + 512]
    return np.asarray((total - total.mean()) / total.std(), np.float32)


def look_up(field: Floats, x: NDArray[np.float64], y: NDArray[np.float64]) -> Floats:
    """Values of a periodic field at (x, y), its period being 1."""
    size = field.shape[0]
    column = (x * size).astype(np.int64) & (size - 1)
    row = (y * size).astype(np.int64) & (size - 1)
    return field[row, column]


def soft_color(rng: Rng, least: float, most: float, strength: float = 0.22) -> NDArray[np.float64]:
    """A reflectance of little saturation, linear RGB."""
    hue, saturation = rng.random(), rng.uniform(0, strength)
    return rng.uniform(least, most) * np.array(colorsys.hsv_to_rgb(hue, saturation, 1.0))


def field_over(shape: tuple[int, int], rng: Rng, depth: float) -> Floats:
    """A smooth gradient over the picture, about 1."""
    coarse = (1 + depth * rng.uniform(-1, 1, (3, 4))).astype(np.float32)
    return np.asarray(cv2.resize(coarse, (shape[1], shape[0]), interpolation=cv2.INTER_CUBIC))


def room(eye: Eye, rng: Rng, lighting: Lighting, poles: Sequence[Pole], behind: float) -> Floats:
    """What the eye sees of a room whose far wall stands ``behind`` metres away, linear light.

    Rows are seen when they are exposed; the blur of lens and movement is still to come.
    """
    double = 2
    columns = (np.arange(eye.width * double) + 0.5) / double - 0.5
    rows = (np.arange(eye.height * double)[:, None] + 0.5) / double - 0.5
    x, y, z = eye.rays(columns, rows)
    turn = rng.uniform(-0.5, 0.5)
    cos, sin = math.cos(turn), math.sin(turn)
    x, y = x * cos + y * sin, y * cos - x * sin
    half = rng.uniform(0.35, 1.0) * behind
    tall = rng.uniform(2.4, 4.0)
    light = lighting.mean
    out = np.empty((*x.shape, 3), np.float32)

    with np.errstate(divide="ignore"):
        to_far = np.where(x > 1e-6, behind / x, np.inf)
        to_side = half / np.maximum(np.abs(y), 1e-9)
        to_flat = np.where(z < 0, -eye.above, tall - eye.above) / np.where(z == 0, 1e-9, z)
    to_wall = np.minimum(to_far, to_side)
    flat = to_flat < to_wall
    reach = np.minimum(to_flat, to_wall)
    at_x, at_y, at_z = reach * x, reach * y, eye.above + reach * z

    wall = soft_color(rng, 0.25, 0.8)
    side = to_side < to_far
    along = np.where(side, at_x, at_y)
    texture = look_up(clouds(int(rng.integers(4))), along / 2.7 + 5, at_z / 2.7 + 5)
    shade = (1 + rng.uniform(0.0, 0.06) * texture) * np.where(side, rng.uniform(0.6, 1.0), 1.0)
    surface = shade[..., None] * wall.astype(np.float32)
    for _ in range(int(rng.integers(0, 5))):
        place, wide = rng.uniform(-0.7, 0.7) * half, rng.uniform(0.3, 1.4)
        low = 0.0 if rng.random() < 0.6 else rng.uniform(0.5, 1.2)
        high = low + rng.uniform(0.3, 2.0)
        thing = ~side & (np.abs(at_y - place) < wide / 2) & (at_z > low) & (at_z < high)
        color = soft_color(rng, 0.03, 0.7, 0.35 if rng.random() < 0.3 else 0.15)
        if color[0] > 1.15 * color[2]:  # nothing orange in a plain room
            color = color[::-1]
        surface[thing] = color * (1 + 0.05 * texture[thing])[:, None]
        if rng.random() < 0.6:
            panel = thing & (np.abs(at_y - place) < wide * 0.38) & (at_z > low + 0.1)
            surface[panel & (at_z < high - 0.12)] *= rng.uniform(0.7, 1.2)
    if rng.random() < 0.8:
        board = at_z < rng.uniform(0.06, 0.14)
        surface[board] = soft_color(rng, 0.05, 0.8, 0.15)
    out[:] = surface

    tiled = rng.random() < 0.5
    size = rng.uniform(0.2, 0.6)
    floor = soft_color(rng, 0.08, 0.5, 0.3 if tiled else 0.2)
    grain = look_up(clouds(int(rng.integers(4))), at_x / 1.9 + 5, at_y / 1.9 + 5)
    shade = 1 + rng.uniform(0.02, 0.15) * grain
    if tiled:
        seam = np.minimum(np.abs((at_x / size) % 1 - 0.5), np.abs((at_y / size) % 1 - 0.5))
        width = np.maximum(0.004, reach / eye.constant) / size
        shade = shade * np.where(seam < width, rng.uniform(0.5, 0.9), 1.0)
        tile = np.floor(at_x / size) * 7 + np.floor(at_y / size) * 13
        shade = shade * (1 + 0.04 * np.sin(tile * 12.9898))
    shade = shade * _shadows(at_x, at_y, turn, lighting, poles)
    ground = shade[..., None] * floor
    above = np.broadcast_to(rng.uniform(0.5, 0.9) * light**0, ground.shape)
    out[flat] = np.where((z < 0)[..., None], ground, above)[flat]
    # Corners are darker than open walls.
    corner = np.minimum(np.abs(to_far - to_side) / (to_far + to_side) * 8, 1.0)
    edge = np.minimum(np.abs(to_flat - to_wall) / (to_flat + to_wall) * 8, 1.0)
    out *= (0.82 + 0.18 * np.minimum(corner, edge))[..., None]
    out *= field_over(out.shape[:2], rng, 0.25)[..., None] * light.astype(np.float32)
    return np.asarray(cv2.resize(out, (eye.width, eye.height), interpolation=cv2.INTER_AREA))


def _shadows(
    x: NDArray[np.float64],
    y: NDArray[np.float64],
    turn: float,
    lighting: Lighting,
    poles: Sequence[Pole],
) -> NDArray[np.float64]:
    """How much light is left on the floor at (x, y), which is turned by ``turn``."""
    left = np.ones_like(x)
    cos, sin = math.cos(turn), math.sin(turn)
    for pole in poles:
        foot = pole.foot
        place = np.array([foot[0] * cos + foot[1] * sin, foot[1] * cos - foot[0] * sin])
        radius = pole.kind.diameter / 2
        apart = np.hypot(x - place[0], y - place[1])
        left *= 1 - 0.5 * np.exp(-np.maximum(apart - radius, 0) / 0.05)
        for lamp in lighting.lamps:
            ahead, aside, up = lamp.direction
            away = -np.array([ahead * cos + aside * sin, aside * cos - ahead * sin])
            long = np.linalg.norm(away)
            away /= long
            along = (x - place[0]) * away[0] + (y - place[1]) * away[1]
            across = np.abs((y - place[1]) * away[0] - (x - place[0]) * away[1])
            soft = 0.01 + 0.08 * np.maximum(along, 0)
            dark = np.clip((radius + soft / 2 - across) / soft, 0, 1) * (along > 0)
            dark *= along < pole.kind.height * long / up
            share = 0.5 * lamp.color[1] / lighting.mean[1]
            left *= 1 - min(share, 0.8) * dark * radius / (radius + soft / 2)
    return left
