"""Makes the pictures of docs/calibration.md, from tests/: ``python -m bench.calibration_pictures``.

What the commands draw, over pictures whose truth is known: landmark 13 at 2.5, 4 and 6 metres seen
by a camera with C = 610, one distance mistaken by 10 cm, and six views of the board.
"""

from __future__ import annotations

import os
import tempfile
from pathlib import Path

import board_scenes
import cv2
import numpy as np
from vision_scenes import HERE, pole, room

from polepilot.commands.main import run
from polepilot.core.sim.render import Look, Renderer
from polepilot.core.vehicle import Camera

IMAGES = Path(__file__).resolve().parents[2] / "docs" / "images"
_WIDTH = 1000


def main() -> None:
    """Draw both pictures."""
    with tempfile.TemporaryDirectory() as name:
        os.chdir(name)
        _constant(IMAGES / "calibrate-camera.png")
        _lens(IMAGES / "calibrate-board.png")


def _constant(out: Path) -> None:
    camera, words = Camera(constant=610.0), []
    for seed, (away, bearing, said) in enumerate(
        [(2.5, 0.12, 2.5), (4.0, -0.2, 4.1), (6.0, 0.05, 6.0)]
    ):
        renderer = Renderer(
            camera,
            [pole(13, away, bearing)],
            room(20.0),
            np.random.default_rng(seed),
            Look(noise=0),
        )
        file = f"{'abc'[seed]}.png"
        cv2.imwrite(file, renderer.render(HERE, 0.0))
        words += [file, "--distance", f"{file}={said}"]
    run(["calibrate", "camera", *words, "--annotate", "out.png"])
    _shrink("out.png", out)


def _lens(out: Path) -> None:
    files = []
    for number, (turn, away, aim) in enumerate(board_scenes.VIEWS[:6]):
        files.append(f"board{number}.png")
        cv2.imwrite(files[-1], board_scenes.board_picture(turn, away, aim, noise=0.0))
    run(["calibrate", "camera", "--board", *files, "--annotate", "out.png"])
    _shrink("out.png", out)


def _shrink(drawn: str, out: Path) -> None:
    picture = cv2.imread(drawn)
    assert picture is not None
    height = round(picture.shape[0] * _WIDTH / picture.shape[1])
    small = cv2.resize(picture, (_WIDTH, height), interpolation=cv2.INTER_AREA)
    cv2.imwrite(str(out), small, [cv2.IMWRITE_PNG_COMPRESSION, 9])


if __name__ == "__main__":
    main()
