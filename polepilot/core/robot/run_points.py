"""The four kinds of points of a run (paper, Fig. 15): real, measured, estimated, target.

From the files that `simulate` and `replay` write, or from the run's log.
"""

from __future__ import annotations

import csv
import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from polepilot.core.errors import DatasetError
from polepilot.core.evaluation import Covariances, covariances_of, read_covariances
from polepilot.core.geometry import Point
from polepilot.core.robot.fields import Fields
from polepilot.core.robot.run_log import RunLog, find_log
from polepilot.core.site import parse_site
from polepilot.core.trajectory import LARGEST, Array, Trajectory, read_tum

JUDGED = ("estimated", "smoothed", "measured", "deadreckoned")
"""Trajectories that may lie in a run's folder, the most important one first."""
_TRUE = ("real", "truth")
_NO_POSE = ("idle", "fixing", "lost")
"""States in which a published pose is not claimed to be one."""


@dataclass(slots=True)
class RunPoints:
    """What is known of a run. ``tracks`` are trajectories by name; targets are n x 2, metres."""

    tracks: dict[str, Trajectory]
    real: Trajectory | None = None
    targets: Array = field(default_factory=lambda: np.empty((0, 2)))
    covariances: Covariances | None = None
    """Of ``estimated``."""
    landmarks: tuple[tuple[int, Point], ...] = ()
    """Number and place, as the map has them."""
    notes: tuple[str, ...] = ()
    """What is missing, as sentences."""


def read_run(path: Path) -> RunPoints:
    """A run's folder, or its log.

    Raises:
        DatasetError: nothing there, or something that cannot be read; names file and line.
    """
    if path.is_dir() and (path / "estimated.tum").exists():
        return _from_files(path)
    log = find_log(path)
    if log is None:
        raise DatasetError(
            f"{path}: expected a trajectory (.tum), the log of a run (.mcap), or a folder with "
            "estimated.tum or run.mcap."
        )
    return _from_log(log)


def read_targets(path: Path) -> Array:
    """The file `target.csv` (``t,x,y``) of a simulated run: n x 2, repeated ones once.

    Raises:
        DatasetError: no such file, or a line that is no target.
    """
    places: list[tuple[float, float]] = []
    try:
        with path.open(newline="", encoding="utf-8") as file:
            for number, row in enumerate(csv.reader(file), start=1):
                if not row or (number == 1 and row[0].strip() == "t"):
                    continue
                try:
                    _, x, y = (float(word) for word in row)
                except ValueError:
                    x = y = math.nan
                if not (abs(x) <= LARGEST and abs(y) <= LARGEST):
                    raise DatasetError(f"{path}:{number}: expected three finite numbers `t,x,y`.")
                places.append((x, y))
    except (OSError, UnicodeDecodeError, csv.Error) as error:
        raise DatasetError(f"{path}: cannot be read as text ({error}).") from error
    return _once(places)


def _from_files(folder: Path) -> RunPoints:
    tracks = {
        name: read_tum(folder / f"{name}.tum")
        for name in JUDGED
        if (folder / f"{name}.tum").exists()
    }
    true = next((folder / f"{n}.tum" for n in _TRUE if (folder / f"{n}.tum").exists()), None)
    targets, covariances = folder / "target.csv", folder / "estimated.cov"
    points = RunPoints(
        tracks,
        None if true is None else read_tum(true),
        read_targets(targets) if targets.exists() else np.empty((0, 2)),
        read_covariances(covariances) if covariances.exists() else None,
    )
    log = find_log(folder)
    if log is not None:
        # A simulated run keeps its covariances and its map in its log only.
        recorded = _from_log(log)
        points.covariances = points.covariances or recorded.covariances
        points.landmarks, points.notes = recorded.landmarks, recorded.notes
    return points


def _from_log(path: Path) -> RunPoints:
    log = RunLog(path)
    real: list[Sequence[float]] = []
    estimated: list[Sequence[float]] = []
    measured: list[Sequence[float]] = []
    uppers: list[Sequence[float]] = []
    targets: list[tuple[float, float]] = []
    landmarks: tuple[tuple[int, Point], ...] = ()
    for _, channel, fields in log.messages("site", "snapshot"):
        if channel == "site":
            site = parse_site(fields.document, str(fields.path))
            landmarks = tuple((mark.id, mark.position) for mark in site.landmarks)
            continue
        stamp = fields.number("t")
        for rows in (real, estimated, measured):
            if rows and stamp < rows[-1][0] - 1.0:
                raise DatasetError(f"{fields.where}: t = {stamp}: the clock has jumped back.")
        if (true := _numbers(fields, "real", 3)) is not None:
            real.append((stamp, *true))
        pose, upper = _numbers(fields, "estimated", 4), _numbers(fields, "covariance", 6)
        claimed = fields.text("state") not in _NO_POSE
        if pose is not None and upper is not None and claimed:
            estimated.append((stamp, *pose[:3]))
            uppers.append(upper)
        seen = _numbers(fields, "measured", 4)
        if seen is not None and (not measured or seen[0] > measured[-1][0]):
            measured.append(seen)
        target = _numbers(fields, "target", 2)
        if target is not None:
            targets.append((target[0], target[1]))
    if not estimated:
        raise DatasetError(f"{path}: holds no estimated poses.")
    track = _trajectory(estimated)
    return RunPoints(
        {"estimated": track, "measured": _trajectory(measured)},
        _trajectory(real) if real else None,
        _once(targets),
        covariances_of(track.stamps, np.array(uppers)),
        landmarks,
        tuple(log.notes),
    )


def _numbers(fields: Fields, key: str, count: int) -> Sequence[float] | None:
    values = fields.value(key)
    if values is None:
        return None
    good = isinstance(values, list) and len(values) == count
    if not good or not all(isinstance(v, int | float) and abs(v) <= LARGEST for v in values):
        raise DatasetError(f"{fields.where}: {key}: expected {count} finite numbers.")
    return [float(value) for value in values]


def _trajectory(rows: Sequence[Sequence[float]]) -> Trajectory:
    table = np.array(rows, dtype=float).reshape(-1, 4)
    table = table[np.argsort(table[:, 0], kind="stable")]
    return Trajectory(table[:, 0], table[:, 1:])


def _once(places: Sequence[tuple[float, float]]) -> Array:
    """Each target as long as it was the target: once."""
    table = np.array(places, dtype=float).reshape(-1, 2)
    if len(table) < 2:
        return table
    new = np.concatenate([[True], (np.abs(np.diff(table, axis=0)) > 1e-6).any(axis=1)])
    return np.asarray(table[new])
