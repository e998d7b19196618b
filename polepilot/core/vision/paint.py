"""The bright paint of landmarks: orange, any other saturated colour, or white (against black).

The eye tells a coloured paint from grey things by two channels of the picture, the one in which the
paint is brightest and the one in which it is darkest, and measures edges in the brightest one and
in the brightness. White paint has no colour: then any bright and dark stripes of the right
proportions are a landmark, as they have to be for monochrome and infrared cameras.
"""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType

from polepilot.core.errors import InputError

Triple = tuple[int, int, int]
"""Blue, green, red, as in a picture."""

COLOURS: Mapping[str, str] = MappingProxyType(
    {
        "orange": "#ff6600",
        "red": "#e02020",
        "yellow": "#ffd000",
        "green": "#00a040",
        "cyan": "#00b0d0",
        "blue": "#1040e0",
        "magenta": "#e010a0",
        "white": "#ffffff",
    }
)
"""The colours that have a name, as sRGB."""
EXPECTED = (
    f"a bright colour without grey in it ({', '.join(list(COLOURS)[:-1])}, or one such as "
    "#00a040), or white"
)
"""What can be configured, for messages."""

_HEX = re.compile(r"#([0-9a-f]{2})([0-9a-f]{2})([0-9a-f]{2})")
_LUMA = (29, 150, 77)
"""Rec. 601 in 256ths, of blue, green, red: what JPEG and cameras' mosaics keep sharp."""
_LEAST_SHARE = 0.5
"""Of the brightest channel: less brightness than this drowns in what surrounds the paint."""
_LEAST_LIGHT = 0.15
"""Linear light of the brightest channel; black paint gives back about 0.03."""
_MOST_GREY = 0.3
"""A paint's darkest channel over its brightest, in linear light; orange has 0.05 in practice."""
_LEAST_GREY = 0.8
"""From here on it counts as white."""
_MOST_THIRD = 0.95
"""The third channel's light over the brightest one's, where a paint has one bright channel only."""
_ALIKE = 0.08
"""Channels nearer to each other than this share of the brightest are equally dark."""
_DARK_ORDER = (1, 2, 0)
"""Of equally dark channels the first one serves: least noise, and least astray in warm light."""


@dataclass(frozen=True, slots=True)
class Paint:
    """What the bright segments are painted with: sRGB, 0 to 255 each.

    Raises:
        InputError: no such colour, too dark, or neither saturated nor white.
    """

    red: int
    green: int
    blue: int

    def __post_init__(self) -> None:
        if not all(0 <= value <= 255 for value in (self.red, self.green, self.blue)):
            raise InputError(f"bright is {self.bgr[::-1]}: expected 0 to 255 each.")
        light = self._light
        if max(light) < _LEAST_LIGHT or _MOST_GREY < min(light) / max(light) < _LEAST_GREY:
            raise InputError(f"bright is {str(self)!r}: expected {EXPECTED}.")

    @classmethod
    def parse(cls, text: str) -> Paint:
        """A name of `COLOURS`, or ``#rrggbb``.

        Raises:
            InputError: as the class.
        """
        wanted = text.strip().lower()
        match = _HEX.fullmatch(COLOURS.get(wanted, wanted))
        if match is None:
            raise InputError(f"bright is {text!r}: expected {EXPECTED}.")
        return cls(*(int(part, 16) for part in match.groups()))

    def __str__(self) -> str:
        return next((name for name, rgb in COLOURS.items() if rgb == self.rgb), self.rgb)

    @property
    def rgb(self) -> str:
        """``#rrggbb``, sRGB."""
        return f"#{self.red:02x}{self.green:02x}{self.blue:02x}"

    @property
    def bgr(self) -> Triple:
        """sRGB, 0 to 255, in the order of a picture's channels: blue, green, red."""
        return self.blue, self.green, self.red

    @property
    def reflectance(self) -> tuple[float, float, float]:
        """Linear light that it gives back, of blue, green, red: 0 to 1."""
        blue, green, red = self._light
        return blue, green, red

    @property
    def coloured(self) -> bool:
        """Whether it has a colour to tell it from grey things by; white has none."""
        light = self._light
        return min(light) / max(light) <= _MOST_GREY

    @property
    def channels(self) -> tuple[int, int | None]:
        """The channel in which it is brightest, and the one in which it is darkest.

        0 is blue, 1 green, 2 red. White is measured in green, the channel with the least noise, and
        has no darkest one: None.
        """
        if not self.coloured:
            return 1, None
        light = self._light
        high = max(range(3), key=lambda channel: light[channel])
        dark = [channel for channel in _DARK_ORDER if channel != high]
        least = min(light) + _ALIKE * light[high]
        return high, next(channel for channel in dark if light[channel] <= least)

    @property
    def third(self) -> tuple[float, float]:
        """Least and most light of the third channel, as shares of the brightest one's.

        Light without white balance makes up to three times as much or as little of a share. Paints
        with one bright channel, such as orange, are not held to a least.
        """
        high, low = self.channels
        if low is None:
            return 0.0, math.inf
        share = self._light[3 - high - low] / self._light[high]
        return (share / 4 if share > 0.4 else 0.0), max(_MOST_THIRD, 3 * share)

    @property
    def weights(self) -> Triple:
        """Of blue, green, red in the brightness, in 256ths.

        Luma where the paint has enough of it, as orange has: that is what JPEG keeps sharp. Blue,
        red and magenta have little. They get just as much of each channel in proportion to the
        paint as brings their brightness to half of the brightest channel: noise is alike in all
        channels of a picture, so those weights are the ones that raise the paint most above it.
        Black with a share s of the paint has s of its light in any weighted sum of grey levels
        (they are powers of light), so the weights displace no edge.
        """
        paint = self.bgr
        most, total = max(paint), sum(paint)
        by_luma = sum(w * p for w, p in zip(_LUMA, paint, strict=True)) / (256 * most)
        by_paint = sum(p * p for p in paint) / (total * most)
        if by_luma >= _LEAST_SHARE or not self.coloured:
            return _LUMA
        part = (_LEAST_SHARE - by_luma) / (by_paint - by_luma)
        mixed = [
            round((1 - part) * w + part * 256 * p / total)
            for w, p in zip(_LUMA, paint, strict=True)
        ]
        mixed[self.channels[0]] += 256 - sum(mixed)
        blue, green, red = mixed
        return blue, green, red

    @property
    def _light(self) -> list[float]:
        return [_linear(grey / 255) for grey in self.bgr]


def _linear(grey: float) -> float:
    return grey / 12.92 if grey <= 0.04045 else float(((grey + 0.055) / 1.055) ** 2.4)


ORANGE = Paint.parse("orange")
