from __future__ import annotations

import math

import numpy as np
import pytest
import shapely

from polepilot.core.errors import CameraError, ConfigError, LinkError
from polepilot.core.geometry import Pose2D
from polepilot.core.landmark import Landmark
from polepilot.core.link.protocol import HostLink, LinkState
from polepilot.core.scenery import Scenery
from polepilot.core.sim.clock import PacedClock
from polepilot.core.sim.motion import Disturbances
from polepilot.core.sim.obstacle import Obstacle
from polepilot.core.sim.sensing import sightings
from polepilot.core.sim.world import LATENCY, World, start_of
from polepilot.core.site import Site, Start
from polepilot.core.vehicle import Camera, RobotModel

ROOM = Site(
    boundary=((0, 0), (8, 0), (8, 6), (0, 6)),
    walls=(((5, 0), (5, 2)),),
    landmarks=(Landmark(1, 8.0, 3.0), Landmark(2, 4.0, 6.0), Landmark(3, 7.5, 1.0)),
    start=Start(1.0, 3.0, 0.0),
)


class Host:
    """Keeps the link alive and the world moving, 50 times a second."""

    def __init__(self, world: World) -> None:
        self.world = world
        self.link = HostLink()

    def run(self, seconds: float, left: int = 0, right: int = 0, steering: int = 0) -> None:
        end = self.world.now + seconds
        while self.world.now < end - 1e-9:
            now = self.world.now
            for chunk in self.world.link.read():
                self.link.receive(chunk.data, chunk.stamp)
            if self.link.ready and not self.link.armed:
                self.link.arm()
            self.link.drive(left, right, steering)
            self.world.link.write(self.link.poll(now))
            self.world.advance(now + 0.02)


def quiet(**options: object) -> World:
    return World(ROOM, disturbances=Disturbances.none(), **options)  # type: ignore[arg-type]


def test_bytes_turn_wheels() -> None:
    world = quiet()
    host = Host(world)
    host.run(0.5)
    assert host.link.state is LinkState.ARMED
    assert world.truth == Pose2D(1, 3, 0)
    host.run(2.0, 600, 600)
    assert 1.5 < world.truth.x <= 1.6
    assert world.speed == pytest.approx(0.3, rel=1e-6)
    host.run(0.5)
    assert world.wheels_standing


def test_wheels_stand_soon_after_the_computer_falls_silent() -> None:
    world = World(ROOM, seed=3)
    Host(world).run(1.5, 600, 600)
    assert not world.wheels_standing
    world.advance(world.now + 0.25 + 0.3)
    assert world.wheels_standing


def test_unplugged() -> None:
    world = quiet()
    world.link.plugged = False
    world.camera.plugged = False
    with pytest.raises(LinkError):
        world.link.read()
    with pytest.raises(LinkError):
        world.link.write(b"\0")
    with pytest.raises(CameraError):
        world.camera.read()
    before = world.link.generation
    world.link.plugged = True
    assert world.link.generation == before + 1
    world.advance(0.1)
    chunks = world.link.read()
    assert chunks
    assert all(0 < chunk.stamp <= 0.1 for chunk in chunks)


def test_proximity_sees_walls_poles_and_people() -> None:
    world = quiet(start=Pose2D(3.5, 1.0, 0.0))
    host = Host(world)
    host.run(0.5)
    left, center, right = host.link.telemetry.telemetry.ranges
    # The wall x = 5 is 1.38 m ahead of the centre sensor; y = 0 is sqrt(2) m to the right along
    # the axis of that beam, whose edge meets it sooner.
    assert center == pytest.approx(1.38, abs=0.05)
    assert right == pytest.approx(1.0 / math.sin(math.radians(52.5)), abs=0.05)
    assert left == 1.5
    world.set_obstacles([Obstacle(4.5, 1.0)])
    host.run(0.3)
    assert host.link.telemetry.telemetry.ranges[1] == pytest.approx(0.63, abs=0.05)


