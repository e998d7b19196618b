"""`polepilot calibrate`: the camera constant, the lens, the pan potentiometer, motors and servo."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from polepilot.commands.outcome import Outcome, Target
from polepilot.core.errors import InputError

if TYPE_CHECKING:
    from polepilot.core.landmark import Landmark
    from polepilot.server.settings import Settings

app = typer.Typer(help="Calibrate camera, pan unit and drive; results go to robot.toml.")

Config = Annotated[
    Path | None, typer.Option(metavar="robot.toml", help="What is known of the robot so far.")
]
Write = Annotated[
    bool, typer.Option("--write", help="Change that file; the old one is kept beside it.")
]
AsJson = Annotated[bool, typer.Option("--json", help="One JSON document.")]


@app.callback()
def main() -> None:
    """Calibrate camera, pan unit and drive; results go to robot.toml."""


@app.command()
def camera(
    pictures: Annotated[
        list[str] | None, typer.Argument(help="Of a landmark, or with --board of the board.")
    ] = None,
    distance: Annotated[
        list[str] | None,
        typer.Option(
            metavar="METRES|FILE=METRES|LIST.csv",
            help="Level distance from the camera's axis to the landmark's axis: one for all "
            "pictures, one for each, or a list of picture,metres.",
        ),
    ] = None,
    landmark: Annotated[
        int | None, typer.Option("--id", help="Which landmark, where a picture shows several.")
    ] = None,
    ids: Annotated[
        str | None, typer.Option(help="Ids that exist, as 1-15 or 1,3,7-9; default: all.")
    ] = None,
    bits: Annotated[int, typer.Option(help="Bits per landmark: 4, 5, 6 or 8.")] = 4,
    segment: Annotated[float, typer.Option(help="Length of a segment, metres.")] = 0.05,
    diameter: Annotated[float, typer.Option(help="Thickness or width, metres.")] = 0.07,
    shape: Annotated[str, typer.Option(help="cylinder or flat.")] = "cylinder",
    board: Annotated[
        bool, typer.Option("--board", help="Lens distortion too, from a ChArUco board.")
    ] = False,
    squares: Annotated[str, typer.Option(help="Of the board, columns x rows.")] = "9x6",
    square: Annotated[float, typer.Option(help="Side of the board's squares, metres.")] = 0.030,
    marker: Annotated[float, typer.Option(help="Side of the board's markers, metres.")] = 0.022,
    dictionary: Annotated[str, typer.Option(help="Of the board's markers.")] = "4X4_50",
    board_out: Annotated[
        Path | None,
        typer.Option(metavar="FILE.pdf|svg|png", help="Make that board, to be printed."),
    ] = None,
    config: Config = None,
    write: Write = False,
    annotate: Annotated[
        Path | None, typer.Option(metavar="OUT.png", help="Draw what was found in the pictures.")
    ] = None,
    as_json: AsJson = False,
) -> None:
    """Camera constant from pictures of a landmark at known distances; lens from a board."""
    from polepilot.commands.calibrate_board import calibrate_lens, parse_board, write_board
    from polepilot.commands.calibrate_camera import (
        calibrate_constant,
        parse_distances,
        read_pictures,
    )
    from polepilot.commands.detect import kinds_of
    from polepilot.commands.drawings import place_for

    files = list(pictures or ())
    if board_out is not None:
        if files:
            raise InputError("--board-out makes a board to print: expected no pictures with it.")
        made = write_board(parse_board(squares, square, marker, dictionary), board_out)
        typer.echo(json.dumps(made.document) if as_json else made.words)
        return
    if not files:
        raise InputError("no picture is given: expected at least one.")
    if annotate is not None:
        place_for(annotate, files)  # before the work
    target = Target(config, write, as_json)
    settings = target.settings()
    if board:
        if distance:
            raise InputError("--distance is given with --board: expected one of the two.")
        sheet = parse_board(squares, square, marker, dictionary)
        outcome = calibrate_lens(read_pictures(files), sheet, settings, annotate)
    else:
        kinds = kinds_of(ids, bits, segment, diameter, shape)
        if landmark is not None and landmark not in kinds:
            raise InputError(f"--id is {landmark}: expected one of the ids that exist.")
        if not distance:
            raise InputError("--distance is missing: expected metres, as --distance 3.0.")
        distances = parse_distances(distance, files)
        outcome = calibrate_constant(
            read_pictures(files), distances, kinds, landmark, settings, annotate
        )
    target.finish(outcome)


@app.command()
def pan(
    at: Annotated[
        list[str] | None,
        typer.Option(
            metavar="COUNTS=DEGREES",
            help="What the converter says while the camera looks into a known direction, left "
            "positive; two or more. 0.78rad=45: what the program says, in radians.",
        ),
    ] = None,
    dataset: Annotated[
        Path | None, typer.Option(metavar="FOLDER", help="A recording of the standing robot.")
    ] = None,
    log: Annotated[
        Path | None, typer.Option(metavar="run.mcap", help="The log of a run in which it stood.")
    ] = None,
    site: Annotated[
        Path | None,
        typer.Option(metavar="SITE.json", help="Where the landmarks are, if not as recorded."),
    ] = None,
    heading: Annotated[
        str | None,
        typer.Option(metavar="DEGREES", help="Of the robot on the map, where it is known."),
    ] = None,
    config: Config = None,
    write: Write = False,
    as_json: AsJson = False,
) -> None:
    """Potentiometer counts to angles, from known directions or from a site's landmarks."""
    from rich.console import Console
    from rich.progress import Progress

    from polepilot.commands.calibrate_pan import (
        calibrate_directions,
        calibrate_survey,
        from_dataset,
        from_log,
        parse_degrees,
        unit_of,
    )
    from polepilot.core.robot.dataset import read_dataset
    from polepilot.core.site import read_site

    if sum(given is not None and given != [] for given in (at, dataset, log)) != 1:
        raise InputError("expected one of --at COUNTS=DEGREES (twice or more), --dataset, --log.")
    target = Target(config, write, as_json)
    unit = target.settings().model.pan
    if at:
        if site is not None or heading is not None:
            raise InputError("--site and --heading go with --dataset or --log.")
        target.finish(calibrate_directions(at, unit))
        return
    facing = None if heading is None else parse_degrees(heading, "--heading")
    given: dict[int, Landmark] = {}
    if site is not None:
        given = dict(read_site(site).landmarks_by_id())
    if dataset is not None:
        recording = read_dataset(dataset)
        unit = unit_of(recording, unit, config)
        landmarks = given or recording.landmarks
        screen = Console(stderr=True)
        with Progress(console=screen, transient=True, disable=not screen.is_terminal) as bars:
            task = bars.add_task("looking", total=None)
            found, (start, end) = from_dataset(
                recording, landmarks, lambda done: bars.update(task, completed=done)
            )
    else:
        assert log is not None
        found, recorded, (start, end) = from_log(log)
        landmarks = given or recorded
    about = f"standing from {start:.1f} to {end:.1f} s: {len(found)} sightings"
    target.finish(calibrate_survey(found, landmarks, unit, facing, about))


