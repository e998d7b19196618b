"""Landmarks that should be seen and are not."""

from __future__ import annotations

import math

import pytest

from polepilot.core.geometry import Pose2D
from polepilot.core.landmark import Landmark
from polepilot.core.localization.presence import Presence

MARKS = {1: Landmark(1, 5.0, 0.0), 2: Landmark(2, 0.0, 5.0), 3: Landmark(3, 2.0, 0.2)}
HALF_VIEW = math.radians(18.4)
HERE = Pose2D(0.0, 0.0, 0.0)


def used(sightings: int = 10) -> Presence:
    """Landmarks 1 and 2 were seen from here and from farther away."""
    presence = Presence(MARKS, 0.1, HALF_VIEW)
    for number in (1, 2):
        presence.saw(number, 6.0, 0.0, Pose2D(-1.0, -1.0, 0.0))
        for _ in range(sightings):
            presence.saw(number, 4.9, 0.3, HERE)
    return presence


def test_what_stands_in_the_picture_is_expected() -> None:
    presence = used()
    assert presence.expected(HERE, 0.0) == [1]
    assert presence.expected(HERE, math.pi / 2) == [2]
    assert presence.expected(HERE, math.pi) == []
    # Too near for the picture, by what was seen so far; and at the picture's edge.
    assert 3 not in presence.expected(HERE, 0.05)
    assert presence.expected(HERE, HALF_VIEW - math.radians(2)) == []
    # Never seen from so far away.
    assert presence.expected(Pose2D(-3.0, 0.0, 0.0), 0.0) == []


def test_the_more_often_it_was_seen_the_sooner_it_is_missed() -> None:
    chances = []
    for sightings in (3, 10, 40):
        presence = used(sightings)
        missing, chance, hidden = presence.look(1.0, HERE, 0.0, set())
        assert (missing, hidden) == ([1], [])
        again = presence.look(1.1, HERE, 0.0, set())[1]
        assert again == pytest.approx(chance**2)
        chances.append(chance)
    assert chances[0] > chances[1] > chances[2]
    assert chances[2] < 0.03


def test_a_landmark_that_comes_and_goes_is_not_missed_so_soon() -> None:
    steady, shaky = used(), used()
    for index in range(5):
        shaky.look(0.1 * index, HERE, 0.0, set())
        shaky.saw(1, 4.9, 0.3, HERE)
    chances = [presence.look(1.0, HERE, 0.0, set())[1] for presence in (steady, shaky)]
    assert chances[0] < 0.1 < chances[1]


def test_from_another_place_something_may_stand_between() -> None:
    missing, chance, _ = used().look(1.0, Pose2D(-0.3, 0.0, 0.0), 0.0, set())
    assert missing == []
    assert chance == 1.0


def test_what_is_not_seen_for_long_is_hidden_until_it_is_seen() -> None:
    presence = used()
    reports = []
    for index in range(400):
        pose = Pose2D(-0.3 - 0.001 * index, 0.0, 0.0)
        reports += presence.look(0.1 * index, pose, 0.0, {2})[2]
    assert reports == [1]
    assert presence.saw(1, 4.0, 0.0, HERE)
    assert not presence.saw(1, 4.0, 0.0, HERE)


def test_what_is_hardly_ever_read_from_so_far_away_is_not_hidden() -> None:
    """At the end of what the camera resolves, one look in eight tells."""
    marks = {1: Landmark(1, 14.0, 0.0), 2: Landmark(2, 0.0, 14.0)}
    presence = Presence(marks, 0.1, HALF_VIEW)
    for number in marks:
        presence.saw(number, 1.0, 0.0, Pose2D(5.0, 5.0, 0.0))
    reports = []
    for index in range(320):
        pose = Pose2D(0.002 * index, 0.0, 0.0)
        if index % 16 == 0:
            presence.saw(2 if index % 32 else 1, 13.9, 0.0, pose)
        else:
            for pan in (0.0, math.pi / 2):
                reports += presence.look(0.3 * index, pose, pan, set())[2]
    assert reports == []
    # One that is as far and was read every time is missed as before.
    steady = Presence(marks, 0.1, HALF_VIEW)
    steady.saw(1, 1.0, 0.0, Pose2D(5.0, 5.0, 0.0))
    for index in range(50):
        steady.saw(1, 13.9, 0.0, Pose2D(-0.1 * index, 0.0, 0.0))
    found = [steady.look(10.0 + index, Pose2D(1.0, 0.0, 0.0), 0.0, set())[2] for index in range(14)]
    assert [1] in found


def test_a_wrong_pose_takes_its_expectations_with_it() -> None:
    presence = used()
    presence.forget()
    assert presence.look(1.0, HERE, 0.0, set())[:2] == ([], 1.0)


def test_a_landmark_behind_another_one_is_not_missed() -> None:
    presence = used()
    # From here landmark 3 stands on the line of sight to 1, 4 cm aside of it.
    behind = Pose2D(-0.1, 0.3, -0.06)
    assert presence.expected(behind, 0.0) == []
    assert presence.expected(Pose2D(-0.1, 0.6, -0.1), 0.0) == [1]
    reports = []
    for index in range(400):
        reports += presence.look(0.1 * index, behind, 0.0, set())[2]
    assert reports == []
    # One that stands behind it hides nothing.
    marks = {**MARKS, 4: Landmark(4, 6.5, 0.0)}
    other = Presence(marks, 0.1, HALF_VIEW)
    other.saw(1, 6.0, 0.0, HERE)
    other.saw(1, 4.9, 0.3, HERE)
    assert other.expected(HERE, 0.0) == [1]
