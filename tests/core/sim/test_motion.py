from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from polepilot.core.errors import InternalError
from polepilot.core.geometry import Pose2D
from polepilot.core.sim.motion import Actuation, Disturbances, Motion
from polepilot.core.vehicle import PanUnit, Vehicle

VEHICLE, PAN = Vehicle(), PanUnit()


def motion(disturbances: Disturbances | None = None, seed: int = 1) -> Motion:
    chosen = Disturbances.none() if disturbances is None else disturbances
    return Motion(VEHICLE, PAN, chosen, np.random.default_rng(seed), full_speed=0.5)


def fitting(speed: float, steering: float) -> Actuation:
    """Rear speeds that fit the steering angle."""
    bend = math.tan(steering) / VEHICLE.wheelbase * VEHICLE.track / 2
    return Actuation(speed * 2000 * (1 - bend), speed * 2000 * (1 + bend), steering)


def test_straight() -> None:
    robot = motion()
    robot.advance(2.0, Actuation(600, 600))
    assert robot.pose == pytest.approx(Pose2D(0.6, 0.0, 0.0), abs=1e-9)
    assert robot.speed == pytest.approx(0.3)
    assert robot.left_travel == pytest.approx(0.6)


@pytest.mark.parametrize("side", [1, -1])
@pytest.mark.parametrize("speed", [0.2, -0.2])
def test_full_steering_turns_on_the_tightest_circle(side: int, speed: float) -> None:
    robot = motion()
    robot.advance(1.0, Actuation(steering=side * VEHICLE.max_steering))
    robot.advance(math.tau * 0.30 / 0.2, fitting(speed, side * VEHICLE.max_steering))
    # Once round a circle of 0.30 m: back where it started.
    assert robot.pose.position == pytest.approx((0.0, 0.0), abs=1e-6)
    assert math.cos(robot.pose.heading) == pytest.approx(1.0)


@settings(deadline=None, max_examples=50)
@given(speed=st.floats(-0.4, 0.4), steering=st.floats(-0.58, 0.58), seconds=st.floats(0.1, 4))
def test_motion_is_the_integral_of_its_rates(speed: float, steering: float, seconds: float) -> None:
    robot = motion()
    robot.advance(1.0, Actuation(steering=steering))
    robot.advance(seconds, fitting(speed, steering))
    x = y = 0.0
    count = 4000
    turn_rate = speed * math.tan(steering) / VEHICLE.wheelbase
    for index in range(count):
        heading = turn_rate * (index + 0.5) * seconds / count
        x += speed * math.cos(heading) * seconds / count
        y += speed * math.sin(heading) * seconds / count
    assert robot.pose.position == pytest.approx((x, y), abs=1e-5)


def test_rear_wheels_that_do_not_fit_the_steering_slip() -> None:
    front_wins = motion()
    front_wins.advance(1.0, Actuation(400, 600))
    assert front_wins.pose.heading == 0.0
    blend = motion(replace(Disturbances.none(), rear_grip=0.25))
    blend.advance(1.0, Actuation(400, 600))
    # The wheels alone would turn it by (0.3 - 0.2)/0.2 rad.
    assert blend.pose.heading == pytest.approx(0.25 * 0.5)


def test_servo_takes_its_time() -> None:
    robot = motion()
    robot.advance(0.1, Actuation(steering=0.5))
    assert robot.steering == pytest.approx(0.1 * VEHICLE.steering_rate)
    robot.advance(0.4, Actuation(steering=2.0))
    assert robot.steering == pytest.approx(VEHICLE.max_steering)


def test_motors_lag() -> None:
    robot = motion(replace(Disturbances.none(), motor_lag=0.1))
    robot.advance(0.1, Actuation(1000, 1000))
    assert robot.left == pytest.approx(0.5 * (1 - math.exp(-1)), rel=1e-6)
    assert not robot.standing
    robot.advance(2.0, Actuation())
    assert robot.standing


def test_wheels_stand_within_a_sixth_of_a_second() -> None:
    robot = motion(replace(Disturbances.none(), motor_lag=0.08, friction=1.0))
    robot.advance(1.0, Actuation(800, 800))
    robot.advance(0.16, Actuation())
    assert robot.standing
    before = robot.pose
    robot.advance(1.0, Actuation())
    assert robot.pose == before


