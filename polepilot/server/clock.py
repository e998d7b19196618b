"""The robot's time on a real machine."""

from __future__ import annotations

import time


class MonotonicClock:
    """Seconds since this object was made; runs on when somebody sets the machine's date."""

    def __init__(self) -> None:
        self._origin = time.monotonic()

    def now(self) -> float:
        return time.monotonic() - self._origin

    def wait_until(self, stamp: float) -> None:
        while (left := stamp - self.now()) > 0:
            time.sleep(left)
