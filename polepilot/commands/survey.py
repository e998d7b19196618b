"""`polepilot survey`: where the poles stand, from a recorded drive."""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

if TYPE_CHECKING:
    from polepilot.core.geometry import Point
    from polepilot.core.landmark import LandmarkKind
    from polepilot.core.localization.survey_result import Survey
    from polepilot.core.localization.survey_run import SurveyOptions, SurveyRun
    from polepilot.core.observation import PanReading, RangeBearing
    from polepilot.core.robot.dataset import Dataset
    from polepilot.core.site import Site

Kinds = dict[int, "LandmarkKind"]

_MARGIN = 0.5
"""The outline of a site that has none yet keeps so far off poles and path, metres."""
_NEAR = 0.12
"""Pan readings so long before and after a picture say where it was pointed, seconds."""
_GIVEN_UP = 0.25
"""Farther from a picture than this no reading says anything."""
_COUNT = math.radians(270) / 1023
"""One step of the potentiometer's converter, radians."""


def survey(
    recording: Annotated[
        Path,
        typer.Argument(
            metavar="RECORDING",
            help="Folder with dataset.json, samples.jsonl and pictures; or the log of a run "
            "(run.mcap), or its folder.",
        ),
    ],
    site_file: Annotated[
        Path | None, typer.Option("--site", help="Site to put the poles into, or to refine.")
    ] = None,
    refine: Annotated[
        bool,
        typer.Option(
            "--refine",
            help="The poles of --site (else of the recording) were measured by hand: put them "
            "right, and say which one was measured wrongly.",
        ),
    ] = False,
    distance: Annotated[
        tuple[int, int, float] | None,
        typer.Option(metavar="ID ID METRES", help="How far apart two poles stand, by tape."),
    ] = None,
    anchor: Annotated[
        list[str] | None,
        typer.Option(metavar="ID=X,Y", help="Where a pole stands, m; twice or more."),
    ] = None,
    map_sigma: Annotated[
        float, typer.Option(help="How well the map to refine was measured, m.")
    ] = 0.01,
    range_sigma: Annotated[
        float,
        typer.Option(help="How wrong all ranges may be together, as a share: 0.001 is 0.1 %."),
    ] = 0.001,
    ids: Annotated[
        str | None, typer.Option(help="Ids to look for, as 1-15; those of the recording without.")
    ] = None,
    out: Annotated[Path | None, typer.Option("--out", help="Write SITE.json here.")] = None,
    plot: Annotated[
        Path | None, typer.Option("--plot", help="Write a drawing, SVG or PNG.")
    ] = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print one JSON document.")] = False,
) -> None:
    """Find out where all poles stand, from a drive past them. Nothing has to be measured."""
    from dataclasses import replace

    from polepilot.commands.files import write_whole
    from polepilot.core.errors import InputError
    from polepilot.core.localization.survey import survey as build
    from polepilot.core.localization.survey_run import SurveyOptions
    from polepilot.core.site import read_site

    if plot is not None and plot.suffix.lower() not in (".svg", ".png"):
        raise InputError(f"--plot {plot}: expected a name that ends in .svg or .png.")
    site = None if site_file is None else read_site(site_file)
    options = SurveyOptions(
        map_sigma=map_sigma,
        range_sigma=range_sigma,
        distance=distance,
        anchors=_anchors(anchor or []),
    )
    data = read_recording(recording)
    options = replace(options, **_coordinates(site, data, refine, options))
    if site is not None and out is not None and not _tied(options):
        raise InputError(
            f"--out {out}: nothing ties the survey to the walls of {site_file}: expected --refine, "
            "two --anchor, or a site whose start has a heading, from which the drive began."
        )
    kinds, default = _kinds(recording, data, site, ids)
    with _bar() as tell:
        run, left_out = to_run(data, kinds, lambda share: tell("reading pictures", share))
        try:
            found = build(run, options, tell)
        except InputError as error:
            raise InputError(f"{recording}: {error.message}", remedy=error.remedy) from error
    if out is not None and not found.converged:
        raise InputError(
            f"{recording}: the fit has not converged, {out} is not written: expected a drive round "
            "all poles, each of them seen from several sides."
        )
    files: dict[Path, bytes] = {}
    if out is not None:
        document = site_document(found, site, kinds, default, recording.resolve().name)
        files[out] = (json.dumps(document, indent=1) + "\n").encode()
    if files:
        write_whole(files)
    if plot is not None:
        from polepilot.core.localization.survey_plot import plot_survey

        background = site if _tied(options) else None
        write_whole({plot: plot_survey(found, background).encoded(plot)}, "--plot")
    if as_json:
        extra = {
            "pictures": len(run.pictures),
            "sightings": run.sightings(),
            "travelled": run.travelled(),
        }
        notes = [*data.notes, *left_out, *found.notes]
        typer.echo(json.dumps({**found.to_json(), "notes": notes, **extra}, allow_nan=False))
    else:
        typer.echo("\n".join([*_summary(found, run), *data.notes, *left_out]))


