"""Sites: what is read, what is mended, what is refused and where."""

from __future__ import annotations

import json
import math
import time
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from shapely import Polygon

from polepilot.core.errors import SiteError
from polepilot.core.site import Site, parse_site, read_site

DEMO = Path(__file__).parents[2] / "polepilot" / "demo" / "workshop.json"
SQUARE = [[0, 0], [4, 0], [4, 4], [0, 4]]
NAN, INF = float("nan"), float("inf")


def mark(**changes: Any) -> dict[str, Any]:
    return {"id": 1, "x": 1, "y": 1, **changes}


def test_demo_reads_and_writes_the_same() -> None:
    site = read_site(DEMO)
    assert len(site.landmarks) == 8
    assert site.repairs == ()
    assert parse_site(site.to_json(), "json") == site
    assert parse_site(json.loads(json.dumps(site.to_geojson())), "geojson") == site


def test_only_a_boundary_is_needed() -> None:
    site = parse_site({"boundary": SQUARE}, "s")
    assert site == Site(boundary=((0, 0), (4, 0), (4, 4), (0, 4)))


def test_a_route_may_say_how_to_stand_at_its_end() -> None:
    route = {"name": "a", "nodes": [[1, 1], [2, 2]], "heading": 4.0}
    site = parse_site({"boundary": SQUARE, "routes": [route]}, "s")
    assert site.routes[0].heading == pytest.approx(4.0 - math.tau)
    assert parse_site(site.to_json(), "json") == site
    assert parse_site(json.loads(json.dumps(site.to_geojson())), "geojson") == site


def test_rings_are_turned_counter_clockwise() -> None:
    site = parse_site({"boundary": SQUARE[::-1], "islands": [[[1, 1], [1, 2], [2, 1]]]}, "s")
    assert Polygon(site.boundary).exterior.is_ccw
    assert Polygon(site.islands[0]).exterior.is_ccw


@pytest.mark.parametrize(
    ("document", "words"),
    [
        ([], "the site is a list"),
        ({}, "boundary is missing"),
        ({"boundary": SQUARE, "wals": []}, "'wals'"),
        ({"boundary": "room"}, "boundary is the text 'room'"),
        ({"boundary": SQUARE[:2]}, "boundary has 2 points: expected at least 3"),
        ({"boundary": [[0, 0], [1, 0, 2], [1, 1]]}, "boundary[1] has 3 numbers"),
        ({"boundary": [[0, 0], [NAN, 0], [1, 1]]}, "boundary[1][0] is nan"),
        ({"boundary": [[0, 0], [INF, 0], [1, 1]]}, "boundary[1][0] is inf"),
        ({"boundary": [[0, 0], [10**400, 0], [1, 1]]}, "boundary[1][0] is too large"),
        ({"boundary": [[0, 0], [2e5, 0], [1, 1]]}, "boundary[1][0] is 200000"),
        ({"boundary": [[0, 0], [True, 0], [1, 1]]}, "boundary[1][0] is true"),
        ({"boundary": [[0, 0], [1, 0], [2, 0]]}, "boundary encloses no area"),
        ({"boundary": [[0, 0], [1e-3, 0], [0, 1e-3]]}, "boundary encloses no area"),
        ({"boundary": SQUARE, "islands": [[[1, 1], [2, 2]]]}, "islands[0] has 2 points"),
        ({"boundary": SQUARE, "islands": [[[1, 1], [3, 3], [3, 1], [1, 3]]]}, "islands[0] crosses"),
        ({"boundary": SQUARE, "islands": [[[-1, -1], [5, -1], [5, 5], [-1, 5]]]}, "leave no floor"),
        ({"boundary": SQUARE, "walls": [[[1, 1]]]}, "walls[0] has 1 different points"),
        ({"boundary": SQUARE, "walls": [[[1, 1], [1, 1]]]}, "walls[0] has 1 different points"),
        ({"boundary": SQUARE, "landmarks": [mark(), mark(x=2)]}, "landmarks[1].id is 1"),
        ({"boundary": SQUARE, "landmarks": [mark(id=16)]}, "does not fit into 4 bits"),
        ({"boundary": SQUARE, "landmarks": [mark(id=1.5)]}, "expected a whole number"),
        ({"boundary": SQUARE, "landmarks": [mark(bits=7)]}, "bits is 7"),
        ({"boundary": SQUARE, "landmarks": [mark(shape="cube")]}, "shape is 'cube'"),
        ({"boundary": SQUARE, "landmarks": [{"id": 1, "x": 1}]}, "landmarks[0].y is missing"),
        ({"boundary": SQUARE, "landmarks": [mark(colour="red")]}, "'colour'"),
        ({"boundary": SQUARE, "routes": [{"name": "", "nodes": [[1, 1]]}]}, "name is empty"),
        ({"boundary": SQUARE, "routes": [{"name": "a", "nodes": []}]}, "routes[0].nodes has 0"),
        ({"boundary": SQUARE, "routes": [{"name": "a", "nodes": [[1, 1]]}] * 2}, "is 'a', as in"),
        (
            {"boundary": SQUARE, "routes": [{"name": "a", "nodes": [[1, 1]], "heading": "up"}]},
            "routes[0].heading is the text 'up'",
        ),
        ({"boundary": SQUARE, "start": [1]}, "start has 1 numbers"),
        ({"boundary": SQUARE, "start": [1, 1, NAN]}, "start[2] is nan"),
        ({"type": "FeatureCollection", "features": []}, "no feature has the role 'boundary'"),
        ({"type": "FeatureCollection"}, "features is null"),
    ],
)
def test_refused_with_the_field(document: Any, words: str) -> None:
    with pytest.raises(SiteError) as caught:
        parse_site(document, "s.json")
    assert str(caught.value).startswith("s.json: ")
    assert words in str(caught.value)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("document", "where"),
    [
        ({"boundary": [[0, 0], [4, 4], [4, 0], [0, 4]]}, (2, 2)),
        ({"boundary": SQUARE, "islands": [[[5, 5], [6, 5], [6, 6]]]}, (5, 5)),
        ({"boundary": SQUARE, "start": [9, 9]}, (9, 9)),
        (
            {"boundary": SQUARE, "islands": [[[1, 1], [3, 1], [3, 3], [1, 3]]], "start": [2, 2]},
            (2, 2),
        ),
    ],
)
def test_refused_with_the_place(document: Any, where: tuple[float, float]) -> None:
    with pytest.raises(SiteError) as caught:
        parse_site(document, "s.json")
    assert caught.value.where == pytest.approx(where)
    assert f"({where[0]:.2f}, {where[1]:.2f})" in str(caught.value)


