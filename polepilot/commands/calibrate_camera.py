"""`polepilot calibrate camera` with landmarks: the camera constant from known distances."""

from __future__ import annotations

import csv
import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

from polepilot.commands.drawings import real
from polepilot.commands.outcome import Outcome
from polepilot.core.errors import ImageError, InputError

if TYPE_CHECKING:
    from polepilot.core.landmark import LandmarkKind
    from polepilot.core.observation import Detection, Image
    from polepilot.core.vehicle import Camera
    from polepilot.core.verdict import Verdict
    from polepilot.core.vision.calibration import ConstantFit
    from polepilot.core.vision.paint import Paint
    from polepilot.server.settings import Settings

_PASSES = 8
_CLOSE = 1e-6
"""Constants nearer than this share of them are the same."""


@dataclass(frozen=True, slots=True, eq=False)
class Picture:
    """A picture file, read."""

    name: str
    image: Image

    @property
    def size(self) -> tuple[int, int]:
        """Columns and rows."""
        return self.image.shape[1], self.image.shape[0]


def read_pictures(files: Sequence[str]) -> list[Picture]:
    """All ``files``, which have to be different and of one size.

    Raises:
        ImageError: some cannot be read, or differ in size; all of them are named.
        InputError: one of them is given twice, by whatever name.
    """
    from polepilot.core.vision.images import read_image

    if not files:
        raise InputError("no picture is given: expected at least one.")
    names: dict[str, str] = {}
    for file in files:
        place = real(file)
        if place in names:
            also = "" if names[place] == file else f", first as {names[place]}"
            raise InputError(f"{file}: is given twice{also}: expected different pictures.")
        names[place] = file
    pictures, problems = [], []
    for file in files:
        try:
            pictures.append(Picture(file, read_image(file)))
        except ImageError as error:
            problems.append(error.message.rstrip("."))
    if problems:
        raise ImageError("; ".join(problems) + ".")
    width, height = pictures[0].size
    for picture in pictures:
        if picture.size != (width, height):
            own = "{} x {}".format(*picture.size)
            raise ImageError(
                f"{picture.name}: has {own} pixels and {pictures[0].name} {width} x {height}: "
                "expected pictures of one size."
            )
    return pictures


def calibrate_constant(
    pictures: Sequence[Picture],
    distances: Sequence[float],
    kinds: dict[int, LandmarkKind],
    only: int | None,
    settings: Settings,
    annotate: Path | None,
) -> Outcome:
    """Find the constant, draw what was seen, and say what to make of it."""
    from polepilot.core.vision.calibration import judge

    camera = starting_camera(settings, *pictures[0].size)
    camera, fit = solve_constant(pictures, distances, kinds, only, camera, settings.paint)
    if annotate is not None:
        _draw(pictures, fit, kinds, annotate)
    return _outcome(camera, fit, settings, judge(fit, camera.width))


def starting_camera(settings: Settings, width: int, height: int) -> Camera:
    """What robot.toml knows of the camera, for pictures of this size.

    Pictures may be those that the robot sees, or those that its camera delivers before they are
    averaged down.
    """
    from polepilot.core.vision.calibration import before_resizing

    # The file's lens, whether it is in use or the robot is being simulated.
    known = settings.camera.distortion if any(settings.camera.distortion) else ()
    camera = replace(settings.model.camera, distortion=known)
    return before_resizing(camera, width, height)


def solve_constant(
    pictures: Sequence[Picture],
    distances: Sequence[float],
    kinds: dict[int, LandmarkKind],
    only: int | None,
    camera: Camera,
    paint: Paint,
) -> tuple[Camera, ConstantFit]:
    """Look, fit, and look again with what was found: the detector's view of pitch and lens
    depends a little on the constant.

    Raises:
        InputError: a picture shows no landmark, or several and ``only`` chooses none.
    """
    from polepilot.core.vision.calibration import KnownRange, fit_constant
    from polepilot.core.vision.detector import LandmarkDetector

    for _ in range(_PASSES):
        detector = LandmarkDetector(camera, kinds, paint)
        found = _choose([(p.name, detector.detect(p.image)) for p in pictures], only, kinds)
        samples = [
            KnownRange(p.name, distance, seen, camera.constant, kinds[seen.id].axis_depth)
            for p, distance, seen in zip(pictures, distances, found, strict=True)
        ]
        fit = fit_constant(samples)
        change = abs(fit.constant / camera.constant - 1)
        camera = replace(camera, constant=fit.constant)
        if change < _CLOSE:
            break
    return camera, fit


def parse_distances(options: Sequence[str], files: Sequence[str]) -> list[float]:
    """A distance per file from ``3.0``, ``3.0 4.5`` (in order), ``FILE=3.0`` or ``FILES.csv``.

    Raises:
        InputError: a number is none, a name fits no picture, or a picture has no distance or two.
    """
    plain: list[float] = []
    named: dict[str, float] = {}
    for text in options:
        name, equals, number = text.rpartition("=")
        if equals:
            entries = [(f"--distance {text}", name, number)]
        elif text.lower().endswith(".csv"):
            entries = _entries_in(Path(text))
        else:
            plain.append(_metres(text, f"--distance {text}"))
            continue
        for where, name, number in entries:
            file = _picture_named(name, files, where)
            if file in named:
                raise InputError(
                    f"{where}: {file} has a distance already, {named[file]:g} m: expected one for "
                    "each picture."
                )
            named[file] = _metres(number, where)
    rest = [file for file in files if file not in named]
    if len(plain) == 1:
        plain *= len(rest)
    if len(plain) != len(rest):
        if not plain:
            raise InputError(
                f"{rest[0]}: its distance is missing: expected --distance {rest[0]}=METRES."
            )
        raise InputError(
            f"--distance is given {len(plain)} times for {len(rest)} pictures: expected one for "
            "all, one for each, or FILE=METRES."
        )
    in_order = iter(plain)
    return [named[file] if file in named else next(in_order) for file in files]


