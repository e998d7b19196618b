"""The application: routes, errors, security and the page, around one set of services."""

from __future__ import annotations

from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from typing import TYPE_CHECKING, Any

from fastapi import APIRouter, FastAPI
from fastapi.openapi.utils import get_openapi
from starlette.websockets import WebSocket

from polepilot.server import errors
from polepilot.server.page import mount_page
from polepilot.server.proxy import mount_panel
from polepilot.server.routes import (
    landmarks,
    metrics,
    missions,
    plans,
    precision,
    robot,
    runs,
    simulation,
    sites,
)
from polepilot.server.schemas import Problem, SiteDocument
from polepilot.server.security import Security
from polepilot.server.version import VERSION

if TYPE_CHECKING:
    from polepilot.server.services import Services


def create_app(services: Services | None = None) -> FastAPI:
    """The ASGI application. Without services it can only describe itself (OpenAPI)."""

    @asynccontextmanager
    async def lifespan(_: FastAPI) -> AsyncIterator[None]:
        assert services is not None
        await services.open()
        try:
            yield
        finally:
            await services.close()

    app = FastAPI(
        title="Polepilot",
        version=VERSION,
        summary="Draw, check, drive, prove: the interface of the robot's brain.",
        lifespan=lifespan,
        docs_url=None,
        redoc_url=None,
        separate_input_output_schemas=False,
        generate_unique_id_function=lambda route: route.name,
    )
    app.state.services = services
    errors.install(app)
    api = APIRouter(prefix="/api/v1")
    for module in (robot, sites, precision, landmarks, plans, missions, runs, simulation):
        api.include_router(module.router)
    api.add_api_websocket_route("/stream", _stream)
    app.include_router(api)
    app.include_router(metrics.router)
    mount_panel(app)
    mount_page(app)
    app.add_middleware(
        Security,
        port=lambda: 8000 if services is None else services.port,
        host="127.0.0.1" if services is None else services.host,
    )
    app.openapi = lambda: openapi_document(app)  # type: ignore[method-assign]
    return app


def openapi_document(app: FastAPI) -> dict[str, Any]:
    """The OpenAPI document, with the problem document among its components."""
    if app.openapi_schema is None:
        document = get_openapi(
            title=app.title, version=app.version, summary=app.summary, routes=app.routes
        )
        known = document.setdefault("components", {}).setdefault("schemas", {})
        for model in (Problem, SiteDocument):
            schema = model.model_json_schema(ref_template="#/components/schemas/{model}")
            for name, definition in schema.pop("$defs", {}).items():
                known.setdefault(name, definition)
            known.setdefault(model.__name__, schema)
        app.openapi_schema = document
    return app.openapi_schema


async def _stream(socket: WebSocket) -> None:
    """Snapshots as they come, the newest one first."""
    services: Services = socket.app.state.services
    await services.hub.serve(socket, services.runner.latest)
