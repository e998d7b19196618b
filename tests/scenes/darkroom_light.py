"""The darkroom's light: lamps, paints and sensors as spectra, colours as three numbers after that.

A surface has a reflectance, a lamp a spectrum, the sensor three sensitivities; what the sensor
sees is the sum over wavelengths of their product. For surfaces given as red, green and blue only
(photographs) the same sum becomes a 3x3 matrix. All triples are in OpenCV's order: blue, green,
red.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

WAVE: Array = np.arange(400.0, 701.0, 10.0)
"""Nanometres."""

_NEUTRAL = 5000.0
"""The colour temperature that the camera's colour matrix was made for, kelvin."""


def _bell(center: float, width: float) -> Array:
    return np.asarray(np.exp(-(((WAVE - center) / width) ** 2) / 2))


def _step(center: float, width: float) -> Array:
    return np.asarray(1 / (1 + np.exp(-(WAVE - center) / width)))


SENSOR: Array = np.stack(
    [
        _bell(458, 27) + 0.04 * _bell(540, 40),
        _bell(535, 36) + 0.06 * _bell(620, 30),
        _bell(605, 34) + 0.05 * _bell(470, 30),
    ]
)
"""Sensitivities of the blue, green and red pixels."""

_RED = _step(588, 8)
_BLUE = 1 - _step(495, 10)
_BASIS = np.stack([_BLUE, 1 - _RED - _BLUE, _RED])


def planck(temperature: float) -> Array:
    """A black body's spectrum over `WAVE`, its mean 1."""
    metres = WAVE * 1e-9
    power = metres**-5 / np.expm1(0.014388 / (metres * temperature))
    return np.asarray(power / power.mean())


def lamp(temperature: float, kind: str) -> Array:
    """A lamp's spectrum: ``thermal``, ``led`` (blue peak and phosphor) or ``tube`` (lines)."""
    body = planck(temperature)
    if kind == "thermal":
        return body
    cool = np.clip((temperature - 2500) / 4500, 0, 1)
    if kind == "led":
        other = (0.5 + 1.6 * cool) * _bell(450, 11) + _bell(590 - 35 * cool, 58)
    else:
        other = 0.25 * body + (0.5 + 1.2 * cool) * _bell(436, 9) + 1.1 * _bell(546, 9)
        other = other + (1.4 - 0.6 * cool) * _bell(611, 10) + 0.25 * _bell(488, 9)
    return np.asarray(0.35 * body + 0.65 * other / other.mean())


@dataclass(frozen=True, slots=True)
class Light:
    """One lamp as one camera sees it, and what that camera makes of it."""

    matrix: Array
    """Blue, green and red of a surface to the sensor's three; white under it gives green 1."""
    orange: Array
    """The sensor's three for the bright paint in full light."""
    black: Array
    gains: Array
    """White balance: what the sensor's three are multiplied by, the least of them 1."""
    correction: Array
    """From balanced sensor values to the blue, green and red of a screen (linear)."""
    white: Array
    """The sensor's three for a white surface, for highlights."""
    note: str

    def seen(self, sensor: Array) -> Array:
        """The screen's linear blue, green and red for values of the sensor (..., 3)."""
        return np.asarray((sensor * self.gains) @ self.correction.T)


def draw_light(rng: np.random.Generator, drift: float) -> Light:
    """A lamp of 2700 to 7500 K and a white balance that follows it more or less.

    ``drift`` is the largest share of the lamp's colour that the white balance leaves in, on the
    reciprocal scale of temperature.
    """
    temperature = 1e6 / rng.uniform(1e6 / 7500, 1e6 / 2700)
    kind = str(rng.choice(["thermal", "led", "tube"], p=[0.45, 0.4, 0.15]))
    spectrum = lamp(temperature, kind)
    raw = SENSOR * spectrum
    white = raw.sum(axis=1)
    raw = raw / white[1]
    matrix = raw @ _BASIS.T

    left = rng.uniform(0, drift)
    mired = 1e6 / temperature
    believed = mired + left * (1e6 / _NEUTRAL - mired) + rng.normal(0, 40 * drift)
    guess = (SENSOR * lamp(1e6 / np.clip(believed, 110, 400), kind)).sum(axis=1)
    tint = np.array([1.0, 1 + rng.normal(0, 0.06 * drift), 1.0])
    gains = tint * guess[1] / guess
    gains = gains / gains.min()

    reference = SENSOR * planck(_NEUTRAL)
    balanced = (reference / reference.sum(axis=1, keepdims=True)) @ _BASIS.T
    strength = rng.uniform(0.55, 1.0)
    correction = (1 - strength) * np.eye(3) + strength * np.linalg.inv(balanced)

    edge, top = rng.uniform(556, 588), rng.uniform(0.55, 0.8)
    foot = rng.uniform(0.025, 0.05)
    orange = foot + (top - foot) * _step(edge, rng.uniform(7, 12))
    glow = rng.uniform(0, 0.25) if rng.random() < 0.25 else 0.0
    orange = orange + glow * _bell(605, 18)
    dark = rng.uniform(0.02, 0.06) * (1 + rng.uniform(-0.15, 0.15) * (WAVE - 550) / 150)
    return Light(
        matrix,
        raw @ orange,
        raw @ dark,
        gains,
        correction,
        white / white[1],
        f"{temperature:.0f} K {kind}, {left:.2f} of it left, paint from {edge:.0f} nm",
    )
