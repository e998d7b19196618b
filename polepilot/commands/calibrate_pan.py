"""`polepilot calibrate pan`: potentiometer counts to radians."""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Sequence
from dataclasses import replace
from itertools import pairwise
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from polepilot.commands.outcome import Outcome
from polepilot.core.errors import DatasetError, ImageError, InputError

if TYPE_CHECKING:
    from polepilot.core.landmark import Landmark
    from polepilot.core.localization.pan_line import KnownDirection, PanLine
    from polepilot.core.localization.pan_survey import PanSurvey
    from polepilot.core.observation import RangeBearing
    from polepilot.core.robot.dataset import Dataset
    from polepilot.core.vehicle import PanUnit
    from polepilot.server.settings_edit import Changes

Stretch = tuple[float, float]
"""From one moment to another, seconds."""

_SETTLE = 0.5
"""A robot that was told to stand rolls for so long, seconds."""
_LARGEST_GAP = 0.5
"""Between two readings of the pan angle, seconds."""


def calibrate_directions(texts: Sequence[str], unit: PanUnit) -> Outcome:
    """From directions that a person knows: ``COUNTS=DEGREES``, left positive."""
    from polepilot.core.localization.pan_line import fit_line, judge

    fit = fit_line([_direction(text, unit) for text in texts], unit)
    rows = [
        (
            f"{one.adc:g}",
            f"{math.degrees(one.angle):+.2f}",
            f"{math.degrees(one.angle + off):+.2f}",
            f"{math.degrees(off):+.2f}",
        )
        for one, off in zip(fit.directions, fit.residuals, strict=True)
    ]
    document = {
        "directions": [
            {"adc": one.adc, "angle": one.angle, "residual": off}
            for one, off in zip(fit.directions, fit.residuals, strict=True)
        ],
        "radians_per_count": fit.line.scale,
        "zero": fit.line.zero,
        "bow": fit.bow,
    }
    changes, lines = _result(fit.line, unit)
    headings = ("counts", "given °", "line °", "residual °")
    return Outcome((headings, rows), lines, document, judge(fit), changes)


def calibrate_survey(
    measurements: Sequence[RangeBearing],
    landmarks: dict[int, Landmark],
    unit: PanUnit,
    heading: float | None,
    about: str,
) -> Outcome:
    """From landmarks of a surveyed site; ``about`` says what was looked at."""
    from polepilot.core.localization.pan_line import PanLine
    from polepilot.core.localization.pan_survey import judge, survey_pan

    half = max(abs(unit.minimum), abs(unit.maximum))
    survey = survey_pan(measurements, landmarks, half, heading)
    rows = [
        (
            str(check.landmark),
            str(check.sightings),
            " to ".join(f"{math.degrees(angle):+.0f}" for angle in check.pan),
            f"{check.range_error * 100:+.1f}",
            f"{math.degrees(check.bearing_error):+.2f}",
            "" if check.agrees else "left out",
        )
        for check in survey.checks
    ]
    changes, lines = _result(survey.line(PanLine.of(unit)), unit)
    x, y, direction = survey.camera
    place = f"the camera stood at ({x:.3f}, {y:.3f}) m; pan angle 0, as it was read, looked at"
    lines = (about, f"{place} {math.degrees(direction):+.1f}°", *lines)
    headings = ("landmark", "seen", "pan °", "range cm", "bearing °", "")
    return Outcome((headings, rows), lines, _survey_document(survey), judge(survey), changes)


