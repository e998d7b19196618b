"""How every calibration ends: a table, a verdict, and lines for robot.toml or the file itself."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import typer

from polepilot.core.errors import InputError, RefusedError

if TYPE_CHECKING:
    from polepilot.core.verdict import Verdict
    from polepilot.server.settings import Settings
    from polepilot.server.settings_edit import Changes


@dataclass(frozen=True, slots=True)
class Outcome:
    """What a calibration found, for people and for programs."""

    table: tuple[Sequence[str], Sequence[Sequence[str]]]
    """Headings and rows."""
    lines: tuple[str, ...]
    """What else a person reads before the verdict."""
    document: dict[str, Any]
    """The ``--json`` document, without verdict and settings."""
    verdict: Verdict
    changes: Changes
    """For robot.toml."""


@dataclass(frozen=True, slots=True)
class Target:
    """Where the result goes: robot.toml (``config``), which is changed if ``write``."""

    config: Path | None
    write: bool
    as_json: bool

    def settings(self) -> Settings:
        """What robot.toml says now; the defaults without one.

        Raises:
            InputError: ``--write`` without ``--config``, or the file cannot be used.
        """
        from polepilot.server.settings import load_settings

        if self.write and self.config is None:
            raise InputError("--write is given without --config: expected --config robot.toml.")
        return load_settings(self.config)

    def finish(self, outcome: Outcome) -> None:
        """Say what was found, and write it where that is wanted.

        Raises:
            RefusedError: a poor result is not written.
        """
        from polepilot.server.settings_edit import rewrite

        verdict = outcome.verdict
        refused = self.write and verdict.grade == "poor"
        kept = None
        if self.write and not refused:
            assert self.config is not None
            kept = rewrite(self.config, outcome.changes)
        written = self.write and not refused
        if self.as_json:
            document = {
                **outcome.document,
                "verdict": verdict.to_json(),
                "settings": outcome.changes,
                "written": str(self.config) if written else None,
                "kept": None if kept is None else str(kept),
            }
            typer.echo(json.dumps(document))
        else:
            self._print(outcome, written, kept)
        if refused:
            raise RefusedError(
                f"{self.config} was not changed, because the result is poor: {verdict.reason}",
                remedy=" ".join(verdict.notes),
            )

    def _print(self, outcome: Outcome, written: bool, kept: Path | None) -> None:
        from polepilot.server.settings_edit import as_toml

        headings, rows = outcome.table
        _table(headings, rows)
        for line in outcome.lines:
            typer.echo(line)
        typer.echo(outcome.verdict.text)
        for note in outcome.verdict.notes:
            typer.echo(f"  {note}")
        if kept is not None:
            typer.echo(f"written to {self.config}; the old file is kept as {kept}")
        elif written:
            typer.echo(f"{self.config} says so already; nothing was changed")
        elif not self.write:
            where = "robot.toml" if self.config is None else str(self.config)
            typer.echo(f"for {where} (--write puts it in):")
            typer.echo(as_toml(outcome.changes))


def _table(headings: Sequence[str], rows: Sequence[Sequence[str]]) -> None:
    """Columns as wide as they need to be; the first is words, the others are numbers."""
    lines = [headings, *rows]
    widths = [max(len(line[column]) for line in lines) for column in range(len(headings))]
    for line in lines:
        first, *rest = zip(line, widths, strict=True)
        cells = [first[0].ljust(first[1]), *(cell.rjust(width) for cell, width in rest)]
        typer.echo("  ".join(cells).rstrip())
