"""The final judgement: the campaign whose figures stand in docs/vision.md, and their bounds.

``./run soak tests/soak/test_vision.py`` runs it, ``python -m scenes.final`` (in tests/) as well.
Its pictures begin at seed 930,000; nobody develops a detector on them.
"""

from __future__ import annotations

import argparse
import json
import math
import sys
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, get_args

from scenes.campaign import run, summary, table
from scenes.truth import Family

SEED = 930_000
FRAMES: Mapping[Family, int] = dict.fromkeys(get_args(Family), 660) | {"empty": 3_000}
"""Pictures per family."""

Result = Mapping[str, Any]
"""What `scenes.campaign.summary` gives: figures by family."""


@dataclass(frozen=True, slots=True)
class Figure:
    """One figure of the table and between what it has to lie."""

    of: Callable[[Result], float | None]
    """None where the pictures that it is about are missing."""
    low: float | None = None
    high: float | None = None
    unit: str = ""
    digits: int = 2

    def met(self, result: Result) -> bool | None:
        """Whether the bounds are kept; None where there is no figure."""
        value = self.of(result)
        if value is None:
            return None
        return (self.low is None or value >= self.low) and (self.high is None or value <= self.high)

    @property
    def target(self) -> str:
        """The bounds for people: ``≥ 99.5 %``."""
        if self.low is None:
            return f"≤ {self.high:g}{self.unit}"
        if self.high is None:
            return f"≥ {self.low:g}{self.unit}"
        return f"{self.low:g} to {self.high:g}{self.unit}"

    def shown(self, result: Result) -> str | None:
        """The figure for people."""
        value = self.of(result)
        return None if value is None else f"{value:.{self.digits}f}{self.unit}"


@dataclass(frozen=True, slots=True)
class Line:
    """One line of the table: pictures, and the figures that belong together."""

    pictures: str
    what: str
    figures: tuple[Figure, ...]


def _at(*path: str) -> Callable[[Result], float | None]:
    """The figure at a path of the summary."""

    def find(result: Result) -> float | None:
        place: Any = result
        for key in path:
            place = place.get(key) if isinstance(place, Mapping) else None
        return None if place is None else float(place)

    return find


def _plain(result: Result) -> float | None:
    """Read where the surround has not the paint's colour (where none has: over all)."""
    apart = _at("photo", "plain", "read_percent")(result)
    return _at("photo", "read_percent")(result) if apart is None else apart


APART = "hidden, ids apart"
"""The hidden landmarks once more, as on a site with the ids that are offered."""
_NOT_WHOLE = ("hidden", APART)


def _wrong(result: Result) -> float | None:
    """Wrong ids per hundred answers, hidden landmarks left out."""
    rows = [row for family, row in result.items() if family not in (*_NOT_WHOLE, "empty")]
    answers = sum(row["answers"] for row in rows)
    return 100 * sum(row["wrong"] for row in rows) / answers if answers else None


def _honesty(name: str) -> Callable[[Result], float | None]:
    """Standard deviation of error over sigma, over all landmarks that are whole."""

    def find(result: Result) -> float | None:
        rows = [
            row
            for family, row in result.items()
            if family != APART and row.get(f"{name}_ratio_std") is not None
        ]
        read = sum(row["read"] for row in rows)
        squares = sum(row["read"] * row[f"{name}_ratio_std"] ** 2 for row in rows)
        return math.sqrt(squares / read) if read else None

    return find


def _read(family: str, bound: float) -> Figure:
    return Figure(_at(family, "read_percent"), low=bound, unit=" %")


def _mean(family: str, bound: float) -> Figure:
    return Figure(_at(family, "range_mean_percent"), high=bound, unit=" %", digits=3)


def _p95(family: str, bound: float) -> Figure:
    return Figure(_at(family, "range_p95_percent"), high=bound, unit=" %", digits=3)


_BEARING = (
    Figure(_at("clean", "bearing_median_deg"), high=0.03, unit="°", digits=4),
    Figure(_at("clean", "bearing_p95_deg"), high=0.1, unit="°", digits=4),
)
_HIDDEN = Figure(_at("hidden", "wrong_percent"), high=1, unit=" %")
_HIDDEN_APART = Figure(_at(APART, "wrong_percent"), high=1, unit=" %")
_FALSE = Figure(_at("empty", "false_per_1000"), high=1)
_HONEST = (
    Figure(_honesty("range"), low=0.8, high=1.25),
    Figure(_honesty("bearing"), low=0.8, high=1.25),
)