def from_dataset(
    recording: Dataset, landmarks: dict[int, Landmark], done: Callable[[int], None]
) -> tuple[list[RangeBearing], Stretch]:
    """What was seen while the robot stood longest, and when that was.

    Raises:
        InputError: it never stood, or none of the pictures can be used.
    """
    from polepilot.core.observation import Odometry, PanReading
    from polepilot.core.robot.dataset import FrameFile
    from polepilot.core.vision.detector import LandmarkDetector
    from polepilot.core.vision.images import read_image
    from polepilot.core.vision.measure import to_range_bearing

    driven = [(s.stamp, s.speed) for s in recording.samples if isinstance(s, Odometry)]
    ends = recording.samples[0].stamp, recording.samples[-1].stamp
    start, end = _longest_stand(driven, ends, str(recording.folder))
    readings = [s for s in recording.samples if isinstance(s, PanReading)]
    pan = _pan_at([(r.stamp, r.angle) for r in readings])
    kinds = {number: mark.kind for number, mark in landmarks.items()}
    detector = LandmarkDetector(recording.camera, kinds, recording.paint)
    found: list[RangeBearing] = []
    problem = ""
    frames = [s for s in recording.samples if isinstance(s, FrameFile) and start <= s.stamp <= end]
    for number, frame in enumerate(frames, start=1):
        angle = pan(frame.stamp)
        if angle is not None:
            try:
                image = read_image(frame.path)
            except ImageError as error:
                problem = f"; samples.jsonl:{frame.line}: {error.message}"
            else:
                found += [
                    to_range_bearing(seen, frame.stamp, angle) for seen in detector.detect(image)
                ]
        done(number)
    if not found:
        raise DatasetError(
            f"{recording.folder}: no landmark was seen from {start:.1f} to {end:.1f} s, while the "
            f"robot stood{problem}"
        )
    return found, (start, end)


def from_log(path: Path) -> tuple[list[RangeBearing], dict[int, Landmark], Stretch]:
    """The same from a run's log, with the landmarks of its own site.

    Raises:
        InputError: no such file, nothing in it, or the robot never stood.
    """
    if not path.is_file():
        raise InputError(f"--log {path}: no such file; expected the log of a run (.mcap).")
    try:
        return _read_log(path)
    except (KeyError, TypeError, ValueError, IndexError) as error:
        raise InputError(f"--log {path}: is no log of a run that can be read.") from error


def _read_log(path: Path) -> tuple[list[RangeBearing], dict[int, Landmark], Stretch]:
    from polepilot.core.observation import RangeBearing
    from polepilot.core.robot.log import read_messages
    from polepilot.core.site import parse_site

    driven: list[tuple[float, float]] = []
    readings: list[tuple[float, float]] = []
    sightings: list[dict[str, Any]] = []
    landmarks: dict[int, Landmark] = {}
    for channel, _, data in read_messages(path):
        if channel == "site":
            landmarks = dict(parse_site(json.loads(data), str(path)).landmarks_by_id())
        elif channel == "snapshot":
            message = json.loads(data)
            driven.append((message["t"], message["command"][0]))
            if message["pan"] is not None:
                readings.append((message["t"], message["pan"]))
        elif channel == "sighting":
            message = json.loads(data)
            if message["measurements"]:
                sightings.append(message)
    if not driven or not sightings:
        raise InputError(f"--log {path}: holds no sightings of a run; expected run.mcap.")
    start, end = _longest_stand(driven, (driven[0][0], driven[-1][0]), f"--log {path}")
    pan = _pan_at(readings)
    found = [
        RangeBearing(
            message["t"],
            one["landmark"],
            one["range"],
            one["bearing"],
            one["range_sigma"],
            one["bearing_sigma"],
            # A snapshot's angle is a tick old at most; only its product with the error counts.
            pan(message["t"]),
        )
        for message in sightings
        if start <= message["t"] <= end
        for one in message["measurements"]
    ]
    return found, landmarks, (start, end)


def unit_of(recording: Dataset, unit: PanUnit, config: Path | None) -> PanUnit:
    """The calibration by which a recording's angles were read.

    Raises:
        DatasetError: robot.toml has another range.
    """
    recorded = recording.pan_minimum, recording.pan_maximum
    if config is None:
        return replace(unit, minimum=recorded[0], maximum=recorded[1])
    same = np.allclose(recorded, (unit.minimum, unit.maximum), atol=1e-3)
    if not same:
        ours, theirs = (
            " to ".join(f"{math.degrees(angle):.1f}" for angle in pair)
            for pair in ((unit.minimum, unit.maximum), recorded)
        )
        raise DatasetError(
            f"{recording.folder / 'dataset.json'}: its pan angles were read with a range of "
            f"{theirs} degrees, but {config} has {ours}: expected the same calibration."
        )
    return unit


def parse_degrees(text: str, option: str) -> float:
    """Degrees as a person types them, in radians.

    Raises:
        InputError: no number, or more than a turn.
    """
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not abs(value) <= 360:
        raise InputError(f"{option} is {text!r}: expected degrees, left positive, as -90.")
    return math.radians(value)


