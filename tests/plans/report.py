"""Makes the tables and pictures of docs/planning.md: ``python -m plans.report`` (in tests/).

The page is written by hand; its tables stand between ``<!-- table: NAME -->`` and ``<!-- end -->``
and are made from docs/results/plans.json (``python -m plans.final``) and plan-growth.json
(``python -m plans.growth``).
"""

from __future__ import annotations

import json
import re
import sys
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

from plans.final import TARGETS, mean
from plans.sets import DEVELOPMENT
from plans.shapes import box, document, figure_13

DOCS = Path(__file__).resolve().parents[2] / "docs"
RESULTS = DOCS / "results"
PENDING = "not measured yet"
_BLOCK = re.compile(r"(<!-- table: ([\w-]+) -->\n).*?(<!-- end -->)", re.DOTALL)

Row = dict[str, Any]


def filled(page: str, results: Path = RESULTS) -> str:
    """The page with every table made from the measurements in ``results``.

    Raises:
        KeyError: the page asks for a table that there is not.
    """

    def table(match: re.Match[str]) -> str:
        return f"{match[1]}{TABLES[match[2]](results)}\n{match[3]}"

    return _BLOCK.sub(table, page)


def _load(results: Path, name: str) -> Any:
    path = results / f"{name}.json"
    return json.loads(path.read_text()) if path.exists() else None


def _rows(head: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    lines = [head, ["---"] * len(head), *rows]
    return "\n".join("| " + " | ".join(line) + " |" for line in lines)


def _figures(results: Path) -> str:
    """What was asked for and what came out, by turning radius."""
    measured = _load(results, "plans")
    if not measured:
        return PENDING
    rows = []
    for target in TARGETS:
        sign = "≥" if target.at_least else "≤"
        cells = []
        for found in measured.values():
            value = target.value([row for row in found if "error" not in row])
            cells.append(_short(value))
        both = set(target.radii) == set(measured)
        bound = f"{sign} {target.bound:g}" + ("" if both else f" (radius {target.radii[0]})")
        rows.append([target.what, bound, *cells])
    for key, what in (("ratio", "length / (area / width)"), ("reversals", "changes of gear")):
        for name, of in (("mean", mean), ("worst", max)):
            cells = [
                f"{of([row[key] for row in found if 'error' not in row]):.3f}".rstrip("0").rstrip(
                    "."
                )
                for found in measured.values()
            ]
            rows.append([f"{what}, {name}", "", *cells])
    failed = [str(sum("error" in row for row in found)) for found in measured.values()]
    rows.append(["maps without a plan", "0", *failed])
    return _rows(["", "asked for", *(f"radius {radius} m" for radius in measured)], rows)


def _short(value: float) -> str:
    """Three digits at most: 1.25, 100."""
    text = f"{value:.3f}"
    return text.rstrip("0").rstrip(".")


def _maps(results: Path) -> str:
    """A line per map of the final set."""
    measured = _load(results, "plans")
    if not measured:
        return PENDING
    sharp, driven = measured["0"], measured["0.6"]
    rows = []
    for plain, curved in zip(sharp, driven, strict=True):
        rows.append(
            [
                plain["map"],
                *(_cells(plain, "bound", "ratio", "coverage", "seconds")),
                *(_cells(curved, "ratio", "coverage", "reversals", "seconds")),
            ]
        )
    head = ["map", "bound", "ratio", "covered %", "s", "ratio, 0.6 m", "covered %", "gears", "s"]
    return _rows(head, rows)


def _cells(row: Row, *keys: str) -> list[str]:
    digits = {"bound": 3, "ratio": 3, "coverage": 2, "seconds": 2, "reversals": 0}
    if "error" in row:
        return ["failed", *[""] * (len(keys) - 1)]
    return [f"{row[key]:.{digits[key]}f}" for key in keys]


def _growth(results: Path) -> str:
    measured = _load(results, "plan-growth")
    if not measured:
        return PENDING
    sizes = next(iter(measured.values()))["area_over_width"]
    rows = [
        [f"{radius} m", *(f"{value:.2f} s" for value in row["seconds"]), f"{row['exponent']:.2f}"]
        for radius, row in measured.items()
    ]
    return _rows(["turning radius", *(f"{size:.0f} m" for size in sizes), "exponent"], rows)


TABLES: dict[str, Callable[[Path], str]] = {
    "figures": _figures,
    "maps": _maps,
    "growth": _growth,
}


def pictures() -> dict[str, str]:
    """The drawings of the page by file name, SVG."""
    from polepilot.core.planning.coverage import plan_scan
    from polepilot.core.planning.options import PlanOptions
    from polepilot.core.planning.plot import plot_svg
    from polepilot.core.planning.route import plan_route
    from polepilot.core.site import parse_site

    fig13 = parse_site(figure_13(), "Fig. 13")
    office = parse_site(DEVELOPMENT["office 6"](), "office")
    hall = parse_site(
        document(
            box(0, 0, 9, 5),
            [box(3, 1.5, 4, 5)],
            no_go=[box(5.5, 0, 6.5, 3)],
            routes=[{"name": "Dock", "nodes": [[2, 4], [5, 1], [8, 1.2]], "heading": 1.5708}],
            start=[1, 1, 0],
        ),
        "hall",
    )
    paper = PlanOptions(min_turn_radius=0, order="paper")
    return {
        "plan-figure13.svg": plot_svg(fig13, plan_scan(fig13, paper)),
        "plan-office.svg": plot_svg(office, plan_scan(office, PlanOptions(min_turn_radius=0))),
        "plan-drivable.svg": plot_svg(office, plan_scan(office, PlanOptions())),
        "plan-route.svg": plot_svg(hall, plan_route(hall, "Dock", PlanOptions())),
    }


def main() -> None:
    """Draws the pictures and fills in the tables."""
    for name, svg in pictures().items():
        (DOCS / "images" / name).write_text(svg, "utf-8")
    page = DOCS / "planning.md"
    page.write_text(filled(page.read_text("utf-8")), "utf-8")
    sys.stderr.write(f"{page}\n")


if __name__ == "__main__":
    main()
