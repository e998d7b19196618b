"""Follows a planned path with a steered front wheel, forward and backward."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from polepilot.core.command import STAND, DriveCommand
from polepilot.core.control.stretches import CREEP, SPACING, Stretch, cut
from polepilot.core.geometry import Point, Pose2D, wrap_angle
from polepilot.core.plan import Plan
from polepilot.core.vehicle import Vehicle

SEARCH_AHEAD = 0.40
"""The cursor looks no farther along the path than this: passes lie side by side."""
SEARCH_BACK = 0.06
REACTION = 0.10
"""Seconds until a command has turned the wheel: the target is aimed at from there."""
SHORTEST_AIM = 0.14
LONGEST_AIM = 0.34
AIM_TIME = 0.40
"""The aim lies so many seconds of driving ahead, between the two lengths above."""
STOP_BEFORE = 0.008
"""At creeping speed the motors run on for about so far."""
STOP_TIME = 0.30
OFF_ROUTE = 0.50
"""Farther than this from the path is no longer following it, metres."""


class PathTracker:
    """Gives the command that keeps `base_link` on ``plan.path``.

    The robot aims at a point of the path a little ahead of it (the paper aims at the next node
    rather than at the line between nodes: the same without its zigzag), on the circle that is
    tangent to its heading. At each change of gear it stops, turns the front wheel where it will
    be needed, and goes on.

    A cursor, bounded to a short window, remembers how far it has come; it never runs back and
    never jumps to a neighbouring pass. The end of a stretch counts as reached when the robot has
    passed it, however far aside, so that nothing is circled for ever.

    Args:
        rolling: the command that is being carried out, where the robot is to change over to this
            path without stopping.
    """

    def __init__(self, plan: Plan, vehicle: Vehicle, rolling: DriveCommand = STAND) -> None:
        self._vehicle = vehicle
        self._stretches = cut(plan, vehicle)
        self._index = 0
        self._along = 0.0
        self._deviation = 0.0
        self._distance = 0.0
        self._against = 0.0
        self._joining = False
        self._hold: float | None = 0.0
        self._speed = 0.0
        self._steering = 0.0
        self._roll(rolling)
        self._idle_way = 0.0
        self._mark = 0.0
        self._target: Point = (float(plan.path[0, 0]), float(plan.path[0, 1]))
        self._end: Point = (float(plan.path[-1, 0]), float(plan.path[-1, 1]))

    @property
    def length(self) -> float:
        """Of the whole path, metres."""
        return self._stretches[-1].begin + self._stretches[-1].length if self._stretches else 0.0

    @property
    def progress(self) -> float:
        """Metres along the path, never less than before (but for `resume_at`)."""
        if self.done:
            return self.length
        stretch = self._stretches[self._index]
        return stretch.begin + min(self._along, stretch.length)

    @property
    def done(self) -> bool:
        """Whether the path has been driven to its end."""
        return self._index >= len(self._stretches)

    @property
    def target(self) -> Point:
        """The point of the path that is aimed at, `map`."""
        return self._target

    @property
    def deviation(self) -> float:
        """How far `base_link` is left of the path (right negative) as driven, metres."""
        return self._deviation

    @property
    def gear(self) -> int:
        """1 forward, -1 backward; 1 when done."""
        return 1 if self.done else self._stretches[self._index].gear

    @property
    def aligned(self) -> bool:
        """Whether the robot points along the path, within 45 degrees, seen in its gear."""
        return self._against < 0.3

    @property
    def off_route(self) -> bool:
        """Whether following has failed and the path should be planned anew or taken up again."""
        return bool(self.off_route_reason)

    @property
    def off_route_reason(self) -> str:
        """Why, for a person; empty while all is well."""
        if self.done:
            return ""
        # Who comes from a detour may have to turn round first.
        turning = 2.5 * self._vehicle.min_turn_radius + 0.30 if self._joining else 0.0
        if self._distance > max(OFF_ROUTE, turning):
            return f"the robot is {100 * self._distance:.0f} cm away from its path"
        if self._idle_way > math.tau * self._vehicle.min_turn_radius * 1.15 + 0.8:
            return f"{self._idle_way:.1f} m driven without getting ahead on the path"
        return ""

    def resume_at(self, progress: float, rolling: DriveCommand = STAND) -> None:
        """Take the path up again ``progress`` metres from its start (clamped to its ends).

        Args:
            rolling: as for the tracker itself.
        """
        progress = min(max(progress, 0.0), self.length)
        self._index = 0
        while (
            self._index < len(self._stretches) - 1
            and progress >= self._stretches[self._index + 1].begin
        ):
            self._index += 1
        if self._stretches:
            self._along = progress - self._stretches[self._index].begin
        self._begin_stretch(standing=abs(self._speed) < CREEP)
        self._distance = 0.0
        self._joining = True
        self._roll(rolling)

    def take_up(self) -> None:
        """The robot has stood since the last update: begin again from where it is."""
        self._hold = 0.0
        self._speed = 0.0
        self._mark, self._idle_way = self._along, 0.0

    def cut_short(self, most: float) -> bool:
        """Leave out the rest of a forward stretch if that is at most ``most`` metres.

        For a robot that is held before a wall: it goes on with the next stretch, backward, or is
        done. Says whether it did.
        """
        if self.done:
            return False
        stretch = self._stretches[self._index]
        if stretch.gear < 0 or stretch.length - self._along > most:
            return False
        self._index += 1
        self._speed = 0.0
        if self._index == len(self._stretches):
            self._target = self._end
        else:
            self._along = 0.0
            self._begin_stretch(standing=True)
        return True

    def path_ahead(
        self, horizon: float
    ) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.int8]]:
        """What is still to be driven, up to ``horizon`` metres.

        Returns:
            Points (M x 2, `map`), metres along the path (M), gears (M). Empty when done.
        """
        points, along, gears = [], [], []
        here = self.progress
        for stretch in self._stretches[self._index :]:
            inside = stretch.begin + stretch.along
            chosen = (inside >= here - 1e-9) & (inside <= here + horizon)
            if not chosen.any():
                if inside[0] > here + horizon:
                    break
                continue
            points.append(stretch.points[chosen])
            along.append(inside[chosen])
            gears.append(np.full(int(chosen.sum()), stretch.gear, np.int8))
        if not points:
            return np.empty((0, 2)), np.empty(0), np.empty(0, np.int8)
        return np.vstack(points), np.concatenate(along), np.concatenate(gears)

    def update(self, pose: Pose2D, dt: float) -> DriveCommand:
        """The command for the next ``dt`` seconds, from where the robot is now.

        Args:
            pose: of `base_link` in `map`.
        """
        if self.done:
            return STAND
        stretch = self._stretches[self._index]
        self._locate(stretch, pose)
        rest = stretch.length - self._along
        if rest <= STOP_BEFORE and self._hold is None:
            self._index += 1
            if self._index == len(self._stretches):
                self._speed = 0.0
                self._target = self._end
                return DriveCommand(0.0, self._steering)
            self._along = 0.0
            self._begin_stretch(standing=False)
            stretch = self._stretches[self._index]
            self._locate(stretch, pose)
            rest = stretch.length - self._along
        steering = self._steer(stretch, pose)
        if self._hold is not None:
            turned = abs(steering - self._steering)
            if turned > 0.05:
                self._hold = max(self._hold, turned / self._vehicle.steering_rate + 0.1)
            self._steering = steering
            self._speed = 0.0
            self._hold -= dt
            if self._hold > 1e-9:
                return DriveCommand(0.0, steering)
            self._hold = None
        self._steering = steering
        self._speed = self._pace(stretch, rest, dt)
        self._idle_way += abs(self._speed) * dt
        if self._along > self._mark + 0.05:
            self._mark, self._idle_way = self._along, 0.0
        return DriveCommand(stretch.gear * self._speed, steering)

    def _roll(self, command: DriveCommand) -> None:
        if command.speed * self.gear >= CREEP:
            self._hold = None
            self._speed, self._steering = abs(command.speed), command.steering

    def _begin_stretch(self, *, standing: bool) -> None:
        self._hold = 0.0 if standing else STOP_TIME
        self._mark = self._along
        self._idle_way = 0.0

    def _locate(self, stretch: Stretch, pose: Pose2D) -> None:
        """Move the cursor to the nearest point of the window, and measure the deviation."""
        low = int(np.searchsorted(stretch.along, self._along - SEARCH_BACK)) - 1
        high = int(np.searchsorted(stretch.along, self._along + SEARCH_AHEAD)) + 1
        # The cursor may stand beyond the end of the stretch; the last piece is always in view.
        low = min(max(low, 0), len(stretch.along) - 2)
        high = min(max(high, low + 1), len(stretch.along) - 1)
        starts = stretch.points[low:high]
        steps = stretch.points[low + 1 : high + 1] - starts
        lengths = stretch.along[low + 1 : high + 1] - stretch.along[low:high]
        units = steps / lengths[:, None]
        offset = np.array([pose.x, pose.y]) - starts
        along = (offset * units).sum(axis=1)
        inside = np.clip(along, 0.0, lengths)
        aside = units[:, 0] * offset[:, 1] - units[:, 1] * offset[:, 0]
        heading = pose.heading if stretch.gear > 0 else pose.heading + math.pi
        # A pass in the other direction may be near, too: it must not be taken for this one.
        against = 1 - units @ np.array([math.cos(heading), math.sin(heading)])
        distance = aside**2 + (along - inside) ** 2
        best = int(np.argmin(distance + (0.15 * against) ** 2))
        last = len(stretch.along) - 2
        # Beyond the end of the stretch the cursor runs on, so that overshooting ends it.
        here = along[best] if low + best == last and along[best] > 0 else inside[best]
        self._along = max(self._along, float(stretch.along[low + best] + here))
        self._deviation = float(aside[best])
        self._against = float(against[best])
        self._distance = math.sqrt(float(distance[best]))
        if low + best == last and along[best] > lengths[best]:
            self._distance = abs(self._deviation)
        if self._distance < 0.10 and self.aligned:
            self._joining = False

    def _steer(self, stretch: Stretch, pose: Pose2D) -> float:
        """The front wheel's angle that leads `base_link` through the target."""
        vehicle, gear = self._vehicle, stretch.gear
        reach = min(max(SHORTEST_AIM, AIM_TIME * self._speed), LONGEST_AIM)
        reach += 0.5 * abs(self._deviation)
        ahead = self._speed * REACTION
        self._target = stretch.point_at(self._along + ahead + reach)
        if ahead > 0:
            curvature = math.tan(self._steering) / vehicle.wheelbase
            turn = gear * ahead * curvature
            pose = Pose2D(
                pose.x + gear * ahead * math.cos(pose.heading + turn / 2),
                pose.y + gear * ahead * math.sin(pose.heading + turn / 2),
                wrap_angle(pose.heading + turn),
            )
        x, y = pose.to_local(self._target)
        if gear * x <= 0:
            # The target lies behind: turn as tightly as possible towards it.
            return math.copysign(vehicle.max_steering, y)
        # Same circle for both gears: tangent to the heading, through the target.
        curvature = 2 * y / (x * x + y * y)
        steering = math.atan(curvature * vehicle.wheelbase)
        return min(max(steering, -vehicle.max_steering), vehicle.max_steering)

    def _pace(self, stretch: Stretch, rest: float, dt: float) -> float:
        """Speed without its sign: limits of the path, of acceleration, and of being astray."""
        ahead = min(max(self._along + self._speed * REACTION, 0.0), stretch.length)
        index = min(int(np.searchsorted(stretch.along, ahead)), len(stretch.along) - 1)
        speed = float(stretch.speed[index])
        if rest <= SPACING:
            speed = CREEP
        if abs(self._deviation) > 0.10:
            speed = min(speed, self._vehicle.max_speed / 2)
        speed = min(speed, self._speed + self._vehicle.max_acceleration * dt)
        return min(max(speed, CREEP), self._vehicle.max_speed)
