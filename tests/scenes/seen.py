"""What the eye's kernel has seen, computed once more in Python for the figures of docs/vision.md.

The kernel answers with a `Strip` and keeps the rest to itself. Signal and straightened light are
short enough to repeat (native/eye.h, upright.c); places and sizes are the strip's own, and only the
levels of light that belong to them are fitted anew.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from polepilot.core.landmark import LandmarkKind
from polepilot.core.observation import Image
from polepilot.core.vehicle import Camera
from polepilot.core.vision.kernel import Kernel, Strip

Floats = NDArray[np.floating[Any]]

_WEIGHTS = (29, 150, 77)
_FAINTEST = 16
_HALF_LIGHT = 0.60
_CELLS = 400


def strips_of(image: Image, camera: Camera, kind: LandmarkKind) -> list[Strip]:
    """The strips that the kernel has read."""
    kinds = dict.fromkeys(range(1, 2**kind.bits), kind)
    return [strip for strip in Kernel(kinds, camera.constant).look(image) if not strip.reason]


def linear(image: Image) -> Floats:
    """Grey levels as linear light, 0 to 1 (sRGB)."""
    grey = image / 255.0
    return np.asarray(np.where(grey <= 0.04045, grey / 12.92, ((grey + 0.055) / 1.055) ** 2.4))


def grey_levels(light: Floats) -> Image:
    """Linear light as grey levels (sRGB)."""
    light = np.clip(light, 0.0, 1.0)
    grey = np.where(light <= 0.0031308, 12.92 * light, 1.055 * light ** (1 / 2.4) - 0.055)
    return np.asarray(np.rint(255 * grey), np.uint8)


def signal(image: Image) -> NDArray[np.int64]:
    """How bright the paint's colour is, by pixel, grey levels: brightness where there is colour."""
    wide = image.astype(np.int64)
    brightness = (wide @ np.array(_WEIGHTS)) >> 4
    value = (3 * brightness) >> 5
    color = (6 * wide[..., 2] - 7 * wide[..., 0]) // 4
    return np.asarray(np.clip(np.minimum(color, value) - _FAINTEST, 0, 255))


def runs(column: NDArray[np.int64]) -> list[tuple[float, float]]:
    """Bright runs of a column, from and to (rows): where the signal exceeds half of the light."""
    lit = column > _HALF_LIGHT * np.percentile(column[column > 0], 75)
    edges = np.flatnonzero(np.diff(np.concatenate([[0], lit.astype(np.int8), [0]])))
    return [(float(a) - 0.5, float(b) - 0.5) for a, b in zip(edges[::2], edges[1::2], strict=True)]


def straightened(image: Image, strip: Strip, half: float) -> Floats:
    """Linear light (rows x columns x BGR) ``half`` columns to both sides of the upright strip."""
    light = linear(image)
    reach = np.arange(-math.ceil(half), math.ceil(half) + 1)
    rows = np.arange(image.shape[0])
    middle = strip.column + strip.lean * (rows - strip.row)
    place = middle[:, None] + reach[None, :]
    left = np.clip(np.floor(place).astype(int), 0, image.shape[1] - 2)
    part = np.clip(place - left, 0.0, 1.0)[..., None]
    at = rows[:, None]
    return np.asarray((1 - part) * light[at, left] + part * light[at, left + 1])


def place_of(strip: Strip, segments: Floats) -> Floats:
    """Rows of boundaries ``segments`` below the code's middle."""
    return np.asarray(strip.row + strip.unit * segments / (1 + strip.sag * segments))


@dataclass(frozen=True, slots=True, eq=False)
class CodeFit:
    """A code's light by row: what the model makes of it, and what is left over."""

    rows: Floats
    light: Floats
    model: Floats
    rest: float
    """Root of the mean square, as a share of bright minus dark."""


def fit_code(light: Floats, strip: Strip) -> CodeFit:
    """Levels of light for the strip's own places: above, bright, dark (each with a tilt), below.

    ``light`` is by row of the picture. By how much bright segments grow (glare, tone curve) is the
    one thing besides that the strip does not tell; the best of a few is taken.
    """
    code = strip.code.decode()
    half = len(code) / 2
    margin = 1.5 * strip.blur + 2
    first = max(math.ceil(strip.row - half * strip.unit - margin), 0)
    last = min(math.floor(strip.row + half * strip.unit + margin), len(light) - 1)
    rows = np.arange(first, last + 1, dtype=float)
    kept = light[first : last + 1]
    fits = [_levels(rows, kept, strip, code, growth) for growth in np.linspace(-0.3, 0.3, 25)]
    model, step = min(fits, key=lambda one: float(np.sum((kept - one[0]) ** 2)))
    return CodeFit(rows, kept, model, float(np.sqrt(np.mean((kept - model) ** 2)) / step))


