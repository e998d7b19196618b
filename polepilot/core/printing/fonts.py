"""The typeface of printed sheets: Bitstream Vera Sans, which is embedded in PDF files.

An embedded typeface looks the same in every viewer and print shop, and its widths are known here.
"""

from __future__ import annotations

from functools import cache

REGULAR, BOLD = "Vera", "VeraBd"
FAMILY = "Bitstream Vera Sans, DejaVu Sans, Verdana, sans-serif"
"""For SVG, which names a typeface and takes a similar one where it is missing."""


@cache
def load_fonts() -> None:
    """Make the typeface known to the PDF library, once."""
    # Only who prints needs the library, and it takes a moment.
    from reportlab.pdfbase import pdfmetrics
    from reportlab.pdfbase.ttfonts import TTFont

    for name in (REGULAR, BOLD):
        pdfmetrics.registerFont(TTFont(name, f"{name}.ttf"))


def text_width(words: str, size: float, bold: bool = False) -> float:
    """How long a line is, in the unit of ``size``."""
    from reportlab.pdfbase import pdfmetrics

    load_fonts()
    return float(pdfmetrics.stringWidth(words, BOLD if bold else REGULAR, size))


def wrap(words: str, size: float, width: float, bold: bool = False) -> list[str]:
    """The words broken into lines of at most ``width``; a longer word has a line to itself."""
    lines = [""]
    for word in words.split():
        longer = f"{lines[-1]} {word}".strip()
        if lines[-1] and text_width(longer, size, bold) > width:
            lines.append(word)
        else:
            lines[-1] = longer
    return lines
