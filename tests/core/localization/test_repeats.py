"""Sightings that are told twice."""

from __future__ import annotations

from dataclasses import replace

from polepilot.core.landmark import Landmark
from polepilot.core.localization.localizer import Localizer
from polepilot.core.localization.repeats import Repeats
from polepilot.core.observation import Odometry, RangeBearing
from polepilot.core.vehicle import Vehicle

MARKS = {1: Landmark(1, 3.0, 0.0), 2: Landmark(2, 0.0, 4.0)}
ONE = RangeBearing(0.0, 1, 3.0, 0.0, 0.01, 0.001)
OTHER = RangeBearing(0.0, 2, 4.0, 1.5707963267948966, 0.01, 0.001)


def at(stamp: float) -> list[RangeBearing]:
    return [replace(one, stamp=stamp) for one in (ONE, OTHER)]


def test_only_what_is_new_is_left() -> None:
    repeats = Repeats()
    assert repeats.fresh([ONE, ONE, OTHER]) == [ONE, OTHER]
    assert repeats.fresh([ONE]) == []
    assert repeats.fresh([replace(ONE, range=2.0)]) == []
    # One picture may hold a number twice: which of them is right others have to tell.
    both = [replace(ONE, stamp=0.1), replace(ONE, stamp=0.1, bearing=0.5)]
    assert repeats.fresh(both) == both
    assert repeats.fresh(at(0.2)) == at(0.2)


def test_memory_is_bounded() -> None:
    repeats = Repeats()
    for number in range(5000):
        repeats.fresh([replace(ONE, landmark=number)])
    assert len(repeats._last) <= 1001


def test_a_picture_told_twice_is_no_second_look() -> None:
    localizer = Localizer(MARKS, Vehicle(), 0.0)
    localizer.add_odometry(Odometry(0.0, 0.0, 0.0))
    for _ in range(5):
        localizer.add_measurements(at(0.0))
        localizer.add_picture(0.0, 0.0, at(0.0) * 2)
    assert localizer.estimate(0.0) is None
    localizer.add_measurements(at(0.1))
    assert localizer.estimate(0.1) is not None