def test_scale_error_and_steering_offset() -> None:
    robot = motion(replace(Disturbances.none(), speed_scale=0.03, steering_offset=0.02))
    robot.advance(1.0, Actuation(500, 500))
    assert robot.speed == pytest.approx(0.25 * 1.03)
    assert robot.pose.heading == pytest.approx(0.2575 * math.tan(0.02) / 0.20, rel=1e-3)


def test_white_slip_grows_with_the_root_of_the_way() -> None:
    noisy = replace(Disturbances.none(), slip=0.01, turn_slip=0.0)
    ends = []
    for seed in range(80):
        robot = motion(noisy, seed)
        robot.advance(2.0, Actuation(1000, 1000))
        ends.append(robot.pose.x)
    assert np.mean(ends) == pytest.approx(1.0, abs=0.005)
    # Chi-square bounds of 80 draws: 0.01 within 30 % (more than three sigma).
    assert np.std(ends) == pytest.approx(0.01, rel=0.3)


def test_bursts_lose_way() -> None:
    robot = motion(replace(Disturbances.none(), burst_rate=0.5, burst_loss=0.5, burst_length=0.4))
    robot.advance(59.0, Actuation(1000, 1000))
    # 30 bursts of 0.24 s on average at half speed: about 1.6 m of 29.5 m.
    assert 27.0 < robot.pose.x < 29.0
    assert robot.left_travel == pytest.approx(29.5)


def test_pan_turns_to_its_stops_and_stays() -> None:
    robot = motion()
    robot.advance(1.0, Actuation(pan=1000))
    assert robot.pan_angle == pytest.approx(math.radians(45))
    assert robot.pan_rate == pytest.approx(math.radians(45))
    robot.advance(10.0, Actuation(pan=1000))
    assert robot.pan_angle == pytest.approx(PAN.maximum)
    assert robot.pan_rate == 0.0
    assert robot.adc() == 1023
    robot.advance(20.0, Actuation(pan=-1000))
    assert robot.pan_angle == pytest.approx(PAN.minimum)
    assert robot.adc() == 0


def test_potentiometer_is_slightly_bent_and_noisy() -> None:
    robot = motion(replace(Disturbances.none(), adc_bow=0.003, adc_noise=0.5))
    robot.advance(1.5, Actuation(pan=-1000))
    true = robot.pan_angle
    readings = [robot.adc() for _ in range(400)]
    share = (true - PAN.minimum) / (PAN.maximum - PAN.minimum)
    expected = 1023 * (share + 0.003 * math.sin(math.tau * share))
    assert np.mean(readings) == pytest.approx(expected, abs=0.15)
    # Half a count of noise, and the 0.29 counts of rounding.
    assert np.std(readings) == pytest.approx(math.hypot(0.5, 0.289), rel=0.15)
    assert abs(PAN.angle(float(np.mean(readings))) - true) < math.radians(270 * 0.0035)


def test_backlash_holds_the_camera_back() -> None:
    robot = motion(replace(Disturbances.none(), backlash=math.radians(2)))
    robot.advance(0.5, Actuation(pan=1000))
    assert robot.pan_angle == pytest.approx(math.radians(21.5))
    robot.advance(1 / 45, Actuation(pan=-1000))
    assert robot.pan_angle == pytest.approx(math.radians(21.5))
    robot.advance(3 / 45, Actuation(pan=-1000))
    assert robot.pan_angle == pytest.approx(math.radians(19.5))


def test_same_seed_same_world() -> None:
    ends = []
    for _ in range(2):
        robot = motion(Disturbances(), seed=7)
        robot.advance(5.0, Actuation(500, 700, 0.2, -500))
        ends.append((robot.pose, robot.pan_angle, robot.adc()))
    assert ends[0] == ends[1]


def test_placing_does_not_touch_the_wheels() -> None:
    robot = motion(replace(Disturbances.none(), motor_lag=0.1))
    robot.advance(1.0, Actuation(500, 500))
    robot.place(Pose2D(5, 5, 1))
    assert robot.pose == Pose2D(5, 5, 1)
    assert not robot.standing


def test_time_does_not_run_backward() -> None:
    with pytest.raises(InternalError):
        motion().advance(-0.1, Actuation())