def test_repeated_points_are_dropped_and_said() -> None:
    site = parse_site({"boundary": [[0, 0], [0, 0], [4, 0], [4, 4], [0, 4], [0, 0]]}, "s")
    assert len(site.boundary) == 4
    assert site.repairs == ("boundary: a repeated point at (0.00, 0.00) was dropped.",)


@pytest.mark.parametrize(
    "ring",
    [
        [[0, 0], [2, 0], [2, 2], [4, 2], [4, 4], [2, 4], [2, 2], [0, 2]],  # two rooms, one point
        [[0, 0], [4, 0], [4, 4], [2, 0], [0, 4]],  # a corner on a wall
    ],
)
def test_a_boundary_that_touches_itself_is_mended(ring: list[list[float]]) -> None:
    site = parse_site({"boundary": ring}, "s")
    assert Polygon(site.boundary).is_valid
    assert Polygon(site.boundary).area == pytest.approx(8, abs=0.01)
    assert any("touches itself" in repair for repair in site.repairs)


def test_overlaps_are_kept_and_said() -> None:
    islands = [[[3, 3], [6, 3], [6, 6]], [[3.5, 3.3], [3.9, 3], [3, 4]]]
    site = parse_site({"boundary": SQUARE, "islands": islands}, "s")
    assert any("reaches over the boundary" in repair for repair in site.repairs)
    assert any("islands[0] and islands[1]: overlap" in repair for repair in site.repairs)
    assert site.floor().area < 16


def test_no_go_areas_are_floor_to_see_across_but_not_to_drive_on() -> None:
    carpet = [[1, 1], [1, 3], [3, 3], [3, 1]]
    site = parse_site({"boundary": SQUARE, "no_go": [carpet], "landmarks": [mark(x=2, y=2)]}, "s")
    assert site.repairs == ()
    assert Polygon(site.no_go[0]).exterior.is_ccw
    assert site.floor().area == pytest.approx(12)
    assert len(site.segments()) == 4
    assert parse_site(site.to_json(), "json") == site
    assert parse_site(json.loads(json.dumps(site.to_geojson())), "geojson") == site
    assert "no_go" not in parse_site({"boundary": SQUARE}, "s").to_json()


@pytest.mark.parametrize(
    ("more", "words"),
    [
        ({"no_go": [[[1, 1], [2, 2]]]}, "no_go[0] has 2 points"),
        ({"no_go": [[[1, 1], [3, 3], [3, 1], [1, 3]]]}, "no_go[0] crosses itself at (2.00, 2.00)"),
        ({"no_go": [[[-1, -1], [5, -1], [5, 5], [-1, 5]]]}, "no_go leaves no floor"),
        ({"no_go": [SQUARE], "start": [2, 2]}, "no_go leaves no floor"),
        ({"no_go": [[[1, 1], [3, 1], [2, 3]]], "start": [2, 2]}, "start (2.00, 2.00) is not on"),
    ],
)
def test_no_go_areas_that_cannot_be(more: Any, words: str) -> None:
    with pytest.raises(SiteError) as caught:
        parse_site({"boundary": SQUARE, **more}, "s")
    assert words in str(caught.value)


def test_a_no_go_area_outside_is_said_to_change_nothing() -> None:
    site = parse_site({"boundary": SQUARE, "no_go": [[[5, 5], [6, 5], [6, 6]]]}, "s")
    assert site.repairs == (
        "no_go[0]: lies outside the floor at (5.00, 5.00); it changes nothing.",
    )
    assert site.floor().area == pytest.approx(16)


