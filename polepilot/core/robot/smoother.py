"""The offline best: every pose of a recording from all that was seen before and after it.

Rauch, Tung and Striebel's smoother over the localizer's own filter: once forward, keeping what was
believed before and after each picture, then backward, each belief corrected by the one after it.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from polepilot.core.geometry import Pose2D, wrap_angle
from polepilot.core.landmark import Landmark
from polepilot.core.localization.ekf import STATES, PoseFilter
from polepilot.core.localization.noise import NoiseModel
from polepilot.core.localization.odometry import OdometryHistory, Step
from polepilot.core.observation import RangeBearing

Array = NDArray[np.float64]
Picture = tuple[float, Sequence[RangeBearing]]
"""Stamp and what was seen."""

_WIDE = np.diag(np.square((0.3, 0.3, 0.14)))
"""What is known of a pose before the first picture is taken in, m² and rad²."""
_ROUNDS = 2
"""The second time the filter is linearized about what the first time has found."""


@dataclass(frozen=True, slots=True)
class _Belief:
    """Around one picture: predicted to it, and with it; ``moved``: from the one before, square."""

    moved: Array
    predicted: Array
    predicted_covariance: Array
    state: Array
    covariance: Array


class Smoother:
    """Smooths stretches of a recording, in each of which the pose was never lost.

    Args:
        landmarks: those that stand where the map has them.
        history: the odometry of the whole recording.
        camera_forward: of the pan axis ahead of `base_link`, metres.
    """

    def __init__(
        self,
        landmarks: Mapping[int, Landmark],
        history: OdometryHistory,
        camera_forward: float,
        noise: NoiseModel,
        gate: float,
    ) -> None:
        self._landmarks = landmarks
        self._history = history
        self._forward = camera_forward
        # A robot that looks ahead must not become too sure; one that looks back has seen it all.
        self._noise = replace(noise, position_limit=0.0, heading_limit=0.0)
        self._still = replace(noise, speed_walk=0.0, steering_walk=0.0)
        self._gate = gate

    def smooth(self, pictures: Sequence[Picture], pose: Pose2D, stamp: float) -> list[Pose2D]:
        """The pose at each picture, in order of time; ``pose`` at ``stamp`` is roughly right."""
        if not pictures:
            return []
        history = self._history
        start = np.zeros(STATES)
        first = pictures[0][0]
        smoothed: list[Array] = []
        for _ in range(_ROUNDS):
            factor, offset = 1.0 + float(start[3]), float(start[4])
            start[:3] = (
                smoothed[0][:3] if smoothed else history.advance(pose, stamp, first, factor, offset)
            )
            smoothed = _backward(self._ahead(pictures, start))
            start = smoothed[0].copy()
        return [Pose2D(float(s[0]), float(s[1]), wrap_angle(float(s[2]))) for s in smoothed]

    def _ahead(self, pictures: Sequence[Picture], start: Array) -> list[_Belief]:
        """The filter over all pictures, linearized about ``start`` at first."""
        tracked = PoseFilter(self._history.wheelbase, self._forward, self._noise, self._gate)
        tracked.reset(Pose2D(*(float(v) for v in start[:3])), _WIDE)
        beliefs: list[_Belief] = []
        now = pictures[0][0]
        for stamp, sightings in pictures:
            steps = list(self._history.steps(now, stamp))
            moved = self._moved(tracked, steps)
            tracked.predict(steps)
            now = stamp
            predicted, covariance = tracked.state.copy(), tracked.covariance.copy()
            for sighting in sightings:
                if sighting.landmark in self._landmarks:
                    seen = tracked.innovation(sighting, self._landmarks[sighting.landmark])
                    if seen.squared <= self._gate:
                        tracked.update(seen)
            beliefs.append(
                _Belief(
                    moved, predicted, covariance, tracked.state.copy(), tracked.covariance.copy()
                )
            )
        return beliefs

    def _moved(self, tracked: PoseFilter, steps: Sequence[Step]) -> Array:
        """Derivative of the state after ``steps`` by the state before them."""
        probe = PoseFilter(self._history.wheelbase, self._forward, self._still, self._gate)
        probe.state[:] = tracked.state
        probe.covariance = np.eye(STATES)
        probe.predict(steps)
        # From independent errors of size 1, how pose and distortions hang together afterwards is
        # the derivative by the distortions. By the heading, the whole way turns about its start.
        moved = np.eye(STATES)
        moved[:3, 3:] = probe.covariance[:3, 3:]
        way = probe.state[:2] - tracked.state[:2]
        moved[0, 2], moved[1, 2] = -way[1], way[0]
        return moved


def _backward(beliefs: Sequence[_Belief]) -> list[Array]:
    """States with all pictures taken in, in order of time."""
    state = beliefs[-1].state
    found = [state]
    for index in range(len(beliefs) - 2, -1, -1):
        here, following = beliefs[index], beliefs[index + 1]
        # K = P Fᵀ (P⁻)⁻¹, with both covariances symmetric.
        gain = np.linalg.solve(
            following.predicted_covariance + 1e-15 * np.eye(STATES),
            following.moved @ here.covariance,
        ).T
        change = state - following.predicted
        change[2] = wrap_angle(float(change[2]))
        state = here.state + gain @ change
        found.append(state)
    return found[::-1]
