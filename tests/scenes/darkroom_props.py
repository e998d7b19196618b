"""The darkroom's properties: pumpkins, cones, coats and other orange things, and traps.

Things are drawn on the plane of a `Stage` at a foot (plane position) with a scale (plane pixels a
metre). Traps are drawn where no landmark stands: whatever has orange and black in rows.
"""

from __future__ import annotations

from collections.abc import Callable

import cv2
import numpy as np
from numpy.typing import NDArray
from scenes.darkroom_photos import orange
from scenes.darkroom_stage import Stage, grain

Array = NDArray[np.float64]


def _at(foot: Array, scale: float, points: list[tuple[float, float]]) -> Array:
    """Metres right and up of the foot to plane positions."""
    return np.array([[foot[0] + scale * x, foot[1] - scale * y] for x, y in points])


def pumpkin(rng: np.random.Generator, stage: Stage, foot: Array, scale: float) -> None:
    """Ribs, a stem, a shine."""
    color = orange(rng, 0.95)
    wide, high = rng.uniform(0.15, 0.32), rng.uniform(0.12, 0.25)
    light = rng.uniform(-0.8, 0.8)
    stage.darken(_ring(foot, scale * wide * 1.2, scale * 0.05), 0.5, 2.0)
    for offset in (-0.75, 0.75, -0.45, 0.45, 0.0):
        center = (foot[0] + scale * wide * offset, foot[1] - scale * high)
        radii = (scale * wide * 0.45, scale * high * (1.05 - 0.2 * abs(offset)))
        stage.lit_ellipse(center, radii, color * rng.uniform(0.85, 1.05), light, 0.15)
    stem = _at(foot, scale, [(-0.02, 2 * high), (0.02, 2 * high), (0.04, 2 * high + 0.07)])
    stage.spot(stem, [0.04, 0.15, 0.1])


def _ring(foot: Array, across: float, down: float) -> Array:
    angle = np.linspace(0, 2 * np.pi, 24, endpoint=False)
    return np.stack([foot[0] + across * np.cos(angle), foot[1] + down * np.sin(angle)], axis=1)


def cone(rng: np.random.Generator, stage: Stage, foot: Array, scale: float) -> None:
    """A traffic cone with bright (seldom dark) bands."""
    color = orange(rng, 0.95)
    high, wide = rng.uniform(0.3, 0.9), rng.uniform(0.08, 0.17)
    band = np.full(3, 0.8 if rng.random() < 0.8 else 0.03)
    stage.spot(
        _at(
            foot,
            scale,
            [(-1.4 * wide, 0), (1.4 * wide, 0), (1.3 * wide, 0.04), (-1.3 * wide, 0.04)],
        ),
        color * 0.7,
    )
    levels = np.sort(rng.uniform(0.3, 0.95, 4)) if rng.random() < 0.5 else [0.35, 0.5, 0.62, 0.76]
    cuts = [0.03, *levels, 1.0]
    strips = 8
    for k in range(strips):
        left, right = -1 + 2 * k / strips, -1 + 2 * (k + 1) / strips
        bright = 0.45 + 0.55 * float(np.clip(0.7 + 0.5 * np.sin(left + 1.5), 0, 1))
        for i in range(5):
            a, b = cuts[i], cuts[i + 1]
            wa, wb = wide * (1 - 0.85 * a), wide * (1 - 0.85 * b)
            quad = [
                (left * wa, a * high),
                (right * wa, a * high),
                (right * wb, b * high),
                (left * wb, b * high),
            ]
            stage.spot(_at(foot, scale, quad), (band if i % 2 else color) * bright)


