"""Pictures of landmarks that stand where the caller wants them, with the studio's means.

The studio draws everything by lot. Here poles and camera are given, and the light if it matters;
room, paint and sensor are drawn like those of the studio's clean pictures.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import cv2
import numpy as np
from scenes.studio_light import Floats, Lighting, Paint, Rng, draw_lighting
from scenes.studio_optics import Eye, Pole, see
from scenes.studio_room import room
from scenes.studio_sensor import Sensor, develop

from polepilot.core.observation import Image
from polepilot.core.vehicle import Camera

ORANGE = Paint(np.array([0.75, 0.20, 0.03]), np.array([0.035, 0.035, 0.035]), 0.0, 30.0)
"""A usual paint."""


def posed(
    poles: Sequence[Pole],
    eye: Eye,
    seed: int,
    *,
    lighting: Lighting | None = None,
    plain: bool = False,
    behind: Callable[[Floats], None] | None = None,
) -> Image:
    """A room with these poles, none in front of another.

    Args:
        poles: what stands in it.
        eye: the camera.
        seed: of everything that is not given.
        lighting: the light; default: drawn.
        plain: a sensor that is simply good: no mosaic, no sharpening, no JPEG.
        behind: paints things into the light of the room (rows x columns x RGB), in place.
    """
    rng = np.random.default_rng([2_255, seed])
    if lighting is None:
        lighting = draw_lighting(rng, 6500.0, 2900.0, 1.5)
    farthest = max((pole.range for pole in poles), default=6.0)
    picture = room(eye, rng, lighting, poles, farthest + rng.uniform(0.5, 4.0))
    if behind is not None:
        behind(picture)
    picture = np.asarray(cv2.GaussianBlur(picture, (0, 0), eye.blur), np.float32)
    for pole in sorted(poles, key=lambda one: -one.range):
        see(pole, eye, lighting).onto(picture)
    return develop(picture, _sensor(picture, lighting, plain, rng), rng)


def camera_of(eye: Eye) -> Camera:
    """The camera that a detector is told of."""
    return Camera(
        constant=eye.constant,
        width=eye.width,
        height=eye.height,
        center_x=eye.center[0],
        center_y=eye.center[1],
    )


def _sensor(picture: Floats, lighting: Lighting, plain: bool, rng: Rng) -> Sensor:
    light = lighting.mean
    gains = light ** -rng.uniform(0.75, 1.0) * np.exp(rng.normal(0, 0.04, 3))
    usual = float((picture @ np.array([0.25, 0.6, 0.15], np.float32)).mean())
    exposure = rng.uniform(0.13, 0.3) / (0.5 * usual + 0.1 * float(light[1]))
    electrons, read_noise = rng.uniform(2500, 8000), rng.uniform(0.0005, 0.002)
    vignetting, saturation = rng.uniform(0.0, 0.3), rng.uniform(0.9, 1.25)
    tone, gamma = str(rng.choice(["srgb", "power", "curve"])), rng.uniform(2.0, 2.4)
    sharpened, mosaic, compressed, halved = rng.random(4) < (0.3, 0.2, 0.15, 0.4)
    return Sensor(
        gains / gains[1] * exposure,
        electrons,
        read_noise,
        vignetting,
        saturation,
        tone="srgb" if plain else tone,
        gamma=gamma,
        sharpening=rng.uniform(0.2, 0.7) if sharpened and not plain else 0.0,
        mosaic=bool(mosaic) and not plain,
        quality=int(rng.integers(85, 96)) if compressed and not plain else None,
        subsampled=bool(halved),
    )
