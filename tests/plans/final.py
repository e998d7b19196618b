"""Judges ``plan`` on the final set of maps and prints the table: ``python -m plans.final``.

In tests/. ``--dev`` takes the set that is for development; the final set is for judging only.
"""

from __future__ import annotations

import argparse
import json
import sys
import time
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

from plans.scorer import judge
from plans.sets import DEVELOPMENT, FINAL

RADII = (0.0, 0.6)
TOOL, CLEARANCE = 0.4, 0.2
RESULTS = Path(__file__).parents[2] / "docs" / "results" / "plans.json"

Row = dict[str, Any]


def campaign(
    maps: Sequence[str], dev: bool, radii: Sequence[float] = RADII, processes: int = 1
) -> dict[str, list[Row]]:
    """The verdicts of maps, by turning radius. A plan that fails is a row with an ``error``."""
    jobs = [(name, radius) for radius in radii for name in maps]
    work = partial(_one, dev=dev)
    if processes == 1:
        rows = [_said(work(job)) for job in jobs]
    else:
        with ProcessPoolExecutor(processes) as pool:
            rows = [_said(row) for row in pool.map(work, jobs)]
    return {
        f"{radius:g}": [row for row, job in zip(rows, jobs, strict=True) if job[1] == radius]
        for radius in radii
    }


def _said(row: Row) -> Row:
    """The row, with a word on standard error that it is there."""
    short = row.get("error") or f"{row['coverage']:.3f} %, over {row['over']:.3f}"
    sys.stderr.write(f"{row['map']}: {short}\n")
    return row


def planned(site: Row, radius: float, **options: Any) -> Row:
    """What ``plan --json`` prints for a SITE.json document."""
    from polepilot.commands.plan import JobMode, make_plan
    from polepilot.core.planning.options import PlanOptions
    from polepilot.core.site import parse_site

    wanted = PlanOptions(tool_width=TOOL, clearance=CLEARANCE, min_turn_radius=radius, **options)
    plan = make_plan(parse_site(site, "the map"), JobMode.SCAN, None, wanted)
    document: Row = json.loads(json.dumps(plan.to_json(), allow_nan=False))
    return document


def _one(job: tuple[str, float], dev: bool) -> Row:
    name, radius = job
    site = (DEVELOPMENT if dev else FINAL)[name]()
    began = time.process_time()
    try:
        plan = planned(site, radius)
    except Exception as error:  # noqa: BLE001 - a planner that fails is a figure of the table
        return {"map": name, "error": f"{type(error).__name__}: {error}"}
    used = time.process_time() - began
    row = judge(name, site, plan, TOOL, CLEARANCE, radius).to_json()
    return row | {"seconds": round(used, 3)}


@dataclass(frozen=True, slots=True)
class Target:
    """What a column of the table is to be."""

    what: str
    key: str
    of: Callable[[list[float]], float]
    bound: float
    at_least: bool = False
    radii: tuple[str, ...] = ("0", "0.6")
    maps: Callable[[Row], bool] = bool

    def value(self, rows: list[Row]) -> float:
        return self.of([row[self.key] for row in rows if "error" not in row and self.maps(row)])

    def met(self, rows: list[Row]) -> bool:
        value = self.value(rows)
        return value >= self.bound if self.at_least else value <= self.bound


def mean(values: list[float]) -> float:
    return sum(values) / len(values) if values else 0.0


def _worst(values: list[float]) -> float:
    return max(values, default=0.0)


def _least(values: list[float]) -> float:
    return min(values, default=100.0)


def _large(row: Row) -> bool:
    return bool(row["area"] > 2000)


def _plan(row: Row) -> bool:
    return not _large(row)


