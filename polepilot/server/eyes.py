"""Looking at pictures in a thread of its own, so that a tick never waits for one."""

from __future__ import annotations

import threading
from collections.abc import Mapping

from polepilot.core.errors import CameraError
from polepilot.core.landmark import LandmarkKind
from polepilot.core.robot.ports import SensorPort, Sighting

_POLL = 0.004
"""Seconds between two looks for a new picture."""


class BackgroundSensor:
    """A `SensorPort` in front of another one whose ``read`` takes long."""

    def __init__(self, sensor: SensorPort) -> None:
        self._sensor = sensor
        self._lock = threading.Lock()
        self._newest: Sighting | None = None
        self._failure: CameraError | None = None
        self._expected: Mapping[int, LandmarkKind] | None = None
        self._stopping = threading.Event()
        self._thread = threading.Thread(target=self._run, name="eyes", daemon=True)
        self._thread.start()

    def expect(self, kinds: Mapping[int, LandmarkKind]) -> None:
        """Which landmarks are on the map; holds from the next picture on."""
        with self._lock:
            self._expected = kinds
            self._newest = None

    def read(self) -> Sighting | None:
        """The newest sighting that was not read yet, or None; never blocks.

        Raises:
            CameraError: what the other sensor said last.
        """
        with self._lock:
            sighting, self._newest = self._newest, None
            failure = self._failure
        if sighting is None and failure is not None:
            raise CameraError(failure.message, remedy=failure.remedy, code=failure.code)
        return sighting

    def close(self) -> None:
        self._stopping.set()
        self._thread.join(timeout=1.0)
        self._sensor.close()

    def _run(self) -> None:
        while not self._stopping.is_set():
            with self._lock:
                expected, self._expected = self._expected, None
            if expected is not None:
                self._sensor.expect(expected)
            sighting, failure = None, None
            try:
                sighting = self._sensor.read()
            except CameraError as error:
                failure = error
            except Exception as error:  # noqa: BLE001 - the robot says so, instead of going blind
                failure = CameraError(f"a picture could not be looked at: {error}")
            with self._lock:
                self._failure = failure
                if sighting is not None and self._expected is None:
                    self._newest = sighting
            if sighting is None:
                self._stopping.wait(_POLL)