def _levels(
    rows: Floats, light: Floats, strip: Strip, code: str, growth: float
) -> tuple[Floats, float]:
    half = len(code) / 2
    shares: list[Floats] = []
    before: Floats = np.ones_like(rows)
    for index in range(len(code) + 1):
        above = code[index - 1] if index else "0"
        below = code[index] if index < len(code) else "0"
        shift = growth * (int(above) - int(below))
        step = _step(rows, float(place_of(strip, np.array(index - half))) + shift, strip.blur)
        shares.append(before - step)
        before = step
    shares.append(before)
    bright = sum((s for s, c in zip(shares[1:-1], code, strict=True) if c == "1"), 0 * rows)
    dark = sum((s for s, c in zip(shares[1:-1], code, strict=True) if c == "0"), 0 * rows)
    tilt = (rows - strip.row) / (half * strip.unit)
    basis = np.stack([shares[0], bright, bright * tilt, dark, dark * tilt, shares[-1]], axis=1)
    levels = np.linalg.lstsq(basis, light, rcond=None)[0]
    return basis @ levels, float(levels[1] - levels[3])


def _step(rows: Floats, place: float, blur: float) -> Floats:
    """A blurred step as pixels see it: the mean over each row."""
    fine = (np.arange(8) + 0.5) / 8 - 0.5
    z = (rows[:, None] + fine - place) / blur
    return np.asarray(0.5 * np.vectorize(math.erfc)(-z / math.sqrt(2)).mean(axis=1))


@dataclass(frozen=True, slots=True, eq=False)
class SideFit:
    """Bright minus dark by column: what a lit cylinder makes of it."""

    columns: Floats
    light: Floats
    fine: Floats
    """Columns at which ``model`` is given."""
    model: Floats
    surface: Floats
    """The light on the cylinder itself, before lens and pixels; 0 beside it."""


def across(image: Image, strip: Strip, reach: float) -> tuple[Floats, Floats]:
    """Columns and light of the paint's colour there: bright segments minus dark ones."""
    light = linear(image)
    color = light[..., 2] - light[..., 0]
    code = strip.code.decode()
    half = len(code) / 2
    columns = np.arange(math.floor(strip.column - reach), math.ceil(strip.column + reach) + 1)
    total = {"0": np.zeros(len(columns)), "1": np.zeros(len(columns))}
    count = {"0": 0, "1": 0}
    for index, bit in enumerate(code):
        low, high = place_of(strip, np.array([index - half + 0.3, index - half + 0.7]))
        for row in range(math.ceil(low), math.floor(high) + 1):
            place = columns + strip.lean * (row - strip.row)
            total[bit] += np.interp(place, np.arange(image.shape[1]), color[row])
            count[bit] += 1
    return columns.astype(float), total["1"] / count["1"] - total["0"] / count["0"]


def fit_side(columns: Floats, light: Floats, strip: Strip) -> SideFit:
    """Lambert's law on a cylinder, a + b u + c sqrt(1 - u²), for the strip's middle and width."""
    u = (np.arange(_CELLS) + 0.5) / _CELLS * 2 - 1
    basis = np.stack([np.ones_like(u), u, np.sqrt(1 - u**2)], axis=1)
    place = strip.column + u * strip.width / 2
    cell = strip.width / _CELLS
    best: tuple[float, Floats, Floats] | None = None
    for blur in np.linspace(0.25, 1.5, 26):
        seen = _seen(columns, place, blur, cell) @ basis
        levels = np.linalg.lstsq(seen, light, rcond=None)[0]
        off = float(np.sum((seen @ levels - light) ** 2))
        if best is None or off < best[0]:
            fine = np.linspace(columns[0], columns[-1], 300)
            best = off, levels, _seen(fine, place, blur, cell) @ basis @ levels
    assert best is not None
    fine = np.linspace(columns[0], columns[-1], 300)
    inner = (fine - strip.column) / (strip.width / 2)
    on = np.abs(inner) < 1
    surface = np.zeros_like(fine)
    surface[on] = (
        np.stack([np.ones(on.sum()), inner[on], np.sqrt(1 - inner[on] ** 2)], axis=1) @ best[1]
    )
    return SideFit(columns, light, fine, best[2], surface)


def _seen(columns: Floats, place: Floats, blur: float, cell: float) -> Floats:
    """What each column gets of each cell of the surface."""
    total: Floats = np.zeros((len(columns), len(place)))
    for part in (np.arange(4) + 0.5) / 4 - 0.5:
        z = (columns[:, None] + part - place[None, :]) / blur
        total += np.exp(-0.5 * z * z)
    return total * cell / (4 * blur * math.sqrt(2 * math.pi))