def _direction(text: str, unit: PanUnit) -> KnownDirection:
    """``512=0``: counts; ``0.78rad=45``: the angle as it is read with the present calibration."""
    from polepilot.core.localization.pan_line import KnownDirection, PanLine

    said, equals, degrees = text.partition("=")
    try:
        count = float(said.removesuffix("rad"))
    except ValueError:
        count = math.nan
    if said.endswith("rad") and math.isfinite(count):
        count = PanLine.of(unit).adc(count)
    if not equals or not math.isfinite(count):
        raise InputError(f"--at is {text!r}: expected COUNTS=DEGREES, left positive, as 512=0.")
    try:
        return KnownDirection(count, parse_degrees(degrees, f"--at {text}: the direction"))
    except InputError as error:
        if error.message.startswith("--at"):
            raise
        raise InputError(f"--at {text}: {error.message}") from error


def _result(line: PanLine, unit: PanUnit) -> tuple[Changes, tuple[str, ...]]:
    """What goes to robot.toml, and which way the present calibration is wrong."""
    from polepilot.core.localization.pan_line import PanLine, corrected

    better, present = corrected(unit, line), PanLine.of(unit)
    lines = []
    for read in (unit.minimum, 0.0, unit.maximum):
        off = math.degrees(line.angle(present.adc(read)) - read)
        side = "left" if off > 0 else "right"
        how = f"{abs(off):.1f}° farther {side}" if abs(off) >= 0.05 else "that is right"
        lines.append(
            f"where the calibration so far says {math.degrees(read):+.1f}° the camera looks at "
            f"{math.degrees(read) + off:+.1f}°: {how}"
        )
    changes: Changes = {
        "pan": {
            "minimum_rad": better.minimum,
            "maximum_rad": better.maximum,
            "adc_at_minimum": better.adc_at_minimum,
            "adc_at_maximum": better.adc_at_maximum,
        }
    }
    return changes, tuple(lines)


def _survey_document(survey: PanSurvey) -> dict[str, object]:
    return {
        "landmarks": [
            {
                "id": check.landmark,
                "sightings": check.sightings,
                "pan": list(check.pan),
                "range_residual": check.range_error,
                "bearing_residual": check.bearing_error,
                "agrees": check.agrees,
            }
            for check in survey.checks
        ],
        "camera": list(survey.camera),
        "scale": survey.scale,
        "scale_sigma": survey.scale_sigma,
        "offset": survey.offset,
        "bow": survey.bow,
        "bow_sigma": survey.bow_sigma,
        "range_scale": survey.range_scale,
    }


def _longest_stand(driven: Sequence[tuple[float, float]], ends: Stretch, what: str) -> Stretch:
    """The longest time without speed, after the robot has come to rest."""
    stands: list[Stretch] = []
    moments = [*driven, (ends[1], 0.0)]
    if not driven or driven[0][0] > ends[0]:
        moments.insert(0, (ends[0], 0.0))
    begin: float | None = None
    rolling = 0.0
    for (stamp, speed), (following, _) in pairwise(moments):
        if speed != 0:
            begin, rolling = None, _SETTLE
            continue
        begin = stamp + rolling if begin is None else begin
        stands.append((begin, following))
    best = max(stands, key=lambda stand: stand[1] - stand[0], default=(0.0, 0.0))
    if best[1] <= best[0]:
        raise InputError(f"{what}: the robot never stood: expected a recording while standing.")
    return best


def _pan_at(readings: Sequence[tuple[float, float]]) -> Callable[[float], float | None]:
    """The pan angle at a moment, interpolated; None where no readings are near."""
    stamps = np.array([stamp for stamp, _ in readings])
    angles = np.array([angle for _, angle in readings])

    def at(stamp: float) -> float | None:
        after = int(np.searchsorted(stamps, stamp))
        if after < len(stamps) and stamps[after] == stamp:
            return float(angles[after])
        if not 0 < after < len(stamps) or stamps[after] - stamps[after - 1] > _LARGEST_GAP:
            return None
        return float(np.interp(stamp, stamps, angles))

    return at
