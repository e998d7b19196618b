"""What is told twice is no second witness: sightings that came before are left out."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

from polepilot.core.observation import RangeBearing


@dataclass(slots=True)
class Repeats:
    """Remembers when each landmark was last told of; bounded in memory."""

    _last: dict[int, float] = field(default_factory=dict)

    def fresh(self, measurements: Sequence[RangeBearing]) -> list[RangeBearing]:
        """Those of landmarks that no earlier call had at the same moment.

        Two different ones of one landmark in one picture both stay: one of them may be misread.
        """
        several = measurements if len(measurements) == 1 else dict.fromkeys(measurements)
        new = [m for m in several if self._last.get(m.landmark) != m.stamp]
        if len(self._last) > 1000:
            self._last.clear()
        self._last.update((m.landmark, m.stamp) for m in new)
        return new
