"""Makes the figures and pictures of docs/vision.md: ``python -m scenes.report`` (in tests/).

The page is written by hand, its tables stand between ``<!-- table: NAME -->`` and ``<!-- end -->``
and are made from the measurements in docs/results. ``--measure`` measures anew: ``table2`` and
``speed`` take a minute, ``resolution`` takes six, ``studio`` and ``darkroom`` (`scenes.final`) an
hour each.
"""

from __future__ import annotations

import argparse
import json
import re
import statistics
import sys
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

import cv2
from scenes import final, resolution, table2
from scenes.campaign import CAMERAS
from scenes.studio import scene

DOCS = Path(__file__).resolve().parents[2] / "docs"
RESULTS = DOCS / "results"
PENDING = "not measured yet"
_SPEED_SCENES = 60
_BLOCK = re.compile(r"(<!-- table: ([\w-]+) -->\n).*?(<!-- end -->)", re.DOTALL)


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


def _judgement(program: str) -> Callable[[Path], str]:
    """The table of the final campaign on one program's pictures."""

    def table(results: Path) -> str:
        ours = _load(results, f"{program}-default")
        papers = _load(results, f"{program}-paper")
        rows = []
        for line in final.LINES:
            targets = " / ".join(figure.target for figure in line.figures)
            cells = [line.pictures, line.what, targets]
            rows.append([*cells, _cell(line, ours, judged=True), _cell(line, papers)])
        return _rows(["pictures", "", "target", "default", "paper"], rows) + _counts(ours)

    return table


def _cell(line: final.Line, result: final.Result | None, judged: bool = False) -> str:
    if result is None:
        return PENDING
    parts = []
    for figure in line.figures:
        shown = figure.shown(result)
        failed = judged and figure.met(result) is False
        parts.append("-" if shown is None else f"**{shown}** (missed)" if failed else shown)
    return " / ".join(parts)


_TARGETS = (
    ("clean", "plain rooms, 2-8 m", 99.5),
    ("clean-8-12", "plain rooms, 8-12 m", 99.5),
    ("clean-12-16", "plain rooms, 12.5-16 m", 97.0),
    ("clean-16-22", "plain rooms, 16-22 m", 60.0),
    ("photo", "photographs, surround not orange", 98.0),
    ("pan", "panning, surround not orange", 97.0),
)


def _cameras(results: Path) -> str:
    """How many landmarks are read by what the camera has done to colour, of both programs."""
    measured = [_load(results, f"{program}-default") for program in ("darkroom", "studio")]
    rows = []
    for family, words, target in _TARGETS:
        cells = [words, f"≥ {target:g} %"]
        for camera in CAMERAS:
            found = [one and one[family]["cameras"][camera]["read_percent"] for one in measured]
            cells.append(
                " / ".join(
                    PENDING
                    if value is None
                    else f"{value:.2f}"
                    if value >= target
                    else f"**{value:.2f}**"
                    for value in found
                )
            )
        rows.append(cells)
    head = ["read, darkroom / studio, %", "target", "a larger picture, averaged"]
    return _rows([*head, "JPEG 4:2:0", "mosaic at this resolution"], rows)


def _counts(result: final.Result | None) -> str:
    if result is None:
        return ""
    rows = {family: row for family, row in result.items() if family != final.APART}
    counts = ", ".join(f"{row['frames']} {family}" for family, row in rows.items())
    landmarks = sum(row["landmarks"] for row in rows.values())
    return f"\n\nPictures: {counts}; {landmarks} whole landmarks in them."


def _table2(results: Path) -> str:
    measured = _load(results, "table2")
    rows = []
    for index, (actual, printed) in enumerate(zip(table2.ACTUAL, table2.PRINTED, strict=True)):
        off = 100 * (printed / actual - 1)
        cells = [f"{100 * actual:.0f}", f"{100 * printed:.0f} ({off:+.2f} %)"]
        for name in ("default", "paper"):
            row = measured and measured[name][index]
            if not row:
                cells += [PENDING, ""]
            elif row["mean"] is None:
                cells += ["-", f"0 of {row['pictures']}"]
            else:
                cells += [f"{100 * row['mean']:.3f} %", f"{row['read']} of {row['pictures']}"]
        rows.append(cells)
    means = [f"{100 * table2.paper_mean():.2f} %"]
    for name in ("default", "paper"):
        known = [row["mean"] for row in measured[name] if row["mean"]] if measured else []
        means += [f"**{100 * statistics.mean(known):.3f} %**" if known else PENDING, ""]
    head = ["actual, cm", "printed in the paper", "default: mean error", "read"]
    head += ["paper's detector: mean error", "read"]
    return _rows(head, [*rows, ["mean", *means]])


