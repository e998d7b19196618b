"""A camera with a detector behind it: pictures in, sightings out."""

from __future__ import annotations

from collections.abc import Callable, Mapping

from polepilot.core.landmark import LandmarkKind
from polepilot.core.robot.ports import CameraPort, Sighting
from polepilot.core.vision.detector import Detector

MakeDetector = Callable[[Mapping[int, LandmarkKind]], Detector]
"""Builds a detector that knows which landmarks exist."""


class Eye:
    """A `SensorPort` on a camera. Each picture is looked at once, when it is read."""

    def __init__(self, camera: CameraPort, make_detector: MakeDetector) -> None:
        self._camera = camera
        self._make_detector = make_detector
        self._detector = make_detector({})

    def expect(self, kinds: Mapping[int, LandmarkKind]) -> None:
        """The landmarks of the map that is used from now on."""
        self._detector = self._make_detector(kinds)

    def read(self) -> Sighting | None:
        frame = self._camera.read()
        if frame is None:
            return None
        return Sighting(frame.stamp, tuple(self._detector.detect(frame.image)), frame)

    def close(self) -> None:
        self._camera.close()
