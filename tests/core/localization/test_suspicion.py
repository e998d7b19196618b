"""What the filter cannot tell of itself: an improbable map, too few witnesses, losses in a row."""

from __future__ import annotations

import numpy as np
import pytest

from polepilot.core.geometry import Pose2D
from polepilot.core.landmark import Landmark
from polepilot.core.localization.ekf import STATES, PoseFilter
from polepilot.core.localization.localizer import Localizer
from polepilot.core.localization.suspicion import MapMisfit, Suspicion
from polepilot.core.observation import RangeBearing, Status
from polepilot.core.vehicle import Vehicle

MARKS = {n: Landmark(n, x, y) for n, x, y in [(1, 3.0, 0.0), (2, 0.0, 3.0), (3, -3.0, -1.0)]}


def sight(stamp: float, number: int, pose: Pose2D, place: tuple[float, float]) -> RangeBearing:
    x, y = pose.inverse().to_parent(place)
    return RangeBearing(
        stamp, number, float(np.hypot(x, y)), float(np.arctan2(y, x)), 0.005, 0.002, 0.0
    )


def test_nothing_is_suspected_of_a_right_pose() -> None:
    suspicion = Suspicion(0.2)
    assert suspicion.judge(10.0, 6, {}, MapMisfit(9.0, 8.0, 1)).reason == ""
    assert suspicion.judge(10.0, 6, {4: (0.3, 0.2)}, MapMisfit()).reason == ""


def test_an_improbable_map_is_suspected_until_it_is_probable_again() -> None:
    suspicion = Suspicion(0.2)
    reasons = [
        suspicion.judge(10.0, 6, {}, MapMisfit(8.0 + 4.0 * sigmas, 8.0, 1)).reason
        for sigmas in (0.0, 3.9, 4.1, 3.1, 2.9, 3.9)
    ]
    assert [bool(reason) for reason in reasons] == [False, False, True, True, False, False]
    assert "landmark 1: check the map" in reasons[2]


def test_three_landmarks_farther_apart_than_on_the_map_are_suspected() -> None:
    """Of four and more the filter can tell whether all ranges are off or one landmark is."""
    stretched = MapMisfit(4.0, 4.0, None, -2.4)
    assert "closer together" in Suspicion(0.2).judge(10.0, 3, {}, stretched).reason
    assert "closer together" in Suspicion(0.2).judge(10.0, 4, {2: (0.3, 0.0)}, stretched).reason
    assert Suspicion(0.2).judge(10.0, 4, {}, stretched).reason == ""
    assert Suspicion(0.2).judge(10.0, 3, {}, MapMisfit(4.0, 4.0, None, 1.5)).reason == ""


def test_where_as_many_are_off_as_agree_the_map_is_suspected() -> None:
    """One that was moved is carelessness; several, with hardly more that agree, are another map."""
    moved = {4: (5.0, 1.0), 5: (0.3, 0.0)}
    suspected = Suspicion(0.2).judge(10.0, 7, moved, MapMisfit(), 3)
    assert "not the map of this place" in suspected.reason
    assert suspected.spread == pytest.approx(np.hypot(5.0, 1.0))
    assert Suspicion(0.2).judge(10.0, 7, moved, MapMisfit(), 4).reason == ""
    assert Suspicion(0.2).judge(10.0, 7, {4: (5.0, 1.0)}, MapMisfit(), 2).reason == ""
    more = {**moved, 6: (0.4, 0.4), 7: (1.0, 1.0)}
    assert Suspicion(0.2).judge(10.0, 9, more, MapMisfit(), 5).reason != ""


