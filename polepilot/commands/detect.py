"""`polepilot detect`: read landmarks in picture files."""

from __future__ import annotations

import json
import math
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from polepilot.commands.drawings import encoded, place_for_each
from polepilot.commands.files import whole_files
from polepilot.commands.ids import parse_ids
from polepilot.core.errors import InputError

if TYPE_CHECKING:
    from polepilot.core.landmark import LandmarkKind
    from polepilot.core.observation import Detection, Image
    from polepilot.core.vehicle import Camera
    from polepilot.core.vision.detector import LandmarkDetector, Look
    from polepilot.core.vision.paint import Paint
    from polepilot.core.vision.paper import PaperDetector


@dataclass(frozen=True, slots=True)
class _Seen:
    """What is kept of a picture after it was looked at."""

    file: str
    found: tuple[Detection, ...]
    summary: str
    """In words: what was found and rejected."""

    @classmethod
    def of(cls, file: str, look: Look) -> _Seen:
        from polepilot.core.vision.annotate import summary

        return cls(file, tuple(one.detection for one in look.found), summary(look))


def detect(
    files: Annotated[list[str], typer.Argument(help="Pictures; each is looked at by itself.")],
    camera_constant: Annotated[
        float, typer.Option(help="Camera constant in pixels, for the pictures as given.")
    ] = 600.0,
    center: Annotated[
        str | None,
        typer.Option(metavar="CX,CY", help="Optical axis in pixels; default: the middle."),
    ] = None,
    bits: Annotated[int, typer.Option(help="Bits per landmark: 4, 5, 6 or 8.")] = 4,
    ids: Annotated[
        str | None, typer.Option(help="Ids that exist, as 1-15 or 1,3,7-9; default: all.")
    ] = None,
    segment: Annotated[float, typer.Option(help="Length of a segment, metres.")] = 0.05,
    diameter: Annotated[float, typer.Option(help="Thickness or width, metres.")] = 0.07,
    shape: Annotated[str, typer.Option(help="cylinder or flat.")] = "cylinder",
    bright: Annotated[
        str,
        typer.Option(help="Colour of bright segments: orange, green, #00a040, ...; or white."),
    ] = "orange",
    detector: Annotated[str, typer.Option(help="default or paper.")] = "default",
    annotate: Annotated[
        Path | None,
        typer.Option(
            metavar="OUT.png",
            help="Draw what was found, and what was not and why; of several pictures OUT-1.png, "
            "OUT-2.png, ...",
        ),
    ] = None,
    as_json: Annotated[bool, typer.Option("--json", help="One JSON document.")] = False,
) -> None:
    """Find landmarks in pictures: id, range to the axis, bearing (left positive)."""
    from polepilot.core.vision.annotate import annotate as draw
    from polepilot.core.vision.images import read_image

    if not (math.isfinite(camera_constant) and camera_constant > 0):
        raise InputError(f"--camera-constant is {camera_constant}: expected pixels, above 0.")
    if detector not in ("default", "paper"):
        raise InputError(f"--detector is {detector!r}: expected 'default' or 'paper'.")
    drawings = [] if annotate is None else place_for_each(annotate, files)
    paint = paint_of(bright)
    if detector == "paper" and str(paint) != "orange":
        raise InputError(f"--bright is {bright!r}: expected 'orange' with --detector paper.")
    axis = None if center is None else parse_center(center)
    kinds = kinds_of(ids, bits, segment, diameter, shape)
    seen: list[_Seen] = []
    problems: list[str] = []
    with whole_files("--annotate") as write:
        # One picture at a time, so that thousands need no more memory than one.
        for index, file in enumerate(files):
            try:
                image = read_image(file)
                if problems:
                    continue  # all that is wrong is said, nothing else is done any more
                camera = _camera(image, camera_constant, axis)
                look = _detector(detector, camera, kinds, paint).examine(image)
                if drawings:
                    out = drawings[index]
                    write(out, encoded(draw(image, look, Path(file).name), out))
            except InputError as error:
                problems.append(error.message.rstrip("."))
            else:
                seen.append(_Seen.of(file, look))
        if problems:
            raise InputError("; ".join(problems) + ".")
    if as_json:
        document = {
            "frames": [
                {"file": one.file, "detections": [_entry(found) for found in one.found]}
                for one in seen
            ]
        }
        typer.echo(json.dumps(document))
    else:
        _table(seen)


