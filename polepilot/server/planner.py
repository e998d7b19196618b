"""Plans are computed in a process of their own, so that they never slow the robot down.

The process reads one JSON document per line from standard input and answers with one line on
standard output; it ends when its standard input does, so it cannot outlive the service.
"""

from __future__ import annotations

import asyncio
import contextlib
import json
import os
import sys
from dataclasses import asdict
from typing import Any

from polepilot.core.errors import InputError, PlanError, PolepilotError, SiteError
from polepilot.core.vehicle import Vehicle
from polepilot.server.errors import BusyError

TIMEOUT = 120.0
"""Seconds after which a plan is given up."""
_LIMIT = 64 * 1024 * 1024
_NICENESS = 10


class Planner:
    """Hands jobs to the planning process, one at a time."""

    def __init__(self, vehicle: Vehicle) -> None:
        self._vehicle = asdict(vehicle)
        self._process: asyncio.subprocess.Process | None = None
        self._turn = asyncio.Lock()
        self._closed = False

    async def warm_up(self) -> None:
        """Start the process before somebody waits for it."""
        async with self._turn:
            await self._running()

    async def plan(self, job: dict[str, Any]) -> dict[str, Any]:
        """Compute a plan.

        Args:
            job: ``site`` (SITE.json), ``mode``, ``route``, ``options`` (what PlanOptions is given
                besides the vehicle; ``start`` as a list), ``area`` (MultiPolygon coordinates, or
                None for everything that can be reached).

        Returns:
            what ``convert.plan_document`` makes of the plan.

        Raises:
            PlanError, SiteError, InputError: as planning does.
            BusyError: it took too long, or the process was killed.
        """
        async with self._turn:
            process = await self._running()
            try:
                answer = await asyncio.wait_for(self._ask(process, job), TIMEOUT)
            except (TimeoutError, asyncio.CancelledError) as error:
                # Nobody waits for the answer any more; it must not be taken for the next one's.
                await self._kill()
                if isinstance(error, asyncio.CancelledError):
                    raise
                raise BusyError(
                    f"The plan was not ready after {TIMEOUT:.0f} s.",
                    code="planning_timeout",
                    remedy="Use a larger tool width, or a simpler drawing.",
                ) from None
            if answer is None:
                await self._kill()
                if self._closed:
                    raise _shutting_down()
                raise BusyError("The planning process ended.", code="planning_failed")
        if "error" in answer:
            raise _error(answer["error"])
        plan: dict[str, Any] = answer["plan"]
        return plan

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
                "polepilot.server.planner",
                stdin=asyncio.subprocess.PIPE,
                stdout=asyncio.subprocess.PIPE,
                limit=_LIMIT,
                # A Ctrl-C is for the service; this process ends with its standard input.
                start_new_session=True,
            )
        return self._process

    async def _ask(
        self, process: asyncio.subprocess.Process, job: dict[str, Any]
    ) -> dict[str, Any] | None:
        assert process.stdin is not None
        assert process.stdout is not None
        try:
            process.stdin.write(json.dumps({**job, "vehicle": self._vehicle}).encode() + b"\n")
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


def compute(job: dict[str, Any]) -> dict[str, Any]:
    """Carry out one job, in the planning process."""
    from polepilot.core.planning.coverage import plan_scan
    from polepilot.core.planning.options import PlanOptions
    from polepilot.core.planning.route import plan_route
    from polepilot.core.site import Start, parse_site
    from polepilot.server.convert import multipolygon_of, plan_document

    site = parse_site(job["site"], "the site")
    options = dict(job["options"])
    if (start := options.get("start")) is not None:
        options["start"] = Start(*start)
    wanted = PlanOptions.from_vehicle(Vehicle(**job["vehicle"]), **options)
    if job["mode"] == "route":
        return plan_document(plan_route(site, job["route"], wanted))
    area = None if job["area"] is None else multipolygon_of(job["area"])
    return plan_document(plan_scan(site, wanted, area))


def answer(line: bytes) -> bytes:
    """The answer to one line; bad input becomes an answer as well."""
    try:
        document: dict[str, Any] = {"plan": compute(json.loads(line))}
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


def main() -> None:
    """Answer until standard input ends. An error that is not bad input ends the process."""
    with contextlib.suppress(OSError):
        os.nice(_NICENESS)
    # Whatever a library prints must not get between the answers.
    output = os.fdopen(os.dup(sys.stdout.fileno()), "wb")
    os.dup2(sys.stderr.fileno(), sys.stdout.fileno())
    for module in ("coverage", "route"):
        __import__(f"polepilot.core.planning.{module}")
    for line in sys.stdin.buffer:
        output.write(answer(line))
        output.flush()


if __name__ == "__main__":
    main()
