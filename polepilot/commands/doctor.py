"""`polepilot doctor`: is the robot's microcontroller wired and working as it should?"""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from polepilot.core.errors import InputError, LinkError

if TYPE_CHECKING:
    from polepilot.commands.doctor_link import LinkDoctor
    from polepilot.commands.person import Person
    from polepilot.commands.stage import Stage
    from polepilot.core.link.workbench import Workbench
    from polepilot.server.settings import Settings


def doctor(
    port: Annotated[
        str | None,
        typer.Argument(
            help="/dev/ttyUSB0 or another path, or VID:PID[:SERIAL]; default: link.port of "
            "robot.toml, /dev/polepilot, or the only device that is plugged in."
        ),
    ] = None,
    link: Annotated[
        bool,
        typer.Option("--link", help="Check the line to the board and all that is wired to it."),
    ] = False,
    board: Annotated[
        str, typer.Option(help="serial, or for a try without hardware simulated or host.")
    ] = "serial",
    baud: Annotated[
        int | None,
        typer.Option(
            min=1200, max=4_000_000, help="Bits per second.", show_default="as configured"
        ),
    ] = None,
    config: Annotated[
        Path | None, typer.Option(metavar="robot.toml", help="What is known of the robot so far.")
    ] = None,
    as_json: Annotated[
        bool, typer.Option("--json", help="One JSON document; nothing is asked or moved.")
    ] = False,
) -> None:
    """Check the board before wheels touch the ground.

    On a terminal inputs are tried by hand, and each output after a yes. Exit status 1 where
    something is not as it should be.
    """
    from polepilot.commands.doctor_link import LinkDoctor
    from polepilot.commands.person import Terminal
    from polepilot.server.settings import load_settings

    if not link:
        raise InputError("doctor: expected --link, perhaps with a port, as --link /dev/ttyUSB0.")
    settings = load_settings(config)
    stage = open_stage(board, port, baud, settings)
    person = Terminal() if Terminal.present() and not as_json else None
    stage, bench = _connected(stage, baud or settings.link.baud_rate)
    checks = LinkDoctor(bench, settings.model.pan, say=None if as_json else typer.echo)
    with bench:
        try:
            checks.look(stage.name)
            if person is not None:
                _by_hand(checks, person)
        except LinkError as error:
            checks.note("line", "bad", str(error))
    if as_json:
        typer.echo(json.dumps(checks.to_json()))
    else:
        typer.echo(checks.verdict)
    if checks.bad:
        raise typer.Exit(1)


def open_stage(board: str, port: str | None, baud: int | None, settings: Settings) -> Stage:
    """The serial port that options and robot.toml name, or the simulated robot.

    Raises:
        InputError: they contradict each other, or name nothing.
    """
    from polepilot.commands.stage import serial_stage, simulated_stage

    if board not in ("serial", "simulated", "host"):
        raise InputError(f"--board is {board!r}: expected serial, simulated or host.")
    if board == "serial":
        return serial_stage(port or settings.link.port or None, baud or settings.link.baud_rate)
    if port is not None:
        raise InputError(f"--board {board} has no port: expected it without {port}.")
    return simulated_stage(settings.with_board(board))


def _connected(stage: Stage, baud: int) -> tuple[Stage, Workbench]:
    """A session with the board; where it only babbles, other usual baud rates are tried.

    Raises:
        LinkError: none works; what the first one told.
    """
    from dataclasses import replace

    from polepilot.commands.stage import BAUD_RATES
    from polepilot.core.link.workbench import Workbench

    bench = Workbench(stage.port, stage.clock)
    try:
        stage.port.read()  # opens it
        typer.echo("The handshake switches the servo on: the front wheel may turn.", err=True)
        bench.connect()
        return replace(
            stage, name=f"{stage.name}, {baud} baud" if stage.again else stage.name
        ), bench
    except LinkError as error:
        stage.port.close()
        if stage.again is None or error.code not in ("link_silent", "link_foreign"):
            raise
        for other in BAUD_RATES:
            if other == baud:
                continue
            port = stage.again(other)
            bench = Workbench(port, stage.clock)
            try:
                bench.connect(3.0)
            except LinkError:
                port.close()
                continue
            name = f"{stage.name}, {other} baud: set link.baud_rate = {other} in robot.toml"
            return replace(stage, port=port, name=name), bench
        raise


def _by_hand(checks: LinkDoctor, person: Person) -> None:
    from polepilot.commands.doctor_hands import try_inputs, try_outputs

    try_inputs(checks, person)
    try_outputs(checks, person)
