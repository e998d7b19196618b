"""Always last: nothing reaches the wheels that this has not let through."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from polepilot.core.command import STAND, DriveCommand
from polepilot.core.errors import ConfigError
from polepilot.core.observation import PoseEstimate, Status
from polepilot.core.vehicle import Vehicle

FUTURE = 0.05
"""Stamps may be ahead of now by this much, seconds: rounding and two clocks."""
LONGEST_TICK = 0.10
"""However long the last tick took, no more acceleration than this many seconds allow."""


@dataclass(frozen=True, slots=True)
class Limits:
    """What is allowed at most, beside what the vehicle can do. Metres, radians, seconds."""

    max_speed: float = 0.40
    max_acceleration: float = 0.60
    """When speeding up; slowing down is always allowed at once."""
    max_estimate_age: float = 0.50
    max_link_age: float = 0.25
    max_position_sigma: float = 0.50
    degraded_share: float = 0.5
    """Share of the speed that is left while the pose is degraded."""

    def __post_init__(self) -> None:
        for name in self.__dataclass_fields__:
            value = getattr(self, name)
            if not (math.isfinite(value) and value > 0):
                raise ConfigError(f"limits.{name} is {value}: expected a number above 0.")
        if self.degraded_share > 1:
            raise ConfigError(f"limits.degraded_share is {self.degraded_share}: expected 0 to 1.")


@dataclass(frozen=True, slots=True)
class Verdict:
    """What the wheels get, and why, if it is less than was wanted."""

    command: DriveCommand
    reason: str
    """For a person; empty while all is well."""
    code: str
    """Machine-readable and stable: ok, degraded, or what forbids to drive."""


class Supervisor:
    """Lets a command through, limits it, or replaces it by standing still.

    Anything stale, unknown or contradictory means standing still. The only memory is the last
    speed that was let through, for the limit of acceleration.
    """

    def __init__(self, limits: Limits, vehicle: Vehicle) -> None:
        self._limits = limits
        self._vehicle = vehicle
        self._speed = 0.0
        self._last: float | None = None

    def check(
        self,
        now: float,
        command: DriveCommand,
        estimate: PoseEstimate | None,
        link_state: str,
        link_age: float | None,
    ) -> Verdict:
        """The last word on ``command``.

        Args:
            link_state: of the microcontroller's link: only "armed" may drive.
            link_age: seconds since its last telemetry, None before the first.
        """
        refusal = (
            _refuse_command(command)
            or _refuse_link(link_state, link_age, self._limits)
            or _refuse_pose(now, estimate, self._limits)
        )
        elapsed = 0.0 if self._last is None else min(max(now - self._last, 0.0), LONGEST_TICK)
        self._last = now
        if refusal is not None:
            self._speed = 0.0
            return Verdict(STAND, refusal[1], refusal[0])
        degraded = estimate is not None and estimate.status is Status.DEGRADED
        self._speed = self._limit_speed(command.speed, elapsed, degraded)
        reach = self._vehicle.max_steering
        steering = min(max(command.steering, -reach), reach)
        allowed = DriveCommand(self._speed, steering)
        if degraded and estimate is not None:
            why = f": {estimate.reason}" if estimate.reason else ""
            return Verdict(allowed, f"Slowed down, the pose is uncertain{why}", "degraded")
        return Verdict(allowed, "", "ok")

    def _limit_speed(self, wanted: float, elapsed: float, degraded: bool) -> float:
        limits = self._limits
        top = min(limits.max_speed, self._vehicle.max_speed)
        if degraded:
            top *= limits.degraded_share
        wanted = min(max(wanted, -top), top)
        step = min(limits.max_acceleration, self._vehicle.max_acceleration) * elapsed
        before = self._speed if self._speed * wanted > 0 else 0.0
        if abs(wanted) <= abs(before):
            return wanted
        return math.copysign(min(abs(wanted), abs(before) + step), wanted)


Refusal = tuple[str, str] | None
"""Code and reason."""


def _refuse_command(command: DriveCommand) -> Refusal:
    if not (math.isfinite(command.speed) and math.isfinite(command.steering)):
        return "bad_command", "The command is not a number; this is a fault of the program."
    return None


def _refuse_link(state: str, age: float | None, limits: Limits) -> Refusal:
    if state == "estop":
        return "estop", "Emergency stop."
    if state in ("closed", "connecting"):
        return "no_link", "The microcontroller does not answer."
    if state == "link_lost":
        return "link_lost", "The microcontroller missed the computer and has stopped the motors."
    if state != "armed":
        return "not_armed", "The motors are not armed."
    if age is None or not -FUTURE <= age <= limits.max_link_age:
        return "link_silent", "No telemetry from the microcontroller just now."
    return None


def _refuse_pose(now: float, estimate: PoseEstimate | None, limits: Limits) -> Refusal:
    if estimate is None:
        return "no_pose", "The pose is not known yet."
    if estimate.status is Status.FIXING:
        return "fixing", estimate.reason or "Looking for landmarks."
    if estimate.status is Status.LOST:
        return "lost", estimate.reason or "The pose is lost."
    if not (np.isfinite(estimate.pose).all() and np.isfinite(estimate.covariance).all()):
        return "bad_pose", "The pose is not a number; this is a fault of the program."
    age = now - estimate.stamp
    if not -FUTURE <= age <= limits.max_estimate_age:
        return "pose_stale", f"The pose is {age:.1f} s old."
    if estimate.position_sigma > limits.max_position_sigma:
        sigma = 100 * estimate.position_sigma
        return "pose_uncertain", f"The position is uncertain by {sigma:.0f} cm."
    return None
