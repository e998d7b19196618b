"""Surveys of drives with every fault: how near, how sure, and what is said of bad ones."""

from __future__ import annotations

import math
from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from core.localization.generator import Faults
from core.localization.surveying import Drive, changed, drive, errors, nees

from polepilot.core.errors import DatasetError, InputError
from polepilot.core.geometry import Point, Pose2D
from polepilot.core.localization.survey import survey
from polepilot.core.localization.survey_result import Survey
from polepilot.core.localization.survey_run import SurveyOptions, SurveyRun
from polepilot.core.observation import Odometry, RangeBearing

SEEDS = (9101, 9102, 9103)
LIMITS = {"room": 0.02, "yard": 0.05}


@cache
def shared(place: str, seed: int) -> Drive:
    return drive(place, seed)


@cache
def surveyed(place: str, seed: int) -> Survey:
    return survey(shared(place, seed).run)


@pytest.mark.parametrize("seed", SEEDS)
@pytest.mark.parametrize("place", ["room", "yard"])
def test_all_poles_without_any_map(place: str, seed: int) -> None:
    found = surveyed(place, seed)
    truth = shared(place, seed).truth
    off = errors(found, truth)
    assert set(off) == set(truth)
    assert max(off.values()) < LIMITS[place]
    assert found.not_placed == ()
    assert found.frame == "first pose"
    assert found.path[0][1] == pytest.approx((0, 0, 0), abs=1e-6)
    assert len(found.path) == len(shared(place, seed).run.pictures)


def test_what_distorts_the_drive_comes_out_as_well() -> None:
    found = surveyed("room", SEEDS[0])
    for name, true in (("speed_scale", 1.03), ("steering_offset", math.radians(1.0))):
        value = found.distortions[name]
        assert abs(value.value - true) < 3 * value.sigma
        assert value.sigma < 0.01


def test_sigmas_are_right_on_average() -> None:
    """Ranges are off together by as much as the survey believes they may be."""
    rng = np.random.default_rng(77)
    values = []
    for seed in range(9201, 9207):
        for place in ("room", "yard"):
            one = drive(place, seed, scale=1 + float(rng.normal(0, SurveyOptions().range_sigma)))
            values.append(nees(survey(one.run), one.truth))
    assert 1.0 < float(np.mean(values)) < 4.0
    assert max(values) < 12.0


@pytest.mark.parametrize("seed", SEEDS)
@pytest.mark.parametrize("place", ["room", "yard"])
def test_the_pole_that_was_measured_wrongly_is_named(place: str, seed: int) -> None:
    one = shared(place, seed)
    rng = np.random.default_rng(seed)
    hand = measured_by_hand(one.truth, rng)
    wrong = int(rng.choice(sorted(hand)))
    way = rng.uniform(0, math.tau)
    hand[wrong] = (hand[wrong][0] + 0.3 * math.cos(way), hand[wrong][1] + 0.3 * math.sin(way))
    found = survey(one.run, SurveyOptions(hand_measured=hand, map_sigma=0.005))
    assert [pole.id for pole in found.wrong] == [wrong]
    assert found.frame == "map"
    off = errors(found, one.truth, align=False)
    assert set(off) == set(one.truth)
    assert max(off.values()) < 0.02
    moved = found.wrong[0].moved
    assert moved is not None
    assert math.dist(moved, (-0.3 * math.cos(way), -0.3 * math.sin(way))) < 0.03


@pytest.mark.parametrize("seed", SEEDS)
@pytest.mark.parametrize(("place", "sigma"), [("room", 0.005), ("yard", 0.005), ("room", 0.02)])
def test_nothing_is_said_of_a_good_map(place: str, sigma: float, seed: int) -> None:
    one = shared(place, seed)
    hand = measured_by_hand(one.truth, np.random.default_rng(seed + 7), sigma)
    found = survey(one.run, SurveyOptions(hand_measured=hand, map_sigma=sigma))
    assert found.wrong == ()
    if sigma > 0.01:  # better than such a tape was, on the whole
        after = errors(found, one.truth).values()
        before = [math.dist(hand[k], one.truth[k]) for k in hand]
        assert np.mean(list(after)) < np.mean(before)


def test_sigmas_of_refined_maps_are_right_on_average() -> None:
    values = []
    for seed in SEEDS:
        for place in ("room", "yard"):
            one = shared(place, seed)
            hand = measured_by_hand(one.truth, np.random.default_rng(seed + 9), 0.01)
            found = survey(one.run, SurveyOptions(hand_measured=hand))
            values.append(nees(found, one.truth, align=False))
    assert 1.0 < float(np.mean(values)) < 4.0


def test_a_wrong_camera_constant_accuses_nobody() -> None:
    one = drive("yard", SEEDS[0], scale=1.015)
    hand = measured_by_hand(one.truth, np.random.default_rng(5))
    found = survey(one.run, SurveyOptions(hand_measured=hand, map_sigma=0.005))
    assert found.wrong == ()
    assert found.distortions["range_scale"].value == pytest.approx(1.015, abs=0.003)
    assert any("ranges come out 1.5 % too long" in note for note in found.notes)


