"""Figures for Prometheus, at /metrics."""

from __future__ import annotations

from fastapi import APIRouter, Response

from polepilot.server.routes.common import ServicesDep

router = APIRouter(include_in_schema=False)


@router.get("/metrics")
async def metrics(services: ServicesDep) -> Response:
    """The text exposition format."""
    return Response(services.metrics.text(), media_type="text/plain; version=0.0.4; charset=utf-8")
