"""Two clocks: when, on the host's clock, a board's time stamp was taken."""

from __future__ import annotations

from collections import deque

_WRAP = 1 << 32


class ClockMap:
    """Maps a board's milliseconds to host seconds, by the quickest arrivals of late.

    A packet is read a little after it was made: transfer time, and the wait for the owner's next
    tick. The smallest difference of the last seconds is the one with the least waiting; it
    serves for all, so that a stamp has the board's regularity and not the tick's.
    """

    def __init__(self, window: float = 5.0) -> None:
        self._window = window
        self._differences: deque[tuple[float, float]] = deque()
        """(host time, difference), ascending in both: a sliding minimum."""
        self._last_ms: int | None = None
        self._board_ms = 0

    def forget(self) -> None:
        """The board's time starts anew."""
        self._differences.clear()
        self._last_ms = None

    def went_back(self, t_ms: int) -> bool:
        """``t_ms`` is before the last one, and not because the 32 bits have wrapped."""
        if self._last_ms is None:
            return False
        return (t_ms - self._last_ms) % _WRAP >= _WRAP // 2

    def to_host(self, t_ms: int, received: float) -> float:
        """Seconds of the host's clock at which the board's clock showed ``t_ms``."""
        if self._last_ms is None:
            self._board_ms = t_ms
        else:
            self._board_ms += (t_ms - self._last_ms) % _WRAP
        self._last_ms = t_ms
        board = self._board_ms / 1000
        difference = received - board
        while self._differences and self._differences[-1][1] >= difference:
            self._differences.pop()
        self._differences.append((received, difference))
        while self._differences[0][0] < received - self._window:
            self._differences.popleft()
        return board + self._differences[0][1]