def _entries_in(path: Path) -> list[tuple[str, str, str]]:
    """Rows of ``picture,metres``, each after where it stands, for messages.

    A first row that is a heading is passed over.
    """
    try:
        text = path.read_text(encoding="utf-8-sig")
        table = list(csv.reader(text.splitlines()))
    except (OSError, UnicodeDecodeError, csv.Error) as error:
        no_text = "no text" if isinstance(error, UnicodeDecodeError) else error
        why = getattr(error, "strerror", None) or no_text
        raise InputError(f"--distance {path}: cannot be read ({why}).") from error
    found: list[tuple[str, str, str]] = []
    rows = [row for row in table if any(cell.strip() for cell in row)]
    for number, row in enumerate(rows, start=1):
        where = f"{path}: row {number}"
        if len(row) != 2:
            raise InputError(f"{where}: has {len(row)} columns: expected picture,metres.")
        name, metres = (cell.strip() for cell in row)
        if number == 1 and not any(character.isdigit() for character in metres):
            continue
        found.append((where, name, metres))
    return found


def _picture_named(name: str, files: Sequence[str], where: str) -> str:
    if name in files:
        return name
    same = {file for file in files if Path(file).name == Path(name).name}
    if len(same) != 1:
        what = "is none of the pictures" if not same else "could be several of the pictures"
        raise InputError(f"{where}: {name!r} {what}.")
    return same.pop()


def _metres(text: str, where: str) -> float:
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        raise InputError(f"{where}: expected metres, as 3.0.")
    return value


def _choose(
    found: Sequence[tuple[str, list[Detection]]], only: int | None, kinds: dict[int, LandmarkKind]
) -> list[Detection]:
    chosen, none = [], []
    for name, detections in found:
        wanted = [d for d in detections if only is None or d.id == only]
        if len(wanted) > 1:
            ids = ", ".join(str(d.id) for d in wanted)
            raise InputError(f"{name}: shows landmarks {ids}: choose one with --id.")
        if not wanted:
            ids = ", ".join(str(d.id) for d in detections)
            none.append(f"{name} (it shows {ids})" if ids else name)
        chosen += wanted
    if none:
        what = "no landmark" if only is None else f"no landmark {only}"
        sizes = sorted({(k.bits, k.segment) for k in kinds.values()})
        said = " or ".join(f"{bits} bits and segments of {s * 100:g} cm" for bits, s in sizes)
        raise InputError(f"{', '.join(none)}: {what} was found; expected a whole one of {said}.")
    return chosen


def _outcome(camera: Camera, fit: ConstantFit, settings: Settings, verdict: Verdict) -> Outcome:
    from polepilot.core.vision.calibration import resized

    rows = [
        (
            r.sample.name,
            str(r.sample.detection.id),
            f"{r.sample.distance:.3f}",
            f"{r.measured:.3f}",
            f"{r.error * 100:+.1f}",
            f"{r.share * 100:+.2f}",
            "" if r.agrees else "left out",
        )
        for r in fit.residuals
    ]
    lines = [
        f"camera constant {fit.constant:.2f} ± {fit.standard_error:.2f} pixels for "
        f"{camera.width} x {camera.height} pictures"
    ]
    small = resized(camera, settings.camera.width, settings.camera.height)
    if (small.width, small.height) != (camera.width, camera.height):
        lines.append(
            f"{small.constant:.2f} pixels for the robot's {small.width} x {small.height} pictures"
        )
    document = {
        "pictures": [
            {
                "file": r.sample.name,
                "id": r.sample.detection.id,
                "distance": r.sample.distance,
                "measured": r.measured,
                "residual": r.error,
                "residual_share": r.share,
                "sigma": r.sigma,
                "agrees": r.agrees,
            }
            for r in fit.residuals
        ],
        "constant": fit.constant,
        "standard_error": fit.standard_error,
        "width": camera.width,
        "height": camera.height,
        "center": [camera.center_x, camera.center_y],
    }
    headings = ("picture", "id", "given m", "measured m", "residual cm", "residual %", "")
    changes = {"camera": {"constant_px": round(small.constant, 2)}}
    return Outcome((headings, rows), tuple(lines), document, verdict, changes)


def _draw(
    pictures: Sequence[Picture], fit: ConstantFit, kinds: dict[int, LandmarkKind], out: Path
) -> None:
    from polepilot.commands.contact_sheet import GREEN, RED, Tile, write_sheet

    tiles = []
    for picture, residual in zip(pictures, fit.residuals, strict=True):
        seen, colour = residual.sample.detection, GREEN if residual.agrees else RED
        kind = kinds[seen.id]
        unit = (seen.bottom - seen.top) / kind.segments
        half = unit * kind.diameter / kind.segment / 2
        left, right = seen.column - half, seen.column + half
        tile = Tile(picture.image)
        for edge in range(kind.segments + 1):
            row = seen.top + edge * unit
            # The code's ends all across, the edges between its segments beside it.
            ticks = [(left, right)] if edge in (0, kind.segments) else []
            ticks += [(left - half / 2, left), (right, right + half / 2)]
            for first, last in ticks:
                tile.line((first, row), (last, row), colour)
        for side in (left, right):
            tile.line((side, seen.top), (side, seen.bottom), colour)
        tile.say(f"{Path(picture.name).name}: landmark {seen.id}")
        tile.say(
            f"given {residual.sample.distance:.3f} m, measured {residual.measured:.3f} m: "
            f"{residual.error * 100:+.1f} cm",
            colour,
        )
        tiles.append(tile)
    write_sheet(tiles, out)
