"""Sites with something wrong with them, by lot: ``python -m plans.fuzz`` (in tests/).

Each has to be refused in one clear line or planned on (with what was mended said), within seconds,
and never ends in another error.
"""

from __future__ import annotations

import argparse
import math
import sys
import time
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from plans.final import planned
from plans.shapes import Document, Ring, box, circle, document

from polepilot.core.errors import PlanError, SiteError

Rng = np.random.Generator
LONGEST = 10.0
"""Seconds of computing that any site may take, refused or not."""


@dataclass(frozen=True, slots=True)
class Outcome:
    """What became of one site."""

    seed: int
    kind: str
    said: str
    """The refusal, or what was mended; empty for a plan without any word."""
    refused: bool
    placed: bool
    """Whether the refusal has a place on the map."""
    seconds: float
    coverage: float | None = None


def bad_site(seed: int) -> tuple[str, Document]:
    """A kind of fault and a site that has it; now and then two of them."""
    rng = np.random.default_rng(seed)
    site = _good(rng)
    kinds = list(_FAULTS)
    kind = kinds[int(rng.integers(len(kinds)))]
    _FAULTS[kind](site, rng)
    if rng.random() < 0.15:
        _FAULTS[kinds[int(rng.integers(len(kinds)))]](site, rng)
    return kind, site


def outcome(seed: int) -> Outcome:
    """What the planner makes of one bad site.

    Raises:
        Exception: anything that is no refusal.
    """
    kind, site = bad_site(seed)
    radius = 0.6 if seed % 4 == 0 else 0.0
    began = time.process_time()
    try:
        plan = planned(site, radius)
    except (SiteError, PlanError) as error:
        placed = getattr(error, "where", None) is not None
        return Outcome(seed, kind, str(error), True, placed, time.process_time() - began)
    seconds = time.process_time() - began
    said = " ".join(plan["notes"])
    return Outcome(seed, kind, said, False, False, seconds, plan["predicted"]["coverage"])


def wrong_with(found: Outcome) -> str:
    """What must not be, in words; empty where all is as it should be."""
    if found.seconds > LONGEST:
        return f"took {found.seconds:.1f} s"
    if found.refused and ("\n" in found.said or len(found.said) < 20 or "Error" in found.said):
        return f"is refused in other than one clear line: {found.said!r}"
    if found.coverage is not None and not 0 <= found.coverage <= 1:
        return f"has a predicted coverage of {found.coverage}"
    return ""


def _good(rng: Rng) -> Document:
    wide, high = (round(float(v), 2) for v in rng.uniform(1.5, 7, 2))
    x, y = (round(float(v), 2) for v in rng.uniform(-20, 20, 2))
    ring = box(x, y, x + wide, y + high)
    if rng.random() < 0.4:
        ring = circle(x, y, min(wide, high) / 2, int(rng.integers(5, 30)))
    islands = []
    if rng.random() < 0.5:
        a, b = _inside(ring, rng)
        islands.append(circle(a, b, float(rng.uniform(0.05, 0.4)), int(rng.integers(3, 9))))
    walls = [[list(_inside(ring, rng)), list(_inside(ring, rng))]] if rng.random() < 0.4 else []
    return document(ring, islands, walls=walls)


def _inside(ring: Ring, rng: Rng) -> tuple[float, float]:
    """A place that is likely to be inside."""
    weights = rng.dirichlet(np.ones(len(ring)))
    x, y = weights @ np.array(ring)
    return round(float(x), 3), round(float(y), 3)


def _corner(site: Document, rng: Rng) -> int:
    return int(rng.integers(len(site["boundary"])))


def _crossing(site: Document, rng: Rng) -> None:
    ring = site["boundary"]
    a, b = rng.choice(len(ring), 2, replace=False)
    ring[a], ring[b] = ring[b], ring[a]


def _tangled(site: Document, rng: Rng) -> None:
    count = int(rng.choice([8, 40, 300, 2000]))
    site["boundary"] = np.round(rng.uniform(-5, 5, (count, 2)), 3).tolist()


def _flat(site: Document, rng: Rng) -> None:
    ring = np.array(site["boundary"])
    ring[:, int(rng.integers(2))] *= float(rng.choice([0.0, 1e-9, 1e-4, 0.05]))
    site["boundary"] = ring.tolist()


