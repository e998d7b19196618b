"""`polepilot bench vision`: the default detector beside OpenCV's ArUco, on the same pictures."""

from __future__ import annotations

import json
import time
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from polepilot.core.errors import InputError

if TYPE_CHECKING:
    from collections.abc import Callable

    from polepilot.core.observation import Image

app = typer.Typer(help="Measure speed.")

_PICTURES = (".png", ".jpg", ".jpeg", ".bmp", ".webp", ".tif", ".tiff")
_WARM_UP = 10
_ROUNDS = 5
_RENDERED = 60


@app.callback()
def main() -> None:
    """Measure speed."""


@app.command()
def vision(
    frames: Annotated[
        Path | None,
        typer.Option(metavar="DIR", help="Folder of pictures; default: rendered ones."),
    ] = None,
    as_json: Annotated[bool, typer.Option("--json", help="One JSON document.")] = False,
) -> None:
    """Median milliseconds per picture: ours, ArUco (DICT_4X4_50), and the ratio."""
    import cv2

    from polepilot.core.landmark import LandmarkKind
    from polepilot.core.vehicle import Camera
    from polepilot.core.vision.detector import LandmarkDetector

    cv2.setNumThreads(1)
    images = rendered_set() if frames is None else _folder(frames)
    source = "rendered (60 frames, seed 1)" if frames is None else str(frames)
    height, width = images[0].shape[:2]
    camera = Camera(width=width, height=height, center_x=(width - 1) / 2, center_y=(height - 1) / 2)
    ours = LandmarkDetector(camera, dict.fromkeys(range(1, 16), LandmarkKind()))
    aruco = cv2.aruco.ArucoDetector(cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_4X4_50))

    def find_markers(image: Image) -> object:
        grey = image if image.ndim == 2 else cv2.cvtColor(image, cv2.COLOR_BGR2GRAY)
        return aruco.detectMarkers(grey)

    ours_ms, aruco_ms = _interleaved(images, ours.detect, find_markers)
    document = {
        "frames": len(images),
        "ours_ms": ours_ms,
        "aruco_ms": aruco_ms,
        "ratio": ours_ms / aruco_ms,
        "source": source,
    }
    if as_json:
        typer.echo(json.dumps(document))
        return
    typer.echo(f"{len(images)} pictures, {source}; median per picture, one thread")
    typer.echo(f"ours  {ours_ms:7.3f} ms")
    typer.echo(f"ArUco {aruco_ms:7.3f} ms")
    typer.echo(f"ratio {ours_ms / aruco_ms:7.2f}")


def rendered_set(count: int = _RENDERED, seed: int = 1) -> list[Image]:
    """Pictures of a room with three landmarks at 2 to 8 m; always the same for a seed."""
    import math

    import numpy as np

    from polepilot.core.geometry import Point, Pose2D
    from polepilot.core.landmark import Landmark
    from polepilot.core.sim.render import Renderer
    from polepilot.core.vehicle import Camera

    rng = np.random.default_rng(seed)
    corners: list[Point] = [(-9.0, -9.0), (9.0, -9.0), (9.0, 9.0), (-9.0, 9.0)]
    walls = list(zip(corners, corners[1:] + corners[:1], strict=True))
    images = []
    for _ in range(count):
        marks = []
        for bearing in (-0.2, 0.0, 0.2):
            away, off = rng.uniform(2, 8), bearing + rng.uniform(-0.06, 0.06)
            number = int(rng.integers(1, 16))
            marks.append(Landmark(number, away * math.cos(off), away * math.sin(off)))
        renderer = Renderer(Camera(), marks, walls, rng)
        images.append(renderer.render(Pose2D(0.0, 0.0, 0.0), 0.0))
    return images


def _folder(folder: Path) -> list[Image]:
    from polepilot.core.vision.images import read_image

    if not folder.is_dir():
        raise InputError(f"--frames {folder}: expected a folder of pictures.")
    files = sorted(file for file in folder.iterdir() if file.suffix.lower() in _PICTURES)
    if not files:
        raise InputError(f"--frames {folder}: holds no picture ({', '.join(_PICTURES)}).")
    return [read_image(file) for file in files]


def _interleaved(
    images: list[Image], first: Callable[[Image], object], second: Callable[[Image], object]
) -> tuple[float, float]:
    """Median milliseconds per picture of both, taking turns so that both meet the same load."""
    import statistics

    for index in range(_WARM_UP):
        first(images[index % len(images)])
        second(images[index % len(images)])
    rounds = _ROUNDS if len(images) * _ROUNDS <= 2000 else 1
    taken: tuple[list[float], list[float]] = ([], [])
    for _ in range(rounds):
        for image in images:
            for work, times in zip((first, second), taken, strict=True):
                start = time.perf_counter()
                work(image)
                times.append((time.perf_counter() - start) * 1e3)
    return statistics.median(taken[0]), statistics.median(taken[1])
