"""The web server around the application: uvicorn, with our manners at its end.

Differences from plain uvicorn: the wheels stop before anybody is waited for, a signal ends with
exit status 0, and a listener that takes nothing any more is cut off instead of being waited for.
"""

from __future__ import annotations

import contextlib
import signal
import socket
import threading
from collections.abc import Callable, Iterator
from types import FrameType
from typing import TYPE_CHECKING, Any

import uvicorn
from fastapi import FastAPI
from uvicorn.protocols.websockets.websockets_sansio_impl import WebSocketsSansIOProtocol

from polepilot.core.errors import InputError

if TYPE_CHECKING:
    from polepilot.server.services import Services

_GRACE = 1
"""Seconds that answers under way have when the service ends."""
_LAST_WORDS = 2.0
"""Seconds that a closed WebSocket has to take what was sent to it."""
_SIGNALS = (signal.SIGINT, signal.SIGTERM)


class _WebSocketProtocol(WebSocketsSansIOProtocol):
    """Cuts off a closed connection whose other side takes nothing, with all it has waiting."""

    async def run_asgi(self) -> None:
        await super().run_asgi()
        self.loop.call_later(_LAST_WORDS, self.transport.abort)

    async def send(self, message: Any) -> None:
        await super().send(message)
        if message["type"] == "websocket.http.response.body":
            # A refusal is a complete handshake too, and nothing to complain about in the log.
            self.handshake_complete = True


class Listener(uvicorn.Server):
    """Serves one application until a signal, or until the robot has given up."""

    def __init__(self, app: FastAPI, services: Services, ready: Callable[[], None]) -> None:
        """``ready`` is called as soon as the page can be opened."""
        super().__init__(
            uvicorn.Config(
                app,
                ws=_WebSocketProtocol,
                ws_max_size=1024 * 1024,
                ws_per_message_deflate=False,
                timeout_graceful_shutdown=_GRACE,
                access_log=False,
                log_config=None,
                log_level="warning",
                server_header=False,
                lifespan="on",
            )
        )
        self._services = services
        self._ready = ready
        services.on_failed = self._give_up

    async def startup(self, sockets: list[socket.socket] | None = None) -> None:
        await super().startup(sockets)
        if self.started:
            self._ready()

    async def shutdown(self, sockets: list[socket.socket] | None = None) -> None:
        await self._services.stop_robot()
        await self._services.stop_planning()
        await super().shutdown(sockets)

    @contextlib.contextmanager
    def capture_signals(self) -> Iterator[None]:
        if threading.current_thread() is not threading.main_thread():
            yield
            return
        original = {number: signal.signal(number, self.handle_exit) for number in _SIGNALS}
        try:
            yield
        finally:
            for number, handler in original.items():
                signal.signal(number, handler)

    def handle_exit(self, sig: int, frame: FrameType | None) -> None:  # noqa: ARG002
        # A second Ctrl-C changes nothing: stopping takes a second or two, and must be complete.
        self.should_exit = True

    def _give_up(self) -> None:
        self.should_exit = True


def bind(host: str, port: int) -> socket.socket:
    """A socket that listens on ``host`` and ``port`` (0: any free one).

    Raises:
        InputError: the port is in use, or is not for us.
    """
    family, kind, protocol, _, address = _resolve(host, port)
    bound = socket.socket(family, kind, protocol)
    try:
        bound.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        bound.bind(address)
        # Already here, so that a second service on this port is told so at its start.
        bound.listen(2048)
    except (OSError, OverflowError) as error:
        bound.close()
        why = getattr(error, "strerror", None) or str(error)
        raise InputError(
            f"port {port} on {host} cannot be used ({why}).",
            remedy="Stop the program that uses it, or give another one with --port.",
            code="port_in_use",
        ) from None
    return bound


def _resolve(host: str, port: int) -> Any:
    try:
        return socket.getaddrinfo(host, port, type=socket.SOCK_STREAM, flags=socket.AI_PASSIVE)[0]
    except (OSError, OverflowError) as error:
        raise InputError(f"--host {host}: cannot be resolved ({error}).") from None
