"""A printing job: which landmarks, what they look like, on which paper; and its drawing.

The default orange is 65 % magenta and 100 % yellow, which every printer has as pure inks; the
default black is black ink with colours beneath. Black ink is carbon and stays dark to infrared
cameras, which a black mixed of colours does not.
"""

from __future__ import annotations

from dataclasses import dataclass, field

from polepilot.core.errors import InputError
from polepilot.core.landmark import LandmarkKind, encode
from polepilot.core.printing.artwork import ids_in_words, sheet_items, tile_items
from polepilot.core.printing.drawing import Drawing, Ink, Sheet
from polepilot.core.printing.instructions import Contents, instructions
from polepilot.core.printing.pages import Page, arrange
from polepilot.core.printing.paper import Paper, parse_paper

ORANGE = Ink("#ff6600", (0.0, 0.65, 1.0, 0.0))
RICH_BLACK = Ink("#000000", (0.5, 0.4, 0.4, 1.0))
OVERLAPS = (5.0, 40.0)
"""Strips and flaps to glue, mm: from what glue needs to what paper can spare."""
_LEAST_CONTRAST = 0.1
"""Linear light, in the channel in which the bright ink is brightest: there edges are measured."""


@dataclass(frozen=True, slots=True)
class PrintJob:
    """What to print. ``overlap`` is the width of the strips and flaps to glue, mm."""

    ids: tuple[int, ...]
    kind: LandmarkKind = field(default_factory=LandmarkKind)
    paper: Paper = field(default_factory=lambda: parse_paper("A4"))
    overlap: float = 10.0
    bright: Ink = ORANGE
    dark: Ink = RICH_BLACK

    def __post_init__(self) -> None:
        if not self.ids:
            raise InputError("ids are missing: expected at least one landmark.")
        if len(set(self.ids)) != len(self.ids):
            raise InputError("ids name a landmark twice: expected each once.")
        for number in self.ids:
            encode(number, self.kind.bits)
        if not OVERLAPS[0] <= self.overlap <= OVERLAPS[1]:
            raise InputError(
                f"overlap is {self.overlap:g} mm: expected {OVERLAPS[0]:g} to {OVERLAPS[1]:g} mm."
            )
        most = max(self.bright.light)
        there = self.dark.light[self.bright.light.index(most)]
        if most < there + _LEAST_CONTRAST or self.bright.luminance <= self.dark.luminance:
            raise InputError(
                f"bright is {self.bright.rgb} and dark is {self.dark.rgb}:"
                " expected bright to be much brighter than dark."
            )

    @property
    def title(self) -> str:
        """ "Landmarks 1–15"."""
        noun = "Landmark" if len(self.ids) == 1 else "Landmarks"
        words = ids_in_words(self.ids)
        return f"{noun} {words}" if len(words) <= 30 else f"{len(self.ids)} landmarks"

    def pages(self) -> tuple[Page, ...]:
        """What goes on which sheet, without the instructions.

        Raises:
            InputError: it would be more sheets than anybody would print.
        """
        return arrange(self.ids, self.kind, self.paper, self.overlap)

    def drawing(self, pages: tuple[Page, ...] | None = None) -> Drawing:
        """The instructions, then the sheets with landmarks (``pages``, where they are known).

        Raises:
            InputError: it would be more sheets than anybody would print.
        """
        pages = self.pages() if pages is None else pages
        inks = (self.dark, self.bright)
        first = instructions(
            Contents(self.ids, self.kind, self.paper, pages, inks, self.title),
        )
        sheets = [first]
        heading = self._heading()
        for number, page in enumerate(pages, start=2):
            words = f"sheet {number} of {len(pages) + 1}"
            items = list(sheet_items(page.width, page.height, heading, words))
            for placed in page.placed:
                items += tile_items(placed, inks)
            sheets.append(Sheet(page.width, page.height, _page_title(page), tuple(items)))
        return Drawing(self.title, tuple(sheets))

    def _heading(self) -> list[str]:
        kind = self.kind
        thing = "tube" if kind.shape == "cylinder" else "sticker"
        sizes = f"segments of {kind.segment * 1000:g} mm, {thing} {kind.diameter * 1000:g} mm"
        return [
            f"Polepilot · {self.title} · {kind.bits} bits, {sizes}",
            f"{self.title} · {kind.bits} bits, {sizes}",
            self.title,
        ]


def _page_title(page: Page) -> str:
    """What the sheet is called in the outline of the file."""
    if len(page.placed) == 1 and page.placed[0].tile.parts > 1:
        tile = page.placed[0].tile
        return f"Landmark {tile.landmark}, part {tile.number} of {tile.parts}"
    found = sorted({placed.tile.landmark for placed in page.placed})
    return f"Landmark{'s' * (len(found) > 1)} {ids_in_words(found)}"
