"""A planned path: where `base_link` goes, in which gear, and what is to be expected of it."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray
from shapely import MultiPolygon

from polepilot.core.errors import InternalError
from polepilot.core.geometry import Point, Polyline

Mode = Literal["scan", "route"]
PartKind = Literal["loop", "bridge", "link", "cleanup", "route"]


@dataclass(frozen=True, slots=True)
class PlanPart:
    """A stretch of the path: points ``first`` to ``last``, where the next part begins."""

    kind: PartKind
    first: int
    last: int


@dataclass(frozen=True, slots=True)
class Unreachable:
    """Free space that the robot's size keeps it out of, and why."""

    polygon: Polyline
    reason: str


@dataclass(frozen=True, slots=True)
class Prediction:
    """What a plan will do: share of the reachable area swept, metres, seconds, changes of gear."""

    coverage: float
    length: float
    duration: float
    reversals: int
    overlap: float = 0.0
    """Share of the strip under the tool that falls on floor which was swept before, 0 to 1; 0 for
    routes and for plans kept by older versions."""


@dataclass(frozen=True, slots=True, eq=False)
class Plan:
    """Path of `base_link` in `map`: N points, N-1 gears (1 forward, -1 backward), and its parts."""

    mode: Mode
    path: NDArray[np.float64]
    """N x 2, metres."""
    gear: NDArray[np.int8]
    """N-1."""
    parts: tuple[PlanPart, ...]
    unreachable: tuple[Unreachable, ...]
    predicted: Prediction
    tool_width: float
    clearance: float
    min_turn_radius: float
    area: MultiPolygon = field(default_factory=MultiPolygon)
    """Scan mode: the part of the reachable area that this plan is to sweep."""
    nodes: tuple[Point, ...] = ()
    """Route mode: the places to pass, by which the drive is judged."""
    notes: tuple[str, ...] = ()
    """What the planner decided that a person should know."""
    runtime: float = 0.0
    """Seconds that planning took."""

    def __post_init__(self) -> None:
        count = len(self.path)
        if self.path.shape != (count, 2) or count < 2 or len(self.gear) != count - 1:
            raise InternalError(
                f"a plan has {count} points and {len(self.gear)} gears: expected N x 2 and N-1."
            )
        ends = [0, *(part.last for part in self.parts)]
        if [part.first for part in self.parts] != ends[:-1] or ends[-1] != count - 1:
            raise InternalError("the parts of a plan leave a gap in its path.")

    def to_json(self) -> dict[str, Any]:
        """The ``plan --json`` document (docs: contracts)."""
        return {
            "path": np.round(self.path, 4).tolist(),
            "gear": self.gear.tolist(),
            "parts": [{"kind": p.kind, "first": p.first, "last": p.last} for p in self.parts],
            "unreachable": [
                {"polygon": [list(point) for point in u.polygon], "reason": u.reason}
                for u in self.unreachable
            ],
            "predicted": {
                "coverage": self.predicted.coverage,
                "length": self.predicted.length,
                "duration": self.predicted.duration,
                "reversals": self.predicted.reversals,
                "overlap": self.predicted.overlap,
            },
            "nodes": [list(node) for node in self.nodes],
            "notes": list(self.notes),
            "runtime": self.runtime,
        }