def read_recording(path: Path) -> Dataset:
    """A dataset folder, the log of a run, or the folder of a run.

    Raises:
        DatasetError: none of them, or one that cannot be used.
    """
    from polepilot.core.robot.dataset import read_dataset
    from polepilot.core.robot.run_log import find_log, read_run_log

    log = None if (path / "dataset.json").exists() else find_log(path)
    return read_dataset(path) if log is None else read_run_log(log)


def to_run(
    data: Dataset, kinds: Kinds, progress: Callable[[float], None]
) -> tuple[SurveyRun, list[str]]:
    """What was driven and seen, and which pictures told nothing; pictures are read here.

    Raises:
        DatasetError: none of the pictures can be used.
    """
    from itertools import pairwise

    from polepilot.core.errors import DatasetError, ImageError
    from polepilot.core.localization.survey_run import SurveyRun
    from polepilot.core.observation import Odometry, PanReading
    from polepilot.core.robot.dataset import LONGEST_GAP, FrameFile, Sighted
    from polepilot.core.vision.detector import LandmarkDetector
    from polepilot.core.vision.images import read_image
    from polepilot.core.vision.measure import to_range_bearing

    pan = _PanAt([s for s in data.samples if isinstance(s, PanReading)])
    detector = LandmarkDetector(data.camera, kinds, data.paint)
    pictures = []
    unusable: list[str] = []
    unpointed: list[str] = []
    for sample in data.samples:
        if isinstance(sample, Sighted):
            seen = tuple(m for m in sample.measurements if math.isfinite(m.bearing))
            pictures.append((sample.stamp, seen))
        elif isinstance(sample, FrameFile):
            seen = ()
            try:
                image = read_image(sample.path)
                size, wanted = image.shape[:2], (data.camera.height, data.camera.width)
                if size != wanted:
                    raise ImageError(
                        f"{sample.path}: {size[1]} x {size[0]} pixels: expected "
                        f"{wanted[1]} x {wanted[0]}."
                    )
            except ImageError as error:
                unusable.append(f"samples.jsonl:{sample.line}: {error.message}")
            else:
                pointing = pan(sample.stamp)
                if pointing is None:
                    unpointed.append(
                        f"samples.jsonl:{sample.line}: no pan reading within {_GIVEN_UP} s."
                    )
                else:
                    angle, sigma = pointing
                    seen = tuple(
                        _less_sure(to_range_bearing(one, sample.stamp, angle), sigma)
                        for one in detector.detect(image)
                    )
            pictures.append((sample.stamp, seen))
            progress(len(pictures) / data.frames)
    if pictures and len(unusable) + len(unpointed) == len(pictures):
        problem = (unusable or unpointed)[-1]
        raise DatasetError(f"{data.folder}: none of its pictures can be used; {problem}")
    left_out = [
        f"Left out, as {why}: {len(those)} of {len(pictures)} pictures, the first one {those[0]}"
        for why, those in (
            ("they cannot be read", unusable),
            ("nobody knows where the camera pointed", unpointed),
        )
        if those
    ]
    gaps = [a.stamp for a, b in pairwise(data.samples) if b.stamp - a.stamp > LONGEST_GAP]
    run = SurveyRun(
        odometry=tuple(s for s in data.samples if isinstance(s, Odometry)),
        pictures=tuple(pictures),
        wheelbase=data.vehicle.wheelbase,
        camera_forward=data.camera.forward,
        pan_range=max(abs(data.pan_minimum), abs(data.pan_maximum)),
        breaks=tuple(gaps),
    )
    return run, left_out


