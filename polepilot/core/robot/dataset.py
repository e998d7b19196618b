"""A recorded run on disk: `dataset.json`, `samples.jsonl` and pictures (docs: contracts)."""

from __future__ import annotations

import json
import math
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from polepilot.core.errors import DatasetError, InputError
from polepilot.core.landmark import Landmark, LandmarkKind
from polepilot.core.observation import Odometry, PanReading
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


Sample = Odometry | PanReading | FrameFile

_LARGEST = 1e12
"""No time, length or angle of a recording is larger."""
_MOST = 1_000_000
"""No count is larger: columns, rows, bits, ids."""


@dataclass(frozen=True, slots=True, eq=False)
class Dataset:
    """A recording, checked. Samples are in order of time; of one moment, the picture is last."""

    folder: Path
    camera: Camera
    vehicle: Vehicle
    pan_minimum: float
    pan_maximum: float
    landmarks: dict[int, Landmark]
    samples: tuple[Sample, ...]
    truth: Trajectory | None = None
    paint: Paint = ORANGE
    """Of the landmarks' bright segments; the optional field ``landmark.bright``."""

    @property
    def frames(self) -> int:
        return sum(isinstance(sample, FrameFile) for sample in self.samples)


def read_dataset(folder: Path) -> Dataset:
    """Read a recording; the pictures are opened only when they are replayed.

    Raises:
        DatasetError: something is missing or impossible; the message names file and line or field.
    """
    if not folder.is_dir():
        raise DatasetError(f"{folder}: expected a folder with dataset.json and samples.jsonl.")
    path = folder / "dataset.json"
    root = _Fields(path, "", _parse(_read_text(path), path))
    camera, pan = root.child("camera"), root.child("camera")
    minimum, maximum = pan.number("pan_min_rad"), pan.number("pan_max_rad")
    if not minimum < maximum:
        raise DatasetError(f"{path}: camera.pan_min_rad must be less than pan_max_rad.")
    truth = folder / "truth.tum"
    return Dataset(
        folder=folder,
        camera=Camera(
            constant=camera.number("constant_px", above=0),
            width=camera.count("width"),
            height=camera.count("height"),
            center_x=camera.number("cx"),
            center_y=camera.number("cy"),
            forward=camera.number("forward_m"),
            mount_height=camera.number("height_m", above=0),
        ),
        vehicle=Vehicle(
            wheelbase=root.child("vehicle").number("wheelbase_m", above=0),
            track=root.child("vehicle").number("track_m", above=0),
        ),
        pan_minimum=minimum,
        pan_maximum=maximum,
        landmarks=_landmarks(root),
        samples=_samples(folder),
        truth=read_tum(truth) if truth.exists() else None,
        paint=root.child("landmark").paint(),
    )


class _Fields:
    """An object of a JSON document that knows where it stands."""

    def __init__(self, path: Path, place: str, document: Any) -> None:
        self._where = f"{path}: {place or 'the document'}"
        self._path, self._place = path, place
        if not isinstance(document, dict):
            raise DatasetError(f"{self._where}: expected an object with named fields.")
        self._document = document

    def __contains__(self, key: str) -> bool:
        return key in self._document

    def value(self, key: str) -> Any:
        if key not in self._document:
            raise DatasetError(f"{self._where}: the field {key!r} is missing.")
        return self._document[key]

    def child(self, key: str) -> _Fields:
        place = f"{self._place}.{key}" if self._place else key
        return _Fields(self._path, place, self.value(key))

    def number(self, key: str, above: float | None = None) -> float:
        value = self.value(key)
        good = isinstance(value, (int, float)) and not isinstance(value, bool)
        if not good or not -_LARGEST <= value <= _LARGEST or (above is not None and value <= above):
            limit = "" if above is None else f" above {above:g}"
            raise DatasetError(
                f"{self._where}: {key} is {_shown(value)}: expected a finite number{limit}."
            )
        return float(value)

    def count(self, key: str) -> int:
        value = self.value(key)
        if not isinstance(value, int) or isinstance(value, bool) or not 1 <= value <= _MOST:
            raise DatasetError(
                f"{self._where}: {key} is {_shown(value)}: expected a whole number, 1 to {_MOST}."
            )
        return value

    def text(self, key: str) -> str:
        value = self.value(key)
        if not isinstance(value, str) or not value:
            raise DatasetError(f"{self._where}: {key} is {_shown(value)}: expected a text.")
        return value

    def kind(self, default: LandmarkKind | None = None) -> LandmarkKind:
        """The size of a landmark: bits, segment_m, diameter_m, and shape where it is not round."""
        try:
            if default is None:
                return LandmarkKind(
                    bits=self.count("bits"),
                    segment=self.number("segment_m", above=0),
                    diameter=self.number("diameter_m", above=0),
                    shape=self.value("shape") if "shape" in self else "cylinder",
                )
            return LandmarkKind(
                bits=self.count("bits") if "bits" in self else default.bits,
                segment=self.number("segment_m") if "segment_m" in self else default.segment,
                diameter=self.number("diameter_m") if "diameter_m" in self else default.diameter,
                shape=self.value("shape") if "shape" in self else default.shape,
            )
        except DatasetError:
            raise
        except InputError as error:
            raise DatasetError(f"{self._where}: {error.message}") from error

    def paint(self) -> Paint:
        """``bright``, of the landmarks' bright segments; orange where it is not said."""
        if "bright" not in self:
            return ORANGE
        text = self.text("bright")
        try:
            return Paint.parse(text)
        except InputError as error:
            raise DatasetError(f"{self._where}: {error.message}") from error


