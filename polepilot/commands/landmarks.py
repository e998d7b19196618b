"""`polepilot landmarks`: print landmarks to scale, and choose ids that are hard to confuse."""

from __future__ import annotations

import json
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from polepilot.commands.ids import parse_ids
from polepilot.core.errors import InputError
from polepilot.core.landmark import (
    LandmarkKind,
    id_set,
    recommended_ids,
    spacing,
)

if TYPE_CHECKING:
    from polepilot.core.printing.job import PrintJob
    from polepilot.core.printing.pages import Page

app = typer.Typer(help="Print landmarks to scale, choose their ids.")

_SAFE = "safe"
_LARGER = ("A3", "A2", "A1", "A0")


@app.command(name="print")
def print_landmarks(
    out: Annotated[Path, typer.Option(metavar="FILE.pdf|FILE.svg", help="What to write.")],
    ids: Annotated[
        str, typer.Option(help="As 1-15 or 1,3,7-9; 'safe': ids that are hard to confuse.")
    ] = _SAFE,
    count: Annotated[int | None, typer.Option(help="How many, with --ids safe.")] = None,
    bits: Annotated[int, typer.Option(help="Bits per landmark: 4, 5, 6 or 8.")] = 4,
    segment: Annotated[float, typer.Option(help="Length of a segment, metres.")] = 0.05,
    diameter: Annotated[float, typer.Option(help="Thickness or width, metres.")] = 0.07,
    shape: Annotated[str, typer.Option(help="cylinder or flat.")] = "cylinder",
    paper: Annotated[
        str,
        typer.Option(
            help="A5 to A0, Letter, Legal, Tabloid, a size in mm as 420x594, or a roll's width in"
            " mm as roll-610."
        ),
    ] = "A4",
    overlap: Annotated[float, typer.Option(help="Strips and flaps to glue, mm.")] = 10.0,
    bright: Annotated[
        str,
        typer.Option(help="Colour of bright segments, as for detect: orange, green, #00a040, ..."),
    ] = "orange",
    dark: Annotated[
        str | None, typer.Option(metavar="#RRGGBB", help="Dark colour; default: black.")
    ] = None,
    as_json: Annotated[bool, typer.Option("--json", help="One JSON document.")] = False,
) -> None:
    """Draw landmarks to true scale, to be cut out and wrapped around tubes or stuck on walls."""
    from polepilot.commands.detect import paint_of
    from polepilot.commands.files import write_whole
    from polepilot.core.printing.drawing import Ink
    from polepilot.core.printing.job import ORANGE, RICH_BLACK, PrintJob
    from polepilot.core.printing.paper import parse_paper
    from polepilot.core.printing.pdf import pdf_bytes
    from polepilot.core.printing.svg import svg_text

    suffix = out.suffix.lower()
    if suffix not in (".pdf", ".svg"):
        raise InputError(f"--out {out}: expected a file whose name ends with .pdf or .svg.")
    if shape not in ("cylinder", "flat"):
        raise InputError(f"--shape is {shape!r}: expected 'cylinder' or 'flat'.")
    with _naming_options():
        kind = LandmarkKind(bits, segment, diameter, "flat" if shape == "flat" else "cylinder")
        chosen = _chosen(ids, bits, count)
        sheet = parse_paper(paper)
    paint = paint_of(bright)
    bright_ink = ORANGE if paint.rgb == ORANGE.rgb else Ink(paint.rgb)
    with _naming_options("--dark: "):
        dark_ink = RICH_BLACK if dark is None else Ink(dark)
    with _naming_options():
        job = PrintJob(chosen, kind, sheet, overlap, bright_ink, dark_ink)
    pages = job.pages()
    drawing = job.drawing(pages)
    if suffix == ".pdf":
        files = {out: pdf_bytes(drawing)}
    else:
        digits = len(str(len(drawing.sheets)))
        files = {
            out.with_name(f"{out.stem}-{number:0{digits}}{out.suffix}"): svg_text(page).encode()
            for number, page in enumerate(drawing.sheets, start=1)
        }
    write_whole(files)
    _warn(chosen, bits)
    if as_json:
        document = {
            "files": [str(path) for path in files],
            "sheets": len(drawing.sheets),
            "parts": pages[0].placed[0].tile.parts,
            "ids": list(chosen),
            "spacing": spacing(chosen, bits) if len(chosen) > 1 else None,
        }
        typer.echo(json.dumps(document))
    else:
        typer.echo(_summary(job, pages, list(files)))


