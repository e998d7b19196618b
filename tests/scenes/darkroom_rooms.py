"""The darkroom's rooms: a box with a floor, in true perspective, and what stands at its walls."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scenes.darkroom_camera import Plane
from scenes.darkroom_photos import (
    bricks,
    curtain,
    orange,
    photograph,
    plaster,
    tiles,
    wood,
)
from scenes.darkroom_stage import Stage, grain

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Room:
    """Metres from the camera's foot."""

    depth: float
    left: float
    right: float
    """Positive too."""
    height: float

    @staticmethod
    def around(rng: np.random.Generator, far: float) -> Room:
        """A room that has a landmark ``far`` away in it and reaches beyond the picture's sides."""
        depth = far + rng.uniform(0.5, 4.0)
        wide = 0.36 * far + 0.4
        return Room(
            depth,
            wide + rng.exponential(0.12 * far),
            wide + rng.exponential(0.12 * far),
            rng.uniform(2.4, 3.2) + 0.12 * max(depth - 8, 0) * rng.random(),
        )


def _plain(rng: np.random.Generator, low: float, high: float) -> Array:
    """Grey, or a little blue, green or violet: nothing that is orange in any light."""
    grey = np.full(3, rng.uniform(low, high))
    tint = np.array([rng.uniform(-0.02, 0.25), rng.uniform(-0.05, 0.1), rng.uniform(-0.15, 0.02)])
    return np.asarray(grey * (1 + rng.random() * tint))


def _cold(rng: np.random.Generator) -> Array:
    """A saturated colour of furniture, far from orange."""
    value = rng.uniform(0.1, 0.55)
    kind = rng.integers(4)
    if kind == 0:
        return np.array([value, value * 0.45, value * 0.2])
    if kind == 1:
        return np.array([value * 0.4, value, value * 0.35])
    if kind == 2:
        return np.full(3, rng.uniform(0.02, 0.05))
    return _plain(rng, 0.05, 0.8)


def room(rng: np.random.Generator, stage: Stage, far: float, warm: bool) -> str:
    """Draw a room whose things stand beyond ``far``; ``warm`` lets in wood, brick and orange."""
    box = Room.around(rng, far)
    wall, floor, ceiling = _surfaces(rng, warm)
    d, a, b, h = box.depth, box.left, -box.right, box.height
    long = d + 1.0
    stage.fill(np.broadcast_to(_plain(rng, 0.3, 0.8), (4, 4, 3)).astype(np.float32))
    stage.face(np.array([[-1, a, h], [-1, b, h], [d, b, h], [d, a, h]]), ceiling)
    stage.panel([-1, a, 0], [0, b - a, 0], [long, 0, 0], floor)
    side = wall if rng.random() < 0.7 else _surfaces(rng, warm)[0]
    dim = rng.uniform(0.75, 1.05, 2).astype(np.float32)
    stage.panel([-1, a, h], [long, 0, 0], [0, 0, -h], side * dim[0])
    stage.panel([-1, b, h], [long, 0, 0], [0, 0, -h], side * dim[1])
    stage.panel([d, a, h], [0, b - a, 0], [0, 0, -h], wall)
    if rng.random() < 0.8:
        skirting = _plain(rng, 0.05, 0.8)
        z = rng.uniform(0.06, 0.14)
        for corners in (
            [[d, a, z], [d, b, z], [d, b, 0], [d, a, 0]],
            [[0, a, z], [d, a, z], [d, a, 0], [0, a, 0]],
            [[0, b, z], [d, b, z], [d, b, 0], [0, b, 0]],
        ):
            stage.face(np.array(corners), skirting)
    for _ in range(int(rng.integers(0, 5))):
        _wall_thing(rng, stage, box, warm)
    for _ in range(int(rng.integers(0, 4))):
        _furniture(rng, stage, box, far, warm)
    if rng.random() < 0.35:
        _ceiling_lamps(rng, stage, box)
    field = 1 + 0.10 * grain(rng, (60, 80), (2, 3))
    field *= np.linspace(rng.uniform(0.8, 1.15), rng.uniform(0.8, 1.15), 80)[None]
    stage.shade(np.clip(field, 0.45, 1.5).astype(np.float32))
    return f"{'warm' if warm else 'plain'} room {d:.1f} m deep"


def _surfaces(rng: np.random.Generator, warm: bool) -> tuple[Plane, Plane, Array]:
    """Textures of the walls and the floor, the colour of the ceiling."""
    wall = plaster(rng, _plain(rng, 0.25, 0.85), rng.uniform(0.005, 0.03))
    if rng.random() < 0.4:
        floor = tiles(rng, _plain(rng, 0.1, 0.6), int(rng.integers(8, 40)))
    else:
        floor = plaster(rng, _plain(rng, 0.05, 0.55), rng.uniform(0.02, 0.12))
    if warm:
        kind = rng.integers(5)
        if kind == 0:
            wall = np.tile(wood(rng, 256), (1, 4, 1))
        elif kind == 1:
            wall = np.tile(bricks(rng, 256), (1, 3, 1))
        elif kind == 2:
            wall = plaster(rng, orange(rng), 0.03)
        elif kind == 3:
            wall = np.tile(curtain(rng, orange(rng), 256), (1, 2, 1))
        if rng.random() < 0.6:
            floor = np.tile(wood(rng, 256), (1, 2, 1))
    ceiling = _plain(rng, 0.5, 0.9)
    return wall, floor, ceiling


