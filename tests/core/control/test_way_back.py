from __future__ import annotations

import math

import numpy as np
import pytest
from core.control.driving import VEHICLE, meet

from polepilot.core.control.places import as_plan, beside, pose_at
from polepilot.core.control.tracker import PathTracker
from polepilot.core.control.way_back import (
    ENDS,
    MOST_BACKWARD,
    Goal,
    Way,
    goals_on,
    ways_back,
)
from polepilot.core.geometry import Pose2D, wrap_angle
from polepilot.core.robot.curves import curves_of
from polepilot.core.scenery import Scenery
from polepilot.core.sim.motion import Actuation, Disturbances, Motion
from polepilot.core.sim.obstacle import Obstacle
from polepilot.core.site import Site
from polepilot.core.vehicle import PanUnit

CURVES = curves_of(VEHICLE)
RADIUS = VEHICLE.plan_turn_radius
NEEDED = VEHICLE.body_radius + 0.05


def box(width: float, length: float) -> Scenery:
    """A dead end that is open to the left."""
    return Scenery(
        [((0, 0), (length, 0)), ((length, 0), (length, width)), ((length, width), (0, width))]
    )


def search(start: Pose2D, goals: list[Goal], walls: Scenery) -> Way | None:
    found = list(ways_back(start, goals, CURVES, lambda at: walls.distances(at) - NEEDED, RADIUS))
    assert all(way is None for way in found[:-1])
    return found[-1]


def end_of(way: Way) -> Pose2D:
    """How the robot stands at the end of a way."""
    step = way.points[-1] - way.points[-2]
    heading = math.atan2(step[1], step[0]) + (0 if way.gears[-1] > 0 else math.pi)
    return Pose2D(*map(float, way.points[-1]), wrap_angle(heading))


@pytest.mark.parametrize("heading", np.linspace(-math.pi, math.pi, 9)[:-1])
def test_it_gets_out_of_a_dead_end_too_narrow_to_turn_round_in(heading: float) -> None:
    walls = box(1.0, 3.0)
    assert 2 * RADIUS + 2 * NEEDED > 1.0, "else a forward turn would do"
    start, goal = Pose2D(2.4, 0.5, heading), Pose2D(0.8, 0.5, math.pi)
    way = search(start, [Goal(goal, 0.0, 0.0)], walls)
    assert way is not None
    assert way.points[0] == pytest.approx(start.position)
    assert end_of(way).distance_to(goal.position) < 1e-6
    assert abs(wrap_angle(end_of(way).heading - goal.heading)) < math.radians(5)
    assert walls.distances(way.points).min() >= NEEDED - 1e-9
    lengths = np.hypot(*np.diff(way.points, axis=0).T)
    back = [float(part.sum()) for part in np.split(
        lengths * (way.gears < 0), np.flatnonzero(np.diff(way.gears)) + 1
    )]  # fmt: skip
    assert max(back) <= MOST_BACKWARD


def test_a_tracker_drives_it() -> None:
    heading = math.radians(30)
    walls, goal = box(1.0, 3.0), Pose2D(0.8, 0.5, math.pi)
    way = search(Pose2D(2.4, 0.5, heading), [Goal(goal, 0.0, 0.0)], walls)
    assert way is not None
    motion = Motion(
        VEHICLE, PanUnit(), Disturbances(), np.random.default_rng(1), full_speed=0.5,
        pose=Pose2D(2.4, 0.5, heading),
    )  # fmt: skip
    tracker = PathTracker(as_plan(way.points, way.gears, 0.5), VEHICLE)
    closest = math.inf
    for _ in range(2000):
        command = tracker.update(motion.pose, 0.05)
        bend = math.tan(command.steering) / VEHICLE.wheelbase * VEHICLE.track / 2
        duty = command.speed / 0.5 * 1000
        motion.advance(0.05, Actuation(duty * (1 - bend), duty * (1 + bend), command.steering))
        closest = min(closest, walls.distance(motion.pose.position) - VEHICLE.body_radius)
        if tracker.done:
            break
    assert tracker.done
    assert closest > 0.0
    assert motion.pose.distance_to(goal.position) < 0.05
    assert abs(wrap_angle(motion.pose.heading - goal.heading)) < math.radians(10)


