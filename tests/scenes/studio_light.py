"""Light and paint: black bodies, lamps, what a surface sends back. All colours are linear RGB."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.floating[Any]]
Rng = np.random.Generator

_WAVES = np.linspace(400e-9, 700e-9, 61)
_PEAKS = np.array([[600e-9, 36e-9], [540e-9, 38e-9], [460e-9, 28e-9]])
"""Peak and spread of the sensor's red, green and blue filters."""
_RESPONSE = np.exp(-0.5 * ((_WAVES - _PEAKS[:, :1]) / _PEAKS[:, 1:]) ** 2)


def black_body(kelvin: float) -> NDArray[np.float64]:
    """What the sensor's three filters make of a black body, as a multiple of 5500 K; green is 1."""

    def raw(temperature: float) -> NDArray[np.float64]:
        planck = _WAVES**-5 / np.expm1(0.0143878 / (_WAVES * temperature))
        return np.asarray(_RESPONSE @ planck)

    color = raw(kelvin) / raw(5500.0)
    return np.asarray(color / color[1])


@dataclass(frozen=True, slots=True)
class Lamp:
    """A distant light: where it comes from (unit vector, x ahead, y left, z up) and its colour."""

    direction: NDArray[np.float64]
    color: NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Lighting:
    """All light of a picture; flat surfaces that face the camera get about ``mean``."""

    lamps: tuple[Lamp, ...]
    ambient: NDArray[np.float64]
    lean: NDArray[np.float64]
    """By how much more ambient light comes from one side: a horizontal vector shorter than 1."""

    @property
    def mean(self) -> NDArray[np.float64]:
        """The light that an average surface gets."""
        direct = sum((0.5 * lamp.color for lamp in self.lamps), np.zeros(3))
        return np.asarray(self.ambient + direct)

    def on_vertical(self, azimuth: NDArray[np.float64]) -> NDArray[np.float64]:
        """Light on vertical surfaces whose normals point to ``azimuth`` (n): n x 3."""
        normal = np.stack([np.cos(azimuth), np.sin(azimuth)], axis=1)
        light = np.outer(1.0 + normal @ self.lean, self.ambient)
        for lamp in self.lamps:
            facing = np.maximum(normal @ lamp.direction[:2], 0.0)
            light += np.outer(facing, lamp.color)
        return light

    def on_floor(self) -> NDArray[np.float64]:
        """Light on what lies flat."""
        direct = sum((lamp.direction[2] * lamp.color for lamp in self.lamps), np.zeros(3))
        return np.asarray(self.ambient + direct)


@dataclass(frozen=True, slots=True)
class Paint:
    """The two colours of a landmark (share of the light that comes back) and how it shines."""

    bright: NDArray[np.float64]
    dark: NDArray[np.float64]
    gloss: float
    sharpness: float


def draw_lighting(
    rng: Rng, coolest: float = 7500.0, warmest: float = 2700.0, aside: float = 1.9
) -> Lighting:
    """One to three lamps of one or two temperatures, and light from all around.

    Args:
        rng: chance.
        coolest: highest temperature of a lamp, kelvin.
        warmest: lowest temperature.
        aside: how far from behind the camera lamps stand at most, radians: at more than a quarter
            turn they light the sides of what the camera sees.
    """

    def kelvin() -> float:
        return 1e6 / rng.uniform(1e6 / coolest, 1e6 / warmest)

    first, second = kelvin(), kelvin()
    lamps = []
    for index in range(int(rng.integers(1, 4))):
        azimuth = np.pi + rng.uniform(-aside, aside)
        height = rng.uniform(0.15, 1.2)
        toward = np.array(
            [np.cos(azimuth) * np.cos(height), np.sin(azimuth) * np.cos(height), np.sin(height)]
        )
        temperature = second if index and rng.random() < 0.4 else first
        lamps.append(Lamp(toward, black_body(temperature) * rng.uniform(0.3, 1.0)))
    ambient = black_body(first) * rng.uniform(0.3, 0.8)
    lean = rng.uniform(-0.3, 0.3, 2)
    lighting = Lighting(tuple(lamps), ambient, lean)
    scale = 1.0 / lighting.mean[1]
    return Lighting(
        tuple(Lamp(lamp.direction, lamp.color * scale) for lamp in lamps), ambient * scale, lean
    )


def draw_paint(rng: Rng) -> Paint:
    """Orange of some hue and strength, black that is not quite black."""
    red = rng.uniform(0.5, 0.88)
    bright = red * np.array([1.0, rng.uniform(0.11, 0.38), rng.uniform(0.01, 0.08)])
    dark = rng.uniform(0.02, 0.07) * rng.uniform(0.9, 1.1, 3)
    gloss = rng.uniform(0.01, 0.08) if rng.random() < 0.3 else 0.0
    return Paint(bright, dark, gloss, rng.uniform(15.0, 80.0))
