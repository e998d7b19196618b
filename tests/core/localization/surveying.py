"""Recordings of the generator as surveys take them, and how a survey compares with the truth."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from core.localization.generator import FORWARD, WHEELBASE, Faults, Recording, record

from polepilot.core.geometry import Point, Pose2D
from polepilot.core.localization.survey_align import fit_rigid
from polepilot.core.localization.survey_result import Survey
from polepilot.core.localization.survey_run import SurveyRun
from polepilot.core.observation import Odometry, RangeBearing

YARD = [
    (0.5, 0.5),
    (10.0, 0.2),
    (19.5, 0.6),
    (19.7, 7.5),
    (19.4, 14.6),
    (10.2, 14.8),
    (0.4, 14.5),
    (0.3, 7.4),
]
YARD_LOOP = [(3.0, 3.0), (16.0, 3.2), (16.5, 11.5), (10.0, 8.0), (3.5, 11.8)]
PLACES: dict[str, dict[str, Any]] = {
    "room": {},
    "yard": {"places": YARD, "loop": YARD_LOOP, "speed": 0.5},
}
SECONDS = 90.0
Change = Callable[[RangeBearing], Iterable[RangeBearing]]


@dataclass(frozen=True)
class Drive:
    """A recorded drive and where the poles really stood."""

    run: SurveyRun
    truth: dict[int, Point]


def drive(place: str, seed: int, scale: float = 1.0, **more: Any) -> Drive:
    """A drive of 90 s past poles that stand exactly where the generator's map has them.

    ``scale``: all ranges come out so many times too long.
    """
    faults = more.pop("faults", Faults(survey_sigma=0.0))
    recording = record(seed, SECONDS, faults=faults, **PLACES[place], **more)
    truth = {number: mark.position for number, mark in recording.landmarks.items()}
    return Drive(to_run(recording, lambda m: [replace(m, range=scale * m.range)]), truth)


def to_run(recording: Recording, change: Change = lambda m: [m]) -> SurveyRun:
    """``change``: what becomes of each sighting."""
    odometry = [event for event in recording.events if isinstance(event, Odometry)]
    pictures = [
        (event[0], tuple(new for m in event[1] for new in change(m)))
        for event in recording.events
        if not isinstance(event, Odometry)
    ]
    return SurveyRun(tuple(odometry), tuple(pictures), WHEELBASE, FORWARD)


def changed(run: SurveyRun, change: Change) -> SurveyRun:
    """The same drive with other sightings."""
    pictures = [(t, tuple(new for m in seen for new in change(m))) for t, seen in run.pictures]
    return replace(run, pictures=tuple(pictures))


def errors(found: Survey, truth: dict[int, Point], *, align: bool = True) -> dict[int, float]:
    """Per pole how far it is from the truth, metres; ``align``: after the best rigid motion."""
    pose = _laid(found, truth) if align else Pose2D(0.0, 0.0, 0.0)
    return {
        pole.id: math.dist(pose.to_parent(pole.position), truth[pole.id]) for pole in found.poles
    }


def nees(found: Survey, truth: dict[int, Point], *, align: bool = True) -> float:
    """Mean squared error of the poles in their own sigmas: 2 if those are right."""
    pose = _laid(found, truth) if align else Pose2D(0.0, 0.0, 0.0)
    cos, sin = math.cos(pose.heading), math.sin(pose.heading)
    turn = np.array([[cos, -sin], [sin, cos]])
    values = []
    for pole in found.poles:
        off = np.array(pose.to_parent(pole.position)) - np.array(truth[pole.id])
        values.append(off @ np.linalg.solve(turn @ pole.covariance @ turn.T, off))
    return float(np.mean(values))


def _laid(found: Survey, truth: dict[int, Point]) -> Pose2D:
    return fit_rigid(found.places(), truth, tuple(pole.id for pole in found.poles))
