"""What a picture made for the tests of seeing shows: the truth that detections are judged by.

Two programs make such pictures, `studio` and `darkroom`. They share nothing but this module, so
that a detector which suits one of them only is found out by the other.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Literal

from polepilot.core.landmark import LandmarkKind
from polepilot.core.observation import Image

Family = Literal[
    "clean", "clean-8-12", "clean-12-16", "clean-16-22", "photo", "pan", "hidden", "empty"
]
"""Which rows of the table of results a picture belongs to (`scenes.campaign`)."""


@dataclass(frozen=True, slots=True)
class Truth:
    """One landmark that stands in the picture, whole unless ``hidden``.

    ``range`` is horizontal, from the camera's vertical axis to the landmark's axis, metres.
    ``bearing`` is from the optical axis, left positive, radians, at mid exposure of the middle row.
    """

    id: int
    range: float
    bearing: float
    kind: LandmarkKind = field(default_factory=LandmarkKind)
    orange_surround: bool = False
    """Something of the paint's colour touches the code's outline in the picture."""
    hidden: bool = False
    """Something in front covers a part of the code: not to be read, least of all wrongly."""


@dataclass(frozen=True, slots=True, eq=False)
class Scene:
    """A picture (camera constant 600, 400x300 unless said otherwise) and what stands in it."""

    image: Image
    truths: tuple[Truth, ...]
    family: Family
    seed: int
    note: str = ""
    """What was drawn by lot, for somebody who looks at a failure."""
