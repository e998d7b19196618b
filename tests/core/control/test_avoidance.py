from __future__ import annotations

import math

import numpy as np
import pytest
from core.control.driving import VEHICLE, arc, meet, plan_of

from polepilot.core.control.avoidance import ObstacleAvoidance
from polepilot.core.control.detour import Room, find
from polepilot.core.control.memory import FORGET, FORGET_NEAR, ObstacleMemory
from polepilot.core.control.tracker import PathTracker
from polepilot.core.geometry import Pose2D
from polepilot.core.landmark import Landmark
from polepilot.core.observation import PoseEstimate, Status
from polepilot.core.robot.curves import curves_of
from polepilot.core.scenery import Scenery
from polepilot.core.sim.obstacle import Obstacle
from polepilot.core.site import Site
from polepilot.core.vehicle import Proximity

ROOM = Site(boundary=((0, 0), (8, 0), (8, 6), (0, 6)))
LINE = [(1.0, 3.0), (7.0, 3.0)]
PERSON = (4.0, 3.0)


def corridor(width: float) -> Site:
    low, high = 3.0 - width / 2, 3.0 + width / 2
    return Site(boundary=((0, low), (8, low), (8, high), (0, high)))


@pytest.mark.parametrize("radius", [0.20, 0.25])
@pytest.mark.parametrize("aside", [-0.3, -0.15, 0.0, 0.15, 0.3])
def test_person_on_the_line_is_passed_on_the_left(radius: float, aside: float) -> None:
    person = Obstacle(4.0, 3.0 + aside, radius)
    met = meet(LINE, ROOM, [person])
    assert met.done
    assert met.to_people >= 0.15
    beside = [y for x, y in met.positions if abs(x - 4.0) < 0.1]
    assert min(beside) > person.y
    # Rejoined: the last metre is driven on the line, and the last node is reached.
    assert max(abs(y - 3.0) for x, y in met.positions if x > 6.2) < 0.05
    assert math.dist(met.end.position, LINE[-1]) < 0.03


@pytest.mark.parametrize("seed", range(4))
def test_person_is_passed_with_an_uncertain_pose(seed: int) -> None:
    met = meet(LINE, ROOM, [Obstacle(*PERSON)], seed=seed, sigma=0.015)
    assert met.done
    assert met.to_people >= 0.15


def test_person_left_of_the_line_is_passed_on_the_right() -> None:
    met = meet(LINE, ROOM, [Obstacle(4.0, 3.6)])
    assert met.done
    assert met.to_people >= 0.15
    assert max(y for _, y in met.positions) < 3.1


def test_person_behind_a_corner() -> None:
    path = [(1.0, 1.0), *arc((4, 1.6), 0.6, -math.pi / 2, 0), (4.6, 5.0)]
    met = meet(path, ROOM, [Obstacle(4.6, 2.6)])
    assert met.done
    assert met.to_people >= 0.15
    assert min(x for x, y in met.positions if abs(y - 2.6) < 0.05) < 4.0


def test_person_at_arms_length_is_given_room_first() -> None:
    met = meet(LINE, ROOM, [Obstacle(1.75, 3.0)])
    assert met.done
    assert met.to_people >= 0.15
    assert any("Backing off" in reason for reason in met.reasons)
    assert min(x for x, _ in met.positions) > 0.5


def test_wide_box_is_passed() -> None:
    box = [Obstacle(4.0, 2.6 + 0.3 * index, 0.2) for index in range(4)]
    met = meet(LINE, ROOM, box)
    assert met.done
    assert met.to_people >= 0.15


def test_left_blocked_by_a_wall_means_waiting_with_a_reason() -> None:
    met = meet(LINE, corridor(1.2), [Obstacle(*PERSON)], longest=30)
    assert not met.done
    assert met.to_people >= 0.15
    assert met.to_walls >= 0.15
    assert any("no room" in reason for reason in met.reasons)
    assert met.stood > 20


def test_after_long_waiting_the_right_will_do() -> None:
    # Left of the line 0.6 m are too little to pass, right of it there is room.
    site = Site(boundary=((0, 0), (8, 0), (8, 3.6), (0, 3.6)))
    met = meet(LINE, site, [Obstacle(*PERSON)])
    assert met.done
    assert met.to_people >= 0.15
    assert met.stood > 7.5
    assert math.dist(met.end.position, LINE[-1]) < 0.03


def test_no_detour_leads_through_a_no_go_area() -> None:
    carpet = ((2.5, 3.5), (5.5, 3.5), (5.5, 5.5), (2.5, 5.5))
    site = Site(boundary=ROOM.boundary, no_go=(carpet,))
    met = meet(LINE, site, [Obstacle(*PERSON)])
    assert met.done
    assert met.to_people >= 0.15
    # On the left there would be room, but for the carpet.
    assert all(not (2.4 < x < 5.6 and y > 3.4) for x, y in met.positions)


