"""Judges ``replay`` on our recordings and prints the table: ``python -m recordings.final``.

In tests/. Seeds 0 to 99 are for development; ``--final`` takes those that are for judging only.
"""

from __future__ import annotations

import argparse
import json
import math
import sys
import tempfile
from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor
from functools import partial
from pathlib import Path
from typing import Any

import cv2
from recordings.ideal import PARTS, Part
from recordings.scenario import KINDS, Kind
from recordings.verdict import Verdict, figures, judge

FINAL = tuple(range(11000, 11024))
LIMITS: dict[Kind, tuple[tuple[float, float], ...]] = {
    "room": ((2.0, 0.9), (4.5, 2.0), (0.40, 0.22), (1.2, 0.7)),
    "corridor": ((1.8, 1.0), (4.0, 2.4), (0.45, 0.30), (1.3, 0.9)),
    "yard": ((3.2, 1.5), (7.0, 3.5), (0.40, 0.20), (1.3, 0.7)),
    "slip": ((2.0, 1.2), (5.0, 2.8), (0.45, 0.28), (1.5, 0.9)),
    "moved": ((2.0, 1.0), (4.5, 2.3), (0.45, 0.25), (1.3, 0.8)),
    "lifted": ((2.0, 0.9), (5.0, 2.2), (0.50, 0.28), (1.5, 0.9)),
    "three": ((2.4, 1.2), (6.0, 2.8), (0.50, 0.30), (1.5, 0.9)),
}
"""Position mean and p95 (cm), heading mean and p95 (degrees): floor, target."""
_JUDGED = ("position_mean_cm", "position_p95_cm", "heading_mean_deg", "heading_p95_deg")
OTHERS = {
    "poses_percent": (97.0, 99.5, True),
    "recovery_s": (3.0, 0.5, False),
    "moved_after_sweeps": (2.0, 2.0, False),
    "moved_error_cm": (10.0, 10.0, False),
}
"""Floor, target, and whether more is better."""


def campaign(
    kinds: Sequence[Kind],
    seeds: Sequence[int],
    keep: Path,
    *,
    measured: bool = False,
    ideal: Sequence[Part] = (),
    processes: int = 2,
) -> dict[str, Any]:
    """Every kind with every seed, judged; figures by kind."""
    jobs = [(kind, seed) for kind in kinds for seed in seeds]
    work = partial(_one, keep=keep, measured=measured, ideal=ideal)
    if processes == 1:
        verdicts = [work(job) for job in jobs]
    else:
        with ProcessPoolExecutor(processes, initializer=cv2.setNumThreads, initargs=(1,)) as pool:
            verdicts = list(pool.map(work, jobs))
    return {kind: figures([one for one in verdicts if one.kind == kind]) for kind in kinds}


def _one(job: tuple[Kind, int], keep: Path, measured: bool, ideal: Sequence[Part]) -> Verdict:
    try:
        return judge(*job, keep, measured=measured, ideal=ideal)
    except Exception as error:
        error.add_note(f"in the recording {job[0]} {job[1]}")
        raise


def missed(result: dict[str, Any], *, target: bool = False) -> list[str]:
    """Which floors (or targets) the figures do not reach, in words."""
    out = []
    for kind, row in result.items():
        for name, (floor, goal) in zip(_JUDGED, LIMITS.get(kind, ()), strict=False):
            limit = goal if target else floor
            if not row[name] <= limit:
                out.append(f"{kind}: {name} is {row[name]:.2f}: expected {limit:g} at most")
        for name, (floor, goal, more) in OTHERS.items():
            limit, value = goal if target else floor, row[name]
            if value is None or (kind == "push" and name == "recovery_s"):
                continue
            if not (value >= limit if more else value <= limit):
                out.append(f"{kind}: {name} is {value:.2f}: expected {limit:g}")
        if not 1.5 <= row["nees_mean"] <= 4.5:
            out.append(f"{kind}: nees_mean is {row['nees_mean']:.2f}: expected 1.5 to 4.5")
        if not 90.0 <= row["nees_inside_percent"] <= 99.5:
            out.append(
                f"{kind}: nees_inside_percent is {row['nees_inside_percent']:.1f}: expected 90-99.5"
            )
        if row["false_reports"]:
            out.append(f"{kind}: false reports: {', '.join(row['false_reports'])}")
    return out


