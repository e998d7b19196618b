"""`polepilot serve`: the robot with its web page."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

if TYPE_CHECKING:
    from polepilot.server.settings import Settings


def serve(
    host: Annotated[
        str, typer.Option(help="Address to listen on: this machine only, there is no login yet.")
    ] = "127.0.0.1",
    port: Annotated[
        int | None,
        typer.Option(min=0, max=65535, help="TCP port; 0 takes a free one.", show_default="8000"),
    ] = None,
    config: Annotated[
        Path | None, typer.Option(help="robot.toml; without it the simulated robot.")
    ] = None,
    data: Annotated[
        Path | None,
        typer.Option(
            envvar="POLEPILOT_DATA", help="Folder for sites, plans and logs.", show_default=False
        ),
    ] = None,
    board: Annotated[
        str | None,
        typer.Option(
            help="simulated, host (simulated, with the firmware's C code) or serial.",
            show_default="as configured",
        ),
    ] = None,
) -> None:
    """Serve the page and drive the robot until Ctrl-C."""
    from polepilot.server.listener import bind
    from polepilot.server.security import check_loopback
    from polepilot.server.settings import load_settings

    check_loopback(host)
    settings = load_settings(config)
    if board is not None:
        settings = settings.with_board(board)
    listening = bind(host, settings.server.port if port is None else port)
    try:
        _run(settings, host, listening.getsockname()[1], [listening], data)
    finally:
        listening.close()


def _run(settings: Settings, host: str, port: int, sockets: list, data: Path | None) -> None:  # type: ignore[type-arg]
    import asyncio
    import sys

    from polepilot.server.app import create_app
    from polepilot.server.assembly import open_services
    from polepilot.server.listener import Listener
    from polepilot.server.logs import configure_logs

    configure_logs()
    services = open_services(settings, host, port, data)
    shown = f"[{host}]" if ":" in host else host

    # Fixed now: a library that starts in the background swallows what is printed meanwhile.
    output = sys.stdout

    def ready() -> None:
        typer.echo(f"Polepilot is ready: http://{shown}:{port}/", file=output)

    asyncio.run(Listener(create_app(services), services, ready).serve(sockets))
    if services.failed:
        raise typer.Exit(1)
