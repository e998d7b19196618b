"""Draws the pictures of a recording: rolling shutter, blur of motion, cylinders ray by ray.

The background is a drum at infinity; poles and people are cylinders whose every ray is cast at its
own moment: a row's exposure is sampled at several times, each through another point of the pixel.
All colours are linear blue, green, red.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray
from recordings.motion import Course
from recordings.panorama import AROUND, SCALE, UPWARD, drum
from recordings.scenario import Rng, Scenario
from recordings.sensor import Film
from scenes.studio_light import black_body, draw_paint

Floats = NDArray[np.float32]
SHADES = 64
SEGMENT = 0.05
COARSE = 16
GOLDEN = 0.6180339887


@dataclass(frozen=True, slots=True, eq=False)
class Thing:
    """An upright cylinder in bands of colour, from the floor up."""

    x: float
    y: float
    radius: float
    height: float
    bands: tuple[int, ...]
    """Which of the two paints each band has, from below; all bands are equally high."""
    paints: Floats
    """Two colours, and what the light makes of them is ``lit``."""
    light: float
    since: float = -math.inf
    until: float = math.inf


@dataclass(frozen=True, slots=True)
class Light:
    """From all around, leaning to one side, and one or two lamps."""

    ambient: NDArray[np.float64]
    lean: tuple[float, float]
    lamps: tuple[tuple[float, NDArray[np.float64]], ...]
    """Azimuth from which each comes, and colour."""

    def on(self, azimuth: NDArray[np.float64]) -> NDArray[np.float64]:
        """Upon upright surfaces that face ``azimuth`` (n): n x 3."""
        share = 1.0 + self.lean[0] * np.cos(azimuth) + self.lean[1] * np.sin(azimuth)
        out = np.outer(share, self.ambient)
        for way, color in self.lamps:
            out += np.outer(np.maximum(np.cos(azimuth - way), 0.0), color)
        return out


def code(number: int) -> tuple[int, ...]:
    """The bands of a landmark of four bits, from below; 1 is bright (paper, Fig. 5)."""
    bits = [number >> index & 1 for index in range(4)]
    top_down = [1, 1, 0, bits[0], 0, bits[1], 0, bits[2], 0, bits[3], 0, 1, 1]
    return tuple(reversed(top_down))


def _light(rng: Rng) -> Light:
    kelvin = float(rng.uniform(2800, 7000))
    color = black_body(kelvin)[::-1]
    lamps = tuple(
        (float(rng.uniform(-math.pi, math.pi)), color * float(rng.uniform(0.2, 0.9)))
        for _ in range(int(rng.integers(1, 3)))
    )
    lean = tuple(float(v) for v in rng.uniform(-0.25, 0.25, 2))
    return Light(color * float(rng.uniform(0.5, 0.9)), (lean[0], lean[1]), lamps)


class Painter:
    """One recording's pictures; ``paint(index)`` gives any of them, always the same."""

    def __init__(self, scenario: Scenario, course: Course) -> None:
        rng = np.random.default_rng([scenario.seed, 7, len(scenario.kind)])
        self._scenario, self._course, self._eye = scenario, course, scenario.eye
        self._light = _light(rng)
        tint = self._light.on(np.linspace(-math.pi, math.pi, 12)).mean(axis=0)
        self._drum = drum(rng, scenario.outdoors) * tint.astype(np.float32)
        paint = draw_paint(rng)
        paints = np.stack([paint.dark, paint.bright])[:, ::-1].astype(np.float32)
        self._things = [
            Thing(pole.x, pole.y, 0.035, 0.65, code(pole.id), paints, float(rng.uniform(0.6, 1.3)))
            for pole in scenario.poles
        ]
        person = scenario.person
        if person is not None:
            clothes = rng.uniform(0.03, 0.6, (2, 3)).astype(np.float32)
            self._things.append(
                Thing(
                    *(person.x, person.y, person.radius, person.height, (0, 1), clothes, 1.0),
                    *(person.since, person.until),
                )
            )
        self._film = Film(rng, tint)
        self._yaw = course.heading + course.pan
        self._camera_x = course.x + self._eye.forward * np.cos(course.heading)
        self._camera_y = course.y + self._eye.forward * np.sin(course.heading)
        order = rng.permutation(16)
        self._grid = {
            16: (order, rng.permutation(16), np.arange(16)),
            8: (np.argsort(np.argsort(order[:8])), rng.permutation(8), np.arange(8)),
        }

    def paint(self, index: int) -> NDArray[np.uint8]:
        """Picture ``index``: rows x columns x blue, green, red."""
        t = float(self._course.frames[index])
        tilt = self._tilt(t)
        light = self._behind(t, tilt)
        x, y = self._at(self._camera_x, t), self._at(self._camera_y, t)
        things = [thing for thing in self._things if thing.since <= t < thing.until]
        things.sort(key=lambda thing: -math.dist((thing.x, thing.y), (x, y)))
        for thing in things:
            self._stand(light, thing, t, tilt)
        return self._film.develop(light, np.random.default_rng([self._scenario.seed, index]))

    def _at(self, values: NDArray[np.float64], t: float) -> float:
        return float(np.interp(t, self._course.t, values))

    def _tilt(self, t: float) -> tuple[float, float]:
        """Pitch (up) and roll of the camera in one picture."""
        eye, course = self._eye, self._course
        pan = self._at(course.pan, t)
        forward = eye.body_pitch + self._at(course.pitch, t)
        aside = eye.body_roll + self._at(course.roll, t)
        pitch = eye.pitch + forward * math.cos(pan) + aside * math.sin(pan)
        roll = eye.roll - forward * math.sin(pan) + aside * math.cos(pan)
        return pitch, roll

    def _turned(self, left: Floats, up: Floats, tilt: tuple[float, float]) -> tuple[Floats, ...]:
        """Rays of the level camera: forward, left, up."""
        (cp, sp), (cr, sr) = ((math.cos(a), math.sin(a)) for a in tilt)
        aside, rise = left * cr - up * sr, left * sr + up * cr
        return cp - rise * sp, aside, sp + rise * cp

    def _moments(self, t: float, rows: NDArray[np.float64]) -> NDArray[np.float64]:
        """When rows are exposed."""
        return t + (rows - self._eye.cy) * self._eye.readout / (self._eye.height - 1)

    def _behind(self, t: float, tilt: tuple[float, float]) -> Floats:
        """The drum as this picture shows it."""
        eye = self._eye
        rows = (np.arange(-1, eye.height / COARSE + 1) + 0.5) * COARSE - 0.5
        columns = (np.arange(-1, eye.width / COARSE + 1) + 0.5) * COARSE - 0.5
        left, up = np.meshgrid((eye.cx - columns) / eye.constant, (eye.cy - rows) / eye.constant)
        forward, aside, rise = self._turned(left, up, tilt)
        yaw = np.interp(self._moments(t, rows), self._course.t, self._yaw)
        turn = math.floor((yaw.mean() - 0.5) / math.tau) * math.tau
        azimuth = yaw[:, None] - turn + np.arctan2(aside, forward)
        # The drum's columns run clockwise: rising columns look further to the right.
        map_x = (AROUND - azimuth * SCALE) % AROUND
        first = map_x[:, :1]
        map_x = first.min() + (map_x - first.min() + AROUND / 2) % AROUND - AROUND / 2
        map_x -= math.floor(map_x.min() / AROUND) * AROUND
        map_y = UPWARD - rise / np.hypot(forward, aside) * SCALE
        size = (len(columns) * COARSE, len(rows) * COARSE)
        part = (slice(COARSE, COARSE + eye.height), slice(COARSE, COARSE + eye.width))
        fine_x, fine_y = (
            cv2.resize(plane.astype(np.float32), size, interpolation=cv2.INTER_LINEAR)[part]
            for plane in (map_x, map_y)
        )
        seen = cv2.remap(
            *(self._drum, fine_x, fine_y, cv2.INTER_LINEAR), borderMode=cv2.BORDER_REPLICATE
        )
        smear = abs(np.interp(t + 0.005, self._course.t, self._yaw) - yaw.mean()) / 0.005
        width = float(smear) * eye.exposure * eye.constant
        if width > 1.2:
            reach = math.ceil(width / 2)
            offsets = np.abs(np.arange(-reach, reach + 1))
            kernel = np.clip(width / 2 + 0.5 - offsets, 0.0, 1.0)
            seen = cv2.sepFilter2D(seen, -1, kernel / kernel.sum(), np.ones(1))
        return np.asarray(seen, np.float32)

    def _stand(self, light: Floats, thing: Thing, t: float, tilt: tuple[float, float]) -> None:
        """Put a cylinder before what is already there."""
        eye, course = self._eye, self._course
        box = self._box(thing, t, tilt)
        if box is None:
            return
        top, bottom, first, last, smear = box
        count = 8 if smear < 3.0 else 16
        down, aside_, when = self._grid[count]
        step = [((order + 0.5) / count - 0.5)[:, None, None] for order in (down, aside_, when)]
        across = np.arange(first, last)[None, None, :]
        # Each column's samples lie between those of its neighbours: no edge snaps to a grid.
        between = (across * GOLDEN % 1.0 - 0.5) / count
        rows = np.arange(top, bottom)[None, :, None] + step[0]
        columns = (across + step[1]).astype(np.float32)
        left = (np.float32(eye.cx) - columns) / np.float32(eye.constant)
        up = ((eye.cy - rows - between) / eye.constant).astype(np.float32)
        moments = self._moments(t, rows) + step[2] * eye.exposure
        yaw = np.interp(moments, course.t, self._yaw)
        dx = thing.x - np.interp(moments, course.t, self._camera_x)
        dy = thing.y - np.interp(moments, course.t, self._camera_y)
        a = (dx * np.cos(yaw) + dy * np.sin(yaw)).astype(np.float32)
        b = (dy * np.cos(yaw) - dx * np.sin(yaw)).astype(np.float32)
        lens = (eye.mount + np.interp(moments, course.t, course.rise)).astype(np.float32)
        forward, aside, rise = self._turned(left, up, tilt)
        cross = a * aside - b * forward
        square = forward * forward + aside * aside
        inner = np.float32(thing.radius**2) * square - cross * cross
        along = (a * forward + b * aside - np.sqrt(np.maximum(inner, 0))) / square
        z = lens + along * rise
        hit = (inner > 0) & (along > 0.05) & (z >= 0) & (z < thing.height)
        if not hit.any():
            return
        facing = math.atan2(dy.mean(), dx.mean()) + math.pi
        shade = cross / (np.float32(thing.radius) * np.sqrt(square))
        shade = np.clip((shade + 1) * (SHADES / 2), 0, SHADES - 1).astype(np.int32)
        bands = np.array([*thing.bands, 0], np.int32)
        band = np.clip(z * (len(thing.bands) / thing.height), 0, len(thing.bands) - 1)
        which = np.where(hit, bands[band.astype(np.int32)] * SHADES + shade, 2 * SHADES)
        color = self._colors(thing, facing)[which].sum(axis=0) / np.float32(count)
        part = light[top:bottom, first:last]
        part *= 1 - color[..., 3:]
        part += color[..., :3]

    def _colors(self, thing: Thing, facing: float) -> Floats:
        """What each paint sends back by the place across the cylinder, and cover; last: nothing."""
        across = np.arcsin((np.arange(SHADES) + 0.5) / (SHADES / 2) - 1)
        light = (thing.light * self._light.on(facing - across)).astype(np.float32)
        table = np.ones((2 * SHADES + 1, 4), np.float32)
        table[:-1, :3] = (thing.paints[:, None, :] * light[None]).reshape(-1, 3)
        table[-1] = 0
        return table

    def _box(
        self, thing: Thing, t: float, tilt: tuple[float, float]
    ) -> tuple[int, int, int, int, float] | None:
        """Rows, columns that may show it, and over how many columns it is smeared."""
        eye, course = self._eye, self._course
        moments = t + (eye.readout + eye.exposure) * np.array([-0.5, 0.0, 0.5])
        yaw = np.interp(moments, course.t, self._yaw)
        dx = thing.x - np.interp(moments, course.t, self._camera_x)
        dy = thing.y - np.interp(moments, course.t, self._camera_y)
        off = np.arctan2(dy, dx) - yaw
        off = (off + math.pi) % math.tau - math.pi
        if np.abs(off).max() > 1.2:
            return None
        far = float(np.hypot(dx, dy).min()) - thing.radius
        depth = max(far, 0.1) * math.cos(float(np.abs(off).max()))
        wide = eye.constant * thing.radius / depth + 3 + abs(math.sin(tilt[1])) * eye.height * 0.6
        middle = eye.cx - eye.constant * np.tan(off)
        first = max(math.floor(middle.min() - wide), 0)
        last = min(math.ceil(middle.max() + wide) + 1, eye.width)
        lens = eye.mount + self._at(course.rise, t)
        lean = eye.constant * math.tan(tilt[0]) * 1.1
        slack = 4 + abs(math.sin(tilt[1])) * eye.width / 2 + 0.03 * abs(lean)
        above = eye.cy + lean - eye.constant / depth * (thing.height - lens)
        below = eye.cy + lean + eye.constant / (depth if lens > 0 else far) * lens
        top = max(math.floor(above - slack), 0)
        bottom = min(math.ceil(below + slack) + 1, eye.height)
        if first >= last or top >= bottom:
            return None
        smear = abs(float(middle[2] - middle[0])) * eye.exposure / (eye.readout + eye.exposure)
        return top, bottom, first, last, smear