def parse_center(text: str) -> tuple[float, float]:
    """``"199.5,149.5"`` as two finite numbers.

    Raises:
        InputError: anything else.
    """
    try:
        x, y = (float(part) for part in text.split(","))
    except ValueError:
        x = y = math.nan
    if not (math.isfinite(x) and math.isfinite(y)):
        raise InputError(f"--center is {text!r}: expected CX,CY in pixels, as 199.5,149.5.")
    return x, y


def kinds_of(
    ids: str | None, bits: int, segment: float, diameter: float, shape: str
) -> dict[int, LandmarkKind]:
    """The landmarks that the options describe, by id.

    Raises:
        InputError: there are no such landmarks; names the option.
    """
    from polepilot.core.landmark import LandmarkKind

    if shape not in ("cylinder", "flat"):
        raise InputError(f"--shape is {shape!r}: expected 'cylinder' or 'flat'.")
    try:
        kind = LandmarkKind(
            bits=bits,
            segment=segment,
            diameter=diameter,
            shape="cylinder" if shape == "cylinder" else "flat",
        )
    except InputError as error:
        raise InputError(f"--{error.message}") from error  # its fields are our options
    chosen = range(1, 2**bits) if ids is None else parse_ids(ids, bits)
    return dict.fromkeys(chosen, kind)


def paint_of(bright: str) -> Paint:
    """The colour that ``--bright`` names.

    Raises:
        InputError: there is no such colour, or nobody could see it.
    """
    from polepilot.core.vision.paint import Paint

    try:
        return Paint.parse(bright)
    except InputError as error:
        raise InputError(f"--{error.message}") from error


def _camera(image: Image, constant: float, axis: tuple[float, float] | None) -> Camera:
    from polepilot.core.vehicle import Camera

    height, width = image.shape[:2]
    x, y = axis if axis is not None else ((width - 1) / 2, (height - 1) / 2)
    return Camera(constant=constant, width=width, height=height, center_x=x, center_y=y)


def _detector(
    name: str, camera: Camera, kinds: dict[int, LandmarkKind], paint: Paint
) -> LandmarkDetector | PaperDetector:
    from polepilot.core.vision.detector import LandmarkDetector
    from polepilot.core.vision.paper import PaperDetector

    if name == "paper":
        return PaperDetector(camera, kinds)
    return LandmarkDetector(camera, kinds, paint)


def _entry(detection: Detection) -> dict[str, Any]:
    return {
        "id": detection.id,
        "range": detection.range,
        "bearing": detection.bearing,
        "column": detection.column,
        "top": detection.top,
        "bottom": detection.bottom,
        "range_sigma": detection.range_sigma,
        "bearing_sigma": detection.bearing_sigma,
    }


def _table(seen: list[_Seen]) -> None:
    from rich.console import Console
    from rich.table import Table
    from rich.text import Text

    from polepilot.core.vision.images import shown

    table = Table("picture", "id", "range cm", "± cm", "bearing °", "± °", "column")
    for one in seen:
        # As Text: brackets and colons in a name are no markup.
        name = Text(shown(one.file))
        if not one.found:
            table.add_row(name, "-", "", "", "", "", "")
        for d in one.found:
            table.add_row(
                name,
                str(d.id),
                f"{d.range * 100:.1f}",
                f"{d.range_sigma * 100:.1f}",
                f"{math.degrees(d.bearing):+.2f}",
                f"{math.degrees(d.bearing_sigma):.2f}",
                f"{d.column:.1f}",
            )
    console = Console()
    console.print(table)
    for one in seen:
        if not one.found:
            console.print(Text(f"{shown(one.file)}: {one.summary}."), soft_wrap=True)