def test_two_wrong_poles_of_eight_are_both_named() -> None:
    one = shared("yard", SEEDS[1])
    hand = measured_by_hand(one.truth, np.random.default_rng(6))
    hand[2] = (hand[2][0] + 0.3, hand[2][1])
    hand[7] = (hand[7][0], hand[7][1] - 0.25)
    found = survey(one.run, SurveyOptions(hand_measured=hand, map_sigma=0.005))
    assert {pole.id for pole in found.wrong} == {2, 7}
    assert found.wrong[0].id == 2
    assert max(errors(found, one.truth, align=False).values()) < 0.03


def test_poles_that_are_not_on_the_map_are_added() -> None:
    one = shared("room", SEEDS[0])
    hand = measured_by_hand(one.truth, np.random.default_rng(8))
    del hand[4]
    hand[15] = (4.0, 3.0)
    found = survey(one.run, SurveyOptions(hand_measured=hand, map_sigma=0.005))
    new = next(pole for pole in found.poles if pole.id == 4)
    assert new.measured is None
    assert new.moved is None
    assert math.dist(new.position, one.truth[4]) < 0.02
    assert [(gone.id, gone.reason) for gone in found.not_placed] == [(15, "was not seen")]


def test_anchors_in_one_place_are_refused() -> None:
    with pytest.raises(InputError, match="anchors 1 and 3 are in one place"):
        SurveyOptions(anchors={1: (0.0, 0.0), 2: (4.0, 0.0), 3: (0.01, 0.0)})


def test_another_map_is_refused() -> None:
    one = shared("room", SEEDS[0])
    rng = np.random.default_rng(3)
    other = {k: (float(rng.uniform(0, 8)), float(rng.uniform(0, 6))) for k in one.truth}
    with pytest.raises(InputError, match="agree"):
        survey(one.run, SurveyOptions(hand_measured=other))
    two = {k: one.truth[k] for k in (1, 5)}
    with pytest.raises(InputError, match="2 poles in common: expected at least 3"):
        survey(one.run, SurveyOptions(hand_measured=two))


def test_one_distance_says_how_large_everything_is() -> None:
    one = drive("room", SEEDS[0], scale=1.03)
    assert max(errors(survey(one.run), one.truth).values()) > 0.05
    length = math.dist(one.truth[1], one.truth[5])
    found = survey(one.run, SurveyOptions(distance=(1, 5, length)))
    assert max(errors(found, one.truth).values()) < 0.02
    assert found.distortions["range_scale"].value == pytest.approx(1.03, abs=0.003)


def test_two_anchors_define_the_coordinates() -> None:
    one = shared("room", SEEDS[1])
    anchors = {k: one.truth[k] for k in (2, 6)}
    found = survey(one.run, SurveyOptions(anchors=anchors))
    assert found.frame == "anchors"
    assert max(errors(found, one.truth, align=False).values()) < 0.02


def test_the_drive_begins_where_it_is_said_to() -> None:
    start = Pose2D(3.0, -2.0, 2.5)
    found = survey(shared("room", SEEDS[1]).run, SurveyOptions(start=start))
    plain = surveyed("room", SEEDS[1])
    assert found.path[0][1] == pytest.approx(start, abs=1e-5)
    for pole, same in zip(found.poles, plain.poles, strict=True):
        assert math.dist(pole.position, start.to_parent(same.position)) < 1e-3
        assert pole.sigma == pytest.approx(same.sigma, rel=0.02)


@pytest.mark.parametrize("seed", SEEDS)
def test_wrong_numbers_do_no_harm(seed: int) -> None:
    one = drive("room", seed, faults=Faults(survey_sigma=0.0, wrong_ids=0.08))
    found = survey(one.run)
    assert max(errors(found, one.truth).values()) < 0.02
    assert sum(pole.rejected for pole in found.poles) > 20


@pytest.mark.parametrize("seed", SEEDS)
def test_a_robot_that_was_lifted_goes_on_elsewhere(seed: int) -> None:
    faults = Faults(survey_sigma=0.0, lift_at=40.0)
    one = drive("room", seed, faults=faults, stands=(38.0, 45.0))
    found = survey(one.run)
    assert max(errors(found, one.truth).values()) < 0.02
    assert any("a break" in note for note in found.notes)


def test_slip_does_little_harm() -> None:
    one = drive("room", SEEDS[2], faults=Faults(survey_sigma=0.0, slip_bursts=0.10))
    assert max(errors(survey(one.run), one.truth).values()) < 0.02


def test_a_detector_that_is_too_sure_is_seen_through() -> None:
    rng = np.random.default_rng(1)
    one = shared("room", SEEDS[0])
    noisy = changed(one.run, lambda m: [replace(m, range=m.range + float(rng.normal(0, 0.06)))])
    found = survey(noisy)
    assert found.misfit > 1.5
    assert nees(found, one.truth) < 6.0


