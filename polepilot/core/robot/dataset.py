"""A recorded run on disk: `dataset.json`, `samples.jsonl` and pictures (docs: contracts)."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from itertools import combinations
from pathlib import Path

from polepilot.core.errors import DatasetError, InputError
from polepilot.core.landmark import Landmark
from polepilot.core.localization.localizer import LocalizerSettings
from polepilot.core.observation import Odometry, PanReading, RangeBearing
from polepilot.core.robot.fields import Fields, parse_json, shown
from polepilot.core.trajectory import Trajectory, read_tum
from polepilot.core.vehicle import Camera, Vehicle
from polepilot.core.vision.paint import ORANGE, Paint


@dataclass(frozen=True, slots=True)
class FrameFile:
    """A picture of the recording: when it was taken and where it lies."""

    stamp: float
    path: Path
    line: int
    """Of `samples.jsonl`."""


@dataclass(frozen=True, slots=True)
class Sighted:
    """What a picture gave, where a recording keeps that instead of the picture."""

    stamp: float
    measurements: tuple[RangeBearing, ...]
    pan: float | None = None
    """Where the camera pointed, where that is known."""


Sample = Odometry | PanReading | FrameFile | Sighted

LONGEST_GAP = 0.5
"""Seconds without any sample after which nobody knows how the robot has moved."""
_FASTEST = 100.0
"""No robot on poles drives faster, m/s."""
_SMALLEST_ROBOT, _LARGEST_ROBOT = 0.001, 100.0
"""Of its lengths, metres."""
_APART = 0.001
"""Nearer to each other than this no two landmarks can stand, metres."""
_BEYOND = math.radians(20)
"""So far a potentiometer may say that it is beyond its ends, radians."""


@dataclass(frozen=True, slots=True, eq=False)
class Dataset:
    """A recording, checked. Samples are in order of time; of one moment, the picture is last."""

    folder: Path
    """Where it lies; of a run's log, the log."""
    camera: Camera
    vehicle: Vehicle
    pan_minimum: float
    pan_maximum: float
    landmarks: dict[int, Landmark]
    samples: tuple[Sample, ...]
    truth: Trajectory | None = None
    paint: Paint = ORANGE
    """Of the landmarks' bright segments; the optional field ``landmark.bright``."""
    settings: LocalizerSettings = field(default_factory=LocalizerSettings)
    """What its localizer tolerated; the program's own values where that was not recorded."""
    notes: tuple[str, ...] = ()
    """What is missing or left out, as sentences."""

    @property
    def frames(self) -> int:
        return sum(isinstance(sample, FrameFile | Sighted) for sample in self.samples)


def in_order(samples: list[Sample]) -> tuple[Sample, ...]:
    """By time; a picture is read with all that was known at its moment."""
    samples.sort(key=lambda sample: (sample.stamp, isinstance(sample, FrameFile | Sighted)))
    return tuple(samples)


def read_dataset(folder: Path) -> Dataset:
    """Read a recording; the pictures are opened only when they are replayed.

    Raises:
        DatasetError: something is missing or impossible; the message names file and line or field.
    """
    if not folder.is_dir():
        raise DatasetError(f"{folder}: expected a folder with dataset.json and samples.jsonl.")
    path = folder / "dataset.json"
    root = Fields(path, "", parse_json(_read_text(path), path))
    camera, vehicle = root.child("camera"), root.child("vehicle")
    minimum, maximum = camera.number("pan_min_rad"), camera.number("pan_max_rad")
    if not minimum < maximum:
        raise DatasetError(f"{path}: camera.pan_min_rad must be less than pan_max_rad.")
    truth = folder / "truth.tum"
    samples, notes = _samples(folder, (minimum - _BEYOND, maximum + _BEYOND))
    return Dataset(
        folder=folder,
        camera=Camera(
            constant=camera.number("constant_px", above=0),
            width=camera.count("width"),
            height=camera.count("height"),
            center_x=camera.number("cx"),
            center_y=camera.number("cy"),
            forward=camera.number("forward_m", within=(-_LARGEST_ROBOT, _LARGEST_ROBOT)),
            mount_height=camera.number("height_m", above=0),
        ),
        vehicle=Vehicle(
            wheelbase=vehicle.number("wheelbase_m", within=(_SMALLEST_ROBOT, _LARGEST_ROBOT)),
            track=vehicle.number("track_m", within=(_SMALLEST_ROBOT, _LARGEST_ROBOT)),
        ),
        pan_minimum=minimum,
        pan_maximum=maximum,
        landmarks=_landmarks(root),
        samples=samples,
        truth=read_tum(truth) if truth.exists() else None,
        paint=root.child("landmark").paint(),
        notes=notes,
    )


