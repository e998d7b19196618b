"""`polepilot precision`: how well the robot will know where it is, before a pole is put up."""

from __future__ import annotations

import math
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

if TYPE_CHECKING:
    from polepilot.core.localization.precision_grid import PrecisionMap
    from polepilot.core.localization.precision_suggest import Suggestions


def precision(
    site_file: Annotated[Path, typer.Argument(metavar="SITE.json", help="Site, or GeoJSON.")],
    resolution: Annotated[float | None, typer.Option(help="From spot to spot, m.")] = None,
    fine: Annotated[bool, typer.Option("--fine", help="Some 20,000 spots, not 1,200.")] = False,
    suggest: Annotated[int | None, typer.Option(help="So many more landmarks: where?")] = None,
    plot: Annotated[Path | None, typer.Option(help="Draw the map: OUT.svg or OUT.png.")] = None,
    config: Annotated[Path | None, typer.Option(help="robot.toml: camera and pan unit.")] = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print one JSON document.")] = False,
) -> None:
    """Expected error of the pose at every spot, and where more landmarks would help most."""
    import json

    from polepilot.commands.files import write_whole
    from polepilot.commands.precision_plot import draw, png_bytes
    from polepilot.core.errors import InputError, SiteError
    from polepilot.core.localization.precision import fine_resolution, precision_map
    from polepilot.core.localization.precision_sight import Sweep
    from polepilot.core.localization.precision_suggest import suggest as suggest_places
    from polepilot.core.printing.svg import svg_text
    from polepilot.core.site import read_site
    from polepilot.server.settings import load_settings

    if plot is not None and plot.suffix.lower() not in (".svg", ".png"):
        raise InputError(f"--plot {plot}: expected a name that ends in .svg or .png.")
    if fine and resolution is not None:
        raise InputError("--fine and --resolution are both given: expected one of them.")
    site = read_site(site_file)
    settings = load_settings(config)
    sweep = Sweep(settings.model.camera, settings.model.pan)
    if fine:
        resolution = fine_resolution(site)
    try:
        found = precision_map(site, sweep, resolution)
        more = suggest_places(site, suggest, sweep) if suggest is not None else None
    except SiteError:
        raise
    except InputError as error:
        option = error.message.partition(" ")[0] in ("resolution", "suggest")
        place = "--" if option else f"{site_file}: "
        raise InputError(place + error.message, remedy=error.remedy, code=error.code) from error
    if plot is not None:
        sheet = draw(site, found, more)
        drawing = svg_text(sheet).encode() if plot.suffix.lower() == ".svg" else png_bytes(sheet)
        write_whole({plot: drawing}, "--plot")
    if as_json:
        document: dict[str, Any] = found.to_json()
        if more is not None:
            document["suggest"] = more.to_json()
        typer.echo(json.dumps(document, allow_nan=False))
    else:
        typer.echo("\n".join([*_summary(found), *(_advice(more) if more else ())]))


def _centimetres(metres: float | None) -> str:
    return "-" if metres is None else f"{100 * metres:.1f} cm"


def _summary(found: PrecisionMap) -> list[str]:
    heading = found.mean_heading
    from polepilot.core.localization.precision_grid import Reason

    why_not = {
        Reason.NONE: "no landmark is seen, whichever way the robot looks",
        Reason.ONE_LANDMARK: "only one landmark is seen",
        Reason.ONE_DIRECTION: "the landmarks in sight stand too much in one direction",
    }
    lines = [
        f"spots     {int(found.floor.sum())}, {found.resolution:g} m apart",
        f"position  {_centimetres(found.mean_position)} on average,"
        f" {_centimetres(found.worst_position)} at worst (1 sigma)",
        f"heading   {'-' if heading is None else f'{math.degrees(heading):.2f}°'} on average",
        f"fix       possible in {100 * found.coverage:.1f} % of all poses",
    ]
    blind = [(found.area(reason), why) for reason, why in why_not.items()]
    lines += [f"no fix    on {area:.1f} m²: {why}" for area, why in blind if area >= 0.05]
    return lines


def _advice(more: Suggestions) -> list[str]:
    before = more.before
    lines = [
        f"more landmarks, of {more.places} places along the walls:",
        f"   so far{'':22}{_centimetres(before.overall):>8}  {100 * before.coverage:5.1f} %",
    ]
    for number, one in enumerate(more.chosen, start=1):
        place = f"({one.landmark.x:.2f}, {one.landmark.y:.2f})"
        lines.append(
            f"{number:2} no. {one.landmark.id:<3} at {place:<17}"
            f"{_centimetres(one.overall):>8}  {100 * one.coverage:5.1f} %"
        )
    share = 100.0 if more.gain_bound <= 0 else 100 * more.gain / more.gain_bound
    lines += [
        "   (mean error, what has no fix counted as"
        f" {_centimetres(before.limit)}; share of poses with a fix)",
        f"   Whichever {len(more.chosen)} of these places are chosen: at most {_times(share)} the"
        f" information, and no mean error below {_centimetres(more.overall_bound)}.",
    ]
    return lines


def _times(percent: float) -> str:
    return f"{100 / percent:.2f} times" if percent > 0 else "any multiple of"