def test_a_number_that_is_only_another_pole_misread_is_not_placed() -> None:
    rng = np.random.default_rng(2)

    def misread(m: RangeBearing) -> list[RangeBearing]:
        return [replace(m, landmark=9) if m.landmark == 3 and rng.random() < 0.15 else m]

    one = shared("room", SEEDS[0])
    found = survey(changed(one.run, misread))
    assert [gone.id for gone in found.not_placed] == [9]
    assert "pole 3" in found.not_placed[0].reason
    assert max(errors(found, one.truth).values()) < 0.02


def test_two_poles_with_one_number_are_not_placed() -> None:
    one = shared("room", SEEDS[0])
    twins = changed(one.run, lambda m: [replace(m, landmark=2) if m.landmark == 5 else m])
    found = survey(twins)
    assert [gone.id for gone in found.not_placed] == [2]
    assert "two p" in found.not_placed[0].reason
    assert max(errors(found, one.truth).values()) < 0.02


def test_what_nothing_joins_is_not_placed() -> None:
    run = shared("room", SEEDS[0]).run
    pictures = tuple(
        (t, tuple(m for m in seen if (t < 45) == (m.landmark < 5)))
        for t, seen in run.pictures
        if not 40 < t < 50
    )
    found = survey(replace(run, pictures=pictures, breaks=(40.0,)))
    assert {pole.id for pole in found.poles} <= {1, 2, 3, 4}
    assert {gone.id for gone in found.not_placed} >= {5, 6}
    assert all("nothing joins" in gone.reason for gone in found.not_placed)
    assert any("could not be joined" in note for note in found.notes)


def test_a_gap_is_bridged_by_poles_that_both_sides_see() -> None:
    one = shared("room", SEEDS[0])
    pictures = tuple(p for p in one.run.pictures if not 40 < p[0] < 50)
    found = survey(replace(one.run, pictures=pictures, breaks=(40.0,)))
    assert max(errors(found, one.truth).values()) < 0.02
    assert len(found.path) == len(pictures)


def test_recordings_that_say_nothing() -> None:
    run = shared("room", SEEDS[0]).run
    with pytest.raises(DatasetError, match="no picture"):
        replace(run, pictures=())
    with pytest.raises(DatasetError, match="order of time"):
        replace(run, pictures=run.pictures[::-1])
    with pytest.raises(InputError, match="no landmark was seen in 1124 pictures"):
        survey(changed(run, lambda _: []))
    with pytest.raises(InputError, match=r"drove 0\.00 m"):
        survey(replace(run, odometry=(Odometry(0.0, 0.0, 0.0),)))
    with pytest.raises(InputError, match=r"placed: 3; expected at least two"):
        survey(changed(run, lambda m: [m] if m.landmark == 3 else []))
    with pytest.raises(InputError, match="placed: none"):
        survey(changed(run, lambda m: [replace(m, range=math.inf, range_sigma=math.inf)]))


def test_options_that_make_no_sense() -> None:
    run = shared("room", SEEDS[0]).run
    with pytest.raises(InputError, match="pole 44 was never seen; the recording shows 1, 2"):
        survey(run, SurveyOptions(distance=(1, 44, 2.0)))
    hidden = changed(run, lambda m: [m] if m.landmark != 7 or m.stamp < 0.1 else [])
    rare = sum(m.landmark == 7 for _, seen in hidden.pictures for m in seen)
    if rare:
        with pytest.raises(InputError, match="could not be placed"):
            survey(hidden, SurveyOptions(distance=(1, 7, 2.0)))
    for wrong in (
        {"distance": (1, 1, 2.0)},
        {"distance": (1, 2, -1.0)},
        {"anchors": {1: (0.0, 0.0)}},
        {"map_sigma": 0.0},
        {"range_sigma": math.nan},
        {"anchors": {1: (0.0, 0.0), 2: (1.0, 0.0)}, "hand_measured": {1: (0.0, 0.0)}},
    ):
        with pytest.raises(InputError, match="expected"):
            SurveyOptions(**wrong)  # type: ignore[arg-type]


def test_sightings_without_a_range_still_count() -> None:
    rng = np.random.default_rng(4)

    def cut(m: RangeBearing) -> list[RangeBearing]:
        far = {"range": math.inf, "range_sigma": math.inf} if rng.random() < 0.5 else {}
        return [replace(m, **far)]  # type: ignore[arg-type]

    one = shared("room", SEEDS[0])
    found = survey(changed(one.run, cut))
    assert max(errors(found, one.truth).values()) < 0.02


def test_progress_is_told() -> None:
    told: list[tuple[str, float]] = []
    survey(shared("room", SEEDS[0]).run, progress=lambda text, share: told.append((text, share)))
    assert {"first map", "robust fit", "final fit"} <= {text for text, _ in told}
    assert all(0 <= share <= 1 for _, share in told)


def test_an_empty_run_cannot_be_made() -> None:
    with pytest.raises(DatasetError, match="wheelbase"):
        SurveyRun((), ((0.0, ()),), 0.0, 0.1)


def measured_by_hand(
    truth: dict[int, Point], rng: np.random.Generator, sigma: float = 0.005
) -> dict[int, Point]:
    return {
        k: (x + float(rng.normal(0, sigma)), y + float(rng.normal(0, sigma)))
        for k, (x, y) in truth.items()
    }