def _wall_thing(rng: np.random.Generator, stage: Stage, box: Room, warm: bool) -> None:
    """A door, window, picture, pipe, switch or radiator on the back wall."""
    d = box.depth - 0.01
    y = rng.uniform(-box.right, box.left)
    kind = rng.integers(6)
    color = orange(rng) if warm and rng.random() < 0.4 else _cold(rng)
    if kind == 0:
        wide, bottom, top = rng.uniform(0.7, 1.8), 0.0, rng.uniform(1.9, 2.2)
        frame = _plain(rng, 0.1, 0.8)
        stage.face(_upright(d, y + 0.06, y - wide - 0.06, bottom, top + 0.06), frame)
    elif kind == 1:
        wide, bottom, top = rng.uniform(0.6, 3.0), rng.uniform(0.4, 1.0), rng.uniform(1.6, 2.3)
        color = np.array([1.6, 1.4, 1.2]) * rng.uniform(0.6, 1.6)
        stage.face(_upright(d, y + 0.05, y - wide - 0.05, bottom - 0.05, top + 0.05), [0.7] * 3)
    elif kind == 2:
        wide, bottom = rng.uniform(0.3, 1.6), rng.uniform(0.3, 1.3)
        top = bottom + rng.uniform(0.3, 1.0)
        if warm:
            picture, _ = photograph(rng)
            stage.panel(
                np.array([d, y, top]),
                np.array([0, -wide, 0]),
                np.array([0, 0, bottom - top]),
                picture[::4, ::4],
            )
            return
    elif kind == 3:
        wide, bottom, top = rng.uniform(0.02, 0.15), 0.0, box.height
    elif kind == 4:
        wide, bottom, top = 0.08, rng.uniform(0.25, 1.1), 1.2
        top = bottom + rng.uniform(0.08, 0.3)
    else:
        wide, bottom, top = rng.uniform(0.5, 1.6), 0.12, rng.uniform(0.5, 0.8)
        ribs = plaster(rng, _plain(rng, 0.6, 0.85), 0.01)
        ribs *= (1 - 0.35 * (np.arange(256) % 16 < 4)).astype(np.float32)[None, :, None]
        stage.panel(
            np.array([d, y, top]), np.array([0, -wide, 0]), np.array([0, 0, bottom - top]), ribs
        )
        return
    stage.face(_upright(d, y, y - wide, bottom, top), color)


def _upright(x: float, left: float, right: float, bottom: float, top: float) -> Array:
    return np.array([[x, left, top], [x, right, top], [x, right, bottom], [x, left, bottom]])


def _furniture(rng: np.random.Generator, stage: Stage, box: Room, far: float, warm: bool) -> None:
    """A box, a shelf or a table at the back."""
    front = rng.uniform(far + 0.15, max(box.depth - 0.3, far + 0.2))
    deep = min(rng.uniform(0.3, 0.8), box.depth - front)
    y = rng.uniform(-box.right + 0.4, box.left)
    wide, high = rng.uniform(0.3, 1.8), rng.uniform(0.3, 2.0)
    color = orange(rng) if warm and rng.random() < 0.35 else _cold(rng)
    left, right = y, y - wide
    stage.darken(
        stage.pixels(
            np.array(
                [
                    [front - 0.1, left + 0.1, 0.001],
                    [front - 0.1, right - 0.1, 0.001],
                    [front + deep, right - 0.1, 0.001],
                    [front + deep, left + 0.1, 0.001],
                ]
            )
        ),
        0.5,
        4.0,
    )
    if rng.random() < 0.25:
        top = rng.uniform(0.5, 0.9)
        for leg in (left, right + 0.04):
            stage.face(_upright(front, leg, leg - 0.04, 0, top), color * 0.8)
        stage.face(_upright(front, left, right, top - 0.05, top), color)
        return
    facing = right if y - wide / 2 > 0 else left
    stage.face(
        np.array(
            [
                [front, facing, high],
                [front + deep, facing, high],
                [front + deep, facing, 0],
                [front, facing, 0],
            ]
        ),
        color * rng.uniform(0.5, 0.9),
    )
    stage.face(_upright(front, left, right, 0, high), color)
    for z in np.arange(0.3, high, rng.uniform(0.3, 0.6)):
        stage.face(_upright(front - 0.002, left, right, z, z + 0.015), color * 0.35)


def _ceiling_lamps(rng: np.random.Generator, stage: Stage, box: Room) -> None:
    z = box.height - 0.01
    for x in np.arange(2.0, box.depth, rng.uniform(1.5, 3.5)):
        for y in np.arange(-box.right + 0.8, box.left, rng.uniform(1.6, 3.0)):
            stage.face(
                np.array([[x, y, z], [x, y - 0.6, z], [x + 0.6, y - 0.6, z], [x + 0.6, y, z]]),
                [2.5, 2.5, 2.5],
            )