def _outside(site: Document, rng: Rng) -> None:
    key = str(rng.choice(["islands", "walls", "no_go"]))
    x, y = rng.uniform(30, 60, 2).round(2)
    site.setdefault(key, []).append([[x, y], [x + 1, y], [x + 1, y + 1]])


def _over_the_edge(site: Document, rng: Rng) -> None:
    x, y = site["boundary"][_corner(site, rng)]
    ring = circle(x, y, float(rng.uniform(0.05, 4)), int(rng.integers(3, 20)))
    site.setdefault(str(rng.choice(["islands", "no_go"])), []).append(ring)


def _overlapping(site: Document, rng: Rng) -> None:
    for _ in range(int(rng.integers(2, 12))):
        x, y = _inside(site["boundary"], rng)
        site["islands"].append(circle(x, y, float(rng.uniform(0.05, 0.6)), 7))
    if rng.random() < 0.3:
        site["islands"].append(site["islands"][0])


def _doubled(site: Document, rng: Rng) -> None:
    ring = site["boundary"]
    for _ in range(int(rng.integers(1, 6))):
        at = _corner(site, rng)
        x, y = ring[at]
        ring.insert(at, [x + float(rng.choice([0, 0, 1e-12, 1e-7])), y])
    ring.append(list(ring[0]))


def _not_finite(site: Document, rng: Rng) -> None:
    value = [math.nan, math.inf, -math.inf, 1e308][int(rng.integers(4))]
    key = str(rng.choice(["boundary", "walls", "start"]))
    if key == "start":
        site["start"] = [value, 0]
    elif key == "walls":
        site["walls"] = [[[0, value], [1, 1]]]
    else:
        site["boundary"][_corner(site, rng)][int(rng.integers(2))] = value


def _absurd(site: Document, rng: Rng) -> None:
    factor = float(10 ** rng.uniform(1, 9) if rng.random() < 0.7 else 10 ** rng.uniform(-9, -0.5))
    for key in ("boundary", "islands", "walls"):
        lines = [site[key]] if key == "boundary" else site.get(key, [])
        for line in lines:
            line[:] = [[x * factor, y * factor] for x, y in line]


def _stretched(site: Document, rng: Rng) -> None:
    factor = float(10 ** rng.uniform(1, 4.5))
    site["boundary"] = [[x * factor, y] for x, y in site["boundary"]]
    site["islands"] = []


def _touching(site: Document, rng: Rng) -> None:
    ring = site["boundary"]
    at = _corner(site, rng)
    (x0, y0), (x1, y1) = ring[at], ring[(at + 1) % len(ring)]
    ring.insert((at + 2) % len(ring) or 1, [(x0 + x1) / 2, (y0 + y1) / 2])


def _spike(site: Document, rng: Rng) -> None:
    ring = site["boundary"]
    at = _corner(site, rng)
    x, y = ring[at]
    out = [x + float(rng.uniform(-3, 3)), y + float(rng.uniform(-3, 3))]
    ring[at : at + 1] = [[x, y], out, [x, y]]


def _hair(site: Document, rng: Rng) -> None:
    """Corners that nearly touch the next wall."""
    ring = site["boundary"]
    at = _corner(site, rng)
    a, b, c = (np.array(ring[(at + i) % len(ring)]) for i in range(3))
    near = a + (c - a) * float(rng.uniform(0.2, 0.8)) + (b - a) * float(10 ** rng.uniform(-9, -2))
    ring[(at + 1) % len(ring)] = near.tolist()


def _type(site: Document, rng: Rng) -> None:
    key = str(rng.choice(["boundary", "islands", "walls", "no_go", "start", "routes", "name"]))
    values: list[Any] = [None, 7, "x", {}, [], [[]], [None], [[1]], [[1, 2, 3]], True, [{"a": 1}]]
    site[key] = values[int(rng.integers(len(values)))]


def _start(site: Document, rng: Rng) -> None:
    if rng.random() < 0.5:
        site["start"] = rng.uniform(-30, 30, 2).tolist()
        return
    x, y = site["boundary"][_corner(site, rng)]
    site["start"] = [x + float(rng.uniform(-0.3, 0.3)), y + float(rng.uniform(-0.3, 0.3))]


