"""Progress bars on standard error, for work that takes longer than a moment."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager

from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn

from polepilot.core.robot.snapshot import Snapshot

_EVERY = 25
"""Ticks between two updates: drawing must not slow the simulation."""


@contextmanager
def mission_progress() -> Iterator[Callable[[Snapshot], None]]:
    """A bar of the mission's progress with its state; feed it every snapshot."""
    columns = (TextColumn("{task.description:10}"), BarColumn(), TextColumn("{task.fields[note]}"))
    with Progress(
        *columns, TimeElapsedColumn(), console=Console(stderr=True), transient=True
    ) as bars:
        task = bars.add_task("fixing", total=1.0, note="")

        def show(snapshot: Snapshot) -> None:
            if snapshot.seq % _EVERY:
                return
            mission = snapshot.mission
            note = f"{snapshot.stamp:6.0f} s"
            if mission is not None and mission.coverage is not None:
                note += f"  covered {100 * mission.coverage:.0f} %"
            bars.update(
                task,
                description=snapshot.state.value,
                completed=0.0 if mission is None else mission.progress,
                note=note,
            )

        yield show
