"""Only our own page on this machine: every foreign Host and Origin is refused, everywhere."""

from __future__ import annotations

import asyncio
from collections.abc import Callable

import httpx
import pytest
from server.conftest import Running
from server.fakes import SQUARE, TestClient
from websockets.asyncio.client import connect
from websockets.exceptions import InvalidStatus

from polepilot.core.errors import InputError
from polepilot.server.security import check_loopback

HTTP_ADDRESSES = ("/api/v1/about", "/", "/openapi.json", "/metrics", "/viser/", "/nothing")
SOCKET_ADDRESSES = ("/api/v1/stream", "/viser", "/viser/", "/nothing")
FOREIGN_HOSTS = (
    "evil.example",
    "evil.example:8000",
    "127.0.0.1:9",
    "localhost",
    "127.0.0.1.evil.example:8000",
    "127.0.0.1:8000@evil.example",
    "",
)
FOREIGN_ORIGINS = (
    "http://evil.example",
    "https://127.0.0.1:8000",
    "http://127.0.0.1:9",
    "http://localhost",
    "null",
    "http://localhost:8000.evil.example",
    "",
)


@pytest.mark.parametrize("path", HTTP_ADDRESSES)
def test_foreign_hosts(client: TestClient, path: str) -> None:
    for host in FOREIGN_HOSTS:
        answer = client.get(path, headers={"Host": host})
        assert answer.status_code == 403, host
        assert answer.json()["code"] == "foreign_host"


@pytest.mark.parametrize("path", HTTP_ADDRESSES)
def test_foreign_origins(client: TestClient, path: str) -> None:
    for origin in FOREIGN_ORIGINS:
        answer = client.get(path, headers={"Origin": origin})
        assert answer.status_code == 403, origin
        assert answer.json()["code"] == "foreign_origin"


def test_a_foreign_page_changes_nothing(client: TestClient) -> None:
    headers = {"Origin": "http://evil.example", "Content-Type": "text/plain"}
    assert client.post("/api/v1/sites", json=SQUARE, headers=headers).status_code == 403
    assert client.post("/api/v1/robot/stop", headers=headers).status_code == 403
    assert len(client.get("/api/v1/sites").json()) == 1
    assert client.get("/api/v1/robot").json()["state"] == "ready"


@pytest.mark.parametrize(
    "name", ["127.0.0.1:8000", "localhost:8000", "LOCALHOST:8000", "[::1]:8000"]
)
def test_our_own_names(client: TestClient, name: str) -> None:
    headers = {"Host": name, "Origin": f"http://{name}"}
    assert client.get("/api/v1/about", headers=headers).status_code == 200


def test_headers(client: TestClient) -> None:
    for path in ("/api/v1/about", "/nothing", "/viser/"):
        headers = client.get(path).headers
        assert "frame-ancestors 'self'" in headers["content-security-policy"]
        assert headers["x-content-type-options"] == "nosniff"
        assert headers["cross-origin-resource-policy"] == "same-origin"
    assert "script-src 'self';" in client.get("/").headers["content-security-policy"]
    assert client.get("/api/v1/about").headers["cache-control"] == "no-store"


@pytest.mark.parametrize("length", ["-1", "x", "99999999999999999999", "1e3"])
def test_lengths_that_are_none(client: TestClient, length: str) -> None:
    headers = {"Content-Length": length}
    assert client.post("/api/v1/robot/stop", headers=headers).status_code == 413


def test_websockets_are_checked_as_well(serve: Callable[..., Running]) -> None:
    running = serve()
    host = running.address

    async def try_all() -> None:
        for path in SOCKET_ADDRESSES:
            for origin in ("http://evil.example", "null", "http://127.0.0.1:9"):
                with pytest.raises(InvalidStatus) as refused:
                    await connect(f"ws://{host}{path}", origin=origin)  # type: ignore[arg-type]
                assert refused.value.response.status_code == 403
                assert b"foreign_origin" in refused.value.response.body
        own = f"http://{host}"
        async with connect(f"ws://{host}/api/v1/stream", origin=own) as socket:  # type: ignore[arg-type]
            assert b'"snapshot"' in (await socket.recv(decode=False))

    asyncio.run(try_all())
    upgrade = {
        "Host": "evil.example",
        "Connection": "Upgrade",
        "Upgrade": "websocket",
        "Sec-WebSocket-Version": "13",
        "Sec-WebSocket-Key": "dGhlIHNhbXBsZSBub25jZQ==",
    }
    refusal = httpx.get(f"{running.url}/api/v1/stream", headers=upgrade)
    assert (refusal.status_code, refusal.json()["code"]) == (403, "foreign_host")
    assert httpx.get(f"{running.url}/api/v1/about").status_code == 200
    assert httpx.get(f"{running.url}/api/v1/about", headers={"Host": "x"}).status_code == 403


@pytest.mark.parametrize("host", ["0.0.0.0", "::", "192.168.1.5", "polepilot.local", ""])
def test_addresses_that_others_could_reach(host: str) -> None:
    with pytest.raises(InputError, match=r"expected 127\.0\.0\.1"):
        check_loopback(host)


@pytest.mark.parametrize("host", ["127.0.0.1", "localhost", "::1", "127.0.0.2"])
def test_addresses_of_this_machine(host: str) -> None:
    check_loopback(host)
