"""The default detector: colour -> strips -> straight -> edges -> code -> measure."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Protocol

from polepilot.core.landmark import LandmarkKind
from polepilot.core.observation import Detection, Image
from polepilot.core.vehicle import Camera
from polepilot.core.vision import color
from polepilot.core.vision.code import read_code
from polepilot.core.vision.edges import Scale, fit_scale, segment_levels
from polepilot.core.vision.measure import bearing_of, half_width_of, range_of
from polepilot.core.vision.straight import Column, rough_code, straighten
from polepilot.core.vision.strips import Strip, find_strips

RANGE_FLOOR = 0.0009
"""Share of the range that is uncertain besides what the fit knows: blur that is not Gaussian,
grey levels that are not quite sRGB, a camera that is not quite level."""
MOST_NOISE = 0.2
"""Largest rms rest of a fit, as a share of the contrast."""
COLUMN_FLOOR = 0.2
"""The same for the strip's middle, pixels: light from one side moves the edges that are seen."""
LEAN_SHARE = 6.0
"""The same, in pixels per unit of slope of a leaning strip."""
MODEL_FACTOR = 1.25
"""By how much the scale is less certain than a fit with independent noise says."""


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
        self._bits = sorted({kind.bits for kind in self._kinds.values()})
        self._aspect = {
            bits: max(k.diameter / k.segment for k in self._kinds.values() if k.bits == bits)
            for bits in self._bits
        }

    def detect(self, image: Image) -> list[Detection]:
        """All landmarks of a picture (rows x columns x 3 BGR, or grey), from left to right."""
        found: list[tuple[float, Detection]] = []
        signal = color.contrast(image)
        for strip in find_strips(color.bright(signal), signal, self._bits):
            result = self._read(image, strip)
            if result is not None:
                found.append(result)
        return _best(found)

    def _read(self, image: Image, strip: Strip) -> tuple[float, Detection] | None:
        """Detection and how badly it fits, or None where the strip is no landmark of ours."""
        code = rough_code(image, strip)
        column = straighten(image, strip, code, self._aspect[strip.bits])
        if column is None:
            return None
        unit = (strip.bottom - strip.top) / len(code)
        # A segment misread at whole pixels shows in the levels: fit again with what they say.
        for _ in range(2):
            scale = fit_scale(column, code, strip.top, unit)
            if scale is None:
                return None
            levels = segment_levels(column, scale, len(code))
            if levels is None:
                return None
            reading = read_code(levels, scale.noise / math.sqrt(max(scale.unit, 1.0)))
            if reading.id is None:
                return None
            if reading.code == code:
                kind = self._kinds.get(reading.id)
                if kind is None or kind.bits != strip.bits or not _plausible(scale):
                    return None
                detection = self._measure(reading.id, kind, column, scale)
                return None if detection is None else (scale.noise, detection)
            code = reading.code
        return None

    def _measure(
        self, number: int, kind: LandmarkKind, column: Column, scale: Scale
    ) -> Detection | None:
        camera = self._camera
        bottom = scale.top + kind.segments * scale.unit
        middle = (scale.top + bottom) / 2
        left, right = (
            side + column.slope * (middle - column.middle) for side in (column.left, column.right)
        )
        # Straightening leaves some of a lean: a steep strip is less certain.
        sigma = math.hypot(column.edge_sigma, LEAN_SHARE * column.slope)
        if math.isfinite(left) and math.isfinite(right):
            at = (left + right) / 2
            sigma /= math.sqrt(2)
        else:
            seen = left if math.isfinite(left) else right
            if not math.isfinite(seen):
                return None
            guess = bearing_of(seen, camera)
            half = half_width_of(range_of(scale.unit, guess, kind, camera), guess, kind, camera)
            at = seen + half if math.isfinite(left) else seen - half
            left, right = at - half, at + half
            sigma = math.hypot(sigma, 0.1 * half + 0.2)
        # Rolling shutter and roll both lean the strip about the middle row: there it is where
        # the landmark stands at the picture's stamp.
        level = at + column.slope * (camera.center_y - middle)
        bearing = bearing_of(level, camera)
        front = column.front if kind.shape == "cylinder" else 1.0
        distance = range_of(scale.unit, bearing, kind, camera, front)
        expected = 2 * half_width_of(distance, bearing, kind, camera)
        if abs(right - left - expected) > 0.35 * expected + 1.2:
            return None
        relative = math.hypot(MODEL_FACTOR * scale.unit_sigma / scale.unit, RANGE_FLOOR)
        return Detection(
            id=number,
            range=distance,
            bearing=bearing,
            column=at,
            top=scale.top,
            bottom=bottom,
            range_sigma=relative * distance,
            bearing_sigma=math.hypot(sigma, COLUMN_FLOOR)
            * math.cos(bearing) ** 2
            / camera.constant,
        )


def _plausible(scale: Scale) -> bool:
    """Whether a square wave explains the light well enough, without an absurd blur."""
    return scale.noise < MOST_NOISE and scale.blur < max(1.0, 0.3 * scale.unit)


def _best(found: list[tuple[float, Detection]]) -> list[Detection]:
    """One detection per id and place: of rivals, the one that fits best."""
    kept: list[Detection] = []
    for _, one in sorted(found, key=lambda pair: pair[0]):
        reach = 0.12 * (one.bottom - one.top)
        if all(
            one.id != other.id
            and (
                abs(one.column - other.column) > reach
                or one.bottom < other.top
                or other.bottom < one.top
            )
            for other in kept
        ):
            kept.append(one)
    return sorted(kept, key=lambda one: one.column)
