"""Accuracy and time against resolution: the same rooms by cameras with more and fewer pixels.

All see the same angle of view (C grows with the width), and every camera has the blur, noise and
JPEG per pixel that the studio draws for clean pictures: a lens that is good enough for its sensor.
``PYTHONPATH=tests python -m scenes.resolution --json FILE`` takes about six minutes.
"""

from __future__ import annotations

import argparse
import json
import math
import sys
import time
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from scenes.campaign import KINDS, match
from scenes.studio import scene
from scenes.truth import Family

from polepilot.core.observation import Detection, Image
from polepilot.core.vehicle import Camera
from polepilot.core.vision.detector import LandmarkDetector

SIZES = (
    *((320, 240), (400, 300), (640, 480), (800, 600)),
    *((1024, 768), (1280, 960), (1600, 1200)),
)
CONSTANT = 1.5
"""Camera constant as a multiple of the width: 600 at 400 pixels."""
SCENES = 40
"""Per size and band, unless said otherwise."""
BANDS: Mapping[str, tuple[Family, ...]] = {
    "2-8 m": ("clean",),
    "8-16 m": ("clean-8-12", "clean-12-16"),
}
_LOOKS = 3
"""Times that a picture is looked at; the quickest counts."""


def camera_of(size: tuple[int, int]) -> Camera:
    """The camera with that many columns and rows."""
    width, height = size
    return Camera(
        constant=CONSTANT * width,
        width=width,
        height=height,
        center_x=(width - 1) / 2,
        center_y=(height - 1) / 2,
    )


def measure(
    scenes: int = SCENES,
    sizes: Sequence[tuple[int, int]] = SIZES,
    said: Callable[[str], object] = lambda _: None,
) -> list[dict[str, Any]]:
    """One row per size and band; ``said`` hears of the progress."""
    cv2.setNumThreads(1)
    rows = []
    for size in sizes:
        for band in BANDS:
            rows.append(_row(size, band, scenes))
            said(f"{size[0]} x {size[1]}, {band}")
    return rows


def _row(size: tuple[int, int], band: str, scenes: int) -> dict[str, Any]:
    camera = camera_of(size)
    detector = LandmarkDetector(camera, KINDS)
    families = BANDS[band]
    errors, turned, times = [], [], []
    poles = 0
    for seed in range(scenes):
        family = families[seed % len(families)]
        shown = scene(family, seed, size=size, constant=camera.constant)
        answers, seconds = _look(detector, shown.image)
        times.append(seconds)
        poles += len(shown.truths)
        for index, answer in match(answers, shown.truths, camera).read.items():
            truth = shown.truths[index]
            errors.append(abs(answer.range / truth.range - 1))
            turned.append(abs(answer.bearing - truth.bearing))
    row: dict[str, Any] = {
        "width": size[0],
        "height": size[1],
        "band": band,
        "scenes": scenes,
        "landmarks": poles,
        "read": len(errors),
        "milliseconds": 1e3 * float(np.median(times)),
    }
    if errors:
        row["range_mean_percent"] = 100 * float(np.mean(errors))
        row["range_p95_percent"] = 100 * float(np.percentile(errors, 95))
        row["bearing_median_deg"] = math.degrees(float(np.median(turned)))
    return row


def _look(detector: LandmarkDetector, image: Image) -> tuple[list[Detection], float]:
    """What is found, and how long that takes undisturbed, seconds."""
    taken = []
    for _ in range(_LOOKS):
        start = time.perf_counter()
        answers = detector.detect(image)
        taken.append(time.perf_counter() - start)
    return answers, min(taken)


def main(arguments: Sequence[str] | None = None) -> None:
    """Measures and prints the rows."""
    parser = argparse.ArgumentParser(prog="python -m scenes.resolution", description=__doc__)
    parser.add_argument("--scenes", type=int, default=SCENES, help="per size and band")
    parser.add_argument("--json", type=Path, help="file for the figures")
    options = parser.parse_args(arguments)
    rows = measure(options.scenes, said=lambda text: sys.stderr.write(f"{text}\n"))
    if options.json is not None:
        options.json.write_text(json.dumps(rows, indent=1) + "\n")
    for row in rows:
        cells = (f"{k} {v:.4g}" if isinstance(v, float) else f"{k} {v}" for k, v in row.items())
        sys.stdout.write(", ".join(cells) + "\n")


if __name__ == "__main__":
    main()
