"""What stands behind poles and in front of them: photographs, and orange and other things.

Everything is drawn as the light that it sends back in white light of strength 1, linear RGB.
"""

from __future__ import annotations

import colorsys
import math
from collections.abc import Callable
from functools import cache
from importlib.util import find_spec
from pathlib import Path

import cv2
import numpy as np
import skimage.data
from scenes.studio_light import Floats, Rng
from scenes.studio_optics import Eye, Pole
from scenes.studio_room import clouds

from polepilot.core.landmark import decode

Mask = Floats
_SHIPPED = (
    *("astronaut", "brick", "camera", "chelsea", "coffee", "coins", "grass", "gravel"),
    *("hubble_deep_field", "immunohistochemistry", "retina", "rocket", "motorcycle_left"),
)
"""Pictures that come inside scikit-image's wheel: nothing is fetched."""


@cache
def photographs() -> tuple[Floats, ...]:
    """Real photographs, linear RGB, 0 to 1; as many as the installed packages hold."""
    folder = Path(skimage.data.__file__).parent
    files = [path for path in sorted(folder.iterdir()) if path.stem in _SHIPPED]
    files = [path for path in files if path.suffix in (".png", ".jpg")]
    # Found without importing it: that takes a second.
    learn = find_spec("sklearn")
    if learn is not None and learn.origin is not None:
        images = Path(learn.origin).parent / "datasets" / "images"
        files += sorted(images.glob("*.jpg"))
    loaded = []
    for path in files:
        image = cv2.imread(str(path), cv2.IMREAD_COLOR)
        if image is not None:
            value = image[..., ::-1].astype(np.float32) / 255
            loaded.append(
                np.where(value <= 0.04045, value / 12.92, ((value + 0.055) / 1.055) ** 2.4)
            )
    return tuple(np.asarray(one, np.float32) for one in loaded)


