"""The stream of snapshots: latest wins, per client.

A snapshot is turned into bytes once, whoever listens. Each client has a slot for one message: what
it had no time to take is replaced, so one that never reads costs no memory and delays nobody.
"""

from __future__ import annotations

import asyncio
import contextlib
import json
from typing import TYPE_CHECKING

from starlette.websockets import WebSocket, WebSocketDisconnect

from polepilot.server.convert import snapshot_document

if TYPE_CHECKING:
    from polepilot.server.runner import Published

MOST_CLIENTS = 64
STUCK_AFTER = 10.0
"""A client that takes nothing for this many seconds is dropped."""
TRY_LATER = 1013


def encode(published: Published) -> bytes:
    """The message about a snapshot."""
    document = snapshot_document(published.snapshot, published.around)
    return json.dumps(document, separators=(",", ":"), ensure_ascii=False).encode()


class _Slot:
    """One client's newest message."""

    def __init__(self) -> None:
        self._event = asyncio.Event()
        self._message: str | None = None

    def put(self, message: str) -> bool:
        """Returns whether a message was replaced that nobody had taken."""
        replaced = self._message is not None
        self._message = message
        self._event.set()
        return replaced

    async def take(self) -> str:
        await self._event.wait()
        self._event.clear()
        message, self._message = self._message, None
        assert message is not None
        return message


class Hub:
    """All who listen."""

    def __init__(self, *, most_clients: int = MOST_CLIENTS, stuck_after: float = STUCK_AFTER):
        self._most_clients = most_clients
        self._stuck_after = stuck_after
        self._slots: set[_Slot] = set()
        self._last: tuple[Published, str] | None = None
        self.sent = 0
        self.skipped = 0
        self.dropped = 0

    @property
    def clients(self) -> int:
        return len(self._slots)

    def publish(self, published: Published) -> None:
        """Hand a snapshot to everybody; from the event loop only, returns at once."""
        if not self._slots:
            return
        message = self.text_of(published)
        for slot in self._slots:
            self.skipped += slot.put(message)

    def text_of(self, published: Published) -> str:
        """The message about a snapshot, made once."""
        if self._last is None or self._last[0] is not published:
            self._last = (published, encode(published).decode())
        return self._last[1]

    async def serve(self, socket: WebSocket, first: Published | None) -> None:
        """Send snapshots to one client until it leaves or is stuck."""
        if len(self._slots) >= self._most_clients:
            await socket.accept()
            await socket.close(TRY_LATER, "too many listeners")
            return
        await socket.accept()
        slot = _Slot()
        if first is not None:
            slot.put(self.text_of(first))
        self._slots.add(slot)
        sender = asyncio.create_task(self._send(socket, slot))
        listener = asyncio.create_task(_until_gone(socket))
        try:
            await asyncio.wait({sender, listener}, return_when=asyncio.FIRST_COMPLETED)
        finally:
            self._slots.discard(slot)
            for task in (sender, listener):
                task.cancel()
                with contextlib.suppress(asyncio.CancelledError):
                    await task

    async def _send(self, socket: WebSocket, slot: _Slot) -> None:
        with contextlib.suppress(WebSocketDisconnect, RuntimeError):
            while True:
                message = await slot.take()
                try:
                    await asyncio.wait_for(socket.send_text(message), self._stuck_after)
                except TimeoutError:
                    self.dropped += 1
                    return
                self.sent += 1


async def _until_gone(socket: WebSocket) -> None:
    """Read and forget what a client says, until it is gone."""
    with contextlib.suppress(WebSocketDisconnect, RuntimeError):
        while (await socket.receive())["type"] != "websocket.disconnect":
            pass