def site_document(
    found: Survey, site: Site | None, kinds: Kinds, default: LandmarkKind, name: str
) -> dict[str, Any]:
    """The SITE.json document: ``site`` with the poles where they were found.

    Without a site the outline is a rectangle around all that is known, for a person to redraw.
    """
    from dataclasses import replace

    from polepilot.core.landmark import Landmark
    from polepilot.core.site import Site, Start, parse_site

    old = {} if site is None else site.landmarks_by_id()
    placed = {
        pole.id: Landmark(
            pole.id,
            round(pole.x, 4),
            round(pole.y, 4),
            old[pole.id].kind if pole.id in old else kinds.get(pole.id, default),
        )
        for pole in found.poles
    }
    marks = [placed.pop(number, mark) for number, mark in old.items()]
    marks += [mark for _, mark in sorted(placed.items())]
    if site is None:
        spots = [pole.position for pole in found.poles] + [pose.position for _, pose in found.path]
        low_x, high_x = min(x for x, _ in spots) - _MARGIN, max(x for x, _ in spots) + _MARGIN
        low_y, high_y = min(y for _, y in spots) - _MARGIN, max(y for _, y in spots) + _MARGIN
        ring = ((low_x, low_y), (high_x, low_y), (high_x, high_y), (low_x, high_y))
        start = Start(*(round(value, 4) for value in found.path[0][1]))
        outline = tuple((round(x, 2), round(y, 2)) for x, y in ring)
        site = Site(boundary=outline, name=f"Survey of {name}", start=start)
    document = replace(site, landmarks=tuple(marks)).to_json()
    parse_site(document, "the surveyed site")
    return document


class _PanAt:
    """Where the camera pointed, from the readings before and after a moment."""

    def __init__(self, readings: Sequence[PanReading]) -> None:
        import numpy as np

        self._stamps = np.array([reading.stamp for reading in readings])
        self._angles = np.array([reading.angle for reading in readings])

    def __call__(self, stamp: float) -> tuple[float, float] | None:
        """Angle and its standard deviation, radians; None where no reading is near."""
        import numpy as np

        away = np.abs(self._stamps - stamp)
        if float(away.min()) > _GIVEN_UP:
            return None
        near = away <= _NEAR
        inside = bool(self._stamps[0] <= stamp <= self._stamps[-1])
        if inside and np.count_nonzero(near) >= 4:
            # A line is finer than one converter step, unless the camera turns round just here.
            rate, angle = np.polyfit(self._stamps[near] - stamp, self._angles[near], 1)
            left = self._angles[near] - angle - rate * (self._stamps[near] - stamp)
            if float(np.abs(left).max()) < 1.1 * _COUNT:
                return float(angle), 0.2 * _COUNT
        sigma = (0.3 if inside else 3.0) * _COUNT
        return float(np.interp(stamp, self._stamps, self._angles)), sigma


def _less_sure(measurement: RangeBearing, sigma: float) -> RangeBearing:
    from dataclasses import replace

    return replace(measurement, bearing_sigma=math.hypot(measurement.bearing_sigma, sigma))


def _kinds(
    recording: Path, data: Dataset, site: Site | None, ids: str | None
) -> tuple[Kinds, LandmarkKind]:
    """What the poles look like that may stand here, and what any other would look like."""
    from polepilot.commands.ids import parse_ids
    from polepilot.core.landmark import LandmarkKind
    from polepilot.core.robot.fields import Fields, parse_json

    default = LandmarkKind()
    path = recording / "dataset.json"
    if path.is_file():
        root = Fields(path, "", parse_json(path.read_text(encoding="utf-8-sig"), path))
        default = root.child("landmark").kind()
    known = {number: mark.kind for number, mark in data.landmarks.items()}
    if site is not None:
        known |= {mark.id: mark.kind for mark in site.landmarks}
    if ids is not None:
        return {k: known.get(k, default) for k in parse_ids(ids, default.bits)}, default
    return known or dict.fromkeys(range(1, 2**default.bits), default), default


