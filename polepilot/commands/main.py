"""The `polepilot` command: registers the subcommands and turns errors into exit statuses.

0 success, 2 bad usage or bad input (one line on standard error), 1 other failure.
"""

from __future__ import annotations

import io
import os
import signal
import sys

# Matrices and pictures are small here: more threads cost a netbook more than they give. Libraries
# read these when they are imported, which the commands do later.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
os.environ.setdefault("OPENCV_FOR_THREADS_NUM", "1")

import typer
from typer.exceptions import TyperException

from polepilot.commands import bench, calibrate, landmarks
from polepilot.commands.detect import detect
from polepilot.commands.doctor import doctor
from polepilot.commands.evaluate import evaluate
from polepilot.commands.plan import plan
from polepilot.commands.precision import precision
from polepilot.commands.recover import recover
from polepilot.commands.replay import replay
from polepilot.commands.serve import serve
from polepilot.commands.simulate import simulate
from polepilot.commands.survey import survey
from polepilot.core.errors import InputError, PolepilotError, RefusedError

app = typer.Typer(
    name="polepilot",
    help="Web-controlled brain of a mobile robot that finds its way by barcode poles.",
    add_completion=False,
    pretty_exceptions_enable=False,
    rich_markup_mode=None,
)
for _command in (
    serve,
    detect,
    plan,
    precision,
    simulate,
    replay,
    evaluate,
    recover,
    survey,
    doctor,
):
    app.command()(_command)
app.add_typer(landmarks.app, name="landmarks", help="Print landmarks to scale, choose their ids.")
app.add_typer(calibrate.app, name="calibrate", help="Camera constant, lens, pan unit, drive.")
app.add_typer(bench.app, name="bench", help="Measure how fast and how well parts work.")


def main() -> None:
    """Run the command line; never shows a traceback for a user's mistake."""
    if isinstance(sys.stdout, io.TextIOWrapper):
        # Names of files may be any bytes: what is no text is shown escaped.
        sys.stdout.reconfigure(errors="backslashreplace")
    sys.exit(run(sys.argv[1:]))


def run(arguments: list[str]) -> int:
    """Run one command and return its exit status."""
    try:
        return int(app(args=arguments, prog_name="polepilot", standalone_mode=False) or 0)
    except typer.Exit as exit_:
        return exit_.exit_code
    except TyperException as error:
        context = getattr(error, "ctx", None)
        place = context.command_path if context is not None else "polepilot"
        _say(f"{place}: {error.format_message()} See '{place} --help'.")
        return 2
    except (InputError, RefusedError) as error:
        _say(str(error))
        return 2
    except PolepilotError as error:
        _say(str(error))
        return 1
    except (typer.Abort, KeyboardInterrupt):
        _say("interrupted.")
        return 128 + signal.SIGINT
    except BrokenPipeError:
        # The reader of our output has gone (``| head``): nobody is left to tell.
        sys.stderr.close()
        return 1
    except OSError as error:
        # A full disk, a device that is gone: nobody's mistake, and no traceback helps.
        _say(f"{error.filename or 'polepilot'}: {error.strerror or error}.")
        return 1


def _say(message: str) -> None:
    sys.stderr.write(" ".join(message.split()) + "\n")
