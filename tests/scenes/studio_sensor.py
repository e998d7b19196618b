"""From light to the bytes of a picture: exposure, sensor, tone, sharpening, JPEG."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray
from scenes.studio_light import Floats, Rng

from polepilot.core.observation import Image


@dataclass(frozen=True, slots=True)
class Sensor:
    """How a camera turns light into grey levels."""

    gains: NDArray[np.float64]
    """White balance and exposure, red, green, blue."""
    electrons: float = 4000.0
    """Photo-electrons of a pixel that is just not saturated: few mean much noise."""
    read_noise: float = 0.001
    """Standard deviation, as a share of saturation."""
    vignetting: float = 0.0
    """By how much the corners are darker, as a share."""
    saturation: float = 1.0
    tone: str = "srgb"
    """srgb, power or curve."""
    gamma: float = 2.2
    sharpening: float = 0.0
    mosaic: bool = False
    quality: int | None = None
    """Of the JPEG; None: no JPEG."""
    subsampled: bool = False
    """The JPEG's chroma has a quarter of the pixels (4:2:0)."""


def noiseless(gains: NDArray[np.float64]) -> Sensor:
    """A sensor that adds nothing to the light."""
    return Sensor(gains, electrons=1e12, read_noise=0.0)


def develop(light: Floats, sensor: Sensor, rng: Rng) -> Image:
    """Linear light (rows x columns x RGB) to a picture (rows x columns x BGR)."""
    rows, columns = light.shape[:2]
    value = light * sensor.gains.astype(np.float32)
    if sensor.vignetting:
        y = (np.arange(rows, dtype=np.float32) - (rows - 1) / 2)[:, None]
        x = np.arange(columns, dtype=np.float32) - (columns - 1) / 2
        radius = (x**2 + y**2) / ((rows / 2) ** 2 + (columns / 2) ** 2)
        value *= (1 - sensor.vignetting * radius)[..., None]
    if sensor.mosaic:
        value = _mosaic(value, sensor, rng)
    else:
        spread = np.sqrt(np.maximum(value, 0) / sensor.electrons + sensor.read_noise**2)
        value = value + spread * rng.standard_normal(value.shape, np.float32)
    value = np.clip(value, 0.0, 1.0)
    if sensor.saturation != 1.0:
        grey = value @ np.array([0.25, 0.6, 0.15], np.float32)
        value = grey[..., None] + sensor.saturation * (value - grey[..., None])
        value = np.clip(value, 0.0, 1.0)
    grey_levels = 255.0 * _tone(value, sensor)
    if sensor.sharpening:
        soft = cv2.GaussianBlur(grey_levels, (0, 0), 1.0)
        grey_levels = grey_levels + sensor.sharpening * (grey_levels - soft)
    image = np.clip(np.rint(grey_levels[..., ::-1]), 0, 255).astype(np.uint8)
    image = np.ascontiguousarray(image)
    return _jpeg(image, sensor) if sensor.quality is not None else image


def _tone(value: Floats, sensor: Sensor) -> Floats:
    # Looked up along the square root: the curve is steep where it is dark.
    levels = _curve_at(np.linspace(0.0, 1.0, 32768) ** 2, sensor).astype(np.float32)
    return np.asarray(levels[(np.sqrt(value) * 32767 + 0.5).astype(np.uint16)])


def _curve_at(value: NDArray[np.float64], sensor: Sensor) -> NDArray[np.float64]:
    if sensor.tone == "power":
        return np.asarray(value ** (1 / sensor.gamma))
    curve = np.where(value <= 0.0031308, 12.92 * value, 1.055 * value ** (1 / 2.4) - 0.055)
    if sensor.tone == "curve":
        curve = 0.8 * curve + 0.2 * curve**2 * (3 - 2 * curve)
    return np.asarray(curve)


def _mosaic(value: Floats, sensor: Sensor, rng: Rng) -> Floats:
    """One colour per pixel (red, green / green, blue), the others from the neighbours."""
    raw = np.empty(value.shape[:2], np.float32)
    raw[0::2, 0::2] = value[0::2, 0::2, 0]
    raw[0::2, 1::2] = value[0::2, 1::2, 1]
    raw[1::2, 0::2] = value[1::2, 0::2, 1]
    raw[1::2, 1::2] = value[1::2, 1::2, 2]
    spread = np.sqrt(np.maximum(raw, 0) / sensor.electrons + sensor.read_noise**2)
    raw += spread * rng.standard_normal(raw.shape, np.float32)
    counts = np.clip(np.rint(raw * 60000.0) + 500, 0, 65535).astype(np.uint16)
    counts = np.minimum(counts, np.uint16(60500))
    full = np.asarray(cv2.cvtColor(counts, cv2.COLOR_BayerRGGB2RGB), np.float32)
    return np.asarray((full - 500) / 60000.0)


def _jpeg(image: Image, sensor: Sensor) -> Image:
    how = [cv2.IMWRITE_JPEG_QUALITY, int(sensor.quality or 0), cv2.IMWRITE_JPEG_SAMPLING_FACTOR]
    how.append(
        cv2.IMWRITE_JPEG_SAMPLING_FACTOR_420
        if sensor.subsampled
        else cv2.IMWRITE_JPEG_SAMPLING_FACTOR_444
    )
    _, data = cv2.imencode(".jpg", image, how)
    return np.asarray(cv2.imdecode(data, cv2.IMREAD_COLOR), np.uint8)
