from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from vision_scenes import CAMERA, HERE, picture, pole, room

from polepilot.core.geometry import Pose2D
from polepilot.core.sim.render import Look, Renderer

CLEAN = Look(noise=0.0, blur=0.0, vignetting=0.0)


def orange(image: np.ndarray) -> np.ndarray:
    wide = image.astype(int)
    return wide[:, :, 2] - wide[:, :, 0] > 90


def test_shape_and_determinism() -> None:
    one, two = (picture([pole(5, 3.0, 0.1)], seed=4) for _ in range(2))
    assert one.shape == (300, 400, 3)
    assert one.dtype == np.uint8
    assert np.array_equal(one, two)
    assert not np.array_equal(one, picture([pole(5, 3.0, 0.1)], seed=5))


def test_noise_differs_from_frame_to_frame() -> None:
    renderer = Renderer(CAMERA, [], room(5.0), np.random.default_rng(0), Look(noise=2.0))
    difference = renderer.render(HERE, 0.0).astype(int) - renderer.render(HERE, 0.0)
    assert difference.std() == pytest.approx(2.0 * math.sqrt(2), rel=0.1)


def test_a_pole_is_where_perspective_puts_it() -> None:
    away, bearing = 3.0, 0.1
    rows, columns = np.nonzero(orange(picture([pole(13, away, bearing)], look=CLEAN)))
    scale = CAMERA.constant / ((away - 0.035) * math.cos(bearing))
    assert rows.min() == pytest.approx(CAMERA.center_y - 0.25 * scale, abs=1.5)
    assert rows.max() == pytest.approx(CAMERA.center_y + 0.40 * scale, abs=1.5)
    middle = CAMERA.center_x - CAMERA.constant * math.tan(bearing)
    assert (columns.min() + columns.max()) / 2 == pytest.approx(middle, abs=1.0)
    assert columns.max() - columns.min() + 1 == pytest.approx(600 * 0.07 / away, abs=2.0)


def test_the_picture_depends_on_the_relative_pose_only() -> None:
    here = picture([pole(13, 3.0, 0.1)], look=CLEAN)
    turned = Pose2D(0.0, 0.0, 0.0)
    renderer = Renderer(CAMERA, [pole(13, 3.0, 0.1)], room(20.0), np.random.default_rng(0), CLEAN)
    assert np.array_equal(orange(here), orange(renderer.render(turned, 0.0)))
    left = renderer.render(Pose2D(0.0, 0.0, -0.05), 0.0)
    assert np.nonzero(orange(left))[1].mean() < np.nonzero(orange(here))[1].mean() - 20


@pytest.mark.parametrize("rate", [-1.0, 1.0])
def test_rolling_shutter_leans_the_pole(rate: float) -> None:
    look = replace(CLEAN, ambient=1.0)
    image = orange(picture([pole(13, 2.2, 0.0)], look=look, pan_rate=rate))
    rows = np.flatnonzero(image.any(axis=1))
    centre = np.array([np.flatnonzero(image[row]).mean() for row in rows])
    slope = np.polyfit(rows, centre, 1)[0]
    # Turning left, what stands still moves to the right while the rows are read out.
    assert slope == pytest.approx(600 * rate * CLEAN.readout / 300, rel=0.1)
    assert np.interp(149.5, rows, centre) == pytest.approx(199.5, abs=0.5)


def test_walls_hide_poles_but_not_those_that_stand_at_them() -> None:
    before = [((2.0, -3.0), (2.0, 3.0))]
    assert not orange(picture([pole(13, 4.0, 0.0)], walls=before)).any()
    at_the_wall = [((4.0, -3.0), (4.0, 3.0))]
    assert orange(picture([pole(13, 4.0, 0.0)], walls=at_the_wall)).any()
    half = [((2.0, -3.0), (2.0, 0.0))]
    columns = np.nonzero(orange(picture([pole(13, 4.0, 0.0)], walls=half)))[1]
    assert columns.max() <= 200


def test_nearer_poles_hide_farther_ones() -> None:
    near, far = pole(1, 2.0, 0.0), pole(15, 4.0, 0.0)
    alone = picture([near], look=CLEAN)
    for order in ([near, far], [far, near]):
        both = picture(order, look=CLEAN)
        assert np.array_equal(both[80:260, 195:205], alone[80:260, 195:205])


def test_people_are_seen_and_hide_poles() -> None:
    renderer = Renderer(CAMERA, [pole(13, 4.0, 0.0)], room(9.0), np.random.default_rng(0), CLEAN)
    free = renderer.render(HERE, 0.0)
    blocked = renderer.render(HERE, 0.0, [((2.0, 0.0), 0.25)])
    assert orange(free).any()
    assert not orange(blocked).any()
    behind = renderer.render(HERE, 0.0, [((6.0, 0.0), 0.25)])
    assert orange(behind).sum() == pytest.approx(orange(free).sum(), rel=0.05)


def test_close_to_and_behind_things() -> None:
    rng = np.random.default_rng(0)
    poles = [pole(3, 0.03, 0.0), pole(4, 0.3, 3.0), pole(5, 0.4, 0.2)]
    renderer = Renderer(CAMERA, poles, [], rng)
    image = renderer.render(HERE, 0.5, [((0.1, 0.0), 0.25), ((-1.0, 0.0), 0.3)])
    assert image.shape == (300, 400, 3)
    assert Renderer(CAMERA, [], [], rng).render(HERE, 0.0).std() > 0
