"""Several pictures with what was found in them, side by side in one file."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import cv2
import numpy as np

from polepilot.commands.drawings import encoded
from polepilot.commands.files import write_whole

if TYPE_CHECKING:
    from polepilot.core.observation import Image

Colour = tuple[int, int, int]
GREEN: Colour = (80, 255, 80)
RED: Colour = (60, 60, 255)

_TILE = 800
"""About how many columns a picture is drawn with."""
_MOST_ACROSS = 3
_BAND = 34
"""Height of a line of words below the picture, pixels."""


class Tile:
    """One picture to draw on, in its own pixels (centres are integers)."""

    def __init__(self, image: Image) -> None:
        height, width = image.shape[:2]
        self.scale = min(_TILE / width, 4.0)
        size = (max(round(width * self.scale), 1), max(round(height * self.scale), 1))
        method = cv2.INTER_AREA if self.scale < 1 else cv2.INTER_NEAREST
        canvas = cv2.resize(image, size, interpolation=method)
        if canvas.ndim == 2:
            canvas = cv2.cvtColor(canvas, cv2.COLOR_GRAY2BGR)
        self._canvas = np.ascontiguousarray(canvas)
        self._words: list[tuple[str, Colour]] = []

    def line(self, first: tuple[float, float], last: tuple[float, float], colour: Colour) -> None:
        """A line between two places, column and row."""
        ends = (self._at(first), self._at(last))
        cv2.line(self._canvas, *ends, colour, 1, cv2.LINE_AA)

    def spot(self, place: tuple[float, float], colour: Colour) -> None:
        """A small circle."""
        cv2.circle(self._canvas, self._at(place), 7, colour, 2, cv2.LINE_AA)

    def say(self, words: str, colour: Colour = (230, 230, 230)) -> None:
        """A line below the picture; letters of the plain alphabet only."""
        self._words.append((words.encode("ascii", "replace").decode(), colour))

    def done(self) -> Image:
        """The picture with the lines below it."""
        band = np.full((_BAND * len(self._words), self._canvas.shape[1], 3), 32, np.uint8)
        for number, (words, colour) in enumerate(self._words):
            place = (6, _BAND * number + 25)
            cv2.putText(band, words, place, cv2.FONT_HERSHEY_SIMPLEX, 0.75, colour, 1, cv2.LINE_AA)
        return np.vstack([self._canvas, band])

    def _at(self, place: tuple[float, float]) -> tuple[int, int]:
        return round((place[0] + 0.5) * self.scale), round((place[1] + 0.5) * self.scale)


def write_sheet(tiles: Sequence[Tile], out: Path, option: str = "--annotate") -> None:
    """All tiles in rows of at most three, as a PNG or JPEG file (``drawings.place_for``).

    Raises:
        InputError: ``out`` cannot be written, or is too large for such a file.
    """
    pictures = [tile.done() for tile in tiles]
    across = min(len(pictures), _MOST_ACROSS)
    width = max(picture.shape[1] for picture in pictures)
    height = max(picture.shape[0] for picture in pictures)
    down = -(-len(pictures) // across)
    sheet = np.full((down * height, across * width, 3), 32, np.uint8)
    for number, picture in enumerate(pictures):
        row, column = divmod(number, across)
        y, x = row * height, column * width
        sheet[y : y + picture.shape[0], x : x + picture.shape[1]] = picture
    write_whole({out: encoded(sheet, out, option)}, option)
