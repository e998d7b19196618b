"""Landmarks that contradict the rest."""

from __future__ import annotations

import pytest

from polepilot.core.geometry import Pose2D
from polepilot.core.landmark import Landmark
from polepilot.core.localization.health import LandmarkHealth, place_of
from polepilot.core.observation import RangeBearing

MARKS = {1: Landmark(1, 5.0, 0.0), 2: Landmark(2, 0.0, 5.0), 3: Landmark(3, -5.0, 0.0)}


def test_a_place_seen_from_a_pose() -> None:
    seen = RangeBearing(0.0, 1, 2.0, 0.0, 0.01, 0.001)
    assert place_of(Pose2D(1.0, 1.0, 0.0), seen, 0.1) == pytest.approx((3.1, 1.0))
    inf = float("inf")
    assert place_of(Pose2D(1.0, 1.0, 0.0), RangeBearing(0, 1, inf, 0, inf, 0.1), 0.1) is None


def test_a_witness_before_and_after_makes_few_sightings_enough() -> None:
    health = LandmarkHealth(MARKS)
    for index in range(3):
        assert health.contradicted(1, 0.1 * index, (5.3, 0.2 + 0.01 * index), 0.02) is None
    assert health.witnessed(1) == []
    (verdict,) = health.witnessed(2)
    assert (verdict.landmark, verdict.code) == (1, "landmark_moved")
    assert (verdict.dx, verdict.dy) == pytest.approx((0.3, 0.21), abs=0.02)
    assert verdict.text == "Landmark 1 has been moved by 37 cm."
    assert set(health.moved) == {1}
    assert health.witnessed(2) == []


def test_a_vague_pose_convicts_nobody_so_quickly() -> None:
    health = LandmarkHealth(MARKS)
    for index in range(5):
        assert health.contradicted(1, 0.1 * index, (5.3, 0.2), 0.10) is None
    assert health.witnessed(2) == []
    verdict = health.contradicted(1, 6.0, (5.3, 0.2), 0.10)
    assert verdict is not None
    assert verdict.code == "landmark_moved"


def test_the_surer_sightings_count_more() -> None:
    health = LandmarkHealth(MARKS)
    for index in range(4):
        health.contradicted(1, 0.1 * index, (5.4, 0.0), 0.08)
    health.contradicted(1, 1.0, (5.32, 0.0), 0.01)
    (verdict,) = health.witnessed(3)
    assert verdict.dx == pytest.approx(0.32, abs=0.01)


def test_a_sure_sighting_stands_against_many_vague_ones() -> None:
    """They come from a pose whose heading was off, and that said so."""
    health = LandmarkHealth(MARKS)
    for index in range(5):
        assert health.contradicted(1, 0.1 * index, (5.45, 0.28), 0.10) is None
    verdict = health.contradicted(1, 9.0, (5.30, 0.20), 0.02)
    assert verdict is not None
    assert (verdict.dx, verdict.dy) == pytest.approx((0.3, 0.2), abs=0.02)


def test_a_shift_within_what_is_known_convicts_nobody() -> None:
    """Far away: ranges that are off together for one pass of the camera."""
    health = LandmarkHealth(MARKS)
    for index in range(5):
        health.contradicted(1, 0.1 * index, (5.10, 0.15), 0.10)
    assert health.witnessed(2) == []
    assert health.contradicted(1, 4.0, (5.10, 0.15), 0.10) is None
    assert health.moved == {}


def test_places_that_disagree_are_no_new_place() -> None:
    health = LandmarkHealth(MARKS)
    for index in range(12):
        place = (5.0 + 0.4 * (index % 3), 0.5 * (index % 4))
        assert health.contradicted(1, 0.5 * index, place, 0.02) is None


def test_a_number_read_where_another_stands_is_misread() -> None:
    health = LandmarkHealth(MARKS)
    for index in range(3):
        health.contradicted(1, 0.1 * index, (0.1, 5.0), 0.02)
    (verdict,) = health.witnessed(3)
    assert verdict.code == "landmark_misread"
    assert verdict.text == "Landmark 1 is read where another one stands."
    assert health.moved == {}


def test_a_landmark_that_is_put_back_is_used_again() -> None:
    health = LandmarkHealth(MARKS)
    health.moved[1] = (0.3, 0.0)
    answers = [health.agreed(1) for _ in range(6)]
    assert answers == [False] * 5 + [True]
    assert health.moved == {}


def test_agreement_in_between_acquits() -> None:
    health = LandmarkHealth(MARKS)
    for index in range(10):
        assert health.contradicted(1, index, (5.3, 0.2), 0.02) is None
        assert not health.agreed(1)
    assert health.witnessed(2) == []


def test_who_contradicted_is_suspected_for_a_while() -> None:
    health = LandmarkHealth(MARKS)
    health.contradicted(1, 0.0, (5.3, 0.2), 0.10)
    assert not health.suspected(1, 0.1)
    health.contradicted(1, 0.1, (5.3, 0.2), 0.10)
    assert health.suspected(1, 0.2)
    assert not health.suspected(2, 0.2)
    assert not health.suspected(1, 20.0)
    health.agreed(1)
    assert not health.suspected(1, 0.3)
