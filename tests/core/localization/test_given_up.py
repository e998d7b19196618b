"""Poses that were given up, and what brings them back."""

from __future__ import annotations

import math

import pytest

from polepilot.core.geometry import Pose2D, wrap_angle
from polepilot.core.landmark import Landmark
from polepilot.core.localization.localizer import Localizer
from polepilot.core.observation import Odometry, RangeBearing, Status
from polepilot.core.vehicle import Vehicle

FORWARD = 0.1
MARKS = {1: Landmark(1, 0.0, 0.0), 2: Landmark(2, 4.0, 0.0), 3: Landmark(3, 2.0, 4.0)}
POSE = Pose2D(2.0, 1.5, 0.0)


def sight(number: int, stamp: float, pose: Pose2D = POSE) -> RangeBearing:
    """What a robot at ``pose`` measures."""
    camera = pose.ahead(FORWARD)
    x, y = MARKS[number].position
    bearing = wrap_angle(math.atan2(y - camera[1], x - camera[0]) - pose.heading)
    return RangeBearing(stamp, number, math.dist(camera, (x, y)), bearing, 0.01, 0.001)


def given_up() -> Localizer:
    """Tracked at `POSE` for ten seconds, then contradicted twice by landmark 1, and given up."""
    localizer = Localizer(MARKS, Vehicle(), FORWARD)
    for tick in range(100):
        localizer.add_odometry(Odometry(0.1 * tick, 0.0, 0.0))
        localizer.add_measurements([sight(n, 0.1 * tick) for n in MARKS])
    away = Pose2D(3.0, 1.5, 0.0)
    localizer.add_measurements([sight(1, 10.0, away)])
    localizer.add_measurements([sight(1, 10.1, away)])
    assert localizer.status is Status.LOST
    localizer.refix("given up")
    assert localizer.estimate(10.1) is None
    return localizer


@pytest.mark.parametrize("pause", [1.0, 60.0])
def test_landmarks_that_agree_bring_it_back(pause: float) -> None:
    localizer = given_up()
    for tick in range(1, int(10 * pause)):
        localizer.add_odometry(Odometry(10.1 + 0.1 * tick, 0.0, 0.0))
    now = 10.1 + pause
    localizer.add_measurements([sight(3, now)])
    localizer.add_measurements([sight(3, now + 0.1)])
    estimate = localizer.estimate(now + 0.1)
    assert estimate is not None
    assert estimate.pose.distance_to(POSE.position) < 0.01
    assert [event.code for event in localizer.events()][-1] == "resumed"


@pytest.mark.parametrize("pause", [2.0, 60.0])
def test_it_does_not_come_back_where_the_robot_no_longer_is(pause: float) -> None:
    """Driven for 1.0 m since: what agrees with where it was contradicts where it is."""
    localizer = given_up()
    for tick in range(1, int(10 * (4.0 + pause))):
        localizer.add_odometry(Odometry(10.1 + 0.1 * tick, 0.25 if tick < 40 else 0.0, 0.0))
    now = 14.1 + pause
    localizer.add_measurements([sight(2, now)])
    localizer.add_measurements([sight(2, now + 0.1)])
    assert localizer.estimate(now + 0.1) is None
    # Seen from where it has come to, they do.
    there = Pose2D(POSE.x + 1.0, POSE.y, 0.0)
    for late in (0.2, 0.3):
        localizer.add_measurements([sight(2, now + late, there)])
    estimate = localizer.estimate(now + 0.3)
    if estimate is not None:
        assert estimate.pose.distance_to(there.position) < 0.3
