"""Obstacles that the site does not show: pass them on the left, rejoin the path, or wait."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from polepilot.core.command import STAND, DriveCommand
from polepilot.core.control.detour import Room, find
from polepilot.core.control.memory import RADIUS, ObstacleMemory, Readings, Remembered
from polepilot.core.control.stretches import Floats
from polepilot.core.control.tracker import SEARCH_AHEAD, PathTracker
from polepilot.core.geometry import Point, Pose2D, wrap_angle
from polepilot.core.observation import PoseEstimate
from polepilot.core.plan import Plan, PlanPart, Prediction
from polepilot.core.scenery import Disc, Scenery
from polepilot.core.site import Site
from polepilot.core.vehicle import Proximity, Vehicle

KEEP = 0.30
"""From the body to an obstacle (paper, "obstacles"), metres."""
LEAST = 0.15
"""No nearer than this while passing; the robot stops first."""
CONCERN = 0.25
"""A path that comes nearer than this to an obstacle has to be left."""
WALL_ROOM = 0.05
"""From the body to walls and poles on a detour."""
WALL_STOP = 0.025
"""It stops where a detour leads nearer to a wall than this."""
BEGIN = 0.80
"""So far before the place of conflict a detour begins."""
LOOK = 2.0
"""So much of the path ahead is checked for conflicts, metres."""
ASTRAY = 0.10
"""Farther from its path than this the plan says nothing about walls, metres."""
AWAY = 0.20
"""Farther than this from the next piece of the path it is not simply followed again, metres."""
COME_AWAY = 0.6
"""Metres from where it first had to stand; nearer it still counts as blocked."""
FIRST_REJOIN = 1.6
"""So far behind the conflict the path is taken up again at the latest, metres."""
REJOIN = 6.0
"""So far ahead of the robot after it has waited for long."""
PATIENCE = 8.0
"""Seconds of waiting, after which any way round will do: on the right, too, and a long one."""
DETOUR_SPEED = 0.22
REPLAN_PERIOD = 0.5
BACK_OFF_AFTER = 3.0
"""Seconds of standing before an obstacle without a way round, after which it makes room."""
BACK_OFF = 0.35
TWITCH = 0.08
"""Who has not come farther than this has been standing, metres."""
FAR_LEFT = 0.35
"""An obstacle whose centre is farther left of the path than this does not stand on it: it is
passed on the right. (The paper always turns left, which would mean a way of more than a metre.)"""
RUN_UP = 15
"""Samples of the path that have to be free, and forward, where it is taken up again."""
LEAD_OUT = 30
"""Samples of the path that are appended to a detour, so that it ends along the path."""


class ObstacleAvoidance:
    """Drives in the tracker's place while something stands in the way.

    The paper's rule: turn left, keep 30 cm from the obstacle, rejoin the route. Readings that the
    site explains are no obstacles. Where the left is closed by walls, the robot stands and says
    so; it goes on as soon as the obstacle has gone.
    """

    def __init__(self, proximity: Proximity, vehicle: Vehicle, site: Site) -> None:
        self._proximity = proximity
        self._vehicle = vehicle
        poles = [(mark.position, mark.kind.diameter / 2) for mark in site.landmarks]
        self._barriers = Scenery(site.barriers(), poles)
        self._memory = ObstacleMemory(proximity, Scenery(site.segments(), poles))
        self._detour: PathTracker | None = None
        self._way: Floats = np.empty((0, 2))
        self._rejoin_at = 0.0
        """Metres along the main path."""
        self._about: Point = (0.0, 0.0)
        self._away = False
        """A detour was begun that has not come back to the path yet."""
        self._side = 0
        """Of the present detour: 1 left, -1 right."""
        self._planned_at = -math.inf
        self._standing_since: float | None = None
        self._stood_at: Point = (0.0, 0.0)
        self._blocked_since: float | None = None
        self._blocked_at: Point = (0.0, 0.0)
        self._backing = 0.0
        self._last = STAND
        self.reason = ""
        """Why the robot does not simply follow its path, for a person; empty if it does."""

    @property
    def active(self) -> bool:
        """Whether the robot drives, or waits, away from its path's command."""
        return bool(self.reason)

    @property
    def target(self) -> Point | None:
        """The point of the detour that is aimed at, `map`."""
        return None if self._detour is None else self._detour.target

    @property
    def obstacles(self) -> tuple[Disc, ...]:
        """What is remembered: centre and the radius to keep clear of, `map`."""
        return tuple(one.disc for one in self._memory.obstacles)

    def reset(self) -> None:
        """Forget all: the robot was carried away, or its pose was found anew."""
        self._memory.forget()
        self._detour = None
        self._backing = 0.0
        self._standing_since = self._blocked_since = None
        self._last = STAND
        self.reason = ""

    def take_up(self) -> None:
        """It goes on after a pause: what it waited for before does not count any more."""
        self._standing_since = self._blocked_since = None
        self._planned_at = -math.inf
        self._last = STAND
        if self._detour is not None:
            self._detour.take_up()

    def blocked_for(self, now: float) -> float:
        """Seconds since the robot last got ahead; 0 unless something is in the way."""
        if self._blocked_since is None or not self.active:
            return 0.0
        return now - self._blocked_since

    def make_room(self, now: float, pose: Pose2D) -> None:
        """Back off a little, if there is room: the board holds the robot before something."""
        self._backing = BACK_OFF
        if self._blocked_since is None:
            self._blocked_since, self._blocked_at = now, pose.position

    def _stood_for(self, now: float) -> float:
        return 0.0 if self._standing_since is None else now - self._standing_since

    def update(
        self,
        now: float,
        dt: float,
        estimate: PoseEstimate,
        readings: Readings,
        tracker: PathTracker,
    ) -> DriveCommand:
        """The command for the next ``dt`` seconds: the tracker's, or one that avoids.

        The tracker is updated here, and only while it is followed: its progress stands still
        during a detour and goes on where the path is rejoined.

        Args:
            readings: metres from each sensor (left, centre, right), None where there is none.
        """
        pose = estimate.pose
        self._memory.observe(now, pose, readings, estimate.position_sigma, estimate.heading_sigma)
        command = self._choose(now, dt, pose, tracker)
        astray = abs(tracker.deviation) > ASTRAY or not tracker.aligned
        if not self._safe(pose, command, astray):
            self.reason = "Waiting: something is too close ahead."
            if command.speed > 0 and self._stood_for(now) > BACK_OFF_AFTER:
                self._backing = BACK_OFF
            command = DriveCommand(0.0, command.steering)
        self._watch(now, pose, command)
        self._last = command
        return command

    def _watch(self, now: float, pose: Pose2D, command: DriveCommand) -> None:
        """For how long has it been standing, and has it not come away from here?"""
        if self._blocked_since is not None and pose.distance_to(self._blocked_at) > COME_AWAY:
            self._blocked_since = None
        if not self.active:
            self._standing_since = None
            return
        if self._standing_since is not None:
            # A short twitch after each new plan is no progress.
            if pose.distance_to(self._stood_at) > TWITCH:
                self._standing_since = None
        elif command.speed == 0:
            self._standing_since, self._stood_at = now, pose.position
        if self._blocked_since is None and command.speed == 0:
            self._blocked_since, self._blocked_at = now, pose.position

    def _choose(self, now: float, dt: float, pose: Pose2D, tracker: PathTracker) -> DriveCommand:
        if self._backing > 0:
            return self._back_off(dt, pose)
        if self._detour is not None:
            return self._follow(now, dt, pose, tracker)
        conflict = self._conflict(tracker)
        if conflict is None and self._away:
            self._away = self._beside(pose, tracker)
            if self._away:
                conflict = self._remaining(pose, tracker)
        if conflict is None:
            self.reason = ""
            command = tracker.update(pose, dt)
            near = self._gaps(np.array([pose.position]))[0] < LOOK
            if near and command.speed > DETOUR_SPEED:
                return DriveCommand(DETOUR_SPEED, command.steering)
            return command
        if now - self._planned_at >= REPLAN_PERIOD:
            self._side = 0
            if self._plan(now, pose, tracker, conflict):
                self._standing_since = None
                return self._follow(now, dt, pose, tracker)
        if self._stood_for(now) > BACK_OFF_AFTER and self._close(pose):
            self._backing = BACK_OFF
            self._standing_since = None
        return STAND

    # ---- is something in the way? ------------------------------------------------------------

    def _gaps(self, points: Floats) -> Floats:
        """From the body's edge, were it at each of these points, to the nearest obstacle."""
        discs = Scenery([], self.obstacles)
        return discs.distances(points) - self._vehicle.body_radius

    def _conflict(self, tracker: PathTracker) -> tuple[float, Remembered] | None:
        """Where the next conflict on the path ahead ends, and the obstacle; or None."""
        known = self._memory.obstacles
        if not known:
            return None
        points, along, _ = tracker.path_ahead(LOOK)
        if len(points) == 0:
            return None
        near = self._gaps(points) < CONCERN
        if not near.any():
            return None
        first = int(np.argmax(near))
        if along[first] - along[0] > BEGIN:
            return None
        inside = along[near]
        # One conflict ends where the path is free for half a metre.
        breaks = np.flatnonzero(np.diff(inside) > 0.5)
        last = float(inside[breaks[0]] if len(breaks) else inside[-1])
        place = points[first]
        obstacle = min(known, key=lambda one: math.dist(one.position, place))
        return last, obstacle

    def _beside(self, pose: Pose2D, tracker: PathTracker) -> bool:
        """Whether the next piece of the path is too far away to be followed from here."""
        points, _, _ = tracker.path_ahead(SEARCH_AHEAD)
        return len(points) > 0 and float(np.hypot(*(points - pose.position).T).min()) > AWAY

    def _close(self, pose: Pose2D) -> bool:
        """Whether more room in front would help."""
        nearest = self._gaps(np.array([pose.position]))[0]
        return bool(nearest < 0.8)

    def _safe(self, pose: Pose2D, command: DriveCommand, astray: bool) -> bool:
        """Whether the robot could still stop in time after another moment of this command.

        Before obstacles always; before walls where it is not on its planned path.
        """
        bodies = [one.body for one in self._memory.obstacles]
        astray = astray or self.active
        if command.speed == 0 or not (bodies or astray):
            return True
        discs = Scenery([], bodies)
        walls = self._barriers.near(pose.position, 1.0) if astray else Scenery()
        speed = abs(command.speed)
        reach = 0.06 + speed * 0.2 + speed**2 / (2 * self._vehicle.max_acceleration)
        curvature = math.tan(command.steering) / self._vehicle.wheelbase
        way = np.sign(command.speed) * reach * np.arange(5) / 4
        turn = way * curvature / 2
        line = np.column_stack(
            [
                pose.x + way * np.cos(pose.heading + turn),
                pose.y + way * np.sin(pose.heading + turn),
            ]
        )
        for scenery, least in ((discs, LEAST + 0.02), (walls, WALL_STOP)):
            gaps = scenery.distances(line) - self._vehicle.body_radius
            if ((gaps[1:] < least) & (gaps[1:] < gaps[0] - 0.005)).any():
                return False
        return True

    # ---- the way round -----------------------------------------------------------------------

    def _plan(
        self,
        now: float,
        pose: Pose2D,
        tracker: PathTracker,
        conflict: tuple[float, Remembered],
    ) -> bool:
        """Look for a way round; without one, say why."""
        self._planned_at = now
        self._detour = None
        last, obstacle = conflict
        points, along, gears = tracker.path_ahead(REJOIN)
        place = int(np.argmin(np.hypot(*(points - obstacle.center).T)))
        tangent = _tangent(points, place)
        aside = obstacle.center - points[place]
        left_of_path = math.cos(tangent) * aside[1] - math.sin(tangent) * aside[0]
        sides = [self._side] if self._side else [1]
        if not self._side and left_of_path > FAR_LEFT:
            sides = [-1, 1]
        farthest = last + FIRST_REJOIN
        if self.blocked_for(now) > PATIENCE:
            sides, farthest = [1, -1], float(along[-1])
        free = _stays((self._gaps(points) >= CONCERN) & (gears > 0))
        farthest = min(farthest, float(along[-1]))
        wanted = np.append(np.arange(last + 0.30, farthest - 0.10, 0.30), max(farthest, last))
        places = np.searchsorted(along, wanted)
        places = places[places < len(points)]
        places = places[free[places]]
        if self.blocked_for(now) <= PATIENCE:
            places = places[_onward(pose, points, places)]
        where = f"{max(0.0, pose.distance_to(obstacle.position)):.1f} m away"
        for side in sides:
            # The line from the obstacle to its other side is not to be crossed.
            barrier = (obstacle.position, wrap_angle(tangent - side * math.pi / 2))
            if self._to(pose, points, along, places, barrier):
                self._side = side
                name = "left" if side > 0 else "right"
                self.reason = f"Passing an obstacle on the {name}."
                return True
        if not free[along > last].any():
            self.reason = f"Waiting: the way ahead is occupied, {where}."
        else:
            name = "on the left" if sides == [1] else "on either side"
            self.reason = f"Waiting: there is no room to pass the obstacle {where} {name}."
        return False

    def _to(
        self,
        pose: Pose2D,
        points: Floats,
        along: Floats,
        places: NDArray[np.int64],
        barrier: tuple[Point, float],
    ) -> bool:
        """Plan a detour to one of these places of the path."""
        vehicle = self._vehicle
        room = Room(
            walls=vehicle.body_radius + WALL_ROOM,
            least=vehicle.body_radius + LEAST + 0.04,
            wanted=vehicle.body_radius + KEEP,
        )
        goals = [(float(points[index, 0]), float(points[index, 1])) for index in places]
        found = find(pose.position, goals, self.obstacles, barrier, self._barriers, room)
        if found is None:
            return False
        index = int(places[found[0]])
        self._way = found[1]
        self._rejoin_at = float(along[index])
        self._about = barrier[0]
        self._away = True
        # What follows in the same gear: the detour is to end along the path, but not to back.
        rest = points[index + 1 : index + 1 + LEAD_OUT]
        path = np.vstack([self._way, rest[: _before_gear_change(rest)]])
        self._detour = PathTracker(_as_plan(path), vehicle, rolling=self._last)
        return True

    def _follow(self, now: float, dt: float, pose: Pose2D, tracker: PathTracker) -> DriveCommand:
        detour = self._detour
        if detour is None:
            return STAND
        steps = float(np.hypot(*np.diff(self._way, axis=0).T).sum())
        if detour.progress >= steps or detour.done:
            tracker.resume_at(self._rejoin_at + detour.progress - steps, rolling=self._last)
            self._detour = None
            self._away = False
            self.reason = ""
            return tracker.update(pose, dt)
        rest, _, _ = detour.path_ahead(1.5)
        tight = len(rest) > 0 and self._gaps(rest).min() < LEAST + 0.02
        astray = abs(detour.deviation) > 0.12 or detour.off_route
        stuck = self._stood_for(now) > REPLAN_PERIOD
        if (tight or astray or stuck) and now - self._planned_at >= REPLAN_PERIOD:
            found = self._plan(now, pose, tracker, self._remaining(pose, tracker))
            detour = self._detour
            if not found or detour is None:
                if self._stood_for(now) > BACK_OFF_AFTER:
                    self._backing = BACK_OFF
                return STAND
        if stuck and self._stood_for(now) > BACK_OFF_AFTER:
            self._backing = BACK_OFF
            self._detour = None
            return STAND
        command = detour.update(pose, dt)
        return DriveCommand(min(command.speed, DETOUR_SPEED), command.steering)

    def _remaining(self, pose: Pose2D, tracker: PathTracker) -> tuple[float, Remembered]:
        """The conflict that the present detour is about, seen afresh."""
        conflict = self._conflict(tracker)
        if conflict is not None:
            return conflict
        here = np.array(pose.position)
        nothing = Remembered(np.array(self._about), np.eye(2), 0.0)
        known = self._memory.obstacles or [nothing]
        nearest = min(known, key=lambda one: float(np.hypot(*(one.center - here))))
        return max(self._rejoin_at - 0.30, tracker.progress), nearest

    def _back_off(self, dt: float, pose: Pose2D) -> DriveCommand:
        """Straight back, as far as the map says that there is room; nothing looks that way."""
        behind = pose.ahead(-(self._vehicle.body_radius + 0.10))
        discs = Scenery([], self.obstacles)
        room = min(self._barriers.distance(behind), discs.distance(behind))
        self._backing -= 0.12 * dt
        if self._backing <= 0 or room < self._vehicle.body_radius + WALL_ROOM:
            self._backing = 0.0
            self._standing_since = None
            return STAND
        self.reason = "Backing off to make room."
        self._away = True
        return DriveCommand(-0.12, 0.0)


