"""What the detector makes of pictures: seen by the real one, or drawn from how it errs."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable, Collection, Sequence
from dataclasses import asdict
from functools import cache
from pathlib import Path

import numpy as np
from recordings.recording import Told
from recordings.sights import Sight

from polepilot.core.observation import Detection
from polepilot.core.robot.dataset import Dataset, FrameFile
from polepilot.core.vision.detector import LandmarkDetector
from polepilot.core.vision.images import read_image

See = Callable[[FrameFile], Sequence[Detection]]

FARTHEST = 17.0
READ = 0.985
FAINT = 10.0
"""Metres from which on landmarks are read less often, down to half of them at the farthest."""
RANGE_SHARE = 0.0004
HEIGHT_PIXELS = 0.11
"""Error of the code's height in the picture."""
BEARING_PIXELS = 0.24
TAIL = 0.03
"""Share of the readings that err twice as much."""


def drawn(told: Told, seed: int, ideal: Collection[str] = ()) -> See:
    """Landmarks with errors by lot, which are those that the detector made of our pictures."""

    def see(frame: FrameFile) -> list[Detection]:
        rng = np.random.default_rng([seed, round(frame.stamp * 1e4)])
        seen = told.sights[round(frame.stamp, 6)]
        return [one for sight in seen if (one := _measured(sight, rng, ideal)) is not None]

    return see


def _measured(sight: Sight, rng: np.random.Generator, ideal: Collection[str]) -> Detection | None:
    chance = float(rng.random())
    errors = rng.standard_normal(2) * (2.0 if rng.random() < TAIL else 1.0)
    errors *= ["ranges" not in ideal, "bearings" not in ideal]
    wide = 600 * 0.07 / sight.range
    likely = READ - 0.5 * max(sight.range - FAINT, 0.0) / (FARTHEST - FAINT)
    if not sight.whole or sight.range > FARTHEST or chance > likely or sight.smear > 2.0 * wide:
        return None
    height = 600 * 0.65 / sight.range
    sigma = sight.range * float(np.hypot(RANGE_SHARE, HEIGHT_PIXELS / height))
    turned = BEARING_PIXELS / 600
    distance = sight.range + sigma * float(errors[0])
    bearing = sight.bearing + turned * float(errors[1])
    column = 199.5 - 600 * float(np.tan(bearing))
    scale = 600 / (distance * float(np.cos(bearing)))
    rows = 149.5 - 0.25 * scale, 149.5 + 0.4 * scale
    return Detection(sight.id, distance, bearing, column, *rows, sigma, turned)


def looked(dataset: Dataset, keep: bool = True) -> See:
    """The default detector on the pictures; ``keep`` its answers beside them for another time."""
    kinds = {number: mark.kind for number, mark in dataset.landmarks.items()}
    detector = LandmarkDetector(dataset.camera, kinds)
    store = dataset.folder / f"detections-{_detector_fingerprint()}.json"
    known: dict[str, list[Detection]] = {}
    if keep and store.exists():
        rows = json.loads(store.read_text())
        known = {name: [Detection(**one) for one in row] for name, row in rows.items()}
    complete = len(known) == dataset.frames

    def see(frame: FrameFile) -> list[Detection]:
        nonlocal complete
        if frame.path.name not in known:
            known[frame.path.name] = list(detector.detect(read_image(frame.path)))
        if keep and not complete and len(known) == dataset.frames:
            complete = True
            document = {name: [asdict(one) for one in row] for name, row in known.items()}
            part = store.with_suffix(".part")
            part.write_text(json.dumps(document))
            part.replace(store)
        return known[frame.path.name]

    return see


@cache
def _detector_fingerprint() -> str:
    """Of the program that looks."""
    import polepilot.core.vision as vision

    digest = hashlib.sha256()
    folder = Path(next(iter(vision.__path__)))
    core = folder.parent
    files = [
        path for path in sorted(folder.rglob("*")) if path.suffix in (".py", ".so", ".c", ".h")
    ]
    for path in [*files, core / "observation.py", core / "landmark.py"]:
        digest.update(path.read_bytes())
    return digest.hexdigest()[:12]
