"""What the localizer was given lately, so that a log can begin with it.

A run begins when its pose is known already. A log that began there would never tell from what it
was found, and nobody could find it again from the log. So the last seconds are kept, and written
first.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Sequence

from polepilot.core.observation import Frame, Odometry, RangeBearing
from polepilot.core.robot.recorder import Recorder

KEPT = 20.0
"""Seconds: more than two sweeps of the camera, which is what a fix may take."""
MOST_KEPT = 4000
"""Entries, whatever their stamps."""

_Write = Callable[[Recorder], None]


class Inputs:
    """Hands everything on to the recorder of the present run; keeps the last seconds for the next.

    ``add_...`` in the order in which the localizer is given them.
    """

    def __init__(self) -> None:
        self._recorder: Recorder | None = None
        self._kept: deque[tuple[float, _Write]] = deque(maxlen=MOST_KEPT)

    def clear(self) -> None:
        """Another map: what was seen before has nothing to do with it."""
        self._kept.clear()

    def record(self, recorder: Recorder) -> None:
        """From now on, and from a few seconds ago."""
        for _, write in self._kept:
            write(recorder)
        self._recorder = recorder

    def end(self) -> None:
        """The run is over."""
        self._recorder = None

    def add_odometry(self, odometry: Odometry, pan: float | None) -> None:
        """How the robot moves from now on, and where the camera points."""
        self._add(odometry.stamp, lambda recorder: recorder.odometry(odometry, pan))

    def add_sighting(
        self,
        stamp: float,
        measurements: Sequence[RangeBearing],
        frame: Frame | None,
        pan: float | None = None,
    ) -> None:
        """What one picture gave. The picture itself goes into a log that is being written only."""
        self._add(stamp, lambda recorder: recorder.sighting(stamp, measurements, None, pan))
        if self._recorder is not None and frame is not None:
            self._recorder.picture(frame)

    def _add(self, stamp: float, write: _Write) -> None:
        self._kept.append((stamp, write))
        while self._kept[0][0] < stamp - KEPT:
            self._kept.popleft()
        if self._recorder is not None:
            write(self._recorder)
