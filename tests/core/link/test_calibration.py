"""Commands to duties and back: the electronic differential, dead band, trim, servo, encoders."""

from __future__ import annotations

import math

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from polepilot.core.command import STAND, DriveCommand
from polepilot.core.errors import ConfigError
from polepilot.core.link.calibration import DriveCalibration
from polepilot.core.link.messages import BoardState, Faults, Features, Telemetry
from polepilot.core.vehicle import Vehicle

VEHICLE = Vehicle()
NOMINAL = DriveCalibration()
CROOKED = DriveCalibration(
    full_speed_left=0.62,
    full_speed_right=0.55,
    dead_band=0.15,
    servo_center=math.radians(-3),
    servo_scale=-1.1,
    counts_per_metre=2000,
)


def telemetry(
    duty: tuple[int, int] = (0, 0),
    steering: int = 0,
    odometer: tuple[int, int] = (0, 0),
    t_ms: int = 0,
) -> Telemetry:
    return Telemetry(
        t_ms, BoardState.ARMED, Faults.NONE, 0, 0, odometer, duty, steering, 0, (0, 0, 0), 0
    )


def test_straight_on() -> None:
    assert NOMINAL.to_drive(DriveCommand(0.25, 0.0), VEHICLE) == (500, 500, 0)
    assert NOMINAL.to_drive(DriveCommand(-0.25, 0.0), VEHICLE) == (-500, -500, 0)
    assert NOMINAL.to_drive(STAND, VEHICLE) == (0, 0, 0)
    assert CROOKED.to_drive(STAND, VEHICLE) == (0, 0, -300)


def test_electronic_differential() -> None:
    """Curvature 2 per metre and 0.2 m of track: the wheels run at 0.8 and 1.2 of the speed."""
    steering = math.atan(VEHICLE.wheelbase * 2.0)
    left, right, angle = NOMINAL.to_drive(DriveCommand(0.25, steering), VEHICLE)
    assert (left, right) == (400, 600)
    assert angle == round(math.degrees(steering) * 100)
    right_turn = NOMINAL.to_drive(DriveCommand(0.25, -steering), VEHICLE)
    assert right_turn == (600, 400, -angle)


def test_dead_band_and_trim() -> None:
    calibration = DriveCalibration(full_speed_left=0.5, full_speed_right=0.4, dead_band=0.2)
    assert calibration.to_drive(DriveCommand(0.1, 0.0), VEHICLE) == (360, 400, 0)
    assert calibration.wheel_speed(199, right=False) == 0
    assert calibration.wheel_speed(-600, right=False) == pytest.approx(-0.25)
    assert calibration.wheel_speed(1000, right=True) == pytest.approx(0.4)


def test_too_fast_keeps_the_curve() -> None:
    steering = math.atan(VEHICLE.wheelbase * 2.0)
    left, right, _ = NOMINAL.to_drive(DriveCommand(5.0, steering), VEHICLE)
    assert right == 1000
    assert left == round(1000 * 0.8 / 1.2)


def test_steering_is_limited_by_vehicle_and_servo() -> None:
    limit = round(math.degrees(VEHICLE.max_steering) * 100)
    assert NOMINAL.to_drive(DriveCommand(0.0, 3.0), VEHICLE)[2] == limit
    narrow = DriveCalibration(servo_center=math.radians(5), servo_limit=math.radians(20))
    assert narrow.to_drive(DriveCommand(0.0, 3.0), VEHICLE)[2] == 2000
    assert narrow.to_drive(DriveCommand(0.0, -3.0), VEHICLE)[2] == -2000
    assert narrow.to_steering(2000) == pytest.approx(math.radians(15))


@settings(deadline=None)
@given(
    st.sampled_from([NOMINAL, CROOKED]),
    st.floats(-0.4, 0.4),
    st.floats(-VEHICLE.max_steering, VEHICLE.max_steering),
)
def test_odometry_gives_back_what_was_commanded(
    calibration: DriveCalibration, speed: float, steering: float
) -> None:
    left, right, angle = calibration.to_drive(DriveCommand(speed, steering), VEHICLE)
    assert max(abs(left), abs(right)) <= 1000
    odometry = calibration.to_odometry(telemetry((left, right), angle), 12.5)
    assert odometry.stamp == 12.5
    assert odometry.steering == pytest.approx(steering, abs=1e-4)
    slowed = max(abs(left), abs(right)) >= 999
    if slowed:
        assert abs(odometry.speed) <= abs(speed) + 1e-3
    else:
        assert odometry.speed == pytest.approx(speed, abs=1e-3)


def test_encoders_only_where_the_board_has_them() -> None:
    before = telemetry((500, 500), 0, (1000, 1100), t_ms=100)
    now = telemetry((500, 500), 0, (1010, 1130), t_ms=200)
    has = Features.ENCODERS
    assert CROOKED.to_odometry(now, 0.0, before, has).speed == pytest.approx(0.1)
    applied = CROOKED.to_odometry(now, 0.0).speed
    assert applied != pytest.approx(0.1)
    assert CROOKED.to_odometry(now, 0.0, before, Features.PAN).speed == applied
    assert CROOKED.to_odometry(now, 0.0, None, has).speed == applied
    assert CROOKED.to_odometry(before, 0.0, before, has).speed == applied, "no time has passed"
    assert NOMINAL.to_odometry(now, 0.0, before, has).speed == pytest.approx(0.25), (
        "a board with encoders, but nobody knows the counts per metre"
    )


def test_encoders_and_clock_wrap() -> None:
    top = (1 << 31) - 5
    before = telemetry(odometer=(top, -top), t_ms=(1 << 32) - 50)
    now = telemetry(odometer=(top + 10 - (1 << 32), -top + 10), t_ms=50)
    assert CROOKED.to_odometry(now, 0.0, before, Features.ENCODERS).speed == pytest.approx(0.05)


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("full_speed_left", 0.0),
        ("full_speed_right", -1.0),
        ("full_speed_right", math.inf),
        ("dead_band", 1.0),
        ("dead_band", -0.1),
        ("servo_center", 1.0),
        ("servo_scale", 0.0),
        ("servo_limit", math.pi / 2),
        ("servo_limit", math.nan),
        ("counts_per_metre", -1.0),
    ],
)
def test_impossible_values_are_refused_by_name(name: str, value: float) -> None:
    with pytest.raises(ConfigError, match=f"{name} is" if not math.isnan(value) else "servo_"):
        DriveCalibration(**{name: value})
