"""A drive as places and the odometry between them, for all places at once."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from polepilot.core.localization.odometry import Step
from polepilot.core.localization.survey_run import SurveyRun

Array = NDArray[np.float64]
Ints = NDArray[np.intp]

SPEED, STEERING, SERVO_LAG, MOTOR_LAG = range(4)
"""What distorts odometry: share of the speed, radians, seconds, seconds."""

_STILL = 1e-4
_SPEED_NOISE, _STEERING_NOISE = 0.03, math.radians(0.3)
"""White noise of speed (as a share) and wheel angle (rad), per square root of a hertz."""
_MOTOR_DOUBT, _SERVO_DOUBT = 0.2, 0.1
"""Error of what motors and servo do on their way, as a share of the way they have left."""
_SKID = 0.004
"""Motion in any direction that no model explains, metres per square root of a metre."""
_LEAST = np.array([2e-4, 2e-4, 2e-4])
"""Nothing is known better than this between two pictures: metres, radians."""


@dataclass(frozen=True, slots=True, eq=False)
class Track:
    """The drive as places ("nodes") and the odometry between them.

    Pictures between which the robot stood share a node.
    """

    node_of: Ints
    """Per picture the node, -1 where it belongs to none."""
    stamps: Array
    """Of each node's first picture."""
    first: Ints
    """Per link the node where it begins; it ends at the next one."""
    steps: Array
    """Links x steps x 5: dt, speed, steering, and the last two's derivatives by their lags."""
    whitening: Array
    """Per link a 3 x 3 matrix that makes its error one of unit covariance."""

    def moved(self, distortion: Array) -> tuple[Array, Array]:
        """Per link how the robot moved in its own frame (N x 3), and derivatives (N x 3 x 4)."""
        return _compose(self.steps, distortion, self._wheelbase)

    _wheelbase: float = 0.2


def build_track(run: SurveyRun, used: Ints, cuts: frozenset[int]) -> Track:
    """Nodes for the pictures ``used`` (their indices, rising).

    ``cuts``: pictures before which the robot was moved by other means than its wheels.
    """
    node_of = np.full(len(run.pictures), -1, dtype=np.intp)
    stamps: list[float] = []
    links: list[tuple[int, list[Step]]] = []
    last: int | None = None
    for index in used.tolist():
        stamp = run.pictures[index][0]
        if last is not None:
            before = run.pictures[last][0]
            cut = any(other in cuts for other in range(last + 1, index + 1))
            if not (cut or run.broken(before, stamp)):
                steps = [s for s in run.history.steps(before, stamp) if abs(s.speed) > _STILL]
                if not steps:
                    node_of[index] = node_of[last]
                    last = index
                    continue
                links.append((len(stamps) - 1, steps))
        node_of[index] = len(stamps)
        stamps.append(stamp)
        last = index
    longest = max((len(steps) for _, steps in links), default=0)
    table = np.zeros((len(links), longest, 5))
    doubts = np.zeros((len(links), longest, 2))
    for row, (_, steps) in enumerate(links):
        for column, step in enumerate(steps):
            table[row, column] = (
                step.dt,
                step.speed,
                step.steering,
                step.speed_by_lag,
                step.by_lag,
            )
            doubts[row, column] = step.unsettled_speed, step.unsettled
    return Track(
        node_of=node_of,
        stamps=np.array(stamps),
        first=np.array([first for first, _ in links], dtype=np.intp),
        steps=table,
        whitening=_whitening(table, doubts, run.wheelbase),
        _wheelbase=run.wheelbase,
    )