def test_geojson_of_other_programs_is_read() -> None:
    document = {
        "type": "FeatureCollection",
        "features": [
            {
                "type": "Feature",
                "properties": {"role": "boundary", "stroke": "#fff"},
                "geometry": {
                    "type": "Polygon",
                    "coordinates": [
                        [[0, 0, 7], [4, 0, 7], [4, 4, 7], [0, 4, 7], [0, 0, 7]],
                        [[1, 1], [2, 1], [2, 2], [1, 1]],
                    ],
                },
            },
            {
                "type": "Feature",
                "properties": {"role": "start"},
                "geometry": {"type": "Point", "coordinates": [3, 3]},
            },
        ],
    }
    site = parse_site(document, "g")
    assert site.boundary == ((0, 0), (4, 0), (4, 4), (0, 4))
    assert len(site.islands) == 1
    assert site.start is not None
    assert site.start.heading is None
    document["features"].append({"type": "Feature", "properties": {"role": "moat"}, "geometry": {}})
    with pytest.raises(SiteError, match="moat"):
        parse_site(document, "g")


def test_geojson_nested_without_end_is_refused() -> None:
    nested: Any = [1.0, 1.0]
    for _ in range(900):
        nested = [nested]
    feature = {
        "type": "Feature",
        "properties": {"role": "wall"},
        "geometry": {"type": "LineString", "coordinates": nested},
    }
    document = {"type": "FeatureCollection", "features": [feature]}
    with pytest.raises(SiteError, match=r"features\[0\]\.coordinates has lists within points"):
        parse_site(document, "deep")


def test_files_that_are_no_sites(tmp_path: Path) -> None:
    missing = tmp_path / "no.json"
    with pytest.raises(SiteError, match=r"no\.json: cannot be read"):
        read_site(missing)
    bad = tmp_path / "bad.json"
    bad.write_text('{"boundary": [', encoding="utf-8")
    with pytest.raises(SiteError, match="is no JSON at line 1"):
        read_site(bad)
    bad.write_bytes(b"\xff\xfe\x00")
    with pytest.raises(SiteError, match="is no text"):
        read_site(bad)
    bad.write_text("[" * 100_000, encoding="utf-8")
    with pytest.raises(SiteError, match="is no JSON"):
        read_site(bad)


def test_thousands_of_points_are_quick() -> None:
    angles = np.arange(10_000) * math.tau / 10_000
    radius = 20 + np.sin(40 * angles)
    ring = np.stack([radius * np.cos(angles), radius * np.sin(angles)], axis=1).tolist()
    began = time.perf_counter()
    site = parse_site({"boundary": ring}, "s")
    assert len(site.boundary) == 10_000
    assert time.perf_counter() - began < 3.0  # 0.1 s on an idle machine


_json = st.recursive(
    st.none() | st.booleans() | st.floats() | st.integers() | st.text(max_size=5),
    lambda inner: (
        st.lists(inner, max_size=4)
        | st.dictionaries(
            st.sampled_from(
                ["boundary", "islands", "walls", "no_go", "landmarks", "start", "id", "x", "name"]
            ),
            inner,
            max_size=4,
        )
    ),
    max_leaves=12,
)
_coordinate = st.integers(-3, 3) | st.floats(-3, 3)
_ring = st.lists(st.tuples(_coordinate, _coordinate).map(list), max_size=8)


@settings(deadline=None, max_examples=200)
@given(
    st.fixed_dictionaries(
        {"boundary": _ring | _json},
        optional={
            "islands": st.lists(_ring, max_size=3) | _json,
            "walls": st.lists(_ring, max_size=2) | _json,
            "no_go": st.lists(_ring, max_size=2) | _json,
            "start": _json,
        },
    )
)
def test_any_document_is_a_sound_site_or_refused(document: Any) -> None:
    try:
        site = parse_site(document, "s")
    except SiteError:
        return
    assert Polygon(site.boundary).is_valid
    assert Polygon(site.boundary).exterior.is_ccw
    assert all(Polygon(ring).is_valid for ring in site.islands)
    again = parse_site(site.to_json(), "s")
    assert again == site


def test_an_island_that_is_the_boundary_but_for_the_last_digits() -> None:
    """What a program writes that scales an outline by one: the difference of the two is empty."""
    ring = [[0.65, 3.8], [0.58986, 4.10232], [0.41861, 4.35861], [0.16232, 4.52986], [-0.14, 4.59]]
    ring += [[-0.44232, 4.52986], [-0.69861, 4.35861], [-0.86986, 4.10232], [-0.93, 3.8]]
    ring += [[-0.86986, 3.49768], [-0.69861, 3.24139], [-0.44232, 3.07014], [-0.14, 3.01]]
    ring += [[0.16232, 3.07014], [0.41861, 3.24139], [0.58986, 3.49768]]
    middle = np.array(ring).mean(axis=0)
    island = (middle + (np.array(ring) - middle)).tolist()
    assert not Polygon(ring).covers(Polygon(island))
    with pytest.raises(SiteError, match="leave no floor"):
        parse_site({"boundary": ring, "islands": [island]}, "s")