def test_a_pose_by_three_on_a_map_of_another_place_says_so() -> None:
    """Landmarks 1 to 3 stand as on the map, by chance; 4 to 6 stand metres off."""
    marks = {**MARKS, **{n: Landmark(n, 2.5 - 4.0 * (n == 4), 1.0 - n) for n in (4, 5, 6)}}
    localizer = Localizer(marks, Vehicle(), 0.0)
    here = Pose2D(0.2, 0.1, 0.3)
    for index in range(240):
        number = (1, 2, 3, 4, 1, 5, 2, 6, 3)[index // 4 % 9]
        mark = marks[number]
        dx, dy = {4: (1.5, 2.0), 5: (-2.0, 1.0), 6: (1.0, -1.7)}.get(number, (0.0, 0.0))
        place = (mark.x + dx, mark.y + dy)
        localizer.add_measurements([sight(0.1 * index, number, here, place)])
        if localizer.status is Status.LOST:
            localizer.refix(localizer.reason)
        estimate = localizer.estimate(0.1 * index)
    assert len(localizer.moved_landmarks) >= 2
    assert estimate is not None
    assert estimate.status is Status.DEGRADED
    assert "not the map of this place" in estimate.reason
    assert estimate.position_sigma > 2.0


def test_two_cannot_say_which_of_three_was_moved() -> None:
    suspected = Suspicion(0.2).judge(10.0, 3, {7: (0.09, -0.12)}, MapMisfit())
    assert "Landmark 7" in suspected.reason
    assert suspected.spread == pytest.approx(0.15)


def test_three_losses_within_a_minute() -> None:
    suspicion = Suspicion(0.2)
    for stamp in (5.0, 20.0):
        suspicion.lost(stamp)
        assert suspicion.judge(stamp, 6, {}, MapMisfit()).reason == ""
    suspicion.lost(40.0)
    assert "calibration" in suspicion.judge(41.0, 6, {}, MapMisfit()).reason
    assert suspicion.judge(64.0, 6, {}, MapMisfit()).spread == pytest.approx(0.1)
    assert suspicion.judge(65.5, 6, {}, MapMisfit()).reason == ""


@pytest.mark.parametrize("seed", range(5))
def test_the_filter_knows_what_its_map_has_cost(seed: int) -> None:
    """Sum of squares and freedom belong together where the map is as good as it is said to be."""
    rng = np.random.default_rng(seed)
    misfits = {}
    for off in (0.005, 0.05):
        true = {n: mark.position + rng.normal(0.0, off, 2) for n, mark in MARKS.items()}
        tracked = PoseFilter(0.2, 0.0, surveyed=tuple(MARKS))
        tracked.covariance[:3, :3] = np.diag(np.square((1e-4, 1e-4, 1e-4)))
        for index in range(60):
            number = index % 3 + 1
            seen = sight(0.1 * index, number, Pose2D(0.0, 0.0, 0.0), tuple(true[number].tolist()))
            tracked.update(tracked.innovation(seen, MARKS[number]))
        misfits[off] = tracked.map_misfit
    right, wrong = misfits[0.005], misfits[0.05]
    assert 0.5 < right.freedom < 6.0
    assert right.excess < 3.0
    assert wrong.excess > 3.0
    shifts = np.hypot(*tracked.state[STATES:].reshape(3, 2).T)
    assert wrong.worst is not None
    assert shifts[wrong.worst - 1] == shifts.max()


def test_the_localizer_says_so_and_is_less_sure() -> None:
    """Three landmarks of which one stands elsewhere: whichever it calls moved, it may be wrong."""
    localizer = Localizer(MARKS, Vehicle(), 0.0)
    here = Pose2D(0.0, 0.0, 0.0)
    places = {n: mark.position for n, mark in MARKS.items()}
    for index in range(6):
        localizer.add_measurements([sight(0.1 * index, n, here, places[n]) for n in (1, 2, 3)])
    sure = localizer.estimate(0.6)
    assert sure is not None
    assert (sure.status, sure.reason) == (Status.TRACKING, "")
    places[3] = (-3.0, -0.7)
    for index in range(60):
        stamp = 1.0 + 0.1 * index
        localizer.add_measurements([sight(stamp, n, here, places[n]) for n in (1, 2, 3)])
    estimate = localizer.estimate(7.0)
    assert estimate is not None
    assert 3 in localizer.moved_landmarks
    assert estimate.status is Status.DEGRADED
    assert "cannot be told" in estimate.reason
    assert estimate.position_sigma == pytest.approx(0.3, abs=0.03)
