"""Obstacles that the site does not show: pass them on the left, rejoin the path, or wait."""

from __future__ import annotations

import math

import numpy as np

from polepilot.core.command import STAND, DriveCommand
from polepilot.core.control.detour import Room, find
from polepilot.core.control.memory import RADIUS, ObstacleMemory, Readings, Remembered
from polepilot.core.control.stretches import Floats
from polepilot.core.control.tracker import PathTracker
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
BEGIN = 0.80
"""So far before the place of conflict a detour begins."""
LOOK = 2.0
"""So much of the path ahead is checked for conflicts, metres."""
REJOIN = 6.0
"""So far ahead the path is taken up again at the latest."""
DETOUR_SPEED = 0.22
REPLAN_PERIOD = 0.5
BACK_OFF_AFTER = 3.0
"""Seconds of standing before an obstacle without a way round, after which it makes room."""
BACK_OFF = 0.35
FAR_LEFT = 0.35
"""An obstacle whose centre is farther left of the path than this does not stand on it: it is
passed on the right. (The paper always turns left, which would mean a way of more than a metre.)"""
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
        self._scenery = Scenery(
            site.segments(),
            [(mark.position, mark.kind.diameter / 2) for mark in site.landmarks],
        )
        self._memory = ObstacleMemory(proximity, self._scenery)
        self._detour: PathTracker | None = None
        self._way: Floats = np.empty((0, 2))
        self._rejoin_at = 0.0
        """Metres along the main path."""
        self._about: Point = (0.0, 0.0)
        self._side = 0
        """Of the present detour: 1 left, -1 right."""
        self._planned_at = -math.inf
        self._standing_since: float | None = None
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
        self._standing_since = None
        self._last = STAND
        self.reason = ""

    def blocked_for(self, now: float) -> float:
        """Seconds that it has been standing before an obstacle; 0 while it drives."""
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
        if not self._safe(pose, command):
            self.reason = "Waiting: something is too close ahead."
            command = DriveCommand(0.0, command.steering)
        if command.speed == 0 and self.active:
            if self._standing_since is None:
                self._standing_since = now
        else:
            self._standing_since = None
        self._last = command
        return command

    def _choose(self, now: float, dt: float, pose: Pose2D, tracker: PathTracker) -> DriveCommand:
        if self._backing > 0:
            return self._back_off(dt, pose)
        if self._detour is not None:
            return self._follow(now, dt, pose, tracker)
        conflict = self._conflict(tracker)
        if conflict is None:
            self.reason = ""
            command = tracker.update(pose, dt)
            if self._memory.obstacles and command.speed > DETOUR_SPEED:
                return DriveCommand(DETOUR_SPEED, command.steering)
            return command
        if now - self._planned_at >= REPLAN_PERIOD:
            self._side = 0
            if self._plan(now, pose, tracker, conflict):
                return self._follow(now, dt, pose, tracker)
        if self.blocked_for(now) > BACK_OFF_AFTER and self._close(pose):
            self._backing = BACK_OFF
            self._standing_since = None
        return STAND

    # ---- is something in the way? ------------------------------------------------------------

    def _gaps(self, points: Floats) -> Floats:
        """From the body's edge, were it at each of these points, to the nearest obstacle."""
        discs = Scenery([], self.obstacles)
        return discs.distances(points) - self._vehicle.body_radius

    def _conflict(self, tracker: PathTracker) -> tuple[float, float, Remembered] | None:
        """First and last place of conflict on the path ahead, and the obstacle; or None."""
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
        return float(along[first]), last, obstacle

    def _close(self, pose: Pose2D) -> bool:
        """Whether more room in front would help."""
        nearest = self._gaps(np.array([pose.position]))[0]
        return bool(nearest < 0.8)

    def _safe(self, pose: Pose2D, command: DriveCommand) -> bool:
        """Whether the robot could still stop before an obstacle after another moment of this."""
        discs = Scenery([], [one.body for one in self._memory.obstacles])
        if not discs.discs or command.speed == 0:
            return True
        speed = abs(command.speed)
        reach = 0.06 + speed * 0.2 + speed**2 / (2 * self._vehicle.max_acceleration)
        curvature = math.tan(command.steering) / self._vehicle.wheelbase
        gap = discs.distance(pose.position) - self._vehicle.body_radius
        steps = 4
        for index in range(1, steps + 1):
            way = math.copysign(reach * index / steps, command.speed)
            turn = way * curvature
            ahead = (
                pose.x + way * math.cos(pose.heading + turn / 2),
                pose.y + way * math.sin(pose.heading + turn / 2),
            )
            then = discs.distance(ahead) - self._vehicle.body_radius
            if then < LEAST + 0.02 and then < gap - 0.005:
                return False
        return True

    # ---- the way round -----------------------------------------------------------------------

    def _plan(
        self,
        now: float,
        pose: Pose2D,
        tracker: PathTracker,
        conflict: tuple[float, float, Remembered],
    ) -> bool:
        """Look for a way round; without one, say why."""
        self._planned_at = now
        self._detour = None
        first, last, obstacle = conflict
        points, along, gears = tracker.path_ahead(REJOIN)
        place = int(np.argmin(np.hypot(*(points - obstacle.center).T)))
        tangent = _tangent(points, place)
        aside = obstacle.center - points[place]
        left_of_path = math.cos(tangent) * aside[1] - math.sin(tangent) * aside[0]
        sides = [self._side] if self._side else [1]
        if not self._side and left_of_path > FAR_LEFT:
            sides = [-1, 1]
        free = (self._gaps(points) >= CONCERN) & (gears > 0)
        x, y = obstacle.position
        where = f"at {x:.1f}, {y:.1f}"
        for side in sides:
            # The line from the obstacle to its other side is not to be crossed.
            barrier = (obstacle.position, wrap_angle(tangent - side * math.pi / 2))
            for wanted in np.arange(last + 0.30, min(last + 1.6, along[-1] + 0.01), 0.45):
                index = int(np.searchsorted(along, wanted))
                if index >= len(points) or not free[index] or along[index] < first:
                    continue
                if self._to(pose, points[index:], float(along[index]), barrier):
                    self._side = side
                    name = "left" if side > 0 else "right"
                    self.reason = f"Passing an obstacle {where} on the {name}."
                    return True
        if not free[along > last].any():
            self.reason = f"Waiting: the way ahead is occupied {where} up to its end."
        else:
            self.reason = f"Waiting: there is no room to pass the obstacle {where} on the left."
        return False

    def _to(
        self,
        pose: Pose2D,
        rest: Floats,
        rejoin_at: float,
        barrier: tuple[Point, float],
    ) -> bool:
        """Plan a detour that ends where ``rest`` of the path begins."""
        vehicle = self._vehicle
        room = Room(
            walls=vehicle.body_radius + WALL_ROOM,
            least=vehicle.body_radius + LEAST + 0.04,
            wanted=vehicle.body_radius + KEEP,
        )
        goal = (float(rest[0, 0]), float(rest[0, 1]))
        way = find(pose.position, goal, self.obstacles, barrier, self._scenery, room)
        if way is None:
            return False
        self._way = way
        self._rejoin_at = rejoin_at
        self._about = barrier[0]
        path = np.vstack([way, rest[1 : 1 + LEAD_OUT]])
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
            self.reason = ""
            return tracker.update(pose, dt)
        rest, _, _ = detour.path_ahead(1.5)
        tight = len(rest) > 0 and self._gaps(rest).min() < LEAST + 0.02
        astray = abs(detour.deviation) > 0.12 or detour.off_route
        stuck = self.blocked_for(now) > REPLAN_PERIOD
        if (tight or astray or stuck) and now - self._planned_at >= REPLAN_PERIOD:
            found = self._plan(now, pose, tracker, self._remaining(pose, tracker))
            detour = self._detour
            if not found or detour is None:
                if self.blocked_for(now) > BACK_OFF_AFTER:
                    self._backing = BACK_OFF
                return STAND
        if stuck and self.blocked_for(now) > BACK_OFF_AFTER:
            self._backing = BACK_OFF
            self._detour = None
            return STAND
        command = detour.update(pose, dt)
        return DriveCommand(min(command.speed, DETOUR_SPEED), command.steering)

    def _remaining(self, pose: Pose2D, tracker: PathTracker) -> tuple[float, float, Remembered]:
        """The conflict that the present detour is about, seen afresh."""
        conflict = self._conflict(tracker)
        if conflict is not None:
            return conflict
        here = np.array(pose.position)
        nothing = Remembered(np.array(self._about), np.eye(2), 0.0)
        known = self._memory.obstacles or [nothing]
        nearest = min(known, key=lambda one: float(np.hypot(*(one.center - here))))
        return tracker.progress, max(self._rejoin_at - 0.30, tracker.progress), nearest

    def _back_off(self, dt: float, pose: Pose2D) -> DriveCommand:
        """Straight back, as far as the map says that there is room; nothing looks that way."""
        behind = pose.ahead(-(self._vehicle.body_radius + 0.10))
        discs = Scenery([], self.obstacles)
        room = min(self._scenery.distance(behind), discs.distance(behind))
        self._backing -= 0.12 * dt
        if self._backing <= 0 or room < self._vehicle.body_radius + WALL_ROOM:
            self._backing = 0.0
            self._standing_since = None
            return STAND
        self.reason = "Backing off to make room for passing an obstacle."
        return DriveCommand(-0.12, 0.0)


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
