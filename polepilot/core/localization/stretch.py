"""A stretch of motion: where it leads, and how its end depends on its start and on what is wrong.

Steps are chained in plain floats: for matrices this small, numpy's calls cost more than the work.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from polepilot.core.localization.noise import NoiseModel
from polepilot.core.localization.odometry import Step, arc

Array = NDArray[np.float64]


class Distortions(NamedTuple):
    """What is wrong with the odometry."""

    speed: float
    """Relative error of the speed."""
    steering: float
    """Error of the wheel angle, radians."""
    servo: float
    """Errors of the servo's and the motors' time constants, seconds."""
    motor: float
    slowness: float = 0.0
    """Error of the servo's slowness, seconds per radian."""


class Stretch(NamedTuple):
    """Some steps of motion in one."""

    dx: float
    """In `map`, metres; ``turn`` in radians."""
    dy: float
    turn: float
    jacobian: Array
    """3 x 8: derivative of the pose at the end by the pose at the start and by the distortions."""
    noise: Array
    """3 x 3 covariance of what the steps add."""
    moving: float
    """Seconds of it in motion."""


def drive(
    heading: float,
    steps: Iterable[Step],
    wrong: Distortions,
    model: NoiseModel,
    wheelbase: float,
) -> Stretch | None:
    """Chain ``steps``, beginning with ``heading``; None where the robot only stood."""
    way_x = way_y = way_turn = moving = 0.0
    # Derivatives of the pose by the distortions.
    vx = vy = vh = ox = oy = oh = sx = sy = sh = mx = my = mh = 0.0
    wx = wy = wh = 0.0
    xx = xy = xh = yy = yh = hh = 0.0
    speed_density, steering_density = model.speed_noise**2, model.steering_noise**2
    skid_density = model.skid**2
    factor = 1.0 + wrong.speed
    for step in steps:
        told, dt = step.speed, step.dt
        if told == 0.0:
            continue
        moving += dt
        raw = told + step.speed_by_lag * wrong.motor
        angle = step.steering + wrong.steering + step.by_lag * wrong.servo
        tan = math.tan(angle + step.by_slowness * wrong.slowness)
        curvature = tan / wheelbase
        distance = raw * factor * dt
        dx, dy, turn, ax, ay, bx, by = arc(heading + way_turn, distance, curvature)
        # By distance: (ax, ay, curvature). By steering: through the curvature.
        bend = (1.0 + tan * tan) / wheelbase
        cx, cy, ch = bx * bend, by * bend, distance * bend
        unit = raw * dt
        gx, gy, gh = ax * unit, ay * unit, curvature * unit
        way_x += dx
        way_y += dy
        way_turn += turn
        lag_m, lag_s = factor * step.speed_by_lag * dt, step.by_lag
        vx, vy, vh = vx - vh * dy + gx, vy + vh * dx + gy, vh + gh
        ox, oy, oh = ox - oh * dy + cx, oy + oh * dx + cy, oh + ch
        sx, sy, sh = sx - sh * dy + cx * lag_s, sy + sh * dx + cy * lag_s, sh + ch * lag_s
        lag_w = step.by_slowness
        wx, wy, wh = wx - wh * dy + cx * lag_w, wy + wh * dx + cy * lag_w, wh + ch * lag_w
        mx, my, mh = mx - mh * dy + ax * lag_m, my + mh * dx + ay * lag_m, mh + curvature * lag_m
        # The noise so far turns with the heading's error; then comes that of this step.
        xx, xy, yy = (
            xx - 2.0 * dy * xh + dy * dy * hh,
            xy + dx * xh - dy * yh - dx * dy * hh,
            yy + 2.0 * dx * yh + dx * dx * hh,
        )
        xh, yh = xh - dy * hh, yh + dx * hh
        doubt = model.motor_doubt * step.unsettled_speed
        along = (speed_density * raw * raw + doubt * doubt) * dt
        doubt = model.servo_doubt * step.unsettled
        across = (steering_density + doubt * doubt) / dt
        skid = skid_density * abs(told) * dt
        xx += along * ax * ax + across * cx * cx + skid
        xy += along * ax * ay + across * cx * cy
        xh += along * ax * curvature + across * cx * ch
        yy += along * ay * ay + across * cy * cy + skid
        yh += along * ay * curvature + across * cy * ch
        hh += along * curvature * curvature + across * ch * ch
    if moving == 0.0:
        return None
    jacobian = np.array(
        (
            (1.0, 0.0, -way_y, vx, ox, sx, mx, wx),
            (0.0, 1.0, way_x, vy, oy, sy, my, wy),
            (0.0, 0.0, 1.0, vh, oh, sh, mh, wh),
        )
    )
    noise = np.array(((xx, xy, xh), (xy, yy, yh), (xh, yh, hh)))
    return Stretch(way_x, way_y, way_turn, jacobian, noise, moving)
