"""The robot itself: its state, its site, and the stop that always works."""

from __future__ import annotations

from typing import Annotated, Any

from fastapi import APIRouter, Query, Response
from starlette.concurrency import run_in_threadpool

from polepilot.server.convert import model_document
from polepilot.server.errors import NotFoundError
from polepilot.server.routes.common import ServicesDep, problems
from polepilot.server.schemas import About, SiteChoice, Snapshot
from polepilot.server.version import VERSION

router = APIRouter(tags=["robot"])


def snapshot_response(services: ServicesDep) -> Response:
    """The newest snapshot, as the stream sends it."""
    return Response(services.snapshot_bytes(), media_type="application/json")


@router.get("/about", response_model=About)
async def about(services: ServicesDep) -> Any:
    """What this robot is."""
    return {
        "name": services.name,
        "version": VERSION,
        "board": services.board,
        "simulated": services.twin is not None,
        "site_id": services.missions.site_id,
        "model": model_document(services.model),
    }


@router.get("/robot", response_model=Snapshot, responses=problems(503))
async def get_robot(services: ServicesDep) -> Response:
    """The newest snapshot, the same document as on the stream."""
    return snapshot_response(services)


@router.put("/robot/site", response_model=Snapshot, responses=problems(404, 409, 422, 503))
async def choose_site(services: ServicesDep, choice: SiteChoice) -> Response:
    """Load a site; the robot fixes its pose anew."""
    await services.missions.load_site(choice.site_id)
    return snapshot_response(services)


@router.post("/robot/stop", response_model=Snapshot, responses=problems(503))
async def stop(services: ServicesDep) -> Response:
    """Emergency stop: wheels off at once, latched until it is cleared."""
    await services.runner.call(lambda robot: robot.stop("Emergency stop by hand."), urgent=True)
    return snapshot_response(services)


@router.post("/robot/clear", response_model=Snapshot, responses=problems(409, 503))
async def clear(services: ServicesDep) -> Response:
    """Release the emergency stop; nothing moves by itself afterwards."""
    await services.runner.call(lambda robot: robot.clear())
    return snapshot_response(services)


@router.get(
    "/camera.jpg",
    response_class=Response,
    responses={
        200: {"content": {"image/jpeg": {"schema": {"type": "string", "format": "binary"}}}},
        **problems(404, 422),
    },
)
async def camera(
    services: ServicesDep,
    plain: Annotated[bool, Query(description="Without the detections drawn.")] = False,
) -> Response:
    """The latest picture, with what was seen in it."""
    sighting = services.runner.sighting
    if sighting is None or sighting.frame is None:
        raise NotFoundError("There is no picture.", code="no_picture")
    picture = await run_in_threadpool(services.pictures.jpeg, sighting, plain)
    headers = {"Cache-Control": "no-store", "X-Stamp": f"{sighting.stamp:.4f}"}
    return Response(picture, media_type="image/jpeg", headers=headers)
