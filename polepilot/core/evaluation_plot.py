"""A run as the paper's Fig. 15 draws it, with the errors over time below."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from polepilot.core.chart import ESTIMATED, INK, MEASURED, SERIES, SOFT, TARGET, Chart, Field
from polepilot.core.evaluation import Comparison
from polepilot.core.geometry import Point
from polepilot.core.trajectory import Array, Trajectory

_WIDTH, _LEFT, _RIGHT = 860.0, 56.0, 16.0
_MAP, _STRIP, _BETWEEN = 460.0, 120.0, 58.0
_MOST_DOTS = 1500
"""More dots of one kind than this are thinned: they would lie on each other."""
_TARGET_STEP = 0.25
"""A tracker's target moves along its path: crosses at least so far apart, metres."""
_MEASURED = "measured"


def draw(
    title: str,
    truth: Trajectory,
    tracks: Mapping[str, Trajectory],
    comparisons: Mapping[str, Comparison],
    targets: Array,
    landmarks: Sequence[tuple[int, Point]] = (),
) -> Chart:
    """The four kinds of points on a map, then position and heading errors over time.

    ``tracks`` and ``comparisons`` go by the same names; one called ``measured`` is drawn as dots.
    Where errors of ``measured`` are many times the others', the scale follows the others.
    """
    height = 46 + _MAP + 2 * (_STRIP + _BETWEEN) + 26
    chart = Chart(_WIDTH, height, title)
    places = [truth.poses[:, :2], targets, np.array([p for _, p in landmarks]).reshape(-1, 2)]
    first = next(iter(tracks))
    places.append(tracks[first].poses[:, :2])
    field = Field.to_scale(chart, _LEFT, 40, _WIDTH - _LEFT - _RIGHT, _MAP, np.concatenate(places))
    field.frame("x, m", "y, m")
    colors = _colors(tracks)
    for number, place in landmarks:
        ((x, y),) = field.at(np.array([place]))
        chart.dot(x, y, INK, 3.5)
        chart.text(x + 6, y - 5, str(number), SOFT, 11)
    for x, y in field.at(_spread(targets)):
        chart.cross(x, y, TARGET)
    if _MEASURED in tracks:
        for x, y in field.at(_inside(field, _thinned(tracks[_MEASURED].poses[:, :2]))):
            chart.dot(x, y, MEASURED)
    for piece in _pieces(field, truth):
        field.line(piece, INK, 3.2)
    for name, track in tracks.items():
        if name != _MEASURED:
            for piece in _pieces(field, track):
                field.line(piece, colors[name], 1.3, dashed=name != first)
    _legend(chart, colors, len(targets) > 0)
    _strips(chart, comparisons, colors, 40 + _MAP + _BETWEEN)
    return chart


def _strips(
    chart: Chart, comparisons: Mapping[str, Comparison], colors: Mapping[str, str], top: float
) -> None:
    begin = min(float(one.stamps[0]) for one in comparisons.values())
    end = max(float(one.stamps[-1]) for one in comparisons.values())
    span = (begin, max(end, begin + 1e-3))
    errors = {
        "position error, cm": {n: 100 * c.distances for n, c in comparisons.items()},
        "heading error, deg": {
            n: np.degrees(np.abs(c.offsets[:, 2])) for n, c in comparisons.items()
        },
    }
    for index, (what, lines) in enumerate(errors.items()):
        size = (_WIDTH - _LEFT - _RIGHT, _STRIP)
        judged = [v for n, v in lines.items() if n != _MEASURED] or list(lines.values())
        highest = max(float(values.max()) for values in judged)
        shown = [float(np.percentile(v, 95)) for n, v in lines.items() if n == _MEASURED]
        highest = max([highest, *(min(3 * highest, value) for value in shown)])
        place = (_LEFT, top + index * (_STRIP + _BETWEEN))
        field = Field(chart, *place, *size, span, (0.0, 1.05 * max(highest, 1e-3)))
        field.frame("time, s", what)
        for name in sorted(lines, key=lambda n: n != _MEASURED):
            rows = np.stack([comparisons[name].stamps, lines[name]], axis=1)
            if name == _MEASURED:
                for x, y in field.at(_inside(field, _thinned(rows))):
                    chart.dot(x, y, MEASURED, 1.2)
                continue
            for piece in np.split(rows, np.flatnonzero(np.diff(rows[:, 0]) > 1.0) + 1):
                field.line(_peaks(piece), colors[name])


def _legend(chart: Chart, colors: Mapping[str, str], targets: bool) -> None:
    x = _LEFT
    chart.line(np.array([(x, 18), (x + 18, 18)]), INK, 3.2)
    chart.text(x + 24, 22, "real")
    x += 74
    if targets:
        chart.cross(x + 9, 18, TARGET)
        chart.text(x + 18, 22, "target")
        x += 78
    for name, color in colors.items():
        if name == _MEASURED:
            for step in (3, 9, 15):
                chart.dot(x + step, 18, color)
        else:
            line = np.array([(x, 18), (x + 18, 18)])
            chart.line(line, color, 1.3, dashed=name != next(iter(colors)))
        chart.text(x + 24, 22, name)
        x += 40 + 7 * len(name)


def _colors(tracks: Mapping[str, Trajectory]) -> dict[str, str]:
    others = iter(SERIES[1:] * len(tracks))
    first = next(iter(tracks))
    return {
        name: MEASURED if name == _MEASURED else ESTIMATED if name == first else next(others)
        for name in tracks
    }


def _pieces(field: Field, track: Trajectory) -> list[Array]:
    """Where a pose was lost or jumped, a line would claim what was never estimated."""
    places = track.poses[:, :2]
    broken = (np.diff(track.stamps) > 1.0) | (np.hypot(*np.diff(places, axis=0).T) > 0.5)
    seen = _seen(field, places)
    broken |= seen[1:] != seen[:-1]
    pieces = np.split(np.arange(len(places)), np.flatnonzero(broken) + 1)
    return [_thinned(places[piece]) for piece in pieces if seen[piece[0]]]


def _thinned(rows: Array) -> Array:
    return np.asarray(rows[:: max(1, math.ceil(len(rows) / _MOST_DOTS))])


def _peaks(rows: Array) -> Array:
    """Thinned so that the highest value of each stretch stays."""
    size = math.ceil(len(rows) / _MOST_DOTS)
    if size < 2:
        return rows
    return np.array(
        [part[np.argmax(part[:, 1])] for part in np.array_split(rows, len(rows) // size)]
    )


def _spread(targets: Array) -> Array:
    kept: list[Array] = []
    for place in targets:
        if not kept or float(np.hypot(*(place - kept[-1]))) >= _TARGET_STEP:
            kept.append(place)
    return np.array(kept).reshape(-1, 2)


def _inside(field: Field, rows: Array) -> Array:
    return np.asarray(rows[_seen(field, rows)])


def _seen(field: Field, rows: Array) -> NDArray[np.bool_]:
    """Which of the data lie inside the borders."""
    good = (rows[:, 0] >= field.x[0]) & (rows[:, 0] <= field.x[1])
    return np.asarray(good & (rows[:, 1] >= field.y[0]) & (rows[:, 1] <= field.y[1]))
