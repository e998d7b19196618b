"""What a survey found: poles with their uncertainty, the path, and what was wrong."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from polepilot.core.geometry import Point, Pose2D

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True, eq=False)
class SurveyedPole:
    """A pole that was placed."""

    id: int
    x: float
    y: float
    covariance: Array
    """2 x 2, m². Of the map's shape where nothing says how it lies, else in `map`."""
    sightings: int
    """That were used."""
    rejected: int
    """That contradicted the rest: another pole misread as this one, most likely."""
    measured: Point | None = None
    """Where the hand-measured map has it."""
    wrong: bool = False
    """Whether the recording says that it does not stand there."""

    @property
    def position(self) -> Point:
        return (self.x, self.y)

    @property
    def sigma(self) -> float:
        """Standard deviation along the worst direction, metres."""
        return float(np.sqrt(np.linalg.eigvalsh(self.covariance)[-1]))

    @property
    def moved(self) -> Point | None:
        """From where it was measured to where it is, metres."""
        if self.measured is None:
            return None
        return (self.x - self.measured[0], self.y - self.measured[1])

    def to_json(self) -> dict[str, Any]:
        moved = self.moved
        p = self.covariance
        return {
            "id": self.id,
            "x": self.x,
            "y": self.y,
            "sigma": self.sigma,
            "covariance": [float(p[0, 0]), float(p[0, 1]), float(p[1, 1])],
            "sightings": self.sightings,
            "rejected": self.rejected,
            "measured": None if self.measured is None else list(self.measured),
            "moved": None
            if moved is None
            else {"dx": moved[0], "dy": moved[1], "distance": math.hypot(*moved)},
            "wrong": self.wrong,
        }


@dataclass(frozen=True, slots=True)
class Unplaced:
    """A pole that was seen, or is on the hand-measured map, and could not be placed."""

    id: int
    sightings: int
    reason: str

    def to_json(self) -> dict[str, Any]:
        return {"id": self.id, "sightings": self.sightings, "reason": self.reason}


@dataclass(frozen=True, slots=True)
class Value:
    """A number that came out besides, and its standard deviation."""

    value: float
    sigma: float

    def to_json(self) -> dict[str, float]:
        return {"value": self.value, "sigma": self.sigma}


@dataclass(frozen=True, slots=True, eq=False)
class Survey:
    """A map of poles and the path that was driven, made from one recording."""

    poles: tuple[SurveyedPole, ...]
    not_placed: tuple[Unplaced, ...]
    path: tuple[tuple[float, Pose2D], ...]
    """Stamp and pose of `base_link` per picture, as far as they are known."""
    frame: str
    """What the coordinates refer to: ``first pose``, ``start``, ``anchors`` or ``map``."""
    distortions: Mapping[str, Value]
    """speed_scale (true per reported), steering_offset, servo_lag, motor_lag, range_scale
    (measured per true), pan_offset, pan_scale, pan_bow: metres, radians, seconds."""
    misfit: float
    """Root mean square of what is left of the sightings, in their own standard deviations."""
    notes: tuple[str, ...] = ()
    converged: bool = True
    """Whether the fit has settled; otherwise its figures are not to be used."""

    @property
    def wrong(self) -> tuple[SurveyedPole, ...]:
        """Poles that do not stand where they were measured, the farthest first."""
        wrong = [pole for pole in self.poles if pole.wrong]
        return tuple(sorted(wrong, key=lambda pole: -math.hypot(*(pole.moved or (0.0, 0.0)))))

    def places(self) -> dict[int, Point]:
        return {pole.id: pole.position for pole in self.poles}

    def to_json(self) -> dict[str, Any]:
        """The ``survey --json`` document."""
        return {
            "frame": self.frame,
            "poles": [pole.to_json() for pole in self.poles],
            "not_placed": [one.to_json() for one in self.not_placed],
            "wrong": [pole.id for pole in self.wrong],
            "path": [[stamp, *pose] for stamp, pose in self.path],
            "distortions": {name: value.to_json() for name, value in self.distortions.items()},
            "misfit": self.misfit,
            "converged": self.converged,
            "notes": list(self.notes),
        }
