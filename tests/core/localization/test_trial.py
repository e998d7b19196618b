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


NEAR = {**MARKS, 5: Landmark(5, 4.0, 0.5)}
"""Landmark 5 stands beside 2."""


def test_a_third_beside_the_pivot_rules_out_one_supposition_alone() -> None:
    """Landmark 1 was moved by 20 cm round 2: 5 stands only 2.5 cm off its place then."""
    trial = Trial(NEAR, 0.2, 0.0)
    trial.begin((1, 2))
    both = trial.covariance(POSE)
    trial.agrees(seen(5))
    assert not trial.over
    left = trial.covariance(POSE)
    # Turned by 1/20 round landmark 2, from which the robot is 2 m and -1.5 m away.
    lever = 0.05 * np.array([-1.5, -2.0, 1.0])
    assert left == pytest.approx(np.outer(lever, lever))
    # A turn round 1 leads elsewhere: what is left is less than both.
    assert np.linalg.eigvalsh(both - left).min() > -1e-12
    assert np.trace(both - left) > 0.01
    # It says the same again; one that stands elsewhere says the rest.
    trial.agrees(seen(5))
    assert not trial.over
    trial.agrees(seen(4))
    assert trial.over


def test_one_that_agrees_and_one_that_contradicts_leave_it_undecided() -> None:
    marks = {**MARKS, 5: Landmark(5, -3.0, 4.0)}
    trial = Trial(marks, 0.2, 0.05)
    trial.begin((1, 2))
    for _ in range(2):
        assert trial.contradicts(seen(3)) == ""
    for _ in range(9):
        trial.agrees(seen(4))
        assert trial.pivots == {1, 2}
    assert "Landmark 3 contradicts" in trial.doubt
    assert trial.undecided
    trial.agrees(seen(5))
    assert trial.over
    # What one of them said of the pose before says nothing of this one.
    trial.begin((1, 2))
    trial.agrees(seen(5))
    assert trial.over


def test_the_two_are_no_witnesses_against_themselves() -> None:
    trial = Trial(MARKS, 0.2, 0.05)
    trial.begin((1, 2))
    assert [trial.contradicts(seen(n)) for n in (1, 1, 2, 2, 3)] == [""] * 5
    assert trial.doubt == ""
    assert trial.contradicts(seen(3)) == ""
    assert trial.doubt == (
        "Landmark 3 contradicts the pose that 1 and 2 have given: one of the three has been moved."
    )
    assert trial.contradicts(seen(1)) == ""
    trial.agrees(seen(4))
    assert trial.doubt == ""


def fail(trial: Trial) -> str:
    """A pose that others contradict, again and again, and that is given up."""
    trial.begin((1, 2))
    said = [trial.contradicts(seen(n)) for n in (3, 3, 4, 4, 3, 4, 3)]
    trial.give_up()
    trial.give_up()
    return said[-1]


def test_poses_of_two_that_fail_again_and_again_are_not_believed() -> None:
    trial = Trial(MARKS, 0.2, 0.05)
    assert fail(trial).endswith("one of those has been moved.")
    assert trial.refusal(2.0) == ""
    assert fail(trial).endswith(
        "one of those has been moved, or this is not the map of this place."
    )
    assert trial.refusal(2.0) == (
        "Poses of two landmarks have failed 2 times: three have to agree, or this is not the map "
        "of this place."
    )
    trial.begin((1, 2, 3))
    assert trial.refusal(2.0) == ""
    fail(trial)
    trial.begin((1, 2))
    trial.agrees(seen(3))
    fail(trial)
    assert trial.refusal(2.0) == ""
    fail(trial)
    assert trial.refusal(2.0) != ""
    # Some minutes later the robot is elsewhere, or the poles are.
    assert trial.refusal(400.0) == ""
    trial.forgive()
    assert trial.refusal(2.0) == ""


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


