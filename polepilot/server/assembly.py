"""From robot.toml to a robot with its world around it: simulated, or a camera and a serial port."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import platformdirs
import shapely
import structlog

from polepilot.core.geometry import Pose2D
from polepilot.core.link.usb import SerialPort
from polepilot.core.robot.eye import Eye
from polepilot.core.robot.ports import CameraPort, Clock
from polepilot.core.robot.robot import Robot
from polepilot.core.sim.board_pins import BoardSettings
from polepilot.core.sim.board_process import BoardProcess
from polepilot.core.sim.clock import PacedClock
from polepilot.core.sim.obstacle import Obstacle
from polepilot.core.sim.render import Look
from polepilot.core.sim.world import World, start_of
from polepilot.core.site import Site, parse_site
from polepilot.core.vision.capture import CameraCapture
from polepilot.core.vision.detector import LandmarkDetector
from polepilot.core.vision.paper import PaperDetector
from polepilot.server.clock import MonotonicClock
from polepilot.server.eyes import BackgroundSensor
from polepilot.server.firmware import host_program
from polepilot.server.missions import last_site
from polepilot.server.panel import Panel
from polepilot.server.runner import RobotPort, Twin
from polepilot.server.services import DataFolder, Services, demo_site
from polepilot.server.settings import Settings
from polepilot.server.store import Store

log = structlog.get_logger("polepilot.camera")


@dataclass(frozen=True, slots=True)
class Assembly:
    """The robot, its time, and the world that it drives in if that is simulated."""

    robot: RobotPort
    clock: Clock
    twin: Twin | None


class WorldTwin:
    """The simulated world as the server shows and changes it."""

    def __init__(self, world: World) -> None:
        self._world = world

    @property
    def truth(self) -> Pose2D:
        return self._world.truth

    @property
    def obstacles(self) -> tuple[tuple[float, float, float], ...]:
        return tuple((x, y, radius) for (x, y), radius in self._world.discs)

    def set_obstacles(self, discs: Sequence[tuple[float, float, float]]) -> None:
        self._world.set_obstacles([Obstacle(x, y, radius) for x, y, radius in discs])

    def place(self, pose: Pose2D) -> None:
        self._world.place(pose)

    def set_site(self, site: Site, *, another: bool) -> None:
        """Change the walls and poles; on ``another`` site, or where the robot would stand outside
        of a changed one, it is carried to the start."""
        self._world.set_site(site)
        truth = self._world.truth
        if another or not shapely.intersects_xy(site.floor(), truth.x, truth.y):
            self._world.place(start_of(site))


def assemble(settings: Settings, site: Site) -> Assembly:
    """Build what ``settings`` describe. ``site`` is where a simulated robot stands at first."""
    if settings.link.board != "serial":
        return _simulated(settings, site)
    clock = MonotonicClock()
    address = settings.port_address
    assert address is not None
    camera = CameraCapture(
        settings.camera.source,
        settings.model.camera,
        capture_size=(settings.camera.capture_width, settings.camera.capture_height),
        controls=settings.controls,
        latency=settings.camera.latency_s,
        clock=clock.now,
        notice=lambda note: log.warning("camera", note=note),
    )
    link = SerialPort(address, settings.link.baud_rate, clock.now)
    sensor = BackgroundSensor(_eye(camera, settings))
    return Assembly(Robot(settings.robot, sensor, link), clock, None)


def _simulated(settings: Settings, site: Site) -> Assembly:
    seed = settings.simulation.seed
    board = None
    if settings.link.board == "host":
        board = BoardProcess.host(host_program(), BoardSettings.from_model(settings.model))
    world = World(
        site,
        settings.model,
        seed=seed,
        board=board,
        disturbances=settings.disturbances(np.random.default_rng(seed)),
        look=Look.painted(settings.paint),
    )
    rendered = settings.simulation.sensing == "rendered"
    sensor = BackgroundSensor(_eye(world.camera, settings)) if rendered else None
    robot = Robot(settings.robot, world.sensor if sensor is None else sensor, world.link)
    return Assembly(robot, PacedClock(world), WorldTwin(world))


def _eye(camera: CameraPort, settings: Settings) -> Eye:
    lens, paint = settings.model.camera, settings.paint
    if settings.landmark.detector == "paper":
        return Eye(camera, lambda kinds: PaperDetector(lens, kinds))
    return Eye(camera, lambda kinds: LandmarkDetector(lens, kinds, paint))


def open_services(settings: Settings, host: str, port: int, data: Path | None) -> Services:
    """Claim the data folder, open the database, and put everything together.

    Args:
        data: None takes the folder from the settings, or the usual place of the system.

    Raises:
        InputError: folder or database cannot be used.
    """
    if data is None:
        data = Path(settings.server.data or platformdirs.user_data_path("polepilot"))
    folder = DataFolder(data.expanduser().absolute())
    try:
        store = Store(folder.path / "polepilot.db")
    except BaseException:
        folder.release()
        raise
    assembly = assemble(settings, last_site(store) or parse_site(demo_site(), "the demo site"))
    return Services(
        robot=assembly.robot,
        twin=assembly.twin,
        clock=assembly.clock,
        model=settings.model,
        board=settings.link.board,
        folder=folder,
        store=store,
        panel=Panel(settings.model, simulated=assembly.twin is not None)
        if settings.server.panel
        else None,
        host=host,
        port=port,
    )
