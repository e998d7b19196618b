"""`polepilot calibrate drive`: motors and steering servo, from measured test runs."""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from polepilot.commands.outcome import Outcome
from polepilot.core.errors import InputError

if TYPE_CHECKING:
    from polepilot.core.link.drive_fit import DriveFit, DriveRun
    from polepilot.core.vehicle import Vehicle
    from polepilot.server.settings import Settings
    from polepilot.server.settings_edit import Changes

_NUMBER = r"\s*([+-]?\d+(?:\.\d*)?)\s*"
_RUN = re.compile(",".join([_NUMBER] * 3) + "=" + ",".join([_NUMBER] * 2))
_PAIR = re.compile(",".join([_NUMBER] * 2))


def parse_run(text: str) -> DriveRun:
    """``40,-15,4=0.81,-0.20``: duty in percent, servo in degrees (left positive), seconds; metres
    ahead and to the left.

    Raises:
        InputError: it is none.
    """
    from polepilot.core.link.drive_fit import DriveRun

    match = _RUN.fullmatch(text)
    if match is None:
        raise InputError(
            f"--run is {text!r}: expected DUTY%,SERVO°,SECONDS=AHEAD,LEFT in metres, as "
            "40,0,4=0.81,0.02."
        )
    duty, servo, seconds, ahead, aside = map(float, match.groups())
    try:
        return DriveRun(duty / 100, duty / 100, math.radians(servo), seconds, ahead, aside)
    except InputError as error:
        raise InputError(f"--run {text}: {error.message}") from error


def parse_turns(text: str) -> float:
    """``12.5,12.25``: turns of the left and the right wheel in the same time; right by left.

    Raises:
        InputError: they are none.
    """
    match = _PAIR.fullmatch(text)
    left, right = map(float, match.groups()) if match else (0.0, 0.0)
    if left <= 0 or right <= 0 or not 0.5 <= right / left <= 2:
        raise InputError(
            f"--turns is {text!r}: expected LEFT,RIGHT turns in the same time, as 12.5,12.25."
        )
    return right / left


def calibrate_drive(
    runs: Sequence[DriveRun],
    settings: Settings,
    *,
    trim: float | None = None,
    servo_limit: float | None = None,
) -> Outcome:
    """Solve, and say what to make of it.

    Raises:
        InputError: the runs contradict each other wholly.
    """
    from polepilot.core.link.drive_fit import fit_drive, judge

    vehicle = settings.model.vehicle
    fit = fit_drive(runs, vehicle, settings.calibration, trim=trim, servo_limit=servo_limit)
    headings = (
        "run",
        "duty %",
        "servo °",
        "seconds",
        "driven m",
        "predicted m",
        "residual %",
        "wheel °",
        "residual °",
    )
    rows = [
        (
            str(number),
            f"{50 * (one.run.left + one.run.right):.0f}",
            f"{math.degrees(one.run.steering):+.0f}",
            f"{one.run.seconds:.2f}",
            f"{one.run.length:.3f}",
            f"{one.predicted:.3f}",
            f"{one.share * 100:+.1f}",
            f"{math.degrees(one.run.angle(vehicle.wheelbase)):+.1f}",
            f"{math.degrees(one.angle_error):+.1f}",
        )
        for number, one in enumerate(fit.residuals, start=1)
    ]
    changes, lines = _result(fit, vehicle)
    return Outcome((headings, rows), lines, _document(fit), judge(fit), changes)


def _result(fit: DriveFit, vehicle: Vehicle) -> tuple[Changes, tuple[str, ...]]:
    """What goes to robot.toml, and in words."""
    from polepilot.core.link.drive_fit import reach, rounded

    found = rounded(fit.calibration)
    drive: dict[str, float] = {
        "full_speed_left_m_s": found.full_speed_left,
        "full_speed_right_m_s": found.full_speed_right,
        "dead_band": found.dead_band,
        "servo_center_rad": found.servo_center,
        "servo_scale": found.servo_scale,
        "servo_limit_rad": found.servo_limit,
    }
    if "counts_per_metre" in fit.found:
        drive["counts_per_m"] = found.counts_per_metre
    changes: dict[str, dict[str, float]] = {"drive": drive}
    widest = reach(found)
    center = math.degrees(found.servo_center)
    side = "left" if center > 0 else "right"
    lines = [
        f"full duty drives {found.full_speed_left:.3f} m/s left, {found.full_speed_right:.3f} m/s "
        f"right; below {found.dead_band * 100:.0f} % nothing turns",
        f"straight on is {abs(center):.1f}° {side} of the servo's middle; it turns "
        f"{abs(found.servo_scale):.2f}° for 1° of the front wheel"
        + (", mirrored" if found.servo_scale < 0 else ""),
        f"the front wheel reaches {math.degrees(widest):.0f}° to both sides: circles of "
        f"{vehicle.wheelbase / math.tan(widest):.2f} m radius",
    ]
    if widest < vehicle.max_steering - math.radians(0.5):
        changes["vehicle"] = {"max_steering_rad": math.floor(widest * 1e4) / 1e4}
        planned = math.degrees(vehicle.max_steering)
        lines.append(
            f"that is less than vehicle.max_steering_rad, {planned:.0f}°: plans have to know it"
        )
    slower = min(found.full_speed_left, found.full_speed_right)
    if vehicle.max_speed > slower:
        lines.append(
            f"vehicle.max_speed_m_s is {vehicle.max_speed:g}, more than these motors give: drives "
            "are planned as shorter than they will be"
        )
    return changes, tuple(lines)


def _document(fit: DriveFit) -> dict[str, Any]:
    return {
        "runs": [
            {
                "left": one.run.left,
                "right": one.run.right,
                "steering": one.run.steering,
                "seconds": one.run.seconds,
                "ahead": one.run.ahead,
                "aside": one.run.aside,
                "length": one.run.length,
                "predicted": one.predicted,
                "residual_share": one.share,
                "angle_residual": one.angle_error,
            }
            for one in fit.residuals
        ],
        "lag": fit.lag,
        "found": list(fit.found),
        "spare": fit.spare,
    }
