"""Runs: the record of what was driven."""

from __future__ import annotations

from typing import Any

from fastapi import APIRouter
from fastapi.responses import FileResponse
from starlette.concurrency import run_in_threadpool

from polepilot.server.convert import plan_record, run_record
from polepilot.server.errors import NotFoundError
from polepilot.server.routes.common import PathId, ServicesDep, problems
from polepilot.server.runs import read_track
from polepilot.server.schemas import RunDetail, RunRecord, Track

router = APIRouter(prefix="/runs", tags=["runs"])


@router.get("", response_model=list[RunRecord])
async def list_runs(services: ServicesDep) -> Any:
    """All runs, newest first."""
    return [run_record(row) for row in await run_in_threadpool(services.store.runs)]


@router.get("/{run_id}", response_model=RunDetail, responses=problems(404, 422))
async def get_run(services: ServicesDep, run_id: PathId) -> Any:
    """One run, its plan, and what it left uncovered."""
    row = await run_in_threadpool(services.store.run, run_id)
    plan = await run_in_threadpool(services.store.plan, row.plan_id)
    return {
        **run_record(row),
        "site_version": plan.site_version,
        "missed": row.missed or [],
        "plan": plan_record(plan),
    }


@router.get("/{run_id}/track", response_model=Track, responses=problems(404, 422))
async def get_track(services: ServicesDep, run_id: PathId) -> Any:
    """The positions of a run, thinned to what a screen can show."""
    await run_in_threadpool(services.store.run, run_id)
    return await run_in_threadpool(read_track, services.log_path(run_id))


@router.get(
    "/{run_id}/log",
    response_class=FileResponse,
    responses={
        200: {"content": {"application/octet-stream": {"schema": {"format": "binary"}}}},
        **problems(404, 422),
    },
)
async def get_log(services: ServicesDep, run_id: PathId) -> FileResponse:
    """The run's MCAP file."""
    await run_in_threadpool(services.store.run, run_id)
    path = services.log_path(run_id)
    if not path.is_file():
        raise NotFoundError(f"Run {run_id} has no log.", code="no_log")
    return FileResponse(
        path, media_type="application/octet-stream", filename=f"polepilot-run-{run_id}.mcap"
    )
