"""The simulated world: floor plan, robot, people, and the ports by which the robot knows them.

The truth stays on this side: the ports give bytes, pictures and sightings, nothing else.
"""

from __future__ import annotations

import math
import threading
from collections import deque
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from polepilot.core.errors import CameraError, InternalError, LinkError
from polepilot.core.geometry import Point, Pose2D
from polepilot.core.landmark import LandmarkKind
from polepilot.core.observation import Frame
from polepilot.core.robot.ports import Chunk, Sighting
from polepilot.core.scenery import Disc, Scenery
from polepilot.core.sim.board import Board
from polepilot.core.sim.board_pins import BoardInputs, BoardSettings
from polepilot.core.sim.board_process import BoardProcess
from polepilot.core.sim.motion import Actuation, Disturbances, Motion
from polepilot.core.sim.obstacle import Obstacle
from polepilot.core.sim.proximity import sense
from polepilot.core.sim.render import Look, Renderer
from polepilot.core.sim.sensing import sightings
from polepilot.core.site import Site
from polepilot.core.vehicle import RobotModel

TICK = 0.005
"""The world moves on in steps of this, seconds."""
LATENCY = 0.040
"""From mid exposure until a picture can be read."""
PROXIMITY_PERIOD = 0.040
CONTACT_PERIOD = 0.020
COUNTS_PER_METRE = 2000.0
"""Of the wheel encoders, for boards whose settings say that they have some."""
_REACH = 3.0
_MOST_CHUNKS = 200
_BATTERY_FULL_MV = 12_400
_BATTERY_MV_PER_HOUR = 300


@dataclass(frozen=True, slots=True)
class _Shot:
    """What a picture taken at ``stamp`` would show."""

    stamp: float
    pose: Pose2D
    rate: float
    people: tuple[Disc, ...]