@app.command()
def ids(
    bits: Annotated[int, typer.Option(help="Bits per landmark: 4, 5, 6 or 8.")] = 5,
    count: Annotated[int | None, typer.Option(help="How many; default: as many as can be.")] = None,
    distance: Annotated[
        int | None,
        typer.Option(
            help="Segments in which any two differ, 1 to 4; default: 2, or more if fewer."
        ),
    ] = None,
    as_json: Annotated[bool, typer.Option("--json", help="One JSON document.")] = False,
) -> None:
    """Recommend ids that a hidden or dirty segment does not turn into each other."""
    with _naming_options():
        if distance is None:
            chosen = recommended_ids(bits, count)
        else:
            whole = id_set(bits, distance)
            if count is not None and not 1 <= count <= len(whole):
                raise InputError(
                    f"count is {count}: {bits} bits have {len(whole)} ids that differ in"
                    f" {distance} segments; expected 1 to {len(whole)}."
                )
            chosen = whole[:count]
    apart = spacing(chosen, bits) if len(chosen) > 1 else None
    if as_json:
        typer.echo(json.dumps({"bits": bits, "spacing": apart, "ids": list(chosen)}))
        return
    typer.echo(",".join(map(str, chosen)))
    if apart is not None:
        plural = "segment" if apart == 1 else "segments"
        typer.echo(f"{len(chosen)} ids of {bits} bits; any two differ in {apart} {plural} or more.")


def _chosen(text: str, bits: int, count: int | None) -> tuple[int, ...]:
    if text.strip().lower() == _SAFE:
        return recommended_ids(bits, count)
    if count is not None:
        raise InputError("--count goes with --ids safe only.")
    return tuple(parse_ids(text, bits))


def _warn(chosen: tuple[int, ...], bits: int) -> None:
    """With 4 bits every id is needed by most sites; with more there is room to be careful."""
    if bits < 5 or len(chosen) < 2 or spacing(chosen, bits) > 1:
        return
    far = len(id_set(bits))
    better = f"--ids safe --count {len(chosen)}" if len(chosen) <= far else "--ids safe"
    listed = ",".join(map(str, recommended_ids(bits, min(len(chosen), far))))
    if len(listed) > 60:
        listed = f"{min(len(chosen), far)} ids"
    typer.echo(
        f"warning: some of these ids differ in one segment only, and a hidden one turns one into"
        f" another; safer: {better} ({listed}).",
        err=True,
    )


def _summary(job: PrintJob, pages: tuple[Page, ...], files: list[Path]) -> str:
    from polepilot.core.printing.artwork import ids_in_words

    names = str(files[0]) if len(files) == 1 else f"{files[0]} to {files[-1].name}"
    parts = pages[0].placed[0].tile.parts
    each = f", {parts} parts each" if parts > 1 else ""
    listed = ids_in_words(job.ids, "-")
    lines = [
        f"{names}: 1 sheet of instructions and {len(pages)} of {job.paper.name}"
        f" with {'landmark' if len(job.ids) == 1 else 'landmarks'} {listed}{each}.",
        "Print at 100 % and measure: the ruler on each sheet must be 100 mm long.",
    ]
    if parts > 1:
        fewer = list(_fewer(job, len(pages)))
        if fewer:
            lines.append(f"Larger paper needs fewer sheets: {', '.join(fewer)}.")
    return "\n".join(lines)


def _fewer(job: PrintJob, sheets: int) -> Iterator[str]:
    """What larger paper would need, as "30 of A3"."""
    from polepilot.core.printing.pages import arrange
    from polepilot.core.printing.paper import parse_paper

    for name in _LARGER:
        try:
            needed = len(arrange(job.ids, job.kind, parse_paper(name), job.overlap))
        except InputError:
            continue
        if needed < sheets:
            sheets = needed
            yield f"{needed} of {name}"


@contextmanager
def _naming_options(prefix: str = "--") -> Iterator[None]:
    """Errors of the core speak of fields: here they speak of options."""
    try:
        yield
    except InputError as error:
        if error.message.startswith("--"):
            raise
        raise InputError(f"{prefix}{error.message}") from error
