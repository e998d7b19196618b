"""Poses that two landmarks alone have given."""

from __future__ import annotations

import math

import numpy as np
import pytest

from polepilot.core.geometry import Pose2D
from polepilot.core.landmark import Landmark
from polepilot.core.localization.fix import Fix, FixRefusal, fix
from polepilot.core.localization.localizer import Localizer
from polepilot.core.localization.trial import Trial
from polepilot.core.observation import Odometry, RangeBearing, Status
from polepilot.core.vehicle import Vehicle

MARKS = {
    1: Landmark(1, 0.0, 0.0),
    2: Landmark(2, 4.0, 0.0),
    3: Landmark(3, 4.0, 4.0),
    4: Landmark(4, 0.0, 5.0),
}
POSE = Pose2D(2.0, 1.5, 0.4)
FORWARD = 0.1


def seen(number: int, stamp: float = 0.0) -> RangeBearing:
    return RangeBearing(stamp, number, 3.0, 0.0, 0.01, 0.001)


def sight(number: int, stamp: float, at: tuple[float, float] | None = None) -> RangeBearing:
    """What the robot at `POSE` measures of a landmark that stands ``at`` another place."""
    x, y = POSE.ahead(FORWARD)
    mx, my = at or MARKS[number].position
    bearing = math.atan2(my - y, mx - x) - POSE.heading
    return RangeBearing(stamp, number, math.hypot(mx - x, my - y), bearing, 0.01, 0.002, bearing)


def test_it_lasts_until_a_third_agrees() -> None:
    trial = Trial(MARKS, 0.2, 0.05)
    assert trial.contradicts(seen(4)) == ""
    trial.begin((1, 2))
    trial.agrees(seen(1))
    assert [trial.contradicts(seen(n)) for n in (3, 3, 4)] == ["", "", ""]
    assert trial.contradicts(seen(4)) == (
        "Landmarks 3 and 4 contradict the pose that 1 and 2 have given: one of those has been "
        "moved."
    )
    trial.begin((1, 2))
    trial.agrees(seen(3))
    assert trial.over
    assert [trial.contradicts(seen(n)) for n in (4, 4, 1, 1)] == [""] * 4
    trial.begin((1, 2, 3))
    assert trial.over


def test_only_where_others_contradict_are_the_two_evidence_as_well() -> None:
    trial = Trial(MARKS, 0.2, 0.05)
    trial.begin((1, 2), [seen(1), seen(2)])
    trial.agrees(seen(1, 1.0))
    trial.contradicts(seen(3, 2.0))
    assert trial.give_up() == [seen(3, 2.0)]
    trial.begin((1, 2), [seen(1), seen(2)])
    trial.agrees(seen(1, 1.0))
    for number in (3, 3, 4, 4):
        trial.contradicts(seen(number, 2.0))
    assert {m.landmark for m in trial.give_up()} == {1, 2, 3, 4}
    assert trial.failed
    assert trial.give_up() == []
    assert not trial.failed


def test_its_covariance_is_that_of_a_landmark_moved_round_the_other() -> None:
    """Landmark 2 was moved by 20 cm; the fix turns round landmark 1 and does not notice."""
    trial = Trial(MARKS, 0.2, 0.05)
    trial.begin((1, 2))
    assert trial.over is False
    turn = 2.0 * math.asin(0.5 * 0.2 / 4.0)
    moved = (4.0 * math.cos(turn), 4.0 * math.sin(turn))
    wrong = fix([sight(1, 0.0), sight(2, 0.0, moved)], MARKS, FORWARD)
    assert isinstance(wrong, Fix)
    error = np.array(wrong.pose) - np.array(POSE)
    assert np.hypot(*error[:2]) > 0.1
    spread = wrong.covariance + trial.covariance(wrong.pose)
    assert error @ np.linalg.solve(wrong.covariance, error) > 100.0
    assert error @ np.linalg.solve(spread, error) < 3.0
    trial.agrees(seen(3))
    assert not trial.covariance(wrong.pose).any()


def test_without_a_third_landmark_on_the_map_nothing_better_is_to_come() -> None:
    trial = Trial({1: MARKS[1], 2: MARKS[2]}, 0.2, 0.05)
    trial.begin((1, 2))
    assert not trial.over
    assert not trial.covariance(POSE).any()


@pytest.mark.parametrize("by", [0.25, 0.4])
def test_a_wrong_pose_never_has_a_small_sigma(by: float) -> None:
    """The dangerous one: a moved landmark keeps its distance to the only other one in view."""
    turn = 2.0 * math.asin(0.5 * by / 4.0)
    moved = (4.0 * math.cos(turn), 4.0 * math.sin(turn))
    localizer = Localizer(MARKS, Vehicle(), FORWARD)
    localizer.add_odometry(Odometry(0.0, 0.0, 0.0))
    poses = []
    codes = []
    for index in range(60):
        stamp = 0.1 * index
        numbers = [(1, 2), (3,), (4,), (1,)][index // 15]
        at = {2: moved}
        localizer.add_measurements([sight(n, stamp, at.get(n)) for n in numbers])
        if localizer.status is Status.LOST:
            localizer.refix(localizer.reason)
        estimate = localizer.estimate(stamp)
        codes += [event.code for event in localizer.events()]
        if estimate is None:
            continue
        error = np.array(estimate.pose) - np.array(POSE)
        squares = error @ np.linalg.solve(estimate.covariance, error)
        assert squares < 16.3, f"{stamp:.1f} s"
        poses.append((np.hypot(*error[:2]), estimate.position_sigma))
    assert poses[0][0] > 0.1
    assert 0.1 < poses[0][1] < 0.45
    assert poses[-1][0] < 0.02
    assert poses[-1][1] < 0.05
    assert "lost" in codes
    assert localizer.moved_landmarks.keys() <= {2}


def test_a_pose_on_trial_convicts_nobody() -> None:
    """Landmark 2 was moved, and 3 is in its place: it is not 3 that has been moved."""
    turn = 2.0 * math.asin(0.5 * 0.4 / 4.0)
    moved = (4.0 * math.cos(turn), 4.0 * math.sin(turn))
    localizer = Localizer(MARKS, Vehicle(), FORWARD)
    localizer.add_odometry(Odometry(0.0, 0.0, 0.0))
    for index in range(30):
        number = 3 if index >= 6 else 1 + index % 2
        at = moved if number == 2 else None
        localizer.add_measurements([sight(number, 0.1 * index, at)])
        if index % 7 == 6:
            localizer.add_measurements([sight(1, 0.1 * index + 0.05)])
    codes = [event.code for event in localizer.events()]
    assert "rejected" in codes
    assert "landmark_moved" not in codes
    assert localizer.moved_landmarks == {}


def test_two_poses_of_as_many_landmarks_are_no_pose() -> None:
    """Landmark 2 was moved round 1; so 1 and 2 agree, and 1 and 3 do."""
    turn = 2.0 * math.asin(0.5 * 0.5 / 4.0)
    moved = (4.0 * math.cos(turn), 4.0 * math.sin(turn))
    sights = [sight(1, 0.0), sight(2, 0.0, moved), sight(3, 0.0)]
    refused = fix(sights, MARKS, FORWARD)
    assert isinstance(refused, FixRefusal)
    assert refused.code == "contradiction"
    found = fix([*sights, sight(4, 0.0)], MARKS, FORWARD)
    assert isinstance(found, Fix)
    assert found.landmarks == (1, 3, 4)
    assert found.outliers == (2,)
    assert math.dist(found.pose.position, POSE.position) < 1e-6
