"""A picture with what was found in it, what was not, and why: for people.

The picture is enlarged if it is small, so that lines and words do not cover what they point at.
Beside each strip its segments are drawn as they were read. Rejected candidates carry letters;
below the picture stands what the letters mean.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from itertools import chain, product
from string import ascii_lowercase
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from polepilot.core.observation import Image
from polepilot.core.vision.detector import Found, Look, Rejected
from polepilot.core.vision.kernel import Strip

Colour = tuple[int, int, int]
Place = tuple[float, float]
"""Column and row."""

FOUND: Colour = (80, 255, 80)
REJECTED: Colour = (240, 190, 130)
_WORDS: Colour = (230, 230, 230)
_ASIDE: Colour = (150, 150, 150)
_GROUND: Colour = (32, 32, 32)
_SHADES: tuple[Colour, Colour] = ((0, 0, 0), (255, 255, 255))
"""Of dark and bright segments,"""
_CALM_SHADES: tuple[Colour, Colour] = ((50, 50, 50), (180, 180, 180))
"""and of those of a rejected candidate."""

_COLUMNS, _ROWS = 1280, 960
"""A picture is enlarged by whole numbers as long as it is no larger than this."""
_MOST_SCALE = 4
_NARROWEST = 640
"""Columns that the words below the picture need."""
_FONT = cv2.FONT_HERSHEY_SIMPLEX
_LETTERS = 0.5
"""Size of letters in a picture of usual size."""
_LINE = 19
"""Rows per line of words there."""
_LEGEND = (
    "Green: read, with range and bearing (left positive). Blue: rejected. Beside each strip: its "
    "segments as they were read."
)
_SHIFT = 4
"""OpenCV draws with this many bits of a pixel."""
_ALOOF = 24
"""Words keep this away from strips that they are not about, if they can."""
_FAR = 8
"""A label farther away than this has a line to its strip."""


def annotate(image: Image, look: Look, title: str = "") -> Image:
    """``image`` (rows x columns x 3 BGR, or grey), enlarged, with what was thought of it.

    Args:
        title: what the picture is called; letters outside of ASCII become question marks.
    """
    sheet = _Sheet(image)
    letters = [name for name, _ in zip(_names(), look.rejected, strict=False)]
    calm = [sheet.strip(one.strip, REJECTED, _CALM_SHADES) for one in look.rejected]
    plain = [sheet.strip(one.strip, FOUND, _SHADES) for one in look.found]
    lines = [(_heading(sheet, look, title), _WORDS)]
    for box, landmark in zip(plain, look.found, strict=True):
        if not sheet.label(box, _told(landmark), FOUND):  # the picture is too small for words
            lines.append(("  ".join(_told(landmark)), FOUND))
    for box, name in zip(calm, letters, strict=True):
        sheet.label(box, (name,), REJECTED)
    sheet.write_labels()
    lines += [(line, REJECTED) for line in _reasons(look.rejected, letters)]
    if calm or plain:
        lines.append((_LEGEND, _ASIDE))
    return sheet.with_lines(lines)


def summary(look: Look) -> str:
    """``2 landmarks; 3 candidates rejected: no contrast (2), cut off``."""
    counts = Counter(one.reason for one in look.rejected)
    reasons = (
        f"{reason} ({count})" if count > 1 else reason for reason, count in counts.most_common()
    )
    return f"{_counted(look)}{': ' if counts else ''}{', '.join(reasons)}"


def _counted(look: Look) -> str:
    found, rejected = len(look.found), len(look.rejected)
    landmarks = f"{found or 'no'} landmark{'s' * (found != 1)}"
    if not rejected:
        return f"{landmarks}; no other candidate" if found else f"{landmarks}; no candidate"
    return f"{landmarks}; {rejected} candidate{'s' * (rejected != 1)} rejected"


def _heading(sheet: _Sheet, look: Look, title: str) -> str:
    size = f"{sheet.columns} x {sheet.rows} pixels"
    drawn = f", {sheet.scale} times as large" if sheet.scale > 1 else ""
    named = f"{title}, " if title else ""
    return f"{named}{size}{drawn}: {_counted(look)}"


def _told(found: Found) -> tuple[str, ...]:
    one = found.detection
    return (
        f"No. {one.id}",
        f"{one.range * 100:.1f} +/- {one.range_sigma * 100:.1f} cm",
        f"{math.degrees(one.bearing):+.2f} +/- {math.degrees(one.bearing_sigma):.2f} deg",
    )


def _reasons(rejected: Iterable[Rejected], letters: Iterable[str]) -> Iterator[str]:
    """One line per reason: which candidates, and what number each seemed to be."""
    grouped: dict[str, list[str]] = {}
    for one, name in zip(rejected, letters, strict=True):
        seemed = f"{name} (No. {one.strip.id}?)" if one.strip.id else name
        grouped.setdefault(one.reason, []).append(seemed)
    for reason, names in grouped.items():
        yield f"{', '.join(names)}: {reason}"


def _names() -> Iterator[str]:
    """a, b, ... z, aa, ab, ..."""
    return chain(ascii_lowercase, map("".join, product(ascii_lowercase, repeat=2)))


@dataclass(frozen=True, slots=True)
class _Box:
    """A rectangle of the enlarged picture, pixels."""

    left: float
    top: float
    right: float
    bottom: float

    def nearest(self, place: Place) -> Place:
        return (
            min(max(place[0], self.left), self.right),
            min(max(place[1], self.top), self.bottom),
        )


@dataclass(frozen=True, slots=True)
class _Label:
    """Words that have found their place, and what they belong to."""

    box: _Box
    words: Sequence[str]
    colour: Colour
    strip: _Box


class _Sheet:
    """The enlarged picture while it is drawn on."""

    def __init__(self, image: Image) -> None:
        self.rows, self.columns = image.shape[:2]
        fits = min(_COLUMNS // max(self.columns, 1), _ROWS // max(self.rows, 1))
        self.scale = min(max(fits, 1), _MOST_SCALE)
        size = max(self.columns * self.scale, 1), max(self.rows * self.scale, 1)
        shown = image if image.size else np.zeros((1, 1), np.uint8)
        canvas = cv2.resize(shown, size, interpolation=cv2.INTER_NEAREST)
        if canvas.ndim == 2:
            canvas = cv2.cvtColor(canvas, cv2.COLOR_GRAY2BGR)
        self._canvas = np.array(canvas, np.uint8)
        self._size = max(1.0, min(size[0] / _COLUMNS, size[1] / _ROWS))
        """Of lines and letters."""
        self._boxes: list[_Box] = []
        self._labels: list[_Label] = []

    def strip(self, strip: Strip, colour: Colour, shades: tuple[Colour, Colour]) -> _Box:
        """The strip's outline, and beside it its segments as they were read; what they cover."""
        code = strip.code.decode("ascii", "replace")
        half = (len(code) or 2 * strip.bits + 5) / 2
        pixel = self._size / self.scale  # of the sheet, in those of the picture
        wide = strip.width / 2 + 1 + pixel
        bar = min(max(0.3 * strip.width, 6 * pixel), 14 * pixel)
        near, far = wide + 4 * pixel, wide + 4 * pixel + bar
        if strip.column - far > 0:  # to the left, where there is room
            near, far = -near, -far
        for index, bit in enumerate(code):
            part = self._outline(strip, (index - half, index + 1 - half), (near, far))
            cv2.fillPoly(self._canvas, [part], shades[bit == "1"], cv2.LINE_AA, _SHIFT)
        if code:
            low, high = sorted((near, far))
            frame = self._outline(strip, (-half, half), (low - pixel, high + pixel), pixel)
            self._polygon(frame, colour, shadow=False)
        self._polygon(self._outline(strip, (-half, half), (-wide, wide), 1 + pixel), colour)
        sides = min(-wide, far), max(wide, far)
        whole = self._outline(strip, (-half, half), sides, 1 + pixel) / 2**_SHIFT
        box = _Box(*map(float, (*whole.min(axis=0), *whole.max(axis=0))))
        self._boxes.append(box)
        return box

    def label(self, strip: _Box, words: Sequence[str], colour: Colour) -> bool:
        """Keep a place for words near the strip, on no other words; False where there is none."""
        width = max(self._width(line) for line in words) + 8 * self._size
        height = (_LINE * len(words) + 4) * self._size
        rows, columns = self._canvas.shape[:2]
        if width > columns or height > rows:
            return False
        step = 4 * self._size
        left = np.append(np.arange(0, columns - width, step), columns - width)[None, :]
        top = np.append(np.arange(0, rows - height, step), rows - height)[:, None]
        cost = _apart(left, left + width, strip.left, strip.right)
        cost = np.hypot(cost, _apart(top, top + height, strip.top, strip.bottom))
        # Nearer to the middle of its height rather than at its ends.
        cost = cost + 0.02 * abs(top + height / 2 - (strip.top + strip.bottom) / 2)

        def covered(box: _Box, room: float) -> NDArray[np.bool_]:
            across = (left < box.right + room) & (left + width > box.left - room)
            down = (top < box.bottom + room) & (top + height > box.top - room)
            return np.asarray(across & down)

        for box in self._boxes:
            cost = cost + 100 * self._size * covered(box, 3 * self._size)
            if box is not strip:  # words beside another strip would seem to be about that one
                off = _apart(left, left + width, box.left, box.right)
                off = np.hypot(off, _apart(top, top + height, box.top, box.bottom))
                cost = cost + 0.5 * np.maximum(_ALOOF * self._size - off, 0.0)
        for label in self._labels:
            cost = np.where(covered(label.box, 2 * self._size), np.inf, cost)
        row, column = np.unravel_index(np.argmin(cost), cost.shape)
        if not math.isfinite(cost[row, column]):
            return False
        x, y = float(left[0, column]), float(top[row, 0])
        self._labels.append(_Label(_Box(x, y, x + width, y + height), words, colour, strip))
        return True

    def write_labels(self) -> None:
        """All lines first, so that none runs over words."""
        for label in self._labels:
            middle = (label.box.left + label.box.right) / 2, (label.box.top + label.box.bottom) / 2
            start = label.strip.nearest(middle)
            end = label.box.nearest(start)
            if math.dist(start, end) > _FAR * self._size:
                self._polygon(_fine(np.array([start, end])), label.colour)
        for label in self._labels:
            left, top = round(label.box.left), round(label.box.top)
            field = self._canvas[top : math.ceil(label.box.bottom), left:][
                :, : math.ceil(label.box.right) - left
            ]
            field[:] = field // 5
            for number, line in enumerate(label.words):
                place = label.box.left + 4 * self._size, label.box.top + _LINE * self._size * number
                self._write(self._canvas, line, place, label.colour)

    def with_lines(self, lines: Sequence[tuple[str, Colour]]) -> Image:
        """The picture, and below it lines of words, broken where they are too long."""
        width = max(self._canvas.shape[1], _NARROWEST)
        broken = [
            (part, colour)
            for line, colour in lines
            for part in self._broken(line, width - 12 * self._size)
        ]
        height = math.ceil((_LINE * len(broken) + 10) * self._size)
        rows, columns = self._canvas.shape[:2]
        sheet = np.full((rows + height, width, 3), _GROUND, np.uint8)
        sheet[:rows, :columns] = self._canvas
        for number, (line, colour) in enumerate(broken):
            place = 6 * self._size, rows + (_LINE * number + 4) * self._size
            self._write(sheet, line, place, colour)
        return sheet

    def _outline(
        self, strip: Strip, ends: Place, sides: Place, margin: float = 0.0
    ) -> NDArray[np.int32]:
        """Corners of a part of the strip, as OpenCV takes them.

        Args:
            ends: from and to, in segments from the strip's middle.
            sides: from and to, in columns from it.
            margin: rows beyond both ends.
        """
        top, bottom = (strip.unit * end / (1 + strip.sag * end) for end in ends)
        corners = [
            (strip.column + strip.lean * row + side, strip.row + row)
            for row, turn in ((top - margin, 1), (bottom + margin, -1))
            for side in sides[::turn]
        ]
        return _fine((np.array(corners) + 0.5) * self.scale)

    def _polygon(self, points: NDArray[np.int32], colour: Colour, *, shadow: bool = True) -> None:
        """A closed line, with a shadow so that it shows on any ground."""
        thin = max(1, round(self._size))
        for ink, thickness in (((0, 0, 0), thin + 2), (colour, thin))[not shadow :]:
            cv2.polylines(self._canvas, [points], True, ink, thickness, cv2.LINE_AA, _SHIFT)

    def _write(self, canvas: Image, words: str, place: Place, colour: Colour) -> None:
        at = round(place[0]), round(place[1] + 15 * self._size)
        thin = max(1, round(self._size))
        size = _LETTERS * self._size
        cv2.putText(canvas, _plain(words), at, _FONT, size, colour, thin, cv2.LINE_AA)

    def _width(self, words: str) -> float:
        size = cv2.getTextSize(
            _plain(words), _FONT, _LETTERS * self._size, max(1, round(self._size))
        )
        return float(size[0][0])

    def _broken(self, line: str, width: float) -> Iterator[str]:
        """Lines no wider than ``width``, broken between words."""
        so_far = ""
        for word in line.split(" "):
            longer = f"{so_far} {word}" if so_far else word
            if self._width(longer) <= width:
                so_far = longer
                continue
            if so_far:
                yield so_far
            while self._width(word) > width:
                fits = max(1, int(len(word) * width / self._width(word)) - 1)
                yield word[:fits]
                word = word[fits:]
            so_far = f"    {word}"
        yield so_far


def _apart(low: NDArray[Any], high: NDArray[Any], from_: float, to: float) -> NDArray[Any]:
    """How far stretches are from another one; 0 where they meet."""
    return np.asarray(np.maximum(np.maximum(from_ - high, low - to), 0.0))


def _fine(places: NDArray[np.float64]) -> NDArray[np.int32]:
    """Pixels of the sheet in sixteenths, as OpenCV takes them; nothing is too far off for it."""
    fine = np.clip(np.rint(places * 2**_SHIFT), -(2**24), 2**24)
    return np.asarray(fine, np.int32)


def _plain(words: str) -> str:
    """In the letters that OpenCV can draw."""
    return words.encode("ascii", "replace").decode()
