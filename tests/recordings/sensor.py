"""From light to the bytes of a picture: lens, exposure, noise, tone, sharpening, JPEG."""

from __future__ import annotations

import cv2
import numpy as np
from numpy.typing import NDArray
from recordings.scenario import Rng

Floats = NDArray[np.float32]
BANK = 1 << 21
"""Noise is drawn once; each picture takes it from another place."""


class Film:
    """A camera's sensor and processing, the same for all pictures of a recording."""

    def __init__(self, rng: Rng, tint: NDArray[np.float64]) -> None:
        balance = float(rng.uniform(0.6, 1.0))
        gains = (float(tint[1]) / tint) ** balance * rng.uniform(0.97, 1.03, 3)
        self._gains = (gains / float(tint[1])).astype(np.float32)
        self._target = float(rng.uniform(0.16, 0.32))
        self._lens = float(rng.uniform(0.35, 0.65))
        self._electrons = float(rng.uniform(1500.0, 6000.0))
        self._dark = float(rng.uniform(0.001, 0.003))
        self._sharpen = float(rng.uniform(0.2, 0.6)) if rng.random() < 0.4 else 0.0
        self._quality = int(rng.integers(85, 98))
        self._subsampled = bool(rng.random() < 0.33)
        self._noise = rng.standard_normal(BANK, np.float32)
        level = np.arange(65536) / 65535
        curve = np.where(level <= 0.0031308, 12.92 * level, 1.055 * level ** (1 / 2.4) - 0.055)
        self._curve = np.rint(255 * curve).astype(np.uint8)

    def develop(self, light: Floats, rng: Rng) -> NDArray[np.uint8]:
        """The picture of a moment's light."""
        light = cv2.GaussianBlur(light, (5, 5), self._lens)
        # The exposure follows the picture's brightness, but not all the way.
        bright = float((light[::12, ::12] * self._gains).mean())
        gain = min(self._target / max(bright, 0.02) ** 0.7 / 0.25**0.3, 1.1)
        value = light * (self._gains * np.float32(gain))
        first = int(rng.integers(0, BANK - value.size))
        noise = self._noise[first : first + value.size].reshape(value.shape)
        spread = np.sqrt(value * np.float32(1 / self._electrons) + np.float32(self._dark**2))
        spread *= noise
        value += spread
        np.clip(value, 0.0, 1.0, out=value)
        value *= np.float32(65535)
        image = self._curve[value.astype(np.uint16)]
        if self._sharpen:
            soft = cv2.GaussianBlur(image, (0, 0), 1.0)
            image = cv2.addWeighted(image, 1 + self._sharpen, soft, -self._sharpen, 0)
        sampling = (
            cv2.IMWRITE_JPEG_SAMPLING_FACTOR_420
            if self._subsampled
            else cv2.IMWRITE_JPEG_SAMPLING_FACTOR_444
        )
        how = [cv2.IMWRITE_JPEG_QUALITY, self._quality]
        how += [cv2.IMWRITE_JPEG_SAMPLING_FACTOR, sampling]
        _, data = cv2.imencode(".jpg", image, how)
        return np.asarray(cv2.imdecode(data, cv2.IMREAD_COLOR), np.uint8)
