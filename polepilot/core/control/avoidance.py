"""Obstacles that the site does not show: pass them on the left, rejoin the path, or wait."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from polepilot.core.command import STAND, DriveCommand
from polepilot.core.control.detour import Room, find
from polepilot.core.control.memory import RADIUS, ObstacleMemory, Readings, Remembered
from polepilot.core.control.patience import Patience
from polepilot.core.control.places import (
    Floats,
    as_plan,
    before_gear_change,
    beside,
    braking_line,
    onward,
    stays,
    tangent,
)
from polepilot.core.control.stretches import SPACING
from polepilot.core.control.tracker import SEARCH_AHEAD, PathTracker
from polepilot.core.control.way_back import Curves, Way, goals_on, ways_back
from polepilot.core.geometry import Point, Pose2D, wrap_angle
from polepilot.core.observation import PoseEstimate
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
HELPS = 0.8
"""It makes room only before what is nearer than this, metres."""
FAR_LEFT = 0.35
"""An obstacle whose centre is farther left of the path than this does not stand on it: it is
passed on the right. (The paper always turns left, which would mean a way of more than a metre.)"""
BACK_SPEED = 0.12
"""Of driving backward where no plan says so, m/s: nothing looks that way."""
HELD_UP = 2.0
"""Seconds of standing on the way back to the path; a change of gear takes less."""
UNSEEN = 3.0
"""Seconds without a reading of what it waits for, after which it goes to look."""
LEAD_OUT = 30
"""Samples of the path that are appended to a detour, so that it ends along the path."""


class ObstacleAvoidance:
    """Drives in the tracker's place while something stands in the way.

    The paper's rule: turn left, keep 30 cm from the obstacle, rejoin the route. Readings that the
    site explains are no obstacles. Where the left is closed by walls, the robot stands and says
    so. Once the obstacle has gone, it takes its path up where it left it, by curves that its front
    wheel can drive: where it stands then, there may be no room to turn round.

    Args:
        curves: ways from one pose to another that the front wheel can drive.
    """

    def __init__(self, proximity: Proximity, vehicle: Vehicle, site: Site, curves: Curves) -> None:
        self._proximity = proximity
        self._vehicle = vehicle
        self._curves = curves
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
        self._search: Iterator[Way | None] | None = None
        """For a way back to the path, under way."""
        self._returning = False
        """The detour is a way back to the path, not one round an obstacle."""
        self._looking = False
        """It goes back to its path to look whether what it waits for is still there."""
        self._looked = False
        """It did so once since it was blocked."""
        self._side = 0
        """Of the present detour: 1 left, -1 right."""
        self._planned_at = -math.inf
        self._patience = Patience()
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
        self._detour = self._search = None
        self._backing = 0.0
        self._patience.forget()
        self._last = STAND
        self.reason = ""

    def take_up(self) -> None:
        """It goes on after a pause: what it waited for before does not count any more."""
        self._patience.forget()
        self._planned_at = -math.inf
        self._search = None
        self._looked = False
        self._last = STAND
        if self._detour is not None:
            self._detour.take_up()

    def blocked_for(self, now: float) -> float:
        """Seconds since the robot last got ahead; 0 unless something is in the way."""
        return self._patience.blocked_for(now) if self.active else 0.0

    def make_room(self, now: float, pose: Pose2D) -> None:
        """Back off a little, if there is room: the board holds the robot before something."""
        self._backing = BACK_OFF
        self._patience.block(now, pose)

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
            if command.speed > 0 and self._patience.stood_for(now) > BACK_OFF_AFTER:
                self._backing = BACK_OFF
            command = DriveCommand(0.0, command.steering)
        self._patience.watch(
            now,
            pose,
            stands=command.speed == 0,
            waits=self.active,
            gives_way=self._backing > 0 or (self._detour is not None and self._looking),
        )
        self._looked &= self._patience.blocked
        self._last = command
        return command

    def _choose(self, now: float, dt: float, pose: Pose2D, tracker: PathTracker) -> DriveCommand:
        if self._backing > 0:
            return self._back_off(dt, pose)
        if self._detour is not None:
            return self._follow(now, dt, pose, tracker)
        conflict = self._conflict(tracker)
        rest = tracker.path_ahead(SEARCH_AHEAD)
        if conflict is None and self._away:
            self._away = beside(pose, *rest)
            if self._away:
                return self._return(now, dt, pose, tracker)
        if conflict is None:
            self._search = None
            self.reason = ""
            command = tracker.update(pose, dt)
            if self._gap(pose) < LOOK and command.speed > DETOUR_SPEED:
                return DriveCommand(DETOUR_SPEED, command.steering)
            return command
        if self._looking and self._search is not None:
            return self._return(now, dt, pose, tracker)
        self._search = None
        if now - self._planned_at >= REPLAN_PERIOD:
            self._side = 0
            if self._plan(now, pose, tracker, conflict):
                self._patience.move_on()
                return self._follow(now, dt, pose, tracker)
        if self._patience.stood_for(now) > BACK_OFF_AFTER and self._gap(pose) < HELPS:
            self._backing = BACK_OFF
            self._patience.move_on()
        elif not self._looked and now - conflict[1].seen > UNSEEN and beside(pose, *rest):
            # It stands where it made room, and nothing is to be seen from here.
            self._looked = True
            self._begin_search(now, pose, tracker, look=True)
        return STAND

    # ---- is something in the way? ------------------------------------------------------------

    def _gap(self, pose: Pose2D) -> float:
        """From the body's edge to the nearest obstacle."""
        return float(self._gaps(np.array([pose.position]))[0])

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

    def _safe(self, pose: Pose2D, command: DriveCommand, astray: bool) -> bool:
        """Whether the robot could still stop in time after another moment of this command.

        Before obstacles always; before walls where it is not on its planned path.
        """
        bodies = [one.body for one in self._memory.obstacles]
        astray = astray or self.active
        if command.speed == 0 or not (bodies or astray):
            return True
        walls = self._barriers.near(pose.position, 1.0) if astray else Scenery()
        line = braking_line(pose, command, self._vehicle)
        for scenery, least in ((Scenery([], bodies), LEAST + 0.02), (walls, WALL_STOP)):
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
        direction = tangent(points, place)
        aside = obstacle.center - points[place]
        left_of_path = math.cos(direction) * aside[1] - math.sin(direction) * aside[0]
        sides = [self._side] if self._side else [1]
        if not self._side and left_of_path > FAR_LEFT:
            sides = [-1, 1]
        farthest = last + FIRST_REJOIN
        if self.blocked_for(now) > PATIENCE:
            sides, farthest = [1, -1], float(along[-1])
        free = stays((self._gaps(points) >= CONCERN) & (gears > 0))
        farthest = min(farthest, float(along[-1]))
        wanted = np.append(np.arange(last + 0.30, farthest - 0.10, 0.30), max(farthest, last))
        places = np.searchsorted(along, wanted)
        places = places[places < len(points)]
        places = places[free[places]]
        if self.blocked_for(now) <= PATIENCE:
            places = places[onward(pose, points, places)]
        where = f"{max(0.0, pose.distance_to(obstacle.position)):.1f} m away"
        for side in sides:
            # The line from the obstacle to its other side is not to be crossed.
            barrier = None
            if obstacle.confirmed:
                barrier = (obstacle.position, wrap_angle(direction - side * math.pi / 2))
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
        barrier: tuple[Point, float] | None,
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
        if barrier is not None:
            self._about = barrier[0]
        self._away = True
        self._returning = self._looking = False
        # What follows in the same gear: the detour is to end along the path, but not to back.
        rest = points[index + 1 : index + 1 + LEAD_OUT]
        path = np.vstack([self._way, rest[: before_gear_change(rest)]])
        plan = as_plan(path, np.ones(len(path) - 1, np.int8), 2 * RADIUS)
        self._detour = PathTracker(plan, vehicle, rolling=self._last)
        return True

    def _follow(self, now: float, dt: float, pose: Pose2D, tracker: PathTracker) -> DriveCommand:
        detour = self._detour
        if detour is None:
            return STAND
        steps = float(np.hypot(*np.diff(self._way, axis=0).T).sum())
        if detour.progress >= steps or detour.done:
            tracker.resume_at(self._rejoin_at + detour.progress - steps, rolling=self._last)
            self._detour = None
            self._away = self._looking = False
            self.reason = ""
            return tracker.update(pose, dt)
        rest, _, _ = detour.path_ahead(1.5)
        tight = len(rest) > 0 and self._gaps(rest).min() < LEAST + 0.02
        astray = abs(detour.deviation) > 0.12 or detour.off_route
        if self._returning:
            return self._follow_back(now, dt, pose, detour, tight or astray)
        stuck = self._patience.stood_for(now) > REPLAN_PERIOD
        if (tight or astray or stuck) and now - self._planned_at >= REPLAN_PERIOD:
            found = self._plan(now, pose, tracker, self._remaining(pose, tracker))
            detour = self._detour
            if not found or detour is None:
                if self._patience.stood_for(now) > BACK_OFF_AFTER:
                    self._backing = BACK_OFF
                return STAND
        if stuck and self._patience.stood_for(now) > BACK_OFF_AFTER:
            self._backing = BACK_OFF
            self._detour = None
            return STAND
        command = detour.update(pose, dt)
        return DriveCommand(min(command.speed, DETOUR_SPEED), command.steering)

    def _follow_back(
        self, now: float, dt: float, pose: Pose2D, detour: PathTracker, wrong: bool
    ) -> DriveCommand:
        """Along the way back to the path, unless it has to be looked for anew."""
        held_up = self._patience.stood_for(now) > HELD_UP
        if wrong or held_up:
            if held_up and detour.gear > 0:
                self._backing = BACK_OFF
            self._detour = None
            self._looking = False
            return STAND
        command = detour.update(pose, dt)
        return DriveCommand(min(max(command.speed, -BACK_SPEED), DETOUR_SPEED), command.steering)

    # ---- back to the path --------------------------------------------------------------------

    def _return(self, now: float, dt: float, pose: Pose2D, tracker: PathTracker) -> DriveCommand:
        """Nothing is in the way, but it is not on its path: take that up where it was left."""
        if self._search is None:
            if now - self._planned_at < REPLAN_PERIOD:
                return STAND
            self._begin_search(now, pose, tracker, look=False)
        for way in self._search or ():
            if way is None:
                return STAND  # the next portion in the next tick
            self._search = None
            self._take(way, tracker)
            return self._follow(now, dt, pose, tracker)
        self._search = None
        return self._no_way_back(now, dt, pose, tracker)

    def _no_way_back(
        self, now: float, dt: float, pose: Pose2D, tracker: PathTracker
    ) -> DriveCommand:
        """The curves did not do: a longer way, forward."""
        self._planned_at = now
        if self._looking:
            self._looking = False
            return STAND
        if self._plan(now, pose, tracker, self._remaining(pose, tracker)):
            self._patience.move_on()
            self.reason = "Back to the path."
            return self._follow(now, dt, pose, tracker)
        self.reason = "Waiting: there is no room to get back to the path."
        if self._patience.stood_for(now) > BACK_OFF_AFTER:
            self._backing = BACK_OFF
        return STAND

    def _begin_search(self, now: float, pose: Pose2D, tracker: PathTracker, *, look: bool) -> None:
        self._planned_at = now
        self._looking = look
        self.reason = "Going to look whether the way is free." if look else "Back to the path."
        points, along, gears = tracker.path_ahead(REJOIN)
        room = self._gaps(points)
        free = stays(room >= CONCERN)
        if look:
            # Up to where the path is free, and with all the room that there should be.
            free = np.logical_and.accumulate(room >= CONCERN) & (room >= KEEP)
        goals = goals_on(points, along, gears, free, far=not look)
        self._search = ways_back(
            pose, goals, self._curves, self._spare, self._vehicle.plan_turn_radius
        )

    def _spare(self, points: Floats) -> Floats:
        """How much more room than needed there is at each of these points."""
        walls = self._barriers.distances(points) - self._vehicle.body_radius - WALL_ROOM
        return np.minimum(walls, self._gaps(points) - KEEP)

    def _take(self, way: Way, tracker: PathTracker) -> None:
        """Set out on a way back, and a little along the path after it."""
        self._way = way.points
        self._rejoin_at = way.goal.along
        rest = tracker.path_ahead(way.goal.skipped + LEAD_OUT * SPACING)
        plan = as_plan(*way.led_out(*rest), 2 * RADIUS)
        self._detour = PathTracker(plan, self._vehicle)
        self._returning = self._away = True
        self._patience.move_on()

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
        self._backing -= BACK_SPEED * dt
        if self._backing <= 0 or room < self._vehicle.body_radius + WALL_ROOM:
            self._backing = 0.0
            self._patience.move_on()
            return STAND
        self.reason = "Backing off to make room."
        self._away = True
        return DriveCommand(-BACK_SPEED, 0.0)
