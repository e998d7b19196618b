"""`polepilot simulate`: a whole run on the simulated robot, as fast as the machine can."""

from __future__ import annotations

import json
import sys
from enum import StrEnum
from pathlib import Path
from typing import Annotated

import typer

from polepilot.commands.plan import JobMode, LoopOrder


class Sensing(StrEnum):
    rendered = "rendered"
    measured = "measured"


def simulate(
    site_file: Annotated[Path, typer.Argument(metavar="SITE.json", help="The drawn map.")],
    mode: Annotated[JobMode, typer.Option(help="Cover the area, or follow a route.")],
    out: Annotated[Path, typer.Option(help="Folder for trajectories and the log.")],
    route: Annotated[str | None, typer.Option(help="Name of the route, with --mode route.")] = None,
    seed: Annotated[int, typer.Option(min=0, help="Of all chance in the simulation.")] = 1,
    duration: Annotated[
        float | None, typer.Option(min=0.1, help="Stop after so many simulated seconds.")
    ] = None,
    sensing: Annotated[
        Sensing, typer.Option(help="Pictures through the detector, or its error model.")
    ] = Sensing.rendered,
    config: Annotated[Path | None, typer.Option(help="robot.toml of the simulated robot.")] = None,
    tool_width: Annotated[float | None, typer.Option(help="Metres.")] = None,
    clearance: Annotated[float | None, typer.Option(help="From the centre to a wall, m.")] = None,
    min_turn_radius: Annotated[float | None, typer.Option(help="Metres.")] = None,
    start: Annotated[str | None, typer.Option(metavar="X,Y[,HEADING]")] = None,
    order: Annotated[LoopOrder, typer.Option(help="Of the loops.")] = LoopOrder.DEFAULT,
    as_json: Annotated[bool, typer.Option("--json", help="One JSON document.")] = False,
) -> None:
    """Drive a plan with the simulated robot and say how well it went."""
    from polepilot.commands.plan import make_plan, naming_file, naming_options, parse_start
    from polepilot.commands.progress import mission_progress
    from polepilot.commands.simulation import Simulation
    from polepilot.core.errors import PolepilotError, RefusedError
    from polepilot.core.planning.options import PlanOptions
    from polepilot.core.site import read_site
    from polepilot.server.settings import load_settings

    settings = load_settings(config)
    site = read_site(site_file)
    if len(site.landmarks) < 2:
        raise RefusedError(
            f"{site_file}: landmarks: {len(site.landmarks)} found, and the robot needs at least "
            "2 to know where it is.",
            code="no_landmarks",
        )
    with naming_options():
        options = PlanOptions.from_vehicle(
            settings.model.vehicle,
            tool_width=tool_width,
            clearance=clearance,
            min_turn_radius=min_turn_radius,
            start=None if start is None else parse_start(start),
            order=order.value,
        )
    with naming_file(site_file):
        plan = make_plan(site, mode, route, options)
    _check_writable(out)
    simulation = Simulation.build(
        site,
        plan,
        settings.robot,
        seed=seed,
        rendered=sensing is Sensing.rendered,
        start=options.start or site.start,
        log=out / "run.mcap",
    )
    limit = 3 * plan.predicted.duration + 120 if duration is None else duration
    with mission_progress() as show:
        result = simulation.run(limit, show)
    simulation.tracks.write(out)
    if as_json:
        sys.stdout.write(json.dumps(result.to_json()) + "\n")
    else:
        sys.stdout.write(_table(result.to_json()))
    if simulation.log_error is not None:
        raise PolepilotError(f"{out / 'run.mcap'}: is incomplete ({simulation.log_error}).")


def _check_writable(out: Path) -> None:
    """A run takes minutes: where it cannot be kept is said before it."""
    from polepilot.commands.simulation import FILES
    from polepilot.core.errors import InputError

    try:
        out.mkdir(parents=True, exist_ok=True)
        for name in FILES:
            (out / name).open("ab").close()
    except OSError as error:
        raise InputError(
            f"--out {out}: cannot be written: {error.filename}: {error.strerror}."
        ) from error


def _table(result: dict[str, object]) -> str:
    from math import degrees

    lines = [f"{result['outcome']}: {result['reason']}"]
    for key, unit, factor in (
        ("position_error", "cm", 100.0),
        ("measured_error", "cm", 100.0),
        ("heading_error", "deg", degrees(1.0)),
    ):
        errors = result[key]
        assert isinstance(errors, dict)
        mean, p95, worst = (factor * errors[name] for name in ("mean", "p95", "max"))
        name = key.replace("_", " ")
        lines.append(f"{name:15} mean {mean:6.2f}  p95 {p95:6.2f}  max {worst:6.2f} {unit}")
    lines.append(f"{'coverage':15} {100 * float(str(result['coverage'])):.1f} %")
    lines.append(f"{'contacts':15} {result['contacts']}")
    lines.append(f"{'time':15} {result['simulated_s']} s simulated in {result['wall_s']} s")
    return "\n".join(lines) + "\n"