LINES = (
    Line("plain rooms, 2-8 m", "read", (_read("clean", 99.5),)),
    Line("", "range error, mean / 95 %", (_mean("clean", 0.15), _p95("clean", 0.5))),
    Line("", "bearing error, median / 95 %", _BEARING),
    Line("plain rooms, 8-12 m", "read", (_read("clean-8-12", 99.5),)),
    Line("", "range error, mean", (_mean("clean-8-12", 0.35),)),
    Line("plain rooms, 12.5-16 m", "read", (_read("clean-12-16", 97),)),
    Line("", "range error, mean", (_mean("clean-12-16", 0.6),)),
    Line("plain rooms, 16-22 m", "read", (_read("clean-16-22", 60),)),
    Line("", "range error, mean", (_mean("clean-16-22", 1),)),
    Line(
        "photographs, all light, 2-8 m",
        "read: surround not orange / all",
        (Figure(_plain, low=98, unit=" %"), _read("photo", 90)),
    ),
    Line("", "range error, mean / 95 %", (_mean("photo", 0.25), _p95("photo", 0.8))),
    Line("panning up to 60 °/s, 2-8 m", "read", (_read("pan", 97),)),
    Line("", "range error, mean", (_mean("pan", 0.3),)),
    Line("all of these", "wrong ids", (Figure(_wrong, high=0.1, unit=" %", digits=3),)),
    Line("partly hidden", "wrong ids: all 15 ids / the 8 of distance 2", (_HIDDEN, _HIDDEN_APART)),
    Line("no landmark", "false answers in 1,000 pictures", (_FALSE,)),
    Line("all", "error / sigma, std: range / bearing", _HONEST),
)
"""The table of docs/vision.md."""


def campaign(
    program: str,
    detectors: Sequence[str] = ("default", "paper"),
    *,
    share: float = 1.0,
    families: Sequence[Family] = get_args(Family),
    processes: int = 2,
    keep: Path | None = None,
) -> dict[str, dict[str, Any]]:
    """The figures of detectors on the final pictures of a program, by detector.

    Args:
        program: ``studio`` or ``darkroom``.
        detectors: ``default``, ``paper``.
        share: of the pictures, for a quick look at whether everything runs.
        families: of them only these.
        processes: that work at the same time.
        keep: folder for rendered pictures; default: kept until the last detector has seen them.
    """
    results: dict[str, dict[str, Any]] = {name: {} for name in detectors}
    for family in families:
        with TemporaryDirectory() as folder:
            work = partial(
                run,
                [family],
                math.ceil(share * FRAMES[family]),
                SEED,
                program=program,
                processes=processes,
                keep=keep or Path(folder),
            )
            for name in detectors:
                results[name] |= summary(work(detector=name))
            if family == "hidden" and "default" in detectors:
                results["default"][APART] = summary(work(detector="apart"))[family]
    return results


def missed(result: Result) -> list[str]:
    """The bounds that are not met, in words."""
    out = []
    pictures = ""
    for line in LINES:
        pictures = line.pictures or pictures
        for figure in line.figures:
            if figure.met(result) is False:
                value = figure.shown(result)
                out.append(f"{pictures}: {line.what}: {value}, expected {figure.target}")
    return out


def main(arguments: Sequence[str] | None = None) -> None:
    """Runs campaigns, prints their tables and writes their figures."""
    parser = argparse.ArgumentParser(prog="python -m scenes.final", description=__doc__)
    parser.add_argument("--programs", nargs="+", default=["studio"], help="studio, darkroom")
    parser.add_argument("--detectors", nargs="+", default=["default", "paper"])
    parser.add_argument("--families", nargs="+", choices=get_args(Family), default=get_args(Family))
    parser.add_argument("--share", type=float, default=1.0, help="of the pictures")
    parser.add_argument("--out", type=Path, help="folder for PROGRAM-DETECTOR.json")
    parser.add_argument("--cache", type=Path, help="folder that keeps rendered pictures")
    parser.add_argument("--processes", type=int, default=2)
    options = parser.parse_args(arguments)
    for program in options.programs:
        results = campaign(
            program,
            options.detectors,
            share=options.share,
            families=options.families,
            processes=options.processes,
            keep=options.cache,
        )
        for detector, result in results.items():
            sys.stdout.write(f"{program}, {detector}\n{table(result)}\n")
            if options.out is not None:
                write(result, options.out, program, detector)
            for words in missed(result) if detector == "default" else ():
                sys.stdout.write(f"NOT MET: {words}\n")


def write(result: Result, folder: Path, program: str, detector: str) -> None:
    """Keeps the figures where `scenes.report` finds them."""
    folder.mkdir(parents=True, exist_ok=True)
    (folder / f"{program}-{detector}.json").write_text(json.dumps(result, indent=1) + "\n")


if __name__ == "__main__":
    main()
