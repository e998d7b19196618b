"""`polepilot calibrate camera --board`: the lens from pictures of a ChArUco board."""

from __future__ import annotations

import math
import re
import struct
import zlib
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from polepilot.commands.calibrate_camera import Picture
from polepilot.commands.files import write_whole
from polepilot.commands.outcome import Outcome
from polepilot.core.errors import InputError

if TYPE_CHECKING:
    from polepilot.core.verdict import Verdict
    from polepilot.core.vision.charuco import Board, LensFit
    from polepilot.server.settings import Settings
    from polepilot.server.settings_edit import Changes

_DPI = 300
_INCH = 0.0254
_MOST_PIXELS = 20_000


def parse_board(squares: str, square: float, marker: float, dictionary: str) -> Board:
    """The board that the options describe.

    Raises:
        InputError: there is no such board; names the option.
    """
    from polepilot.core.vision.charuco import Board

    match = re.fullmatch(r"\s*(\d{1,3})\s*[x×]\s*(\d{1,3})\s*", squares)
    if match is None:
        raise InputError(f"--squares is {squares!r}: expected COLUMNSxROWS, as 9x6.")
    try:
        return Board(int(match[1]), int(match[2]), square, marker, dictionary)
    except InputError as error:
        named = error.message.startswith(("square ", "marker ", "dictionary "))
        option = "--" if named else f"--squares {squares}: "
        raise InputError(f"{option}{error.message}") from error


@dataclass(frozen=True, slots=True)
class PrintedBoard:
    """A board that was drawn to scale, for people and for programs."""

    words: str
    document: dict[str, Any]
    """The ``--json`` document; lengths in metres."""


def write_board(board: Board, out: Path) -> PrintedBoard:
    """Draw the board to scale as PDF, SVG or PNG.

    Raises:
        InputError: no name of such a file, no such size of paper or picture, or not writable.
    """
    suffix = out.suffix.lower()
    if suffix not in (".pdf", ".svg", ".png"):
        raise InputError(f"--board-out {out}: expected a name that ends with .pdf, .svg or .png.")
    size = f"{board.width * 1000:g} x {board.height * 1000:g} mm"
    if suffix == ".png":
        write_whole({out: board_png(board)}, "--board-out")
        words = f"{out}: the board, {size}, at {_DPI} dots per inch or a little off; print to scale"
        return PrintedBoard(words, _board_document(board, out))
    from polepilot.core.printing.board import board_drawing
    from polepilot.core.printing.pdf import pdf_bytes
    from polepilot.core.printing.svg import svg_text

    words = (
        f"ChArUco {board.columns} x {board.rows}, squares {board.square * 1000:g} mm, "
        f"markers {board.marker * 1000:g} mm, {board.dictionary.upper()}"
    )
    drawing = board_drawing("Calibration board", board.width, board.height, board.black(), words)
    sheet = drawing.sheets[0]
    data = pdf_bytes(drawing) if suffix == ".pdf" else svg_text(sheet).encode()
    write_whole({out: data}, "--board-out")
    paper = [sheet.width / 1000, sheet.height / 1000]
    return PrintedBoard(
        f"{out}: the board, {size}, on paper of {sheet.width:g} x {sheet.height:g} mm",
        {**_board_document(board, out), "paper": paper},
    )


def _board_document(board: Board, out: Path) -> dict[str, Any]:
    return {
        "file": str(out),
        "squares": [board.columns, board.rows],
        "square": board.square,
        "marker": board.marker,
        "dictionary": board.dictionary.upper(),
        "width": board.width,
        "height": board.height,
    }


def board_png(board: Board) -> bytes:
    """The board with a white border, and its size on paper noted in the file."""
    import cv2

    pixels = max(round(board.square * _DPI / _INCH), 16)
    if max(board.columns, board.rows) * pixels > _MOST_PIXELS:
        raise InputError("--board-out: the board is too large for a PNG: take a .pdf.")
    edge = pixels // 2
    picture = cv2.copyMakeBorder(
        board.draw(pixels), edge, edge, edge, edge, cv2.BORDER_CONSTANT, value=(255,)
    )
    _, data = cv2.imencode(".png", picture)
    per_metre = round(pixels / board.square)
    body = b"pHYs" + struct.pack(">IIB", per_metre, per_metre, 1)
    chunk = struct.pack(">I", len(body) - 4) + body + struct.pack(">I", zlib.crc32(body))
    whole = data.tobytes()
    after = whole.index(b"IDAT") - 4
    return whole[:after] + chunk + whole[after:]


