"""The darkroom's photographs and the textures that it makes up, as linear blue, green, red.

Photographs come with packages that the tests or the program install anyway: scikit-image,
viser (whole panoramas of real rooms and places) and, where it is there, scikit-learn.
"""

from __future__ import annotations

import importlib.util
from functools import lru_cache
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray
from scenes.darkroom_camera import Plane
from scenes.darkroom_mesh import CENTER, CONSTANT, HEIGHT, WIDTH, View
from scenes.darkroom_stage import grain

PICTURES = (
    "skimage/data/astronaut.png",
    "skimage/data/coffee.png",
    "skimage/data/chelsea.png",
    "skimage/data/motorcycle_left.png",
    "skimage/data/motorcycle_right.png",
    "skimage/data/rocket.jpg",
    "skimage/data/ihc.png",
    "skimage/data/retina.jpg",
    "skimage/data/color.png",
    "skimage/data/logo.png",
    "skimage/data/hubble_deep_field.jpg",
    "skimage/data/brick.png",
    "skimage/data/gravel.png",
    "skimage/data/grass.png",
    "skimage/data/camera.png",
    "skimage/data/coins.png",
    "skimage/data/text.png",
    "sklearn/datasets/images/flower.jpg",
    "sklearn/datasets/images/china.jpg",
)
_WEIGHTS = np.array([5, 5, 4, 5, 4, 2, 3, 2, 1, 2, 1, 3, 1, 2, 2, 1, 1, 5, 5], np.float64)
_GREY = {"brick", "gravel", "grass", "camera", "coins", "text"}

_PLACES = (
    "empty_warehouse_01",
    "st_fagans_interior",
    "lebombo",
    "potsdamer_platz",
    "venice_sunset",
    "forest_slope",
    "studio_small_03",
    "rooitou_park",
    "kiara_1_dawn",
)
_PLACE_WEIGHTS = np.array([3, 5, 4, 4, 4, 2, 2, 1, 2], np.float64)
GREY_PLACES = ("empty_warehouse_01", "studio_small_03", "potsdamer_platz")
"""Places without much of orange."""


def to_linear(picture: NDArray[np.uint8]) -> Plane:
    """Levels of a picture to linear values (sRGB)."""
    table = np.arange(256, dtype=np.float32) / 255
    table = np.where(table <= 0.04045, table / 12.92, ((table + 0.055) / 1.055) ** 2.4)
    return np.asarray(table.astype(np.float32)[picture])


@lru_cache(maxsize=64)
def _load(package: str, path: str) -> NDArray[np.uint8] | None:
    spec = importlib.util.find_spec(package)
    if spec is None or not spec.submodule_search_locations:
        return None
    file = Path(spec.submodule_search_locations[0]) / path
    if not file.is_file():
        return None
    data = np.frombuffer(file.read_bytes(), np.uint8)
    picture = cv2.imdecode(data, cv2.IMREAD_COLOR)
    if picture is None:
        return None
    if max(picture.shape) > 1100:
        picture = cv2.resize(picture, None, fx=0.6, fy=0.6, interpolation=cv2.INTER_AREA)
    return np.asarray(picture, np.uint8)


def _chosen(rng: np.random.Generator) -> tuple[str, NDArray[np.uint8]]:
    for index in rng.choice(len(PICTURES), 3, replace=False, p=_WEIGHTS / _WEIGHTS.sum()):
        package, path = PICTURES[index].split("/", 1)
        picture = _load(package, path)
        if picture is not None:
            return Path(path).stem, picture
    raise FileNotFoundError("the photographs of scikit-image are not installed")


