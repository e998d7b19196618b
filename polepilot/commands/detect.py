"""`polepilot detect`: read landmarks in picture files."""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from polepilot.commands.ids import parse_ids
from polepilot.core.errors import ImageError, InputError

if TYPE_CHECKING:
    from polepilot.core.landmark import LandmarkKind
    from polepilot.core.observation import Detection, Image
    from polepilot.core.vehicle import Camera
    from polepilot.core.vision.detector import Detector


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
    detector: Annotated[str, typer.Option(help="default or paper.")] = "default",
    annotate: Annotated[
        Path | None, typer.Option(metavar="OUT.png", help="Draw what was found (one picture).")
    ] = None,
    as_json: Annotated[bool, typer.Option("--json", help="One JSON document.")] = False,
) -> None:
    """Find landmarks in pictures: id, range to the axis, bearing (left positive)."""
    from polepilot.core.vision.images import read_image

    if not (math.isfinite(camera_constant) and camera_constant > 0):
        raise InputError(f"--camera-constant is {camera_constant}: expected pixels, above 0.")
    if detector not in ("default", "paper"):
        raise InputError(f"--detector is {detector!r}: expected 'default' or 'paper'.")
    if annotate is not None and len(files) != 1:
        raise InputError(f"--annotate draws one picture: got {len(files)}.")
    axis = None if center is None else parse_center(center)
    kinds = kinds_of(ids, bits, segment, diameter, shape)
    images: list[Image] = []
    problems = []
    for file in files:
        try:
            images.append(read_image(file))
        except ImageError as error:
            problems.append(error.message.rstrip("."))
    if problems:
        raise ImageError("; ".join(problems) + ".")
    frames: list[tuple[str, list[Detection]]] = []
    for file, image in zip(files, images, strict=True):
        camera = _camera(image, camera_constant, axis)
        found = _detector(detector, camera, kinds).detect(image)
        frames.append((file, found))
        if annotate is not None:
            _annotate(image, found, annotate)
    if as_json:
        document = {
            "frames": [{"file": name, "detections": [_entry(d) for d in f]} for name, f in frames]
        }
        typer.echo(json.dumps(document))
    else:
        _table(frames)


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


def _camera(image: Image, constant: float, axis: tuple[float, float] | None) -> Camera:
    from polepilot.core.vehicle import Camera

    height, width = image.shape[:2]
    x, y = axis if axis is not None else ((width - 1) / 2, (height - 1) / 2)
    return Camera(constant=constant, width=width, height=height, center_x=x, center_y=y)


def _detector(name: str, camera: Camera, kinds: dict[int, LandmarkKind]) -> Detector:
    from polepilot.core.vision.detector import LandmarkDetector
    from polepilot.core.vision.paper import PaperDetector

    return PaperDetector(camera, kinds) if name == "paper" else LandmarkDetector(camera, kinds)


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


def _table(frames: list[tuple[str, list[Detection]]]) -> None:
    from rich.console import Console
    from rich.table import Table

    table = Table("picture", "id", "range cm", "± cm", "bearing °", "± °", "column")
    for name, found in frames:
        if not found:
            table.add_row(name, "-", "", "", "", "", "")
        for d in found:
            table.add_row(
                name,
                str(d.id),
                f"{d.range * 100:.1f}",
                f"{d.range_sigma * 100:.1f}",
                f"{math.degrees(d.bearing):+.2f}",
                f"{math.degrees(d.bearing_sigma):.2f}",
                f"{d.column:.1f}",
            )
    Console().print(table)


def _annotate(image: Image, found: list[Detection], out: Path) -> None:
    import cv2

    scale = 2
    size = (image.shape[1] * scale, image.shape[0] * scale)
    canvas = cv2.resize(image, size, interpolation=cv2.INTER_NEAREST)
    if canvas.ndim == 2:
        canvas = cv2.cvtColor(canvas, cv2.COLOR_GRAY2BGR)
    green = (80, 255, 80)
    for d in found:
        half = max((d.bottom - d.top) * 0.08, 2.0)
        corners = [(d.column - half, d.top), (d.column + half, d.bottom)]
        first, last = ((round((x + 0.5) * scale), round((y + 0.5) * scale)) for x, y in corners)
        cv2.rectangle(canvas, first, last, green, 1, cv2.LINE_AA)
        text = f"{d.id}: {d.range * 100:.1f} cm {math.degrees(d.bearing):+.2f} deg"
        place = (min(first[0], max(size[0] - 230, 0)), max(first[1] - 6, 14))
        cv2.putText(canvas, text, place, cv2.FONT_HERSHEY_SIMPLEX, 0.5, green, 1, cv2.LINE_AA)
    try:
        written = cv2.imwrite(str(out), canvas)
    except cv2.error:
        written = False
    if not written:
        raise InputError(f"--annotate {out}: cannot be written; expected a new .png or .jpg file.")
