"""Judges ``replay`` on a recording whose truth is known."""

from __future__ import annotations

import math
import time
from collections import Counter
from collections.abc import Collection, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any
from unittest.mock import patch

import numpy as np
from numpy.typing import NDArray
from recordings.ideal import Part, ideal_recording
from recordings.noticed import drawn, looked
from recordings.recording import Told, read_told, recording
from recordings.scenario import Kind

from polepilot.core.localization.localizer import Localizer, LocalizerSettings
from polepilot.core.observation import Detection, RangeBearing, Status
from polepilot.core.robot.dataset import FrameFile, read_dataset
from polepilot.core.robot.replay import ReplayResult, replay
from polepilot.core.trajectory import Trajectory

BOUND = 7.8147
"""Of NEES with three degrees of freedom: 95 % lie below."""
NEAR = 0.20
NEAR_TURN = math.radians(3)
HOLDS = 1.0
"""Seconds for which a pose must be near the truth after the robot was taken away."""
ALLOWED = 3.0
"""After so many seconds with two poles seen, a pose that is still wrong counts as error."""
Floats = NDArray[np.float64]


@dataclass(slots=True, eq=False)
class Verdict:
    """What became of one recording; lengths in metres, angles in radians."""

    kind: Kind
    seed: int
    due: int = 0
    """Pictures after the first motion."""
    given: int = 0
    """Of them, with a pose."""
    position: Floats = field(default_factory=lambda: np.empty(0))
    heading: Floats = field(default_factory=lambda: np.empty(0))
    nees: Floats = field(default_factory=lambda: np.empty(0))
    reckoned: Floats = field(default_factory=lambda: np.empty(0))
    """Position errors by dead reckoning alone."""
    recovery: float | None = None
    """Seconds from the second whole pole after the robot was taken away; inf: never."""
    unaware: float = 0.0
    """Seconds in which the pose was claimed and far outside of its own bound, taken away or not."""
    events: Counter[str] = field(default_factory=Counter)
    moved_after: float | None = None
    """Sweeps from when the moved pole was first whole in view with a pose; inf: not reported."""
    moved_error: float | None = None
    false_reports: list[str] = field(default_factory=list)
    first_pose: float = math.inf
    """Seconds from the recording's beginning."""
    whole_frames: float = 0.0
    """Share of the pictures with a whole pole; ``read_frames``: with a detection."""
    read_frames: float = 0.0
    whole: int = 0
    read: int = 0
    """Whole poles, and those of them that were read."""
    cut_read: int = 0
    wrong: int = 0
    """Detections of what is not within view."""
    range_errors: Floats = field(default_factory=lambda: np.empty(0))
    """Relative; and errors over sigmas."""
    range_ratios: Floats = field(default_factory=lambda: np.empty(0))
    bearing_errors: Floats = field(default_factory=lambda: np.empty(0))
    bearing_ratios: Floats = field(default_factory=lambda: np.empty(0))
    microseconds: float = 0.0
    """Of the localizer's update per measurement; with the fix, the prediction and the books."""
    frame_microseconds: float = 0.0
    """Of the whole replay per picture, without reading and seeing it."""


def judge(
    kind: Kind,
    seed: int,
    keep: Path,
    *,
    measured: bool = False,
    ideal: Collection[Part] = (),
    settings: LocalizerSettings | None = None,
) -> Verdict:
    """One recording, made, replayed and judged.

    Args:
        kind: what happens in it.
        seed: which one of its kind.
        keep: folder for recordings.
        measured: draw the detections by lot, from the detector's errors; no pictures.
        ideal: faults to take away; these recordings are always ``measured``.
        settings: of the localizer.
    """
    measured = measured or bool(ideal)
    if ideal:
        folder = ideal_recording(kind, seed, keep, ideal)
    else:
        folder = recording(kind, seed, keep, pictures=not measured)
    dataset, told = read_dataset(folder), read_told(folder)
    look = drawn(told, seed, ideal) if measured else looked(dataset)
    spent = 0.0
    seen: dict[float, Sequence[Detection]] = {}

    def see(frame: FrameFile) -> Sequence[Detection]:
        nonlocal spent
        begin = time.process_time()
        found = seen[round(frame.stamp, 6)] = look(frame)
        spent += time.process_time() - begin
        return found

    updating = 0.0
    update = Localizer.add_measurements

    def timed(localizer: Localizer, measurements: Sequence[RangeBearing]) -> None:
        nonlocal updating
        begin = time.process_time()
        update(localizer, measurements)
        updating += time.process_time() - begin

    begin = time.process_time()
    with patch.object(Localizer, "add_measurements", timed):
        result = replay(dataset, see, settings)
    lasted = time.process_time() - begin - spent
    out = Verdict(kind, seed)
    out.microseconds = 1e6 * updating / max(sum(len(row) for row in seen.values()), 1)
    out.frame_microseconds = 1e6 * lasted / max(len(seen), 1)
    if dataset.truth is None:
        raise ValueError(f"{folder}: no truth.tum")
    _judge_seeing(out, told, seen)
    _judge_poses(out, told, result, dataset.truth)
    _judge_events(out, told, result)
    return out


