"""`polepilot bench vision`: the default detector beside OpenCV's ArUco, on the same pictures."""

from __future__ import annotations

import json
import statistics
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from polepilot.core.errors import ImageError, InputError

if TYPE_CHECKING:
    from polepilot.core.observation import Image

app = typer.Typer(help="Measure speed.")

_PICTURES = (
    *(".png", ".jpg", ".jpeg", ".jpe", ".bmp", ".dib", ".webp", ".tif", ".tiff", ".gif"),
    *(".ppm", ".pgm", ".pbm", ".pnm"),
)
_WARM_UP = 10
_ROUNDS = 5
_ONCE = 400
"""A batch of more pictures than this is looked at once instead of ``_ROUNDS`` times."""
_BATCH = 256 * 2**20
"""Bytes of decoded pictures that are held in memory together."""
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

    cv2.setNumThreads(1)
    duel = Duel()
    if frames is None:
        source = f"{_RENDERED} pictures rendered by the simulator"
        duel.add(rendered_set())
    else:
        source = str(frames)
        for batch in _batches(picture_files(frames)):
            duel.add(batch)
    ours_ms, aruco_ms = statistics.median(duel.ours), statistics.median(duel.aruco)
    document = {
        "frames": duel.frames,
        "ours_ms": ours_ms,
        "aruco_ms": aruco_ms,
        "ratio": ours_ms / aruco_ms,
        "source": source,
    }
    if as_json:
        typer.echo(json.dumps(document))
        return
    typer.echo(f"{duel.frames} pictures ({source}), median per picture, one thread")
    typer.echo(f"ours  {ours_ms:7.3f} ms")
    typer.echo(f"ArUco {aruco_ms:7.3f} ms")
    typer.echo(f"ratio {ours_ms / aruco_ms:7.2f}")


@dataclass(slots=True)
class Duel:
    """Times of both detectors, milliseconds, one entry per look at a picture."""

    ours: list[float] = field(default_factory=list)
    aruco: list[float] = field(default_factory=list)
    frames: int = 0

    def add(self, images: Sequence[Image]) -> None:
        """Both look at decoded pictures, taking turns so that both meet the same load.

        A detector of ours belongs to one size of picture: the optical axis is in its middle.
        Whoever comes second finds the picture in the processor's cache, so they take turns at that
        as well.
        """
        ours, aruco = _ours(images), _aruco()
        if not self.frames:
            for index in range(_WARM_UP):
                image = images[index % len(images)]
                ours[image.shape[:2]](image)
                aruco(image)
        for turn in range(_ROUNDS if len(images) <= _ONCE else 1):
            for index, image in enumerate(images):
                ours_here = ours[image.shape[:2]]
                if (index + turn) % 2:
                    self.aruco.append(_milliseconds(aruco, image))
                    self.ours.append(_milliseconds(ours_here, image))
                else:
                    self.ours.append(_milliseconds(ours_here, image))
                    self.aruco.append(_milliseconds(aruco, image))
        self.frames += len(images)


def _milliseconds(work: Callable[[Image], object], image: Image) -> float:
    start = time.perf_counter()
    work(image)
    return (time.perf_counter() - start) * 1e3


def _ours(images: Sequence[Image]) -> dict[tuple[int, ...], Callable[[Image], object]]:
    """The default detector for every size among the pictures."""
    from polepilot.core.landmark import LandmarkKind
    from polepilot.core.vehicle import Camera
    from polepilot.core.vision.detector import LandmarkDetector

    kinds = dict.fromkeys(range(1, 16), LandmarkKind())
    detectors: dict[tuple[int, ...], Callable[[Image], object]] = {}
    for rows, columns in {image.shape[:2] for image in images}:
        camera = Camera(
            width=columns, height=rows, center_x=(columns - 1) / 2, center_y=(rows - 1) / 2
        )
        detectors[(rows, columns)] = LandmarkDetector(camera, kinds).detect
    return detectors


def _aruco() -> Callable[[Image], object]:
    import cv2

    detector = cv2.aruco.ArucoDetector(cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_4X4_50))

    def find_markers(image: Image) -> object:
        grey = image if image.ndim == 2 else cv2.cvtColor(image, cv2.COLOR_BGR2GRAY)
        return detector.detectMarkers(grey)

    return find_markers


def rendered_set(count: int = _RENDERED, seed: int = 1) -> list[Image]:
    """Pictures of a room with three different landmarks at 2 to 8 m; always the same for a seed."""
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
        numbers = rng.choice(np.arange(1, 16), 3, replace=False)
        for number, bearing in zip(numbers, (-0.2, 0.0, 0.2), strict=True):
            away, off = rng.uniform(2, 8), bearing + rng.uniform(-0.06, 0.06)
            marks.append(Landmark(int(number), away * math.cos(off), away * math.sin(off)))
        renderer = Renderer(Camera(), marks, walls, rng)
        images.append(renderer.render(Pose2D(0.0, 0.0, 0.0), 0.0))
    return images


def picture_files(folder: Path) -> list[Path]:
    """The pictures of a folder, told by their names' ends, sorted.

    Raises:
        InputError: there is no such folder, it cannot be read, or holds no picture.
    """
    if not folder.is_dir():
        raise InputError(f"--frames {folder}: expected a folder of pictures.")
    try:
        files = sorted(file for file in folder.iterdir() if file.suffix.lower() in _PICTURES)
    except OSError as error:
        raise InputError(f"--frames {folder}: cannot be read ({error.strerror}).") from None
    if not files:
        raise InputError(f"--frames {folder}: holds no picture ({', '.join(_PICTURES)}).")
    return files


def _batches(files: Sequence[Path]) -> Iterator[list[Image]]:
    """Decoded pictures, no more at a time than memory may hold.

    Raises:
        ImageError: some cannot be read; names all of them.
    """
    from polepilot.core.vision.images import read_image

    batch: list[Image] = []
    problems: list[str] = []
    for file in files:
        try:
            image = read_image(file)
        except ImageError as error:
            problems.append(error.message.rstrip("."))
            batch.clear()
        if problems:
            continue  # nothing is measured any more, but everything that is wrong is said
        batch.append(image)
        if sum(image.nbytes for image in batch) >= _BATCH:
            yield batch
            batch = []
    if problems:
        raise ImageError("; ".join(problems) + ".")
    if batch:
        yield batch
