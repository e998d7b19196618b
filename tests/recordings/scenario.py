"""What a recording is made of, drawn by lot: place, poles, the robot's faults, what happens.

Metres, radians, seconds. Nothing of polepilot is used here, so that no mistake of its own can hide.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal, get_args

import numpy as np

Kind = Literal["room", "corridor", "yard", "slip", "moved", "lifted", "three", "push", "hidden"]
KINDS: tuple[Kind, ...] = get_args(Kind)
Point = tuple[float, float]
Rng = np.random.Generator

DURATION = 90.0
HALF_SWEEP = math.radians(135)
"""The camera turns from minus this to this and back."""
POTENTIOMETER_BEND = 0.003
"""Largest deviation of the potentiometer, as a share of the whole sweep."""
SURVEY_SIGMA = 0.005
MOVED_BY = 0.40
LIFTED_BY = 1.50


@dataclass(frozen=True, slots=True)
class Pole:
    """A landmark as it really stands, and where the map has it."""

    id: int
    x: float
    y: float
    mapped: Point


@dataclass(frozen=True, slots=True)
class Person:
    """Somebody who stands in the way of the view for a while."""

    x: float
    y: float
    since: float
    until: float
    radius: float = 0.25
    height: float = 1.7


@dataclass(frozen=True, slots=True)
class Shift:
    """The robot is taken along by a force from outside, within ``lasts`` seconds from ``at`` on."""

    at: float
    lasts: float
    dx: float
    dy: float
    turn: float
    rise: float = 0.0
    """How high it is lifted on the way."""
    stands: float = 0.0
    """Seconds for which the robot stands afterwards."""


@dataclass(frozen=True, slots=True)
class Robot:
    """What this robot is like, as against what its data sheet says."""

    wheelbase: float = 0.20
    track: float = 0.20
    speed_scale: float = 1.0
    steering_offset: float = 0.0
    motor_lag: float = 0.08
    servo_lag: float = 0.12
    servo_rate: float = 3.0
    delay: float = 0.01
    """Until a command has any effect."""
    slip: float = 0.015
    """Spread of the coloured noise on speed and curvature, as a share."""
    skew: float = 0.01
    """Spread of sideways motion, as a share of the speed; twice as many rad/m of turning."""
    bursts: float = 0.0
    """Slip in bursts, as a share."""
    pan_rate: float = math.radians(45)
    bend: tuple[float, ...] = (0.0,) * 8
    """Of the potentiometer: sines and cosines of one to three half waves per sweep, and what a
    straight line takes off that again (constant, share of the half sweep), radians."""


@dataclass(frozen=True, slots=True)
class Eye:
    """The camera on its pan head."""

    constant: float = 600.0
    width: int = 400
    height: int = 300
    forward: float = 0.10
    mount: float = 0.40
    exposure: float = 0.005
    readout: float = 0.02
    """From the middle of the first row's exposure to that of the last row's."""
    pitch: float = 0.0
    """Of the camera on its head, upwards."""
    roll: float = 0.0
    body_pitch: float = 0.0
    body_roll: float = 0.0
    rocking: float = 0.003
    """Spread of the body's rocking while it drives, radians."""
    rate: float = 12.0

    @property
    def cx(self) -> float:
        return (self.width - 1) / 2

    @property
    def cy(self) -> float:
        return (self.height - 1) / 2


@dataclass(frozen=True, slots=True)
class Scenario:
    """All that makes a recording, by its kind and seed."""

    kind: Kind
    seed: int
    size: Point
    poles: tuple[Pole, ...]
    robot: Robot
    eye: Eye
    stands: float
    """Seconds until the first motion."""
    wanders: bool
    """Steers about at random instead of along a route."""
    margin: float
    """How far the robot stays off the walls."""
    shift: bool = False
    person: Person | None = None
    moved: int | None = None
    outdoors: bool = False
    start: float = 0.0
    """Time stamp of the recording's beginning."""


