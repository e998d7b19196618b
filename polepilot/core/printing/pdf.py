"""A drawing as a PDF file: vectors to true scale, inks as a printer mixes them."""

from __future__ import annotations

import io
from typing import Any

from polepilot.core.printing.drawing import Box, Drawing, Ink, Item, Shape, Sheet, Stroke, Text
from polepilot.core.printing.fonts import BOLD, REGULAR, load_fonts

_POINT = 72 / 25.4
"""PDF's unit, points per millimetre."""


def pdf_bytes(drawing: Drawing) -> bytes:
    """The drawing as a PDF document, one page per sheet; the same bytes for the same drawing.

    The document asks viewers to print it without scaling, and has an outline entry per sheet.
    """
    # Only who prints needs it, and it takes a moment.
    from reportlab.pdfgen.canvas import Canvas

    load_fonts()
    buffer = io.BytesIO()
    # Without a first typeface the library names one that is not embedded.
    canvas = Canvas(
        buffer, invariant=1, pageCompression=1, pdfVersion=(1, 6), initialFontName=REGULAR
    )
    canvas.setTitle(drawing.title)
    canvas.setAuthor("")
    canvas.setSubject("Printed landmarks, to scale")
    canvas.setCreator("Polepilot")
    canvas.setViewerPreference("PrintScaling", "None")
    for number, sheet in enumerate(drawing.sheets):
        canvas.setPageSize((sheet.width * _POINT, sheet.height * _POINT))
        canvas.bookmarkPage(f"sheet{number}")
        canvas.addOutlineEntry(sheet.title, f"sheet{number}")
        _sheet(canvas, sheet)
        canvas.showPage()
    canvas.save()
    return buffer.getvalue()


def _sheet(canvas: Any, sheet: Sheet) -> None:
    for item in sheet.items:
        _item(canvas, sheet.height, item)


def _item(canvas: Any, height: float, item: Item) -> None:
    """PDF's y goes up from the sheet's lower edge."""
    match item:
        case Box(x, y, width, tall, ink):
            _fill(canvas, ink)
            corner = (x * _POINT, (height - y - tall) * _POINT)
            canvas.rect(*corner, width * _POINT, tall * _POINT, stroke=0, fill=1)
        case Stroke(points, ink, width, dash):
            _pen(canvas, ink)
            canvas.setLineWidth(width * _POINT)
            canvas.setDash([dash * _POINT] * 2 if dash else [])
            canvas.drawPath(_path(canvas, height, points), stroke=1, fill=0)
        case Shape(points, ink):
            _fill(canvas, ink)
            path = _path(canvas, height, points)
            path.close()
            canvas.drawPath(path, stroke=0, fill=1)
        case Text():
            _text(canvas, height, item)


def _path(canvas: Any, height: float, points: tuple[tuple[float, float], ...]) -> Any:
    path = canvas.beginPath()
    for index, (x, y) in enumerate(points):
        (path.lineTo if index else path.moveTo)(x * _POINT, (height - y) * _POINT)
    return path


def _text(canvas: Any, height: float, text: Text) -> None:
    _fill(canvas, text.ink)
    canvas.saveState()
    canvas.setFont(BOLD if text.bold else REGULAR, text.size * _POINT)
    canvas.translate(text.x * _POINT, (height - text.y) * _POINT)
    if text.angle:
        canvas.rotate(text.angle)
    draw = {
        "start": canvas.drawString,
        "middle": canvas.drawCentredString,
        "end": canvas.drawRightString,
    }
    draw[text.anchor](0, 0, text.words)
    canvas.restoreState()


def _fill(canvas: Any, ink: Ink) -> None:
    if ink.cmyk is not None:
        canvas.setFillColorCMYK(*ink.cmyk)
    else:
        canvas.setFillColorRGB(*ink.channels)


def _pen(canvas: Any, ink: Ink) -> None:
    if ink.cmyk is not None:
        canvas.setStrokeColorCMYK(*ink.cmyk)
    else:
        canvas.setStrokeColorRGB(*ink.channels)
