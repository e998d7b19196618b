"""The 3D panel behind our port: pages, pictures and messages pass both ways."""

from __future__ import annotations

import asyncio
import contextlib
import threading
from collections.abc import Callable, Iterator
from http import HTTPStatus
from typing import Any

import httpx
import pytest
from server.conftest import Running
from websockets.asyncio.client import connect
from websockets.asyncio.server import ServerConnection
from websockets.asyncio.server import serve as serve_sockets
from websockets.exceptions import ConnectionClosed
from websockets.http11 import Request, Response

PROTOCOL = "viser-v1.1.1"


class FakePanel:
    """Answers what it was asked, as the panel's own server would."""

    def __init__(self) -> None:
        self.port = 0
        self.sites: list[Any] = []
        self.updates = 0
        self.requests: list[Request] = []
        self._loop = asyncio.new_event_loop()
        self._thread = threading.Thread(target=self._loop.run_forever)

    def start(self) -> None:
        self._thread.start()
        asyncio.run_coroutine_threadsafe(self._listen(), self._loop).result(5)

    def stop(self) -> None:
        if self.port:
            self.port = 0
            asyncio.run_coroutine_threadsafe(self._close(), self._loop).result(5)
            self._loop.call_soon_threadsafe(self._loop.stop)
            self._thread.join(5)
        self._loop.close()

    def set_site(self, site: Any) -> None:
        self.sites.append(site)

    def set_plan(self, plan: Any) -> None:
        pass

    def update(self, *_: Any) -> None:
        self.updates += 1

    async def _listen(self) -> None:
        self._server = await serve_sockets(
            self._echo,
            "127.0.0.1",
            0,
            subprotocols=[PROTOCOL],
            process_request=self._page,  # type: ignore[list-item]
        )
        self.port = self._server.sockets[0].getsockname()[1]

    async def _close(self) -> None:
        self._server.close()
        await self._server.wait_closed()

    def _page(self, connection: ServerConnection, request: Request) -> Response | None:
        self.requests.append(request)
        if "Upgrade" in request.headers:
            return None
        if request.path.startswith("/nothing"):
            return connection.respond(HTTPStatus.NOT_FOUND, "")
        answer = connection.respond(HTTPStatus.OK, f"page {request.path}")
        answer.headers["X-Panel"] = "yes"
        return answer

    async def _echo(self, connection: ServerConnection) -> None:
        with contextlib.suppress(ConnectionClosed):
            async for message in connection:
                if message == "leave":
                    return
                await connection.send(message)


@pytest.fixture
def panel() -> Iterator[FakePanel]:
    panel = FakePanel()
    yield panel
    panel.stop()


def started(serve: Callable[..., Running], panel: FakePanel) -> Running:
    running = serve(panel=panel)
    for _ in range(500):
        if running.services.panel_port is not None and panel.updates:
            return running
        threading.Event().wait(0.01)
    raise AssertionError("the panel was not started")


def test_pages(serve: Callable[..., Running], panel: FakePanel) -> None:
    running = started(serve, panel)
    answer = httpx.get(f"{running.url}/viser/assets/a.js?x=1&y=a%20b", headers={"Cookie": "secret"})
    assert answer.text == "page /assets/a.js?x=1&y=a%20b"
    assert answer.headers["x-panel"] == "yes"
    assert "wasm" in answer.headers["content-security-policy"] or "unsafe-eval" in str(
        answer.headers["content-security-policy"]
    )
    assert "Cookie" not in panel.requests[-1].headers
    missing = httpx.get(f"{running.url}/viser/nothing")
    assert missing.status_code == 404
    assert missing.json()["code"] == "not_found"
    assert panel.requests[-1].headers["Host"] == f"127.0.0.1:{panel.port}"
    assert httpx.get(f"{running.url}/viser").headers["location"] == "/viser/"
    assert panel.sites[0].name == "Demo workshop"


@pytest.mark.parametrize("path", ["/viser", "/viser/", "/viser/some/where"])
def test_messages(serve: Callable[..., Running], panel: FakePanel, path: str) -> None:
    running = started(serve, panel)

    async def talk() -> None:
        async with connect(
            f"ws://{running.address}{path}",
            subprotocols=[PROTOCOL],
            max_size=None,  # type: ignore[list-item]
        ) as socket:
            assert socket.subprotocol == PROTOCOL
            for message in ("Grüße", b"\x00\xff" * 100_000):
                await socket.send(message)
                assert await socket.recv() == message
            await socket.send("leave")
            with pytest.raises(ConnectionClosed):
                await socket.recv()

    asyncio.run(talk())


def test_ends_quickly_while_somebody_looks(serve: Callable[..., Running], panel: FakePanel) -> None:
    running = started(serve, panel)

    async def look() -> None:
        async with connect(f"ws://{running.address}/viser", subprotocols=[PROTOCOL]) as socket:  # type: ignore[list-item]
            await socket.send("x")
            await socket.recv()
            async with asyncio.timeout(2.5):
                assert await asyncio.to_thread(running.stop)
            with pytest.raises(ConnectionClosed):
                await socket.recv()

    asyncio.run(look())


def test_without_a_panel(serve: Callable[..., Running]) -> None:
    running = serve()
    answer = httpx.get(f"{running.url}/viser/")
    assert (answer.status_code, answer.json()["code"]) == (503, "no_panel")

    async def look() -> None:
        async with connect(f"ws://{running.address}/viser") as socket:
            with pytest.raises(ConnectionClosed):
                await socket.recv()

    asyncio.run(look())
