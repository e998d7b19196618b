"""Who may ask: only this machine, and only our own page in its browser.

There is no login yet, so the service listens on the loopback addresses alone and believes neither
a foreign Host (DNS rebinding) nor a foreign Origin (another page in the same browser). WebSockets
are checked as well: no browser asks before it opens one.
"""

from __future__ import annotations

import ipaddress
from collections.abc import Awaitable, Callable, MutableMapping
from typing import Any

import structlog
from starlette.datastructures import Headers, MutableHeaders
from starlette.exceptions import HTTPException
from starlette.responses import Response
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from polepilot.core.errors import InputError
from polepilot.server.errors import problem

MOST_BODY = 5 * 1024 * 1024
"""Bytes; larger bodies are refused."""
LOOPBACK_NAMES = ("127.0.0.1", "localhost", "::1")

_PAGE_POLICY = (
    "default-src 'self'; script-src 'self'; style-src 'self' 'unsafe-inline';"
    " img-src 'self' data: blob:; font-src 'self' data:; connect-src 'self' ws://{host};"
    " worker-src 'self' blob:; frame-src 'self'; frame-ancestors 'self'; object-src 'none';"
    " base-uri 'self'; form-action 'self'"
)
# The panel's client is a third party's build: it compiles WebAssembly and decodes from data URLs.
_PANEL_POLICY = (
    "default-src 'self' data: blob:; script-src 'self' 'unsafe-inline' 'unsafe-eval' blob:;"
    " style-src 'self' 'unsafe-inline'; img-src 'self' data: blob:; font-src 'self' data:;"
    " connect-src 'self' ws://{host} data: blob:; worker-src 'self' blob: data:;"
    " frame-ancestors 'self'; object-src 'none'; base-uri 'self'"
)

log = structlog.get_logger("polepilot.server")


def check_loopback(host: str) -> None:
    """Raises InputError for an address that others could reach."""
    if host in LOOPBACK_NAMES:
        return
    try:
        if ipaddress.ip_address(host).is_loopback:
            return
    except ValueError:
        pass
    raise InputError(
        f"--host is {host!r}: expected 127.0.0.1, localhost or ::1,"
        " because there is no login yet that would keep others out."
    )


class Security:
    """ASGI middleware, the outermost one: checks, limits, headers, and the last safety net."""

    def __init__(self, app: ASGIApp, port: Callable[[], int], host: str = "127.0.0.1") -> None:
        """``port``: where the service listens, known only once it does."""
        self._app = app
        self._port = port
        self._names = {*LOOPBACK_NAMES, host}

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        if scope["type"] not in ("http", "websocket"):
            await self._app(scope, receive, send)
            return
        headers = Headers(scope=scope)
        refusal = self._refusal(headers)
        if refusal is not None:
            await _refuse(refusal, scope, receive, send)
        elif scope["type"] == "websocket":
            await self._app(scope, receive, send)
        else:
            await self._http(scope, receive, send, headers)

    def _refusal(self, headers: Headers) -> Response | None:
        hosts, origins = headers.getlist("host"), headers.getlist("origin")
        allowed = self._addresses()
        if len(hosts) != 1 or hosts[0].lower() not in allowed:
            return problem(
                403,
                "This address is not ours: the Host must be the loopback address and our port.",
                code="foreign_host",
                remedy=f"Open http://127.0.0.1:{self._port()}/ instead.",
            )
        if any(origin.lower() not in {f"http://{a}" for a in allowed} for origin in origins):
            return problem(403, "Another page has asked; only our own may.", code="foreign_origin")
        return None

    def _addresses(self) -> set[str]:
        names = {f"[{name}]" if ":" in name else name for name in self._names}
        port = self._port()
        addresses = {f"{name}:{port}" for name in names}
        return addresses | names if port == 80 else addresses

    async def _http(self, scope: Scope, receive: Receive, send: Send, headers: Headers) -> None:
        started = False
        body_size = 0

        async def limited_receive() -> Message:
            nonlocal body_size
            message = await receive()
            body_size += len(message.get("body", b""))
            if body_size > MOST_BODY:
                raise HTTPException(413, _TOO_LARGE)
            return message

        async def send_with_headers(message: Message) -> None:
            nonlocal started
            if message["type"] == "http.response.start":
                started = True
                _add_headers(message, scope["path"], headers["host"])
            await send(message)

        length = headers.get("content-length", "0")
        if not length.isdecimal() or int(length) > MOST_BODY:
            response = problem(413, _TOO_LARGE, code="too_large")
            await response(scope, receive, send_with_headers)
            return
        try:
            await self._app(scope, limited_receive, send_with_headers)
        except Exception as error:
            log.error("request failed", path=scope["path"], error=str(error), exc_info=error)
            if started:
                raise
            response = problem(
                500,
                "The service made a mistake; its log says which.",
                code="internal",
                remedy="Report it with the lines of the log around this moment.",
            )
            await response(scope, receive, send_with_headers)


_TOO_LARGE = f"The body is larger than {MOST_BODY // (1024 * 1024)} MB."


async def _refuse(response: Response, scope: Scope, receive: Receive, send: Send) -> None:
    if scope["type"] == "http":
        await response(scope, receive, send)
        return
    # The WebSocket denial response: the handshake is answered with the problem document.
    start: MutableMapping[str, Any] = {
        "type": "websocket.http.response.start",
        "status": response.status_code,
        "headers": response.raw_headers,
    }
    deny: Callable[[MutableMapping[str, Any]], Awaitable[None]] = send
    await deny(start)
    await deny({"type": "websocket.http.response.body", "body": bytes(response.body)})


def _add_headers(message: Message, path: str, host: str) -> None:
    headers = MutableHeaders(scope=message)
    panel = path.startswith("/viser")
    policy = _PANEL_POLICY if panel else _PAGE_POLICY
    headers["Content-Security-Policy"] = policy.format(host=host)
    headers["X-Content-Type-Options"] = "nosniff"
    headers["X-Frame-Options"] = "SAMEORIGIN"
    headers["Referrer-Policy"] = "same-origin"
    headers["Cross-Origin-Resource-Policy"] = "same-origin"
    headers["Cross-Origin-Opener-Policy"] = "same-origin"
    headers["Permissions-Policy"] = "camera=(), microphone=(), geolocation=()"
    if path.startswith("/api/"):
        headers.setdefault("Cache-Control", "no-store")
