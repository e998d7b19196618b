"""`polepilot recover`: a run's log that was cut off, made whole for every MCAP reader."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer


def recover(
    log: Annotated[
        Path, typer.Argument(metavar="RUN.mcap", help="The log of a run, or its folder.")
    ],
    out: Annotated[Path, typer.Option(metavar="WHOLE.mcap", help="Where the whole log goes.")],
    as_json: Annotated[bool, typer.Option("--json", help="Print one JSON document.")] = False,
) -> None:
    """Write what a power cut or kill -9 left of a log as a whole one; the log itself stays."""
    import json
    import sys

    from polepilot.core.errors import InputError
    from polepilot.core.robot.log import LogReader, finish_log
    from polepilot.core.robot.run_log import find_log

    path = find_log(log)
    if path is None:
        raise InputError(f"{log}: no such log: expected run.mcap, or a folder with it.")
    if out.is_dir() or (out.exists() and out.samefile(path)):
        raise InputError(f"--out {out}: expected another file than the log.")
    reader = LogReader(path)
    for _ in reader:
        pass
    if not reader.count:
        raise InputError(f"{path}: expected the log of a run (MCAP): {reader.cut or 'empty'}.")
    try:
        count = finish_log(path, out)
    except OSError as error:
        raise InputError(f"--out {out}: cannot be written: {error.strerror or error}.") from error
    if as_json:
        sys.stdout.write(json.dumps({"messages": count, "cut": reader.cut or None}) + "\n")
        return
    sys.stdout.write(f"{path}: {reader.cut or 'whole'}.\n{count} messages -> {out}\n")