def _onward(pose: Pose2D, points: Floats, places: NDArray[np.int64]) -> NDArray[np.bool_]:
    """Which places can be arrived at along the path, not against it: the next pass comes back."""
    offset = points[places] - pose.position
    along = points[np.minimum(places + 1, len(points) - 1)] - points[np.maximum(places - 1, 0)]
    onward: NDArray[np.bool_] = (offset * along).sum(axis=1) > 0
    return onward


def _stays(good: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Where it is good, and remains so for the next 30 cm (or to the end)."""
    result = good.copy()
    for shift in range(1, min(RUN_UP, len(good))):
        result[:-shift] &= good[shift:]
    return result


def _before_gear_change(points: Floats) -> int:
    """How many of the points come before the line turns back on itself."""
    steps = np.diff(points, axis=0)
    if len(steps) < 2:
        return len(points)
    back = (steps[:-1] * steps[1:]).sum(axis=1) < 0
    return int(np.argmax(back)) + 2 if back.any() else len(points)


def _tangent(points: Floats, index: int) -> float:
    """Direction of the line at one of its points."""
    first, last = max(index - 1, 0), min(index + 1, len(points) - 1)
    step = points[last] - points[first]
    return math.atan2(step[1], step[0])


def _as_plan(path: Floats) -> Plan:
    count = len(path)
    return Plan(
        mode="route",
        path=path,
        gear=np.ones(count - 1, np.int8),
        parts=(PlanPart("route", 0, count - 1),),
        unreachable=(),
        predicted=Prediction(1.0, 0.0, 0.0, 0),
        tool_width=2 * RADIUS,
        clearance=0.0,
        min_turn_radius=0.0,
    )
