"""The paper's filter: each axis by itself, one number at a time (Table 1).

    K = (P + Q) / (P + Q + R),   X = K Z + (1 - K) X⁻,   P = (1 - K) P⁻

Kept as printed, as the reference ``paper``. Deviations of the paper from the textbook, recorded
here and not mended: it calls R = 0.6 and Q = 0.1 standard deviations and uses them as variances;
and its last equation lacks Q, where the textbook has P = (1 - K)(P⁻ + Q), so P goes to 0 and K
to Q / (Q + R) = 0.143 (textbook: 0.333).
"""

from __future__ import annotations

from dataclasses import dataclass

from polepilot.core.errors import InternalError


@dataclass(slots=True)
class AxisFilter:
    """One coordinate. ``value`` is X, ``variance`` is P; the first measurement sets X = Z."""

    measurement_noise: float = 0.6
    process_noise: float = 0.1
    variance: float = 1.0
    value: float | None = None
    gain: float = 0.0
    """The K of the last update."""

    def __post_init__(self) -> None:
        if self.measurement_noise <= 0 or self.process_noise < 0 or self.variance < 0:
            raise InternalError("an axis filter needs R > 0, Q >= 0 and P0 >= 0.")

    def update(self, measured: float, predicted: float | None = None) -> float:
        """The new X from Z = ``measured`` and X⁻ = ``predicted`` (default: the last X)."""
        prior = self.variance + self.process_noise
        self.gain = prior / (prior + self.measurement_noise)
        before = self.value if predicted is None else predicted
        if before is None:
            before = measured
        self.value = self.gain * measured + (1.0 - self.gain) * before
        self.variance = (1.0 - self.gain) * self.variance
        return self.value
