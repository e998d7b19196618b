"""Missions: a plan being executed."""

from __future__ import annotations

from typing import Any

from fastapi import APIRouter, Response

from polepilot.server.convert import run_record
from polepilot.server.routes.common import ServicesDep, problems
from polepilot.server.routes.robot import snapshot_response
from polepilot.server.routes.sites import IdempotencyKey
from polepilot.server.schemas import MissionRequest, RunRecord, Snapshot
from polepilot.server.store import Once

router = APIRouter(tags=["missions"])


@router.post(
    "/missions",
    status_code=201,
    response_model=RunRecord,
    responses=problems(404, 409, 422, 503),
)
async def start_mission(
    services: ServicesDep, wanted: MissionRequest, idempotency_key: IdempotencyKey = None
) -> Any:
    """Start to drive a plan."""

    once = Once.of("run", idempotency_key, wanted.model_dump())
    return run_record(await services.missions.start(wanted.plan_id, once))


@router.post("/mission/pause", response_model=Snapshot, responses=problems(409, 503))
async def pause_mission(services: ServicesDep) -> Response:
    """Stand still and keep the job."""
    await services.runner.call(lambda robot: robot.pause())
    return snapshot_response(services)


@router.post("/mission/resume", response_model=Snapshot, responses=problems(409, 503))
async def resume_mission(services: ServicesDep) -> Response:
    """Go on where the job was paused."""
    await services.runner.call(lambda robot: robot.resume())
    return snapshot_response(services)


@router.post("/mission/end", response_model=Snapshot, responses=problems(409, 503))
async def end_mission(services: ServicesDep) -> Response:
    """Give the job up; what is left can be planned anew."""
    await services.runner.call(lambda robot: robot.end())
    return snapshot_response(services)
