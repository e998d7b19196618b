"""Drawn maps: kept in versions, edited with ETag and If-Match."""

from __future__ import annotations

import re
from typing import Annotated, Any

from fastapi import APIRouter, Header, Response
from starlette.concurrency import run_in_threadpool

from polepilot.core.errors import SiteError
from polepilot.core.site import Site, parse_site
from polepilot.server.errors import PreconditionError
from polepilot.server.routes.common import JsonObject, PathId, ServicesDep, body_of, problems
from polepilot.server.schemas import (
    FeatureCollection,
    SiteCheck,
    SiteProblem,
    SiteRecord,
    SiteSummary,
    SiteVersion,
)
from polepilot.server.store import Once, SiteRow

router = APIRouter(prefix="/sites", tags=["sites"])
IfMatch = Annotated[str | None, Header(description='The ETag that was edited, such as `"v3"`.')]
IdempotencyKey = Annotated[
    str | None,
    Header(
        min_length=1,
        max_length=200,
        description="A repeated request with the same key is done once and answered alike.",
    ),
]


def record_of(row: SiteRow) -> dict[str, Any]:
    """A SiteRecord document."""
    return {
        "id": row.id,
        "version": row.version,
        "name": row.name,
        "updated_at": row.updated_at,
        "repairs": list(row.repairs),
        "site": row.document,
    }


def _answer(response: Response, row: SiteRow) -> dict[str, Any]:
    response.headers["ETag"] = f'"v{row.version}"'
    return record_of(row)


def version_of(if_match: str | None) -> int | None:
    """The version that If-Match names; None for ``*``.

    Raises:
        PreconditionError: it is missing (428) or names no version of ours (412).
    """
    if if_match is None:
        raise PreconditionError(
            "If-Match is missing.",
            status=428,
            code="if_match_required",
            remedy="Send the ETag of the version that was edited.",
        )
    if if_match.strip() == "*":
        return None
    match = re.fullmatch(r'"v([0-9]{1,15})"', if_match.strip(), re.ASCII)
    if match is None:
        raise PreconditionError(
            f"If-Match is {if_match!r}: expected an ETag of this site.",
            status=412,
            code="conflict",
            remedy="Load the site again.",
        )
    return int(match[1])


@router.get("", response_model=list[SiteSummary])
async def list_sites(services: ServicesDep) -> Any:
    """All sites, by name."""
    return [
        {"id": row.id, "name": row.name, "version": row.version, "updated_at": row.updated_at}
        for row in await run_in_threadpool(services.store.sites)
    ]


@router.post(
    "",
    status_code=201,
    response_model=SiteRecord,
    response_model_exclude_unset=True,
    responses=problems(409, 422),
    openapi_extra=body_of("SiteDocument"),
)
async def add_site(
    services: ServicesDep,
    document: JsonObject,
    response: Response,
    idempotency_key: IdempotencyKey = None,
) -> Any:
    """Keep a new drawing; it must be a usable site."""
    site = await run_in_threadpool(_parse, document)

    once = Once.of("site", idempotency_key, document)
    row = await run_in_threadpool(services.store.add_site, site.to_json(), site.repairs, once)
    return _answer(response, row)


@router.post(
    "/check",
    response_model=SiteCheck,
    responses=problems(422),
    openapi_extra=body_of("SiteDocument"),
)
async def check_site(document: JsonObject) -> Any:
    """Look for what is wrong with a drawing, without keeping it."""
    try:
        site = await run_in_threadpool(_parse, document)
    except SiteError as error:
        found = SiteProblem(message=str(error), where=error.where, code=error.code)
        return SiteCheck(ok=False, problems=[found], repairs=[])
    return SiteCheck(ok=True, problems=[], repairs=list(site.repairs))


# Before "/{site_id}", which would take the suffix for a part of the number.
@router.get("/{site_id}.geojson", response_model=FeatureCollection, responses=problems(404, 422))
async def get_geojson(services: ServicesDep, site_id: PathId) -> Any:
    """The site as GeoJSON in local metres."""
    row = await run_in_threadpool(services.store.site, site_id)
    return await run_in_threadpool(lambda: _parse(row.document).to_geojson())


@router.get(
    "/{site_id}",
    response_model=SiteRecord,
    response_model_exclude_unset=True,
    responses=problems(404, 422),
)
async def get_site(services: ServicesDep, site_id: PathId, response: Response) -> Any:
    """The newest version of a site."""
    return _answer(response, await run_in_threadpool(services.store.site, site_id))


@router.put(
    "/{site_id}",
    response_model=SiteRecord,
    response_model_exclude_unset=True,
    responses=problems(404, 412, 422, 428),
    openapi_extra=body_of("SiteDocument"),
)
async def change_site(
    services: ServicesDep,
    site_id: PathId,
    document: JsonObject,
    response: Response,
    if_match: IfMatch = None,
) -> Any:
    """Keep a new version; the older ones stay. The robot takes it over when nothing runs."""
    version = version_of(if_match)
    site = await run_in_threadpool(_parse, document)
    row = await run_in_threadpool(
        services.store.change_site, site_id, version, site.to_json(), site.repairs
    )
    await services.missions.site_changed(row)
    return _answer(response, row)


@router.delete("/{site_id}", status_code=204, responses=problems(404, 409, 412, 422, 428))
async def delete_site(services: ServicesDep, site_id: PathId, if_match: IfMatch = None) -> Response:
    """Take a site off the list; its runs keep what they drove by."""
    version = version_of(if_match)
    services.missions.refuse_if_in_use(site_id)
    await run_in_threadpool(services.store.delete_site, site_id, version)
    return Response(status_code=204)


@router.get("/{site_id}/versions", response_model=list[SiteVersion], responses=problems(404, 422))
async def list_versions(services: ServicesDep, site_id: PathId) -> Any:
    """All versions, oldest first."""
    rows = await run_in_threadpool(services.store.site_versions, site_id)
    return [{"version": version, "updated_at": at} for version, at in rows]


@router.get(
    "/{site_id}/versions/{version}",
    response_model=SiteRecord,
    response_model_exclude_unset=True,
    responses=problems(404, 422),
)
async def get_version(
    services: ServicesDep, site_id: PathId, version: PathId, response: Response
) -> Any:
    """One version of a site."""
    return _answer(response, await run_in_threadpool(services.store.site, site_id, version))


def _parse(document: dict[str, Any]) -> Site:
    return parse_site(document, "the site")
