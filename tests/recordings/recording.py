"""Recordings on disk, as the dataset contract has them; rendered once and kept by a fingerprint."""

from __future__ import annotations

import hashlib
import json
import math
import shutil
import tempfile
from dataclasses import asdict, dataclass
from functools import cache
from pathlib import Path

import cv2
import numpy as np
from recordings.motion import Course, drive
from recordings.painter import Painter
from recordings.scenario import HALF_SWEEP, Kind, Scenario, draw
from recordings.sights import Sight, sights

_MADE_OF = ("scenario", "motion", "sights", "panorama", "painter", "sensor", "recording")
BLANK = "blank.png"
PNG = [cv2.IMWRITE_PNG_COMPRESSION, 1, cv2.IMWRITE_PNG_STRATEGY, cv2.IMWRITE_PNG_STRATEGY_RLE]


@dataclass(frozen=True, slots=True)
class Told:
    """What only the maker of a recording knows; times are stamps of the recording."""

    first_motion: float
    sweep: float
    """Seconds that the camera takes from one end to the other."""
    shift: tuple[float, float] | None
    """When the robot was lifted or pushed, from and until."""
    moved: tuple[int, float, float] | None
    """Which pole stands elsewhere, and by how much, against the map."""
    sights: dict[float, tuple[Sight, ...]]
    """By the pictures' stamps."""


@cache
def fingerprint() -> str:
    """Of everything that a recording depends on, so that no old one is taken."""
    digest = hashlib.sha256(np.__version__.encode() + cv2.__version__.encode())
    here = Path(__file__).parent
    files = [here / f"{name}.py" for name in _MADE_OF] + [here.parent / "scenes/studio_light.py"]
    for path in files:
        digest.update(path.read_bytes())
    return digest.hexdigest()[:12]


def recording(kind: Kind, seed: int, keep: Path, *, pictures: bool = True) -> Path:
    """The folder of a recording below ``keep``, made now or before.

    Without ``pictures`` every frame names the same blank one: for tests of what comes after seeing.
    """
    folder = keep / f"recordings-{fingerprint()}" / f"{kind}-{seed:04d}"
    if not pictures:
        folder = folder.with_name(folder.name + "-blank")
    if folder.is_dir():
        return folder
    folder.parent.mkdir(parents=True, exist_ok=True)
    part = Path(tempfile.mkdtemp(prefix=".part-", dir=folder.parent))
    try:
        write(draw(kind, seed), part, pictures=pictures)
        if not folder.is_dir():
            part.rename(folder)
    finally:
        shutil.rmtree(part, ignore_errors=True)
    return folder


def write(scenario: Scenario, folder: Path, *, pictures: bool, limit: int | None = None) -> None:
    """Everything of a recording into an empty folder; ``limit``: only that many first pictures."""
    course = drive(scenario)
    begin = scenario.start
    _write_json(folder / "dataset.json", _dataset(scenario))
    _write_samples(folder / "samples.jsonl", course, begin, pictures, limit)
    half = 0.5 * course.heading
    rows = np.stack([course.t + begin, course.x, course.y, np.sin(half), np.cos(half)], axis=1)
    lines = [f"{t:.6f} {x:.6f} {y:.6f} 0 0 0 {s:.9f} {c:.9f}\n" for t, x, y, s, c in rows[::2]]
    (folder / "truth.tum").write_text("".join(lines), encoding="ascii")
    _write_json(folder / "told.json", _told(scenario, course))
    if not pictures:
        cv2.imwrite(
            str(folder / BLANK), np.zeros((scenario.eye.height, scenario.eye.width, 3), np.uint8)
        )
        return
    (folder / "frames").mkdir()
    painter = Painter(scenario, course)
    for index in range(len(course.frames))[:limit]:
        path = folder / _name(index)
        cv2.imwrite(str(path), painter.paint(index), PNG)


def read_told(folder: Path) -> Told:
    """The maker's knowledge of a recording."""
    known = json.loads((folder / "told.json").read_text())
    return Told(
        known["first_motion"],
        known["sweep"],
        tuple(known["shift"]) if known["shift"] else None,
        tuple(known["moved"]) if known["moved"] else None,
        {t: tuple(Sight(**one) for one in seen) for t, seen in known["sights"]},
    )


def _name(index: int) -> str:
    return f"frames/{index:05d}.png"


def _dataset(scenario: Scenario) -> dict[str, object]:
    eye, robot = scenario.eye, scenario.robot
    return {
        "camera": {
            "constant_px": eye.constant,
            "width": eye.width,
            "height": eye.height,
            "cx": eye.cx,
            "cy": eye.cy,
            "forward_m": eye.forward,
            "height_m": eye.mount,
            "pan_min_rad": -HALF_SWEEP,
            "pan_max_rad": HALF_SWEEP,
        },
        "vehicle": {"wheelbase_m": robot.wheelbase, "track_m": robot.track},
        "landmark": {"bits": 4, "segment_m": 0.05, "diameter_m": 0.07},
        "landmarks": [
            {"id": pole.id, "x": pole.mapped[0], "y": pole.mapped[1]} for pole in scenario.poles
        ],
    }


def _write_samples(
    path: Path, course: Course, begin: float, pictures: bool, limit: int | None
) -> None:
    rows: list[tuple[float, dict[str, object]]] = []
    for t, speed, steering in course.commands:
        rows.append((t, {"kind": "drive", "speed": speed, "steering": steering}))
    for t, angle in course.readings:
        rows.append((t, {"kind": "pan", "angle": round(angle, 6)}))
    for index, t in enumerate(course.frames.tolist()[:limit]):
        rows.append((t, {"kind": "frame", "file": _name(index) if pictures else BLANK}))
    rows.sort(key=lambda row: row[0])
    lines = [json.dumps({"t": round(t + begin, 6)} | row) + "\n" for t, row in rows]
    path.write_text("".join(lines), encoding="ascii")


def _told(scenario: Scenario, course: Course) -> dict[str, object]:
    begin, shift = scenario.start, course.shift
    moved = next((pole for pole in scenario.poles if pole.id == scenario.moved), None)
    seen = sights(scenario, course)
    return {
        "first_motion": begin + course.first_motion,
        "sweep": 2 * HALF_SWEEP / scenario.robot.pan_rate,
        "shift": [begin + shift.at, begin + shift.at + shift.lasts] if shift else None,
        # As a localizer sees it: the pole appears displaced from where the map has it.
        "moved": [moved.id, moved.x - moved.mapped[0], moved.y - moved.mapped[1]]
        if moved
        else None,
        "sights": [
            [round(t + begin, 6), [asdict(one) for one in row]]
            for t, row in zip(course.frames.tolist(), seen, strict=True)
        ],
    }


def _write_json(path: Path, document: dict[str, object]) -> None:
    if not all(math.isfinite(v) for v in document.values() if isinstance(v, float)):
        raise ValueError(f"{path.name}: a number is not finite")
    path.write_text(json.dumps(document) + "\n", encoding="ascii")
