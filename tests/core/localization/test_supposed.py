"""Where a landmark stands that is not in its place: what is seen later tells it as well."""

from __future__ import annotations

import math

import numpy as np
import pytest

from polepilot.core.geometry import Pose2D
from polepilot.core.landmark import Landmark
from polepilot.core.localization.ekf import PoseFilter
from polepilot.core.localization.fix import Fix
from polepilot.core.localization.health import LandmarkHealth
from polepilot.core.localization.localizer import Localizer
from polepilot.core.localization.odometry import OdometryHistory, advance
from polepilot.core.localization.radial import RadialFilter
from polepilot.core.localization.supposed import Supposed
from polepilot.core.observation import Odometry, RangeBearing
from polepilot.core.vehicle import Vehicle

MARKS = {
    n: Landmark(n, x, y)
    for n, x, y in [(1, 4.0, 0.0), (2, 3.0, 3.0), (3, -3.0, 1.0), (4, 0.0, -4.0), (5, -2.0, -3.0)]
}
TRUE = Pose2D(0.0, 0.0, 0.0)
MOVED = (3.8, 0.4)
"""Where landmark 1 really stands."""


def sight(stamp: float, number: int, place: tuple[float, float] | None = None) -> RangeBearing:
    """As the robot at `TRUE` sees it, its camera above the axle."""
    x, y = place or MARKS[number].position
    return RangeBearing(stamp, number, math.hypot(x, y), math.atan2(y, x), 0.005, 0.002, 0.0)


def turned(degrees: float) -> PoseFilter:
    """Known to 2 cm, but for a heading that is off by so much and says so."""
    known = PoseFilter(0.2, 0.0, surveyed=tuple(MARKS))
    sigma = math.radians(max(abs(degrees), 0.5))
    known.reset(Pose2D(0.0, 0.0, math.radians(degrees)), np.diag([0.02, 0.02, sigma]) ** 2)
    return known


def kept_from_two() -> tuple[float, float]:
    """Where landmark 1 may stand so that nothing says that a pose of 1 and 2 is wrong."""
    round_two = math.radians(12.0)
    x, y = MARKS[1].x - MARKS[2].x, MARKS[1].y - MARKS[2].y
    cos, sin = math.cos(round_two), math.sin(round_two)
    return MARKS[2].x + cos * x - sin * y, MARKS[2].y + sin * x + cos * y


def test_a_heading_that_is_put_right_later_moves_the_place_too() -> None:
    known, supposed = turned(3.0), Supposed()
    seen = sight(0.0, 1, MOVED)
    place = known.appears(seen)
    assert place is not None
    assert math.dist(place, MOVED) > 0.15
    supposed.begin(known, 0.0, MARKS[1], place)
    history = OdometryHistory(0.2)
    supposed.follow(history, 0.0, [], [(seen, MARKS[1])], 0.2)
    ((_, _, before),) = supposed.places()
    supposed.follow(history, 0.1, [(sight(0.1, 2), MARKS[2])], [], 0.2)
    ((number, shift, after),) = supposed.places()
    assert number == 1
    assert shift == pytest.approx((-0.2, 0.4), abs=0.04)
    assert after < 0.3 * before


def test_nothing_is_learnt_of_a_landmark_that_is_here_and_there() -> None:
    supposed, history = Supposed(), OdometryHistory(0.2)
    supposed.begin(turned(0.0), 0.0, MARKS[1], MOVED)
    for index in range(8):
        place = (3.8, 0.4) if index < 2 else (1.0 + 0.5 * index, 2.0)
        seen = [(sight(0.1 * index, 1, place), MARKS[1])]
        supposed.follow(history, 0.1 * index, [], seen, 0.2)
    assert not supposed


def test_it_is_given_up_before_the_odometry_is_forgotten() -> None:
    supposed, history = Supposed(), OdometryHistory(0.2)
    supposed.begin(turned(0.0), 0.0, MARKS[1], MOVED)
    supposed.follow(history, 30.0, [(sight(30.0, 2), MARKS[2])], [], 0.2)
    assert not supposed


def test_few_are_followed_at_once_and_none_by_the_papers_method() -> None:
    supposed, known = Supposed(), turned(0.0)
    for number in MARKS:
        supposed.begin(known, 0.0, MARKS[number], (9.0, 9.0))
    assert len(supposed.places()) == 2
    other = Supposed()
    other.begin(RadialFilter(0.2, 0.0), 0.0, MARKS[1], MOVED)
    assert not other


def test_what_was_learnt_since_convicts_where_the_sightings_were_vague() -> None:
    def health() -> LandmarkHealth:
        found = LandmarkHealth(MARKS)
        for index in range(4):
            found.contradicted(1, 0.1 * index, (3.9, 0.6), 0.15)
        return found

    assert health().witnessed(2, 1.0) == []
    (verdict,) = health().witnessed(2, 1.0, [(1, (-0.2, 0.4), 0.03)])
    assert (verdict.dx, verdict.dy) == pytest.approx((-0.2, 0.4))
    # Known to six centimetres only: not while more may be learnt.
    vague = [(1, (-0.2, 0.4), 0.06)]
    assert health().witnessed(2, 1.0, vague) == []
    assert len(health().witnessed(2, 5.0, vague)) == 1
    # With the place goes all that is believed of the robot: 17 cm are not striking enough.
    assert health().witnessed(2, 5.0, [(1, (-0.12, 0.12), 0.04)]) == []


