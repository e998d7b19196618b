"""From colours to light: one signal in which the bright paint stands out, and where it is bright.

The bright colour (orange by default) is told from black by chromaticity, red minus blue, not by
brightness: grey walls, shadows and highlights nearly vanish in it, whatever the light. Where a
monochrome camera sees a bright/dark pair, grey itself is the signal.
"""

from __future__ import annotations

import cv2
import numpy as np
from numpy.typing import NDArray

from polepilot.core.observation import Image

Floats = NDArray[np.float32]
Bytes = NDArray[np.uint8]

_NEIGHBOURHOOD = 13
"""Rows in which the brightest pixel sets the threshold."""
_BLOCK = 10
"""Rows per block of the coarse neighbourhood."""
_HALF_LIGHT = 0.70
"""Half of the light as a share of the grey level: 0.5 ** (1/2.2) = 0.73, less what black adds."""
_COARSE_SHARE = 0.25
"""Of the coarse neighbourhood's brightest: what is darker is not the bright paint."""
_RED, _BLUE = 1.5, 2.0
"""Colour = 1.5 red - 2 blue: grey stays below zero in light down to about 4000 K."""
_FAINTEST = 10
"""Grey levels of colour below which everything counts as black."""


def contrast(image: Image) -> Bytes:
    """The signal in grey levels, rows x columns: red where there is colour, or grey as it is.

    Red itself, not the difference, tells bright from black where both are orange by half: JPEG
    and cheap cameras keep brightness twice as sharp as colour.
    """
    if image.ndim == 2:
        return image
    red, blue = cv2.extractChannel(image, 2), cv2.extractChannel(image, 0)
    colour = cv2.addWeighted(red, _RED, blue, -_BLUE, 0.0)
    return np.asarray(cv2.min(red, colour), np.uint8)


def linear(patch: Image) -> Floats:
    """Red, or grey, in linear light (sRGB curve undone), 0 to 1.

    Edges are found in linear light because pixels average light, not grey levels. Red alone: the
    difference of two channels holds no brightness, which is what JPEG keeps sharp.
    """
    return _LINEAR.take(patch if patch.ndim == 2 else patch[:, :, 2], mode="clip")


def bright(signal: Bytes) -> Bytes:
    """Where the signal is at least half as bright as the brightest nearby in the same column.

    Comparing along the column finds bright and black segments in dim and in glaring light alike,
    at every distance, without knowing how bright the paint is. Returns 0 or 255 per pixel.
    """
    near = cv2.dilate(signal, np.ones((_NEIGHBOURHOOD, 1), np.uint8))
    floor = np.maximum(_coarse(signal), _FAINTEST)
    level = np.maximum(cv2.convertScaleAbs(near, alpha=_HALF_LIGHT), floor)
    return np.asarray(cv2.compare(signal, level, cv2.CMP_GT), np.uint8)


def _coarse(signal: Bytes) -> Bytes:
    """A share of the brightest value within about half of the picture's height, per pixel."""
    rows, columns = signal.shape
    blocks = -(-rows // _BLOCK)
    padded = signal
    if blocks * _BLOCK != rows:
        padded = np.zeros((blocks * _BLOCK, columns), np.uint8)
        padded[:rows] = signal
    peak = padded.reshape(blocks, _BLOCK, columns).max(axis=1)
    reach = blocks // 2 | 1
    widest = cv2.dilate(peak, np.ones((reach, 1), np.uint8))
    share = np.asarray(cv2.convertScaleAbs(widest, alpha=_COARSE_SHARE), np.uint8)
    return np.repeat(share, _BLOCK, axis=0)[:rows]


def _linear_table() -> Floats:
    grey = np.arange(256) / 255
    curve = np.where(grey <= 0.04045, grey / 12.92, ((grey + 0.055) / 1.055) ** 2.4)
    return curve.astype(np.float32)


_LINEAR = _linear_table()
