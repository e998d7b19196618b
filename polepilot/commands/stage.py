"""Where a board is tried: on its serial port, or simulated with a robot and a hall around it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from polepilot.core.errors import InputError

if TYPE_CHECKING:
    from polepilot.core.geometry import Pose2D
    from polepilot.core.robot.ports import Clock, LinkPort
    from polepilot.core.sim.motion import Disturbances
    from polepilot.server.settings import Settings

_HALL = 40.0
"""Side of the simulated hall, metres: nothing is near its middle."""
_STEADY_NAME = Path("/dev/polepilot")
"""What the udev rule of deploy/ calls the board."""
BAUD_RATES = (250_000, 115_200)
"""Of the firmware on Arduino boards, and elsewhere."""


@dataclass(frozen=True, slots=True)
class Stage:
    """A line to a board, and the time that goes with it."""

    port: LinkPort
    clock: Clock
    name: str
    """Where it is, in words."""
    hall: Hall | None = None
    """Around the simulated robot."""
    again: Callable[[int], LinkPort] | None = None
    """Opens the same serial port at another baud rate."""


class Hall:
    """The simulated robot's surroundings, and the tape measure that a person would use there."""

    def __init__(self, settings: Settings, disturbances: Disturbances | None = None) -> None:
        import numpy as np

        from polepilot.core.sim.board_pins import BoardSettings
        from polepilot.core.sim.board_process import BoardProcess
        from polepilot.core.sim.world import World
        from polepilot.core.site import parse_site
        from polepilot.server.firmware import host_program

        seed = settings.simulation.seed
        board = None
        if settings.link.board == "host":
            board = BoardProcess.host(host_program(), BoardSettings.from_model(settings.model))
        corners = [[0, 0], [_HALL, 0], [_HALL, _HALL], [0, _HALL]]
        start = [_HALL / 2, _HALL / 2, 0]
        if disturbances is None:
            disturbances = settings.disturbances(np.random.default_rng(seed))
        self.world = World(
            parse_site({"name": "Hall", "boundary": corners, "start": start}, "the hall"),
            settings.model,
            seed=seed,
            board=board,
            disturbances=disturbances,
        )
        self._line = self.world.truth

    def put_on_line(self) -> Pose2D:
        """Carry the robot back to the start line."""
        from polepilot.core.geometry import Pose2D

        self._line = Pose2D(_HALL / 2, _HALL / 2, 0.0)
        self.world.place(self._line)
        return self._line

    def measured(self) -> tuple[float, float]:
        """How far ahead of the line, and how far to the left, the robot's axle stands; metres."""
        there = self._line.inverse().compose(self.world.truth)
        return there.x, there.y


def simulated_stage(settings: Settings) -> Stage:
    """The simulated robot in an empty hall, in real time."""
    from polepilot.core.sim.clock import PacedClock

    hall = Hall(settings)
    return Stage(hall.world.link, PacedClock(hall.world), f"{settings.link.board} board", hall)


def serial_stage(named: str | None, baud_rate: int) -> Stage:
    """A serial port: the one that is named, or the only one that is plugged in.

    Raises:
        ConfigError: the name is none.
        InputError: none is named, and there is none or more than one.
    """
    from polepilot.core.link.usb import PortAddress, SerialPort
    from polepilot.server.clock import MonotonicClock

    address = PortAddress.parse(named or _only_port())
    clock = MonotonicClock()

    def at(rate: int) -> SerialPort:
        return SerialPort(address, rate, clock.now)

    return Stage(at(baud_rate), clock, str(address), None, at)


def _only_port() -> str:
    from serial.tools import list_ports

    if _STEADY_NAME.exists():
        return str(_STEADY_NAME)
    found = sorted(str(port.device) for port in list_ports.comports() if port.vid is not None)
    if len(found) == 1:
        return found[0]
    if not found:
        raise InputError(
            "No serial device is plugged in.",
            remedy="Check the USB cable and the board's power, or name the port.",
        )
    raise InputError(
        f"Several serial devices are plugged in: {', '.join(found)}.", remedy="Name one of them."
    )
