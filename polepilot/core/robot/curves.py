"""The planner's curves for control, which gets back to its path by them."""

from __future__ import annotations

from collections.abc import Sequence

from polepilot.core.control.way_back import CHANGE, Curves, Line
from polepilot.core.geometry import Pose2D
from polepilot.core.planning.curves import sample, shortest_curves
from polepilot.core.vehicle import Vehicle


def curves_of(vehicle: Vehicle) -> Curves:
    """Curves from pose to pose for this vehicle, the best first, as points and gears."""
    radius = vehicle.plan_turn_radius

    def between(start: Pose2D, goal: Pose2D) -> Sequence[Line]:
        found = shortest_curves(start, goal, radius, CHANGE)
        return [sample(start, curve, radius)[:2] for curve in found]

    return between
