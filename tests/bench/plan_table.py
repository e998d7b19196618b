"""A table of scan plans over many maps: coverage, length, bound, changes of gear, seconds of
processor time.

    python tests/bench/plan_table.py [--radius 0 0.6] [--order default] [--only NAME ...]

Judged independently of the planner (tests/core/planning/judge.py). Length is given as a multiple
of area / tool width; next to it stands what straight passes cost at least for the widths of the
map, ``bound``.
"""

from __future__ import annotations

import argparse
import sys
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
import shapely
import shapely.affinity

sys.path.insert(0, str(Path(__file__).parents[1]))

from core.planning import judge, maps

from polepilot.core.errors import PolepilotError
from polepilot.core.planning.coverage import plan_scan
from polepilot.core.planning.options import PlanOptions
from polepilot.core.site import Site, read_site

DEMO = Path(__file__).parents[2] / "polepilot" / "demo" / "workshop.json"


def rooms(width: float, depth: float, columns: int) -> Site:
    """Rooms on both sides of a corridor of 1.6 m, each with a door of 0.9 m and a table."""
    walls, islands = [], []
    high = 2 * depth + 1.6
    for side, y, far in ((0, depth, 0.0), (1, depth + 1.6, high)):
        for column in range(columns):
            x = column * width
            door = x + 0.3 + 0.25 * width * (column % 3)
            walls += [[[x, y], [door, y]], [[door + 0.9, y], [x + width, y]]]
            if column:
                walls.append([[x, y], [x, far]])
            cx, cy = x + 0.6 * width, depth / 2 if not side else high - depth / 2
            if (column + side) % 2 == 0:
                islands.append(maps.box(cx - 0.4, cy - 0.3, cx + 0.4, cy + 0.3))
    return maps.site(
        maps.box(0, 0, columns * width, high), islands, walls=walls, start=[0.5, depth + 0.8]
    )


def hall(seed: int, count: int, wide: float, deep: float) -> Site:
    """A hall with furniture: rectangles, some turned, that do not overlap."""
    rng = np.random.default_rng(seed)
    placed: list[shapely.Polygon] = []
    for _ in range(count * 40):
        if len(placed) == count:
            break
        a, b = rng.uniform(0.2, 0.8, 2)
        x, y = rng.uniform(1.0, wide - 1.0), rng.uniform(1.0, deep - 1.0)
        shape = shapely.box(x - a / 2, y - b / 2, x + a / 2, y + b / 2)
        if rng.random() < 0.4:
            shape = shapely.affinity.rotate(shape, float(rng.uniform(0, 90)))
        if all(shape.distance(other) > 0.05 for other in placed):
            placed.append(shape)
    islands = [np.round(np.asarray(p.exterior.coords)[:-1], 4).tolist() for p in placed]
    return maps.site(maps.box(0, 0, wide, deep), islands)


MAPS: dict[str, Callable[[], Site]] = {
    "demo": lambda: read_site(DEMO),
    **{name: build for name, build in maps.NAMED.items() if name != "tight"},
    "room3x4": lambda: maps.site(maps.box(0, 0, 3, 4)),
    "room3.3x5.1": lambda: maps.site(maps.box(0, 0, 3.3, 5.1)),
    "room6x9": lambda: maps.site(maps.box(0, 0, 6.25, 9.1)),
    "flat": lambda: rooms(3.4, 4.2, 2),
    "offices": lambda: rooms(3.0, 4.0, 4),
    "offices2": lambda: rooms(4.5, 5.0, 5),
    "hall8": lambda: hall(1, 8, 7.0, 6.0),
    "hall20": lambda: hall(2, 20, 12.0, 9.0),
    "islands30": lambda: hall(3, 30, 14.0, 10.0),
    "comb1.0": lambda: maps.comb(5, 1.0, 4.0, 0.15),
    "spiral1.3": lambda: maps.spiral(3, 1.3),
    "star5": lambda: maps.star(5, 1.0, 3.0),
    "slant": lambda: maps.site([[0, 0], [6, 1], [5.2, 5], [1.5, 6.3], [-1, 3]]),
    "field": lambda: maps.site([[0, 0], [100, 5], [97, 60], [40, 64], [-2, 50]]),
    **{
        f"random{seed}": (lambda seed=seed: maps.random_site(np.random.default_rng(seed)))
        for seed in (1, 2, 3, 10, 12, 33652)
    },
}


def bound(area: shapely.Geometry, tool: float) -> float:
    """Length / (area / tool) of straight passes, from how wide the area is at each place.

    What vanishes when the area is opened with a disc of diameter w is narrower than w there and
    costs ceil(w / tool) passes; what is wider than twenty tools counts as it is.
    """
    widths = np.arange(tool, 20 * tool, tool / 10)
    left, cost = float(area.area), 0.0
    for width in widths:
        radius = width / 2
        opened = area.buffer(-radius, quad_segs=16).buffer(radius, quad_segs=16)
        now = min(left, float(opened.area))
        middle = max(width - tool / 20, tool)
        cost += (left - now) * np.ceil(middle / tool - 0.02) * tool / middle
        left = now
    return (cost + left) / float(area.area)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.split("\n", 1)[0])
    parser.add_argument("--radius", type=float, nargs="+", default=[0.0, 0.6])
    parser.add_argument("--order", default="default")
    parser.add_argument("--only", nargs="+")
    chosen = parser.parse_args()
    totals: dict[float, list[tuple[float, float, float, float]]] = {}
    print(
        f"{'map':12} {'bound':>6}"
        + "".join(f" |  r={r:g}: cov   ratio  rev   s  " for r in chosen.radius)
    )
    for name, build in MAPS.items():
        if chosen.only and name not in chosen.only:
            continue
        site = build()
        line, least = "", 0.0
        for radius in chosen.radius:
            began = time.process_time()
            try:
                plan = plan_scan(site, PlanOptions(min_turn_radius=radius, order=chosen.order))
            except PolepilotError as problem:
                line += f" | {problem}"
                continue
            seconds = time.process_time() - began
            area = judge.reachable(site, tuple(plan.path[0]), plan.clearance)
            least = least or bound(area, plan.tool_width)
            covered = judge.coverage(plan, site)
            ratio = plan.predicted.length / (area.area / plan.tool_width)
            marks = "" if judge.clearance_of(plan, site) >= plan.clearance - 1e-6 else " CONTACT"
            if radius and judge.sharpest(plan) < 0.98 * radius:
                marks += " SHARP"
            totals.setdefault(radius, []).append((covered, ratio, ratio / least, seconds))
            line += f" | {100 * covered:7.2f} {ratio:6.3f} {plan.predicted.reversals:4d}"
            line += f" {seconds:6.2f}{marks}"
        print(f"{name:12} {least:6.3f}{line}", flush=True)
    for radius, rows in totals.items():
        table = np.array(rows)
        print(
            f"radius {radius:g}: coverage {100 * table[:, 0].mean():.2f} mean"
            f" {100 * table[:, 0].min():.2f} worst; ratio {table[:, 1].mean():.3f} mean"
            f" {table[:, 1].max():.3f} worst; over bound {table[:, 2].mean():.3f} mean"
            f" {table[:, 2].max():.3f} worst; seconds {table[:, 3].mean():.2f} mean"
            f" {table[:, 3].max():.2f} worst"
        )


if __name__ == "__main__":
    main()