def _no_floor(site: Document, rng: Rng) -> None:
    key = str(rng.choice(["islands", "no_go"]))
    ring = np.array(site["boundary"])
    middle = ring.mean(axis=0)
    factor = float(rng.choice([1.0, 1.5, 0.999, 0.9]))
    site[key] = [(middle + (ring - middle) * factor).tolist()]


def _many(site: Document, rng: Rng) -> None:
    count = int(rng.choice([3_000, 10_000]))
    angles = np.arange(count) * math.tau / count
    radius = 3 + 0.3 * np.sin(9 * angles) + rng.normal(0, float(rng.choice([0, 1e-4, 3e-3])), count)
    ring = np.stack([radius * np.cos(angles), radius * np.sin(angles)], axis=1)
    if rng.random() < 0.5:
        ring[rng.integers(count, size=20)] = ring[rng.integers(count, size=20)]
    site.update(boundary=ring.tolist(), islands=[], walls=[])


def _geojson(site: Document, rng: Rng) -> None:
    rings = [site.pop("boundary"), *site.pop("islands", [])]
    if rng.random() < 0.6:
        rings[0] = [*rings[0], rings[0][0]]
    shape = str(rng.choice(["Polygon", "MultiPolygon", "LineString"], p=[0.7, 0.15, 0.15]))
    feature = {
        "type": "Feature",
        "properties": {"role": str(rng.choice(["boundary", "island", "moat"], p=[0.7, 0.2, 0.1]))},
        "geometry": {"type": shape, "coordinates": rings},
    }
    site.clear()
    site.update(type="FeatureCollection", features=[feature])


def _walls(site: Document, rng: Rng) -> None:
    lines = rng.uniform(-8, 8, (int(rng.integers(1, 40)), 2, 2)).round(2).tolist()
    site["walls"] = [*lines, [[0, 0], [0, 0]]] if rng.random() < 0.2 else lines


_FAULTS: dict[str, Callable[[Document, Rng], None]] = {
    "crosses itself": _crossing,
    "tangled": _tangled,
    "no area": _flat,
    "outside": _outside,
    "over the edge": _over_the_edge,
    "islands overlap": _overlapping,
    "points twice": _doubled,
    "not finite": _not_finite,
    "absurd size": _absurd,
    "stretched": _stretched,
    "touches itself": _touching,
    "spike": _spike,
    "hair": _hair,
    "wrong type": _type,
    "start": _start,
    "no floor": _no_floor,
    "many points": _many,
    "geojson": _geojson,
    "walls everywhere": _walls,
}


def _safe(fault: Callable[[Document, Rng], None]) -> Callable[[Document, Rng], None]:
    """A second fault may find a site that is past spoiling."""

    def spoil(site: Document, rng: Rng) -> None:
        try:
            fault(site, rng)
        except (TypeError, ValueError, KeyError, IndexError, AttributeError):
            return

    return spoil


_FAULTS = {kind: _safe(fault) for kind, fault in _FAULTS.items()}


def main() -> None:
    """Tries sites by their seeds and prints what became of them, by kind."""
    parser = argparse.ArgumentParser(prog="python -m plans.fuzz", description=__doc__)
    parser.add_argument("--count", type=int, default=2000)
    parser.add_argument("--first", type=int, default=0)
    options = parser.parse_args()
    refused: Counter[str] = Counter()
    tried: Counter[str] = Counter()
    slowest = (0.0, -1)
    for seed in range(options.first, options.first + options.count):
        try:
            found = outcome(seed)
        except Exception as error:  # noqa: BLE001 - what it is here to find
            sys.stdout.write(f"seed {seed}: {type(error).__name__}: {error}\n")
            continue
        tried[found.kind] += 1
        refused[found.kind] += found.refused
        slowest = max(slowest, (found.seconds, seed))
        if words := wrong_with(found):
            sys.stdout.write(f"seed {seed} ({found.kind}) {words}\n")
    for kind, count in sorted(tried.items()):
        sys.stdout.write(f"{kind:18} {count:5} sites, {refused[kind]:5} refused\n")
    sys.stdout.write(f"slowest: {slowest[0]:.1f} s, seed {slowest[1]}\n")


if __name__ == "__main__":
    main()
