"""The first picture of docs/vision.md: what is found, and what is not taken for a landmark."""

from __future__ import annotations

from scenes.campaign import CAMERA, KINDS
from scenes.studio import scene

from polepilot.core.observation import Image
from polepilot.core.vision.annotate import annotate
from polepilot.core.vision.detector import LandmarkDetector

SEED = 291
"""Landmarks before a cat (scikit-image's, which belongs to everybody)."""


def found() -> Image:
    """The picture as ``detect --annotate`` draws it."""
    image = scene("photo", SEED).image
    return annotate(image, LandmarkDetector(CAMERA, KINDS).examine(image), "photo.png")