def test_a_pose_that_was_right_all_the_same_remembers_who_contradicted_it() -> None:
    health = LandmarkHealth(MARKS)
    for index in range(3):
        health.contradicted(1, 0.1 * index, MOVED, 0.02)
    health.set_aside()
    assert health.witnessed(2) == []
    health.restore()
    (verdict,) = health.witnessed(2)
    assert verdict.landmark == 1


def test_one_that_spoilt_the_first_pose_is_named_when_the_right_one_is_found() -> None:
    """It is not seen again in between."""
    localizer = Localizer(MARKS, Vehicle(), 0.0)
    moved = kept_from_two()
    stamp, named = 0.0, {}
    for number in (1, 2, 3, 4, 5, 3, 4, 5):
        for _ in range(4):
            stamp += 0.1
            seen = sight(stamp, number, moved if number == 1 else None)
            localizer.add_measurements([seen])
            if localizer.status.name == "LOST":
                localizer.refix(localizer.reason)
            named |= {e.landmark: e for e in localizer.events() if e.code == "landmark_moved"}
    assert list(named) == [1]
    assert (named[1].dx, named[1].dy) == pytest.approx(
        (moved[0] - MARKS[1].x, moved[1] - MARKS[1].y), abs=0.03
    )
    estimate = localizer.estimate(stamp)
    assert estimate is not None
    assert math.dist(estimate.pose.position, (0.0, 0.0)) < 0.03


def test_one_that_was_left_behind_is_named_by_how_the_robot_really_drove() -> None:
    """Dead reckoning by itself would carry its sightings along only to half a metre."""
    localizer, moved = Localizer(MARKS, Vehicle(), 0.0), kept_from_two()
    pose, stamp, named = TRUE, 0.0, {}
    for number in [1] * 6 + [2] * 6 + [0] * 30 + [2] * 3 + [3] * 4 + [4] * 6 + [5] * 6 + [2] * 6:
        stamp += 0.1
        drives = 12 < round(10 * stamp) <= 48
        localizer.add_odometry(Odometry(stamp - 0.1, 0.3 if drives else 0.0, 0.1))
        if drives:
            pose = advance(pose, 0.3, 0.1, 0.1, Vehicle().wheelbase)
        if number:
            x, y = moved if number == 1 else MARKS[number].position
            x, y = pose.inverse().to_parent((x, y))
            seen = RangeBearing(
                stamp, number, math.hypot(x, y), math.atan2(y, x), 0.005, 0.002, 0.0
            )
            localizer.add_measurements([seen])
        if localizer.status.name == "LOST":
            localizer.refix(localizer.reason)
        named |= {e.landmark: e for e in localizer.events() if e.code == "landmark_moved"}
    assert list(named) == [1]
    off = moved[0] - MARKS[1].x, moved[1] - MARKS[1].y
    assert (named[1].dx, named[1].dy) == pytest.approx(off, abs=0.08)


def test_what_did_not_lead_to_a_pose_of_two_says_something_when_it_fails() -> None:
    """Landmark 3 leaves it undecided until it is forgotten; so are most sightings of 1."""
    localizer, moved = Localizer(MARKS, Vehicle(), 0.0), kept_from_two()
    times = {3: [0.4, 0.5, 0.6, 0.7], 1: [3.05 + 0.1 * k for k in range(14)]}
    times |= {2: [8.1, 8.2, 8.3], 4: [8.5, 8.6, 8.7], 5: [8.9, 9.0, 9.1, 9.2, 9.3]}
    codes = []
    for stamp, number in sorted((t, number) for number, row in times.items() for t in row):
        localizer.add_measurements([sight(stamp, number, moved if number == 1 else None)])
        if localizer.status.name == "LOST":
            localizer.refix(localizer.reason)
        codes += [(e.code, e.landmark) for e in localizer.events()]
    assert ("refixed", None) in codes
    assert ("landmark_moved", 1) in codes


def test_a_landmark_that_had_no_part_in_a_pose_and_is_in_its_place_is_not_followed() -> None:
    supposed, known, history = Supposed(), turned(0.0), OdometryHistory(0.2)
    found = Fix(TRUE, np.diag([0.02, 0.02, 0.01]) ** 2, (2, 3))
    agreeing = [(sight(0.1 * k, n), MARKS[n]) for k, n in enumerate((2, 3, 4))]
    outsiders = [
        ((sight(0.4, 1, MOVED), MARKS[1]), (3.7, 0.6), 0.3),
        ((sight(0.5, 5), MARKS[5]), (-2.2, -3.2), 0.3),
    ]
    rows = supposed.start(known, found, 0.5, agreeing, outsiders, history)
    assert [seen.landmark for seen, _, _ in rows] == [1, 5]
    for (_, place, sigma), true in zip(rows, (MOVED, MARKS[5].position), strict=True):
        assert place == pytest.approx(true, abs=0.03)
        assert sigma < 0.05
    supposed.keep({1})
    assert [number for number, _, _ in supposed.places()] == [1]
