"""How well the robot will know its pose, before it is there."""

from __future__ import annotations

from typing import Any

from fastapi import APIRouter, Request
from starlette.concurrency import run_in_threadpool

from polepilot.server.routes.common import PathId, ServicesDep, problems, while_waited_for
from polepilot.server.schemas_precision import (
    DrawnPrecisionRequest,
    PrecisionRecord,
    PrecisionRequest,
)

router = APIRouter(prefix="/sites", tags=["precision"])


@router.post("/precision", response_model=PrecisionRecord, responses=problems(422, 503))
async def drawn_precision(
    services: ServicesDep, wanted: DrawnPrecisionRequest, request: Request
) -> Any:
    """The precision map of a drawing, without keeping it."""
    work = services.precision.map(
        wanted.site, detail=wanted.detail, resolution=wanted.resolution, suggest=wanted.suggest
    )
    return await while_waited_for(request, work)


@router.post(
    "/{site_id}/precision", response_model=PrecisionRecord, responses=problems(404, 422, 503)
)
async def site_precision(
    services: ServicesDep, site_id: PathId, wanted: PrecisionRequest, request: Request
) -> Any:
    """The precision map of a kept site, with its own landmarks or with others."""
    row = await run_in_threadpool(services.store.site, site_id)
    document = row.document
    if wanted.landmarks is not None:
        marks = [mark.model_dump() for mark in wanted.landmarks]
        document = {**document, "landmarks": marks}
    work = services.precision.map(
        document, detail=wanted.detail, resolution=wanted.resolution, suggest=wanted.suggest
    )
    return await while_waited_for(request, work)
