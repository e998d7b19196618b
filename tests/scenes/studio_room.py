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


def look_up(field: Floats, x: Floats, y: Floats) -> Floats:
    """Values of a periodic field at (x, y), its period being 1."""
    size = field.shape[0]
    column = (x * size).astype(np.int32) & (size - 1)
    row = (y * size).astype(np.int32) & (size - 1)
    return np.asarray(field[row, column])


def soft_color(rng: Rng, least: float, most: float, strength: float = 0.22) -> Floats:
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
    turn = rng.uniform(-0.5, 0.5)
    x, y, z = (axis.astype(np.float32) for axis in eye.rays(columns, rows, turn=-turn))
    half = rng.uniform(0.35, 1.0) * behind
    tall = rng.uniform(2.4, 4.0)
    z[z == 0] = 1e-9
    to_far = behind / np.maximum(x, 1e-6)
    to_side = half / np.maximum(np.abs(y), 1e-6)
    to_flat = np.where(z < 0, -eye.above, tall - eye.above) / z
    to_wall = np.minimum(to_far, to_side)
    flat = to_flat < to_wall
    # Corners are darker than open walls.
    edge = np.minimum(
        np.abs(to_far - to_side) / (to_far + to_side),
        np.abs(to_flat - to_wall) / (to_flat + to_wall),
    )
    out = np.empty((*x.shape, 3), np.float32)
    there = ~flat
    reach = to_wall[there]
    out[there] = _walls(
        (reach * x[there], reach * y[there], eye.above + reach * z[there]),
        (to_side < to_far)[there],
        half,
        (rng, lighting, turn),
    )
    there = flat & (z > 0)
    out[there] = (rng.uniform(0.5, 0.9) * lighting.ambient).astype(np.float32)
    there = flat & (z < 0)
    reach = to_flat[there]
    out[there] = _floor(
        reach * x[there], reach * y[there], reach / eye.constant, poles, (rng, lighting, turn)
    )
    out *= (0.82 + 0.18 * np.minimum(8 * edge, 1.0))[..., None]
    out *= field_over(out.shape[:2], rng, 0.25)[..., None]
    return np.asarray(cv2.resize(out, (eye.width, eye.height), interpolation=cv2.INTER_AREA))


_Chance = tuple[Rng, Lighting, float]
"""What all parts of a room share: chance, light, and how far the room is turned to the left."""


def _walls(
    place: tuple[Floats, Floats, Floats], side: NDArray[np.bool_], half: float, chance: _Chance
) -> Floats:
    """Light from the walls at ``place`` (in the room): doors, cupboards, a skirting board."""
    rng, lighting, turn = chance
    x, y, z = place
    texture = look_up(clouds(int(rng.integers(4))), np.where(side, x, y) / 2.7 + 5, z / 2.7 + 5)
    surface = np.empty((len(x), 3), np.float32)
    surface[:] = soft_color(rng, 0.25, 0.8)
    for _ in range(int(rng.integers(0, 5))):
        middle, wide = rng.uniform(-0.7, 0.7) * half, rng.uniform(0.3, 1.4)
        low = 0.0 if rng.random() < 0.6 else rng.uniform(0.5, 1.2)
        high = low + rng.uniform(0.3, 2.0)
        across = np.abs(y - middle)
        thing = ~side & (across < wide / 2) & (z > low) & (z < high)
        color = soft_color(rng, 0.03, 0.7, 0.35 if rng.random() < 0.3 else 0.15)
        if color[0] > 1.15 * color[2]:  # nothing orange in a plain room
            color = color[::-1]
        surface[thing] = color
        if rng.random() < 0.6:
            panel = thing & (across < wide * 0.38) & (z > low + 0.1) & (z < high - 0.12)
            surface[panel] *= rng.uniform(0.7, 1.2)
    if rng.random() < 0.8:
        surface[z < rng.uniform(0.06, 0.14)] = soft_color(rng, 0.05, 0.8, 0.15)
    # The far wall faces the camera, the side walls each other.
    normals = turn + np.array([math.pi, -math.pi / 2, math.pi / 2])
    light = np.maximum(lighting.on_vertical(normals), 0.5 * lighting.ambient).astype(np.float32)
    surface *= light[np.where(side, np.where(y > 0, 1, 2), 0)]
    surface *= (1 + rng.uniform(0.0, 0.06) * texture)[:, None]
    return surface


def _floor(x: Floats, y: Floats, pixel: Floats, poles: Sequence[Pole], chance: _Chance) -> Floats:
    """Light from the floor at (x, y) in the room; a pixel is ``pixel`` metres wide there."""
    rng, lighting, turn = chance
    tiled = rng.random() < 0.5
    size = rng.uniform(0.2, 0.6)
    color = soft_color(rng, 0.08, 0.5, 0.3 if tiled else 0.2)
    texture = look_up(clouds(int(rng.integers(4))), x / 1.9 + 5, y / 1.9 + 5)
    shade = 1 + rng.uniform(0.02, 0.15) * texture
    if tiled:
        seam = np.minimum(np.abs((x / size) % 1 - 0.5), np.abs((y / size) % 1 - 0.5))
        wide = np.maximum(0.004, pixel) / size
        shade *= np.where(seam < wide, rng.uniform(0.5, 0.9), 1.0)
        tile = np.floor(x / size) * 7 + np.floor(y / size) * 13
        shade *= 1 + 0.04 * np.sin(tile * 12.9898)
    shade *= _shadows(x, y, turn, lighting, poles)
    light = (color * lighting.on_floor()).astype(np.float32)
    return np.asarray(shade.astype(np.float32)[:, None] * light)


def _shadows(
    x: Floats, y: Floats, turn: float, lighting: Lighting, poles: Sequence[Pole]
) -> Floats:
    """How much light is left on the floor at (x, y), in the room."""
    left = np.ones_like(x)
    cos, sin = np.float32(math.cos(turn)), np.float32(math.sin(turn))
    for pole in poles:
        foot = pole.foot.astype(np.float32)
        across = x - (foot[0] * cos + foot[1] * sin)
        along = y - (foot[1] * cos - foot[0] * sin)
        radius = np.float32(pole.kind.diameter / 2)
        apart = np.hypot(across, along)
        close = apart < 0.4
        left[close] *= 1 - 0.5 * np.exp(-np.maximum(apart[close] - radius, 0) / 0.05)
        for lamp in lighting.lamps:
            ahead, aside, up = (np.float32(part) for part in lamp.direction)
            long = np.hypot(ahead, aside)
            away = -(ahead * cos + aside * sin) / long, -(aside * cos - ahead * sin) / long
            down = across * away[0] + along * away[1]
            near = (down > 0) & (down < pole.kind.height * long / up)
            off = np.abs(along[near] * away[0] - across[near] * away[1])
            soft = 0.01 + 0.08 * down[near]
            dark = np.clip((radius + soft / 2 - off) / soft, 0, 1) * radius / (radius + soft / 2)
            share = up * lamp.color[1] / lighting.on_floor()[1]
            left[near] *= 1 - np.float32(share) * dark
    return left
