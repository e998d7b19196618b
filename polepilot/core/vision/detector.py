"""The default detector: the kernel looks, `measure` makes metres of what it saw."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Protocol

from polepilot.core.landmark import LandmarkKind
from polepilot.core.observation import Detection, Image
from polepilot.core.vehicle import Camera
from polepilot.core.vision.kernel import Kernel, Strip
from polepilot.core.vision.measure import measure, pitch_of, stands


class Detector(Protocol):
    """Finds landmarks in single pictures; keeps nothing from one picture to the next."""

    def detect(self, image: Image) -> list[Detection]:
        """All landmarks that could be read, from left to right."""
        ...


class LandmarkDetector:
    """Reads every landmark of a picture, near and far, and measures it on linear light.

    Args:
        camera: constant and centre for pictures as they are given; pictures are never resized.
        kinds: the ids that exist and what each looks like; anything else is not reported.
    """

    def __init__(self, camera: Camera, kinds: Mapping[int, LandmarkKind]) -> None:
        self._camera = camera
        self._kinds = dict(kinds)
        self._kernel = Kernel(self._kinds, camera.constant)

    def detect(self, image: Image) -> list[Detection]:
        """All landmarks of a picture (rows x columns x 3 BGR, or grey), from left to right."""
        read = [
            strip
            for strip in self._kernel.look(image)
            if not strip.reason and stands(strip, self._kinds[strip.id], self._camera)
        ]
        if not read:
            return []
        best = [(strip, self._kinds[strip.id]) for strip in _best(read)]
        pitch = pitch_of(best, self._camera)
        found = [measure(strip, kind, pitch, self._camera) for strip, kind in best]
        return sorted(found, key=lambda one: one.column)


def _best(strips: list[Strip]) -> list[Strip]:
    """One strip per id and place: of rivals, the one that fits best."""
    if len(strips) == 1:
        return strips
    kept: list[Strip] = []
    for one in sorted(strips, key=lambda strip: strip.noise):
        half = (one.bits + 2.5) * one.unit
        if all(
            one.id != other.id
            and (
                abs(one.column - other.column) > 0.24 * half
                or abs(one.row - other.row) > half + (other.bits + 2.5) * other.unit
            )
            for other in kept
        ):
            kept.append(one)
    return kept