def _compose(steps: Array, distortion: Array, wheelbase: float) -> tuple[Array, Array]:
    """The exact arcs of all links at once; derivatives by the four distortions."""
    count = len(steps)
    moved, derivative = np.zeros((count, 3)), np.zeros((count, 3, 4))
    for k in range(steps.shape[1]):
        rows = np.flatnonzero(steps[:, k, 0] > 0)
        step, by_speed, by_steering = _arc(steps[rows, k], distortion, wheelbase)
        heading = moved[rows, 2]
        turned = _turn(heading, step)
        # What was wrong with the heading before swings this step about.
        rate = derivative[rows, 2].copy()
        derivative[rows, 0] -= turned[:, 1, None] * rate
        derivative[rows, 1] += turned[:, 0, None] * rate
        speed = steps[rows, k, 1] + steps[rows, k, 3] * distortion[MOTOR_LAG]
        factor = 1.0 + distortion[SPEED]
        one = np.zeros((len(rows), 3, 4))
        along, aside = _turn(heading, by_speed), _turn(heading, by_steering)
        one[:, :, SPEED] = along * speed[:, None]
        one[:, :, MOTOR_LAG] = along * (factor * steps[rows, k, 3])[:, None]
        one[:, :, STEERING] = aside
        one[:, :, SERVO_LAG] = aside * steps[rows, k, 4][:, None]
        derivative[rows] += one
        moved[rows] += turned
    return moved, derivative


def _arc(step: Array, distortion: Array, wheelbase: float) -> tuple[Array, Array, Array]:
    """Of single steps (N x 5): the motion (N x 3), its derivatives by speed and by steering."""
    dt = step[:, 0]
    speed = (step[:, 1] + step[:, 3] * distortion[MOTOR_LAG]) * (1.0 + distortion[SPEED])
    tan = np.tan(step[:, 2] + distortion[STEERING] + step[:, 4] * distortion[SERVO_LAG])
    curvature, by_steering = tan / wheelbase, (1.0 + tan * tan) / wheelbase
    distance = speed * dt
    turn = distance * curvature
    ahead = np.sinc(turn / np.pi)
    rise = np.sin(0.5 * turn) * np.sinc(0.5 * turn / np.pi)
    # Steps are short: series of the derivatives are exact to 1e-6 and better.
    ahead_slope, rise_slope = -turn / 3 + turn**3 / 30, 0.5 - turn**2 / 8
    squared = distance * distance * by_steering
    motion = np.column_stack([distance * ahead, distance * rise, turn])
    by_speed = np.column_stack([dt * np.cos(turn), dt * np.sin(turn), dt * curvature])
    return (
        motion,
        by_speed,
        np.column_stack([squared * ahead_slope, squared * rise_slope, distance * by_steering]),
    )


def _turn(heading: Array, motion: Array) -> Array:
    """Motions in a frame turned by ``heading``, seen from outside it."""
    cos, sin = np.cos(heading), np.sin(heading)
    x, y = motion[:, 0], motion[:, 1]
    return np.column_stack([cos * x - sin * y, sin * x + cos * y, motion[:, 2]])


def _whitening(steps: Array, doubts: Array, wheelbase: float) -> Array:
    """From the noise of each step to the inverse square root of each link's covariance."""
    count = len(steps)
    covariance = np.zeros((count, 3, 3))
    moved = np.zeros((count, 3))
    none = np.zeros(4)
    for k in range(steps.shape[1]):
        rows = np.flatnonzero(steps[:, k, 0] > 0)
        step = steps[rows, k]
        motion, by_speed, by_steering = _arc(step, none, wheelbase)
        heading = moved[rows, 2]
        turned = _turn(heading, motion)
        along, aside = _turn(heading, by_speed), _turn(heading, by_steering)
        swing = np.tile(np.eye(3), (len(rows), 1, 1))
        swing[:, 0, 2], swing[:, 1, 2] = -turned[:, 1], turned[:, 0]
        dt = step[:, 0]
        speed_variance = (_SPEED_NOISE * step[:, 1]) ** 2 / dt
        speed_variance += (_MOTOR_DOUBT * doubts[rows, k, 0]) ** 2
        steering_variance = _STEERING_NOISE**2 / dt + (_SERVO_DOUBT * doubts[rows, k, 1]) ** 2
        grown = swing @ covariance[rows] @ swing.transpose(0, 2, 1)
        grown += np.einsum("ni,nj,n->nij", along, along, speed_variance)
        grown += np.einsum("ni,nj,n->nij", aside, aside, steering_variance)
        skid = _SKID**2 * np.abs(step[:, 1]) * dt
        grown[:, 0, 0] += skid
        grown[:, 1, 1] += skid
        covariance[rows] = grown
        moved[rows] += turned
    covariance += np.diag(_LEAST**2)
    return np.linalg.inv(np.linalg.cholesky(covariance)) if count else covariance
