"""A judgement in plain words: good, fair or poor, why, and what would make it better."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Literal

Grade = Literal["good", "fair", "poor"]


@dataclass(frozen=True, slots=True)
class Verdict:
    """What to think of a calibration. ``poor`` means: do not use it."""

    grade: Grade
    reason: str
    notes: tuple[str, ...] = ()
    """What else a person should know or do, one sentence each."""

    @property
    def text(self) -> str:
        """``good: every picture agrees within 0.2 %.``, without the notes."""
        return f"{self.grade}: {self.reason}"

    def to_json(self) -> dict[str, Any]:
        """``{"grade", "reason", "notes"}``."""
        return {"grade": self.grade, "reason": self.reason, "notes": list(self.notes)}
