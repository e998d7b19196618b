"""The localizer run over a recording, causally: nothing later than t goes into the pose at t."""

from __future__ import annotations

import math
import tempfile
from collections import deque
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np

from polepilot.core.errors import DatasetError, ImageError
from polepilot.core.geometry import Pose2D, wrap_angle
from polepilot.core.localization.localizer import Localizer, LocalizerEvent, LocalizerSettings
from polepilot.core.localization.odometry import NO_LAGS, Following, OdometryHistory
from polepilot.core.observation import (
    Detection,
    Odometry,
    PanReading,
    PoseEstimate,
    RangeBearing,
    Status,
)
from polepilot.core.robot.dataset import LONGEST_GAP, Dataset, FrameFile, Sighted
from polepilot.core.robot.smoother import Picture, Smoother
from polepilot.core.trajectory import format_tum

See = Callable[[FrameFile], Sequence[Detection]]
"""Reads the landmarks of a picture. Raises ImageError where it is none."""

_AT_REST = 5.0
"""Seconds after which motors and servo have done what they were told, whatever their lags."""
_SEARCH = 10.0
"""Pictures so long before a pose was found may have led to it, seconds."""
_COUNT = math.radians(270) / 1023
"""One step of the potentiometer's converter, radians."""


@dataclass(slots=True)
class ReplayResult:
    """What a replay found; a row per frame as soon as a pose is known."""

    frames: int = 0
    estimates: list[PoseEstimate] = field(default_factory=list)
    measured: list[tuple[float, Pose2D]] = field(default_factory=list)
    deadreckoned: list[tuple[float, Pose2D]] = field(default_factory=list)
    events: list[LocalizerEvent] = field(default_factory=list)
    pictures: list[Picture] = field(default_factory=list)
    """What was seen when."""
    found: list[int] = field(default_factory=list)
    """Which estimates are the first ones after the pose was found, or found anew."""
    moved: frozenset[int] = frozenset()
    """Landmarks that do not stand where the map has them."""
    following: Following = NO_LAGS
    """How motors and servo follow what they are told, as far as that was learnt."""
    refusal: str = ""
    """Why there is no pose at all, for a person; empty where there is one."""

    def to_json(self) -> dict[str, Any]:
        """The ``replay --json`` document."""
        return {
            "frames": self.frames,
            "poses": len(self.estimates),
            "first_pose_t": self.estimates[0].stamp if self.estimates else None,
            "events": [
                {
                    "t": event.stamp,
                    "code": event.code,
                    "landmark": event.landmark,
                    "dx": event.dx,
                    "dy": event.dy,
                    "text": event.text,
                }
                for event in self.events
            ],
        }


class PanTrack:
    """Where the camera pointed, from the potentiometer's last readings; never from later ones.

    The pan turns steadily, so a straight line through the last few readings is finer than one
    converter step, and carries on to the moment of exposure.
    """

    def __init__(self, minimum: float, maximum: float) -> None:
        self._minimum, self._maximum = minimum, maximum
        self._readings: deque[tuple[float, float]] = deque(maxlen=6)

    def add(self, reading: PanReading) -> None:
        self._readings.append((reading.stamp, reading.angle))

    def at(self, stamp: float) -> tuple[float, float] | None:
        """Angle and its standard deviation, radians; None where no reading is recent."""
        if not self._readings or stamp - self._readings[-1][0] > 0.3:
            return None
        recent = [(t - stamp, a) for t, a in self._readings if stamp - t < 0.3]
        last_t, last = recent[-1]
        angle, rate = last, 0.0
        for count in (6, 3, 2):
            points = np.array(recent[-count:])
            if len(points) < 2 or np.ptp(points[:, 0]) < 1e-6:
                break
            rate, angle = (float(v) for v in np.polyfit(points[:, 0], points[:, 1], 1))
            residual = points[:, 1] - angle - rate * points[:, 0]
            if float(np.abs(residual).max()) < 1.1 * _COUNT:
                break
        margin = 2.0 * abs(rate * last_t)
        sigma = 0.3 * _COUNT
        if last + margin > self._maximum or last - margin < self._minimum:
            # It may have turned round since.
            sigma += margin
        return min(max(angle, self._minimum), self._maximum), sigma