def test_passage_goes_on_when_the_person_has_left() -> None:
    person = Obstacle(4.0, 3.0, waypoints=((4.0, 9.0),), starts=20.0)
    met = meet(LINE, corridor(1.2), [person])
    assert met.done
    assert met.seconds > 25
    assert met.to_people >= 0.15


def test_corridor_just_wide_enough() -> None:
    # Left of the person 0.85 m: body 0.28, 0.15 to the person and 0.05 to the wall at least.
    met = meet(LINE, corridor(2.2), [Obstacle(*PERSON)])
    assert met.done
    assert met.to_people >= 0.15
    assert met.to_walls > 0.03


def test_person_who_crosses_the_way_is_not_touched() -> None:
    met = meet(LINE, ROOM, [Obstacle(4.0, 1.0, waypoints=((4.0, 5.0),), speed=0.4)])
    assert met.done
    assert met.to_people > 0


def test_occupied_end_means_waiting() -> None:
    met = meet(LINE, ROOM, [Obstacle(7.0, 3.0)], longest=25)
    assert not met.done
    assert met.to_people >= 0.15
    assert any("is occupied" in reason for reason in met.reasons)


@pytest.mark.parametrize("seed", range(3))
def test_what_the_site_shows_is_no_obstacle(seed: int) -> None:
    # Along walls at 6 cm from the body, poles standing at them and a free one beside the path.
    site = Site(
        boundary=((0, 0), (5.4, 0), (5.4, 4), (0, 4)),
        landmarks=(Landmark(1, 2.2, 0.0), Landmark(2, 5.4, 1.0), Landmark(4, 3.4, 0.6)),
    )
    path = [
        (0.2, 0.56),
        *arc((0.56, 0.56), 0.36, math.pi, 1.5 * math.pi),
        *arc((4.84, 0.56), 0.36, -math.pi / 2, 0),
        (5.2, 3.0),
    ]
    met = meet(path, site, [], start=Pose2D(0.2, 0.56, -math.pi / 2), seed=seed, sigma=0.01)
    assert met.done
    assert met.reasons == []


def test_without_sensors_nothing_is_avoided() -> None:
    avoidance = ObstacleAvoidance(Proximity(), VEHICLE, ROOM, curves_of(VEHICLE))
    tracker = PathTracker(plan_of(LINE), VEHICLE)
    estimate = PoseEstimate(0.0, Pose2D(1, 3, 0), np.eye(3) * 1e-4, Status.TRACKING)
    plain = PathTracker(plan_of(LINE), VEHICLE)
    for tick in range(30):
        command = avoidance.update(tick * 0.05, 0.05, estimate, (None, None, None), tracker)
        assert command == plain.update(estimate.pose, 0.05)
    assert command.speed > 0.1
    assert not avoidance.active
    assert avoidance.target is None


def test_reset_forgets() -> None:
    avoidance = ObstacleAvoidance(Proximity(), VEHICLE, ROOM, curves_of(VEHICLE))
    tracker = PathTracker(plan_of(LINE), VEHICLE)
    for tick in range(6):
        now = tick * 0.05
        estimate = PoseEstimate(now, Pose2D(1, 3, 0), np.eye(3) * 1e-4, Status.TRACKING)
        avoidance.update(now, 0.05, estimate, (1.5, 0.4, 1.5), tracker)
    assert avoidance.active
    assert avoidance.obstacles[0][0] == pytest.approx((1.12 + 0.4 + 0.25, 3.0), abs=0.02)
    avoidance.reset()
    assert not avoidance.active
    assert avoidance.obstacles == ()


def looks(memory: ObstacleMemory, count: int, center: float, begin: float = 0.0) -> float:
    for tick in range(count):
        memory.observe(begin + tick * 0.05, Pose2D(2, 3, 0), (1.5, center, 1.5), 0.01, 0.005)
    return begin + count * 0.05


def test_memory_needs_more_than_one_reading() -> None:
    memory = ObstacleMemory(Proximity(), Scenery(ROOM.segments()))
    now = looks(memory, 1, 0.8)
    assert memory.obstacles == []
    looks(memory, 4, 0.8, now)
    assert len(memory.obstacles) == 1


def test_memory_gives_up_what_is_seen_to_be_gone() -> None:
    memory = ObstacleMemory(Proximity(), Scenery(ROOM.segments()))
    now = looks(memory, 6, 0.8)
    looks(memory, 6, 1.5, now)
    assert memory.obstacles == []