def _judge_seeing(out: Verdict, told: Told, seen: dict[float, Sequence[Detection]]) -> None:
    pairs = []
    for stamp, found in seen.items():
        there = {sight.id: sight for sight in told.sights[stamp]}
        whole = {number for number, sight in there.items() if sight.whole}
        ids = {one.id for one in found}
        out.whole += len(whole)
        out.read += len(whole & ids)
        out.cut_read += len((ids & set(there)) - whole)
        out.wrong += len(ids - set(there))
        out.whole_frames += bool(whole) / len(seen)
        out.read_frames += bool(ids) / len(seen)
        pairs += [(one, there[one.id]) for one in found if one.id in whole]
    ranged = [(a, b) for a, b in pairs if math.isfinite(a.range_sigma)]
    out.range_errors = np.array([a.range / b.range - 1 for a, b in ranged])
    out.range_ratios = np.array([(a.range - b.range) / a.range_sigma for a, b in ranged])
    out.bearing_errors = np.array([a.bearing - b.bearing for a, b in pairs])
    out.bearing_ratios = np.array([(a.bearing - b.bearing) / a.bearing_sigma for a, b in pairs])


def _judge_poses(out: Verdict, told: Told, result: ReplayResult, truth: Trajectory) -> None:
    stamps = np.array(sorted(told.sights))
    due = stamps[stamps >= told.first_motion]
    poses = {round(one.stamp, 6): one for one in result.estimates}
    out.due = len(due)
    out.given = sum(t in poses for t in due.tolist())
    if result.estimates:
        out.first_pose = result.estimates[0].stamp - float(truth.stamps[0])
    times = np.array([t for t in due.tolist() if t in poses])
    if not len(times):
        out.recovery = math.inf if told.shift else None
        return
    right = truth.at(times).poses
    said = np.array([poses[t].pose for t in times.tolist()])
    error = said - right
    error[:, 2] = (error[:, 2] + math.pi) % math.tau - math.pi
    spread = np.array([poses[t].covariance for t in times.tolist()])
    nees = np.einsum("ni,ni->n", error, np.linalg.solve(spread, error[..., None])[..., 0])
    apart = np.hypot(error[:, 0], error[:, 1])
    counted = np.ones(len(times), bool)
    if told.shift is not None:
        good = (apart < NEAR) & (np.abs(error[:, 2]) < NEAR_TURN)
        second, recovered = _second_pole(told), _recovered(times, good, told.shift[1])
        out.recovery = max(recovered - second, 0.0)
        until = min(recovered, second + ALLOWED)
        counted = (times < told.shift[0]) | (times >= until)
    far = (nees > 30.0) & (apart > NEAR)
    claimed = np.array([poses[t].status is not Status.LOST for t in times.tolist()])
    out.unaware = float((far & claimed).sum()) / 12.0
    out.position, out.nees = apart[counted], nees[counted]
    out.heading = np.abs(error[:, 2])[counted]
    rows = [(t, pose.x, pose.y) for t, pose in result.deadreckoned if t >= told.first_motion]
    reckoned = np.array(rows).reshape(-1, 3)
    out.reckoned = np.hypot(*(reckoned[:, 1:] - truth.at(reckoned[:, 0]).poses[:, :2]).T)


def _second_pole(told: Told) -> float:
    """When the second whole pole came into view after the robot was put down."""
    after = told.shift[1] if told.shift else 0.0
    known: set[int] = set()
    for stamp, row in sorted(told.sights.items()):
        if stamp >= after:
            known |= {sight.id for sight in row if sight.whole}
            if len(known) >= 2:
                return stamp
    return math.inf


def _recovered(times: Floats, good: NDArray[np.bool_], after: float) -> float:
    """The first time from which on the pose holds."""
    for index in np.flatnonzero((times >= after) & good):
        then = (times >= times[index]) & (times < times[index] + HOLDS)
        if good[then].all():
            return float(times[index])
    return math.inf


