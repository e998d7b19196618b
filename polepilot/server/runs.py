"""What a screen and the store ask of a run's log (`core/robot/log.py` reads the file)."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
from shapely import MultiPolygon

from polepilot.core.plan import Plan
from polepilot.core.robot.log import read_messages

MOST_MOMENTS = 5000
"""More positions than this are not sent to a screen."""
MOST_EVENTS = 5000
_JUMP = 0.5
"""A pose that moves farther than this between two ticks was corrected, not driven; metres."""


def read_track(path: Path) -> dict[str, Any]:
    """The positions of a run (schemas.Track); empty where there is no log."""
    count = sum(channel == "snapshot" for channel, _, _ in read_messages(path))
    stride = max(1, -(-count // MOST_MOMENTS))
    track: dict[str, list[Any]] = {
        key: [] for key in ("t", "real", "estimated", "measured", "target", "events")
    }
    last_measured = -1.0
    number = 0
    for channel, _, data in read_messages(path):
        if channel == "event" and len(track["events"]) < MOST_EVENTS:
            event = json.loads(data)
            track["events"].append({key: event[key] for key in ("t", "code", "level", "text")})
        if channel != "snapshot":
            continue
        number += 1
        # The newest one is always among them, so that a track ends where the run did.
        if (count - number) % stride or number > count:
            continue
        moment = json.loads(data)
        track["t"].append(moment["t"])
        for key in ("real", "estimated", "target"):
            track[key].append(moment[key])
        measured = moment["measured"]
        if measured is not None and measured[0] > last_measured:
            last_measured = measured[0]
            track["measured"].append(measured[:3])
    return track


def missed_area(path: Path, plan: Plan) -> MultiPolygon:
    """What a run that ended without a word had not swept, by the positions in its log."""
    if plan.area.is_empty:
        return MultiPolygon()
    from polepilot.core.planning.swept import SweptArea

    swept = SweptArea(plan.area, plan.tool_width)
    last: tuple[float, float] | None = None
    for channel, _, data in read_messages(path):
        if channel != "snapshot":
            continue
        moment = json.loads(data)
        estimated = moment["estimated"]
        if estimated is None or moment["state"] != "running":
            last = None
            continue
        here = (float(estimated[0]), float(estimated[1]))
        if last is not None and float(np.hypot(here[0] - last[0], here[1] - last[1])) < _JUMP:
            swept.sweep(last, here)
        last = here
    return swept.missed()


def travelled(path: Path) -> tuple[float, float]:
    """Metres and seconds that a log covers."""
    track = read_track(path)
    places = np.array([p[:2] for p in track["estimated"] if p is not None], dtype=np.float64)
    if len(places) < 2:
        return 0.0, 0.0
    steps = np.hypot(*np.diff(places, axis=0).T)
    return float(steps[steps < _JUMP].sum()), float(track["t"][-1] - track["t"][0])