def replay(
    dataset: Dataset,
    see: See,
    settings: LocalizerSettings | None = None,
    progress: Callable[[int], None] | None = None,
) -> ReplayResult:
    """Run the localizer over ``dataset``; ``see`` reads each picture, ``progress`` counts them.

    Where the recording keeps measurements instead of pictures (a run's log), nothing is read again.
    A pose that is lost is looked for again at once, in motion too. A picture that cannot be read
    is left out and reported as the event ``frame_skipped``.
    """
    settings = settings or dataset.settings
    half_range = max(abs(dataset.pan_minimum), abs(dataset.pan_maximum))
    settings = replace(settings, noise=replace(settings.noise, pan_range=half_range))
    camera = dataset.camera
    localizer = Localizer(
        dataset.landmarks, dataset.vehicle, camera.forward, settings, camera.half_view
    )
    pan = PanTrack(dataset.pan_minimum, dataset.pan_maximum)
    # Dead reckoning for comparison takes the commands as they are.
    commands = OdometryHistory(dataset.vehicle.wheelbase)
    reckoned: tuple[float, Pose2D] | None = None
    # Likewise from frame to frame: the localizer's odometry does not reach back to a measurement
    # that is long past.
    measured: tuple[float, Pose2D] | None = None
    taken: tuple[float, Pose2D] | None = None
    result = ReplayResult()
    last = dataset.samples[0].stamp if dataset.samples else 0.0
    command = Odometry(last, 0.0, 0.0)
    for sample in dataset.samples:
        stamp = sample.stamp
        if stamp - last > LONGEST_GAP:
            text = f"Nothing was recorded for {stamp - last:.1f} s: the pose is looked for anew."
            result.events.append(LocalizerEvent(stamp, "clock_jump", text))
            _forget(localizer, text)
            for odometry in _stand(command, last, stamp):
                localizer.add_odometry(odometry)
                commands.add(odometry)
        last = stamp
        if isinstance(sample, Odometry):
            command = sample
            localizer.add_odometry(sample)
            commands.add(sample)
            continue
        if isinstance(sample, PanReading):
            pan.add(sample)
            continue
        result.frames += 1
        told = len(result.events)
        angle, seen_now = _look(sample, see, pan, result)
        result.pictures.append((stamp, seen_now))
        localizer.add_picture(stamp, angle, seen_now)
        if localizer.status is Status.LOST:
            result.events += localizer.events()
            localizer.refix(localizer.reason)
        estimate = localizer.estimate(stamp)
        result.events += localizer.events()
        if any(event.code in ("fixed", "refixed") for event in result.events[told:]):
            result.found.append(len(result.estimates))
        if estimate is not None:
            result.estimates.append(estimate)
            if measured is None or localizer.measured != taken:
                taken = localizer.measured
                measured = taken or (stamp, estimate.pose)
            measured = (stamp, localizer.history.advance(measured[1], measured[0], stamp))
            result.measured.append(measured)
        if reckoned is not None:
            reckoned = (stamp, commands.advance(reckoned[1], reckoned[0], stamp))
        elif estimate is not None:
            reckoned = (stamp, estimate.pose)
        if reckoned is not None:
            result.deadreckoned.append(reckoned)
        if progress is not None:
            progress(result.frames)
    result.moved = frozenset(localizer.moved_landmarks)
    result.following = localizer.history.following
    if not result.estimates:
        result.refusal = localizer.reason
    return result


def smooth(dataset: Dataset, result: ReplayResult) -> list[tuple[float, Pose2D]]:
    """The offline best: the pose at each of the result's estimates from the whole recording.

    Wherever the pose was lost and found again a new stretch begins, which knows nothing of the
    one before; pictures from which it was found count for it.
    """
    settings = dataset.settings
    half_range = max(abs(dataset.pan_minimum), abs(dataset.pan_maximum))
    motors, servo, slowness = result.following
    history = OdometryHistory(
        dataset.vehicle.wheelbase,
        speed_lag=motors,
        steering_lag=servo,
        steering_slowness=slowness,
        span=math.inf,
    )
    for sample in dataset.samples:
        if isinstance(sample, Odometry):
            history.add(sample)
    smoother = Smoother(
        {k: mark for k, mark in dataset.landmarks.items() if k not in result.moved},
        history,
        dataset.camera.forward,
        replace(settings.noise, pan_range=half_range),
        settings.gate,
    )
    found: list[tuple[float, Pose2D]] = []
    begun = -math.inf
    for begin, end in pairwise([*result.found, len(result.estimates)]):
        stretch = result.estimates[begin:end]
        if not stretch:
            continue
        first, last = stretch[0].stamp, stretch[-1].stamp
        begun = max(begun, first - _SEARCH)
        pictures = [p for p in result.pictures if begun < p[0] <= last]
        jumps = [
            index
            for index, ((before, _), (after, _)) in enumerate(pairwise(pictures), start=1)
            if after <= first and after - before > LONGEST_GAP
        ]
        pictures = pictures[jumps[-1] if jumps else 0 :]
        begun = last
        poses = smoother.smooth(pictures, stretch[0].pose, first)
        known = {stamp: pose for (stamp, _), pose in zip(pictures, poses, strict=True)}
        found += [(one.stamp, known.get(one.stamp, one.pose)) for one in stretch]
    return found


