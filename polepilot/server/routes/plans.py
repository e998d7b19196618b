"""Plans: what a job would do, before a wheel turns."""

from __future__ import annotations

from typing import Any

from fastapi import APIRouter, Request, Response
from starlette.concurrency import run_in_threadpool

from polepilot.server.convert import plan_record
from polepilot.server.routes.common import PathId, ServicesDep, problems, while_waited_for
from polepilot.server.schemas import PlanRecord, PlanRequest

router = APIRouter(prefix="/plans", tags=["plans"])


@router.post("", status_code=201, response_model=PlanRecord, responses=problems(404, 409, 422, 503))
async def add_plan(services: ServicesDep, wanted: PlanRequest, request: Request) -> Any:
    """Compute a plan and keep it. It is given up when whoever asked for it leaves."""
    found = await while_waited_for(request, services.missions.plan(wanted))
    return found if isinstance(found, Response) else plan_record(found)


@router.get("/{plan_id}", response_model=PlanRecord, responses=problems(404, 422))
async def get_plan(services: ServicesDep, plan_id: PathId) -> Any:
    """A plan that was computed before."""
    return plan_record(await run_in_threadpool(services.store.plan, plan_id))
