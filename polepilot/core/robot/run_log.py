"""A run's log as a recording that can be replayed: measurements instead of pictures."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import fields as fields_of
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from polepilot.core.errors import DatasetError, InputError
from polepilot.core.localization.localizer import LocalizerSettings
from polepilot.core.observation import Odometry, PanReading, RangeBearing
from polepilot.core.robot.dataset import Dataset, Sample, Sighted, in_order
from polepilot.core.robot.fields import LARGEST, Fields, parse_json
from polepilot.core.robot.log import LogReader
from polepilot.core.site import Site, parse_site
from polepilot.core.trajectory import Trajectory
from polepilot.core.vehicle import Camera, Vehicle

LOG = "run.mcap"
"""What the log is called in the folder of a run."""
_BACKWARD = 1.0
"""Telemetry may be stamped a little out of order; a clock that was set back goes farther."""
_TOLERATED = ("tolerance", "degraded_after", "degraded_sigma", "lost_after", "lost_sigma")
"""Of the localizer's settings, what people set; all else is what today's program believes."""

Messages = Iterator[tuple[int, str, Fields]]


def find_log(path: Path) -> Path | None:
    """The log that ``path`` is, or holds as the folder of a run; None where there is none."""
    if path.is_dir():
        inside = path / LOG
        return inside if inside.is_file() else None
    return path if path.is_file() else None


class RunLog:
    """The messages of a log, each checked to be an object; ``notes`` once they were read."""

    def __init__(self, path: Path) -> None:
        self.path = path
        self.notes: list[str] = []

    def messages(self, *channels: str) -> Messages:
        """Number (from 1), channel and document of the messages on ``channels``.

        Raises:
            DatasetError: no such file, no log, or a message that is no JSON object.
        """
        reader = LogReader(self.path)
        try:
            for number, (channel, _, data) in enumerate(reader, start=1):
                if channel in channels:
                    where = Path(f"{self.path}: message {number}")
                    try:
                        text = data.decode("utf-8")
                    except UnicodeDecodeError as error:
                        raise DatasetError(f"{where}: is no text ({error}).") from error
                    yield number, channel, Fields(where, channel, parse_json(text, where))
        except OSError as error:
            problem = error.strerror or error
            raise DatasetError(f"{self.path}: cannot be read: {problem}.") from error
        if reader.count == 0:
            why = reader.cut or "it has no messages"
            raise DatasetError(f"{self.path}: expected the log of a run (MCAP): {why}.")
        if reader.cut:
            self.notes = [f"{self.path.name}: {reader.cut}: what came before is used."]


def read_run_log(path: Path) -> Dataset:
    """The recording in a log: what its localizer was given, and the truth where it is known.

    A log that was cut off comes back as far as it goes; ``notes`` say so.

    Raises:
        DatasetError: nothing that can be replayed; the message names file, message and field.
    """
    log = RunLog(path)
    samples: list[Sample] = []
    truth: list[tuple[float, ...]] = []
    robot: Fields | None = None
    site: Site | None = None
    last = -math.inf
    for _, channel, fields in log.messages("robot", "site", "odometry", "sighting", "snapshot"):
        if channel == "robot":
            robot = fields
        elif channel == "site":
            site = _site(fields)
        elif channel == "odometry":
            stamp = fields.number("t")
            if stamp < last - _BACKWARD:
                raise DatasetError(
                    f"{fields.where}: t = {stamp} follows {last}: the clock has jumped back."
                )
            last = stamp
            samples += _odometry(fields, stamp)
        elif channel == "sighting":
            samples.append(_sighting(fields))
        elif fields.value("real") is not None:
            truth.append((fields.number("t"), *_triple(fields, "real")))
    if robot is None or site is None:
        missing = "robot" if robot is None else "site"
        raise DatasetError(
            f"{path}: holds no {missing!r} message: it ends too early, or comes from a version "
            "that did not record what a replay needs."
        )
    if not any(isinstance(sample, Sighted) for sample in samples):
        raise DatasetError(f"{path}: holds no sightings: there is nothing to replay.")
    table = np.array(sorted(truth)).reshape(-1, 4)
    pan = robot.child("pan")
    robot.child("vehicle").number("wheelbase", above=0)
    return Dataset(
        folder=path,
        camera=Camera(**_numbers(robot.child("camera"), Camera)),
        vehicle=Vehicle(**_numbers(robot.child("vehicle"), Vehicle)),
        pan_minimum=pan.number("minimum"),
        pan_maximum=pan.number("maximum"),
        landmarks=dict(site.landmarks_by_id()),
        samples=in_order(samples),
        truth=Trajectory(table[:, 0], table[:, 1:]) if len(table) else None,
        settings=_settings(robot.child("localizer")),
        notes=tuple(log.notes),
    )


def _odometry(fields: Fields, stamp: float) -> list[Sample]:
    steering = fields.number("steering", within=(-1.55, 1.55))
    samples: list[Sample] = [Odometry(stamp, fields.number("speed"), steering)]
    pan = fields.number_or_none("pan")
    if pan is not None:
        samples.append(PanReading(stamp, pan))
    return samples


def _sighting(fields: Fields) -> Sighted:
    stamp = fields.number("t")
    measured = []
    for one in fields.items("measurements"):
        away, sigma = one.number_or_none("range", 0), one.number_or_none("range_sigma", 0)
        measured.append(
            RangeBearing(
                stamp,
                one.count("landmark"),
                math.inf if away is None else away,
                one.number("bearing"),
                math.inf if away is None or sigma is None else sigma,
                one.number("bearing_sigma", above=0),
                one.number_or_none("pan") if "pan" in one else None,
            )
        )
    pan = fields.number_or_none("pan") if "pan" in fields else None
    return Sighted(stamp, tuple(measured), pan)


def _triple(fields: Fields, key: str) -> tuple[float, float, float]:
    values = fields.value(key)
    good = isinstance(values, list) and len(values) == 3
    if not good or not all(isinstance(v, int | float) and abs(v) <= LARGEST for v in values):
        raise DatasetError(f"{fields.where}: {key}: expected x, y and heading.")
    return float(values[0]), float(values[1]), float(values[2])


def _site(fields: Fields) -> Site:
    try:
        return parse_site(fields.document, str(fields.path))
    except DatasetError:
        raise
    except InputError as error:
        raise DatasetError(error.message) from error


def _settings(fields: Fields) -> LocalizerSettings:
    found: dict[str, Any] = {n: fields.number(n, above=0) for n in _TOLERATED if n in fields}
    if "method" in fields:
        method = fields.text("method")
        if method not in ("ekf", "paper"):
            raise DatasetError(f"{fields.where}: method is {method!r}: expected 'ekf' or 'paper'.")
        found["method"] = method
    return replace(LocalizerSettings(), **found)


def _numbers(fields: Fields, known: type) -> dict[str, Any]:
    """The fields of ``known`` that are single numbers; others keep their default."""
    found: dict[str, Any] = {}
    for one in fields_of(known):
        if one.name in fields and isinstance(one.default, int | float):
            whole = isinstance(one.default, int)
            found[one.name] = fields.count(one.name) if whole else fields.number(one.name)
    return found