def photograph(rng: np.random.Generator) -> tuple[Plane, str]:
    """A crop (4:3) of a photograph, mirrored, blurred and toned by lot, and its name."""
    name, picture = _chosen(rng)
    high, wide = picture.shape[:2]
    size = rng.uniform(0.35, 1.0) * min(wide, high * WIDTH / HEIGHT)
    across, down = int(size), int(size * HEIGHT / WIDTH)
    x = int(rng.integers(0, wide - across + 1))
    y = int(rng.integers(0, high - down + 1))
    crop = picture[y : y + down, x : x + across]
    if rng.random() < 0.5:
        crop = crop[:, ::-1]
    if rng.random() < 0.08:
        crop = crop[::-1]
    linear = to_linear(np.ascontiguousarray(crop))
    big = cv2.resize(linear, (2 * WIDTH, 2 * HEIGHT), interpolation=cv2.INTER_CUBIC)
    linear = np.clip(big, 0, 1).astype(np.float32)
    if name in _GREY and rng.random() < 0.75:
        warm = np.array([rng.uniform(0.1, 0.5), rng.uniform(0.3, 0.6), rng.uniform(0.7, 1.0)])
        cold = rng.uniform(0.3, 1.0, 3)
        linear = linear * (warm if rng.random() < 0.7 else cold).astype(np.float32)
    if rng.random() < 0.45:
        linear = np.asarray(cv2.GaussianBlur(linear, (0, 0), float(rng.uniform(0.8, 6))))
    return linear * np.float32(rng.uniform(0.5, 1.15)), name


