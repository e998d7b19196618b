"""What a survey works on: a recorded drive with what was seen, and what else is known."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from itertools import combinations, pairwise

from polepilot.core.errors import DatasetError, InputError
from polepilot.core.geometry import Point, Pose2D
from polepilot.core.localization.odometry import OdometryHistory
from polepilot.core.observation import Odometry, RangeBearing

Picture = tuple[float, tuple[RangeBearing, ...]]
"""Stamp and what was seen, possibly nothing."""

_APART = 0.05
"""Nearer to each other than this no two poles stand, metres: they are thicker."""


@dataclass(frozen=True, slots=True, eq=False)
class SurveyRun:
    """A recording, read: commands, pictures in order of time, and the robot's measures.

    Raises:
        DatasetError: no picture, pictures out of order, or impossible measures.
    """

    odometry: tuple[Odometry, ...]
    pictures: tuple[Picture, ...]
    wheelbase: float
    camera_forward: float
    pan_range: float = math.radians(135)
    """Half of it, radians."""
    breaks: tuple[float, ...] = ()
    """Moments across which nobody knows how the robot has moved: gaps in the recording."""
    speed_lag: float = 0.05
    """First guesses of the time constants, seconds."""
    steering_lag: float = 0.10
    history: OdometryHistory = field(init=False)

    def __post_init__(self) -> None:
        if not self.pictures:
            raise DatasetError("the recording holds no picture: expected frames with landmarks.")
        if any(after[0] < before[0] for before, after in pairwise(self.pictures)):
            raise DatasetError("the pictures are not in order of time.")
        if not (self.wheelbase > 0 and self.pan_range > 0 and math.isfinite(self.camera_forward)):
            raise DatasetError("the recording names an impossible wheelbase, camera or pan range.")
        history = OdometryHistory(
            self.wheelbase,
            speed_lag=self.speed_lag,
            steering_lag=self.steering_lag,
            span=math.inf,
        )
        for sample in self.odometry:
            history.add(sample)
        object.__setattr__(self, "history", history)

    def sightings(self) -> int:
        return sum(len(seen) for _, seen in self.pictures)

    def travelled(self) -> float:
        """Metres driven, according to odometry."""
        return self.history.moved(self.pictures[0][0], self.pictures[-1][0])[0]

    def broken(self, start: float, end: float) -> bool:
        """Whether the recording has a gap between two moments."""
        return any(start <= moment < end for moment in self.breaks)

    def sighting_counts(self) -> dict[int, int]:
        """How often each pole was seen."""
        counts: dict[int, int] = {}
        for _, seen in self.pictures:
            for sighting in seen:
                counts[sighting.landmark] = counts.get(sighting.landmark, 0) + 1
        return counts


@dataclass(frozen=True, slots=True)
class SurveyOptions:
    """What is known besides the recording. Metres.

    Raises:
        InputError: an impossible value.
    """

    hand_measured: Mapping[int, Point] = field(default_factory=dict)
    """A map to refine."""
    map_sigma: float = 0.01
    """How well it was measured, per coordinate."""
    anchors: Mapping[int, Point] = field(default_factory=dict)
    """Poles that define the coordinates; none, or two and more."""
    anchor_sigma: float = 0.002
    distance: tuple[int, int, float] | None = None
    """Two poles and how far apart they stand."""
    distance_sigma: float = 0.005
    start: Pose2D | None = None
    """Where the drive began, if coordinates refer to that; else it began at the origin."""
    range_sigma: float = 0.001
    """How wrong all ranges may be together, as a share: landmarks' size, camera constant."""

    def __post_init__(self) -> None:
        for name in ("map_sigma", "anchor_sigma", "distance_sigma", "range_sigma"):
            value = getattr(self, name)
            if not 0 < value < 10:
                raise InputError(f"{name.replace('_', '-')} is {value:g}: expected more than 0.")
        if len(self.anchors) == 1:
            raise InputError("one anchor is given: expected two or more, or none.")
        for (one, here), (other, there) in combinations(self.anchors.items(), 2):
            if not math.dist(here, there) > _APART:
                raise InputError(
                    f"anchors {one} and {other} are in one place: expected places of their own."
                )
        if self.anchors and self.hand_measured:
            raise InputError("anchors and a map to refine exclude each other: expected one.")
        if self.distance is not None:
            a, b, metres = self.distance
            if a == b or not 0 < metres < math.inf:
                raise InputError(
                    f"distance {a} {b} {metres:g}: expected two different poles, and metres."
                )