def draw(kind: Kind, seed: int) -> Scenario:
    """The recording ``seed`` of a kind."""
    rng = np.random.default_rng([seed, KINDS.index(kind), 4711])
    size = {"corridor": (20.0, 3.0), "yard": (20.0, 15.0)}.get(kind, (8.0, 6.0))
    count = 3 if kind == "three" else int(rng.integers(6, 9))
    places = _places(rng, kind, size, count)
    ids = rng.choice(np.arange(1, 16), count, replace=False)
    moved = int(rng.integers(count)) if kind == "moved" else None
    poles = []
    for index, (x, y) in enumerate(places):
        off = rng.normal(0.0, SURVEY_SIGMA, 2)
        if index == moved:
            way = rng.uniform(-math.pi, math.pi)
            off = off + MOVED_BY * np.array([math.cos(way), math.sin(way)])
        poles.append(Pole(int(ids[index]), x, y, (round(x + off[0], 4), round(y + off[1], 4))))
    outdoors = kind == "yard"
    person = None
    if kind == "hidden":
        one = poles[int(rng.integers(count))]
        inward = np.array([size[0] / 2 - one.x, size[1] / 2 - one.y])
        x, y = np.array([one.x, one.y]) + inward / np.hypot(*inward) * rng.uniform(0.45, 0.7)
        since = float(rng.uniform(20, 30))
        person = Person(float(x), float(y), since, since + float(rng.uniform(25, 40)))
    return Scenario(
        kind,
        seed,
        size,
        tuple(poles),
        _robot(rng, kind),
        _eye(rng, outdoors),
        stands=float(rng.uniform(4.0, 8.0)),
        wanders=bool(rng.random() < 0.4),
        margin={"corridor": 0.7, "yard": 1.5}.get(kind, 0.9),
        shift=kind in ("lifted", "push"),
        person=person,
        moved=None if moved is None else poles[moved].id,
        outdoors=outdoors,
        start=round(float(rng.uniform(0.0, 500.0)), 3),
    )


def _places(rng: Rng, kind: Kind, size: Point, count: int) -> list[Point]:
    """Along the walls, evenly but for chance; no two nearer than a metre."""
    width, depth = size
    inset = (0.4, 4.0) if kind == "yard" else (0.12, 0.4)
    while True:
        places: list[Point] = []
        first = rng.uniform(0.0, 1.0)
        for index in range(count):
            off = float(rng.uniform(*inset))
            if kind == "corridor":
                x = (index + rng.uniform(0.2, 0.8)) * width / count
                places.append((float(x), off if (index + (first < 0.5)) % 2 else depth - off))
                continue
            spread = 0.15 if count < 6 else 0.35
            along = (first + (index + rng.uniform(-spread, spread)) / count) % 1.0
            places.append(_on_rim(along * 2 * (width + depth), width, depth, off))
        if all(math.dist(a, b) > 1.0 for i, a in enumerate(places) for b in places[:i]):
            return places


def _on_rim(along: float, width: float, depth: float, off: float) -> Point:
    """A place ``off`` inside the walls, ``along`` metres round them."""
    for x, y, dx, dy, length in (
        (0.0, off, 1, 0, width),
        (width - off, 0.0, 0, 1, depth),
        (width, depth - off, -1, 0, width),
        (off, depth, 0, -1, depth),
    ):
        if along < length:
            x, y = x + dx * along, y + dy * along
            return min(max(x, off), width - off), min(max(y, off), depth - off)
        along -= length
    return off, off


def _robot(rng: Rng, kind: Kind) -> Robot:
    def sign() -> int:
        return int(rng.choice([-1, 1]))

    waves = np.zeros(8)
    waves[:6] = rng.normal(0.0, 1.0, 6) / np.array([1.0, 1.0, 2.0, 2.0, 3.0, 3.0])
    angles = np.linspace(-HALF_SWEEP, HALF_SWEEP, 541)
    # Not straight is what differs from the straight line that fits best.
    slope, constant = np.polyfit(angles / HALF_SWEEP, bent(angles, tuple(waves)), 1)
    waves[6:] = -constant, -slope
    waves *= POTENTIOMETER_BEND * 2 * HALF_SWEEP / np.abs(bent(angles, tuple(waves))).max()
    return Robot(
        speed_scale=1.0 + 0.03 * sign(),
        steering_offset=math.radians(1.0) * sign(),
        motor_lag=float(rng.uniform(0.04, 0.15)),
        servo_lag=float(rng.uniform(0.08, 0.18)),
        bursts=0.10 if kind == "slip" else 0.0,
        pan_rate=math.radians(float(rng.uniform(30, 60))),
        bend=tuple(float(wave) for wave in waves),
    )


def _eye(rng: Rng, outdoors: bool) -> Eye:
    return Eye(
        forward=round(float(rng.uniform(0.05, 0.15)), 3),
        exposure=float(rng.uniform(0.001, 0.004) if outdoors else rng.uniform(0.003, 0.008)),
        readout=float(rng.uniform(0.012, 0.030)),
        pitch=math.radians(float(rng.uniform(-1.2, 1.2))),
        roll=math.radians(float(rng.uniform(-0.8, 0.8))),
        body_pitch=math.radians(float(rng.uniform(-0.4, 0.4))),
        body_roll=math.radians(float(rng.uniform(-0.4, 0.4))),
    )


def bent(angles: np.ndarray, waves: tuple[float, ...]) -> np.ndarray:
    """By how much the potentiometer reads too much at these angles."""
    out = waves[6] + waves[7] * angles / HALF_SWEEP
    for index in range(3):
        phase = (index + 1) * math.pi / 2 * angles / HALF_SWEEP
        out = out + waves[2 * index] * np.sin(phase) + waves[2 * index + 1] * np.cos(phase)
    return out