def test_contacts_are_counted_once_each() -> None:
    world = quiet(start=Pose2D(4.0, 1.0, math.pi))
    assert world.contacts == 0
    # Backward, where no sensor looks, through the wall at x = 5: one contact, however long.
    host = Host(world)
    host.run(4.0, -800, -800)
    host.run(0.6)
    assert world.truth.x > 5.0
    assert world.contacts == 1
    assert world.closest_wall == pytest.approx(-0.14, abs=0.01)
    world.place(Pose2D(1, 3, 0))
    world.advance(world.now + 0.1)
    world.add_obstacle(Obstacle(1.3, 3.0))
    world.advance(world.now + 0.5)
    assert world.contacts == 2
    world.remove_obstacle(world.obstacles[0])
    world.advance(world.now + 0.1)
    assert world.contacts == 2
    assert world.closest_obstacle == pytest.approx(0.3 - 0.25 - 0.14, abs=0.02)


def test_firmware_stops_before_the_wall() -> None:
    world = quiet(start=Pose2D(4.0, 1.0, 0.0))
    Host(world).run(4.0, 800, 800)
    assert world.wheels_standing
    assert world.contacts == 0
    assert 0.0 < world.closest_wall < 0.09


def test_walking_person() -> None:
    person = Obstacle(0, 0, 0.2, ((1, 0), (1, 2)), speed=0.5, starts=1.0)
    assert person.position(0.0) == (0, 0)
    assert person.position(2.0) == pytest.approx((0.5, 0.0))
    assert person.position(4.0) == pytest.approx((1.0, 0.5))
    assert person.position(99.0) == (1, 2)


def test_pictures_come_at_the_cameras_rate_and_late() -> None:
    world = quiet()
    stamps = []
    while world.now < 1.0:
        world.advance(world.now + 0.005)
        sighting = world.sensor.read()
        if sighting is not None:
            assert world.now - sighting.stamp == pytest.approx(LATENCY, abs=0.006)
            assert sighting.frame is None
            stamps.append(sighting.stamp)
    assert len(stamps) == pytest.approx(Camera().rate, abs=1)
    assert world.sensor.read() is None


def test_rendered_picture_shows_the_landmark_ahead() -> None:
    world = quiet()
    world.advance(0.2)
    frame = world.camera.read()
    assert frame is not None
    assert frame.image.shape == (300, 400, 3)
    assert 0 < frame.stamp <= 0.2 - LATENCY + 1e-9
    # Orange (red far above blue) at the middle column, where landmark 1 stands.
    middle = frame.image[:, 199].astype(int)
    assert ((middle[:, 2] - middle[:, 0]) > 60).sum() > 10
    assert world.camera.read() is None


def test_measured_sightings_follow_their_error_model() -> None:
    camera = Camera()
    mark = Landmark(5, 6.0, 0.5)
    rng = np.random.default_rng(4)
    pose = Pose2D(0, 0, 0.1)
    found = [sightings(camera, pose, [mark], Scenery(), rng) for _ in range(3000)]
    seen = [detections[0] for detections in found if detections]
    assert len(seen) / len(found) == pytest.approx(0.97, abs=0.012)
    ranges = np.array([(d.range - math.hypot(6, 0.5)) / d.range_sigma for d in seen])
    bearings = np.array([(d.bearing - pose.bearing_to((6, 0.5))) / d.bearing_sigma for d in seen])
    for errors in (ranges, bearings):
        assert abs(errors.mean()) < 0.08
        assert errors.std() == pytest.approx(1.0, abs=0.05)
    # Eq. 1: the length in pixels belongs to the depth of the front surface.
    one = seen[0]
    depth = (one.range - 0.035) * math.cos(one.bearing)
    assert one.bottom - one.top == pytest.approx(600 * 0.65 / depth)
    assert one.column == pytest.approx(199.5 - 600 * math.tan(one.bearing))


