"""Waits for bytes of a serial device in a thread of its own and stamps them as they arrive."""

from __future__ import annotations

import errno
import os
import select
import threading
from collections import deque
from collections.abc import Callable

from polepilot.core.link.report import Chunk

_READ_SIZE = 4096
_MOST_CHUNKS = 1000
"""Kept for an owner who does not read; older ones are forgotten."""
_NOTHING = 0.005
"""Seconds to wait where a device is readable and gives nothing."""


class Listener:
    """Reads a descriptor until it fails or is told to stop.

    The owner's tick comes up to 20 ms after the bytes, in which the camera turns by a degree; what
    a board measured is timed by the arrival of its bytes, so somebody has to be there.
    """

    def __init__(
        self, descriptor: int, clock: Callable[[], float], alive: Callable[[], bool]
    ) -> None:
        """``alive`` tells whether reading nothing means that nothing came."""
        self.failure: OSError | None = None
        """Why it has ended by itself."""
        self._descriptor = descriptor
        self._clock = clock
        self._alive = alive
        self._chunks: deque[Chunk] = deque(maxlen=_MOST_CHUNKS)
        self._wake_out, self._wake_in = os.pipe()
        self._thread = threading.Thread(target=self._run, name="serial", daemon=True)
        self._thread.start()

    def take(self) -> list[Chunk]:
        """What has come since the last call, oldest first."""
        chunks = []
        while self._chunks:
            chunks.append(self._chunks.popleft())
        return chunks

    def stop(self) -> None:
        """End; the descriptor may be closed afterwards."""
        os.write(self._wake_in, b".")
        self._thread.join()
        os.close(self._wake_in)
        os.close(self._wake_out)

    def _run(self) -> None:
        poll = select.poll()
        poll.register(self._descriptor, select.POLLIN)
        poll.register(self._wake_out, select.POLLIN)
        while True:
            ready = {descriptor for descriptor, _ in poll.poll()}
            if self._wake_out in ready:
                return
            stamp = self._clock()
            try:
                data = os.read(self._descriptor, _READ_SIZE)
            except BlockingIOError:
                continue
            except OSError as error:
                self.failure = error
                return
            if data:
                self._chunks.append(Chunk(stamp, data))
            elif not self._alive():
                self.failure = OSError(errno.ENODEV, os.strerror(errno.ENODEV))
                return
            else:
                select.select([self._wake_out], [], [], _NOTHING)