def table(result: dict[str, Any]) -> str:
    """The figures for a person: ours (floor -> target)."""
    lines = [
        f"{'':10}{'position mean / p95 cm':>30}{'floor':>10}{'target':>10}"
        f"{'heading mean / p95 deg':>26}{'floor':>11}{'target':>11}"
        f"{'poses %':>9}{'NEES':>6}{'in 95 %':>8}{'recov. s':>9}{'sweeps':>7}{'moved cm':>9}"
        f"{'unaware s':>10}{'us/meas.':>9}{'us/frame':>9}"
    ]
    for kind, row in result.items():
        p, pp, h, hp = LIMITS.get(kind, ((math.nan, math.nan),) * 4)
        lines.append(
            f"{kind:10}{_pair(row, *_JUDGED[:2]):>30}{f'{p[0]:g}/{pp[0]:g}':>10}"
            f"{f'{p[1]:g}/{pp[1]:g}':>10}{_pair(row, *_JUDGED[2:]):>26}"
            f"{f'{h[0]:g}/{hp[0]:g}':>11}{f'{h[1]:g}/{hp[1]:g}':>11}"
            f"{row['poses_percent']:9.1f}{row['nees_mean']:6.2f}"
            f"{row['nees_inside_percent']:8.1f}{_or_none(row['recovery_s']):>9}"
            f"{_or_none(row['moved_after_sweeps']):>7}{_or_none(row['moved_error_cm']):>9}"
            f"{row['unaware_s']:10.1f}{row['microseconds_per_measurement']:9.0f}"
            f"{row['microseconds_per_frame']:9.0f}"
        )
    lines += [
        "",
        f"{'':10}{'by seed: position mean/p95, heading mean/p95, poses %, NEES, inside %'}",
    ]
    for kind, row in result.items():
        for one in row["by_seed"]:
            more = "".join(
                f"  {name} {one[key]:.2f}"
                for name, key in (("recovery", "recovery_s"), ("sweeps", "moved_after_sweeps"))
                if one[key] is not None
            )
            lines.append(
                f"{kind:10}{one['seed']:5d}  {_pair(one, *_JUDGED[:2])}  "
                f"{_pair(one, *_JUDGED[2:])}  {one['poses_percent']:6.1f}"
                f"{one['nees_mean']:7.2f}{one['nees_inside_percent']:7.1f}{more}"
            )
    lines += ["", f"{'':10}what was seen, and what happened"]
    for kind, row in result.items():
        lines.append(
            f"{kind:10}whole pole in {row['frames_with_whole_pole_percent']:.0f} % of frames, "
            f"read in {row['frames_with_detection_percent']:.0f} %; whole ones read "
            f"{row['whole_read_percent']:.1f} %, cut {row['cut_read']}, not in view "
            f"{row['not_in_view']}; range {row['range_mean_percent']:.2f} % "
            f"(bias {row['range_bias_percent']:+.2f}, /sigma {row['range_ratio']:.2f}), bearing "
            f"{row['bearing_deg']:.3f} deg (/sigma {row['bearing_ratio']:.2f}); first pose "
            f"{row['first_pose_s']:.1f} s; dead reckoning {row['reckoned_mean_cm']:.0f} cm"
        )
        lines.append(f"{'':10}{row['events']} {'; '.join(row['false_reports'])}")
    return "\n".join(lines)


def _plain(value: Any) -> Any:
    """``value`` with null for what is no number: a robot that never moves has no errors."""
    if isinstance(value, dict):
        return {key: _plain(one) for key, one in value.items()}
    if isinstance(value, list):
        return [_plain(one) for one in value]
    return None if isinstance(value, float) and math.isnan(value) else value


def _pair(row: dict[str, Any], first: str, second: str) -> str:
    return f"{row[first]:.2f} / {row[second]:.2f}"


def _or_none(value: float | None) -> str:
    return "" if value is None else f"{value:.2f}"


def main(arguments: Sequence[str] | None = None) -> None:
    """Runs the campaign and prints its table."""
    parser = argparse.ArgumentParser(prog="python -m recordings.final", description=__doc__)
    parser.add_argument("--scenario", nargs="+", choices=KINDS, help="default: all")
    parser.add_argument("--seeds", nargs="+", type=int, default=[0, 1])
    parser.add_argument("--final", action="store_true", help="judge: LIMITS' kinds, FINAL's seeds")
    parser.add_argument("--measured", action="store_true", help="detections by lot, no pictures")
    parser.add_argument(
        "--ideal", nargs="+", choices=PARTS, default=(), help="likewise, without these faults"
    )
    parser.add_argument("--json", type=Path, help="file for the figures")
    parser.add_argument("--processes", type=int, default=2)
    parser.add_argument(
        "--cache",
        type=Path,
        default=Path(tempfile.gettempdir()) / "polepilot-recordings",
        help="folder that keeps recordings",
    )
    options = parser.parse_args(arguments)
    result = campaign(
        options.scenario or (tuple(LIMITS) if options.final else KINDS),
        FINAL if options.final else options.seeds,
        options.cache,
        measured=options.measured,
        ideal=options.ideal,
        processes=options.processes,
    )
    if options.json is not None:
        options.json.write_text(json.dumps(_plain(result), indent=1) + "\n")
    sys.stdout.write(table(result) + "\n")
    for kind in ("floor", "target"):
        short = missed(result, target=kind == "target")
        sys.stdout.write(f"\n{kind}s missed: {len(short)}\n")
        sys.stdout.write("".join(f"  {text}\n" for text in short))


if __name__ == "__main__":
    main()
