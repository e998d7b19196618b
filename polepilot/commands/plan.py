"""``polepilot plan``: what a job will do, before a wheel turns."""

from __future__ import annotations

import math
from collections.abc import Iterator
from contextlib import contextmanager
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

if TYPE_CHECKING:
    from polepilot.core.plan import Plan
    from polepilot.core.planning.options import PlanOptions
    from polepilot.core.site import Site, Start


class JobMode(StrEnum):
    """What to plan."""

    SCAN = "scan"
    ROUTE = "route"


class LoopOrder(StrEnum):
    """In which order loops are driven."""

    DEFAULT = "default"
    PAPER = "paper"


def plan(
    site_file: Annotated[Path, typer.Argument(metavar="SITE.json", help="Site, or GeoJSON.")],
    mode: Annotated[JobMode, typer.Option(help="Scan the area, or track a route.")] = JobMode.SCAN,
    route: Annotated[str | None, typer.Option(help="Name of the route to track.")] = None,
    tool_width: Annotated[float, typer.Option(help="Width that one pass sweeps, m.")] = 0.4,
    clearance: Annotated[float, typer.Option(help="Path to walls, at least, m.")] = 0.2,
    min_turn_radius: Annotated[float, typer.Option(help="Tightest turn, m; 0 for none.")] = 0.6,
    start: Annotated[str | None, typer.Option(help="X,Y or X,Y,HEADING; m and rad.")] = None,
    end_heading: Annotated[
        float | None, typer.Option(help="Heading at the last node of the route, rad.")
    ] = None,
    order: Annotated[LoopOrder, typer.Option(help="Order of the loops.")] = LoopOrder.DEFAULT,
    plot: Annotated[Path | None, typer.Option(help="Write a drawing here, SVG.")] = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print one JSON document.")] = False,
) -> None:
    """Plan a job on a site: its path, what it covers, what cannot be reached, how long it takes."""
    import json

    from polepilot.commands.files import write_whole
    from polepilot.core.planning.options import PlanOptions
    from polepilot.core.site import read_site

    site = read_site(site_file)
    with naming_options():
        options = PlanOptions(
            tool_width=tool_width,
            clearance=clearance,
            min_turn_radius=min_turn_radius,
            start=parse_start(start) if start is not None else None,
            order=order.value,
        )
    with naming_file(site_file):
        result = make_plan(site, mode, route, options, end_heading)
    if plot is not None:
        from polepilot.core.planning.plot import plot_svg

        write_whole({plot: plot_svg(site, result).encode("utf-8")}, "--plot")
    if as_json:
        typer.echo(json.dumps(result.to_json(), allow_nan=False))
    else:
        typer.echo(_summary(result))


def make_plan(
    site: Site,
    mode: JobMode,
    route: str | None,
    options: PlanOptions,
    end_heading: float | None = None,
) -> Plan:
    """The plan of a job.

    Raises:
        InputError: route mode without a route that exists, or scan mode with one.
        PlanError: the job cannot be planned.
    """
    from polepilot.core.errors import InputError
    from polepilot.core.planning.coverage import plan_scan
    from polepilot.core.planning.route import plan_route

    if mode is JobMode.ROUTE:
        if route is None:
            known = ", ".join(repr(entry.name) for entry in site.routes) or "none"
            raise InputError(f"--route is missing: the site's routes are {known}.")
        return plan_route(site, route, options, end_heading)
    if route is not None:
        raise InputError("--route is given with --mode scan: expected --mode route.")
    if end_heading is not None:
        raise InputError("--end-heading is given with --mode scan: expected --mode route.")
    return plan_scan(site, options)


@contextmanager
def naming_options() -> Iterator[None]:
    """Errors of ``PlanOptions`` speak of its fields: here they speak of options."""
    from polepilot.core.errors import InputError, PlanError

    try:
        yield
    except PlanError as error:
        name, _, rest = error.message.partition(" ")
        raise InputError(f"--{name.replace('_', '-')} {rest}") from error


@contextmanager
def naming_file(site_file: Path) -> Iterator[None]:
    """Errors of planning speak of the site: here they name its file."""
    from polepilot.core.errors import InputError, PlanError, SiteError

    try:
        yield
    except (PlanError, SiteError) as error:
        message = f"{site_file}: {error.message}"
        raise InputError(message, remedy=error.remedy, code=error.code) from error


def parse_start(text: str) -> Start:
    """A start typed as ``X,Y`` or ``X,Y,HEADING`` (metres, radians).

    Raises:
        InputError: anything else.
    """
    from polepilot.core.errors import InputError
    from polepilot.core.geometry import wrap_angle
    from polepilot.core.site import Start

    try:
        numbers = [float(part) for part in text.split(",")]
    except ValueError:
        numbers = []
    if len(numbers) not in (2, 3) or not all(math.isfinite(number) for number in numbers):
        raise InputError(f"--start is {text!r}: expected X,Y or X,Y,HEADING in metres and radians.")
    heading = wrap_angle(numbers[2]) if len(numbers) == 3 else None
    return Start(numbers[0], numbers[1], heading)


def _summary(result: Plan) -> str:
    """A few lines for a person."""
    predicted = result.predicted
    minutes, seconds = divmod(round(predicted.duration), 60)
    lines = [
        f"length     {predicted.length:.1f} m",
        f"duration   {minutes} min {seconds} s",
        f"reversals  {predicted.reversals}",
    ]
    if result.mode == "scan":
        lines.insert(0, f"coverage   {predicted.coverage * 100:.1f} % of {result.area.area:.1f} m²")
        lines.insert(1, f"overlap    {predicted.overlap * 100:.1f} %")
    for piece in result.unreachable:
        x, y = (sum(values) / len(piece.polygon) for values in zip(*piece.polygon, strict=True))
        lines.append(f"unreachable near ({x:.2f}, {y:.2f}): {piece.reason}")
    lines += list(result.notes)
    return "\n".join(lines)
