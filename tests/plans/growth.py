"""How planning time grows with the size of the map: ``python -m plans.growth`` (in tests/).

Halls with pillars, a hundred times larger from the first to the last, the pillars as dense in all
of them: so nothing but the size changes. The exponent is the slope of a straight line through the
logarithms (least squares).
"""

from __future__ import annotations

import json
import math
import sys
import time
from pathlib import Path
from typing import Any

import numpy as np
from plans.final import CLEARANCE, RADII, TOOL, planned
from plans.scorer import ground
from plans.shapes import Document, grid_pillars

LARGEST_EXPONENT = 1.1
SIDES = (5, 9, 16, 28, 50)
"""Metres; their squares go from 25 to 2,500."""
RESULTS = Path(__file__).parents[2] / "docs" / "results" / "plan-growth.json"


def hall(side: float) -> Document:
    """A square hall with a column every five metres."""
    count = max(1, round(side / 5))
    return grid_pillars(count, count, side / count, 0.5)


def measured() -> dict[str, dict[str, Any]]:
    """By turning radius: area over width, seconds (the least of three), and the exponent."""
    out: dict[str, dict[str, Any]] = {}
    planned(hall(SIDES[0]), 0.6)  # libraries are loaded
    for radius in RADII:
        sizes, seconds = [], []
        for side in SIDES:
            site = hall(side)
            spent, plan = math.inf, {}
            for _ in range(3 if side < 20 else 1):
                began = time.process_time()
                plan = planned(site, radius)
                spent = min(spent, time.process_time() - began)
            first = plan["path"][0]
            area = ground(site, (first[0], first[1]), CLEARANCE).reachable.area
            sizes.append(area / TOOL)
            seconds.append(spent)
        slope = np.polyfit(np.log(sizes), np.log(seconds), 1)[0]
        out[f"{radius:g}"] = {
            "area_over_width": [round(size, 1) for size in sizes],
            "seconds": [round(value, 4) for value in seconds],
            "exponent": round(float(slope), 3),
        }
    return out


def table(result: dict[str, dict[str, Any]]) -> str:
    lines = []
    for radius, row in result.items():
        pairs = zip(row["area_over_width"], row["seconds"], strict=True)
        cells = ", ".join(f"{size:.0f} m: {spent:.2f} s" for size, spent in pairs)
        lines.append(f"turning radius {radius} m: {cells}; exponent {row['exponent']:.2f}")
    return "\n".join(lines)


def main() -> None:
    """Measures, prints and keeps the figures."""
    result = measured()
    RESULTS.write_text(json.dumps(result, indent=1) + "\n")
    sys.stdout.write(f"{table(result)}\n")


if __name__ == "__main__":
    main()