def test_no_way_through_a_wall() -> None:
    walls = Scenery([((0, 0), (3, 0)), ((3, 0), (3, 1)), ((3, 1), (0, 1)), ((1.5, 0), (1.5, 1))])
    assert search(Pose2D(2.4, 0.5, 0), [Goal(Pose2D(0.8, 0.5, math.pi), 0, 0)], walls) is None
    assert search(Pose2D(2.4, 0.5, 0), [], walls) is None


def test_from_where_it_is_too_narrow_it_goes_no_nearer() -> None:
    walls = Scenery([((0, 0), (6, 0))])
    start = Pose2D(1.0, VEHICLE.body_radius + 0.03, 0.0)
    way = search(start, [Goal(Pose2D(3.0, 0.6, 0.0), 0, 0)], walls)
    assert way is not None
    room = walls.distances(way.points) - VEHICLE.body_radius
    assert room.min() > 0.02
    away = np.hypot(*(way.points - start.position).T) > ENDS
    assert room[away].min() >= 0.05 - 1e-9


def test_the_path_is_taken_up_where_it_was_left_or_soon_after() -> None:
    goals = [Goal(Pose2D(2.0 + ahead, 0.0, 0.0), ahead, ahead) for ahead in (0.0, 0.2, 0.8)]
    way = search(Pose2D(1.0, 0.4, 0.0), goals, Scenery([((-9, 9), (9, 9))]))
    assert way is not None
    assert way.goal is goals[0]
    way = search(Pose2D(1.0, 0.4, 0.0), goals, Scenery([((1.9, -0.1), (2.3, -0.1))]))
    assert way is not None
    assert way.goal is goals[2]


def path_with_a_cusp() -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    forward = np.column_stack([np.arange(0, 0.62, 0.02), np.zeros(31)])
    points = np.vstack([forward, forward[::-1]])
    gears = np.repeat(np.array([1, -1], np.int8), 31)
    return points, np.arange(62) * 0.02, gears


def test_how_it_stands_on_a_path_that_goes_to_and_fro() -> None:
    points, along, gears = path_with_a_cusp()
    assert all(abs(pose_at(points, gears, i).heading) < 1e-9 for i in range(len(points)))
    goals = goals_on(points, along, gears, np.ones(62, bool), far=False)
    assert goals[0].skipped == 0
    assert max(goal.along for goal in goals) <= 1.0 + 1e-9
    assert not goals_on(points, along, gears, np.zeros(62, bool), far=True)


def test_beside_the_path_or_across_it() -> None:
    ahead = path_with_a_cusp()
    assert not beside(Pose2D(0.0, 0.1, 0.2), *ahead)
    assert beside(Pose2D(0.0, 0.3, 0.0), *ahead)
    assert beside(Pose2D(0.0, 0.0, 1.5), *ahead)


def test_what_leads_out_is_in_one_gear() -> None:
    points, along, gears = path_with_a_cusp()
    goal = Goal(Pose2D(0.4, 0.0, 0.0), 0.4, 0.4)
    way = Way(np.array([[0.4, 0.4], [0.4, 0.0]]), np.ones(1, np.int8), goal, 0.4)
    line, gear = way.led_out(points, along, gears)
    assert (gear == 1).all()
    assert line[-1] == pytest.approx((0.6, 0.0))
    assert len(line) == len(gear) + 1


@pytest.mark.parametrize("seed", range(5))
def test_when_the_person_has_left_a_dead_end_the_whole_path_is_driven(seed: int) -> None:
    site = Site(boundary=((0, 0), (5, 0), (5, 1), (0, 1)))
    path = [(1.0, 0.5), (4.6, 0.5), (2.0, 0.5)]
    person = Obstacle(4.0, 0.5, waypoints=((4.0, 9.0),), starts=25.0, speed=2.0)
    met = meet(path, site, [person], gear=[1, -1], seed=seed, sigma=0.01)
    assert met.done
    assert met.to_people >= 0.15
    assert met.to_walls > 0.02
    assert max(x for x, _ in met.positions) > 4.55, "the end of the dead end is driven as well"
    assert math.dist(met.end.position, path[-1]) < 0.05