def photograph(width: int, height: int, rng: Rng) -> Floats:
    """A piece of a photograph, turned over or not, its hues a little shifted."""
    choice = int(rng.integers(len(photographs())))
    if photographs()[choice].shape[0] > 1000 and rng.random() < 0.7:
        choice = int(rng.integers(len(photographs())))  # the retina: all orange, seldom met
    source = photographs()[choice]
    rows, columns = source.shape[:2]
    shape = width / height
    tall = rng.uniform(0.45, 1.0) * min(rows, columns / shape)
    wide = tall * shape
    top, left = rng.uniform(0, rows - tall), rng.uniform(0, columns - wide)
    piece = source[int(top) : int(top + tall), int(left) : int(left + wide)]
    shrink = piece.shape[0] > height
    how = cv2.INTER_AREA if shrink else cv2.INTER_CUBIC
    piece = np.asarray(cv2.resize(piece, (width, height), interpolation=how), np.float32)
    if rng.random() < 0.5:
        piece = piece[:, ::-1]
    if np.ptp(source[:: rows // 8, :: columns // 8], axis=2).max() < 0.01 and rng.random() < 0.7:
        # A grey photograph of a surface: of brick, earth, straw, wood, stone.
        tint = orange_color(rng) if rng.random() < 0.15 else np.clip(any_color(rng), 0.05, 1)
        piece = piece * (tint / tint.max()).astype(np.float32)
    mix = np.eye(3) + rng.uniform(-0.08, 0.08, (3, 3))
    mix /= mix.sum(axis=1, keepdims=True)
    piece = piece @ mix.astype(np.float32) * np.float32(rng.uniform(0.6, 1.3))
    return np.clip(piece, 0.0, 1.2)


def orange_color(rng: Rng, like: Floats | None = None) -> Floats:
    """Of orange, red or wooden things; ``like``: of nearly that colour."""
    if like is not None:
        return np.asarray(like * rng.uniform(0.7, 1.2) * rng.uniform(0.88, 1.12, 3))
    kind = rng.random()
    if kind < 0.25:  # wood, cardboard
        red = rng.uniform(0.2, 0.6)
        return red * np.array([1.0, rng.uniform(0.38, 0.6), rng.uniform(0.1, 0.3)])
    if kind < 0.45:  # brick, rust
        red = rng.uniform(0.15, 0.45)
        return red * np.array([1.0, rng.uniform(0.2, 0.4), rng.uniform(0.08, 0.25)])
    red = rng.uniform(0.4, 0.9)
    green = rng.uniform(0.02, 0.12) if kind < 0.65 else rng.uniform(0.1, 0.42)
    return red * np.array([1.0, green, rng.uniform(0.01, 0.1)])


def any_color(rng: Rng) -> Floats:
    """Black, grey, white or coloured."""
    if rng.random() < 0.3:
        return rng.uniform(0.02, 0.08) * np.ones(3)
    color = colorsys.hsv_to_rgb(rng.random(), rng.uniform(0, 0.9), rng.uniform(0.05, 0.8))
    return np.array(color) ** 1.5


def polygon(shape: tuple[int, int], corners: Floats) -> Mask:
    """Cover (0 to 1) of a polygon given in pixels, pixel centres being integers."""
    fine = 4
    low = np.floor(corners.min(axis=0)).astype(int) - 1
    high = np.ceil(corners.max(axis=0)).astype(int) + 2
    low, high = np.maximum(low, 0), np.minimum(high, [shape[1], shape[0]])
    out = np.zeros(shape, np.float32)
    if (high <= low).any():
        return out
    size = (high - low) * fine
    mask = np.zeros((size[1], size[0]), np.uint8)
    inside = ((corners - low + 0.5) * fine - 0.5) * 256
    cv2.fillPoly(mask, [np.rint(inside).astype(np.int32)], 255, shift=8)
    part = cv2.resize(mask, tuple(int(n) for n in high - low), interpolation=cv2.INTER_AREA)
    out[low[1] : high[1], low[0] : high[0]] = part.astype(np.float32) / 255
    return out


def box(left: float, top: float, right: float, bottom: float, tilt: float = 0.0) -> Floats:
    """Corners of an upright rectangle, turned by ``tilt`` radians about its middle."""
    middle = np.array([(left + right) / 2, (top + bottom) / 2])
    corners = np.array([[left, top], [right, top], [right, bottom], [left, bottom]]) - middle
    cos, sin = math.cos(tilt), math.sin(tilt)
    return np.asarray(corners @ np.array([[cos, sin], [-sin, cos]]) + middle)


def blob(middle: Floats, size: Floats, rng: Rng) -> Floats:
    """Corners of a rounded, irregular shape (clothing, a bush)."""
    angle = np.linspace(0, 2 * math.pi, 40, endpoint=False)
    radius = np.ones(40)
    for wave in range(2, 7):
        radius += rng.normal(0, 0.25 / wave) * np.cos(wave * angle + rng.uniform(0, 7))
    round_ = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    return np.asarray(middle + size * radius[:, None] * round_)


def _paint_over(picture: Floats, mask: Mask, color: Floats | Floats) -> None:
    """``color``: one for all, or one per pixel."""
    picture += mask[..., None] * (np.asarray(color, np.float32) - picture)


def _crumple(shape: tuple[int, int], rng: Rng, depth: float, stretch: float = 1.0) -> Floats:
    """Random shading of cloth, wood (stretched) or plaster, about 1."""
    field = clouds(int(rng.integers(4)))
    y = (np.arange(shape[0]) * rng.uniform(0.6, 2.0) * stretch + rng.integers(512)).astype(int)
    x = (np.arange(shape[1]) * rng.uniform(0.6, 2.0) / stretch + rng.integers(512)).astype(int)
    return np.asarray(np.clip(1 + depth * field[y[:, None] & 511, x & 511], 0.1, 2.5))


Thing = Callable[[Floats, Floats, Floats, Floats, Rng], None]
"""Draws itself into a picture: middle and half size in pixels, colour."""


def _board(picture: Floats, middle: Floats, half: Floats, color: Floats, rng: Rng) -> None:
    (x, y), (w, h) = middle, half
    mask = polygon(picture.shape[:2], box(x - w, y - h, x + w, y + h, rng.normal(0, 0.03)))
    grain = _crumple(picture.shape[:2], rng, rng.uniform(0.02, 0.2), rng.choice([0.15, 1, 7]))
    _paint_over(picture, mask, grain[..., None] * color)


def _crate(picture: Floats, middle: Floats, half: Floats, color: Floats, rng: Rng) -> None:
    (x, y), (w, h) = middle, half
    lid = rng.uniform(0.1, 0.3) * h
    skew = rng.uniform(-0.4, 0.4) * w
    front = box(x - w, y - h + lid, x + w, y + h)
    top = np.array([[x - w, y - h + lid], [x + w, y - h + lid]])
    top = np.concatenate([top, np.array([[x + w + skew, y - h], [x - w + skew, y - h]])])
    _paint_over(picture, polygon(picture.shape[:2], top), color * rng.uniform(1.0, 1.3))
    shade = _crumple(picture.shape[:2], rng, 0.05)
    _paint_over(picture, polygon(picture.shape[:2], front), shade[..., None] * color)


def _bricks(picture: Floats, middle: Floats, half: Floats, color: Floats, rng: Rng) -> None:
    (x, y), (w, h) = middle, half
    mask = polygon(picture.shape[:2], box(x - w, y - h, x + w, y + h))
    tall = rng.uniform(5, 16)
    wide = tall * rng.uniform(2.2, 3.2)
    rows, columns = np.indices(picture.shape[:2], np.float32)
    course = np.floor(rows / tall)
    shifted = columns + wide / 2 * (course % 2)
    number = (course * 71 + np.floor(shifted / wide) * 37).astype(np.int64)
    tint = clouds(1)[number % 512, (number * 7) % 512]
    edge = max(tall * 0.08, 0.7)
    joint = (rows % tall < edge) | (shifted % wide < edge)
    wall = color * np.clip(1 + 0.2 * tint, 0.4, 1.8)[..., None]
    wall = np.where(joint[..., None], rng.uniform(0.15, 0.5), wall)
    _paint_over(picture, mask, wall * _crumple(picture.shape[:2], rng, 0.08)[..., None])


def _cone(picture: Floats, middle: Floats, half: Floats, color: Floats, rng: Rng) -> None:
    (x, y), (w, h) = middle, half
    w = min(w, 0.45 * h)
    shape = picture.shape[:2]
    body = np.array([[x - 0.12 * w, y - h], [x + 0.12 * w, y - h], [x + w, y + h], [x - w, y + h]])
    across = (np.arange(shape[1]) - x) / max(w, 1)
    shade = 0.5 + 0.6 * np.exp(-((across - rng.uniform(-0.4, 0.4)) ** 2) / 0.3)
    cone = color * shade[:, None]
    stripes = np.zeros(shape[0], bool)
    rows = (np.arange(shape[0]) - (y - h)) / (2 * h)
    for start in (0.25, 0.55)[: int(rng.integers(0, 3))]:
        stripes |= (rows > start) & (rows < start + 0.14)
    white = 0.8 * shade[None, :, None] * np.ones(3)
    surface = np.where(stripes[:, None, None], white, np.broadcast_to(cone, picture.shape))
    _paint_over(picture, polygon(shape, body), surface)
    plate = box(x - 1.25 * w, y + 0.93 * h, x + 1.25 * w, y + h)
    _paint_over(picture, polygon(shape, plate), color * 0.6)


def _cloth(picture: Floats, middle: Floats, half: Floats, color: Floats, rng: Rng) -> None:
    mask = polygon(picture.shape[:2], blob(middle, half, rng))
    folds = _crumple(picture.shape[:2], rng, 0.25, rng.uniform(0.3, 1.0))
    _paint_over(picture, mask, folds[..., None] * color)


def _flowers(picture: Floats, middle: Floats, half: Floats, color: Floats, rng: Rng) -> None:
    leaf = np.array([0.05, 0.16, 0.03]) * rng.uniform(0.5, 1.5)
    for _ in range(int(rng.integers(8, 30))):
        place = middle + half * rng.uniform(-1, 1, 2)
        size = np.full(2, rng.uniform(0.08, 0.3) * min(half)) + 1.5
        tone = leaf if rng.random() < 0.3 else color * rng.uniform(0.6, 1.2)
        corners = blob(place, size, rng)
        low = np.maximum(np.floor(corners.min(axis=0)).astype(int) - 1, 0)
        high = np.ceil(corners.max(axis=0)).astype(int) + 2
        part = picture[low[1] : high[1], low[0] : high[0]]
        if part.size:
            _paint_over(part, polygon(part.shape[:2], corners - low), tone)


def _stripes(picture: Floats, middle: Floats, half: Floats, color: Floats, rng: Rng) -> None:
    """Orange and dark (or white) bars, level or slanting: cloth, barriers."""
    (x, y), (w, h) = middle, half
    rows, columns = np.indices(picture.shape[:2], np.float32)
    angle = rng.choice([0.0, math.pi / 2, rng.uniform(0.3, 1.2)])
    along = rows * math.cos(angle) + columns * math.sin(angle)
    period, share = rng.uniform(6, 40), rng.uniform(0.3, 0.7)
    lit = np.clip((np.abs(along / period % 1 - 0.5) - share / 2) * period + 0.5, 0, 1)
    other = rng.uniform(0.02, 0.08) * np.ones(3) if rng.random() < 0.6 else any_color(rng)
    bars = other + lit[..., None] * (color - other)
    mask = polygon(picture.shape[:2], box(x - w, y - h, x + w, y + h, rng.normal(0, 0.05)))
    _paint_over(picture, mask, bars)


THINGS: tuple[Thing, ...] = (_board, _board, _crate, _bricks, _cone, _cloth, _flowers, _stripes)


def scatter(picture: Floats, rng: Rng, count: int) -> None:
    """Orange, red and other things anywhere."""
    rows, columns = picture.shape[:2]
    for _ in range(count):
        middle = rng.uniform([0, 0.1 * rows], [columns, rows])
        half = rng.uniform(0.03, 0.22, 2) * columns
        thing = THINGS[int(rng.integers(len(THINGS)))]
        thing(picture, middle, half, orange_color(rng), rng)


def surround(picture: Floats, outline: Floats, like: Floats, rng: Rng) -> None:
    """Something of the paint's hue behind a landmark: all round it, or at one side or end."""
    low, high = outline.min(axis=0), outline.max(axis=0)
    middle, half = (low + high) / 2, (high - low) / 2
    reach = half + rng.uniform(0.3, 1.5) * half[1]
    where = rng.random()
    side = rng.choice([-1.0, 1.0])
    if where < 0.25:  # one side, beginning behind the pole
        middle = middle + np.array([side * (reach[0] - rng.uniform(-0.5, 0.9) * half[0]), 0.0])
    elif where < 0.55:  # one end
        share = rng.uniform(0.0, 0.9) * half[1]
        middle = middle + np.array([rng.normal(0, 0.3) * reach[0], side * (reach[1] - share)])
    else:
        middle = middle + rng.uniform(-0.2, 0.2, 2) * half[1]
    thing = THINGS[int(rng.integers(len(THINGS)))]
    # Half of them of just the paint's colour, the others orange or wooden.
    color = orange_color(rng, like if rng.random() < 0.5 else None)
    thing(picture, middle, reach, color, rng)


def false_pole(picture: Floats, rng: Rng, like: Floats, bits: int = 4) -> None:
    """A striped post that is no landmark: bars of one length, of any, or a code that is none."""
    rows, columns = picture.shape[:2]
    tall = rng.uniform(0.08, 0.8) * rows
    wide = tall * rng.uniform(0.06, 0.3)
    x, y = rng.uniform(0, columns), rng.uniform(0.1 * rows, 0.95 * rows - tall)
    kind = rng.random()
    if kind < 0.35:
        bars = [1.0] * int(rng.integers(3, 22))
        levels = [index % 2 for index in range(len(bars))]
    elif kind < 0.6:
        count = int(rng.integers(3, 14))
        bars = list(rng.uniform(0.4, 3.0, count))
        levels = [index % 2 for index in range(count)]
    else:
        while True:
            code = "".join(rng.choice(["0", "1"], 2 * bits + 5))
            if decode(code) is None:
                break
        bars, levels = [1.0] * len(code), [int(c) for c in code]
    edges = y + np.concatenate([[0.0], np.cumsum(bars)]) / sum(bars) * tall
    dark = rng.uniform(0.02, 0.08) * np.ones(3)
    across = np.clip((np.arange(columns) - x) / wide * 2, -1, 1)
    shade = (0.4 + 0.6 * np.sqrt(1 - (0.9 * across) ** 2))[:, None]
    tilt = rng.normal(0, 0.02)
    for top, bottom, level in zip(edges[:-1], edges[1:], levels, strict=True):
        lean = tilt * ((top + bottom) / 2 - y)
        mask = polygon((rows, columns), box(x - wide / 2 + lean, top, x + wide / 2 + lean, bottom))
        _paint_over(picture, mask, shade * (like if level else dark))


def ladder(picture: Floats, rng: Rng, like: Floats) -> None:
    """Rungs between two posts."""
    rows, columns = picture.shape[:2]
    x, wide = rng.uniform(0.1, 0.8) * columns, rng.uniform(0.04, 0.2) * columns
    post, gap = rng.uniform(2, 8), rng.uniform(6, 35)
    dark = rng.uniform(0.02, 0.08) * np.ones(3)
    if rng.random() < 0.5:
        _paint_over(picture, polygon((rows, columns), box(x, 0, x + wide, rows)), dark)
    for level in np.arange(rng.uniform(0, gap), rows, gap):
        rung = box(x, level, x + wide, level + rng.uniform(0.2, 0.6) * gap)
        _paint_over(picture, polygon((rows, columns), rung), like * rng.uniform(0.8, 1.1))
    for side in (x, x + wide):
        _paint_over(
            picture, polygon((rows, columns), box(side - post / 2, 0, side + post / 2, rows)), like
        )


def covered(mask: Mask, pole: Pole, eye: Eye) -> Floats:
    """Share of every segment of a landmark (bottom first) that ``mask`` covers."""
    across, up = np.meshgrid(np.linspace(-0.94, 0.94, 9), (np.arange(9) + 0.5) / 9)
    shares = []
    for index in range(pole.kind.segments):
        heights = (index + up.ravel()) * pole.kind.segment
        pixels = np.rint(eye.project(pole.surface(across.ravel(), heights))).astype(int)
        columns = np.clip(pixels[:, 0], 0, mask.shape[1] - 1)
        rows = np.clip(pixels[:, 1], 0, mask.shape[0] - 1)
        shares.append(float(mask[rows, columns].mean()))
    return np.array(shares)


def occluder(shape: tuple[int, int], pole: Pole, eye: Eye, rng: Rng) -> tuple[Mask, Floats]:
    """Something in front of a landmark that covers a good part of a segment: cover and colour."""
    outline = pole.outline(eye)
    low, high = outline.min(axis=0), outline.max(axis=0)
    wide = high[0] - low[0]
    unit = (high[1] - low[1]) / pole.kind.segments
    while True:
        kind = rng.integers(5)
        x = (low[0] + high[0]) / 2 + rng.normal(0, 1.0) * wide
        reach = wide * rng.uniform(0.7, 4.0)
        if kind == 0:  # a box on the floor
            top = high[1] - rng.uniform(0.4, 5.0) * unit
            corners = box(x - reach, top, x + reach, high[1] + rng.uniform(0, 3) * unit)
        elif kind == 1:  # a board or a twig across
            y, thick = rng.uniform(low[1], high[1]), rng.uniform(0.35, 3.0) * unit
            tilt = rng.normal(0, 0.25)
            corners = box(x - 2 * reach, y - thick / 2, x + 2 * reach, y + thick / 2, tilt)
        elif kind == 2:  # a leg
            leg = wide * rng.uniform(0.4, 2.0)
            x = (low[0] + high[0]) / 2 + rng.choice([-1, 1]) * (
                leg + wide * rng.uniform(-1, 0.4)
            ) / 2
            top = rng.uniform(low[1] - 6 * unit, high[1] - unit)
            corners = box(x - leg / 2, top, x + leg / 2, high[1] + 4 * unit, rng.normal(0, 0.04))
        elif kind == 3:  # cloth hanging over it
            y = low[1] + rng.uniform(-0.5, 1.0) * unit
            size = np.array([reach, rng.uniform(0.6, 5.0) * unit])
            corners = blob(np.array([x, y]), size, rng)
        else:  # a plant
            y = rng.uniform(low[1], high[1])
            corners = blob(np.array([x, y]), np.array([reach, rng.uniform(0.5, 4) * unit]), rng)
        mask = polygon(shape, corners)
        share = covered(mask, pole, eye)
        if share.max() >= 0.34 and share.mean() < 0.85:
            break
    hue = rng.random()
    color: Floats
    if hue < 0.25:
        color = pole.paint.bright * rng.uniform(0.6, 1.2)
    elif hue < 0.4:
        color = orange_color(rng)
    elif hue < 0.7:
        color = rng.uniform(0.015, 0.07) * rng.uniform(0.8, 1.2, 3)
    else:
        color = any_color(rng)
    folds = _crumple(shape, rng, rng.uniform(0.0, 0.25))
    return mask, np.asarray(folds[..., None] * color, np.float32)
