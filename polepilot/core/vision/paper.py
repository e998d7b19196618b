"""The paper's detector, literally: the reference that the default one has to beat.

Orange by fixed bounds on the grey levels, orange pixels counted per column, the middle column of
every region whose count exceeds half of the greatest, run lengths to bits, Eq. 1 for the range.
So half of the maximum hides far landmarks beside near ones, edges are whole pixels, and the range
is the depth of the surface: no radius, no 1 / cos(bearing).

Deviation: pictures are taken as they are given; scaling them to 400x300 is the camera's part.
"""

from __future__ import annotations

from collections.abc import Mapping

import cv2
import numpy as np
from numpy.typing import NDArray

from polepilot.core.landmark import LandmarkKind, decode, encode
from polepilot.core.observation import Detection, Image
from polepilot.core.vehicle import Camera
from polepilot.core.vision.detector import Found, Look
from polepilot.core.vision.kernel import Strip
from polepilot.core.vision.measure import bearing_of, depth_of

# R - 1.5 B > 0, in tenths so that whole numbers suffice.
_RED_TENTHS, _BLUE_TENTHS = 10, 15
_LEAST = (0, 0, 60)
_MOST = (100, 155, 255)
_PIXEL_SIGMA = 0.41
"""Standard deviation of a length between two edges that are each rounded to a whole pixel."""


class PaperDetector:
    """Same shape as ``LandmarkDetector``.

    Args:
        camera: constant and centre for pictures as they are given.
        kinds: the ids that exist and what each looks like.
    """

    def __init__(self, camera: Camera, kinds: Mapping[int, LandmarkKind]) -> None:
        self._camera = camera
        self._kinds = dict(kinds)
        self._bits = sorted({kind.bits for kind in self._kinds.values()})

    def detect(self, image: Image) -> list[Detection]:
        """Landmarks of a picture (rows x columns x 3 BGR), from left to right.

        A grey picture holds no orange, hence no landmark.
        """
        if image.ndim == 2:
            return []
        orange = _orange(image)
        count = orange.sum(axis=0)
        if not count.max(initial=0):
            return []
        found = []
        for first, last in _regions(count > count.max() / 2):
            middle = (first + last) // 2
            detection = self._read(orange[:, middle], middle)
            if detection is not None:
                found.append(detection)
        return found

    def examine(self, image: Image) -> Look:
        """The same landmarks with their strips. The paper does not say why others are none."""
        return Look(tuple(Found(one, self._strip(one)) for one in self.detect(image)), ())

    def _strip(self, one: Detection) -> Strip:
        kind = self._kinds[one.id]
        unit = (one.bottom - one.top) / kind.segments
        return Strip(
            id=one.id,
            bits=kind.bits,
            column=one.column,
            row=(one.top + one.bottom) / 2,
            unit=unit,
            width=unit * kind.diameter / kind.segment,
            code=encode(one.id, kind.bits).encode(),
        )

    def _read(self, strip: NDArray[np.bool_], column: int) -> Detection | None:
        lit = np.flatnonzero(strip)
        if not len(lit):
            return None
        top, bottom = int(lit[0]), int(lit[-1]) + 1
        values = strip[top:bottom]
        starts = np.concatenate([[0], np.flatnonzero(np.diff(values)) + 1])
        lengths = np.diff(np.concatenate([starts, [len(values)]]))
        for bits in self._bits:
            unit = len(values) / (2 * bits + 5)
            counts = np.rint(lengths / unit).astype(int)
            code = "".join(
                ("1" if values[start] else "0") * count
                for start, count in zip(starts, counts, strict=True)
            )
            number = decode(code)
            kind = None if number is None else self._kinds.get(number)
            if number is not None and kind is not None and kind.bits == bits:
                return self._measure(number, kind, column, top, bottom)
        return None

    def _measure(
        self, number: int, kind: LandmarkKind, column: int, top: int, bottom: int
    ) -> Detection:
        pixels = bottom - top
        distance = depth_of(kind.height, pixels, self._camera.constant)
        return Detection(
            id=number,
            range=distance,
            bearing=bearing_of(column, self._camera),
            column=float(column),
            top=top - 0.5,
            bottom=bottom - 0.5,
            range_sigma=distance * _PIXEL_SIGMA / pixels,
            bearing_sigma=0.5 / self._camera.constant,
        )


def _orange(image: Image) -> NDArray[np.bool_]:
    """60 <= R <= 255, 0 <= G <= 155, 0 <= B <= 100 and R > 1.5 B."""
    inside = cv2.inRange(image, np.array(_LEAST), np.array(_MOST)) > 0
    wide = image.astype(np.int16)
    redder: NDArray[np.bool_] = _RED_TENTHS * wide[:, :, 2] > _BLUE_TENTHS * wide[:, :, 0]
    return inside & redder


def _regions(chosen: NDArray[np.bool_]) -> list[tuple[int, int]]:
    """First and last column of every run of chosen columns."""
    edges = np.flatnonzero(np.diff(np.concatenate([[0], chosen.astype(np.int8), [0]])))
    return [(int(a), int(b) - 1) for a, b in zip(edges[0::2], edges[1::2], strict=True)]