def test_memory_does_not_push_what_has_gone_before_the_beam_for_ever() -> None:
    # Read just beside the middle of the beam, and not there any more.
    memory = ObstacleMemory(Proximity(), Scenery(ROOM.segments()))
    now = looks(memory, 6, 0.8)
    sensor = Pose2D(2.12, 3.0, 0.0)
    for tick in range(40):
        # The robot turns slowly to where the beam's edge has pushed it.
        begin = now + tick * 0.05
        there = memory.obstacles[0].position if memory.obstacles else (9.0, 3.0)
        bearing = sensor.bearing_to(there)
        aside = 0.12 if bearing >= 0 else -0.12
        pose = Pose2D(2.0, 3.0, bearing - aside)
        memory.observe(begin, pose, (1.5, 1.5, 1.5), 0.01, 0.005)
    assert memory.obstacles == []


def test_memory_keeps_who_stands_a_little_beside_where_it_was_believed() -> None:
    memory = ObstacleMemory(Proximity(), Scenery(ROOM.segments()))
    now = looks(memory, 6, 0.8)
    # The free beam looks past its place by a good hand's breadth: pushed aside, not forgotten.
    for tick in range(20):
        memory.observe(now + tick * 0.05, Pose2D(2, 3, -0.25), (1.5, 1.5, 1.5), 0.01, 0.005)
    assert len(memory.obstacles) == 1


@pytest.mark.parametrize(("x", "longest"), [(0.9, FORGET), (2.0, FORGET_NEAR)])
def test_memory_fades_out_of_sight(x: float, longest: float) -> None:
    memory = ObstacleMemory(Proximity(), Scenery(ROOM.segments()))
    now = looks(memory, 6, 0.8)
    away = Pose2D(x, 3, math.pi)
    memory.observe(now + longest - 1, away, (1.5, 1.5, 1.5), 0.01, 0.005)
    assert len(memory.obstacles) == 1
    memory.observe(now + longest + 1, away, (1.5, 1.5, 1.5), 0.01, 0.005)
    assert memory.obstacles == []


def test_detour_does_not_rejoin_just_before_backing() -> None:
    # The path turns back 20 cm behind the person's shadow: it is taken up where it goes forward.
    path = [(1.0, 3.0), (5.1, 3.0), (4.9, 3.0), (7.0, 3.0)]
    met = meet(path, ROOM, [Obstacle(*PERSON)], gear=[1, -1, 1])
    assert met.done
    assert met.to_people >= 0.15
    assert math.dist(met.end.position, path[-1]) < 0.03


def test_person_behind_a_backing_robot_is_not_forgotten() -> None:
    # Past the person on the left, back on the line, and then straight back towards the person.
    path = [(1.0, 3.0), (5.7, 3.0), (4.3, 3.0)]
    met = meet(path, ROOM, [Obstacle(*PERSON)], gear=[1, -1], longest=40)
    assert met.to_people >= 0.15
    assert met.stood > 10


def test_wall_within_tolerance_is_explained_and_something_before_it_is_not() -> None:
    memory = ObstacleMemory(Proximity(), Scenery([((3, -5), (3, 9))]))
    # The wall is 0.88 m ahead of the centre sensor.
    now = looks(memory, 6, 0.80)
    assert memory.obstacles == []
    looks(memory, 6, 0.60, now)
    assert len(memory.obstacles) == 1


def test_detour_keeps_its_distances() -> None:
    walls = Scenery([((0, 4), (8, 4))])
    person = ((4.0, 3.0), 0.25)
    room = Room(walls=0.19, least=0.33, wanted=0.44)
    goals = [(7.5, 3.0), (5.5, 3.0)]
    found = find((2.5, 3.0), goals, [person], ((4.0, 3.0), -math.pi / 2), walls, room)
    assert found is not None
    reached, way = found
    assert reached == 1
    assert tuple(way[0]) == (2.5, 3.0)
    assert tuple(way[-1]) == (5.5, 3.0)
    gaps = Scenery([], [person]).distances(way)
    assert gaps.min() > room.least - 0.03
    assert walls.distances(way).min() > room.walls - 0.03
    # On the left, that is above, and hardly longer than two tangents and an arc.
    assert (way[np.abs(way[:, 0] - 4.0) < 0.1][:, 1] > 3.5).all()
    assert np.hypot(*np.diff(way, axis=0).T).sum() < 3.8


def test_detour_that_does_not_exist() -> None:
    walls = Scenery([((0, 3.6), (8, 3.6)), ((0, 2.4), (8, 2.4))])
    room = Room(walls=0.19, least=0.33, wanted=0.44)
    barrier = ((4.0, 3.0), -math.pi / 2)
    person = ((4.0, 3.0), 0.25)
    assert find((2.5, 3.0), [(5.5, 3.0)], [person], barrier, walls, room) is None
    assert find((2.5, 3.0), [(4.0, 3.2)], [person], barrier, Scenery(), room) is None
    assert find((2.5, 3.0), [], [person], barrier, Scenery(), room) is None
