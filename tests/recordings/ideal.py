"""The same recordings with one of the robot's faults taken away: what does each of them cost?"""

from __future__ import annotations

import tempfile
from collections.abc import Collection
from dataclasses import replace
from pathlib import Path
from typing import Literal, get_args

from recordings.recording import fingerprint, write
from recordings.scenario import Kind, Scenario, draw

Part = Literal["pan", "odometry", "slip", "survey", "ranges", "bearings"]
PARTS: tuple[Part, ...] = get_args(Part)
"""A straight potentiometer; speed and steering as told but for slip; no slip; poles where the map
has them; ranges and bearings in the picture without error (the last two only where drawn)."""


def idealized(scenario: Scenario, parts: Collection[Part]) -> Scenario:
    """``scenario`` without some of its faults; all else is as it was, by the same lots."""
    robot, poles = scenario.robot, scenario.poles
    if "pan" in parts:
        robot = replace(robot, bend=(0.0,) * len(robot.bend))
    if "odometry" in parts:
        robot = replace(robot, speed_scale=1.0, steering_offset=0.0)
    if "slip" in parts:
        robot = replace(robot, slip=0.0, skew=0.0, bursts=0.0)
    if "survey" in parts:
        poles = tuple(
            pole if pole.id == scenario.moved else replace(pole, mapped=(pole.x, pole.y))
            for pole in poles
        )
    return replace(scenario, robot=robot, poles=poles)


def ideal_recording(kind: Kind, seed: int, keep: Path, parts: Collection[Part]) -> Path:
    """Its folder, without pictures, made now or before."""
    made = [part for part in PARTS if part in parts and part not in ("ranges", "bearings")]
    name = f"{kind}-{seed:04d}-without-{'-'.join(made) or 'nothing'}"
    folder = keep / f"recordings-{fingerprint()}" / name
    if not folder.is_dir():
        folder.parent.mkdir(parents=True, exist_ok=True)
        part = Path(tempfile.mkdtemp(prefix=".part-", dir=folder.parent))
        write(idealized(draw(kind, seed), made), part, pictures=False)
        part.rename(folder)
    return folder
