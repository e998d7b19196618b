"""Pictures of landmarks at known places, for the tests of seeing."""

from __future__ import annotations

import math
from collections.abc import Sequence

import cv2
import numpy as np
import skimage.data

from polepilot.core.geometry import Point, Pose2D
from polepilot.core.landmark import Landmark, LandmarkKind
from polepilot.core.observation import Image
from polepilot.core.sim.render import Look, Renderer
from polepilot.core.vehicle import Camera

CAMERA = Camera()
HERE = Pose2D(0.0, 0.0, 0.0)


def room(half: float) -> list[tuple[Point, Point]]:
    """Four walls round the origin, ``half`` metres away."""
    corners: list[Point] = [(-half, -half), (half, -half), (half, half), (-half, half)]
    return list(zip(corners, corners[1:] + corners[:1], strict=True))


def pole(number: int, away: float, bearing: float, kind: LandmarkKind | None = None) -> Landmark:
    """A pole seen from the origin, looking along x."""
    place = away * math.cos(bearing), away * math.sin(bearing)
    return Landmark(number, *place, kind or LandmarkKind())


def picture(
    poles: Sequence[Landmark],
    seed: int = 0,
    *,
    walls: Sequence[tuple[Point, Point]] | None = None,
    pan_rate: float = 0.0,
    look: Look | None = None,
) -> Image:
    """What the camera at the origin sees."""
    walls = room(20.0) if walls is None else walls
    rng = np.random.default_rng(seed)
    return Renderer(CAMERA, poles, walls, rng, look).render(HERE, pan_rate)


def jpeg(image: Image, quality: int = 85) -> Image:
    """The picture as a webcam would send it."""
    _, data = cv2.imencode(".jpg", image, [cv2.IMWRITE_JPEG_QUALITY, quality])
    return np.asarray(cv2.imdecode(data, cv2.IMREAD_COLOR), np.uint8)


def photographs(count: int, seed: int) -> list[Image]:
    """Pieces of real photographs (wood, a cat, an orange space suit, a rocket), 400x300."""
    rng = np.random.default_rng(seed)
    sources = [
        cv2.cvtColor(load(), cv2.COLOR_RGB2BGR)
        for load in (
            skimage.data.coffee,
            skimage.data.chelsea,
            skimage.data.astronaut,
            skimage.data.rocket,
        )
    ]
    pieces = []
    for index in range(count):
        source = sources[index % len(sources)]
        height = int(rng.integers(150, source.shape[0] * 3 // 4))
        width = min(height * 4 // 3, source.shape[1])
        y = int(rng.integers(0, source.shape[0] - height + 1))
        x = int(rng.integers(0, source.shape[1] - width + 1))
        piece = cv2.resize(source[y : y + height, x : x + width], (400, 300))
        noise = rng.normal(0, 2, piece.shape)
        pieces.append(np.clip(piece + noise, 0, 255).astype(np.uint8))
    return pieces
