"""A program that makes pictures of landmarks from physics, for the tests of seeing.

Rays from a camera that is not quite level hit upright (or slightly leaning) painted cylinders;
lamps and black bodies light them; lens, rolling shutter, sensor, tone curve and JPEG make a picture
of what comes back. It shares nothing with the simulator's renderer.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import get_args

import cv2
import numpy as np
from scenes import studio_things as things
from scenes.studio_light import Floats, Lighting, Rng, draw_lighting, draw_paint
from scenes.studio_optics import Eye, Layer, Pole, see
from scenes.studio_room import field_over, room
from scenes.studio_sensor import Sensor, develop
from scenes.truth import Family, Scene, Truth

from polepilot.core.landmark import LandmarkKind

KINDS: Mapping[int, LandmarkKind] = {number: LandmarkKind() for number in range(1, 16)}
"""The landmarks that pictures show unless said otherwise."""
RANGES: Mapping[Family, tuple[float, float]] = {
    "clean": (2.0, 8.0),
    "clean-8-12": (8.0, 12.0),
    "clean-12-16": (12.5, 16.0),
    "clean-16-22": (16.0, 22.0),
    "photo": (2.0, 8.0),
    "pan": (2.0, 8.0),
    "hidden": (2.0, 8.0),
    "empty": (2.0, 8.0),
}
_BAND = 4
"""Pixels round a landmark that count as its surround, in a picture 400 pixels wide."""


@dataclass(frozen=True, slots=True)
class _Lot:
    """What was drawn for a picture before anything is rendered."""

    family: Family
    photo: bool
    eye: Eye
    lighting: Lighting
    kinds: Mapping[int, LandmarkKind]


def scene(
    family: Family,
    seed: int,
    *,
    size: tuple[int, int] = (400, 300),
    constant: float = 600.0,
    kinds: Mapping[int, LandmarkKind] | None = None,
) -> Scene:
    """One picture of a family; the same for the same arguments.

    Args:
        family: which row of the table of results.
        seed: which picture.
        size: width and height in pixels.
        constant: the camera's constant in pixels.
        kinds: the ids to draw from, and what each looks like.
    """
    rng = np.random.default_rng([get_args(Family).index(family), seed])
    lot = _draw(family, rng, size, constant, kinds or KINDS)
    poles = [] if family == "empty" else _place(lot, rng)
    picture = _behind(lot, poles, rng)
    layers = {pole.id: see(pole, lot.eye, lot.lighting) for pole in poles}
    truths = [
        Truth(
            *(pole.id, pole.range, pole.bearing, pole.kind),
            orange_surround=_merges(pole, layers, picture, lot),
        )
        for pole in poles
    ]
    for pole in poles:
        layers[pole.id].onto(picture)
    if family == "hidden":
        truths = _hide(picture, lot, poles, truths, rng)
    sensor = _draw_sensor(lot, picture, rng)
    note = _note(lot, sensor)
    return Scene(develop(picture, sensor, rng), tuple(truths), family, seed, note)


def _draw(
    family: Family,
    rng: Rng,
    size: tuple[int, int],
    constant: float,
    kinds: Mapping[int, LandmarkKind],
) -> _Lot:
    photo = (
        family in ("photo", "empty")
        or (family == "pan" and rng.random() < 0.25)
        or (family == "hidden" and rng.random() < 0.5)
    )
    defocused = photo and rng.random() < 0.1
    eye = Eye(
        *size,
        constant,
        pitch=math.radians(rng.uniform(-2, 2)),
        roll=math.radians(rng.uniform(-2, 2)),
        blur=rng.uniform(0.8, 1.2) if defocused else rng.uniform(0.3, 0.8),
    )
    if family == "pan":
        eye = replace(
            eye,
            pan_rate=math.radians(rng.uniform(-60, 60)),
            readout=rng.uniform(0.010, 0.033),
            exposure=rng.uniform(0.002, 0.012),
        )
    lighting = draw_lighting(rng) if photo else draw_lighting(rng, 6500.0, 2900.0, 1.5)
    return _Lot(family, photo, eye, lighting, kinds)


def _place(lot: _Lot, rng: Rng) -> list[Pole]:
    """Landmarks that stand whole in the picture, none in front of another; far ones first."""
    wanted = int(rng.integers(1, 3 if lot.family == "hidden" else 5))
    leaning = rng.random() < 0.25
    view = math.atan2(lot.eye.width / 2, lot.eye.constant)
    poles: list[Pole] = []
    taken: list[tuple[float, float]] = []
    numbers = rng.permutation(list(lot.kinds))
    for _ in range(400):
        if len(poles) == min(wanted, len(numbers)):
            break
        lean = rng.uniform(-1, 1, 2) if leaning else np.zeros(2)
        number = int(numbers[len(poles)])
        pole = Pole(
            number,
            rng.uniform(*RANGES[lot.family]),
            rng.uniform(-view, view),
            lot.kinds[number],
            draw_paint(rng),
            (math.radians(lean[0]), math.radians(lean[1])),
            turn=math.radians(rng.uniform(-30, 30)) if lot.kinds[number].shape == "flat" else 0.0,
            fade=rng.uniform(-0.15, 0.15),
        )
        outline = pole.outline(lot.eye)
        low, high = outline.min(axis=0), outline.max(axis=0)
        edge = 2.0 + lot.eye.smear / 2
        whole = low[0] >= edge and high[0] <= lot.eye.width - 1 - edge
        whole &= low[1] >= 2.0 and high[1] <= lot.eye.height - 3.0
        gap = 4.0 + lot.eye.smear
        if whole and all(high[0] + gap < left or low[0] - gap > right for left, right in taken):
            poles.append(pole)
            taken.append((low[0], high[0]))
    return sorted(poles, key=lambda one: -one.range)


def _behind(lot: _Lot, poles: list[Pole], rng: Rng) -> Floats:
    """The picture without landmarks, blurred by lens and movement: linear light."""
    eye = lot.eye
    if not lot.photo:
        farthest = max([pole.range for pole in poles], default=6.0)
        picture = room(eye, rng, lot.lighting, poles, farthest + rng.uniform(0.5, 4.0))
    else:
        wide = eye.width + 2 * math.ceil(abs(eye.pan_rate) * eye.readout * eye.constant)
        picture = things.photograph(wide, eye.height, rng)
        if eye.pan_rate:
            shift = eye.constant * np.tan(eye.yaw(np.arange(float(eye.height))))
            columns = np.arange(eye.width)[None, :] - shift[:, None] + (wide - eye.width) / 2
            rows = np.broadcast_to(np.arange(eye.height)[:, None], columns.shape)
            seen = columns.astype(np.float32), rows.astype(np.float32)
            whole = np.ascontiguousarray(picture)
            picture = np.asarray(cv2.remap(whole, *seen, cv2.INTER_LINEAR), np.float32)
        picture = np.ascontiguousarray(picture)
        things.scatter(picture, rng, int(rng.integers(0, 8 if lot.family == "empty" else 3)))
        if lot.family == "empty":
            _decoys(picture, rng)
        for pole in poles:
            if rng.random() < 0.13:
                things.surround(picture, pole.outline(eye), pole.paint.bright, rng)
        picture *= field_over(picture.shape[:2], rng, 0.3)[..., None]
        picture *= lot.lighting.mean.astype(np.float32) * np.float32(rng.uniform(0.6, 1.2))
    if eye.smear > 0.02:
        streak = _streak(eye.smear)
        picture = np.asarray(
            cv2.filter2D(picture, -1, streak, borderType=cv2.BORDER_REPLICATE), np.float32
        )
    return np.asarray(cv2.GaussianBlur(picture, (0, 0), eye.blur), np.float32)


def _decoys(picture: Floats, rng: Rng) -> None:
    """Striped posts, ladders and barriers that are no landmarks."""
    paint = draw_paint(rng).bright
    for _ in range(int(rng.integers(0, 4))):
        things.false_pole(picture, rng, paint)
    if rng.random() < 0.2:
        things.ladder(picture, rng, paint)


def _streak(length: float) -> Floats:
    """A row of weights that blurs by ``length`` pixels, which need not be whole."""
    half = math.ceil(length / 2 + 0.5)
    place = np.arange(-half, half + 1)
    weights = np.clip(length / 2 - np.abs(place) + 0.5, 0.0, 1.0)
    return np.asarray((weights / weights.sum())[None, :], np.float32)


def _merges(pole: Pole, layers: Mapping[int, Layer], picture: Floats, lot: _Lot) -> bool:
    """Whether what lies round the landmark has the colour of its paint, in a good part."""
    seen = picture.copy()
    for number, layer in layers.items():
        if number != pole.id:
            layer.onto(seen)
    layer = layers[pole.id]
    band = max(_BAND * lot.eye.width // 400, 1)
    mask = np.zeros(seen.shape[:2], np.uint8)
    rows, columns = layer.cover.shape
    mask[layer.top : layer.top + rows, layer.left : layer.left + columns] = layer.cover > 0.05
    ring = cv2.dilate(mask, np.ones((2 * band + 1, 2 * band + 1), np.uint8)) - mask
    around = seen[ring > 0]
    paint = pole.paint.bright * lot.lighting.mean
    chroma = around / np.maximum(around.sum(axis=1, keepdims=True), 1e-6)
    apart = np.linalg.norm((chroma - paint / paint.sum())[:, :2], axis=1)
    alike = (apart < 0.15) & (around[:, 0] > 0.08 * paint[0])
    return bool(alike.mean() > 0.15)


def _hide(
    picture: Floats, lot: _Lot, poles: list[Pole], truths: list[Truth], rng: Rng
) -> list[Truth]:
    """Puts something in front of at least one landmark."""
    chosen = rng.random(len(poles)) < 0.75
    if poles:
        chosen[int(rng.integers(len(poles)))] = True
    light = lot.lighting.mean.astype(np.float32)
    hidden = [False] * len(poles)
    for index in np.nonzero(chosen)[0]:
        mask, color = things.occluder(picture.shape[:2], poles[index], lot.eye, rng)
        mask = np.asarray(cv2.GaussianBlur(mask, (0, 0), lot.eye.blur), np.float32)
        picture += mask[..., None] * (color * light - picture)
        for other, pole in enumerate(poles):
            share = things.covered(mask, pole, lot.eye)
            hidden[other] = bool(hidden[other] or share.max() >= 0.33)
            if other != index and 0.02 < share.max() < 0.33:
                hidden[other] = True
    return [replace(truth, hidden=gone) for truth, gone in zip(truths, hidden, strict=True)]


def _draw_sensor(lot: _Lot, picture: Floats, rng: Rng) -> Sensor:
    """White balance, exposure and all that follows."""
    hard = lot.photo
    light = lot.lighting.mean
    drift = np.exp(rng.normal(0, 0.10 if hard else 0.04, 3))
    gains = light ** -rng.uniform(0.5 if hard else 0.75, 1.0) * drift
    gains /= gains[1]
    usual = 0.5 * float((picture @ np.array([0.25, 0.6, 0.15], np.float32)).mean())
    usual += 0.5 * 0.2 * float(light[1])
    lot_of_light = rng.random()
    if hard and lot_of_light < 0.2:
        key, electrons = rng.uniform(0.02, 0.06), rng.uniform(500, 3000)
    elif hard and lot_of_light < 0.4:
        key, electrons = rng.uniform(0.4, 0.8), rng.uniform(2000, 10000)
    else:
        key, electrons = rng.uniform(0.13, 0.3), rng.uniform(2500, 8000)
    compressed = rng.random() < (0.8 if hard else 0.15)
    return Sensor(
        gains * key / usual,
        electrons,
        read_noise=rng.uniform(0.0005, 0.002),
        vignetting=rng.uniform(0.0, 0.45 if hard else 0.3),
        saturation=rng.uniform(0.9, 1.25),
        tone=str(rng.choice(["srgb", "power", "curve"])),
        gamma=rng.uniform(2.0, 2.4),
        sharpening=rng.uniform(0.2, 0.7) if rng.random() < 0.3 else 0.0,
        mosaic=bool(rng.random() < (0.3 if hard else 0.2)),
        quality=int(rng.integers(60 if hard else 85, 96)) if compressed else None,
        subsampled=bool(rng.random() < (0.6 if hard else 0.4)),
    )


def _note(lot: _Lot, sensor: Sensor) -> str:
    eye = lot.eye
    parts = [
        "photo" if lot.photo else "room",
        f"pitch {math.degrees(eye.pitch):.1f}",
        f"roll {math.degrees(eye.roll):.1f}",
        f"blur {eye.blur:.2f}",
        f"gains {sensor.gains[0]:.2f} {sensor.gains[1]:.2f} {sensor.gains[2]:.2f}",
        f"electrons {sensor.electrons:.0f}",
        f"tone {sensor.tone}",
    ]
    if eye.pan_rate:
        parts.append(
            f"pan {math.degrees(eye.pan_rate):.0f} deg/s readout {eye.readout * 1e3:.0f} ms "
            f"exposure {eye.exposure * 1e3:.0f} ms"
        )
    parts += ["mosaic"] * sensor.mosaic
    parts += [f"sharpened {sensor.sharpening:.1f}"] * bool(sensor.sharpening)
    if sensor.quality is not None:
        parts.append(f"jpeg {sensor.quality}{' 4:2:0' * sensor.subsampled}")
    return ", ".join(parts)
