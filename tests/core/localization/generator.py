"""Recordings made for the tests: a robot with every fault that a real one has.

Independent of the simulator and of the code under test: true motion is integrated in small steps,
and nothing of polepilot but its nouns is used.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np

from polepilot.core.geometry import Point, Pose2D, wrap_angle
from polepilot.core.landmark import Landmark
from polepilot.core.observation import Odometry, RangeBearing

STEP = 0.01
WHEELBASE = 0.20
FORWARD = 0.10
HALF_VIEW = math.radians(18.4)
"""Half of the camera's angle of view; a pole nearer than 1.65 m does not fit into the picture."""

ROOM = [(0.2, 0.2), (4.0, 0.1), (7.8, 0.3), (7.9, 3.1), (7.7, 5.8), (3.9, 5.9), (0.1, 5.7)]
LOOP = [(1.5, 1.5), (6.3, 1.4), (6.4, 4.5), (4.0, 3.2), (1.6, 4.6)]


@dataclass(frozen=True)
class Faults:
    speed_scale: float = 1.03
    steering_offset: float = math.radians(1.0)
    servo_lag: float = 0.12
    motor_lag: float = 0.05
    slip: float = 0.02
    slip_bursts: float = 0.0
    pan_bend: float = 0.003
    survey_sigma: float = 0.005
    range_share: float = 0.004
    bearing_sigma: float = math.radians(0.05)
    wrong_ids: float = 0.0
    moved: dict[int, Point] = field(default_factory=dict)
    lift_at: float | None = None
    lift_by: tuple[float, float, float] = (1.2, 0.9, 1.0)


@dataclass
class Recording:
    landmarks: dict[int, Landmark]
    events: list[Odometry | tuple[float, list[RangeBearing]]]
    """Commands and pictures in order of time; a picture is its stamp and what was measured."""
    truth: dict[float, Pose2D]
    """At the stamps of the pictures."""
    pans: dict[float, float]
    """What the potentiometer said at those stamps."""


def record(
    seed: int,
    seconds: float = 60.0,
    places: list[Point] | None = None,
    loop: list[Point] | None = None,
    faults: Faults | None = None,
    standing: float = 7.0,
    stands: tuple[float, float] | None = None,
    speed: float = 0.3,
    stop_and_go: bool = False,
) -> Recording:
    """Stand for a while, then drive round ``loop`` with the camera sweeping all the time."""
    rng = np.random.default_rng(seed)
    faults = faults or Faults()
    places = ROOM if places is None else places
    loop = LOOP if loop is None else loop
    mapped = {i: Landmark(i, x, y) for i, (x, y) in enumerate(places, start=1)}
    real = {}
    for i, mark in mapped.items():
        dx, dy = rng.normal(0, faults.survey_sigma, 2)
        mx, my = faults.moved.get(i, (0.0, 0.0))
        real[i] = (mark.x + dx + mx, mark.y + dy + my)
    start = math.atan2(loop[1][1] - loop[0][1], loop[1][0] - loop[0][0])
    x, y, heading = loop[0][0], loop[0][1], start + float(rng.normal(0, 0.2))
    target, steering, driven, told, slip = 1, 0.0, 0.0, (0.0, 0.0), 0.0
    burst_until, burst = -1.0, 0.0
    pan, pan_way = float(rng.uniform(-2, 2)), math.radians(45) * (1 if rng.random() < 0.5 else -1)
    events: list[Odometry | tuple[float, list[RangeBearing]]] = [Odometry(0.0, 0.0, 0.0)]
    truth: dict[float, Pose2D] = {}
    pans: dict[float, float] = {}
    for tick in range(1, int(seconds / STEP)):
        t = round(tick * STEP, 6)
        standing_now = t < standing or (stands is not None and stands[0] <= t < stands[1])
        standing_now = standing_now or (stop_and_go and t % 4.0 < 1.5)
        if faults.lift_at is not None and abs(t - faults.lift_at) < 0.5 * STEP:
            x, y = x + faults.lift_by[0], y + faults.lift_by[1]
            heading += faults.lift_by[2]
        if tick % 10 == 0:
            goal = loop[target % len(loop)]
            if math.dist((x, y), goal) < 0.5:
                target += 1
                goal = loop[target % len(loop)]
            error = wrap_angle(math.atan2(goal[1] - y, goal[0] - x) - heading)
            wanted = max(-0.55, min(0.55, 0.9 * error))
            new = (0.0 if standing_now else speed, 0.0 if standing_now else wanted)
            if new != told:
                told = new
                events.append(Odometry(t, *told))
        # True motion.
        steering += (told[1] - steering) * (1 - math.exp(-STEP / faults.servo_lag))
        slip += -slip * STEP / 0.5 + faults.slip * math.sqrt(2 * STEP / 0.5) * rng.normal()
        if faults.slip_bursts and t > burst_until and rng.random() < STEP / 6:
            burst_until, burst = t + 1.0, faults.slip_bursts
        factor = faults.speed_scale * (1 - slip) * (1 - (burst if t < burst_until else 0.0))
        driven += (told[0] - driven) * (1 - math.exp(-STEP / max(faults.motor_lag, 1e-9)))
        v = driven * factor
        turn = v * math.tan(steering + faults.steering_offset) / WHEELBASE * STEP
        turn *= 1 + 0.5 * slip
        x += v * STEP * math.cos(heading + turn / 2)
        y += v * STEP * math.sin(heading + turn / 2)
        heading = wrap_angle(heading + turn)
        pan += pan_way * STEP
        if abs(pan) > math.radians(135):
            pan = math.copysign(math.radians(135), pan)
            pan_way = -pan_way
        if tick % 8 == 0:
            stamp = t
            truth[stamp] = Pose2D(x, y, heading)
            pans[stamp] = _read_pan(faults, pan)
            pose = Pose2D(x, y, heading)
            events.append((stamp, _look(rng, faults, real, pose, pan, pans[stamp], stamp)))
    return Recording(mapped, events, truth, pans)


def _read_pan(faults: Faults, pan: float) -> float:
    """Ten bits over 270 degrees, and not quite linear."""
    u = pan / math.radians(135)
    bent = pan + faults.pan_bend * math.radians(270) * math.sin(math.pi * u)
    count = math.radians(270) / 1023
    return round(bent / count) * count


def _look(
    rng: np.random.Generator,
    faults: Faults,
    real: dict[int, Point],
    pose: Pose2D,
    pan: float,
    read: float,
    stamp: float,
) -> list[RangeBearing]:
    x, y, heading = pose
    cx, cy = x + FORWARD * math.cos(heading), y + FORWARD * math.sin(heading)
    seen = []
    for number, (px, py) in real.items():
        distance = math.hypot(px - cx, py - cy)
        bearing = wrap_angle(math.atan2(py - cy, px - cx) - heading)
        in_image = wrap_angle(bearing - pan)
        if abs(in_image) > HALF_VIEW or distance < 1.65:
            continue
        sigma = faults.range_share * distance
        if rng.random() < faults.wrong_ids:
            number = int(rng.choice([n for n in real if n != number]))
        seen.append(
            RangeBearing(
                stamp,
                number,
                distance + float(rng.normal(0, sigma)),
                wrap_angle(read + in_image + float(rng.normal(0, faults.bearing_sigma))),
                sigma,
                faults.bearing_sigma,
                read,
            )
        )
    return seen