def _resolution(results: Path) -> str:
    measured = _load(results, "resolution") or []
    rows = []
    for width, height in resolution.SIZES:
        cells, times = [f"{width} x {height}"], []
        for band in resolution.BANDS:
            row = next((r for r in measured if r["width"] == width and r["band"] == band), None)
            if row is None:
                cells += [PENDING, "", ""]
                continue
            times.append(row["milliseconds"])
            cells.append(f"{100 * row['read'] / row['landmarks']:.1f} %")
            if row["read"]:
                cells.append(f"{row['range_mean_percent']:.3f} %")
                cells.append(f"{row['bearing_median_deg']:.4f}°")
            else:
                cells += ["-", "-"]
        rows.append([*cells, f"{statistics.mean(times):.1f} ms" if times else ""])
    head = ["pixels"]
    for band in resolution.BANDS:
        head += [f"{band}: read", "range, mean", "bearing, median"]
    return _rows([*head, "time"], rows)


def _speed(results: Path) -> str:
    measured = _load(results, "speed")
    rows = []
    for family, words, target in (
        ("clean", "plain rooms", 0.25),
        ("photo", "photographs, orange things", 0.5),
    ):
        row = measured and measured[family]
        cells = [words, f"≤ {target:g}"]
        if row:
            ratio = f"{row['ratio']:.2f}"
            shown = ratio if row["ratio"] <= target else f"**{ratio}** (missed)"
            cells += [shown, f"{row['ours_ms']:.2f} ms", f"{row['aruco_ms']:.2f} ms"]
        else:
            cells += [PENDING, "", ""]
        rows.append(cells)
    return _rows(["pictures", "target", "ours / ArUco", "ours", "ArUco"], rows)


TABLES: Mapping[str, Callable[[Path], str]] = {
    "darkroom": _judgement("darkroom"),
    "studio": _judgement("studio"),
    "cameras": _cameras,
    "table2": _table2,
    "resolution": _resolution,
    "speed": _speed,
}
"""What may stand between marks, by name."""


def measure_speed() -> dict[str, Any]:
    """`polepilot bench vision` on pictures of the studio."""
    from polepilot.commands.bench import Duel

    cv2.setNumThreads(1)
    out = {}
    for family in ("clean", "photo"):
        duel = Duel()
        duel.add([scene(family, seed).image for seed in range(_SPEED_SCENES)])
        ours, aruco = statistics.median(duel.ours), statistics.median(duel.aruco)
        out[family] = {
            "frames": duel.frames,
            "ours_ms": ours,
            "aruco_ms": aruco,
            "ratio": ours / aruco,
        }
    return out


def _measure(name: str, results: Path, share: float, processes: int) -> None:
    results.mkdir(parents=True, exist_ok=True)
    if name in ("studio", "darkroom"):
        for detector, result in final.campaign(name, share=share, processes=processes).items():
            final.write(result, results, name, detector)
        return
    work: Mapping[str, Callable[[], Any]] = {
        "table2": table2.document,
        "resolution": lambda: resolution.measure(said=_say),
        "speed": measure_speed,
    }
    (results / f"{name}.json").write_text(json.dumps(work[name](), indent=1) + "\n")


def make_pictures(images: Path, results: Path = RESULTS) -> None:
    """Draws every picture of the page whose measurements are there."""
    from scenes import figures_found, figures_measuring, figures_seeing

    images.mkdir(parents=True, exist_ok=True)
    _, data = cv2.imencode(".jpg", figures_found.found(), [cv2.IMWRITE_JPEG_QUALITY, 76])
    (images / "vision-found.jpg").write_bytes(data.tobytes())
    figures_seeing.search().save(images / "vision-search.svg")
    figures_seeing.strip().save(images / "vision-strip.svg")
    figures_seeing.side().save(images / "vision-side.svg")
    figures_measuring.pitch().save(images / "vision-pitch.svg")
    rows = _load(results, "resolution")
    if rows:
        figures_measuring.resolution(rows).save(images / "vision-resolution.svg")


def main(arguments: Sequence[str] | None = None) -> None:
    """Measures what is asked for, draws the pictures and fills in the tables."""
    parser = argparse.ArgumentParser(prog="python -m scenes.report", description=__doc__)
    what = ("studio", "darkroom", "table2", "resolution", "speed")
    parser.add_argument("--measure", nargs="+", choices=what, default=(), help="measure anew")
    parser.add_argument("--share", type=float, default=1.0, help="of the final pictures")
    parser.add_argument("--processes", type=int, default=2, help="of studio and darkroom")
    parser.add_argument("--docs", type=Path, default=DOCS, help="folder of vision.md")
    parser.add_argument("--no-pictures", action="store_true", help="leave the pictures alone")
    options = parser.parse_args(arguments)
    results = options.docs / "results"
    for name in options.measure:
        _say(f"measuring {name}")
        _measure(name, results, options.share, options.processes)
    if not options.no_pictures:
        _say("drawing")
        make_pictures(options.docs / "images", results)
    page = options.docs / "vision.md"
    page.write_text(filled(page.read_text("utf-8"), results), "utf-8")


def _say(text: str) -> None:
    sys.stderr.write(f"{text}\n")


if __name__ == "__main__":
    main()
