"""What a plan is asked for: tool, clearance, tightest turn, start, order, speeds."""

from __future__ import annotations

import math
from dataclasses import dataclass, fields
from typing import Any, Literal

from polepilot.core.errors import PlanError
from polepilot.core.site import Start
from polepilot.core.vehicle import Vehicle

Order = Literal["default", "paper"]


@dataclass(frozen=True, slots=True)
class PlanOptions:
    """Metres, seconds. Refuses what no robot has.

    Raises:
        PlanError: a value out of its range; the message names it.
    """

    tool_width: float = 0.4
    clearance: float = 0.2
    """The path comes no nearer than this to boundary, islands and walls."""
    min_turn_radius: float = 0.6
    """0: corners may be as sharp as they like."""
    start: Start | None = None
    """None: where the site says, else in its largest part."""
    order: Order = "default"
    """``paper`` finishes each loop before the next; ``default`` is shorter."""
    max_speed: float = 0.40
    max_acceleration: float = 0.60
    reversal_time: float = 1.5
    """What a change of gear costs: to stop, to steer, to start again."""

    def __post_init__(self) -> None:
        for name, low, high in (
            ("tool_width", 0.01, 100.0),
            ("clearance", 0.0, 100.0),
            ("min_turn_radius", 0.0, 100.0),
            ("max_speed", 0.001, 100.0),
            ("max_acceleration", 0.001, 1000.0),
            ("reversal_time", 0.0, 1000.0),
        ):
            value = getattr(self, name)
            if not low <= value <= high:  # NaN as well
                raise PlanError(f"{name} is {value:g}: expected {low:g} to {high:g}.")
        if self.order not in ("default", "paper"):
            raise PlanError(f"order is {self.order!r}: expected 'default' or 'paper'.")
        if self.start is not None and not all(
            math.isfinite(value)
            for value in (self.start.x, self.start.y, self.start.heading or 0.0)
        ):
            raise PlanError("start is not finite: expected X,Y or X,Y,HEADING.")

    @classmethod
    def from_vehicle(cls, vehicle: Vehicle, **overrides: Any) -> PlanOptions:
        """What a vehicle needs; ``overrides`` that are None are taken from the vehicle."""
        values: dict[str, Any] = {
            "tool_width": vehicle.tool_width,
            "clearance": vehicle.clearance,
            "min_turn_radius": vehicle.plan_turn_radius,
            "max_speed": vehicle.max_speed,
            "max_acceleration": vehicle.max_acceleration,
        }
        known = {entry.name for entry in fields(cls)}
        for key, value in overrides.items():
            if key not in known:
                raise PlanError(f"{key!r} is no planning option: expected {', '.join(known)}.")
            if value is not None:
                values[key] = value
        return cls(**values)
