"""A sheet of a schematic: lines, boxes, words and the usual symbols, as SVG."""

from __future__ import annotations

from html import escape

INK, SOFT, FAINT, PAPER, PANEL = "#1b2127", "#5b6570", "#d3dae1", "#ffffff", "#f5f7f9"
MOTOR, LOGIC, SIGNAL, SENSE, STOP = "#d9480f", "#7048b6", "#0b62a8", "#0f766e", "#b91c1c"
"""Motor supply, 5 V, what the chip drives, what it reads, what stops."""
FONT = "system-ui, 'Segoe UI', Roboto, 'Liberation Sans', 'DejaVu Sans', Helvetica, sans-serif"


def _n(value: float) -> str:
    return f"{value:.1f}".removesuffix(".0")


class Sheet:
    """Grows as it is drawn upon; coordinates are points, y down."""

    def __init__(self, width: float, height: float, title: str, words: str) -> None:
        self._parts: list[str] = []
        self.width, self.height, self._title = width, height, title
        self.text(40, 50, title, size=22, weight=650)
        self.text(40, 74, words, size=13.5, color=SOFT)

    def svg(self) -> str:
        """The whole document."""
        size = f'viewBox="0 0 {_n(self.width)} {_n(self.height)}" width="{_n(self.width)}"'
        return "\n".join(
            [
                f'<svg xmlns="http://www.w3.org/2000/svg" {size} height="{_n(self.height)}" '
                f'font-family="{FONT}" role="img">',
                f"<title>{escape(self._title)}</title>",
                f'<rect width="{_n(self.width)}" height="{_n(self.height)}" rx="10" '
                f'fill="{PAPER}"/>',
                *self._parts,
                "</svg>\n",
            ]
        )

    def text(
        self,
        x: float,
        y: float,
        words: str,
        *,
        size: float = 13,
        color: str = INK,
        anchor: str = "start",
        weight: int = 400,
    ) -> None:
        bold = f' font-weight="{weight}"' if weight != 400 else ""
        self._parts.append(
            f'<text x="{_n(x)}" y="{_n(y)}" font-size="{_n(size)}" fill="{color}" '
            f'text-anchor="{anchor}"{bold}>{escape(words)}</text>'
        )

    def line(
        self,
        *points: tuple[float, float],
        color: str = INK,
        width: float = 1.6,
        dashed: bool = False,
    ) -> None:
        way = "L".join(f"{_n(x)} {_n(y)}" for x, y in points)
        dash = ' stroke-dasharray="5 4"' if dashed else ""
        self._parts.append(
            f'<path d="M{way}" fill="none" stroke="{color}" stroke-width="{_n(width)}" '
            f'stroke-linejoin="round" stroke-linecap="round"{dash}/>'
        )

    def box(
        self,
        x: float,
        y: float,
        width: float,
        height: float,
        *,
        fill: str = PANEL,
        color: str = FAINT,
        radius: float = 8,
        line: float = 1.4,
    ) -> None:
        self._parts.append(
            f'<rect x="{_n(x)}" y="{_n(y)}" width="{_n(width)}" height="{_n(height)}" '
            f'rx="{_n(radius)}" fill="{fill}" stroke="{color}" stroke-width="{_n(line)}"/>'
        )

    def dot(self, x: float, y: float, color: str = INK, radius: float = 3.2) -> None:
        self._parts.append(f'<circle cx="{_n(x)}" cy="{_n(y)}" r="{_n(radius)}" fill="{color}"/>')

    def ring(self, x: float, y: float, radius: float, color: str = INK, fill: str = PAPER) -> None:
        self._parts.append(
            f'<circle cx="{_n(x)}" cy="{_n(y)}" r="{_n(radius)}" fill="{fill}" stroke="{color}" '
            'stroke-width="1.6"/>'
        )

    # ---- symbols -----------------------------------------------------------------------------

    def tag(self, x: float, y: float, words: str, color: str = SOFT) -> None:
        """A small label on a wire, centred."""
        width = 6.0 * len(words) + 14
        self.box(x - width / 2, y - 9, width, 18, fill=PAPER, color=color, radius=9, line=1)
        self.text(x, y + 4, words, size=10.5, color=color, anchor="middle")

    def ground(self, x: float, y: float, color: str = INK) -> None:
        """Three bars below ``y``."""
        for index, half in enumerate((9, 6, 2.5)):
            self.line((x - half, y + 4 * index), (x + half, y + 4 * index), color=color)

    def supply(self, x: float, y: float, words: str, color: str) -> None:
        """An arrow up to a rail, its name above."""
        self.line((x, y), (x, y - 12), color=color)
        self.line((x - 4, y - 8), (x, y - 13), (x + 4, y - 8), color=color)
        self.text(x, y - 18, words, size=11, color=color, anchor="middle", weight=600)

    def resistor(self, x: float, y: float, words: str = "", *, upright: bool = True) -> None:
        """32 points long, centred."""
        if upright:
            self.box(x - 5, y - 16, 10, 32, fill=PAPER, color=INK, radius=1, line=1.5)
            self.text(x + 10, y + 4, words, size=11, color=SOFT)
        else:
            self.box(x - 16, y - 5, 32, 10, fill=PAPER, color=INK, radius=1, line=1.5)
            self.text(x, y - 10, words, size=11, color=SOFT, anchor="middle")

    def motor(self, x: float, y: float, words: str) -> None:
        self.ring(x, y, 17)
        self.text(x, y + 5, "M", size=15, anchor="middle", weight=600)
        self.text(x, y + 33, words, size=11.5, color=SOFT, anchor="middle")

    def opener(self, x: float, y: float, color: str = STOP) -> None:
        """A contact that is closed until pressed, 40 points wide, ``y`` its wire."""
        self.dot(x - 20, y, color)
        self.dot(x + 20, y, color)
        self.line((x - 20, y), (x + 23, y + 6), color=color, width=2)
        self.line((x + 20, y), (x + 20, y + 6), color=color, width=2)

    def closer(self, x: float, y: float, color: str = INK) -> None:
        """A contact that is open at rest, 40 points wide."""
        self.dot(x - 20, y, color)
        self.dot(x + 20, y, color)
        self.line((x - 20, y), (x + 16, y - 13), color=color, width=2)

    def diode(self, x: float, y: float, color: str = INK) -> None:
        """Upright, conducting upward, 24 points high."""
        points = f"{_n(x - 8)},{_n(y + 7)} {_n(x + 8)},{_n(y + 7)} {_n(x)},{_n(y - 7)}"
        self._parts.append(f'<polygon points="{points}" fill="{color}"/>')
        self.line((x - 8, y - 7), (x + 8, y - 7), color=color)

    def mushroom(self, x: float, y: float) -> None:
        """The red button, seen from the side; ``y`` is its foot."""
        self._parts.append(
            f'<path d="M{_n(x - 24)} {_n(y - 22)}a24 15 0 0 1 48 0z" fill="{STOP}"/>'
        )
        self.box(x - 7, y - 22, 14, 22, fill="#e5e7eb", color=SOFT, radius=1, line=1.2)
