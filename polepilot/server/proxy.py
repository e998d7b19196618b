"""The 3D panel behind our own port: HTTP and WebSocket below /viser/ go to its private server.

The panel listens on 127.0.0.1 at a port of its own and has no login; whoever reaches it through
here has passed the checks of `security`.
"""

from __future__ import annotations

import asyncio
import contextlib
from typing import TYPE_CHECKING

import httpx
from fastapi import FastAPI, Request, Response
from fastapi.responses import RedirectResponse, StreamingResponse
from starlette.background import BackgroundTask
from starlette.websockets import WebSocket, WebSocketDisconnect
from websockets.asyncio.client import ClientConnection, connect
from websockets.exceptions import ConnectionClosed, InvalidHandshake
from websockets.typing import Subprotocol

from polepilot.server.errors import BusyError, NotFoundError

if TYPE_CHECKING:
    from polepilot.server.services import Services

_HOP_BY_HOP = frozenset(
    (
        "connection",
        "keep-alive",
        "proxy-authenticate",
        "proxy-authorization",
        "te",
        "trailer",
        "transfer-encoding",
        "upgrade",
        "host",
        "origin",
        "referer",
        "cookie",
    )
)
_MOST_MESSAGE = 64 * 1024 * 1024
_NOT_THERE = 1013
_CLOSE_TIMEOUT = 0.5


def mount_panel(app: FastAPI) -> None:
    """Add the routes below /viser."""
    # The panel's client dials its own address without the slash.
    app.add_api_websocket_route("/viser", _forward_socket)
    app.add_api_websocket_route("/viser/{path:path}", _forward_socket)
    app.add_api_route("/viser", _add_slash, methods=["GET", "HEAD"], include_in_schema=False)
    app.add_api_route(
        "/viser/{path:path}", _forward, methods=["GET", "HEAD"], include_in_schema=False
    )


async def _add_slash() -> Response:
    return RedirectResponse("/viser/", 307)


async def _forward(request: Request, path: str) -> Response:
    services: Services = request.app.state.services
    port = services.panel_port
    if port is None:
        raise _no_panel()
    upstream = services.panel_client.build_request(
        request.method,
        httpx.URL(f"http://127.0.0.1:{port}/", path=f"/{path}", query=request.url.query.encode()),
        headers=[(k, v) for k, v in request.headers.items() if k not in _HOP_BY_HOP],
    )
    try:
        answer = await services.panel_client.send(upstream, stream=True)
    except httpx.HTTPError:
        raise _no_panel() from None
    if answer.status_code == 404:
        await answer.aclose()
        raise NotFoundError("The 3D panel has nothing at this address.")
    response = StreamingResponse(
        answer.aiter_raw(), answer.status_code, background=BackgroundTask(answer.aclose)
    )
    response.raw_headers = [
        (name.lower(), value)
        for name, value in answer.headers.raw
        if name.lower().decode("latin-1") not in _HOP_BY_HOP
    ]
    return response


def _no_panel() -> BusyError:
    return BusyError(
        "The 3D panel is not running.", code="no_panel", remedy="Look at the service's log."
    )


async def _forward_socket(socket: WebSocket, path: str = "") -> None:
    services: Services = socket.app.state.services
    port = services.panel_port
    if port is None:
        await socket.accept()
        await socket.close(_NOT_THERE, "the 3D panel is not running")
        return
    query = f"?{socket.url.query}" if socket.url.query else ""
    wanted = [Subprotocol(name) for name in socket.scope["subprotocols"]]
    try:
        async with connect(
            f"ws://127.0.0.1:{port}/{path}{query}",
            subprotocols=wanted or None,
            max_size=_MOST_MESSAGE,
            compression=None,
            proxy=None,
            close_timeout=_CLOSE_TIMEOUT,
        ) as panel:
            await socket.accept(subprotocol=panel.subprotocol)
            await _join(socket, panel)
    except (OSError, TimeoutError, InvalidHandshake):
        with contextlib.suppress(RuntimeError):
            await socket.accept()
            await socket.close(_NOT_THERE, "the 3D panel does not answer")


async def _join(socket: WebSocket, panel: ClientConnection) -> None:
    """Pass messages both ways until one side leaves."""
    ways = {
        asyncio.create_task(_to_panel(socket, panel)),
        asyncio.create_task(_to_browser(socket, panel)),
    }
    try:
        await asyncio.wait(ways, return_when=asyncio.FIRST_COMPLETED)
    finally:
        for way in ways:
            way.cancel()
        await asyncio.gather(*ways, return_exceptions=True)
        with contextlib.suppress(RuntimeError, WebSocketDisconnect):
            await socket.close()


async def _to_panel(socket: WebSocket, panel: ClientConnection) -> None:
    with contextlib.suppress(ConnectionClosed, WebSocketDisconnect, RuntimeError):
        while (message := await socket.receive())["type"] == "websocket.receive":
            data = message.get("bytes")
            await panel.send(message["text"] if data is None else data)


async def _to_browser(socket: WebSocket, panel: ClientConnection) -> None:
    with contextlib.suppress(ConnectionClosed, WebSocketDisconnect, RuntimeError):
        async for message in panel:
            if isinstance(message, str):
                await socket.send_text(message)
            else:
                await socket.send_bytes(message)