def _coordinates(
    site: Site | None, data: Dataset, refine: bool, options: SurveyOptions
) -> dict[str, Any]:
    """What the recording's coordinates refer to: a map to refine, or where the drive began."""
    from polepilot.core.errors import InputError
    from polepilot.core.geometry import Pose2D

    if refine:
        marks = data.landmarks if site is None else site.landmarks_by_id()
        if not marks:
            raise InputError("--refine: there are no poles to refine: expected a map with poles.")
        return {"hand_measured": {number: mark.position for number, mark in marks.items()}}
    start = None if site is None or options.anchors else site.start
    if start is None or start.heading is None:
        return {}
    return {"start": Pose2D(start.x, start.y, start.heading)}


def _tied(options: SurveyOptions) -> bool:
    """Whether the survey's coordinates are those of the site."""
    return bool(options.hand_measured or options.anchors or options.start)


def _anchors(texts: Sequence[str]) -> dict[int, Point]:
    from polepilot.core.errors import InputError

    found: dict[int, Point] = {}
    for text in texts:
        name, _, place = text.partition("=")
        try:
            number = int(name)
            x, y = (float(part) for part in place.split(","))
        except ValueError:
            number, x, y = 0, math.nan, math.nan
        if not (math.isfinite(x) and math.isfinite(y)):
            raise InputError(f"--anchor is {text!r}: expected ID=X,Y in metres, as 3=1.5,4.")
        if number in found:
            raise InputError(f"--anchor {number} is given twice.")
        found[number] = (x, y)
    return found


@contextmanager
def _bar() -> Iterator[Callable[[str, float], None]]:
    """A progress bar on standard error, where a person sees it."""
    from rich.console import Console
    from rich.progress import Progress

    screen = Console(stderr=True)
    with Progress(console=screen, transient=True, disable=not screen.is_terminal) as bars:
        task = bars.add_task("reading", total=1.0)
        yield lambda text, share: bars.update(task, description=text, completed=share)


def _summary(found: Survey, run: SurveyRun) -> Iterator[str]:
    """The table for a person, and what else there is to say."""
    refers = {
        "first pose": "the origin is where the drive began, x its heading",
        "start": "the drive began at the site's start",
        "anchors": "the anchors define the coordinates",
        "map": "in the coordinates of the map that was refined",
    }[found.frame]
    yield (
        f"{len(found.poles)} poles from {run.sightings()} sightings in {len(run.pictures)} "
        f"pictures, {run.travelled():.0f} m driven; {refers}"
    )
    measured = any(pole.measured is not None for pole in found.poles)
    yield f"{'pole':>4} {'x m':>9} {'y m':>9} {'± cm':>6} {'seen':>5}" + (
        f" {'moved by cm':>12}" if measured else ""
    )
    for pole in found.poles:
        line = f"{pole.id:4d} {pole.x:9.3f} {pole.y:9.3f} {100 * pole.sigma:6.1f}"
        line += f" {pole.sightings:5d}"
        if measured:
            moved = pole.moved
            line += f" {'new' if moved is None else f'{100 * math.hypot(*moved):.1f}':>12}"
            line += "  WRONG" if pole.wrong else ""
        yield line
    for pole in found.wrong:
        moved, place = pole.moved, pole.measured
        if moved is not None and place is not None:
            yield (
                f"pole {pole.id} was measured wrongly, or was moved: {100 * math.hypot(*moved):.0f}"
                f" cm off. It stands at ({pole.x:.3f}, {pole.y:.3f}), not at ({place[0]:.3f}, "
                f"{place[1]:.3f})."
            )
    if measured and not found.wrong:
        yield "no pole contradicts the map."
    for one in found.not_placed:
        yield f"pole {one.id} is not placed ({one.sightings} sightings): {one.reason}."
    yield from found.notes
    speed, steering = found.distortions["speed_scale"], found.distortions["steering_offset"]
    yield (
        f"besides: speed {100 * (speed.value - 1):+.1f} % (± {100 * speed.sigma:.1f}), steering "
        f"{math.degrees(steering.value):+.2f}° (± {math.degrees(steering.sigma):.2f}) against what "
        "was told"
    )
