"""From the light of the segments to an id, or to the reason why there is none.

The end bars say what bright looks like here, the fences between the bits what dark looks like.
Every bit must look like one of the two, in every channel; anything in between is no code.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from polepilot.core.landmark import decode

Floats = NDArray[np.floating[Any]]

_TOLERANCE = 0.30
"""How far a segment may be from its colour, as a share of the distance between the two."""
_DARKEST_SHARE = 0.45
"""Black gives back at most this share of the light of the bright paint (haze, glare)."""
_LEAST_COLOUR = 0.25
"""Least share of colour (red minus blue) in the light of the bright paint."""


@dataclass(frozen=True, slots=True)
class Reading:
    """What the segments say: ``id``, or None and ``why``."""

    id: int | None
    code: str
    why: str = ""


def read_code(levels: Floats, noise: float = 0.0) -> Reading:
    """Read a code from the light of its segments (segments x channels, linear, top first).

    Args:
        noise: standard deviation of a level as a share of bright - dark; widens the tolerance.
    """
    segments = len(levels)
    place = np.linspace(0, 1, segments)[:, None]
    first, last = levels[:2].mean(axis=0), levels[-2:].mean(axis=0)
    # Light may change along the pole: what bright is, is interpolated between the end bars.
    bright = first * (1 - place) + last * place
    dark = levels[2:-2:2].mean(axis=0)
    step = bright - dark
    power = (step * step).sum(axis=1)
    if power.min() <= 1e-7 or (step.sum(axis=1) <= 0).any():
        return Reading(None, "", "no contrast")
    share = ((levels - dark) * step).sum(axis=1) / power
    off = levels - dark - share[:, None] * step
    aside = np.sqrt((off * off).sum(axis=1) / power)
    code = "".join("1" if value > 0.5 else "0" for value in share)
    room = min(_TOLERANCE + 2 * noise, 0.45)
    if levels.shape[1] == 3:
        blue, green, red = bright.mean(axis=0)
        if red - blue < _LEAST_COLOUR * red or green > 0.95 * red:
            return Reading(None, code, "bright segments have the wrong colour")
    if dark.max() > _DARKEST_SHARE * bright.max(axis=1).min():
        return Reading(None, code, "dark segments are not dark")
    ends = np.sqrt(np.vdot(first - last, first - last) / power.mean())
    if ends > 2 * room:
        return Reading(None, code, "end bars differ")
    if np.abs(share - np.rint(np.clip(share, 0, 1))).max() > room or aside.max() > room:
        return Reading(None, code, "a segment looks like neither colour")
    number = decode(code)
    return Reading(number, code, "" if number is not None else "no legal code")
