"""The lens from pictures of a ChArUco board."""

from __future__ import annotations

import math
from dataclasses import replace

import cv2
import numpy as np
import pytest
from board_scenes import BOARD, CAMERA, LENS, VIEWS, board_picture, views

from polepilot.core.errors import InputError
from polepilot.core.vision.charuco import Board, BoardView, LensFit, find_board, fit_lens, judge
from polepilot.core.vision.lens import distort


@pytest.fixture(scope="module")
def seen() -> list[BoardView]:
    found = [find_board(image, BOARD, f"{n}.png") for n, image in enumerate(views())]
    return [view for view in found if view is not None]


@pytest.fixture(scope="module")
def answer(seen: list[BoardView]) -> LensFit:
    return fit_lens(seen)


def test_corners_are_where_the_board_has_them(seen: list[BoardView]) -> None:
    assert [len(view.pixels) for view in seen] == pytest.approx([BOARD.corners] * 10, abs=8)
    # The first one is seen from straight ahead: its corners follow from the lens alone.
    view = seen[0]
    middle = view.places[:, :2] - [BOARD.width / 2, BOARD.height / 2]
    half = np.array([0.5 * CAMERA.width, 0.5 * CAMERA.height])
    matrix = np.array([[610.0, 0, CAMERA.center_x], [0, 610.0, CAMERA.center_y], [0, 0, 1]])
    aim = cv2.undistortPoints(half[None, None], matrix, np.array(LENS)).ravel()
    tangents = middle / VIEWS[0][1] + aim
    expected = distort(tangents * 610.0 + [CAMERA.center_x, CAMERA.center_y], CAMERA)
    np.testing.assert_allclose(view.pixels, expected, atol=0.25)


def test_the_lens_is_found(answer: LensFit) -> None:
    camera = answer.camera
    assert (camera.width, camera.height) == (640, 480)
    assert camera.constant == pytest.approx(CAMERA.constant, rel=0.003)
    assert abs(camera.constant - CAMERA.constant) < 3 * answer.constant_error
    assert camera.center_x == pytest.approx(CAMERA.center_x, abs=1.5)
    assert camera.center_y == pytest.approx(CAMERA.center_y, abs=1.5)
    assert camera.distortion[0] == pytest.approx(LENS[0], abs=0.01)
    # What counts is where things are drawn: both cameras agree on it to a fraction of a pixel.
    tangents = np.stack(np.meshgrid(np.linspace(-0.5, 0.5, 9), np.linspace(-0.38, 0.38, 7)), -1)
    drawn = [
        distort(tangents * c.constant + [c.center_x, c.center_y], c) - [c.center_x, c.center_y]
        for c in (CAMERA, camera)
    ]
    np.testing.assert_allclose(drawn[0], drawn[1], atol=0.8)


def test_the_verdict_on_good_pictures(answer: LensFit) -> None:
    assert judge(answer).grade == "good"
    assert answer.rms < 0.2
    tilts = [math.degrees(result.tilt) for result in answer.views]
    turned = [math.hypot(*turn[:2]) for turn, _, _ in VIEWS]
    np.testing.assert_allclose(tilts, turned, atol=4)


def test_a_blurred_picture_is_left_out(seen: list[BoardView]) -> None:
    rng = np.random.default_rng(1)
    off = seen[3].pixels + rng.normal(0, 3, seen[3].pixels.shape)
    bad = BoardView("3.png", 640, 480, off, seen[3].places)
    answer = fit_lens([*seen[:3], bad, *seen[4:]])
    assert [result.view.name for result in answer.views if not result.used] == ["3.png"]
    assert answer.camera.constant == pytest.approx(CAMERA.constant, rel=0.003)
    assert any("3.png was left out" in note for note in judge(answer).notes)


@pytest.mark.parametrize(
    ("chosen", "expected"),
    [
        ([((0, 0, 0), 0.5, (0.5, 0.5))] * 3, "no tilt"),
        ([((0, 0, 0), 0.4 + 0.1 * n, (0.3 + 0.1 * n, 0.5)) for n in range(5)], "no tilt"),
        (
            [((25, 0, 0), 1.0, (0.5, 0.5)), ((0, 25, 0), 1.0, (0.5, 0.5)), VIEWS[0]],
            "small part|constant is known",
        ),
    ],
)
def test_views_that_say_too_little_are_not_believed(
    chosen: list[tuple[tuple[float, float, float], float, tuple[float, float]]], expected: str
) -> None:
    found = [find_board(board_picture(*view, seed=n), BOARD) for n, view in enumerate(chosen)]
    answer = fit_lens([view for view in found if view is not None])
    verdict = judge(answer)
    assert verdict.grade == "poor"
    if expected == "no tilt":
        assert "no tilt" in verdict.reason


def test_too_few_views(seen: list[BoardView]) -> None:
    with pytest.raises(InputError, match="2 of the pictures show enough of the board"):
        fit_lens(seen[:2])


@pytest.mark.parametrize("shape", [(300, 400), (1, 1, 3), (1, 1000), (240, 320, 3)])
def test_no_board(shape: tuple[int, ...]) -> None:
    assert find_board(np.full(shape, 90, np.uint8), BOARD) is None


def test_another_board_is_not_taken_for_ours() -> None:
    image = board_picture(*VIEWS[0])
    assert find_board(image, replace(BOARD, dictionary="6X6_250")) is None
    colour = cv2.cvtColor(image, cv2.COLOR_GRAY2BGR)
    both = find_board(image, BOARD), find_board(colour, BOARD)
    assert both[0] is not None
    assert both[1] is not None
    np.testing.assert_array_equal(both[0].pixels, both[1].pixels)


@pytest.mark.parametrize(
    ("board", "pixels"),
    [
        (Board(), 90),
        (Board(7, 5, 0.04, 0.02, "6x6_250"), 80),
        (Board(5, 8, 0.025, 0.020, "APRILTAG_36h11"), 100),
    ],
)
def test_black_rectangles_make_the_same_board(board: Board, pixels: int) -> None:
    """``pixels`` per square, so many that every module is a whole number of them."""
    drawn = board.draw(pixels)
    scale = pixels / board.square
    ours = np.full_like(drawn, 255)
    for left, top, width, height in board.black():
        first, last = round(top * scale), round((top + height) * scale)
        ours[first:last, round(left * scale) : round((left + width) * scale)] = 0
    np.testing.assert_array_equal(ours, drawn)


@pytest.mark.parametrize(
    ("changes", "expected"),
    [
        ({"columns": 2}, "2 x 6 squares: expected 3 to 100"),
        ({"square": 0.0}, "square is 0.0 m"),
        ({"square": math.nan}, "square is nan m"),
        ({"marker": 0.03}, "marker is 0.03 m"),
        ({"dictionary": "5"}, "dictionary is '5': expected one of"),
        ({"columns": 20, "rows": 20}, "needs 200 markers: 4X4_50 has 50"),
    ],
)
def test_impossible_boards(changes: dict[str, object], expected: str) -> None:
    with pytest.raises(InputError, match=expected):
        replace(BOARD, **changes)  # type: ignore[arg-type]