def _landmarks(root: Fields) -> dict[int, Landmark]:
    default = root.child("landmark").kind()
    entries = root.value("landmarks")
    path = root.path
    if not isinstance(entries, list):
        raise DatasetError(f"{path}: landmarks: expected a list.")
    marks: dict[int, Landmark] = {}
    for index, entry in enumerate(entries):
        place = f"landmarks[{index}]"
        fields = Fields(path, place, entry)
        number = fields.count("id")
        if number in marks:
            raise DatasetError(f"{path}: {place}: landmark id {number} occurs twice.")
        try:
            marks[number] = Landmark(
                number, fields.number("x"), fields.number("y"), fields.kind(default)
            )
        except DatasetError:
            raise
        except InputError as error:
            raise DatasetError(f"{path}: {place}: {error.message}") from error
    for one, other in combinations(marks.values(), 2):
        if math.dist(one.position, other.position) < _APART:
            raise DatasetError(
                f"{path}: landmarks: {one.id} and {other.id} stand in the same place, "
                f"({one.x:g}, {one.y:g}): expected places of their own."
            )
    return marks


def _samples(folder: Path, pan: tuple[float, float]) -> tuple[tuple[Sample, ...], tuple[str, ...]]:
    """The samples in order, and what was left out of them, as sentences."""
    path = folder / "samples.jsonl"
    samples: list[Sample] = []
    last = pictured = -math.inf
    again: list[int] = []
    # Not splitlines(): a text inside JSON may hold what Unicode calls the end of a line.
    for number, line in enumerate(_read_text(path).split("\n"), start=1):
        if not line.strip():
            continue
        where = Path(f"{path}:{number}")
        fields = Fields(where, "sample", parse_json(line, where))
        stamp = fields.number("t")
        if stamp < last:
            raise DatasetError(f"{where}: t = {stamp} follows {last}: expected rising times.")
        last = stamp
        kind = fields.text("kind")
        if kind == "drive":
            steering = fields.number("steering")
            if abs(steering) >= math.radians(89):
                raise DatasetError(f"{where}: steering is {steering}: expected less than 89 deg.")
            speed = fields.number("speed", within=(-_FASTEST, _FASTEST))
            samples.append(Odometry(stamp, speed, steering))
        elif kind == "pan":
            samples.append(PanReading(stamp, fields.number("angle", within=pan)))
        elif kind == "frame":
            picture = folder / fields.text("file")
            if not _is_file(picture):
                raise DatasetError(f"{where}: there is no picture {shown(str(picture))}.")
            if stamp == pictured:
                # One camera takes one picture at a time; told twice, it is no second witness.
                again.append(number)
                continue
            pictured = stamp
            samples.append(FrameFile(stamp, picture, number))
        else:
            raise DatasetError(f"{where}: kind is {kind!r}: expected 'drive', 'pan' or 'frame'.")
    # Without commands or pan angles a pose would be guesswork: a robot that does not say how it
    # drives would be taken to stand.
    for wanted, name in ((FrameFile, "frame"), (Odometry, "drive"), (PanReading, "pan")):
        if not any(isinstance(sample, wanted) for sample in samples):
            raise DatasetError(f"{path}: expected at least one sample of kind {name!r}.")
    notes = []
    if again:
        notes.append(
            f"samples.jsonl:{again[0]}: a picture of the same moment as the one before; "
            f"{len(again)} of this kind left out."
        )
    return in_order(samples), tuple(notes)


def _is_file(path: Path) -> bool:
    try:
        return path.is_file()
    except OSError:  # a name that is too long, a folder that may not be looked into
        return False


def _read_text(path: Path) -> str:
    try:
        return path.read_text(encoding="utf-8-sig")
    except FileNotFoundError as error:
        raise DatasetError(f"{path}: no such file.") from error
    except (OSError, UnicodeDecodeError) as error:
        raise DatasetError(f"{path}: cannot be read as text ({error}).") from error