def write_results(
    result: ReplayResult, out: Path, smoothed: Sequence[tuple[float, Pose2D]] | None = None
) -> None:
    """Write the trajectories into ``out`` (made if need be), all of them or none.

    Raises:
        DatasetError: the folder cannot be written.
    """
    poses = [estimate.pose for estimate in result.estimates]
    covariance = []
    for estimate in result.estimates:
        p = estimate.covariance
        values = (p[0, 0], p[0, 1], p[0, 2], p[1, 1], p[1, 2], p[2, 2])
        covariance.append(f"{estimate.stamp:.6f} " + " ".join(f"{v:.9e}" for v in values) + "\n")
    files = {
        "estimated.tum": format_tum((e.stamp for e in result.estimates), poses),
        "measured.tum": format_tum(*_columns(result.measured)),
        "deadreckoned.tum": format_tum(*_columns(result.deadreckoned)),
        "estimated.cov": "".join(covariance),
    }
    if smoothed is not None:
        files["smoothed.tum"] = format_tum(*_columns(smoothed))
    try:
        out.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryDirectory(dir=out, prefix=".replay-") as folder:
            for name, text in files.items():
                (Path(folder) / name).write_text(text, encoding="ascii")
            for name in files:
                (Path(folder) / name).replace(out / name)
    except OSError as error:
        raise DatasetError(f"{out}: the results cannot be written ({error}).") from error


def _forget(localizer: Localizer, why: str) -> None:
    """Look for the pose anew, from nothing that was seen before."""
    localizer.refix(why)
    # The first time, what contradicted the old pose is kept; here that is from before, too.
    localizer.refix(why)
    localizer.events()


def _stand(told: Odometry, begin: float, end: float) -> list[Odometry]:
    """What bridges a gap in which nobody knows how the robot moved: standing, then as before.

    The second one is when motors and servo have come to rest: from there on time costs nothing.
    """
    rest = begin + _AT_REST
    stops = [replace(told, stamp=stamp, speed=0.0) for stamp in (begin, rest) if stamp < end]
    return [*stops, replace(told, stamp=end)]


def _look(
    frame: FrameFile | Sighted, see: See, pan: PanTrack, result: ReplayResult
) -> tuple[float | None, list[RangeBearing]]:
    """The pan angle of one picture's moment, where it is known, and what the picture tells."""
    if isinstance(frame, Sighted):
        angles = [frame.pan, *(m.pan for m in frame.measurements)]
        return next((a for a in angles if a is not None), None), list(frame.measurements)
    try:
        detections = see(frame)
    except ImageError as error:
        text = f"samples.jsonl:{frame.line}: picture left out: {error.message}"
        result.events.append(LocalizerEvent(frame.stamp, "frame_skipped", text))
        return None, []
    pointing = pan.at(frame.stamp)
    if pointing is None:
        if not detections:
            return None, []
        text = f"samples.jsonl:{frame.line}: picture left out: no pan reading within 0.3 s."
        result.events.append(LocalizerEvent(frame.stamp, "frame_skipped", text))
        return None, []
    angle, sigma = pointing
    return angle, [
        RangeBearing(
            stamp=frame.stamp,
            landmark=detection.id,
            range=detection.range,
            bearing=wrap_angle(angle + detection.bearing),
            range_sigma=detection.range_sigma,
            bearing_sigma=math.hypot(detection.bearing_sigma, sigma),
            pan=angle,
        )
        for detection in detections
    ]


def _columns(rows: Sequence[tuple[float, Pose2D]]) -> tuple[list[float], list[Pose2D]]:
    return [stamp for stamp, _ in rows], [pose for _, pose in rows]
