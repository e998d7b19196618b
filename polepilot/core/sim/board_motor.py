"""A motor's duty on the simulated board: its slew limit, and no plugging (``core/motor.c``)."""

from __future__ import annotations

_LAG_MS = 64
"""Of the speed behind the duty."""
_SCALE = 8
"""Of the followed speed, which is a whole number as on the chip."""
_REST = 100 * _SCALE
"""Slower than a tenth of full speed a motor may be reversed."""
_LONGEST_MS = 256
"""After that a ramp has ended and a motor stands."""


class BoardMotor:
    """One bridge of the board and what is known of the motor behind it.

    A motor that still turns the other way gets nothing until it has nearly stopped: a reversed
    supply would add to its own voltage, and draw twice the current of a standing one.

    Args:
        slew: largest change of the duty, per mille per millisecond.
    """

    def __init__(self, slew: int) -> None:
        self.duty = 0
        """Per mille, forward or left positive."""
        self._slew = slew
        self._speed = 0

    def off(self) -> None:
        """No duty, at once. How fast the motor may still turn is kept."""
        self.duty = 0

    def run(self, target: int, elapsed_ms: int) -> None:
        """Let time pass on the way to ``target``, per mille."""
        for _ in range(min(elapsed_ms, _LONGEST_MS)):
            gap = self.duty * _SCALE - self._speed
            # Towards zero, as C divides.
            change = gap // _LAG_MS if gap >= 0 else -(-gap // _LAG_MS)
            self._speed += change
            plugging = (target < 0 and self._speed > _REST) or (target > 0 and self._speed < -_REST)
            goal = 0 if plugging else target
            if change == 0 and self.duty == goal:
                return  # nothing will change any more
            self.duty = approach(self.duty, goal, self._slew)


def approach(value: int, target: int, reach: int) -> int:
    """From ``value`` towards ``target``, by at most ``reach``."""
    return min(value + reach, target) if value < target else max(value - reach, target)
