"""Where the robot is: from odometry and landmarks to a pose, how sure it is, and why not.

FIXING -> TRACKING <-> DEGRADED -> LOST -> (refix) -> FIXING. The filter's state lives at the last
measurement; the present pose is predicted from there through the odometry that came since, so a
picture that took 0.3 s to read is applied at the pose from which it was taken.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from itertools import groupby
from typing import Literal, Protocol

import numpy as np
from numpy.typing import NDArray

from polepilot.core.geometry import Point, Pose2D, wrap_angle
from polepilot.core.landmark import Landmark
from polepilot.core.localization.ekf import NoiseModel, PoseFilter
from polepilot.core.localization.fix import Fix, FixSettings
from polepilot.core.localization.health import LandmarkHealth
from polepilot.core.localization.odometry import OdometryHistory, Step
from polepilot.core.localization.radial import RadialFilter, radial_correction
from polepilot.core.localization.search import FixSearch
from polepilot.core.observation import Odometry, PoseEstimate, RangeBearing, Status
from polepilot.core.vehicle import Vehicle

Method = Literal["ekf", "paper"]

_FITTING = 0.7
"""Share of a fix's sightings that the filter must take, or the fix is not believed."""
_PROBATION = 10.0
"""Seconds that a new pose must last before what was learnt with it outlives it."""
_LAG_STEP = 0.01
"""The time constants are followed in steps of this, seconds, and within these limits."""
_SHORTEST_LAG, _LONGEST_LAG = 0.01, 0.5


@dataclass(frozen=True, slots=True)
class LocalizerSettings:
    """What the localizer tolerates, and what it believes of the robot. SI units."""

    method: Method = "ekf"
    tolerance: float = 0.20
    """A landmark may appear this far from where it should be; beyond it, the pose is in doubt."""
    gate: float = 16.0
    """Squared Mahalanobis distance beyond which a measurement is not taken."""
    degraded_after: float = 2.0
    """Seconds of motion without a correction."""
    degraded_sigma: float = 0.10
    lost_after: float = 12.0
    lost_sigma: float = 0.25
    steering_lag: float = 0.10
    """Time constant of the steering servo, seconds; the EKF learns the true one."""
    speed_lag: float = 0.04
    """Time constant of the motors, likewise."""
    fix: FixSettings = field(default_factory=FixSettings)
    noise: NoiseModel = field(default_factory=NoiseModel)


@dataclass(frozen=True, slots=True)
class LocalizerEvent:
    """Something that happened to the pose or to a landmark.

    ``code`` is one of fixed, refixed, degraded, recovered, lost, rejected, landmark_unknown,
    landmark_moved, landmark_misread, landmark_back, late.
    """

    stamp: float
    code: str
    text: str
    landmark: int | None = None
    dx: float | None = None
    """How far the landmark appears displaced in `map`, metres."""
    dy: float | None = None


class _Filter(Protocol):
    @property
    def pose(self) -> Pose2D: ...
    @property
    def pose_covariance(self) -> NDArray[np.float64]: ...
    @property
    def speed_factor(self) -> float: ...
    @property
    def steering_offset(self) -> float: ...
    def reset(self, pose: Pose2D, covariance: NDArray[np.float64]) -> None: ...
    def predict(self, step: Step) -> None: ...
    def take(
        self, measurement: RangeBearing, landmark: Landmark, tolerance: float
    ) -> tuple[bool, float]: ...
    def copy(self) -> _Filter: ...


@dataclass(slots=True)
class _Track:
    """A filter's state at a moment, and how long the robot has moved since its last correction."""

    filter: _Filter
    stamp: float
    moving: float = 0.0

    def predict(self, history: OdometryHistory, stamp: float) -> None:
        for step in history.steps(self.stamp, stamp):
            self.filter.predict(step)
            if step.speed:
                self.moving += step.dt
        self.stamp = max(self.stamp, stamp)

    def copy(self) -> _Track:
        return _Track(self.filter.copy(), self.stamp, self.moving)


