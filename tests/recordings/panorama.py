"""What is behind the poles: a drum of photographs around the robot, in linear blue, green, red.

A drum's column is an azimuth, its row the tangent of an elevation. Real places and photographs
come with packages that the tests or the program install anyway.
"""

from __future__ import annotations

import importlib.util
from functools import lru_cache
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray
from recordings.scenario import Rng

SCALE = 600
"""Columns per radian and rows per unit of tangent."""
AROUND = round(2 * np.pi * SCALE)
UPWARD = 210
"""Rows above the horizon, and as many below."""
EXTRA = 700
"""Columns that are repeated at the end."""
Plane = NDArray[np.float32]

_ROOMS = ("empty_warehouse_01", "st_fagans_interior", "lebombo", "studio_small_03")
_OPEN = ("potsdamer_platz", "venice_sunset", "forest_slope", "rooitou_park", "kiara_1_dawn")
_PHOTOS = (
    "skimage/data/astronaut.png",
    "skimage/data/coffee.png",
    "skimage/data/chelsea.png",
    "skimage/data/motorcycle_left.png",
    "skimage/data/rocket.jpg",
    "skimage/data/retina.jpg",
    "skimage/data/hubble_deep_field.jpg",
    "skimage/data/camera.png",
    "skimage/data/text.png",
    "skimage/data/ihc.png",
    "sklearn/datasets/images/flower.jpg",
    "sklearn/datasets/images/china.jpg",
)
_WALLS = ("skimage/data/brick.png", "skimage/data/gravel.png", "skimage/data/grass.png")


@lru_cache(maxsize=32)
def _photograph(name: str) -> Plane | None:
    """Linear; None where the package that brings it is missing."""
    package, path = name.split("/", 1)
    spec = importlib.util.find_spec(package)
    if spec is None or not spec.submodule_search_locations:
        return None
    file = Path(spec.submodule_search_locations[0]) / path
    if not file.is_file():
        return None
    picture = cv2.imdecode(np.frombuffer(file.read_bytes(), np.uint8), cv2.IMREAD_COLOR)
    if picture is None:
        return None
    levels = np.arange(256) / 255
    linear = np.where(levels <= 0.04045, levels / 12.92, ((levels + 0.055) / 1.055) ** 2.4)
    return linear.astype(np.float32)[picture]


def _place(name: str, turn: float) -> Plane | None:
    """A real place all around, looked at with a longer lens than it was taken with."""
    picture = _photograph(f"viser/_assets/hdri/{name}_1k.jpg")
    if picture is None:
        return None
    high, wide = picture.shape[:2]
    azimuth = (np.arange(AROUND) / SCALE + turn) % (2 * np.pi)
    elevation = np.arctan((UPWARD - np.arange(2 * UPWARD)) / SCALE)
    across = (azimuth / (2 * np.pi) * wide).astype(np.float32)
    down = ((0.5 - 1.6 * elevation / np.pi) * high).astype(np.float32)
    map_x, map_y = np.meshgrid(across, down)
    seen = cv2.remap(picture, map_x, map_y, cv2.INTER_CUBIC, borderMode=cv2.BORDER_WRAP)
    return np.clip(seen, 0.0, 1.0).astype(np.float32)


def _walls(rng: Rng) -> Plane:
    """Painted or bricked walls that change at corners, above a floor."""
    drum = np.empty((2 * UPWARD, AROUND, 3), np.float32)
    corners = np.sort(rng.integers(0, AROUND, 5))
    paint = rng.uniform(0.2, 0.8) * rng.uniform(0.8, 1.0, 3)
    stone = _photograph(str(rng.choice(_WALLS)))
    for index, first in enumerate(corners):
        last = corners[index + 1] if index + 1 < len(corners) else corners[0] + AROUND
        shade = (paint * rng.uniform(0.5, 1.1)).astype(np.float32)
        part = np.broadcast_to(shade, (2 * UPWARD, last - first, 3)).copy()
        if stone is not None and rng.random() < 0.4:
            part *= 0.4 + _tiled(stone, part.shape[:2])
        drum[:, np.arange(first, last) % AROUND] = part
    bend = rng.uniform(20, 60) + 15 * np.cos(np.arange(AROUND) / SCALE * 2 + rng.uniform(0, 6))
    rows = np.arange(2 * UPWARD)[:, None]
    floor = rng.uniform(0.1, 0.6) * rng.uniform(0.6, 1.0, 3)
    ground = np.broadcast_to(floor.astype(np.float32), drum.shape).copy()
    if stone is not None:
        ground *= 0.5 + _tiled(stone, drum.shape[:2])
    drum[rows > UPWARD + bend] = ground[rows > UPWARD + bend]
    return drum


def _tiled(stone: Plane, shape: tuple[int, int]) -> Plane:
    high, wide = stone.shape[:2]
    return stone[np.arange(shape[0])[:, None] % high, np.arange(shape[1]) % wide]


def drum(rng: Rng, outdoors: bool) -> Plane:
    """A place with photographs in it: about half of the circle has one."""
    around = None
    if outdoors or rng.random() < 0.5:
        names = _OPEN if outdoors else _ROOMS
        around = _place(str(rng.choice(names)), float(rng.uniform(0, 2 * np.pi)))
    plane = _walls(rng) if around is None else around
    for _ in range(int(rng.integers(3, 8)) if not outdoors else int(rng.integers(1, 4))):
        picture = _photograph(str(rng.choice(_PHOTOS)))
        if picture is None:
            continue
        high = int(rng.integers(90, 320))
        wide = round(high * picture.shape[1] / picture.shape[0])
        shown = cv2.resize(picture, (wide, high), interpolation=cv2.INTER_AREA)
        if rng.random() < 0.5:
            shown = shown[:, ::-1]
        top = int(rng.integers(0, 2 * UPWARD - high + 1))
        columns = (int(rng.integers(0, AROUND)) + np.arange(wide)) % AROUND
        plane[top : top + high, columns] = shown * np.float32(rng.uniform(0.5, 1.0))
    plane *= np.float32(0.25 / max(float(plane.mean()), 1e-3))
    soft = float(rng.uniform(0.0, 2.0))
    plane = np.concatenate([plane, plane[:, :EXTRA]], axis=1)
    if soft > 0.4:
        plane = cv2.GaussianBlur(plane, (0, 0), soft)
    return np.ascontiguousarray(np.clip(plane, 0.0, 4.0), np.float32)