def _judge_events(out: Verdict, told: Told, result: ReplayResult) -> None:
    out.events = Counter(event.code for event in result.events)
    moved = told.moved[0] if told.moved else None
    hits = []
    for event in result.events:
        if event.code == "landmark_moved" and event.landmark == moved:
            hits.append(event)
        elif event.code in ("landmark_moved", "landmark_misread") or (
            event.code == "landmark_hidden" and out.kind != "hidden"
        ):
            out.false_reports.append(f"{event.code} {event.landmark} at {event.stamp:.1f}")
    if told.moved is None:
        return
    since = result.estimates[0].stamp if result.estimates else math.inf
    views = [
        stamp
        for stamp, row in sorted(told.sights.items())
        if stamp >= since and any(sight.id == moved and sight.whole for sight in row)
    ]
    out.moved_after = math.inf
    if hits and views:
        out.moved_after = max(hits[0].stamp - views[0], 0.0) / told.sweep
        dx, dy = hits[0].dx or 0.0, hits[0].dy or 0.0
        out.moved_error = math.hypot(dx - told.moved[1], dy - told.moved[2])


def figures(verdicts: Sequence[Verdict]) -> dict[str, Any]:
    """All recordings of a kind together, as a person reads them: centimetres and degrees."""

    def pooled(name: str) -> Floats:
        return np.concatenate([getattr(one, name) for one in verdicts])

    def rms(values: Floats) -> float:
        return float(np.sqrt(np.mean(values**2))) if len(values) else math.nan

    position, heading, nees = pooled("position"), pooled("heading"), pooled("nees")
    ratio = pooled("range_errors")
    recovery = [one.recovery for one in verdicts if one.recovery is not None]
    sweeps = [one.moved_after for one in verdicts if one.moved_after is not None]
    apart = [one.moved_error for one in verdicts if one.moved_error is not None]
    row: dict[str, Any] = {
        "recordings": len(verdicts),
        "seeds": [one.seed for one in verdicts],
        "position_mean_cm": 100 * _mean(position),
        "position_p95_cm": 100 * _p95(position),
        "position_max_cm": 100 * float(position.max(initial=0.0)),
        "heading_mean_deg": math.degrees(_mean(heading)),
        "heading_p95_deg": math.degrees(_p95(heading)),
        "heading_max_deg": math.degrees(float(heading.max(initial=0.0))),
        "poses_percent": _percent(sum(v.given for v in verdicts), sum(v.due for v in verdicts)),
        "first_pose_s": max(one.first_pose for one in verdicts),
        "nees_mean": _mean(nees),
        "nees_inside_percent": 100 * _mean((nees < BOUND).astype(float)),
        "unaware_s": sum(one.unaware for one in verdicts),
        "reckoned_mean_cm": 100 * _mean(pooled("reckoned")),
        "recovery_s": max(recovery) if recovery else None,
        "moved_after_sweeps": max(sweeps) if sweeps else None,
        "moved_error_cm": 100 * max(apart) if apart else None,
        "false_reports": [f"{one.seed}: {text}" for one in verdicts for text in one.false_reports],
        "events": dict(sum((one.events for one in verdicts), Counter[str]())),
        "microseconds_per_measurement": float(np.mean([one.microseconds for one in verdicts])),
        "microseconds_per_frame": float(np.mean([one.frame_microseconds for one in verdicts])),
        "frames_with_whole_pole_percent": 100 * float(np.mean([v.whole_frames for v in verdicts])),
        "frames_with_detection_percent": 100 * float(np.mean([v.read_frames for v in verdicts])),
        "whole_read_percent": _percent(
            sum(v.read for v in verdicts), sum(v.whole for v in verdicts)
        ),
        "cut_read": sum(one.cut_read for one in verdicts),
        "not_in_view": sum(one.wrong for one in verdicts),
        "range_mean_percent": 100 * _mean(np.abs(ratio)),
        "range_bias_percent": 100 * _mean(ratio),
        "range_ratio": rms(pooled("range_ratios")),
        "bearing_deg": math.degrees(_mean(np.abs(pooled("bearing_errors")))),
        "bearing_ratio": rms(pooled("bearing_ratios")),
    }
    row["by_seed"] = [
        {
            "seed": one.seed,
            "position_mean_cm": 100 * _mean(one.position),
            "position_p95_cm": 100 * _p95(one.position),
            "heading_mean_deg": math.degrees(_mean(one.heading)),
            "heading_p95_deg": math.degrees(_p95(one.heading)),
            "poses_percent": _percent(one.given, one.due),
            "nees_mean": _mean(one.nees),
            "nees_inside_percent": 100 * _mean((one.nees < BOUND).astype(float)),
            "recovery_s": one.recovery,
            "moved_after_sweeps": one.moved_after,
        }
        for one in verdicts
    ]
    return row


def _percent(part: float, whole: float) -> float:
    """NaN of nothing: a robot that never moves owes no pose."""
    return 100 * part / whole if whole else math.nan


def _mean(values: Floats) -> float:
    return float(values.mean()) if len(values) else math.nan


def _p95(values: Floats) -> float:
    return float(np.percentile(values, 95)) if len(values) else math.nan
