"""Reading printed sheets back: what a PDF or SVG file draws where, in millimetres.

Written against the file formats, not against the writers: only what our sheets use is known, and
anything else is an error.
"""

from __future__ import annotations

import base64
import re
import zlib
from dataclasses import dataclass, field
from itertools import pairwise
from xml.etree import ElementTree

POINT = 25.4 / 72
Color = tuple[float, ...]
Rectangle = tuple[float, float, float, float]


@dataclass
class ReadSheet:
    """x, y (of the top left corner, downwards), width, height and colour of each rectangle."""

    width: float
    height: float
    boxes: list[tuple[Rectangle, Color]] = field(default_factory=list)
    lines: list[tuple[float, float, float, float]] = field(default_factory=list)


def read_pdf(data: bytes) -> list[ReadSheet]:
    """The pages of a PDF document in their order."""
    objects = {
        int(number): body
        for number, body in re.findall(rb"(?m)^(\d+) 0 obj\s(.*?)endobj", data, re.DOTALL)
    }
    (pages,) = (body for body in objects.values() if b"/Type /Pages" in body)
    kids = re.search(rb"/Kids \[(.*?)\]", pages, re.DOTALL)
    assert kids is not None
    sheets = []
    for number in re.findall(rb"(\d+) 0 R", kids[1]):
        page = objects[int(number)]
        box = re.search(rb"/MediaBox \[ 0 0 ([\d.]+) ([\d.]+) \]", page)
        contents = re.search(rb"/Contents (\d+) 0 R", page)
        assert box is not None
        assert contents is not None
        assert b"/UserUnit" not in page
        sheet = ReadSheet(float(box[1]) * POINT, float(box[2]) * POINT)
        _run(_stream(objects[int(contents[1])]).decode("latin-1"), sheet)
        sheets.append(sheet)
    return sheets


def _stream(body: bytes) -> bytes:
    head, _, rest = body.partition(b"stream\n")
    data = rest[: rest.rindex(b"endstream")]
    if b"/ASCII85Decode" in head:
        data = base64.a85decode(data.strip().removesuffix(b"~>"))
    return zlib.decompress(data) if b"/FlateDecode" in head else data


def _run(content: str, sheet: ReadSheet) -> None:
    content = re.sub(r"\bBT\b.*?\bET\b", " ", content, flags=re.DOTALL)
    numbers: list[float] = []
    fill: Color = (0.0,)
    turned: list[bool] = [False]
    path: list[tuple[float, float]] = []
    rectangle: Rectangle | None = None
    for token in re.sub(r"\[[^\]]*\]", " ", content).split():
        if re.fullmatch(r"[-+]?(\d+\.?\d*|\.\d+)", token):
            numbers.append(float(token))
            continue
        if token == "q":
            turned.append(turned[-1])
        elif token == "Q":
            turned.pop()
        elif token == "cm":
            turned[-1] = turned[-1] or numbers != [1, 0, 0, 1, 0, 0]
        elif token in ("k", "rg"):
            fill = tuple(numbers)
        elif token == "re":
            assert not turned[-1], "only words are moved or turned"
            x, y, width, height = (number * POINT for number in numbers)
            rectangle = (x, sheet.height - y - height, width, height)
        elif token in ("m", "l"):
            assert not turned[-1]
            if token == "m":
                path = []
            path.append((numbers[0] * POINT, sheet.height - numbers[1] * POINT))
        elif token == "S":
            for (x0, y0), (x1, y1) in pairwise(path):
                sheet.lines.append((x0, y0, x1, y1))
        elif token in ("f", "f*"):
            if rectangle is not None:
                sheet.boxes.append((rectangle, fill))
            rectangle = None
        else:
            assert token in ("n", "h", "w", "d", "K", "RG", "j", "J"), token
        numbers = []


def read_svg(text: str) -> ReadSheet:
    """One SVG sheet; the white paper itself is left out."""
    root = ElementTree.fromstring(text)
    width, height = (float(root.attrib[name].removesuffix("mm")) for name in ("width", "height"))
    assert root.attrib["width"].endswith("mm")
    assert root.attrib["viewBox"] == f"0 0 {width:g} {height:g}"
    sheet = ReadSheet(width, height)
    for element in list(root.iter())[1:]:
        kind = element.tag.rpartition("}")[2]
        if kind == "rect" and "x" in element.attrib:
            x, y, w, h = (float(element.attrib[name]) for name in ("x", "y", "width", "height"))
            color = element.attrib["fill"]
            rgb = tuple(int(color[i : i + 2], 16) / 255 for i in (1, 3, 5))
            sheet.boxes.append(((x, y, w, h), rgb))
        elif kind == "polyline":
            numbers = [float(n) for n in re.split(r"[ ,]", element.attrib["points"])]
            points = list(zip(numbers[::2], numbers[1::2], strict=True))
            for (x0, y0), (x1, y1) in pairwise(points):
                sheet.lines.append((x0, y0, x1, y1))
        assert kind in ("title", "rect", "polyline", "polygon", "text"), kind
    return sheet


def rulers(sheet: ReadSheet) -> list[float]:
    """Lengths of upright lines that have a line across at either end and twenty-one in all."""
    found = []
    for x0, y0, x1, y1 in sheet.lines:
        if abs(x0 - x1) < 1e-6 and abs(y0 - y1) > 20:
            across = [
                line
                for line in sheet.lines
                if abs(line[1] - line[3]) < 1e-6 and abs(max(line[0], line[2]) - x0) < 1e-3
            ]
            ends = {round(line[1], 2) for line in across}
            if len(across) == 21 and {round(y0, 2), round(y1, 2)} <= ends:
                found.append(abs(y1 - y0))
    return found