@pytest.mark.parametrize(
    ("mark", "sight", "visible"),
    [
        (Landmark(1, 4.0, 0.0), Scenery(), True),
        (Landmark(1, 1.4, 0.0), Scenery(), False),  # too near: its foot is out of the picture
        (Landmark(1, 17.0, 0.0), Scenery(), False),
        (Landmark(1, 4.0, 1.5), Scenery(), False),  # beside the picture
        (Landmark(1, -4.0, 0.0), Scenery(), False),
        (Landmark(1, 4.0, 0.0), Scenery([((2, -1), (2, 1))]), False),
        (Landmark(1, 4.0, 0.0), Scenery([((4, -1), (4, 1))]), True),  # stands at the wall
        (Landmark(1, 4.0, 0.0), Scenery([], [((2, 0), 0.25)]), False),
    ],
)
def test_what_can_be_seen(mark: Landmark, sight: Scenery, visible: bool) -> None:
    rng = np.random.default_rng(1)
    count = sum(bool(sightings(Camera(), Pose2D(0, 0, 0), [mark], sight, rng)) for _ in range(20))
    assert (count > 10) == visible
    assert visible or count == 0


def test_nearer_pole_hides_the_one_behind() -> None:
    marks = [Landmark(1, 3.0, 0.0), Landmark(2, 6.0, 0.0), Landmark(3, 6.0, 0.5)]
    rng = np.random.default_rng(1)
    ids = {
        detection.id
        for _ in range(20)
        for detection in sightings(Camera(), Pose2D(0, 0, 0), marks, Scenery(), rng)
    }
    assert ids == {1, 3}


def test_another_site_while_running() -> None:
    world = quiet(start=Pose2D(3.5, 1.0, 0.0))
    world.advance(0.2)
    world.set_site(Site(boundary=((0, 0), (20, 0), (20, 20), (0, 20))))
    host = Host(world)
    host.run(0.4)
    assert host.link.telemetry.telemetry.ranges[1] == 1.5
    sighting = world.sensor.read()
    assert sighting is not None
    assert sighting.detections == ()
    assert world.camera.read() is not None


def test_same_seed_same_run() -> None:
    ends = []
    for _ in range(2):
        world = World(ROOM, RobotModel(), seed=9)
        Host(world).run(3.0, 500, 700, 1000)
        ends.append((world.truth, world.sensor.read()))
    assert ends[0] == ends[1]
    other = World(ROOM, RobotModel(), seed=10)
    Host(other).run(3.0, 500, 700, 1000)
    assert other.truth != ends[0][0]


def test_start_without_one_is_on_the_floor() -> None:
    ring = ((1, 1), (3, 1), (3, 3), (1, 3))
    site = Site(boundary=((0, 0), (4, 0), (4, 4), (0, 4)), islands=(ring,))
    assert site.floor().contains(shapely.Point(start_of(site).position))


class Wall:
    """A wall clock that only sleeping moves."""

    def __init__(self) -> None:
        self.time = 100.0

    def sleep(self, seconds: float) -> None:
        self.time += seconds


@pytest.mark.parametrize("factor", [0.5, 1.0, 4.0])
def test_paced_clock_keeps_step_with_the_wall(factor: float) -> None:
    world, wall = quiet(), Wall()
    clock = PacedClock(world, factor, monotonic=lambda: wall.time, sleep=wall.sleep)
    for index in range(1, 41):
        clock.wait_until(index * 0.05)
    assert world.now == pytest.approx(2.0, abs=0.006)
    assert wall.time - 100.0 == pytest.approx(2.0 / factor, abs=0.02)


def test_paced_clock_does_not_leap_after_a_stall() -> None:
    world, wall = quiet(), Wall()
    clock = PacedClock(world, monotonic=lambda: wall.time, sleep=wall.sleep)
    wall.time += 5.0
    assert clock.now() == pytest.approx(0.1)
    wall.time += 0.05
    assert clock.now() == pytest.approx(0.15)


def test_paced_clock_refuses_nonsense() -> None:
    with pytest.raises(ConfigError):
        PacedClock(quiet(), 0.0)
