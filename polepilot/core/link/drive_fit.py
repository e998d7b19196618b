"""What one robot's motors and servo do, from a few measured test runs.

In each run the robot drives from a line with constant duties and a constant servo angle; a person
then measures how far ahead of where it stood, and how far aside, its rear axle came to stand.
Those two numbers give the arc (a circle through the start, along the heading there): its length
tells the speed, its curvature the angle of the virtual front wheel.
"""

from __future__ import annotations

import contextlib
import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from polepilot.core.errors import InputError
from polepilot.core.link.calibration import DriveCalibration
from polepilot.core.trajectory import Array
from polepilot.core.vehicle import Vehicle
from polepilot.core.verdict import Grade, Verdict

_SHORTEST = 0.05
"""Metres. Less than that is no run."""
_TAPE = 0.005
"""Metres by which a tape measure, and whoever puts the robot on its line, may be wrong."""
_MOST_LAG = 0.5
"""Seconds by which motors may answer late, all in all."""
_MOST_BAND = 0.9
_APART = 0.08
"""Duties (shares) that differ by less tell nothing about the dead band."""
_ANGLES_APART = math.radians(8)
"""Servo angles that differ by less tell nothing about its scale."""


@dataclass(frozen=True, slots=True)
class DriveRun:
    """One measured run, forward."""

    left: float
    """Share of the full duty of the left wheel."""
    right: float
    steering: float
    """Angle sent to the servo, rad."""
    seconds: float
    """For which the duties were applied; a ramp counts by its area."""
    ahead: float
    """Where the rear axle's middle came to stand, metres from where it was."""
    aside: float
    """The same to the left."""
    counts: tuple[int, int] | None = None
    """Of the wheel encoders, left and right."""

    def __post_init__(self) -> None:
        for name in ("left", "right"):
            if not 0 < getattr(self, name) <= 1:
                raise InputError(f"duty is {getattr(self, name):g}, expected a share up to 1.")
        if not 0.1 <= self.seconds <= 60:
            raise InputError(f"seconds is {self.seconds:g}, expected 0.1 to 60.")
        if not abs(self.steering) < math.pi / 2:
            raise InputError("steering is a right angle or more.")
        if not _SHORTEST <= math.hypot(self.ahead, self.aside) < 100:
            raise InputError(
                f"the robot came {self.ahead:g} m ahead and {self.aside:g} m aside: expected at "
                f"least {_SHORTEST} m, and metres."
            )

    @property
    def chord(self) -> float:
        return math.hypot(self.ahead, self.aside)

    @property
    def turned(self) -> float:
        """By how much the heading has changed, rad."""
        return 2 * math.atan2(self.aside, self.ahead)

    @property
    def curvature(self) -> float:
        """Of the arc, 1/m, left positive."""
        return 2 * self.aside / self.chord**2

    @property
    def length(self) -> float:
        """Of the arc, metres."""
        half = self.turned / 2
        return self.chord * (half / math.sin(half) if abs(half) > 1e-6 else 1.0)

    def angle(self, wheelbase: float) -> float:
        """Of the virtual front wheel, rad."""
        return math.atan(wheelbase * self.curvature)


@dataclass(frozen=True, slots=True)
class DriveResidual:
    """One run against the result."""

    run: DriveRun
    predicted: float
    """Length of its arc by the result, metres."""
    angle_error: float
    """By how much the front wheel stood otherwise than the result says, rad."""

    @property
    def share(self) -> float:
        """Driven farther than predicted, as a share."""
        return self.run.length / self.predicted - 1


@dataclass(frozen=True, slots=True)
class DriveFit:
    """The calibration, and how well the runs agree on it."""

    calibration: DriveCalibration
    residuals: tuple[DriveResidual, ...]
    lag: float
    """Seconds by which the motors begin late, less those by which they coast."""
    found: tuple[str, ...]
    """Names of the fields that the runs could tell; the others are as before."""
    spare: int
    """Measured numbers beyond what had to be found; 0: nothing checks the result."""
    suspect: int | None = None
    """Index of the one run without which all others agree; None where none stands out."""

    @property
    def worst(self) -> tuple[float, float]:
        """Largest residual of a length, as a share, and of the front wheel's angle, rad."""
        return (
            max(abs(one.share) for one in self.residuals),
            max(abs(one.angle_error) for one in self.residuals),
        )

    @property
    def agrees(self) -> bool:
        """Within 2 % and 1 degree."""
        share, angle = self.worst
        return share <= 0.02 and angle <= math.radians(1)