@app.command()
def drive(
    port: Annotated[
        str | None,
        typer.Argument(help="Of the board, as for doctor --link; only when a terminal guides."),
    ] = None,
    run: Annotated[
        list[str] | None,
        typer.Option(
            metavar="DUTY%,SERVO°,SECONDS=AHEAD,LEFT",
            help="A run that was driven and measured (metres), as 40,0,4=0.81,0.02: with these "
            "nothing is driven. Best are five: two straight on at one duty for different times, "
            "one at another duty, one to the left, one to the right.",
        ),
    ] = None,
    turns: Annotated[
        str | None,
        typer.Option(
            metavar="LEFT,RIGHT", help="Turns of both wheels in the same time under equal duty."
        ),
    ] = None,
    servo_range: Annotated[
        float | None,
        typer.Option(
            metavar="DEGREES", min=1, max=89, help="How far the servo turns to either side."
        ),
    ] = None,
    board: Annotated[
        str, typer.Option(help="serial, or for a try without hardware simulated or host.")
    ] = "serial",
    baud: Annotated[
        int | None,
        typer.Option(
            min=1200, max=4_000_000, help="Bits per second.", show_default="as configured"
        ),
    ] = None,
    space: Annotated[
        float, typer.Option(min=0.5, max=20, help="Free floor ahead and to both sides, metres.")
    ] = 2.0,
    config: Config = None,
    write: Write = False,
    as_json: AsJson = False,
) -> None:
    """Speeds, dead band, trim, and the servo's centre, scale and range.

    Guided on a terminal: what to do, step by step; nothing moves without a yes. Or with --run,
    from numbers that were measured before.
    """
    import math

    from polepilot.commands.calibrate_drive import calibrate_drive, parse_run, parse_turns

    target = Target(config, write, as_json)
    settings = target.settings()
    if run:
        if port is not None:
            raise InputError("--run is given with a port: expected one of the two.")
        outcome = calibrate_drive(
            [parse_run(text) for text in run],
            settings,
            trim=None if turns is None else parse_turns(turns),
            servo_limit=None if servo_range is None else math.radians(servo_range),
        )
    else:
        if turns is not None or servo_range is not None:
            raise InputError("--turns and --servo-range go with --run.")
        outcome = _guided(port, board, baud, space, settings)
    target.finish(outcome)


def _guided(
    port: str | None, board: str, baud: int | None, space: float, settings: Settings
) -> Outcome:
    """Lead whoever sits at this terminal.

    Raises:
        InputError: nobody does.
    """
    from polepilot.commands.calibrate_drive import calibrate_drive
    from polepilot.commands.calibrate_drive_guide import Guide
    from polepilot.commands.doctor import open_stage
    from polepilot.commands.person import Terminal
    from polepilot.core.link.workbench import Workbench

    if not Terminal.present():
        raise InputError(
            "There is no terminal to ask before each motion: expected one, or measured runs, as "
            "--run 40,0,4=0.81,0.02."
        )
    stage = open_stage(board, port, baud, settings)
    hall = stage.hall
    with Workbench(stage.port, stage.clock) as bench:
        found = Guide(
            bench,
            Terminal(),
            settings.model.vehicle,
            settings.calibration,
            space=space,
            lift=(lambda: None) if hall is None else hall.put_on_line,
            hint=None if hall is None else hall.measured,
        ).lead()
    return calibrate_drive(found.runs, settings, trim=found.trim, servo_limit=found.servo_limit)
