"""Sites, plans and runs brought together with the robot: what may start when, and what is kept."""

from __future__ import annotations

import asyncio
import math
import sqlite3
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import TYPE_CHECKING, Any

import structlog
from starlette.concurrency import run_in_threadpool

from polepilot.core.errors import PlanError, PolepilotError, RefusedError, SiteError
from polepilot.core.geometry import wrap_angle
from polepilot.core.robot.log import finish_log
from polepilot.core.robot.recorder import Recorder
from polepilot.core.sim.world import start_of
from polepilot.core.site import Site, parse_site
from polepilot.server.convert import Job, coordinates_of, plan_of
from polepilot.server.planner import Planner
from polepilot.server.runner import RobotPort, Runner, Twin
from polepilot.server.runs import missed_area, travelled
from polepilot.server.schemas import PlanRequest
from polepilot.server.store import Once, PlanRow, RunRow, SiteRow, Store

if TYPE_CHECKING:
    from polepilot.core.plan import Plan
    from polepilot.core.robot.mission import RunSummary

LEAST_LANDMARKS = 2
_MOST_TURNED = math.radians(45)
"""So far may the robot look aside from the way that a plan begins with."""
_SITE_SETTING = "site"

log = structlog.get_logger("polepilot.missions")


class Missions:
    """What people ask for, checked against what is stored and what the robot is doing."""

    def __init__(
        self,
        store: Store,
        runner: Runner,
        planner: Planner,
        twin: Twin | None,
        log_path: Callable[[int], Path],
    ) -> None:
        self._store = store
        self._runner = runner
        self._planner = planner
        self._twin = twin
        self._log_path = log_path
        self._turn = asyncio.Lock()
        # Disks are slow and the robot's thread must not wait for them.
        self._clerk = ThreadPoolExecutor(1, thread_name_prefix="clerk")
        self._loaded: SiteRow | None = None
        self._outdated = False

    @property
    def site_id(self) -> int | None:
        """The site that the robot works on."""
        return None if self._loaded is None else self._loaded.id

    @property
    def site(self) -> Site | None:
        """The version of it that the robot has."""
        return None if self._loaded is None else _parse(self._loaded)

    def begin(self, demo: dict[str, Any]) -> None:
        """Before the runner starts: mend what a power cut has left, load the last site.

        The very first start keeps ``demo`` as a site.
        """
        if self._store.setting(_SITE_SETTING) is None and not self._store.sites():
            first = self._store.add_site(demo)
            self._store.set_setting(_SITE_SETTING, str(first.id))
        for run in self._store.open_runs():
            self._end(run.id, "interrupted", "The service ended while it was running.")
            self._clerk.submit(self._mend, run)

    async def load_last_site(self) -> None:
        """Give the robot the site that it had when the service ended."""
        site_id = await run_in_threadpool(_last_site_id, self._store)
        if site_id is not None:
            await self.load_site(site_id)

    def close(self) -> None:
        """Finish what is still to be written; after the runner has ended."""
        self._clerk.shutdown(wait=True)

    # sites

    async def load_site(self, site_id: int) -> None:
        """Have the robot work on the newest version of a site; it fixes its pose anew.

        Raises:
            NotFoundError: there is no such site.
            RefusedError: a mission is going on.
        """
        async with self._turn:
            row = await run_in_threadpool(self._store.site, site_id)
            await self._load(row)
            await run_in_threadpool(self._store.set_setting, _SITE_SETTING, str(site_id))

    async def site_changed(self, row: SiteRow) -> None:
        """A new version was kept: the robot takes it over, at once or after its mission."""
        async with self._turn:
            if self._loaded is None or self._loaded.id != row.id:
                return
            if self._runner.job is not None:
                self._outdated = True
            elif _same_surroundings(self._loaded, row):
                self._loaded = row
            else:
                await self._load(row)

    def refuse_if_in_use(self, site_id: int) -> None:
        """Raises RefusedError while the robot works on this site."""
        if self.site_id == site_id:
            raise RefusedError(
                "The robot works on this site.",
                code="site_in_use",
                remedy="Load another site first.",
            )

    async def _load(self, row: SiteRow) -> None:
        site = await run_in_threadpool(_parse, row)

        def load(robot: RobotPort) -> None:
            if self._runner.job is not None:
                raise _mission_active()
            if self._twin is not None:
                self._twin.set_site(site, another=self._runner.site_id != row.id)
            robot.load_site(site)
            self._runner.site_id = row.id

        await self._runner.call(load)
        self._loaded = row
        self._outdated = False

    # plans

    async def plan(self, wanted: PlanRequest) -> PlanRow:
        """Compute and keep a plan. Where no start is given it begins where the robot stands.

        Raises:
            NotFoundError: no such site or run.
            PlanError: the job cannot be planned on this site.
            RefusedError: the run whose rest is wanted still goes on.
        """
        row = await run_in_threadpool(self._store.site, wanted.site_id)
        area = None
        if wanted.pending_of is not None:
            area = await self._pending(wanted, wanted.pending_of)
        if wanted.mode == "route" and wanted.route is None:
            raise PlanError(
                "route: is missing: expected the name of a route.", code="route_required"
            )
        options: dict[str, Any] = {
            key: value
            for key in ("tool_width", "clearance", "min_turn_radius", "order")
            if (value := getattr(wanted, key)) is not None
        }
        start = wanted.start or self._present_pose(row.id)
        if start is None and self._twin is not None:
            # There the simulated robot will be put when it is given this site.
            at = await run_in_threadpool(lambda: start_of(_parse(row)))
            start = (at.x, at.y, at.heading)
        if start is not None:
            options["start"] = list(start)
        document = await self._planner.plan(
            {
                "site": row.document,
                "mode": wanted.mode,
                "route": wanted.route,
                "end_heading": wanted.end_heading,
                "options": options,
                "area": area,
            }
        )
        route = wanted.route if wanted.mode == "route" else None
        return await run_in_threadpool(
            self._store.add_plan, row, wanted.mode, route, wanted.pending_of, document
        )

    def _present_pose(self, site_id: int) -> tuple[float, float, float] | None:
        published = self._runner.latest
        if published is None or self._runner.site_id != site_id:
            return None
        estimate = published.snapshot.estimate
        return None if estimate is None else (*estimate.pose.position, estimate.pose.heading)

    async def _pending(self, wanted: PlanRequest, run_id: int) -> list[Any]:
        run = await run_in_threadpool(self._store.run, run_id)
        if run.outcome is None:
            raise RefusedError(
                f"Run {run_id} still goes on.", code="run_active", remedy="End it first."
            )
        if run.mode != "scan" or wanted.mode != "scan" or run.site_id != wanted.site_id:
            raise PlanError(
                f"pending_of: run {run_id} is a {run.mode} of site {run.site_id}:"
                f" expected a scan of site {wanted.site_id}, for a plan of mode scan."
            )
        missed = run.missed
        if missed is None:
            missed = await run_in_threadpool(self._missed, run)
        if not missed:
            raise PlanError(f"Run {run_id} left nothing uncovered.", code="nothing_pending")
        return missed

    def _missed(self, run: RunRow) -> list[Any]:
        plan = plan_of(self._store.plan(run.plan_id))
        return coordinates_of(missed_area(self._log_path(run.id), plan))

    # runs

    async def start(self, plan_id: int, once: Once | None = None) -> RunRow:
        """Start to drive a plan; asked again with the same key it answers with the same run.

        Raises:
            NotFoundError: there is no such plan.
            RefusedError: not now; the code says why.
        """
        async with self._turn:
            plan = await run_in_threadpool(self._store.plan, plan_id)
            row, new = await run_in_threadpool(self._store.add_run, plan_id, once)
            if new:
                try:
                    await self._start(plan, row)
                except BaseException:
                    await run_in_threadpool(self._forget, row.id)
                    raise
        return row

    async def _start(self, plan: PlanRow, row: RunRow) -> None:
        if self._runner.job is not None:
            raise _mission_active()
        site_row = await run_in_threadpool(
            self._store.site_as_planned, plan.site_id, plan.site_version
        )
        landmarks = len(site_row.document.get("landmarks", ()))
        if landmarks < LEAST_LANDMARKS:
            raise RefusedError(
                f"The site has {landmarks} of the two landmarks that the robot needs at least.",
                code="no_landmarks",
                remedy="Place at least two landmarks.",
            )
        if self._loaded is None or self._loaded.id != plan.site_id:
            raise RefusedError(
                "The plan is for another site than the robot works on.",
                code="site_not_loaded",
                remedy="Load the plan's site first.",
            )
        if self._loaded.version != plan.site_version:
            raise RefusedError(
                "The site has changed since it was planned.",
                code="site_changed",
                remedy="Plan again.",
            )
        driven = await run_in_threadpool(plan_of, plan)
        self._refuse_if_turned(driven, plan.site_id)
        recorder = self._recorder(row.id)
        job = Job(run_id=row.id, plan_id=plan.id, site_id=plan.site_id, route=plan.route)

        def start(robot: RobotPort) -> None:
            self._runner.job = job
            try:
                robot.start(driven, row.id, recorder)
            except BaseException:
                self._runner.job = None
                raise

        try:
            await self._runner.call(start)
        except BaseException:
            await run_in_threadpool(recorder.close)
            raise

    def _refuse_if_turned(self, plan: Plan, site_id: int) -> None:
        """A plan that begins the other way round would be left within its first metre."""
        pose = self._present_pose(site_id)
        if pose is None:
            return
        (ax, ay), (bx, by) = plan.path[0], plan.path[1]
        begins = math.atan2(by - ay, bx - ax) + (math.pi if plan.gear[0] < 0 else 0.0)
        turned = abs(wrap_angle(begins - pose[2]))
        if turned > _MOST_TURNED:
            raise RefusedError(
                f"The plan begins {math.degrees(turned):.0f}° turned from where the robot looks.",
                remedy="Plan again from here.",
                code="elsewhere",
            )

    def _recorder(self, run_id: int) -> Recorder:
        twin, published = self._twin, self._runner.latest
        assert published is not None
        wall, stamp = published.around.wall, published.snapshot.stamp
        return Recorder(
            self._log_path(run_id),
            wall_start=wall,
            stamp_start=stamp,
            witness=None if twin is None else lambda: twin.truth,
        )

    def run_ended(self, summary: RunSummary) -> None:
        """The robot's callback, in its own thread: must return at once."""
        self._runner.job = None
        self._clerk.submit(self._keep_end, summary)

    def _keep_end(self, summary: RunSummary) -> None:
        try:
            self._end(
                summary.run_id,
                summary.outcome,
                summary.reason,
                coverage=summary.coverage,
                travelled=summary.travelled,
                duration=summary.duration,
                missed=coordinates_of(summary.missed),
            )
            if self._outdated and self._loaded is not None:
                row = self._store.site(self._loaded.id)
                self._take_over(row)
        except (PolepilotError, OSError, sqlite3.Error) as error:
            # The next start of the service works it out from the log.
            log.error("a run's end was not kept", run=summary.run_id, error=str(error))

    def _take_over(self, row: SiteRow) -> None:
        site = _parse(row)

        def load(robot: RobotPort) -> None:
            if self._runner.job is not None:
                return
            if self._twin is not None:
                self._twin.set_site(site, another=False)
            robot.load_site(site)
            self._loaded, self._outdated = row, False

        self._runner.submit(load)

    def _end(
        self,
        run_id: int,
        outcome: str,
        reason: str,
        *,
        coverage: float | None = None,
        travelled: float = 0.0,
        duration: float = 0.0,
        missed: list[Any] | None = None,
    ) -> None:
        self._store.end_run(
            run_id,
            outcome=outcome,
            reason=reason,
            coverage=coverage,
            travelled=travelled,
            duration=duration,
            missed=missed,
        )

    def _mend(self, run: RunRow) -> None:
        """Finish the log of an interrupted run and work out from it what was swept."""
        try:
            path = self._log_path(run.id)
            if not path.is_file() or not finish_log(path):
                return
            plan = plan_of(self._store.plan(run.plan_id))
            missed = missed_area(path, plan)
            length, seconds = travelled(path)
            whole = plan.area.area
            self._end(
                run.id,
                "interrupted",
                "The service ended while it was running.",
                coverage=1 - missed.area / whole if whole > 0 else None,
                travelled=length,
                duration=seconds,
                missed=coordinates_of(missed),
            )
        except Exception as error:  # noqa: BLE001 - one bad log must not stop the service
            log.error("an interrupted run was not mended", run=run.id, error=str(error))

    def _forget(self, run_id: int) -> None:
        path = self._log_path(run_id)
        path.unlink(missing_ok=True)
        if path.parent.is_dir() and not any(path.parent.iterdir()):
            path.parent.rmdir()
        self._store.drop_run(run_id)


def last_site(store: Store) -> Site | None:
    """The site that the robot had when the service ended; None where there is none to use."""
    site_id = _last_site_id(store)
    try:
        return None if site_id is None else _parse(store.site(site_id))
    except SiteError:
        return None


def _last_site_id(store: Store) -> int | None:
    remembered = store.setting(_SITE_SETTING)
    known = [line.id for line in store.sites()]
    if remembered is not None and int(remembered) in known:
        return int(remembered)
    return known[0] if known else None


def _parse(row: SiteRow) -> Site:
    return parse_site(row.document, f"site {row.id}")


def _same_surroundings(a: SiteRow, b: SiteRow) -> bool:
    """Whether nothing has changed that the robot localizes by or must not touch."""
    keys = ("boundary", "islands", "walls", "no_go", "landmarks")
    return all((a.document.get(key) or []) == (b.document.get(key) or []) for key in keys)


def _mission_active() -> RefusedError:
    return RefusedError(
        "A mission is going on.",
        code="mission_active",
        remedy="End it first.",
    )