def fit_drive(
    runs: Sequence[DriveRun],
    vehicle: Vehicle,
    present: DriveCalibration,
    *,
    trim: float | None = None,
    servo_limit: float | None = None,
) -> DriveFit:
    """Solve for what the runs can tell; the rest stays as it is at ``present``.

    Args:
        trim: speed of the right wheel by that of the left one under equal duty; None keeps it.
        servo_limit: largest angle that the servo can take, rad.

    Raises:
        InputError: no run, or runs that contradict each other wholly.
    """
    if not runs:
        raise InputError("no run is given: expected at least one, better five.")
    fit = _fit(runs, vehicle, present, trim, servo_limit)
    if fit.agrees or len(runs) < 4:
        return fit
    clean = []
    for index in range(len(runs)):
        with contextlib.suppress(InputError):
            others = [run for run in runs if run is not runs[index]]
            if _fit(others, vehicle, present, trim, servo_limit).agrees:
                clean.append(index)
    return replace(fit, suspect=clean[0]) if len(clean) == 1 else fit


def _fit(
    runs: Sequence[DriveRun],
    vehicle: Vehicle,
    present: DriveCalibration,
    trim: float | None,
    servo_limit: float | None,
) -> DriveFit:
    found = ["full_speed_left", "full_speed_right", "servo_center"]
    if trim is None:
        trim = _trim_by_counts(runs)
    ratio = present.full_speed_right / present.full_speed_left if trim is None else trim
    mean, band, lag, with_band, parameters = _fit_lengths(runs, ratio, present.dead_band)
    if with_band:
        found.append("dead_band")
    center, scale, with_scale = _fit_servo(runs, vehicle.wheelbase, present)
    if with_scale:
        found.append("servo_scale")
    limit = present.servo_limit
    if servo_limit is not None:
        limit = servo_limit
        found.append("servo_limit")
    counts = _counts_per_metre(runs)
    if counts is not None:
        found.append("counts_per_metre")
    if abs(center) >= limit:
        raise InputError(
            f"straight on would need {math.degrees(center):.0f} degrees of the servo, more than "
            f"its {math.degrees(limit):.0f}: mount its arm anew, or check the measured numbers."
        )
    calibration = DriveCalibration(
        full_speed_left=mean * 2 / (1 + ratio),
        full_speed_right=mean * 2 * ratio / (1 + ratio),
        dead_band=band,
        servo_center=center,
        servo_scale=scale,
        servo_limit=limit,
        counts_per_metre=present.counts_per_metre if counts is None else counts,
    )
    residuals = tuple(
        DriveResidual(
            run,
            _predict(run, calibration, lag),
            run.angle(vehicle.wheelbase) - (run.steering - center) / scale,
        )
        for run in runs
    )
    spare = 2 * len(runs) - parameters - 1 - with_scale
    return DriveFit(calibration, residuals, lag, tuple(found), spare)


def judge(fit: DriveFit) -> Verdict:
    """What to think of it: good within 2 % and 1 degree, fair within 5 % and 2.5 degrees."""
    share, angle = fit.worst[0] * 100, math.degrees(fit.worst[1])
    words = f"speeds agree within {share:.1f} %, steering within {angle:.1f}°."
    grade: Grade = "good"
    notes: list[str] = []
    if share > 5 or angle > 2.5:
        grade = "poor"
    elif not fit.agrees or fit.spare < 2:
        grade = "fair"
    if fit.suspect is not None:
        notes.append(f"Measure run {fit.suspect + 1} again: without it the others agree.")
    elif grade == "poor":
        notes.append("The runs contradict each other: measure them again.")
    if "dead_band" not in fit.found:
        notes.append("The dead band is as before: it takes runs with two different duties.")
    if "servo_scale" not in fit.found:
        notes.append("The servo's scale is as before: it takes runs to the left and to the right.")
    if fit.spare < 2:
        notes.append("More runs would tell whether a number was measured wrongly.")
    return Verdict(grade, words, tuple(notes))


def reach(calibration: DriveCalibration) -> float:
    """The largest angle of the virtual front wheel that the servo gives to both sides, rad."""
    ends = (calibration.servo_limit, -calibration.servo_limit)
    return min(abs((end - calibration.servo_center) / calibration.servo_scale) for end in ends)


def _shares(run: DriveRun, ratio: float, band: float) -> float:
    """Mean speed of both wheels by the mean full speed."""
    weights = 2 / (1 + ratio), 2 * ratio / (1 + ratio)
    duties = run.left, run.right
    above = (max(0.0, duty - band) / (1 - band) for duty in duties)
    return sum(weight * share for weight, share in zip(weights, above, strict=True)) / 2