TARGETS = (
    Target("coverage, mean", "coverage", mean, 99.9, at_least=True),
    Target("coverage, worst", "coverage", _least, 99.5, at_least=True),
    Target("length over bound, mean", "over", mean, 1.10, radii=("0",)),
    Target("length over bound, worst", "over", _worst, 1.25, radii=("0",)),
    Target("contacts", "contacts", sum, 0),
    Target("corners", "corners", sum, 0),
    Target("jumps of heading", "crooked", sum, 0),
    Target("unreachable agrees, worst", "unreachable", _least, 97, at_least=True),
    Target("seconds, worst, floor plans", "seconds", _worst, 1.0, maps=_plan),
    Target("seconds, worst, field", "seconds", _worst, 2.0, maps=_large),
)


def missed(result: Mapping[str, list[Row]]) -> list[str]:
    """What is not as it has to be, in words."""
    words = []
    for radius, rows in result.items():
        words += [
            f"radius {radius}: {row['map']}: {row['error']}" for row in rows if "error" in row
        ]
        for target in TARGETS:
            if radius in target.radii and not target.met(rows):
                sign = "at least" if target.at_least else "at most"
                words.append(
                    f"radius {radius}: {target.what} is {target.value(rows):.3f}: "
                    f"expected {target.bound:g} {sign}"
                )
        words += [
            f"radius {radius}: {row['map']}: parts leave a gap"
            for row in rows
            if "error" not in row and not row["parts"]
        ]
    return words


COLUMNS = (
    ("coverage", "cover %", 3),
    ("length", "length", 1),
    ("ratio", "ratio", 3),
    ("bound", "bound", 3),
    ("over", "over", 3),
    ("contacts", "hits", 0),
    ("corners", "sharp", 0),
    ("crooked", "jumps", 0),
    ("reversals", "gears", 0),
    ("unreachable", "agree %", 2),
    ("seconds", "seconds", 2),
)
_WORST_IS_LEAST = ("coverage", "unreachable")


def table(rows: list[Row]) -> str:
    """A line per map, then mean and worst."""
    good = [row for row in rows if "error" not in row]
    lines = [f"{'':28}" + "".join(f"{head:>9}" for _, head, _ in COLUMNS)]
    for row in rows:
        if "error" in row:
            lines.append(f"{row['map']:28} {row['error']}")
            continue
        lines.append(
            f"{row['map']:28}" + "".join(f"{row[key]:9.{digits}f}" for key, _, digits in COLUMNS)
        )
    for name in ("mean", "worst") if good else ():
        cells = []
        for key, _, digits in COLUMNS:
            values = [row[key] for row in good]
            worst = min(values) if key in _WORST_IS_LEAST else max(values)
            value = mean(values) if name == "mean" else worst
            cells.append(f"{value:9.{max(digits, 1) if name == 'mean' else digits}f}")
        lines.append(f"{name:28}" + "".join(cells))
    return "\n".join(lines)


def main(arguments: Sequence[str] | None = None) -> None:
    """Plans on every map, judges, prints tables; writes the final set's figures."""
    parser = argparse.ArgumentParser(prog="python -m plans.final", description=__doc__)
    parser.add_argument("--dev", action="store_true", help="the development set; writes nothing")
    parser.add_argument("--maps", nargs="+", help="of them only those with one of these words")
    parser.add_argument("--radii", nargs="+", type=float, default=RADII)
    parser.add_argument("--processes", type=int, default=1)
    parser.add_argument("--out", type=Path, default=RESULTS)
    options = parser.parse_args(arguments)
    names = list(DEVELOPMENT if options.dev else FINAL)
    if options.maps:
        names = [name for name in names if any(word in name for word in options.maps)]
    result = campaign(names, options.dev, options.radii, options.processes)
    for radius, rows in result.items():
        sys.stdout.write(f"turning radius {radius} m\n{table(rows)}\n\n")
    for words in missed(result):
        sys.stdout.write(f"NOT MET: {words}\n")
    if not options.dev and not options.maps and tuple(options.radii) == RADII:
        options.out.parent.mkdir(parents=True, exist_ok=True)
        options.out.write_text(json.dumps(result, indent=1) + "\n")


if __name__ == "__main__":
    main()
