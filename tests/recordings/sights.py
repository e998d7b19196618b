"""What a picture can show at all: where each pole is in it, whole, cut or hidden."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from recordings.motion import Course
from recordings.scenario import Scenario

HEIGHT, DIAMETER = 0.65, 0.07
BESIDE = 25
"""Pixels beside the picture within which the middle of a pole may be that is seen in part."""


@dataclass(frozen=True, slots=True)
class Sight:
    """A pole within the picture's angle of view, at mid exposure of the middle row."""

    id: int
    range: float
    """From the pan axis to the pole's axis."""
    bearing: float
    """From the optical axis."""
    whole: bool
    """All of it is in the picture, and nothing is in front of it."""
    hidden: bool
    smear: float
    """Pixels over which the exposure blurs its sides."""


def sights(scenario: Scenario, course: Course) -> list[tuple[Sight, ...]]:
    """Of every picture; poles of which a part may be in it."""
    eye = scenario.eye
    at = course.frames
    heading = np.interp(at, course.t, course.heading)
    pan = np.interp(at, course.t, course.pan)
    x = np.interp(at, course.t, course.x) + eye.forward * np.cos(heading)
    y = np.interp(at, course.t, course.y) + eye.forward * np.sin(heading)
    rise = np.interp(at, course.t, course.rise)
    yaw = heading + pan
    later = np.interp(at + 0.01, course.t, course.heading + course.pan)
    turning = np.abs(later - yaw) / 0.01
    shown = []
    for index, t in enumerate(at.tolist()):
        around = _things(scenario, t, float(x[index]), float(y[index]))
        seen = []
        for number, far, azimuth, _ in around:
            if number == 0:
                continue
            bearing = math.remainder(azimuth - float(yaw[index]), math.tau)
            if abs(bearing) > 1.0 or abs(math.tan(bearing)) * eye.constant > eye.cx + BESIDE:
                continue
            hidden = any(
                near < far and abs(math.remainder(azimuth - other, math.tau)) < wide
                for _, near, other, wide in around
            )
            whole = not hidden and _inside(scenario, bearing, far, float(rise[index]))
            smear = float(turning[index]) * eye.exposure * eye.constant
            seen.append(Sight(number, far, bearing, whole, hidden, smear))
        shown.append(tuple(seen))
    return shown


def _things(
    scenario: Scenario, t: float, x: float, y: float
) -> list[tuple[int, float, float, float]]:
    """Poles, and a person as number 0: range, azimuth, and within which angle it hides others."""
    things = [(pole.id, pole.x, pole.y, DIAMETER / 2) for pole in scenario.poles]
    one = scenario.person
    if one is not None and one.since <= t < one.until:
        things.append((0, one.x, one.y, one.radius))
    out = []
    for number, px, py, radius in things:
        far = math.dist((px, py), (x, y))
        out.append((number, far, math.atan2(py - y, px - x), math.atan2(radius + 0.03, far)))
    return out


def _inside(scenario: Scenario, bearing: float, far: float, rise: float) -> bool:
    eye = scenario.eye
    middle = eye.cx - eye.constant * math.tan(bearing)
    scale = eye.constant / ((far - DIAMETER / 2) * math.cos(bearing))
    pitch = eye.constant * math.tan(eye.pitch)
    half = eye.constant * DIAMETER / 2 / far
    above = eye.cy + pitch - scale * (HEIGHT - eye.mount - rise)
    below = eye.cy + pitch + scale * (eye.mount + rise)
    return half < middle < eye.width - 1 - half and above > 0 and below < eye.height - 1