def coat(rng: np.random.Generator, stage: Stage, foot: Array, scale: float) -> None:
    """A person's back in a work jacket, without the person's finer points."""
    color = orange(rng, 0.85)
    lean = rng.uniform(-0.05, 0.05)
    trousers = np.array([0.05, 0.04, 0.04]) + rng.uniform(0, 0.15, 3)
    stage.spot(
        _at(
            foot,
            scale,
            [(-0.2, 0), (-0.02, 0), (0.0, 0.7), (0.02, 0), (0.2, 0), (0.22, 0.85), (-0.22, 0.85)],
        ),
        trousers,
    )
    body = [
        (-0.24, 0.75),
        (0.24, 0.75),
        (0.26 + lean, 1.3),
        (0.12 + lean, 1.48),
        (-0.12 + lean, 1.48),
        (-0.26 + lean, 1.3),
    ]
    stage.spot(_at(foot, scale, body), color)
    for side in (-1, 1):
        stage.spot(
            _at(
                foot,
                scale,
                [(side * 0.24, 1.35), (side * 0.36, 0.8), (side * 0.28, 0.78), (side * 0.19, 1.2)],
            ),
            color * 0.85,
        )
    if rng.random() < 0.6:
        strip = np.array([0.55, 0.8, 0.75]) * rng.uniform(0.5, 1.1)
        for z in (0.9, 1.1):
            stage.spot(
                _at(foot, scale, [(-0.245, z), (0.245, z), (0.25, z + 0.05), (-0.25, z + 0.05)]),
                strip,
            )
    for _ in range(5):
        x, z = rng.uniform(-0.18, 0.18), rng.uniform(0.8, 1.35)
        stage.darken(
            _at(foot, scale, [(x, z), (x + 0.03, z + 0.02), (x + 0.06, z - 0.2)]),
            0.35,
            max(scale * 0.01, 0.8),
        )


def flowers(rng: np.random.Generator, stage: Stage, foot: Array, scale: float) -> None:
    """A bush with blossoms."""
    for _ in range(24):
        x, z = rng.normal(0, 0.16), abs(rng.normal(0.25, 0.2))
        leaf = np.array([0.03, rng.uniform(0.06, 0.25), rng.uniform(0.02, 0.1)])
        center = (foot[0] + scale * x, foot[1] - scale * z)
        stage.lit_ellipse(center, (scale * 0.06, scale * 0.045), leaf, 0.4)
    color = orange(rng, 0.7)
    for _ in range(int(rng.integers(8, 30))):
        x, z = rng.normal(0, 0.18), abs(rng.normal(0.35, 0.2))
        size = rng.uniform(0.015, 0.045)
        center = (foot[0] + scale * x, foot[1] - scale * z)
        stage.lit_ellipse(center, (scale * size, scale * size), color * rng.uniform(0.8, 1.2), -0.3)
        stage.lit_ellipse(center, (scale * size / 3,) * 2, [0.03, 0.1, 0.2], -0.3)


def board(rng: np.random.Generator, stage: Stage, foot: Array, scale: float) -> None:
    """A plank, a crate or a sheet in one colour, standing right there."""
    color = orange(rng, 0.9)
    wide, high = rng.uniform(0.08, 0.7), rng.uniform(0.3, 1.3)
    lean = rng.uniform(-0.15, 0.15) if rng.random() < 0.4 else 0.0
    stage.spot(
        _at(
            foot,
            scale,
            [(-wide / 2, 0), (wide / 2, 0), (wide / 2 + lean, high), (-wide / 2 + lean, high)],
        ),
        color,
    )
    if rng.random() < 0.4:
        for z in np.arange(0.1, high, 0.18):
            quad = [(-wide / 2, z), (wide / 2, z), (wide / 2, z + 0.02), (-wide / 2, z + 0.02)]
            stage.spot(_at(foot, scale, quad), color * 0.4)


def balls(rng: np.random.Generator, stage: Stage, foot: Array, scale: float) -> None:
    """Balls or oranges in a heap."""
    size = rng.uniform(0.04, 0.13)
    color = orange(rng, 0.9)
    for row in range(3):
        for k in range(int(rng.integers(1, 4))):
            center = (
                foot[0] + scale * size * (2 * k - 2 + row + rng.normal(0, 0.1)),
                foot[1] - scale * size * (1 + 1.7 * row),
            )
            stage.lit_ellipse(center, (scale * size,) * 2, color, rng.uniform(-0.6, 0.6), 0.4)


