"""The simulated world: people in the way, a robot lifted and put down elsewhere."""

from __future__ import annotations

from typing import Any

from fastapi import APIRouter, Response

from polepilot.core.errors import RefusedError
from polepilot.core.geometry import Pose2D, wrap_angle
from polepilot.server.routes.common import ServicesDep, problems
from polepilot.server.routes.robot import snapshot_response
from polepilot.server.runner import Twin
from polepilot.server.schemas import (
    PlaceRequest,
    Simulation,
    SimulationRequest,
    Snapshot,
)

router = APIRouter(prefix="/simulation", tags=["simulation"])


def _twin(services: ServicesDep) -> Twin:
    if services.twin is None:
        raise RefusedError(
            "This robot is real.", code="not_simulated", remedy="Start with --board simulated."
        )
    twin: Twin = services.twin
    return twin


def _document(twin: Twin) -> dict[str, Any]:
    return {"obstacles": [{"x": x, "y": y, "radius": radius} for x, y, radius in twin.obstacles]}


@router.get("", response_model=Simulation, responses=problems(409, 503))
async def get_simulation(services: ServicesDep) -> Any:
    """What stands in the simulated world besides the site."""
    twin = _twin(services)
    return await services.runner.call(lambda _: _document(twin))


@router.put("", response_model=Simulation, responses=problems(409, 422, 503))
async def change_simulation(services: ServicesDep, wanted: SimulationRequest) -> Any:
    """Put obstacles into the simulated world, instead of those that are there."""
    twin = _twin(services)
    discs = [(disc.x, disc.y, disc.radius) for disc in wanted.obstacles]

    def change(_: object) -> dict[str, Any]:
        twin.set_obstacles(discs)
        return _document(twin)

    return await services.runner.call(change)


@router.post("/place", response_model=Snapshot, responses=problems(409, 422, 503))
async def place(services: ServicesDep, wanted: PlaceRequest) -> Response:
    """Lift the simulated robot and put it down elsewhere, without telling it."""
    twin = _twin(services)
    pose = Pose2D(wanted.x, wanted.y, wrap_angle(wanted.heading))
    await services.runner.call(lambda _: twin.place(pose))
    return snapshot_response(services)
