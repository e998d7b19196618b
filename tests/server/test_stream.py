"""The stream: latest wins, one that never reads harms nobody, and there is a limit."""

from __future__ import annotations

import asyncio
import contextlib
import json
import socket
import time
from collections.abc import Callable
from typing import Any

import pytest
from server.conftest import Running
from websockets.asyncio.client import connect
from websockets.exceptions import ConnectionClosed

from polepilot.server.schemas import Snapshot
from polepilot.server.stream import Hub


def test_messages_are_snapshots_in_order(serve: Callable[..., Running]) -> None:
    running = serve()

    async def listen() -> list[Snapshot]:
        async with connect(f"ws://{running.address}/api/v1/stream") as one:
            return [Snapshot.model_validate_json(await one.recv()) for _ in range(15)]

    began = time.monotonic()
    snapshots = asyncio.run(listen())
    assert time.monotonic() - began > 0.5, "more than 20 a second"
    numbers = [snapshot.seq for snapshot in snapshots]
    assert numbers == sorted(set(numbers))


def test_a_command_shows_on_the_stream(serve: Callable[..., Running]) -> None:
    running = serve()

    async def listen() -> None:
        async with connect(f"ws://{running.address}/api/v1/stream") as one:
            assert json.loads(await one.recv())["state"] == "ready"
            running.robot.stop("now")
            async with asyncio.timeout(2):
                while json.loads(await one.recv())["state"] != "stopped":
                    pass

    asyncio.run(listen())


def test_who_never_reads_is_dropped_and_slows_nobody(serve: Callable[..., Running]) -> None:
    running = serve()
    hub = running.services.hub
    hub._stuck_after = 0.5
    # Long messages, so that the buffers of the kernel are soon full.
    running.robot.reason = "x" * 200_000
    deaf = socket.socket()
    deaf.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
    deaf.connect(("127.0.0.1", running.services.port))
    deaf.sendall(
        b"GET /api/v1/stream HTTP/1.1\r\nHost: " + running.address.encode() + b"\r\n"
        b"Upgrade: websocket\r\nConnection: Upgrade\r\nSec-WebSocket-Version: 13\r\n"
        b"Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n\r\n"
    )

    async def listen() -> None:
        async with (
            connect(f"ws://{running.address}/api/v1/stream", max_size=None) as one,
            asyncio.timeout(15),
        ):
            last = time.monotonic()
            worst = 0.0
            while not hub.dropped:
                await one.recv()
                worst = max(worst, time.monotonic() - last)
                last = time.monotonic()
            assert worst < 0.4
            while hub.clients > 1:
                await one.recv()

    asyncio.run(listen())
    assert hub.dropped == 1
    # It is cut off for good, with all that was waiting for it.
    deaf.settimeout(5)
    with contextlib.suppress(ConnectionError):
        while deaf.recv(1 << 20):
            pass
    deaf.close()


def test_many_listeners_and_no_more(serve: Callable[..., Running]) -> None:
    running = serve()
    running.services.hub._most_clients = 5

    async def listen() -> None:
        sockets = [await connect(f"ws://{running.address}/api/v1/stream") for _ in range(5)]
        for one in sockets:
            await one.recv()
        refused = await connect(f"ws://{running.address}/api/v1/stream")
        with pytest.raises(ConnectionClosed) as closed:
            await refused.recv()
        assert closed.value.rcvd is not None
        assert closed.value.rcvd.code == 1013
        await sockets[0].close()
        async with asyncio.timeout(3):
            while running.services.hub.clients > 4:
                await asyncio.sleep(0.01)
        sockets[0] = await connect(f"ws://{running.address}/api/v1/stream")
        await sockets[0].recv()
        for one in sockets:
            await one.close()

    asyncio.run(listen())


def test_what_clients_say_is_ignored(serve: Callable[..., Running]) -> None:
    running = serve()

    async def listen() -> None:
        async with connect(f"ws://{running.address}/api/v1/stream") as one:
            for _ in range(50):
                await one.send("x" * 1000)
                await one.send(b"\xff" * 1000)
            first = json.loads(await one.recv())["seq"]
            async with asyncio.timeout(3):
                while json.loads(await one.recv())["seq"] < first + 10:
                    pass

    asyncio.run(listen())


def test_ends_quickly_with_open_sockets(serve: Callable[..., Running]) -> None:
    running = serve()

    async def listen() -> float:
        sockets = [await connect(f"ws://{running.address}/api/v1/stream") for _ in range(3)]
        for one in sockets:
            await one.recv()
        began = time.monotonic()
        assert await asyncio.to_thread(running.stop)
        took = time.monotonic() - began
        for one in sockets:
            with contextlib.suppress(ConnectionClosed):
                async with asyncio.timeout(2):
                    while True:
                        await one.recv()
        return took

    assert asyncio.run(listen()) < 2.5
    assert running.robot.calls[-1] == "shutdown"


def test_one_text_for_all() -> None:
    """A snapshot is turned into text once, whoever asks."""
    from server.fakes import FakeRobot

    from polepilot.server.convert import Surroundings
    from polepilot.server.runner import Published

    published = Published(FakeRobot().step(1.0), Surroundings(wall=0.0))
    hub: Any = Hub()
    assert hub.text_of(published) is hub.text_of(published)


def test_a_robot_that_gives_up_ends_the_service(serve: Callable[..., Running]) -> None:
    running = serve()
    running.robot.fail_with = ZeroDivisionError("oops")
    running._thread.join(5)
    assert not running._thread.is_alive()
    assert running.services.failed
    assert running.robot.calls[-1] == "shutdown"
