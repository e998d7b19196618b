"""The files: what they say is what was drawn, at its true size."""

from __future__ import annotations

import math
import re
from xml.etree import ElementTree

import pytest
from printed import read_pdf, read_svg, rulers

from polepilot.core.landmark import LandmarkKind
from polepilot.core.printing.drawing import Box, Drawing, Ink, Sheet, Text
from polepilot.core.printing.job import PrintJob
from polepilot.core.printing.paper import parse_paper
from polepilot.core.printing.pdf import pdf_bytes
from polepilot.core.printing.svg import svg_text

JOBS = [
    PrintJob((1, 13)),
    PrintJob((2, 4, 7), LandmarkKind(shape="flat")),
    PrintJob((200,), LandmarkKind(8, 0.12, 0.17), parse_paper("A1"), bright=Ink("#00a0ff")),
]


@pytest.mark.parametrize("job", JOBS)
def test_both_formats_show_the_drawing_to_scale(job: PrintJob) -> None:
    drawing = job.drawing()
    from_pdf = read_pdf(pdf_bytes(drawing))
    from_svg = [read_svg(svg_text(sheet)) for sheet in drawing.sheets]
    assert len(from_pdf) == len(drawing.sheets)
    for sheet, pdf, svg in zip(drawing.sheets, from_pdf, from_svg, strict=True):
        wanted = [item for item in sheet.items if isinstance(item, Box)]
        for read, colors in (
            (pdf, [box.ink.cmyk or box.ink.channels for box in wanted]),
            (svg, [box.ink.channels for box in wanted]),
        ):
            assert (read.width, read.height) == pytest.approx((sheet.width, sheet.height), abs=1e-3)
            assert len(read.boxes) == len(wanted)
            for box, color, (place, paint) in zip(wanted, colors, read.boxes, strict=True):
                assert place == pytest.approx((box.x, box.y, box.width, box.height), abs=1e-3)
                assert paint == pytest.approx(color, abs=1e-3)
            assert rulers(read) == [pytest.approx(100.0, abs=1e-3)]


def test_the_contract_in_the_file_itself() -> None:
    """A 7 cm tube: segments of 50 mm, pi x 70 mm around and 10 mm to glue, 65 cm in all."""
    sheets = read_pdf(pdf_bytes(PrintJob((13,)).drawing()))
    heights: dict[tuple[float, ...], float] = {}
    for sheet in sheets[1:]:
        around = [box for box in sheet.boxes if box[0][2] > 10]
        for (_, _, width, height), color in around:
            assert width == pytest.approx(math.pi * 70, abs=1e-3)
            heights[color] = heights.get(color, 0.0) + height
        right = max(x + width for (x, _, width, _), _ in around)
        outer = max(max(x0, x1) for x0, y0, x1, y1 in sheet.lines if abs(y0 - y1) > 60)
        assert outer - right == pytest.approx(10.0, abs=0.2)
    assert heights == {
        (0.0, 0.65, 1.0, 0.0): pytest.approx(7 * 50, abs=1e-2),  # 1101000101011
        (0.5, 0.4, 0.4, 1.0): pytest.approx(13 * 50, abs=1e-2),  # below all of it
    }


def test_pdf_asks_not_to_be_scaled_and_carries_its_typeface() -> None:
    data = pdf_bytes(PrintJob((1,)).drawing())
    assert data.startswith(b"%PDF-1.6")
    assert data.rstrip().endswith(b"%%EOF")
    assert b"/PrintScaling /None" in data
    fonts = re.findall(rb"/BaseFont /([\w+-]+)", data)
    assert fonts
    assert len({font for font in fonts if b"Vera" not in font}) == 0
    assert len(set(fonts)) == data.count(b"/FontFile2 ")
    assert b"/Title" in data
    assert b"anonymous" not in data


def test_the_same_drawing_is_the_same_file() -> None:
    job = JOBS[0]
    assert pdf_bytes(job.drawing()) == pdf_bytes(job.drawing())


def test_outline_names_the_parts() -> None:
    data = pdf_bytes(PrintJob((13,)).drawing()).decode("latin-1")
    for part in range(1, 5):
        assert f"Landmark 13, part {part} of 4" in data


def test_words_with_signs_of_xml() -> None:
    words = 'a < b & "c" > d'
    sheet = Sheet(150, 150, words, (Text(10, 10, words, angle=90, bold=True, anchor="end"),))
    root = ElementTree.fromstring(svg_text(sheet))
    (text,) = (element for element in root.iter() if element.tag.endswith("}text"))
    assert text.text == words
    assert text.attrib["transform"] == "rotate(-90 10 10)"
    assert pdf_bytes(Drawing(words, (sheet,))).startswith(b"%PDF")