def place(rng: np.random.Generator, view: View, names: tuple[str, ...] = ()) -> tuple[Plane, str]:
    """A real place in true perspective, looked at in some direction, and its name."""
    weights = [1.0] * len(names) if names else list(_PLACE_WEIGHTS)
    names = names or _PLACES
    name = str(rng.choice(names, p=np.array(weights) / sum(weights)))
    picture = _load("viser", f"_assets/hdri/{name}_1k.jpg")
    if picture is None:
        return photograph(rng)
    high, wide = picture.shape[:2]
    rows, columns = np.mgrid[0:HEIGHT:4, 0:WIDTH:4].astype(np.float64)
    wider = rng.uniform(1.0, 1.7)
    forward = np.full(rows.shape, CONSTANT / wider)
    rays = np.stack([forward, CENTER[0] - columns, CENTER[1] - rows], axis=-1)
    world = rays @ view.rotation().T
    azimuth = np.arctan2(world[..., 1], world[..., 0]) + rng.uniform(-np.pi, np.pi)
    elevation = np.arctan2(world[..., 2], np.hypot(world[..., 0], world[..., 1]))
    x = (0.5 - azimuth / (2 * np.pi)) * wide
    # No seam: the picture repeats, and a crop wider than half of it never comes up.
    x = x - np.floor(x.min() / wide) * wide
    y = (0.5 - elevation / np.pi) * high
    around = np.concatenate([picture, picture[:, : wide // 2]], axis=1)
    size = (2 * WIDTH, 2 * HEIGHT)
    map_x = cv2.resize(x.astype(np.float32), size, interpolation=cv2.INTER_LINEAR)
    map_y = cv2.resize(y.astype(np.float32), size, interpolation=cv2.INTER_LINEAR)
    seen = cv2.remap(around, map_x, map_y, cv2.INTER_CUBIC, borderMode=cv2.BORDER_REFLECT)
    linear = to_linear(np.asarray(seen, np.uint8))
    if rng.random() < 0.5:
        linear = np.ascontiguousarray(linear[:, ::-1])
    return linear * np.float32(rng.uniform(0.6, 1.1)), name


def orange(rng: np.random.Generator, near: float = 0.75) -> NDArray[np.float64]:
    """A reflectance like the paint's, or (seldom) any red, yellow or brown."""
    red = rng.uniform(0.45, 0.85)
    if rng.random() < near:
        return np.array([rng.uniform(0.02, 0.07), red * rng.uniform(0.12, 0.32), red])
    kind = rng.integers(3)
    if kind == 0:
        return np.array([0.03, rng.uniform(0.02, 0.05), rng.uniform(0.3, 0.7)])
    if kind == 1:
        return np.array([0.05, red * rng.uniform(0.5, 0.75), red])
    brown = rng.uniform(0.15, 0.4)
    return np.array([brown * 0.25, brown * 0.5, brown])


def wood(rng: np.random.Generator, size: int = 512) -> Plane:
    """Boards that run down the texture."""
    tone = rng.uniform(0.18, 0.55)
    base = np.array([tone * rng.uniform(0.12, 0.4), tone * rng.uniform(0.35, 0.62), tone])
    boards = int(rng.integers(3, 14))
    value = 1 + 0.10 * grain(rng, (size, size), (3, 90)) + 0.05 * grain(rng, (size, size), (9, 250))
    edges = (
        np.sort(rng.uniform(0, size, boards))
        if rng.random() < 0.3
        else (np.arange(boards) * size / boards)
    )
    x = np.arange(size)
    owner = np.searchsorted(edges, x, side="right")
    value = value * (1 + 0.13 * rng.standard_normal(boards + 1))[owner]
    gap = np.min(np.abs(x[:, None] - edges[None]), axis=1) < 1.3
    value[:, gap] *= 0.35
    return np.asarray(np.clip(value[:, :, None] * base, 0.01, 0.95), np.float32)


def bricks(rng: np.random.Generator, size: int = 512) -> Plane:
    """A brick wall; the texture is about 12 courses high."""
    tone = rng.uniform(0.25, 0.6)
    base = np.array([tone * rng.uniform(0.1, 0.35), tone * rng.uniform(0.22, 0.5), tone])
    mortar = np.full(3, rng.uniform(0.15, 0.6))
    courses = int(rng.integers(9, 16))
    y, x = np.mgrid[:size, :size] * (courses / size)
    row = np.floor(y).astype(int)
    across = x / 3 + 0.5 * (row % 2)
    column = np.floor(across).astype(int)
    tints = 1 + 0.16 * rng.standard_normal((courses + 1, courses + 2, 1))
    hues = 1 + 0.08 * rng.standard_normal((courses + 1, courses + 2, 3))
    wall = base * (tints * hues)[row, column]
    joint = (y - row < 0.14) | (across - column < 0.045)
    wall[joint] = mortar
    wall *= (1 + 0.08 * grain(rng, (size, size), (80, 80)))[:, :, None]
    return np.asarray(np.clip(wall, 0.01, 0.95), np.float32)


def curtain(rng: np.random.Generator, color: NDArray[np.float64], size: int = 512) -> Plane:
    """Cloth in folds that run down."""
    x = np.linspace(0, 1, size)
    phase = np.cumsum(1 + 0.5 * grain(rng, (1, size), (0, 12))[0]) / size
    folds = 0.72 + 0.28 * np.sin(2 * np.pi * phase * rng.uniform(8, 26))
    cloth = folds[None, :] * (1 + 0.04 * grain(rng, (size, size), (6, 40)))
    if rng.random() < 0.2:
        cloth = cloth * (0.6 + 0.4 * (np.floor(x * rng.uniform(8, 30)) % 2))[None]
    return np.asarray(np.clip(cloth[:, :, None] * color, 0.005, 0.95), np.float32)


def plaster(rng: np.random.Generator, color: NDArray[np.float64], rough: float) -> Plane:
    """A painted wall or a carpet: one colour, a little uneven."""
    field = (
        1 + rough * grain(rng, (256, 256), (90, 90)) + 0.6 * rough * grain(rng, (256, 256), (5, 5))
    )
    return np.asarray(np.clip(field[:, :, None] * color, 0.005, 0.97), np.float32)


def tiles(
    rng: np.random.Generator, color: NDArray[np.float64], count: int, size: int = 512
) -> Plane:
    """A tiled floor with joints."""
    pitch = size / count
    y, x = np.mgrid[:size, :size]
    row, column = (y // pitch).astype(int), (x // pitch).astype(int)
    tint = 1 + 0.05 * rng.standard_normal((count + 1, count + 1))
    if rng.random() < 0.2:
        tint = tint * np.where(np.add.outer(np.arange(count + 1), np.arange(count + 1)) % 2, 1, 0.4)
    floor = tint[row, column][:, :, None] * color
    joint = (y % pitch < 2.5) | (x % pitch < 2.5)
    floor[joint] = color * rng.uniform(0.4, 0.8)
    return np.asarray(np.clip(floor, 0.005, 0.97), np.float32)
