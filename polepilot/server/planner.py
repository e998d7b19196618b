"""Plans are computed in a process of their own, so that they never slow the robot down."""

from __future__ import annotations

from dataclasses import asdict
from typing import Any

from polepilot.core.vehicle import Vehicle
from polepilot.server.worker import Worker, serve

TIMEOUT = 120.0
"""Seconds after which a plan is given up."""


class Planner(Worker):
    """Hands jobs to the planning process, one at a time."""

    def __init__(self, vehicle: Vehicle) -> None:
        super().__init__("polepilot.server.planner", "plan", "planning")
        self._vehicle = asdict(vehicle)

    async def plan(self, job: dict[str, Any]) -> dict[str, Any]:
        """Compute a plan.

        Args:
            job: ``site`` (SITE.json), ``mode``, ``route``, ``end_heading`` (rad, or None),
                ``options`` (what PlanOptions is given besides the vehicle; ``start`` as a list),
                ``area`` (MultiPolygon coordinates, or None for everything that can be reached).

        Returns:
            what ``convert.plan_document`` makes of the plan.

        Raises:
            PlanError, SiteError, InputError: as planning does.
            BusyError: it took too long, or the process was killed.
        """
        remedy = "Use a larger tool width, or a simpler drawing."
        plan: dict[str, Any] = await self.ask({**job, "vehicle": self._vehicle}, TIMEOUT, remedy)
        return plan


def compute(job: dict[str, Any]) -> dict[str, Any]:
    """Carry out one job, in the planning process."""
    from polepilot.core.planning.coverage import plan_scan
    from polepilot.core.planning.options import PlanOptions
    from polepilot.core.planning.route import plan_route
    from polepilot.core.site import Start, parse_site
    from polepilot.server.convert import multipolygon_of, plan_document

    site = parse_site(job["site"], "the site")
    options = dict(job["options"])
    if (start := options.get("start")) is not None:
        options["start"] = Start(*start)
    wanted = PlanOptions.from_vehicle(Vehicle(**job["vehicle"]), **options)
    if job["mode"] == "route":
        return plan_document(plan_route(site, job["route"], wanted, job.get("end_heading")))
    area = None if job["area"] is None else multipolygon_of(job["area"])
    return plan_document(plan_scan(site, wanted, area))


def main() -> None:
    """Answer until standard input ends. An error that is not bad input ends the process."""
    serve(compute, ("polepilot.core.planning.coverage", "polepilot.core.planning.route"))


if __name__ == "__main__":
    main()
