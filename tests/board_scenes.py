"""Pictures of a ChArUco board through a lens that bends, for the tests of calibration."""

from __future__ import annotations

from functools import lru_cache

import cv2
import numpy as np
from numpy.typing import NDArray

from polepilot.core.observation import Image
from polepilot.core.vehicle import Camera
from polepilot.core.vision.charuco import Board

BOARD = Board()
LENS = (-0.21, 0.06, 0.0008, -0.0006, 0.0)
CAMERA = Camera(
    constant=610.0, width=640, height=480, center_x=324.0, center_y=236.5, distortion=LENS
)
_FINE = 3
_PRECISELY = (cv2.TERM_CRITERIA_COUNT | cv2.TERM_CRITERIA_EPS, 40, 1e-9)
_PIXELS = 60


def board_picture(
    turn: tuple[float, float, float],
    away: float,
    aim: tuple[float, float] = (0.5, 0.5),
    seed: int = 0,
    *,
    camera: Camera = CAMERA,
    board: Board = BOARD,
    noise: float = 2.0,
) -> Image:
    """The board's middle ``away`` metres along the ray through ``aim`` (share of the picture).

    ``turn`` is the board's rotation vector, degrees. Every pixel is followed back through the lens
    by OpenCV, so that nothing of ours draws what is tested.
    """
    matrix = _matrix(camera)
    rays = _rays(camera)
    rotation = cv2.Rodrigues(np.radians(np.array(turn, np.float64)))[0]
    spot = np.array([[[aim[0] * camera.width, aim[1] * camera.height]]], np.float64)
    x, y = cv2.undistortPoints(spot, matrix, np.array(camera.distortion)).ravel()
    centre = away * np.array([x, y, 1.0])
    normal = rotation[:, 2]
    depth = (normal @ centre) / (rays @ normal)
    local = (rays * depth[..., None] - centre) @ rotation
    size = np.array([board.width, board.height])
    places = ((local[..., :2] + size / 2) / board.square * _PIXELS - 0.5).astype(np.float32)
    sheet = cv2.copyMakeBorder(
        board.draw(_PIXELS), _PIXELS, _PIXELS, _PIXELS, _PIXELS, cv2.BORDER_CONSTANT, value=(255,)
    )
    shown = cv2.remap(
        sheet,
        places + _PIXELS,
        None,
        cv2.INTER_LINEAR,
        borderMode=cv2.BORDER_CONSTANT,
        borderValue=(110,),
    )
    small = cv2.resize(shown, (camera.width, camera.height), interpolation=cv2.INTER_AREA)
    grain = noise * np.random.default_rng(seed).normal(0, 1, small.shape)
    return np.clip(20 + 0.8 * small + grain, 0, 255).astype(np.uint8)


def _matrix(camera: Camera) -> NDArray[np.float64]:
    return np.array(
        [[camera.constant, 0, camera.center_x], [0, camera.constant, camera.center_y], [0, 0, 1]]
    )


@lru_cache(maxsize=2)
def _rays(camera: Camera) -> NDArray[np.float64]:
    """Tangents (and 1) of every fine pixel, rows x columns x 3."""
    columns = (np.arange(camera.width * _FINE) + 0.5) / _FINE - 0.5
    rows = (np.arange(camera.height * _FINE) + 0.5) / _FINE - 0.5
    grid = np.stack(np.meshgrid(columns, rows), axis=-1).reshape(-1, 1, 2)
    tangents = cv2.undistortPoints(
        grid, _matrix(camera), np.array(camera.distortion), criteria=_PRECISELY
    ).reshape(-1, 2)
    whole = np.column_stack([tangents, np.ones(len(tangents))])
    return whole.reshape(len(rows), len(columns), 3)


VIEWS: tuple[tuple[tuple[float, float, float], float, tuple[float, float]], ...] = (
    ((0, 0, 0), 0.35, (0.5, 0.5)),
    ((25, 5, 3), 0.40, (0.35, 0.35)),
    ((-28, 0, -4), 0.40, (0.65, 0.65)),
    ((0, 30, 0), 0.42, (0.35, 0.65)),
    ((5, -32, 8), 0.42, (0.65, 0.35)),
    ((20, 22, 0), 0.36, (0.5, 0.5)),
    ((-22, -18, 10), 0.55, (0.25, 0.3)),
    ((15, -25, -90), 0.50, (0.75, 0.7)),
    ((-30, 15, 0), 0.48, (0.7, 0.3)),
    ((18, 30, 5), 0.48, (0.3, 0.72)),
)
"""Turn (degrees), distance and place of ten views from which a lens can be told."""


def views(seed: int = 0, camera: Camera = CAMERA) -> list[Image]:
    """Ten pictures, tilted to all sides, that reach into the corners."""
    return [
        board_picture(turn, away, aim, seed + index, camera=camera)
        for index, (turn, away, aim) in enumerate(VIEWS)
    ]
