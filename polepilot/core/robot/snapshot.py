"""One published tick of the robot: everything that a screen, a log or another program may see."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum
from typing import Literal

from polepilot.core.command import STAND, DriveCommand
from polepilot.core.geometry import Point, Pose2D
from polepilot.core.observation import Detection, PoseEstimate
from polepilot.core.plan import Mode


class State(StrEnum):
    """What the robot is about, in one word."""

    IDLE = "idle"
    """No site is loaded."""
    FIXING = "fixing"
    """Standing, sweeping for landmarks."""
    READY = "ready"
    """The pose is known, nothing runs."""
    RUNNING = "running"
    PAUSED = "paused"
    STOPPED = "stopped"
    """Emergency stop, latched until somebody releases it."""
    LOST = "lost"
    """The pose is not known well enough to drive."""


STAGES = ("sample", "estimate", "decide", "command", "publish")
"""What one tick of the robot consists of."""
Level = Literal["info", "warning", "fault"]


@dataclass(frozen=True, slots=True)
class Event:
    """Something that happened, for the event list and the log."""

    seq: int
    stamp: float
    code: str
    level: Level
    text: str


@dataclass(frozen=True, slots=True)
class LinkStatus:
    """The line to the microcontroller."""

    state: Literal["closed", "connecting", "idle", "armed", "link_lost", "estop"] = "closed"
    age: float | None = None
    """Seconds since the last telemetry."""
    sent: int = 0
    lost: int = 0
    crc_errors: int = 0
    round_trip: float | None = None


@dataclass(frozen=True, slots=True)
class MissionStatus:
    """How far the plan that is being executed has got. Areas in m², ``eta`` in seconds."""

    run_id: int
    mode: Mode
    progress: float
    """Share of the path, 0 to 1."""
    travelled: float
    length: float
    coverage: float | None
    """Share of the plan's area swept according to the filtered pose; None for routes."""
    swept_area: float | None
    missed_area: float | None
    elapsed: float
    eta: float | None


@dataclass(frozen=True, slots=True)
class Measured:
    """The pose from the last measurement before filtering (the paper's R_2^2)."""

    stamp: float
    pose: Pose2D


@dataclass(frozen=True, slots=True, eq=False)
class Snapshot:
    """The state of everything at ``stamp`` (the robot's clock)."""

    seq: int
    stamp: float
    state: State
    reason: str
    estimate: PoseEstimate | None = None
    measured: Measured | None = None
    target: Point | None = None
    command: DriveCommand = STAND
    pan: float | None = None
    proximity: tuple[float | None, float | None, float | None] = (None, None, None)
    battery: float | None = None
    link: LinkStatus = LinkStatus()
    detections: tuple[Detection, ...] = ()
    detections_stamp: float | None = None
    mission: MissionStatus | None = None
    events: tuple[Event, ...] = ()
    """The newest twenty, oldest first."""
    durations: tuple[float, float, float, float, float] = (0.0, 0.0, 0.0, 0.0, 0.0)
    """Seconds that each of the ``STAGES`` took in this tick."""