def extinguisher(rng: np.random.Generator, stage: Stage, foot: Array, scale: float) -> None:
    """A red or orange bottle with a black head."""
    color = orange(rng, 0.4)
    for k in range(8):
        a, b = -0.08 + 0.02 * k, -0.08 + 0.02 * (k + 1)
        bright = 0.4 + 0.6 * np.cos((k - 2.5) / 8 * 2.5)
        stage.spot(_at(foot, scale, [(a, 0), (b, 0), (b, 0.45), (a, 0.45)]), color * bright)
    stage.spot(
        _at(foot, scale, [(-0.05, 0.45), (0.05, 0.45), (0.03, 0.56), (-0.03, 0.56)]), [0.03] * 3
    )


Thing = Callable[[np.random.Generator, Stage, Array, float], None]
THINGS: tuple[Thing, ...] = (pumpkin, cone, coat, flowers, board, balls, extinguisher)


def hang(rng: np.random.Generator, stage: Stage, foot: Array, scale: float) -> None:
    """An orange curtain or banner that goes up out of the picture, in folds."""
    color = orange(rng, 0.9)
    wide = rng.uniform(0.2, 1.5)
    strips = int(rng.integers(6, 20))
    phase = rng.uniform(0, 6)
    for k in range(strips):
        a, b = wide * (k / strips - 0.5), wide * ((k + 1) / strips - 0.5)
        bright = 0.75 + 0.25 * np.sin(phase + 1.9 * k)
        stage.spot(_at(foot, scale, [(a, 0.02), (b, 0.02), (b, 4.0), (a, 4.0)]), color * bright)


# What has orange and dark in rows, and is no landmark.


def stripes(rng: np.random.Generator, stage: Stage) -> None:
    """A field of straight stripes at any angle: barrier board, tape, shutters, jersey."""
    high, wide = stage.shape
    x0, y0 = rng.uniform(-0.1, 0.8) * wide, rng.uniform(-0.1, 0.8) * high
    across, down = rng.uniform(0.02, 0.7) * wide, rng.uniform(0.1, 0.9) * high
    if rng.random() < 0.4:
        across, down = down * 1.4, across * 0.5
    tilt = rng.uniform(-0.3, 0.3) if rng.random() < 0.5 else 0.0
    c, s = np.cos(tilt), np.sin(tilt)
    box = np.array([[0, 0], [across, 0], [across, down], [0, down]]) @ np.array([[c, s], [-s, c]])
    mask = stage.mask(box + np.array([x0, y0]))
    if mask is None:
        return
    (left, top, right, bottom), cover = mask
    y, x = np.mgrid[top:bottom, left:right].astype(np.float32)
    angle = rng.choice([np.pi / 2, np.pi / 2, np.pi / 2 + tilt, 0.0, np.pi / 4, -np.pi / 4])
    period = rng.uniform(6, 90)
    share = rng.uniform(0.3, 0.7)
    t = (x * np.cos(angle) + y * np.sin(angle)) / period + rng.random()
    on = np.clip((share / 2 - np.abs(t - np.floor(t) - 0.5)) * period + 0.5, 0, 1)[..., None]
    other = np.full(3, rng.choice([0.03, 0.03, 0.05, 0.8])) * rng.uniform(0.6, 1.1)
    shade = (1 + 0.08 * grain(rng, (bottom - top, right - left), (3, 3)))[..., None]
    shown = (on * orange(rng, 0.9) + (1 - on) * other) * shade
    part = stage.plane[top:bottom, left:right]
    part += ((shown - part) * cover[..., None]).astype(np.float32)


