"""Plans: what a job would do, before a wheel turns."""

from __future__ import annotations

import asyncio
from typing import Any

from fastapi import APIRouter, Request, Response
from starlette.concurrency import run_in_threadpool

from polepilot.server.convert import plan_record
from polepilot.server.routes.common import PathId, ServicesDep, problems
from polepilot.server.schemas import PlanRecord, PlanRequest

router = APIRouter(prefix="/plans", tags=["plans"])
_LOOK = 0.25
"""Seconds between looks whether somebody still waits for a plan."""


@router.post("", status_code=201, response_model=PlanRecord, responses=problems(404, 409, 422, 503))
async def add_plan(services: ServicesDep, wanted: PlanRequest, request: Request) -> Any:
    """Compute a plan and keep it. It is given up when whoever asked for it leaves."""
    work = asyncio.ensure_future(services.missions.plan(wanted))
    try:
        while not (await asyncio.wait({work}, timeout=_LOOK))[0]:
            if await request.is_disconnected():
                # Nobody reads this answer.
                return Response(status_code=503)
        return plan_record(work.result())
    finally:
        work.cancel()


@router.get("/{plan_id}", response_model=PlanRecord, responses=problems(404, 422))
async def get_plan(services: ServicesDep, plan_id: PathId) -> Any:
    """A plan that was computed before."""
    return plan_record(await run_in_threadpool(services.store.plan, plan_id))
