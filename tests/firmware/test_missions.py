"""Whole missions of the simulator, driven through C on a pseudo-terminal, as through the Python
board: same plan, same world, same chance."""

from __future__ import annotations

import json
import math
from collections.abc import Callable
from importlib.resources import files
from pathlib import Path

import pytest
from firmware.boards import HOST, PIC, chip_board, make

from polepilot.commands.simulation import Simulation, SimulationResult
from polepilot.core.geometry import Pose2D
from polepilot.core.plan import Plan
from polepilot.core.planning.coverage import plan_scan
from polepilot.core.planning.options import PlanOptions
from polepilot.core.planning.route import plan_route
from polepilot.core.robot.recorder import Recorder
from polepilot.core.robot.robot import Robot, RobotSettings
from polepilot.core.sim.board import BoardSettings
from polepilot.core.sim.board_process import BoardProcess
from polepilot.core.sim.world import World
from polepilot.core.site import Site, parse_site
from polepilot.core.vehicle import Proximity, RobotModel

DEMO = json.loads(files("polepilot").joinpath("demo/workshop.json").read_text("utf-8"))
SMALL = {
    "name": "Small",
    "boundary": [[0, 0], [4.2, 0], [4.2, 3.4], [0, 3.4]],
    "landmarks": [
        {"id": 1, "x": 0, "y": 0.6},
        {"id": 2, "x": 0, "y": 2.8},
        {"id": 4, "x": 2.1, "y": 3.4},
        {"id": 7, "x": 4.2, "y": 2.8},
        {"id": 8, "x": 4.2, "y": 0.6},
        {"id": 11, "x": 2.1, "y": 0},
    ],
    "routes": [{"name": "Across", "nodes": [[1.0, 1.0], [3.2, 1.0], [3.2, 2.4]]}],
    "start": [1.0, 1.0, 0.0],
}


USUAL = RobotSettings()
SHORT_SIGHTED = RobotSettings(model=RobotModel(proximity=Proximity(max_range=0.8)))
"""A robot with the infrared rangers that the AVR boards read."""


def fly(
    site: Site,
    plan: Plan,
    seed: int,
    folder: Path,
    board: BoardProcess | None,
    settings: RobotSettings,
) -> SimulationResult:
    """One run from start to end."""
    (x0, y0), (x1, y1) = plan.path[0], plan.path[1]
    heading = math.atan2((y1 - y0) * plan.gear[0], (x1 - x0) * plan.gear[0])
    world = World(
        site,
        settings.model,
        seed=seed,
        start=Pose2D(float(x0), float(y0), heading),
        board=board,
        full_speed=settings.calibration.full_speed_left,
    )
    robot = Robot(settings, world.sensor, world.link)
    recorder = Recorder(folder / "run.mcap", witness=lambda: world.truth, patient=True)
    return Simulation(site, plan, world, robot, recorder).run(3 * plan.predicted.duration + 120)


def host() -> BoardProcess:
    make("host", of="host")
    return BoardProcess.host(HOST, BoardSettings.from_model(USUAL.model))


def compare(
    site: Site,
    plan: Plan,
    seed: int,
    folder: Path,
    board: Callable[[], BoardProcess],
    settings: RobotSettings = USUAL,
) -> SimulationResult:
    """The same mission through both boards.

    Packets reach the two at other moments, so that the runs are not the same to the millimetre;
    their outcome is.
    """
    python = fly(site, plan, seed, folder, None, settings)
    through_c = fly(site, plan, seed, folder, board(), settings)
    assert (python.outcome, through_c.outcome) == ("done", "done"), through_c.reason
    assert (python.contacts, through_c.contacts) == (0, 0)
    assert through_c.coverage == pytest.approx(python.coverage, abs=0.02)
    assert through_c.simulated_s == pytest.approx(python.simulated_s, rel=0.10)
    assert through_c.position_error.mean <= 0.04
    assert through_c.position_error.p95 <= python.position_error.p95 + 0.02
    return through_c


def options() -> PlanOptions:
    return PlanOptions.from_vehicle(USUAL.model.vehicle)


@pytest.mark.slow
@pytest.mark.parametrize(
    "seed", [1, *(pytest.param(seed, marks=pytest.mark.soak) for seed in range(2, 6))]
)
def test_a_room_is_scanned(tmp_path: Path, seed: int) -> None:
    site = parse_site(SMALL, "small")
    compare(site, plan_scan(site, options()), seed, tmp_path, host)


def test_a_tour_of_the_workshop(tmp_path: Path) -> None:
    site = parse_site(DEMO, "demo")
    compare(site, plan_route(site, "Tour", options()), 3, tmp_path, host)


@pytest.mark.slow
@pytest.mark.parametrize("chip", ["atmega328p", PIC])
def test_a_route_through_machine_code(tmp_path: Path, chip: str) -> None:
    """Every byte and every pin of the chip; its rangers see 80 cm far."""
    site = parse_site(SMALL, "small")
    plan = plan_route(site, "Across", options())
    compare(site, plan, 1, tmp_path, lambda: chip_board(chip), SHORT_SIGHTED)