class World:
    """Everything that is real in the simulation; time is what `advance` makes of it.

    All methods may be called from any thread.

    Args:
        site: where walls, islands and landmarks truly stand.
        disturbances: None draws one robot of a series from the seed.
        start: true pose of `base_link`; None stands at the site's start, or inside its floor.
        board: settings of the microcontroller; None fits them to the model, without encoders. Or a
            microcontroller that is a program of its own, which is ended with the link.
        full_speed: of a rear wheel under full duty, m/s.
        look: light and paint in the camera's pictures.
    """

    def __init__(
        self,
        site: Site,
        model: RobotModel | None = None,
        *,
        seed: int = 0,
        disturbances: Disturbances | None = None,
        start: Pose2D | None = None,
        board: BoardProcess | BoardSettings | None = None,
        full_speed: float = 0.5,
        look: Look | None = None,
    ) -> None:
        self.model = model or RobotModel()
        self._look = look
        self._lock = threading.RLock()
        of_body, of_motion, self._of_ranger, self._of_picture, self._of_sighting = (
            np.random.default_rng(child) for child in np.random.SeedSequence(seed).spawn(5)
        )
        self._motion = Motion(
            self.model.vehicle,
            self.model.pan,
            Disturbances.drawn(of_body) if disturbances is None else disturbances,
            of_motion,
            full_speed=full_speed,
            pose=start or start_of(site),
        )
        self._board: Board | BoardProcess = (
            board
            if isinstance(board, BoardProcess)
            else Board(board or BoardSettings.from_model(self.model))
        )
        self._inputs = BoardInputs()
        self._actuation = Actuation()
        self._ticks = 0
        self._next_ranging = self._next_check = self._next_frame = 0.0
        self._obstacles: list[Obstacle] = []
        self._touching: set[Obstacle | None] = set()
        self.contacts = 0
        """How often the body has come to touch a wall or an obstacle."""
        self.closest_wall = math.inf
        """Least distance so far from the body to a wall, metres; negative after a contact."""
        self.closest_obstacle = math.inf
        """The same for obstacles."""
        self.stop_button = False
        """Whether somebody holds the red button on the robot."""
        self.link = WorldLink(self)
        self.camera = WorldCamera(self)
        self.sensor = WorldSensor(self)
        self.set_site(site)

    # ---- the truth, for displays and tests ---------------------------------------------------

    @property
    def now(self) -> float:
        """World time, seconds; starts at 0."""
        return self._ticks * TICK

    @property
    def truth(self) -> Pose2D:
        """The real pose of `base_link`."""
        return self._motion.pose

    @property
    def speed(self) -> float:
        """The real speed of `base_link`, m/s, backward negative."""
        return self._motion.speed

    @property
    def pan_angle(self) -> float:
        """The real direction of the camera from straight ahead, left positive."""
        return self._motion.pan_angle

    @property
    def wheels_standing(self) -> bool:
        return self._motion.standing

    @property
    def camera_pose(self) -> Pose2D:
        """Pan axis and looking direction in `map`."""
        on_body = self.model.camera.pose_on(self._motion.pose)
        return on_body.compose(Pose2D(0.0, 0.0, self._motion.pan_angle))

    @property
    def site(self) -> Site:
        return self._site

    @property
    def obstacles(self) -> tuple[Obstacle, ...]:
        return tuple(self._obstacles)

    @property
    def discs(self) -> tuple[Disc, ...]:
        """The obstacles where they are now: centre and radius."""
        with self._lock:
            return tuple((o.position(self.now), o.radius) for o in self._obstacles)

    # ---- what people do to it ----------------------------------------------------------------

    def place(self, pose: Pose2D) -> None:
        """Lift the robot and put it down elsewhere; nothing on board notices."""
        with self._lock:
            self._motion.place(pose)

    def set_site(self, site: Site) -> None:
        """Exchange walls, islands and landmarks; the robot stays where it is."""
        with self._lock:
            self._site = site
            self._walls = Scenery(site.segments())
            self._poles = tuple((mark.position, mark.kind.diameter / 2) for mark in site.landmarks)
            self._around: tuple[Point, Scenery, Scenery] | None = None
            self.camera.renew()

    def set_obstacles(self, obstacles: Sequence[Obstacle]) -> None:
        """Put these on the floor in place of all that were there."""
        with self._lock:
            self._obstacles = list(obstacles)
            self._touching &= {*obstacles, None}

    def add_obstacle(self, obstacle: Obstacle) -> None:
        with self._lock:
            self._obstacles.append(obstacle)

    def remove_obstacle(self, obstacle: Obstacle) -> None:
        """Take it away; one that is not there is no error."""
        with self._lock:
            self.set_obstacles([other for other in self._obstacles if other != obstacle])

    def renderer(self) -> Renderer:
        """A new one for the present site."""
        return Renderer(
            self.model.camera,
            self._site.landmarks,
            self._site.segments(),
            self._of_picture,
            self._look,
        )

    def advance(self, to: float) -> None:
        """Let the world go on until time ``to``; earlier times are no error."""
        with self._lock:
            last = math.floor(to / TICK + 1e-6)
            while self._ticks < last:
                self._ticks += 1
                self._tick()

    # ---- one step ----------------------------------------------------------------------------

    def _tick(self) -> None:
        now, motion = self.now, self._motion
        motion.advance(TICK, self._actuation)
        if now >= self._next_check:
            self._next_check = now + CONTACT_PERIOD - TICK / 2
            self._check_contact()
        proximity = self._inputs.proximity_mm
        if now >= self._next_ranging:
            self._next_ranging = now + PROXIMITY_PERIOD - TICK / 2
            scenery = self._near()[1].with_discs(self.discs)
            proximity = sense(motion.pose, self.model.proximity, scenery, self._of_ranger)
        self._inputs = BoardInputs(
            pan_adc=motion.adc(),
            proximity_mm=proximity,
            battery_mv=round(_BATTERY_FULL_MV - _BATTERY_MV_PER_HOUR * now / 3600),
            odometer=(
                round(motion.left_travel * COUNTS_PER_METRE),
                round(motion.right_travel * COUNTS_PER_METRE),
            ),
            stop_button=self.stop_button,
        )
        outputs = self._board.step(now, self._inputs)
        self._actuation = Actuation(
            outputs.left, outputs.right, outputs.steering_angle, outputs.pan
        )
        self.link.deliver(self._board.transmit())
        if now >= self._next_frame - TICK / 2:
            self._next_frame += 1 / self.model.camera.rate
            shot = _Shot(now, self.camera_pose, motion.pan_rate + motion.turn_rate, self.discs)
            self.camera.take(shot)
            self.sensor.take(shot)

    def _near(self) -> tuple[Scenery, Scenery]:
        """Walls, and walls with poles, that are near enough to matter."""
        here = self._motion.pose.position
        if self._around is None or math.dist(here, self._around[0]) > _REACH / 3:
            walls = self._walls.near(here, _REACH)
            poles = [pole for pole in self._poles if math.dist(here, pole[0]) < _REACH]
            self._around = (here, walls, walls.with_discs(poles))
        return self._around[1], self._around[2]

    def _check_contact(self) -> None:
        here, radius = self._motion.pose.position, self.model.vehicle.body_radius
        gap = self._near()[0].distance(here) - radius
        self.closest_wall = min(self.closest_wall, gap)
        self._count(None, gap < 0)
        for obstacle in self._obstacles:
            gap = math.dist(here, obstacle.position(self.now)) - obstacle.radius - radius
            self.closest_obstacle = min(self.closest_obstacle, gap)
            self._count(obstacle, gap < 0)

    def _count(self, thing: Obstacle | None, touched: bool) -> None:
        if not touched:
            self._touching.discard(thing)
        elif thing not in self._touching:
            self._touching.add(thing)
            self.contacts += 1


