"""A process of its own for work that must not slow the robot down.

The process reads one JSON document per line from standard input and answers with one line on
standard output; it ends when its standard input does, so it cannot outlive the service.
"""

from __future__ import annotations

import asyncio
import contextlib
import json
import os
import sys
from collections.abc import Callable
from typing import Any

from polepilot.core.errors import InputError, PlanError, PolepilotError, SiteError
from polepilot.server.errors import BusyError

_LIMIT = 64 * 1024 * 1024
_NICENESS = 10


class Worker:
    """Hands jobs to the process, one at a time; a process that dies is replaced at the next one."""

    def __init__(self, module: str, what: str, code: str) -> None:
        """``module`` is run with ``python -m``; ``what`` is what messages call its work, and
        ``code`` is how the codes of its failures begin."""
        self._module = module
        self._what = what
        self._code = code
        self._process: asyncio.subprocess.Process | None = None
        self._turn = asyncio.Lock()
        self._closed = False

    async def warm_up(self) -> None:
        """Start the process before somebody waits for it."""
        async with self._turn:
            await self._running()

    async def ask(self, job: dict[str, Any], timeout: float, remedy: str) -> Any:
        """The answer to one job.

        Args:
            timeout: seconds after which it is given up.
            remedy: what to do then.

        Raises:
            InputError: what the work itself refuses, as it was raised there.
            BusyError: it took too long, or the process was killed.
        """
        async with self._turn:
            process = await self._running()
            try:
                answer = await asyncio.wait_for(self._exchange(process, job), timeout)
            except (TimeoutError, asyncio.CancelledError) as error:
                # Nobody waits for the answer any more; it must not be taken for the next one's.
                await self._kill()
                if isinstance(error, asyncio.CancelledError):
                    raise
                raise BusyError(
                    f"The {self._what} was not ready after {timeout:.0f} s.",
                    code=f"{self._code}_timeout",
                    remedy=remedy,
                ) from None
            if answer is None:
                await self._kill()
                if self._closed:
                    raise _shutting_down()
                raise BusyError(
                    f"The process that makes the {self._what} ended.", code=f"{self._code}_failed"
                )
        if "error" in answer:
            raise _error(answer["error"])
        return answer["answer"]

    async def close(self) -> None:
        """End the process, whatever it is doing."""
        self._closed = True
        await self._kill()

    async def _running(self) -> asyncio.subprocess.Process:
        if self._closed:
            raise _shutting_down()
        if self._process is None or self._process.returncode is not None:
            self._process = await asyncio.create_subprocess_exec(
                sys.executable,
                "-m",
                self._module,
                stdin=asyncio.subprocess.PIPE,
                stdout=asyncio.subprocess.PIPE,
                limit=_LIMIT,
                # A Ctrl-C is for the service; this process ends with its standard input.
                start_new_session=True,
            )
        return self._process

    async def _exchange(
        self, process: asyncio.subprocess.Process, job: dict[str, Any]
    ) -> dict[str, Any] | None:
        assert process.stdin is not None
        assert process.stdout is not None
        try:
            process.stdin.write(json.dumps(job).encode() + b"\n")
            await process.stdin.drain()
            line = await process.stdout.readline()
        except (ConnectionError, ValueError):
            return None
        return json.loads(line) if line.endswith(b"\n") else None

    async def _kill(self) -> None:
        process, self._process = self._process, None
        if process is None:
            return
        with contextlib.suppress(ProcessLookupError):
            process.kill()
        await process.wait()
        if process.stdin is not None:
            process.stdin.close()


def serve(compute: Callable[[dict[str, Any]], Any], imports: tuple[str, ...]) -> None:
    """In the process: answer until standard input ends.

    An error that is not bad input ends the process. ``imports`` are modules that ``compute`` will
    need: they are loaded before the first job comes.
    """
    with contextlib.suppress(OSError):
        os.nice(_NICENESS)
    # Whatever a library prints must not get between the answers.
    output = os.fdopen(os.dup(sys.stdout.fileno()), "wb")
    os.dup2(sys.stderr.fileno(), sys.stdout.fileno())
    for module in imports:
        __import__(module)
    for line in sys.stdin.buffer:
        output.write(_answer(compute, line))
        output.flush()


def _answer(compute: Callable[[dict[str, Any]], Any], line: bytes) -> bytes:
    """The answer to one line; bad input becomes an answer as well."""
    try:
        document: dict[str, Any] = {"answer": compute(json.loads(line))}
    except InputError as error:
        document = {
            "error": {
                "kind": type(error).__name__,
                "message": error.message,
                "remedy": error.remedy,
                "code": error.code,
                "where": error.where if isinstance(error, SiteError) else None,
            }
        }
    return json.dumps(document).encode() + b"\n"


def _shutting_down() -> BusyError:
    return BusyError(
        "The service is shutting down.", code="shutting_down", remedy="Start it again."
    )


def _error(document: dict[str, Any]) -> PolepilotError:
    text = {key: document[key] for key in ("remedy", "code")}
    if document["kind"] == "SiteError":
        where = document["where"]
        return SiteError(document["message"], where=None if where is None else tuple(where), **text)
    kind = PlanError if document["kind"] == "PlanError" else InputError
    return kind(document["message"], **text)
