"""A robot in a simulated world, driven tick by tick."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from polepilot.commands.simulation import TICK
from polepilot.core.geometry import Pose2D
from polepilot.core.plan import Plan
from polepilot.core.robot.eye import Eye
from polepilot.core.robot.mission import RunSummary
from polepilot.core.robot.recorder import Recorder
from polepilot.core.robot.robot import Robot, RobotSettings
from polepilot.core.robot.snapshot import Snapshot, State
from polepilot.core.sim.world import World
from polepilot.core.site import Site, parse_site
from polepilot.core.vision.detector import LandmarkDetector

ROOM = {
    "name": "Room",
    "boundary": [[0, 0], [6, 0], [6, 4], [0, 4]],
    "landmarks": [
        {"id": 1, "x": 0, "y": 1},
        {"id": 2, "x": 0, "y": 3},
        {"id": 4, "x": 3, "y": 4},
        {"id": 7, "x": 6, "y": 3},
        {"id": 8, "x": 6, "y": 1},
        {"id": 11, "x": 3, "y": 0},
    ],
    "routes": [{"name": "Across", "nodes": [[2.5, 2.0], [4.8, 2.0]]}],
    "start": [1.0, 2.0, 0.0],
}


def room(**changes: object) -> Site:
    return parse_site({**ROOM, **changes}, "room")


class Rig:
    """World, robot and recorder; time passes in ``run``."""

    def __init__(
        self,
        site: Site,
        *,
        seed: int = 1,
        rendered: bool = False,
        pose: Pose2D | None = None,
        settings: RobotSettings | None = None,
    ) -> None:
        self.settings = settings or RobotSettings()
        self.world = World(site, self.settings.model, seed=seed, start=pose)
        lens = self.settings.model.camera
        sensor = (
            Eye(self.world.camera, lambda kinds: LandmarkDetector(lens, kinds))
            if rendered
            else self.world.sensor
        )
        self.robot = Robot(self.settings, sensor, self.world.link)
        self.ended: list[RunSummary] = []
        self.robot.on_run_ended = self.ended.append
        self.robot.load_site(site)
        self.now = 0.0
        self.snapshot = self.step()

    def step(self) -> Snapshot:
        self.now += TICK
        self.world.advance(self.now)
        self.snapshot = self.robot.step(self.now)
        return self.snapshot

    def run(
        self,
        seconds: float,
        until: Callable[[Snapshot], bool] = lambda _: False,
        each: Callable[[Snapshot], None] = lambda _: None,
    ) -> bool:
        """Let time pass; whether ``until`` came true."""
        end = self.now + seconds
        while self.now < end:
            each(self.step())
            if until(self.snapshot):
                return True
        return False

    def ready(self) -> Rig:
        """Until the pose is known."""
        assert self.run(20, lambda s: s.state is State.READY), self.snapshot
        return self

    def start(self, plan: Plan, log: Path, run_id: int = 1) -> Rig:
        """Start a mission and wait until the wheels turn."""
        self.recorder = Recorder(log, witness=lambda: self.world.truth)
        self.robot.start(plan, run_id, self.recorder)
        assert self.run(10, lambda _: abs(self.world.speed) > 0.05), self.snapshot
        return self

    def codes(self) -> set[str]:
        return {event.code for event in self.snapshot.events}
