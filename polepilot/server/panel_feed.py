"""Feeds the 3D panel from a thread of its own, so that it holds up neither robot nor server."""

from __future__ import annotations

import threading
from collections.abc import Callable
from typing import Protocol

import structlog

from polepilot.core.geometry import Pose2D
from polepilot.core.observation import Image
from polepilot.core.plan import Plan
from polepilot.core.robot.snapshot import Snapshot
from polepilot.core.site import Site
from polepilot.server.convert import Job
from polepilot.server.runner import Runner

PERIOD = 0.1
"""Seconds between two updates."""

log = structlog.get_logger("polepilot.panel")


class PanelPort(Protocol):
    """What is needed of the panel."""

    @property
    def port(self) -> int: ...
    def start(self) -> None: ...
    def stop(self) -> None: ...
    def set_site(self, site: Site) -> None: ...
    def set_plan(self, plan: Plan | None) -> None: ...
    def update(self, snapshot: Snapshot, truth: Pose2D | None, image: Image | None) -> None: ...


class PanelFeed:
    """Starts the panel and shows it every newest snapshot."""

    def __init__(
        self,
        panel: PanelPort,
        runner: Runner,
        site: Callable[[], Site | None],
        plan: Callable[[Job], Plan],
    ) -> None:
        """``site``: the one that the robot has; ``plan``: that of a mission."""
        self._panel = panel
        self._runner = runner
        self._site_of = site
        self._plan_of = plan
        self._site: Site | None = None
        self._job: Job | None = None
        self._stopping = threading.Event()
        self._thread = threading.Thread(target=self._run, name="panel", daemon=True)

    @property
    def port(self) -> int | None:
        """Where the panel listens; None while it does not."""
        return self._panel.port or None

    def start(self) -> None:
        self._panel.start()
        self._thread.start()

    def stop(self) -> None:
        self._stopping.set()
        if self._thread.is_alive():
            self._thread.join(1.0)
        self._panel.stop()

    def _run(self) -> None:
        while not self._stopping.wait(PERIOD):
            try:
                self._update()
            except Exception as error:
                log.warning("the panel was not updated", error=str(error), exc_info=error)
                self._stopping.wait(5.0)

    def _update(self) -> None:
        published = self._runner.latest
        if published is None:
            return
        site = self._site_of()
        if site is not None and site != self._site:
            self._panel.set_site(site)
            self._site = site
        job = published.around.job
        if job != self._job:
            # The plan of a mission that is over stays until the next one.
            if job is not None:
                self._panel.set_plan(self._plan_of(job))
            self._job = job
        sighting = self._runner.sighting
        image = None if sighting is None or sighting.frame is None else sighting.frame.image
        self._panel.update(published.snapshot, published.around.real, image)
