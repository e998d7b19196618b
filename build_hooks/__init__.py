"""What is built while Polepilot is installed: the page (`page`) and the eye's kernel (`kernel`).

Called by hatch_build.py in the root, by hand or by hatchling; needs nothing but Python itself.
"""

from __future__ import annotations

import sys


class BuildError(RuntimeError):
    """Something cannot be built; the message says why and what to do."""


def say(text: str) -> None:
    """One line about what is done, on standard error."""
    print(f"polepilot: {text}", file=sys.stderr, flush=True)  # noqa: T201