def tiger(rng: np.random.Generator, stage: Stage) -> None:
    """Irregular dark stripes on orange fur."""
    high, wide = stage.shape
    field = grain(rng, (high, wide), (rng.uniform(8, 40), rng.uniform(2, 9)))
    bend = 12 * grain(rng, (high, wide), (3, 3))
    y, x = np.mgrid[:high, :wide].astype(np.float32)
    bent = cv2.remap(field, x, y + bend, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REFLECT)
    dark = np.clip((np.asarray(bent) - rng.uniform(0.0, 0.6)) * 6, 0, 1)[..., None]
    fur = orange(rng, 0.9) * (1 + 0.1 * grain(rng, (high, wide), (150, 60)))[..., None]
    shown = fur * (1 - dark) + 0.03 * dark
    center = (rng.uniform(0.2, 0.8) * wide, rng.uniform(0.2, 0.8) * high)
    size = rng.uniform(0.2, 1.0)
    body = np.clip(
        (1 - ((x - center[0]) / (size * wide)) ** 2 - ((y - center[1]) / (size * high)) ** 2) * 20,
        0,
        1,
    )[..., None]
    stage.plane += ((shown - stage.plane) * body).astype(np.float32)


def ladder(rng: np.random.Generator, stage: Stage) -> None:
    """Two rails and rungs, or the slats of a fence, before something dark."""
    high, wide = stage.shape
    color = orange(rng, 0.9)
    x = rng.uniform(0.05, 0.9) * wide
    across = rng.uniform(0.02, 0.2) * wide
    lean = rng.uniform(-0.15, 0.15) * wide if rng.random() < 0.6 else 0.0
    top, bottom = rng.uniform(-0.1, 0.5) * high, rng.uniform(0.6, 1.1) * high
    if rng.random() < 0.7:
        stage.spot(
            np.array(
                [[x + lean, top], [x + lean + across, top], [x + across, bottom], [x, bottom]]
            ),
            np.full(3, rng.uniform(0.015, 0.06)),
        )
    rail = max(across * rng.uniform(0.06, 0.2), 1.0)
    for side in (x, x + across - rail):
        if rng.random() < 0.8:
            stage.spot(
                np.array(
                    [
                        [side + lean, top],
                        [side + lean + rail, top],
                        [side + rail, bottom],
                        [side, bottom],
                    ]
                ),
                color,
            )
    pitch = rng.uniform(0.02, 0.12) * high
    thick = pitch * rng.uniform(0.15, 0.7)
    for y in np.arange(top, bottom, pitch):
        shift = lean * (bottom - y) / (bottom - top)
        stage.spot(
            np.array(
                [
                    [x + shift, y],
                    [x + shift + across, y],
                    [x + shift + across, y + thick],
                    [x + shift, y + thick],
                ]
            ),
            color * rng.uniform(0.9, 1.05),
        )


def books(rng: np.random.Generator, stage: Stage) -> None:
    """A shelf, or a stack, of things that are orange, dark or any colour, of uneven size."""
    high, wide = stage.shape
    x, y = rng.uniform(0.0, 0.8) * wide, rng.uniform(0.1, 0.6) * high
    thick = rng.uniform(4, 30)
    length = rng.uniform(0.05, 0.4) * high
    stack = rng.random() < 0.6
    for _ in range(int(rng.integers(5, 25))):
        color = (
            orange(rng, 0.9)
            if rng.random() < 0.5
            else (np.full(3, 0.03) if rng.random() < 0.6 else rng.uniform(0.05, 0.7, 3))
        )
        step, extent = thick * rng.uniform(0.6, 1.5), length * rng.uniform(0.8, 1.1)
        if stack:
            box = [[x, y], [x + extent, y], [x + extent, y + step], [x, y + step]]
            y += step
        else:
            box = [
                [x, y + length - extent],
                [x + step, y + length - extent],
                [x + step, y + length],
                [x, y + length],
            ]
            x += step
        stage.spot(np.array(box), color)


Trap = Callable[[np.random.Generator, Stage], None]
TRAPS: tuple[Trap, ...] = (stripes, stripes, tiger, ladder, books)
