"""Makes the figures and tables of docs/localization.md: ``python -m paper_figures`` (in tests/).

What the source paper shows of localization, done again. The page is written by hand; its tables
stand between ``<!-- table: NAME -->`` and ``<!-- end -->`` and are made from docs/results. The runs
take some minutes; ``--fill`` only fills the tables in from what was measured.
"""

from __future__ import annotations

import argparse
import json
import re
import sys
import tempfile
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

from paper_figures import claims, table1, two_poles
from recordings.final import LIMITS, OTHERS

from polepilot.core.chart import Chart
from polepilot.core.evaluation import compare
from polepilot.core.evaluation_plot import draw
from polepilot.core.robot.run_points import read_run

DOCS = Path(__file__).resolve().parents[2] / "docs"
RUN, PAPERS_RUN = "ours-ekf-1", "ours-paper-1"
"""The runs that Fig. 15 is drawn from: the same robot on the same route."""
_BLOCK = re.compile(r"(<!-- table: ([\w-]+) -->\n).*?(<!-- end -->)", re.DOTALL)
_SCENARIOS = {
    "room": "room 8x6 m",
    "corridor": "corridor 20x3 m",
    "yard": "yard 20x15 m",
    "slip": "slip bursts of 10 %",
    "moved": "one pole moved 40 cm",
    "lifted": "lifted 1.5 m away",
    "three": "three poles only",
}


def filled(page: str, results: Path) -> str:
    """The page with every table made from the measurements in ``results``.

    Raises:
        KeyError: the page asks for a table that there is not.
    """

    def table(match: re.Match[str]) -> str:
        made = TABLES[match[2]](results)
        return f"{match[1]}{made}\n{match[3]}" if made else match[1] + match[3]

    return _BLOCK.sub(table, page)


def _load(results: Path, name: str) -> Any:
    path = results / f"{name}.json"
    return json.loads(path.read_text("utf-8")) if path.exists() else None