def run(
    mapped: dict[int, Landmark],
    real: dict[int, tuple[float, float]],
    order: list[int],
    count: int,
    row: int = 3,
) -> list[tuple[Status, float, float, str]]:
    """Stand at `POSE` and see one landmark after the other, each ``row`` times in a row.

    Answers status, error, sigma and reason after each picture.
    """
    localizer = Localizer(mapped, Vehicle(), FORWARD)
    localizer.add_odometry(Odometry(0.0, 0.0, 0.0))
    rows = []
    for index in range(count):
        number = order[index // row % len(order)]
        localizer.add_measurements([sight(number, 0.1 * index, real[number])])
        if localizer.status is Status.LOST:
            localizer.refix(localizer.reason)
        estimate = localizer.estimate(0.1 * index)
        off = math.nan if estimate is None else estimate.pose.distance_to(POSE.position)
        sigma = math.nan if estimate is None else estimate.position_sigma
        rows.append((localizer.status, off, sigma, localizer.reason))
    return rows


@pytest.mark.parametrize("degrees", [3.0, 5.0, 8.0])
def test_a_third_beside_the_pivot_makes_no_wrong_pose_sure(degrees: float) -> None:
    """Landmark 1 was moved round 2, and 5 stands beside 2: it hardly notices."""
    turn = math.radians(degrees)
    real = {number: mark.position for number, mark in NEAR.items()}
    real[1] = (4.0 - 4.0 * math.cos(turn), -4.0 * math.sin(turn))
    rows = run({n: NEAR[n] for n in (1, 2, 5)}, real, [1, 2, 5], 200)
    usable = [row for row in rows if row[0] in (Status.TRACKING, Status.DEGRADED)]
    assert usable
    assert max(off / sigma for _, off, sigma, _ in usable) < 3.7
    assert not any(row[0] is Status.TRACKING for row in rows)


def test_of_a_map_of_another_place_no_third_pose_of_two_is_believed() -> None:
    """All landmarks stand as in a mirror; two of them do not notice."""
    places = {1: (0.0, 0.0), 2: (4.0, 0.0), 3: (4.5, 4.0), 4: (0.5, 5.0), 5: (-2.0, 2.0)}
    mapped = {number: Landmark(number, -x, y) for number, (x, y) in places.items()}
    rows = run(mapped, places, [1, 2, 3, 4, 5], 900, row=35)
    poses = [row for row in rows if not math.isnan(row[1])]
    assert poses
    # Twice, for the seconds until others are seen; then never again.
    assert len(poses) < 200
    assert all(math.isnan(off) for _, off, _, _ in rows[200:])
    assert rows[-1][0] is Status.FIXING
    assert rows[-1][3].endswith("three have to agree, or this is not the map of this place.")


def test_one_that_contradicts_a_pose_on_trial_is_said() -> None:
    real = {number: mark.position for number, mark in MARKS.items()}
    real[3] = (4.6, 4.0)
    rows = run(dict(MARKS), real, [1, 2, 3, 1, 2], 15)
    assert rows[6][0] is Status.DEGRADED
    assert rows[6][3] == "Only landmarks 1 and 2 have agreed so far: a third one has to."
    assert rows[-1][0] is Status.DEGRADED
    assert rows[-1][3] == (
        "Landmark 3 contradicts the pose that 1 and 2 have given: one of the three has been moved."
    )


def test_a_pose_of_two_is_claimed_when_a_third_agrees_and_nothing_is_said_about_it() -> None:
    localizer = Localizer(MARKS, Vehicle(), FORWARD)
    localizer.add_odometry(Odometry(0.0, 0.0, 0.0))
    said = []
    for index in range(12):
        stamp = 0.1 * index
        localizer.add_measurements([sight((1, 2)[index % 2] if index < 9 else 3, stamp)])
        localizer.estimate(stamp)
        said.append((localizer.status, localizer.reason))
    only = "Only landmarks 1 and 2 have agreed so far: a third one has to."
    assert said[3:9] == [(Status.DEGRADED, only)] * 6
    assert said[9:] == [(Status.TRACKING, "")] * 3
    assert [event.code for event in localizer.events()] == ["fixed"]


def test_what_happens_to_a_pose_of_two_is_an_event() -> None:
    localizer = Localizer(MARKS, Vehicle(), FORWARD)
    localizer.add_odometry(Odometry(0.0, 0.0, 0.0))
    for index in range(4):
        localizer.add_measurements([sight(n, 0.1 * index) for n in (1, 2)])
    away = (4.5, 4.0)
    localizer.add_measurements([sight(3, 0.5, away)])
    localizer.add_measurements([sight(3, 0.6, away)])
    localizer.estimate(0.7)
    codes = [event.code for event in localizer.events() if event.code != "rejected"]
    assert codes == ["fixed", "degraded"]
    assert "3" in localizer.reason
    localizer.add_measurements([sight(4, 0.8)])
    localizer.estimate(0.8)
    codes = [event.code for event in localizer.events() if event.code != "rejected"]
    assert codes == ["recovered"]
    assert localizer.status is Status.TRACKING


def test_a_map_of_two_never_claims_what_nothing_can_tell() -> None:
    """One was moved round the other: wherever the robot drives, all is as if none had been."""
    marks = {number: MARKS[number] for number in (1, 2)}
    turn = 2.0 * math.asin(0.5 * 0.4 / 4.0)
    real = {1: (0.0, 0.0), 2: (4.0 * math.cos(turn), 4.0 * math.sin(turn))}
    rows = run(marks, real, [1, 2], 100)
    assert all(row[0] is Status.DEGRADED for row in rows[20:])
    assert rows[-1][1] > 0.1
    assert rows[-1][3] == (
        "The map has landmarks 1 and 2 only: if one of them has been moved round the other, "
        "nothing would tell."
    )


def test_who_asks_for_a_new_pose_is_not_refused_for_what_was_before() -> None:
    places = {1: (0.0, 0.0), 2: (4.0, 0.0), 3: (4.5, 4.0), 4: (0.5, 5.0), 5: (-2.0, 2.0)}
    mapped = {number: Landmark(number, -x, y) for number, (x, y) in places.items()}
    localizer = Localizer(mapped, Vehicle(), FORWARD)
    localizer.add_odometry(Odometry(0.0, 0.0, 0.0))
    for index in range(600):
        number = 1 + index // 35 % 5
        localizer.add_measurements([sight(number, 0.1 * index, places[number])])
        if localizer.status is Status.LOST:
            localizer.refix(localizer.reason)
    assert "three have to agree" in localizer.reason
    localizer.refix("The robot was carried elsewhere.")
    for index in range(600, 610):
        localizer.add_measurements([sight(n, 0.1 * index, places[n]) for n in (1, 2)])
    assert localizer.status is Status.DEGRADED


@pytest.mark.parametrize("seed", range(12))
def test_no_pose_on_a_map_of_another_place_is_sure(seed: int) -> None:
    """Landmarks with the right numbers, anywhere: what agrees does so by chance."""
    rng = np.random.default_rng([seed, 77])
    count = int(rng.integers(4, 8))
    real = {n: (float(x), float(y)) for n, (x, y) in enumerate(rng.uniform(-4, 6, (count, 2)), 1)}
    mapped = {n: Landmark(n, *map(float, rng.uniform(-4, 6, 2))) for n in real}
    # Two of them stand to each other as on the map.
    mapped[2] = Landmark(2, mapped[1].x + math.dist(real[1], real[2]), mapped[1].y)
    rows = run(mapped, real, list(real), 600, row=12)
    assert any(row[0] is Status.DEGRADED for row in rows)
    assert sum(row[0] is Status.TRACKING for row in rows) <= 6