def _landmarks(root: _Fields) -> dict[int, Landmark]:
    default = root.child("landmark").kind()
    entries = root.value("landmarks")
    path = root._path
    if not isinstance(entries, list):
        raise DatasetError(f"{path}: landmarks: expected a list.")
    marks: dict[int, Landmark] = {}
    for index, entry in enumerate(entries):
        place = f"landmarks[{index}]"
        fields = _Fields(path, place, entry)
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
    return marks


def _samples(folder: Path) -> tuple[Sample, ...]:
    path = folder / "samples.jsonl"
    samples: list[Sample] = []
    last = -math.inf
    # Not splitlines(): a text inside JSON may hold what Unicode calls the end of a line.
    for number, line in enumerate(_read_text(path).split("\n"), start=1):
        if not line.strip():
            continue
        where = Path(f"{path}:{number}")
        fields = _Fields(where, "sample", _parse(line, where))
        stamp = fields.number("t")
        if stamp < last:
            raise DatasetError(f"{where}: t = {stamp} follows {last}: expected rising times.")
        last = stamp
        kind = fields.text("kind")
        if kind == "drive":
            steering = fields.number("steering")
            if abs(steering) >= math.radians(89):
                raise DatasetError(f"{where}: steering is {steering}: expected less than 89 deg.")
            samples.append(Odometry(stamp, fields.number("speed"), steering))
        elif kind == "pan":
            samples.append(PanReading(stamp, fields.number("angle")))
        elif kind == "frame":
            picture = folder / fields.text("file")
            if not _is_file(picture):
                raise DatasetError(f"{where}: there is no picture {_shown(str(picture))}.")
            samples.append(FrameFile(stamp, picture, number))
        else:
            raise DatasetError(f"{where}: kind is {kind!r}: expected 'drive', 'pan' or 'frame'.")
    if not any(isinstance(sample, FrameFile) for sample in samples):
        raise DatasetError(f"{path}: expected at least one sample of kind 'frame'.")
    # A picture is read with all that was known at its moment.
    samples.sort(key=lambda sample: (sample.stamp, isinstance(sample, FrameFile)))
    return tuple(samples)


def _parse(text: str, where: Path) -> Any:
    """JSON; ``where`` is the file, or file and line where each line is a document."""
    try:
        return json.loads(text)
    except json.JSONDecodeError as error:
        line = f":{error.lineno}" if where.is_file() else ""
        raise DatasetError(f"{where}{line}: no valid JSON: {error.msg}.") from error
    except (ValueError, RecursionError) as error:  # endless digits, endless brackets
        raise DatasetError(f"{where}: no JSON that can be read: {error}.") from error


def _shown(value: Any) -> str:
    """A value as messages show it, short."""
    text = repr(value)
    return text if len(text) <= 80 else f"{text[:77]}..."


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
