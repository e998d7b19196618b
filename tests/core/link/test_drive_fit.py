"""Runs that a known robot would drive, measured with a tape: what comes out is that robot."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from polepilot.core.errors import InputError
from polepilot.core.link.calibration import DriveCalibration
from polepilot.core.link.drive_fit import DriveFit, DriveRun, fit_drive, judge, reach
from polepilot.core.vehicle import Vehicle

VEHICLE = Vehicle()
PRESENT = DriveCalibration()
CROOKED = DriveCalibration(
    full_speed_left=0.64,
    full_speed_right=0.58,
    dead_band=0.16,
    servo_center=math.radians(-4),
    servo_scale=-1.2,
)
FIVE = ((0.35, 0, 1.5), (0.35, 0, 5), (0.7, 0, 3), (0.5, 18, 3), (0.5, -18, 3))
"""Duty, servo in degrees, seconds."""


def driven(
    robot: DriveCalibration,
    duty: float,
    servo: float,
    seconds: float,
    *,
    lag: float = 0.04,
    tape: tuple[float, float] = (0.0, 0.0),
) -> DriveRun:
    """Where ``robot`` comes to stand, by its definition."""
    steering = math.radians(servo)
    angle = (steering - robot.servo_center) / robot.servo_scale
    curvature = math.tan(angle) / VEHICLE.wheelbase
    per_mille = round(duty * 1000)
    speed = (robot.wheel_speed(per_mille, False) + robot.wheel_speed(per_mille, True)) / 2
    length = speed * (seconds - lag)
    turned = curvature * length
    chord = length * (math.sin(turned / 2) / (turned / 2) if turned else 1)
    ahead, aside = chord * math.cos(turned / 2), chord * math.sin(turned / 2)
    return DriveRun(duty, duty, steering, seconds, ahead + tape[0], aside + tape[1])


def solved(robot: DriveCalibration, noise: float = 0.0, seed: int = 0) -> DriveFit:
    rng = np.random.default_rng(seed)
    trim = robot.full_speed_right / robot.full_speed_left
    runs = [
        driven(robot, *how, tape=(float(rng.normal(0, noise)), float(rng.normal(0, noise))))
        for how in FIVE
    ]
    return fit_drive(runs, VEHICLE, PRESENT, trim=trim, servo_limit=math.radians(40))


@settings(deadline=None, max_examples=60)
@given(
    st.floats(0.35, 1.5),
    st.floats(0.9, 1.1),
    st.floats(0.0, 0.25),
    st.floats(-8, 8),
    st.sampled_from([-1.5, -1.0, 0.8, 1.0, 1.3]),
)
def test_finds_any_robot_from_exact_numbers(
    full: float, trim: float, band: float, center: float, scale: float
) -> None:
    robot = DriveCalibration(full, full * trim, band, math.radians(center), scale)
    fit = solved(robot)
    found = fit.calibration
    # The lag of the motors is not fully free: a guess of 0 within 0.1 s pulls a little.
    assert found.full_speed_left == pytest.approx(robot.full_speed_left, rel=0.015)
    assert found.full_speed_right == pytest.approx(robot.full_speed_right, rel=0.015)
    assert found.dead_band == pytest.approx(band, abs=0.005)
    assert found.servo_center == pytest.approx(robot.servo_center, abs=math.radians(0.05))
    assert found.servo_scale == pytest.approx(scale, rel=0.005)
    assert judge(fit).grade == "good"


@pytest.mark.parametrize("seed", range(5))
def test_a_tape_measure_is_good_enough(seed: int) -> None:
    """3 mm on everything: 3 % of the speed, half a degree of the servo."""
    found = solved(CROOKED, 0.003, seed).calibration
    assert found.full_speed_left == pytest.approx(0.64, rel=0.03)
    assert found.dead_band == pytest.approx(0.16, abs=0.02)
    assert found.servo_center == pytest.approx(CROOKED.servo_center, abs=math.radians(0.5))
    assert found.servo_scale == pytest.approx(-1.2, rel=0.03)


def test_a_run_measured_wrongly_is_named() -> None:
    runs = [driven(CROOKED, *how) for how in FIVE]
    runs[2] = replace(runs[2], ahead=runs[2].ahead + 0.4)
    fit = fit_drive(runs, VEHICLE, PRESENT, trim=0.9)
    assert (judge(fit).grade, fit.suspect) == ("poor", 2)
    askew = [driven(CROOKED, *how) for how in FIVE]
    askew[4] = replace(askew[4], aside=askew[4].aside / 2)
    assert judge(fit_drive(askew, VEHICLE, PRESENT)).grade == "poor"


def test_what_the_runs_cannot_tell_stays_as_it_was() -> None:
    before = replace(CROOKED, full_speed_left=0.3, full_speed_right=0.3, counts_per_metre=1234)
    fit = fit_drive([driven(CROOKED, 0.5, 0, 4)], VEHICLE, before)
    found = fit.calibration
    assert (found.dead_band, found.servo_scale, found.servo_limit, found.counts_per_metre) == (
        before.dead_band,
        before.servo_scale,
        before.servo_limit,
        1234,
    )
    assert found.servo_center == pytest.approx(CROOKED.servo_center, abs=1e-6)
    assert found.full_speed_left == pytest.approx(0.61, rel=0.02)
    verdict = judge(fit)
    assert (verdict.grade, len(verdict.notes)) == ("fair", 3)


def test_encoders_tell_trim_and_counts() -> None:
    runs = [
        replace(driven(CROOKED, *how), counts=(round(2000 * 1.05), round(2000 * 0.95)))
        for how in FIVE[:3]
    ]
    fit = fit_drive(runs, VEHICLE, PRESENT)
    found = fit.calibration
    assert found.full_speed_right / found.full_speed_left == pytest.approx(0.95 / 1.05, rel=1e-3)
    metres = sum(run.length for run in runs)
    assert found.counts_per_metre == pytest.approx(3 * 2000 / metres, rel=1e-3)


def test_impossible_numbers_are_refused() -> None:
    with pytest.raises(InputError, match="no run is given"):
        fit_drive([], VEHICLE, PRESENT)
    with pytest.raises(InputError, match=r"expected at least 0\.05 m"):
        DriveRun(0.4, 0.4, 0.0, 3.0, 0.0, 0.01)
    with pytest.raises(InputError, match="duty is 40"):
        DriveRun(40, 40, 0.0, 3.0, 1.0, 0.01)
    with pytest.raises(InputError, match="seconds"):
        DriveRun(0.4, 0.4, 0.0, 300.0, 1.0, 0.01)
    dead = [DriveRun(0.4, 0.4, math.radians(a), 3.0, 1.0, 0.0) for a in (-20, 0, 20)]
    with pytest.raises(InputError, match="the servo does not steer"):
        fit_drive(dead, VEHICLE, PRESENT)
    mirrored = [driven(CROOKED, *how) for how in FIVE]
    mirrored[4] = replace(mirrored[4], aside=-mirrored[4].aside)
    with pytest.raises(InputError, match="mount its arm anew"):
        fit_drive(mirrored, VEHICLE, PRESENT)
    with pytest.raises(InputError, match="mount its arm anew"):
        fit_drive([driven(CROOKED, 0.5, 20, 2)], VEHICLE, PRESENT, servo_limit=0.1)


def test_an_arc_beyond_half_a_turn() -> None:
    run = DriveRun(0.5, 0.5, 0.3, 6.0, -0.5, 0.5)
    assert run.turned == pytest.approx(math.radians(270))
    assert run.curvature == pytest.approx(2.0)
    assert run.length == pytest.approx(0.5 * math.radians(270))


def test_reach_is_that_of_the_worse_side() -> None:
    lopsided = DriveCalibration(servo_center=math.radians(5), servo_limit=math.radians(30))
    assert math.degrees(reach(lopsided)) == pytest.approx(25)