class Localizer:
    """Estimates the pose of `base_link` in `map`. Not thread-safe; one thread owns the robot."""

    def __init__(
        self,
        landmarks: Mapping[int, Landmark],
        vehicle: Vehicle,
        camera_forward: float,
        settings: LocalizerSettings | None = None,
    ) -> None:
        self.settings = settings or LocalizerSettings()
        self._landmarks = dict(landmarks)
        self._camera_forward = camera_forward
        self._history = OdometryHistory(
            vehicle.wheelbase,
            steering_lag=self.settings.steering_lag,
            speed_lag=self.settings.speed_lag,
        )
        self._search = FixSearch(self._landmarks, self._history, camera_forward, self.settings.fix)
        self._health = LandmarkHealth(self._landmarks)
        self._filter: _Filter
        if self.settings.method == "paper":
            self._filter = RadialFilter(vehicle.wheelbase, camera_forward)
        else:
            self._filter = PoseFilter(
                vehicle.wheelbase, camera_forward, self.settings.noise, self.settings.gate
            )
        self._before: tuple[float, _Filter, tuple[float, float]] | None = None
        self._track: _Track | None = None
        self._ahead: _Track | None = None
        self._status = Status.FIXING
        self._reason = self._search.refusal.reason
        self._measured: tuple[float, Pose2D] | None = None
        self._predicted: tuple[float, Pose2D] | None = None
        self._against: list[RangeBearing] = []
        self._gap = 0.0
        self._last_agreed: dict[int, float] = {}
        self._reported: dict[tuple[str, int], float] = {}
        self._events: deque[LocalizerEvent] = deque(maxlen=256)
        self._fixes = 0

    @property
    def status(self) -> Status:
        return self._status

    @property
    def reason(self) -> str:
        """Why the status is not TRACKING, for a person; empty while tracking."""
        return self._reason

    @property
    def measured(self) -> tuple[float, Pose2D] | None:
        """Stamp and pose from the last measurement before filtering: the paper's R_2^2.

        The position is the prediction moved along the line to the landmark until the range agrees,
        the heading follows from the bearing. After a fix it is the fix.
        """
        return self._measured

    @property
    def predicted(self) -> tuple[float, Pose2D] | None:
        """Stamp and pose just before the last measurement was taken in: the paper's R_2^1."""
        return self._predicted

    @property
    def moved_landmarks(self) -> dict[int, Point]:
        """Landmarks that do not stand where the map has them, and by how much (dx, dy)."""
        return dict(self._health.moved)

    @property
    def history(self) -> OdometryHistory:
        """The odometry of the last seconds, for dead reckoning between poses."""
        return self._history

    def events(self) -> list[LocalizerEvent]:
        """What happened since the last call."""
        drained = list(self._events)
        self._events.clear()
        return drained

    def refix(self, reason: str) -> None:
        """Forget the pose and look for it anew; what contradicted the old one is kept."""
        if self._before is not None and self._track is not None:
            begun, tracked, lags = self._before
            if self._track.stamp - begun < _PROBATION:
                # A pose that did not last was wrong, and so is what was learnt from it.
                self._filter = tracked
                self._history.retune(*lags)
        self._track = self._ahead = self._before = None
        self._measured = self._predicted = None
        self._status, self._reason = Status.FIXING, reason
        self._search.clear()
        if len(self._landmarks) - len(self._health.moved) < 2:
            # With so few left, it is as likely that the pose was wrong.
            self._health.moved.clear()
        self._collect(self._against)
        newest = self._against[-1].stamp if self._against else None
        self._against = []
        self._last_agreed.clear()
        self._health.forget()
        if newest is not None:
            self._try_fix(newest)

    def add_odometry(self, odometry: Odometry) -> None:
        """How the robot moves from ``odometry.stamp`` on."""
        self._history.add(odometry)
        if self._ahead is not None and odometry.stamp < self._ahead.stamp:
            self._ahead = None

    def add_measurements(self, measurements: Sequence[RangeBearing]) -> None:
        """Landmarks seen; those of one picture share a stamp. At most some 0.3 s late.

        Measurements older than the newest one that was taken in are left out, as are unknown
        landmarks; both are reported.
        """
        usable = [m for m in measurements if self._usable(m)]
        usable.sort(key=lambda m: m.stamp)
        for stamp, group in groupby(usable, key=lambda m: m.stamp):
            picture = list(group)
            if self._track is None:
                self._collect(picture)
                self._try_fix(stamp)
            elif stamp < self._track.stamp - 1e-9:
                for measurement in picture:
                    self._report(
                        stamp, "late", "A measurement came too late.", measurement.landmark
                    )
            else:
                self._apply(self._track, stamp, picture)

    def estimate(self, now: float) -> PoseEstimate | None:
        """The pose at ``now``; None until the first fix. Before the last measurement: that one."""
        track = self._track
        if track is None:
            return None
        ahead = self._ahead
        if ahead is None or ahead.stamp > now or ahead.stamp < track.stamp:
            ahead = self._ahead = track.copy()
        ahead.predict(self._history, now)
        covariance = ahead.filter.pose_covariance
        self._judge(ahead.stamp, ahead.moving, _largest_sigma(covariance))
        if len(self._against) >= 2:
            # Something contradicts the pose and nothing has confirmed it since.
            covariance[0, 0] += self._gap**2
            covariance[1, 1] += self._gap**2
            covariance[2, 2] += (self._gap / 3.0) ** 2
        return PoseEstimate(ahead.stamp, ahead.filter.pose, covariance, self._status, self._reason)

    def _usable(self, measurement: RangeBearing) -> bool:
        numbers = (measurement.stamp, measurement.bearing, measurement.bearing_sigma)
        if not all(math.isfinite(number) for number in numbers) or math.isnan(measurement.range):
            return False
        if measurement.landmark in self._landmarks:
            return True
        text = f"Landmark {measurement.landmark} is seen but is not on the map."
        self._report(measurement.stamp, "landmark_unknown", text, measurement.landmark)
        return False

    def _collect(self, measurements: Sequence[RangeBearing]) -> None:
        """Keep for a fix; landmarks known to have been moved would only mislead it."""
        for measurement in measurements:
            if measurement.landmark not in self._health.moved:
                self._search.add(measurement)

    def _try_fix(self, stamp: float) -> None:
        search = self._search
        search.scale, search.offset = self._filter.speed_factor, self._filter.steering_offset
        found = search.attempt(stamp)
        if found is None:
            self._reason = search.refusal.reason
            return
        self._begin(stamp, found)

    def _begin(self, stamp: float, found: Fix) -> None:
        started = self._filter.copy()
        if isinstance(started, PoseFilter):
            sightings = [(m, self._landmarks[m.landmark]) for m in self._search.used]
            share = started.begin(found.pose, stamp, sightings, self._history)
            sigma = _largest_sigma(started.pose_covariance)
            if share < _FITTING or sigma > self.settings.degraded_sigma:
                # The stricter gate left some of them out: they do not fit together so well.
                self._reason = "The landmarks seen so far do not fit together well enough."
                return
        else:
            started.reset(found.pose, found.covariance)
        lags = (self._history.speed_lag, self._history.steering_lag)
        self._before = (stamp, self._filter, lags)
        self._filter = started
        self._track, self._ahead = _Track(self._filter, stamp), None
        self._measured = (stamp, found.pose)
        self._status, self._reason = Status.TRACKING, ""
        self._search.clear()
        self._against = []
        ids = ", ".join(str(number) for number in found.landmarks)
        code = "refixed" if self._fixes else "fixed"
        self._fixes += 1
        self._last_agreed = dict.fromkeys(found.landmarks, stamp)
        self._emit(LocalizerEvent(stamp, code, f"Pose fixed by landmarks {ids}."))

    def _apply(self, track: _Track, stamp: float, picture: list[RangeBearing]) -> None:
        self._ahead = None
        track.predict(self._history, stamp)
        if self._status is Status.LOST:
            self._against.extend(picture)
            del self._against[:-200]
            return
        predicted = track.filter.pose
        self._predicted = (stamp, predicted)
        taken = [m for m in picture if self._take(track, m)]
        ranged = [m for m in taken if math.isfinite(m.range_sigma)]
        if ranged:
            best = min(ranged, key=lambda m: m.range_sigma)
            self._measured = (stamp, self._unfiltered(predicted, best))
        if taken:
            track.moving = 0.0
            self._against = []
            self._retune()
        self._judge_contradictions(stamp)
        self._judge(stamp, track.moving, _largest_sigma(track.filter.pose_covariance))

    def _retune(self) -> None:
        """Let the history follow what the filter has learnt of servo and motors."""
        tracked, history = self._filter, self._history
        if not isinstance(tracked, PoseFilter) or max(map(abs, tracked.lag_errors)) < _LAG_STEP:
            return
        before = (history.speed_lag, history.steering_lag)
        motor, servo = (
            min(max(lag + error, _SHORTEST_LAG), _LONGEST_LAG)
            for lag, error in zip(before, tracked.lag_errors, strict=True)
        )
        if max(abs(motor - before[0]), abs(servo - before[1])) > 0.5 * _LAG_STEP:
            history.retune(motor, servo)
            tracked.retuned(motor - before[0], servo - before[1])

    def _take(self, track: _Track, measurement: RangeBearing) -> bool:
        """Whether a measurement was fused; keeps the books on those that were not."""
        number, stamp = measurement.landmark, measurement.stamp
        mark = self._landmarks[number]
        settings = self.settings
        if number in self._health.moved:
            place = self._place(track.filter.pose, measurement)
            if place is None or math.dist(place, mark.position) > 0.5 * settings.tolerance:
                self._health.contradicted(number, stamp, place or (math.nan, math.nan))
            elif self._health.agreed(number):
                text = f"Landmark {number} stands again where the map has it."
                self._emit(LocalizerEvent(stamp, "landmark_back", text, number))
            return False
        taken, gap = track.filter.take(measurement, mark, settings.tolerance)
        if taken:
            self._last_agreed[number] = stamp
            self._health.agreed(number)
            return True
        place = self._place(track.filter.pose, measurement)
        offset = (None, None) if place is None else (place[0] - mark.x, place[1] - mark.y)
        text = f"Landmark {number} appears {100 * gap:.0f} cm from where it should be."
        self._report(stamp, "rejected", text, number, offset)
        # A number read where another landmark stands speaks against the reading, not the pose.
        misread = place is not None and self._health.stands_another(number, place)
        if gap > settings.tolerance and not misread:
            self._against.append(measurement)
            self._gap = gap
            del self._against[:-200]
        if place is not None and self._others_agree(number, stamp):
            verdict = self._health.contradicted(number, stamp, place)
            if verdict is not None:
                far = 100 * math.hypot(verdict.dx, verdict.dy)
                what = (
                    f"Landmark {number} has been moved by {far:.0f} cm"
                    if verdict.code == "landmark_moved"
                    else f"Landmark {number} is read where another one stands"
                )
                self._emit(
                    LocalizerEvent(stamp, verdict.code, f"{what}.", number, verdict.dx, verdict.dy)
                )
        return False

    def _others_agree(self, number: int, stamp: float) -> bool:
        """Another landmark agreed with the pose within the last two sweeps or so."""
        return any(
            other != number and stamp - when < 8.0 for other, when in self._last_agreed.items()
        )

    def _judge_contradictions(self, stamp: float) -> None:
        """LOST when two landmarks, or one for long, contradict the pose and none agrees."""
        counts: dict[int, int] = {}
        for measurement in self._against:
            counts[measurement.landmark] = counts.get(measurement.landmark, 0) + 1
        if not counts:
            return
        firm = sorted(number for number, count in counts.items() if count >= 2)
        first = self._against[0].stamp
        ids = " and ".join(str(number) for number in sorted(counts))
        limit = f"{100 * self.settings.tolerance:.0f} cm"
        # The paper's tracking drifts in heading until every landmark contradicts it, so there the
        # first one is enough, as the paper has it.
        # So is one that agreed before: it has not moved by itself.
        paper = self.settings.method == "paper"
        hasty = any(
            count >= 3 and (paper or number in self._last_agreed)
            for number, count in counts.items()
        )
        if len(firm) >= 2 or (firm and stamp - first > 5.0) or hasty:
            self._lose(
                stamp,
                f"Landmark {ids} appear{'s' if len(counts) == 1 else ''} more than {limit} from "
                "where the pose has them: the robot has been moved, or has slipped.",
            )
        elif firm and self._status is not Status.DEGRADED:
            self._set(
                stamp, Status.DEGRADED, f"Landmark {ids} appears more than {limit} off its place."
            )

    def _judge(self, stamp: float, moving: float, sigma: float) -> None:
        settings = self.settings
        if self._status in (Status.LOST, Status.FIXING):
            return
        if sigma > settings.lost_sigma:
            self._lose(stamp, f"The position is known only to {100 * sigma:.0f} cm.")
        elif moving > settings.lost_after:
            self._lose(stamp, f"No landmark has been seen during {moving:.0f} s of driving.")
        elif sigma > settings.degraded_sigma:
            text = f"The position is known only to {100 * sigma:.0f} cm."
            self._set(stamp, Status.DEGRADED, text)
        elif moving > settings.degraded_after:
            text = f"No landmark has been seen during {moving:.0f} s of driving."
            self._set(stamp, Status.DEGRADED, text)
        elif len(self._against) < 2:
            self._set(stamp, Status.TRACKING, "")

    def _set(self, stamp: float, status: Status, reason: str) -> None:
        if status is not self._status:
            code = "recovered" if status is Status.TRACKING else "degraded"
            self._emit(LocalizerEvent(stamp, code, reason or "The pose is certain again."))
        self._status, self._reason = status, reason

    def _lose(self, stamp: float, reason: str) -> None:
        if self._status is not Status.LOST:
            self._status, self._reason = Status.LOST, reason
            self._emit(LocalizerEvent(stamp, "lost", reason))

    def _unfiltered(self, predicted: Pose2D, measurement: RangeBearing) -> Pose2D:
        """R_2^2, with the heading from the bearing."""
        mark = self._landmarks[measurement.landmark]
        moved = radial_correction(predicted, measurement, mark, self._camera_forward)
        camera = predicted.ahead(self._camera_forward)
        direction = math.atan2(mark.y - camera[1], mark.x - camera[0])
        return Pose2D(moved.x, moved.y, wrap_angle(direction - measurement.bearing))

    def _place(self, pose: Pose2D, measurement: RangeBearing) -> Point | None:
        """Where in `map` a measured landmark appears."""
        if not (math.isfinite(measurement.range) and math.isfinite(measurement.range_sigma)):
            return None
        camera = pose.ahead(self._camera_forward)
        direction = pose.heading + measurement.bearing
        return (
            camera[0] + measurement.range * math.cos(direction),
            camera[1] + measurement.range * math.sin(direction),
        )

    def _report(
        self,
        stamp: float,
        code: str,
        text: str,
        landmark: int,
        offset: tuple[float | None, float | None] = (None, None),
    ) -> None:
        """Emit, but for each landmark not more often than every two seconds."""
        if stamp - self._reported.get((code, landmark), -math.inf) < 2.0:
            return
        if len(self._reported) > 1000:
            self._reported.clear()
        self._reported[code, landmark] = stamp
        self._emit(LocalizerEvent(stamp, code, text, landmark, *offset))

    def _emit(self, event: LocalizerEvent) -> None:
        self._events.append(event)


def _largest_sigma(covariance: NDArray[np.float64]) -> float:
    """Of the position, along the worst direction."""
    a, b, d = float(covariance[0, 0]), float(covariance[0, 1]), float(covariance[1, 1])
    return math.sqrt(max(0.5 * (a + d) + math.hypot(0.5 * (a - d), b), 0.0))
