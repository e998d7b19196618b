"""Bands along lines against what a disc sweeps chord by chord."""

from __future__ import annotations

import numpy as np
import pytest
import shapely

from polepilot.core.planning.bands import bands_of
from polepilot.core.planning.swept import swept_shape

RADIUS = 0.2
TURNS = (0.0, 0.1, -0.1, 0.3, -0.3, 1.5, 3.14159265)


def _line(seed: int) -> np.ndarray:
    """Corners anywhere, or short steps with gentle and sharp turns, some of them right back."""
    rng = np.random.default_rng(seed)
    count = int(rng.integers(2, 40))
    if seed % 2:
        return rng.uniform(0, 4, (count, 2))
    headings = np.cumsum(rng.choice(TURNS, count))
    steps = rng.uniform(0.01, 0.3, count)[:, None]
    return np.cumsum(steps * np.stack([np.cos(headings), np.sin(headings)], axis=1), axis=0)


@pytest.mark.parametrize("seed", range(60))
def test_bands_are_what_the_disc_sweeps(seed: int) -> None:
    line = _line(seed)
    bands = bands_of([line], RADIUS, 16, 0.0001)
    assert shapely.is_valid(bands.shapes).all()
    exact = swept_shape(line, 2 * RADIUS, 64)
    united = shapely.union_all(bands.shapes)
    assert united.symmetric_difference(exact).area < 0.002 * exact.area
    capsules = shapely.union_all(bands.capsules(np.arange(len(bands.shapes)), 64))
    assert capsules.symmetric_difference(exact).area < 0.002 * exact.area


def test_an_arc_is_few_bands() -> None:
    angles = np.linspace(0, 3 * np.pi / 2, 200)
    arc = np.stack([np.cos(angles), np.sin(angles)], axis=1)
    bands = bands_of([arc], RADIUS, 16, 0.0001)
    assert len(bands.shapes) < 10
    ring = shapely.Point(0, 0).buffer(1.2, 256).difference(shapely.Point(0, 0).buffer(0.8, 256))
    assert shapely.union_all(bands.shapes).difference(ring.buffer(1e-3)).area < RADIUS**2 * 3.2


def _seen(line: np.ndarray, box: shapely.Polygon) -> np.ndarray:
    bands = bands_of([line], RADIUS, 8, 0.0001)
    near = np.flatnonzero(shapely.distance(bands.tracks, box) <= RADIUS)
    low, high = np.hsplit(np.tile(shapely.bounds(box), (len(near), 1)), 2)
    keys = bands.keys_near(near, low, high)
    return keys[np.lexsort(keys.T)]


def test_what_changes_far_away_changes_no_keys() -> None:
    box = shapely.box(2, 0, 3, 1)
    line = np.array([[0.0, 0.5], [6.0, 0.5], [6.0, 3.0]])
    cut = np.array([[0.0, 0.5], [1.2, 0.5], [1.2, -1.0], [1.3, 0.5], [6.0, 0.5]])
    assert _seen(cut, box) == pytest.approx(_seen(line, box), abs=1e-9)
    bumped = np.array([[0.0, 0.5], [2.5, 0.5], [2.6, 0.6], [2.7, 0.5], [6.0, 0.5], [6.0, 3.0]])
    assert len(_seen(bumped, box)) != len(_seen(line, box))
    corner = np.array([[0.0, 0.5], [3.1, 0.5], [3.1, 3.0]])
    straight_on = np.array([[0.0, 0.5], [3.1, 0.5], [6.0, 0.5]])
    assert _seen(corner, box).shape != _seen(straight_on, box).shape


def test_a_bend_in_between_has_a_key_of_its_own() -> None:
    box = shapely.box(-2, -2, 2, 2)
    bend = np.array([[-1.0, 0.0], [-0.5, 0.05], [0.5, 0.05], [1.0, 0.0]])
    other = np.array([[-1.0, 0.0], [-0.4, 0.05], [0.4, 0.05], [1.0, 0.0]])
    assert not np.allclose(_seen(bend, box), _seen(other, box))


def test_a_point_is_a_disc() -> None:
    bands = bands_of([np.array([[1.0, 2.0]])], RADIUS, 32, 0.001)
    assert shapely.union_all(bands.shapes).area == pytest.approx(np.pi * RADIUS**2, rel=0.001)
