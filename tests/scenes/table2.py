"""The paper's Table 2, repeated: six distances, measured by both detectors.

The paper put a landmark at six distances and printed what its program measured, one picture each.
Here every distance gets many rendered pictures, with the paper's camera: 400x300 pixels, C = 600.
``PYTHONPATH=tests python -m scenes.table2`` prints the table.
"""

from __future__ import annotations

import argparse
import json
import math
import sys
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np
from scenes.posed import camera_of, posed
from scenes.studio_light import draw_paint
from scenes.studio_optics import Eye, Pole

from polepilot.core.landmark import LandmarkKind
from polepilot.core.observation import Image
from polepilot.core.vision.detector import Detector, LandmarkDetector
from polepilot.core.vision.paper import PaperDetector

ACTUAL = (2.55, 3.40, 7.30, 2.37, 2.34, 1.91)
"""Metres, in the paper's order."""
PRINTED = (2.54, 3.39, 7.24, 2.40, 2.38, 1.93)
"""What the paper's program measured."""
KIND = LandmarkKind()
PICTURES = 40
"""Per distance, unless said otherwise."""
_NEAR = math.radians(0.8)
"""Between an answer and the landmark that it reads, at most."""


@dataclass(frozen=True, slots=True)
class Row:
    """What one detector made of the pictures at one distance; shares of the distance."""

    distance: float
    pictures: int
    read: int
    mean: float | None
    """Of the sizes of the errors; None where nothing was read."""
    bias: float | None
    """Of the errors; positive: measured too long."""


def paper_mean() -> float:
    """The mean relative error of what the paper printed: 0.92 %."""
    return float(np.mean(np.abs(np.array(PRINTED) / np.array(ACTUAL) - 1)))


def shot(distance: float, seed: int) -> tuple[Image, Eye, Pole]:
    """One landmark, whole in the picture, at ``distance``."""
    rng = np.random.default_rng([2, round(distance * 1000), seed])
    while True:
        eye = Eye(
            pitch=math.radians(rng.uniform(-2, 2)),
            roll=math.radians(rng.uniform(-2, 2)),
            blur=rng.uniform(0.3, 0.8),
        )
        number, bearing = int(rng.integers(1, 16)), rng.uniform(-0.28, 0.28)
        fade = rng.uniform(-0.15, 0.15)
        pole = Pole(number, distance, bearing, KIND, draw_paint(rng), fade=fade)
        outline = pole.outline(eye)
        low, high = outline.min(axis=0), outline.max(axis=0)
        if low.min() >= 2 and high[0] <= eye.width - 3 and high[1] <= eye.height - 3:
            return posed([pole], eye, int(rng.integers(2**31))), eye, pole


def detector_of(name: str, eye: Eye) -> Detector:
    """``default`` or ``paper``, for pictures of this camera."""
    kinds = dict.fromkeys(range(1, 16), KIND)
    camera = camera_of(eye)
    return PaperDetector(camera, kinds) if name == "paper" else LandmarkDetector(camera, kinds)


def measure(
    pictures: int = PICTURES, names: Sequence[str] = ("default", "paper")
) -> dict[str, list[Row]]:
    """The table: for each detector a `Row` per distance, in the paper's order."""
    errors: dict[str, list[list[float]]] = {name: [[] for _ in ACTUAL] for name in names}
    for index, distance in enumerate(ACTUAL):
        for seed in range(pictures):
            image, eye, pole = shot(distance, seed)
            for name in names:
                for answer in detector_of(name, eye).detect(image):
                    if answer.id == pole.id and abs(answer.bearing - pole.bearing) < _NEAR:
                        errors[name][index].append(answer.range / distance - 1)
    return {
        name: [_row(away, pictures, e) for away, e in zip(ACTUAL, errors[name], strict=True)]
        for name in names
    }


def _row(distance: float, pictures: int, errors: Sequence[float]) -> Row:
    if not errors:
        return Row(distance, pictures, 0, None, None)
    mean, bias = float(np.mean(np.abs(errors))), float(np.mean(errors))
    return Row(distance, pictures, len(errors), mean, bias)


def mean_error(rows: Sequence[Row]) -> float:
    """Over all distances alike, of those where anything was read."""
    return float(np.mean([row.mean for row in rows if row.mean is not None]))


def document(pictures: int = PICTURES) -> dict[str, Any]:
    """The measured table as JSON."""
    measured = measure(pictures)
    return {name: [asdict(row) for row in rows] for name, rows in measured.items()}


def main(arguments: Sequence[str] | None = None) -> None:
    """Measures and prints the table."""
    parser = argparse.ArgumentParser(prog="python -m scenes.table2", description=__doc__)
    parser.add_argument("--pictures", type=int, default=PICTURES, help="per distance")
    parser.add_argument("--json", type=Path, help="file for the figures")
    options = parser.parse_args(arguments)
    measured = document(options.pictures)
    if options.json is not None:
        options.json.write_text(json.dumps(measured, indent=1) + "\n")
    for name, rows in measured.items():
        for row in rows:
            error = "" if row["mean"] is None else f"{row['mean']:8.3%} {row['bias']:+8.3%}"
            sys.stdout.write(f"{name:8} {row['distance']:5.2f} m {row['read']:4d} read {error}\n")


if __name__ == "__main__":
    main()