def calibrate_lens(
    pictures: Sequence[Picture], board: Board, settings: Settings, annotate: Path | None
) -> Outcome:
    """Find the board in all pictures, solve for the lens, and say what to make of it.

    Raises:
        InputError: too few pictures show the board.
    """
    from polepilot.core.vision.charuco import FEWEST_VIEWS, find_board, fit_lens, judge

    views = [find_board(picture.image, board, picture.name) for picture in pictures]
    seen = [view for view in views if view is not None]
    if len(seen) < FEWEST_VIEWS:
        none = ", ".join(p.name for p, view in zip(pictures, views, strict=True) if view is None)
        raise InputError(
            f"{len(seen)} of {len(pictures)} pictures show enough of the board: expected at least "
            f"{FEWEST_VIEWS}, better ten.",
            remedy=f"Not in: {none}. Check --squares, --square, --marker, --dictionary."
            if none
            else "",
        )
    fit = fit_lens(seen)
    if annotate is not None:
        _draw(pictures, fit, annotate)
    return _outcome(pictures, fit, settings, judge(fit))


def _outcome(
    pictures: Sequence[Picture], fit: LensFit, settings: Settings, verdict: Verdict
) -> Outcome:
    from polepilot.core.vision.calibration import resized

    results = {result.view.name: result for result in fit.views}
    rows: list[tuple[str, ...]] = []
    entries: list[dict[str, Any]] = []
    for picture in pictures:
        result = results.get(picture.name)
        if result is None:
            rows.append((picture.name, "0", "", "", "no board"))
            entries.append({"file": picture.name, "corners": 0, "used": False})
            continue
        count, tilt = len(result.view.pixels), math.degrees(result.tilt)
        rest = "" if result.used else "left out"
        rows.append((picture.name, str(count), f"{result.rms:.2f}", f"{tilt:.0f}", rest))
        entries.append(
            {
                "file": picture.name,
                "corners": count,
                "rms": result.rms,
                "tilt": result.tilt,
                "used": result.used,
            }
        )
    camera = fit.camera
    lens = ", ".join(f"{value:.5f}" for value in camera.distortion)
    lines = [
        f"camera constant {camera.constant:.2f} ± {fit.constant_error:.2f} pixels, centre "
        f"{camera.center_x:.2f}, {camera.center_y:.2f} for {camera.width} x {camera.height} "
        "pictures",
        f"distortion k1, k2, p1, p2, k3 = {lens}",
    ]
    small = resized(camera, settings.camera.width, settings.camera.height)
    if (small.width, small.height) != (camera.width, camera.height):
        lines.append(
            f"{small.constant:.2f} pixels, centre {small.center_x:.2f}, {small.center_y:.2f} for "
            f"the robot's {small.width} x {small.height} pictures"
        )
    document = {
        "pictures": entries,
        "constant": camera.constant,
        "standard_error": fit.constant_error,
        "width": camera.width,
        "height": camera.height,
        "center": [camera.center_x, camera.center_y],
        "distortion": list(camera.distortion),
        "rms": fit.rms,
    }
    changes: Changes = {
        "camera": {
            "constant_px": round(small.constant, 2),
            "center": (round(small.center_x, 2), round(small.center_y, 2)),
            "distortion": tuple(round(value, 6) for value in small.distortion),
        }
    }
    headings = ("picture", "corners", "rms px", "tilt °", "")
    return Outcome((headings, rows), tuple(lines), document, verdict, changes)


def _draw(pictures: Sequence[Picture], fit: LensFit, out: Path) -> None:
    from polepilot.commands.contact_sheet import GREEN, RED, Tile, write_sheet

    results = {result.view.name: result for result in fit.views}
    tiles = []
    for picture in pictures:
        tile, result = Tile(picture.image), results.get(picture.name)
        name = Path(picture.name).name
        if result is None:
            tile.say(f"{name}: no board", RED)
        else:
            colour = GREEN if result.used else RED
            for column, row in result.view.pixels:
                tile.spot((float(column), float(row)), colour)
            tilt = math.degrees(result.tilt)
            count = len(result.view.pixels)
            tile.say(
                f"{name}: {count} corners, rms {result.rms:.2f} px, tilted {tilt:.0f} deg", colour
            )
        tiles.append(tile)
    write_sheet(tiles, out)
