"""Where the world is swapped: the simulator, the replayer and the hardware implement these.

Nothing above these protocols knows which of them it talks to.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Protocol

from polepilot.core.landmark import LandmarkKind
from polepilot.core.link.report import Chunk
from polepilot.core.observation import Detection, Frame

__all__ = ["CameraPort", "Chunk", "Clock", "LinkPort", "SensorPort", "Sighting"]


@dataclass(frozen=True, slots=True)
class Sighting:
    """What one picture showed. ``frame`` is None where measurements come without pictures."""

    stamp: float
    """Middle of the exposure of the middle row."""
    detections: tuple[Detection, ...]
    frame: Frame | None = None


class CameraPort(Protocol):
    """A source of pictures."""

    def read(self) -> Frame | None:
        """The newest picture that was not read yet, or None; never blocks.

        Raises:
            CameraError: the camera is gone; the message says what to do.
        """
        ...

    def close(self) -> None: ...


class SensorPort(Protocol):
    """A source of landmark sightings: a camera with a detector behind it, or a sensor model."""

    def expect(self, kinds: Mapping[int, LandmarkKind]) -> None:
        """Which landmarks are on the map from now on, and what they look like."""
        ...

    def read(self) -> Sighting | None:
        """The newest sighting that was not read yet, or None; never blocks.

        Raises:
            CameraError: the camera is gone; the message says what to do.
        """
        ...

    def close(self) -> None: ...


class LinkPort(Protocol):
    """A byte stream to the microcontroller."""

    @property
    def generation(self) -> int:
        """How often the line has been opened; a new number asks for a new handshake."""
        ...

    def read(self) -> list[Chunk]:
        """What has come since the last call, oldest first, perhaps nothing; never blocks.

        Raises:
            LinkError: the line is gone; the next call may find it again.
        """
        ...

    def write(self, data: bytes) -> None:
        """Queue ``data`` for sending; never blocks for long.

        Raises:
            LinkError: the line is gone.
        """
        ...

    def close(self) -> None: ...


class Clock(Protocol):
    """The robot's monotonic time, seconds."""

    def now(self) -> float: ...

    def wait_until(self, stamp: float) -> None:
        """Return as soon as ``now()`` has reached ``stamp``."""
        ...