def _rows(head: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    lines = [head, ["---"] * len(head), *rows]
    return "\n".join("| " + " | ".join(line) + " |" for line in lines)


def _table1(results: Path) -> str:
    measured = _load(results, "paper")
    if measured is None:
        return ""
    rows = []
    for name, steps in measured["table1"]["axes"].items():
        for index, step in enumerate(steps):
            printed = table1.PRINTED[name]
            z = printed["Z"][index]
            rows.append(
                [
                    f"{name}, k = {index + 1}",
                    f"{step['Z']:.2f}" + ("" if z is not None else " (not printed)"),
                    f"{printed['K'][index]:.3f}",
                    f"{step['K']:.3f}",
                    f"{printed['X'][index]:.2f}",
                    f"{step['X']:.2f}",
                    f"{printed['P'][index]:.3f}",
                    f"{step['P']:.3f}",
                ]
            )
    head = ["", "Z, cm", "K printed", "K", "X printed", "X", "P printed", "P"]
    return _rows(head, rows)


def _claims(results: Path) -> str:
    measured = _load(results, "paper")
    if measured is None:
        return ""
    rows = [["as the paper says", "paper", "-", "**< 4**", "-", "**15 %**", "-", "-"]]
    worlds = {"paper": "as the paper's simulator", "ours": "as our simulator"}
    for world, words in worlds.items():
        for method, name in (("paper", "paper"), ("ekf", "default")):
            row = measured["claims"][f"{world}-{method}"]
            rows.append(
                [
                    words,
                    name,
                    f"{row['measured_mean_cm']:.1f}",
                    f"**{row['estimated_mean_cm']:.1f}**",
                    f"{row['estimated_p95_cm']:.1f}",
                    f"**{row['improvement_percent']:.0f} %**",
                    f"{row['heading_mean_deg']:.2f}",
                    f"{row['arrived']} of {measured['claims']['seeds']}",
                ]
            )
    head = ["wheels and ranges", "method", "measured, mean cm", "estimated, mean cm", "p95 cm"]
    return _rows([*head, "better by", "heading, mean deg", "arrived"], rows)


def _accuracy(results: Path) -> str:
    """The final judgement, as ``recordings.final --final --json`` writes it; "" without it."""
    measured = _load(results, "localization")
    if measured is None:
        return ""
    rows = []
    for kind, words in _SCENARIOS.items():
        if kind not in measured:
            continue
        row, limits = measured[kind], LIMITS[kind]
        cells = [words]
        for pair, names, digits in (
            (limits[:2], ("position_mean_cm", "position_p95_cm"), 1),
            (limits[2:], ("heading_mean_deg", "heading_p95_deg"), 2),
        ):
            floors, targets = (" / ".join(f"{limit[i]:g}" for limit in pair) for i in (0, 1))
            values = [row[name] for name in names]
            shown = " / ".join(f"{value:.{digits}f}" for value in values)
            good = all(value <= limit[0] for value, limit in zip(values, pair, strict=True))
            cells += [f"{floors} → {targets}", f"**{shown}**" + ("" if good else " (missed)")]
        poses = row.get("poses_percent")
        nees, inside = row.get("nees_mean"), row.get("nees_inside_percent")
        cells.append("-" if poses is None else _limited(poses, OTHERS["poses_percent"]))
        cells.append("-" if nees is None else f"{nees:.1f}, {inside:.1f} %")
        rows.append(cells)
    head = ["recordings", "position cm, floor → target", "ours, mean / p95"]
    head += ["heading deg, floor → target", "ours, mean / p95", "poses", "NEES, in 95 %"]
    return _rows(head, rows)


def _noticed(results: Path) -> str:
    """What the final judgement says besides errors; "" without it."""
    measured = _load(results, "localization")
    if measured is None:
        return ""
    kinds = [kind for kind in _SCENARIOS if kind in measured]
    count = sum(measured[kind]["recordings"] for kind in kinds)
    costs = [measured[kind]["microseconds_per_measurement"] for kind in kinds]
    false = sum(len(measured[kind]["false_reports"]) for kind in kinds)
    rows = []
    for kind, name, words, digits in (
        ("lifted", "recovery_s", "a pose again after the second whole pole, s, at worst", 2),
        ("moved", "moved_after_sweeps", "a moved pole is reported after, sweeps, at worst", 2),
        ("moved", "moved_error_cm", "its displacement is off by, cm, at worst", 1),
    ):
        if kind not in measured:
            continue
        floor, target, _ = OTHERS[name]
        value = measured[kind][name]
        limits = f"{floor:g}" if floor == target else f"{floor:g} → {target:g}"
        missed = "" if value <= floor else " (missed)"
        rows.append([words, limits, f"**{value:.{digits}f}**{missed}"])
    rows.append([f"false reports in all {count} recordings", "0", f"**{false}**"])
    shown = f"**{min(costs):.0f} to {max(costs):.0f}**"
    rows.append(["CPU time per measurement, with fixes and books, microseconds", "100", shown])
    return _rows(["", "floor → target", "ours"], rows)


def _limited(value: float, limits: tuple[float, float, bool]) -> str:
    missed = value < limits[0] if limits[2] else value > limits[0]
    return f"{value:.1f} %" + (" (missed)" if missed else "")


TABLES: Mapping[str, Callable[[Path], str]] = {
    "table1": _table1,
    "claims": _claims,
    "accuracy": _accuracy,
    "noticed": _noticed,
}
"""What may stand between marks, by name."""


def figure_15(folder: Path) -> Chart:
    """A run with its four kinds of points, as ``polepilot evaluate RUN --plot`` draws it."""
    points = read_run(folder)
    assert points.real is not None
    tracks = points.tracks
    compared = {n: one for n, t in tracks.items() if (one := compare(points.real, t)) is not None}
    title = "Real, measured, estimated and target points of a simulated route"
    return draw(title, points.real, tracks, compared, points.targets, points.landmarks)


def main(arguments: Sequence[str] | None = None) -> None:
    """Drives, measures, draws, and fills the tables in."""
    parser = argparse.ArgumentParser(prog="python -m paper_figures", description=__doc__)
    parser.add_argument("--docs", type=Path, default=DOCS, help="folder of the page")
    parser.add_argument("--fill", action="store_true", help="measure and draw nothing")
    options = parser.parse_args(arguments)
    results = options.docs / "results"
    if not options.fill:
        results.mkdir(parents=True, exist_ok=True)
        images = options.docs / "images"
        images.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryDirectory() as folder:
            sys.stderr.write("driving\n")
            document = {
                "table1": table1.document(),
                "two_poles": two_poles.document(),
                "claims": claims.measure(Path(folder)),
            }
            (results / "paper.json").write_text(json.dumps(document, indent=1) + "\n", "utf-8")
            sys.stderr.write("drawing\n")
            figure_15(Path(folder) / RUN).save(images / "localization-route.svg")
            figure_15(Path(folder) / PAPERS_RUN).save(images / "localization-route-paper.svg")
            two_poles.draw().save(images / "localization-two-poles.svg")
    page = options.docs / "localization.md"
    page.write_text(filled(page.read_text("utf-8"), results), "utf-8")


if __name__ == "__main__":
    main()