class WorldLink:
    """A `LinkPort`: the byte stream to the simulated microcontroller."""

    def __init__(self, world: World) -> None:
        self._world = world
        self._waiting: deque[Chunk] = deque(maxlen=_MOST_CHUNKS)
        self._plugged = True
        self.generation = 1

    @property
    def plugged(self) -> bool:
        """False: somebody has pulled the cable."""
        return self._plugged

    @plugged.setter
    def plugged(self, plugged: bool) -> None:
        self.generation += plugged and not self._plugged
        self._plugged = plugged

    def read(self) -> list[Chunk]:
        self._check()
        with self._world._lock:
            chunks = list(self._waiting)
            self._waiting.clear()
        return chunks

    def write(self, data: bytes) -> None:
        self._check()
        with self._world._lock:
            self._world._board.receive(data, self._world.now)

    def close(self) -> None:
        """A board that is a program of its own ends; the simulated one has nothing to give back."""
        board = self._world._board
        if isinstance(board, BoardProcess):
            with self._world._lock:
                board.close()

    def deliver(self, data: bytes) -> None:
        if self._plugged and data:
            self._waiting.append(Chunk(self._world.now, data))

    def _check(self) -> None:
        if not self._plugged:
            raise LinkError("the simulated USB cable is unplugged.", remedy="Plug it in.")


class _Pictures:
    """Shots on their way to whoever reads them."""

    def __init__(self, world: World) -> None:
        self._world = world
        self._taken: deque[_Shot] = deque(maxlen=8)
        self.plugged = True
        """False: the camera is gone."""

    def take(self, shot: _Shot) -> None:
        self._taken.append(shot)

    def close(self) -> None:
        """Nothing to give back."""

    def _newest(self) -> _Shot | None:
        if not self.plugged:
            raise CameraError("the simulated camera is unplugged.", remedy="Plug it in.")
        newest = None
        while self._taken and self._taken[0].stamp + LATENCY <= self._world.now + 1e-9:
            newest = self._taken.popleft()
        return newest


class WorldCamera(_Pictures):
    """A `CameraPort`: rendered pictures, each drawn when it is read."""

    def __init__(self, world: World) -> None:
        super().__init__(world)
        self._renderer: Renderer | None = None

    def renew(self) -> None:
        """The site has changed."""
        self._renderer = None

    def read(self) -> Frame | None:
        with self._world._lock:
            shot = self._newest()
            if shot is None:
                return None
            if self._renderer is None:
                self._renderer = self._world.renderer()
            renderer = self._renderer
        return Frame(shot.stamp, renderer.render(shot.pose, shot.rate, shot.people))


class WorldSensor(_Pictures):
    """A `SensorPort`: sightings from the detector's error model, without pictures."""

    def expect(self, kinds: Mapping[int, LandmarkKind]) -> None:
        """The model sees what is there, whatever the robot expects."""

    def read(self) -> Sighting | None:
        world = self._world
        with world._lock:
            shot = self._newest()
            if shot is None:
                return None
            seen = sightings(
                world.model.camera,
                shot.pose,
                world.site.landmarks,
                world._walls.with_discs(shot.people),
                world._of_sighting,
            )
        return Sighting(shot.stamp, seen)


def start_of(site: Site) -> Pose2D:
    """The site's start (heading 0 where it says none), or a place well inside its floor.

    Raises:
        InternalError: the site has no floor, which a validated site always has.
    """
    if site.start is not None:
        return Pose2D(site.start.x, site.start.y, site.start.heading or 0.0)
    inside = site.floor().representative_point()
    if inside.is_empty:
        raise InternalError("the site has no floor to stand on.")
    return Pose2D(inside.x, inside.y, 0.0)
