"""A sheet as an SVG file: one user unit is one millimetre, and the file says so.

What is part of the code has ``class="code"``, so that a plotter's or a cutter's program can pick it
out; paint that goes on under the next sheet has ``class="bleed"``.
"""

from __future__ import annotations

from html import escape

from polepilot.core.printing.drawing import Box, Item, Shape, Sheet, Stroke, Text
from polepilot.core.printing.fonts import FAMILY


def svg_text(sheet: Sheet) -> str:
    """The sheet as an SVG document."""
    width, height = _number(sheet.width), _number(sheet.height)
    body = "\n".join(_item(item) for item in sheet.items)
    return (
        f'<svg xmlns="http://www.w3.org/2000/svg" width="{width}mm" height="{height}mm"'
        f' viewBox="0 0 {width} {height}" font-family="{FAMILY}">\n'
        f"<title>{escape(sheet.title)}</title>\n"
        f'<rect width="{width}" height="{height}" fill="#ffffff"/>\n'
        f"{body}\n</svg>\n"
    )


def _item(item: Item) -> str:
    match item:
        case Box(x, y, width, height, ink, role):
            return (
                f'<rect{_class(role)} x="{_number(x)}" y="{_number(y)}" width="{_number(width)}"'
                f' height="{_number(height)}" fill="{ink.rgb}"/>'
            )
        case Stroke(points, ink, width, dash, role):
            dashes = f' stroke-dasharray="{_number(dash)}"' if dash else ""
            return (
                f'<polyline{_class(role)} points="{_points(points)}" fill="none"'
                f' stroke="{ink.rgb}" stroke-width="{_number(width)}"{dashes}/>'
            )
        case Shape(points, ink):
            return f'<polygon points="{_points(points)}" fill="{ink.rgb}"/>'
        case Text():
            return _text(item)


def _text(text: Text) -> str:
    x, y = _number(text.x), _number(text.y)
    turn = f' transform="rotate({_number(-text.angle)} {x} {y})"' if text.angle else ""
    anchor = f' text-anchor="{text.anchor}"' if text.anchor != "start" else ""
    weight = ' font-weight="bold"' if text.bold else ""
    return (
        f'<text x="{x}" y="{y}" font-size="{_number(text.size)}" fill="{text.ink.rgb}"'
        f"{anchor}{weight}{turn}>{escape(text.words)}</text>"
    )


def _class(role: str) -> str:
    return f' class="{role}"' if role else ""


def _points(points: tuple[tuple[float, float], ...]) -> str:
    return " ".join(f"{_number(x)},{_number(y)}" for x, y in points)


def _number(value: float) -> str:
    """To a ten-thousandth of a millimetre, without idle zeros."""
    text = f"{value:.4f}".rstrip("0").rstrip(".")
    return "0" if text in ("-0", "") else text