def _predict(run: DriveRun, calibration: DriveCalibration, lag: float) -> float:
    left = calibration.wheel_speed(round(run.left * 1000), right=False)
    right = calibration.wheel_speed(round(run.right * 1000), right=True)
    return max((left + right) / 2 * (run.seconds - lag), 1e-6)


def _fit_lengths(
    runs: Sequence[DriveRun], ratio: float, band: float
) -> tuple[float, float, float, bool, int]:
    """Mean full speed, dead band, lag; whether the band was found; how many were."""
    from scipy.optimize import least_squares

    duties = sorted((run.left + run.right) / 2 for run in runs)
    with_band = len(runs) >= 2 and duties[-1] - duties[0] >= _APART
    with_lag = len(runs) >= 2 + with_band
    lengths = np.array([run.length for run in runs])
    seconds = np.array([run.seconds for run in runs])
    sigma = _TAPE + 0.005 * lengths
    lowest = min(min(run.left, run.right) for run in runs)
    most = min(_MOST_BAND, 0.95 * lowest) if with_band else max(band, 1e-3)

    def off(x: Array) -> Array:
        # A free lag pulls with the weight of a guess: a tenth of a second.
        own = x[1] if with_band else band
        shares = np.array([_shares(run, ratio, own) for run in runs])
        wrong = (x[0] * shares * np.maximum(seconds - x[2], 0.05) - lengths) / sigma
        return np.append(wrong, x[2] / (0.1 if with_lag else 1e-6))

    shares = np.array([_shares(run, ratio, min(band, 0.5 * lowest)) for run in runs])
    start = [float(np.median(lengths / (shares * seconds))), min(band, 0.5 * most), 0.0]
    bounds = ([1e-3, -1e-9, -_MOST_LAG], [20.0, most, _MOST_LAG])
    solved = least_squares(off, np.clip(start, *bounds), bounds=bounds, x_scale=[1, 0.1, 0.1])
    speed, found, lag = (float(value) for value in solved.x)
    return speed, max(0.0, found) if with_band else band, lag, with_band, 1 + with_band + with_lag


def _fit_servo(
    runs: Sequence[DriveRun], wheelbase: float, present: DriveCalibration
) -> tuple[float, float, bool]:
    """Servo angle for straight on, servo angle per angle of the front wheel; whether that was
    found."""
    servo = np.array([run.steering for run in runs])
    angles = np.array([run.angle(wheelbase) for run in runs])
    chords = np.array([run.chord for run in runs])
    weights = 1 / (math.radians(0.2) + wheelbase * 2 * _TAPE / chords**2)
    if np.ptp(servo) < _ANGLES_APART:
        center = float(np.average(servo - present.servo_scale * angles, weights=weights**2))
        return center, present.servo_scale, False
    matrix = np.column_stack([servo, np.ones(len(runs))]) * weights[:, None]
    (slope, offset), *_ = np.linalg.lstsq(matrix, angles * weights, rcond=None)
    if abs(slope) < 0.05 or abs(slope) > 20:
        sent, turned = (math.degrees(float(np.ptp(values))) for values in (servo, angles))
        raise InputError(
            f"{sent:.0f} degrees of the servo changed the front wheel by {turned:.0f}: the servo "
            "does not steer, or a number was measured wrongly."
        )
    return float(-offset / slope), float(1 / slope), True


def _trim_by_counts(runs: Sequence[DriveRun]) -> float | None:
    """Right by left speed, from encoders in runs with equal duties."""
    pairs = [run.counts for run in runs if run.counts is not None and run.left == run.right]
    left, right = sum(pair[0] for pair in pairs), sum(pair[1] for pair in pairs)
    return right / left if left > 0 and right > 0 else None


def _counts_per_metre(runs: Sequence[DriveRun]) -> float | None:
    counted = [run for run in runs if run.counts is not None]
    total = sum(sum(run.counts) / 2 for run in counted if run.counts is not None)
    return total / sum(run.length for run in counted) if total > 0 else None


def rounded(calibration: DriveCalibration) -> DriveCalibration:
    """With no more digits than were measured."""
    return replace(
        calibration,
        full_speed_left=round(calibration.full_speed_left, 4),
        full_speed_right=round(calibration.full_speed_right, 4),
        dead_band=round(calibration.dead_band, 4),
        servo_center=round(calibration.servo_center, 4),
        servo_scale=round(calibration.servo_scale, 4),
        servo_limit=round(calibration.servo_limit, 4),
        counts_per_metre=round(calibration.counts_per_metre, 2),
    )
