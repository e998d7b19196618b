"""Where more landmarks help most: better than chance, and within the bounds that are given."""

from __future__ import annotations

import json
import math
from dataclasses import replace
from itertools import combinations

import numpy as np
import pytest
import shapely
from core.localization.test_precision import (
    CORRIDOR,
    DEMO,
    FLAT,
    ROOM,
    SITES,
    THREE,
    YARD,
    rectangle,
    site_of,
)

from polepilot.core.errors import InputError
from polepilot.core.landmark import Landmark, LandmarkKind, spacing
from polepilot.core.localization import precision_suggest
from polepilot.core.localization.precision import PrecisionField
from polepilot.core.localization.precision_suggest import candidate_places, suggest
from polepilot.core.scenery import Scenery
from polepilot.core.site import Site


def with_poles(site: Site, places: list[tuple[float, float]]) -> list[Landmark]:
    free = [n for n in range(1, 16) if n not in site.landmarks_by_id()]
    new = [Landmark(n, *place) for n, place in zip(free, places, strict=False)]
    return [*site.landmarks, *new]


@pytest.mark.parametrize("site", [DEMO, CORRIDOR, YARD, FLAT, THREE], ids=lambda site: site.name)
def test_better_than_places_by_chance(site: Site) -> None:
    k = 3
    found = suggest(site, k)
    field = PrecisionField(site, resolution=found.before.resolution)
    rng = np.random.default_rng(2026)
    places = candidate_places(site)
    by_chance = [
        field.precision(
            with_poles(site, [places[i] for i in rng.choice(len(places), k, replace=False)])
        ).overall
        for _ in range(20)
    ]
    before, reached = found.before.overall, found.chosen[-1].overall
    assert reached < min(before, float(np.quantile(by_chance, 0.1)))
    assert before - reached > 1.25 * (before - np.mean(by_chance))
    steps = [before, *(one.overall for one in found.chosen)]
    assert steps == sorted(steps, reverse=True)


def test_bounds_hold_for_every_pair(monkeypatch: pytest.MonkeyPatch) -> None:
    """All sets of two of a few places, with the gain computed anew from whole matrices."""
    monkeypatch.setattr(precision_suggest, "MOST_PLACES", 10)
    for site in (ROOM, FLAT, THREE):
        found = suggest(site, 2, resolution=1.0)
        places = candidate_places(site)
        assert found.places == len(places) <= 10
        field = PrecisionField(site, resolution=1.0)
        settings = field.sweep.fix
        prior = np.diag([settings.max_position_sigma**-2] * 2 + [settings.max_heading_sigma**-2])

        def value(
            marks: list[Landmark], field: PrecisionField = field, prior: object = prior
        ) -> float:
            told = field.information(marks)[np.array([[0, 1, 3], [1, 2, 4], [3, 4, 5]])]
            matrices = told.transpose(2, 3, 0, 1)[field.possible] + prior
            return 0.5 * float(np.linalg.slogdet(matrices)[1].mean())

        empty = value(list(site.landmarks))
        sets = [with_poles(site, list(pair)) for pair in combinations(places, 2)]
        gains = [value(marks) - empty for marks in sets]
        errors = [field.precision(marks).overall for marks in sets]
        assert max(gains) <= found.gain_bound + 1e-9
        assert min(errors) >= found.overall_bound
        # Greedy is no worse than this share of the best; here poles may hide each other a little.
        assert found.gain >= (1 - 1 / math.e) * max(gains)
        assert found.gain <= found.gain_bound
        # A bound that is never near would be no use.
        assert found.gain > 0.6 * found.gain_bound


def test_places_are_out_of_the_way_and_in_sight() -> None:
    for site in SITES:
        places = candidate_places(site)
        assert 60 < len(places) <= precision_suggest.MOST_PLACES
        assert len(set(places)) == len(places)
        obstacles = Scenery(site.segments())
        for x, y in places:
            assert shapely.intersects_xy(site.floor(), x, y)
            assert 0.03 < obstacles.distance((x, y)) < 0.20
            for wall in site.walls:
                assert shapely.LineString(wall).distance(shapely.Point(x, y)) > 0.10
            assert all(math.dist((x, y), mark.position) >= 0.3 for mark in site.landmarks)


def test_ids_are_free_and_far_from_each_other() -> None:
    ids = [one.landmark.id for one in suggest(THREE, 4, resolution=1.0).chosen]
    assert len({1, 2, 4, *ids}) == 7
    assert spacing([1, 2, 4, *ids]) == 2
    # Where no such id is left, a near one is better than none.
    ids = [one.landmark.id for one in suggest(DEMO, 3, resolution=1.0).chosen]
    assert len({*DEMO.landmarks_by_id(), *ids}) == 11


def test_new_landmarks_look_like_the_others() -> None:
    kind = LandmarkKind(bits=5, segment=0.04)
    marks = tuple(replace(mark, kind=kind) for mark in ROOM.landmarks)
    (one,) = suggest(replace(ROOM, landmarks=marks), 1, resolution=1.0).chosen
    assert one.landmark.kind == kind


def test_a_site_without_landmarks() -> None:
    bare = site_of("bare", rectangle(6, 5), [])
    found = suggest(bare, 4, resolution=0.5)
    assert found.before.coverage == 0
    assert found.chosen[0].coverage == 0
    assert found.chosen[0].mean_position is None
    assert found.chosen[-1].coverage > 0.6
    json.dumps(found.to_json(), allow_nan=False)


@pytest.mark.parametrize(
    ("site", "k", "word"),
    [
        (ROOM, 0, "1 to 20"),
        (ROOM, 21, "1 to 20"),
        (ROOM, 10, "9 ids left"),
        (site_of("closet", rectangle(0.3, 0.3), [(1, 0.15, 0.15)]), 5, "places"),
    ],
)
def test_what_cannot_be_suggested(site: Site, k: int, word: str) -> None:
    with pytest.raises(InputError, match=word):
        suggest(site, k, resolution=0.25)
