"""A precision map as a drawing: colours by error, hatching where there is no fix, a legend."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from itertools import pairwise

import cv2
import numpy as np
import shapely
from numpy.typing import NDArray

from polepilot.core.errors import InternalError
from polepilot.core.geometry import Point
from polepilot.core.localization.precision_grid import CLASSES, PrecisionMap
from polepilot.core.localization.precision_suggest import Suggestions
from polepilot.core.printing.drawing import BLACK, WHITE, Box, Ink, Item, Shape, Sheet, Stroke, Text
from polepilot.core.site import Site

HEAT = ("#fee838", "#e1cc55", "#bcae6c", "#958f78", "#70727a", "#45526c", "#0c2a55")
"""From sharp to vague: light to dark and yellow to blue, which colour-blind people tell apart."""
_LANDMARK, _SUGGESTED, _SOLID, _HATCH = (
    Ink("#E69F00"),
    Ink("#009E73"),
    Ink("#D0D4D8"),
    Ink("#55606b"),
)
_WIDTH = 200.0
_MARGIN = 8.0
_LEGEND = 24.0
_PIXELS = 8
"""Of a PNG, per millimetre of the drawing."""
_SHIFT = 4
"""Binary digits after the point of a pixel position."""


def labels(limit: float) -> list[str]:
    """What each colour stands for, in centimetres; ``limit`` is the vaguest fix, metres."""
    edges = [f"{100 * edge:g}" for edge in (*CLASSES, limit)]
    between = [f"{low}-{high}" for low, high in pairwise(edges)]
    return [f"< {edges[0]}", *between]


def draw(site: Site, found: PrecisionMap, more: Suggestions | None = None) -> Sheet:
    """The map on one sheet 200 mm wide, with suggested landmarks numbered."""
    floor = site.floor()
    x0, y0, x1, y1 = floor.bounds
    scale = (_WIDTH - 2 * _MARGIN) / max(x1 - x0, 1e-9)
    height = (y1 - y0) * scale + 2 * _MARGIN + _LEGEND

    def at(x: float, y: float) -> Point:
        return (_MARGIN + (x - x0) * scale, _MARGIN + (y1 - y) * scale)

    def path(points: Iterable[Sequence[float]]) -> tuple[Point, ...]:
        return tuple(at(point[0], point[1]) for point in points)

    items: list[Item] = [
        Shape(path(area.exterior.coords[:-1]), Ink(HEAT[color]))
        for color, area in _areas(found, floor)
    ]
    items += [Stroke(path(line), _HATCH, 0.35) for line in _hatching(found, floor)]
    items += [Shape(path(ring), _SOLID) for ring in site.islands]
    items += [Stroke(path([*ring, ring[0]]), BLACK, 0.6) for ring in (*site.islands, site.boundary)]
    items += [Stroke(path(wall), BLACK, 0.8) for wall in site.walls]
    for mark in site.landmarks:
        items += _pole(at(mark.x, mark.y), _LANDMARK, str(mark.id))
    for number, one in enumerate(more.chosen if more else (), start=1):
        place = at(one.landmark.x, one.landmark.y)
        items += _pole(place, _SUGGESTED, f"+{number}")
    items += _legend(found, height)
    return Sheet(_WIDTH, height, f"Precision of {site.name or 'the site'}", tuple(items))


def png_bytes(sheet: Sheet) -> bytes:
    """The drawing as a PNG file."""
    size = (math.ceil(sheet.height * _PIXELS), math.ceil(sheet.width * _PIXELS), 3)
    image = np.full(size, 255, np.uint8)
    for item in sheet.items:
        match item:
            case Box(x, y, width, height, ink):
                corners = ((x, y), (x + width, y), (x + width, y + height), (x, y + height))
                cv2.fillPoly(image, [_pixels(corners)], _bgr(ink), cv2.LINE_AA, _SHIFT)
            case Shape(points, ink):
                cv2.fillPoly(image, [_pixels(points)], _bgr(ink), cv2.LINE_AA, _SHIFT)
            case Stroke(points, ink, width):
                thick = max(1, round(width * _PIXELS))
                cv2.polylines(
                    image, [_pixels(points)], False, _bgr(ink), thick, cv2.LINE_AA, _SHIFT
                )
            case Text():
                _write(image, item)
    done, data = cv2.imencode(".png", image)
    if not done:
        raise InternalError("the picture could not be made.")
    return data.tobytes()


def _pixels(points: Sequence[Point]) -> NDArray[np.int32]:
    places: NDArray[np.int32] = np.round(np.array(points) * (_PIXELS * 2**_SHIFT)).astype(np.int32)
    return places


def _bgr(ink: Ink) -> tuple[float, float, float]:
    red, green, blue = ink.channels
    return (255 * blue, 255 * green, 255 * red)


def _write(image: NDArray[np.uint8], text: Text) -> None:
    font, thick = cv2.FONT_HERSHEY_SIMPLEX, 2 if text.bold else 1
    size = cv2.getFontScaleFromHeight(font, round(0.72 * text.size * _PIXELS), thick)
    words = text.words.encode("ascii", "replace").decode()
    width = cv2.getTextSize(words, font, size, thick)[0][0]
    left = {"start": 0.0, "middle": 0.5, "end": 1.0}[text.anchor] * width
    place = (round(text.x * _PIXELS - left), round(text.y * _PIXELS))
    cv2.putText(image, words, place, font, size, _bgr(text.ink), thick, cv2.LINE_AA)


def _areas(found: PrecisionMap, floor: shapely.Geometry) -> list[tuple[int, shapely.Polygon]]:
    """Runs of cells of one colour, cut off at the walls."""
    step = found.resolution
    colors = np.where(found.fixed, np.searchsorted(CLASSES, np.nan_to_num(found.position)), -1)
    boxes, chosen = [], []
    for row, line in enumerate(colors):
        starts = np.flatnonzero(np.diff(line, prepend=-2))
        for start, end in zip(starts, [*starts[1:], len(line)], strict=True):
            if line[start] >= 0:
                left, low = found.x + (start - 0.5) * step, found.y + (row - 0.5) * step
                boxes.append(shapely.box(left, low, left + (end - start) * step, low + step))
                chosen.append(int(line[start]))
    cut = shapely.intersection(np.array(boxes, dtype=object), floor)
    parts, numbers = shapely.get_parts(cut, return_index=True)
    return [
        (chosen[number], part)
        for part, number in zip(parts, numbers, strict=True)
        if isinstance(part, shapely.Polygon)
    ]


def _hatching(found: PrecisionMap, floor: shapely.Geometry) -> list[list[Point]]:
    """Slanted lines over the cells without a fix; half as many where most headings have none."""
    half = 0.5 * found.resolution
    blind = found.floor & ~found.fixed
    mostly = found.fixed & (found.share < 0.5)
    lines = []
    for row, column in np.argwhere(blind | mostly):
        x, y = found.x + column * found.resolution, found.y + row * found.resolution
        lines.append(((x - half, y - half), (x + half, y + half)))
        if blind[row, column]:
            lines += [((x - half, y), (x, y + half)), ((x, y - half), (x + half, y))]
    if not lines:
        return []
    parts = shapely.get_parts(shapely.intersection(shapely.linestrings(lines), floor))
    return [list(part.coords) for part in parts if isinstance(part, shapely.LineString)]


def _pole(at: Point, ink: Ink, name: str) -> list[Item]:
    x, y = at
    turn = np.linspace(0.0, math.tau, 24, endpoint=False)

    def ring(radius: float) -> tuple[Point, ...]:
        return tuple((x + radius * math.cos(t), y + radius * math.sin(t)) for t in turn)

    return [
        Shape(ring(1.9), WHITE),
        Shape(ring(1.7), BLACK),
        Shape(ring(1.2), ink),
        Text(x + 2.2, y - 1.6, name, 3.6, bold=True),
    ]


def _legend(found: PrecisionMap, height: float) -> list[Item]:
    names = labels(found.limit)
    width = (_WIDTH - 2 * _MARGIN) / (len(names) + 2)
    top = height - _LEGEND
    mean = found.mean_position
    figure = "no fix anywhere" if mean is None else f"{100 * mean:.1f} cm on average"
    title = f"Expected error of the position, 1 sigma, in cm: {figure}"
    items: list[Item] = [Text(_MARGIN, top, title, 4.0, bold=True)]
    for number, (name, color) in enumerate(zip(names, HEAT, strict=True)):
        x = _MARGIN + number * width
        items.append(Box(x, top + 3, width - 1, 5, Ink(color)))
        items.append(Text(x + 0.5 * (width - 1), top + 12.5, name, 3.6, "middle"))
    x = _MARGIN + len(names) * width
    edge = ((x, top + 3), (x + 2 * width, top + 3), (x + 2 * width, top + 8), (x, top + 8))
    items.append(Stroke((*edge, edge[0]), _HATCH, 0.35))
    items += [
        Stroke(((left - 5, top + 8), (left, top + 3)), _HATCH, 0.35)
        for left in np.arange(x + 5, x + 2 * width, 4.0).tolist()
    ]
    items.append(Text(x + width, top + 12.5, "no fix here", 3.6, "middle"))
    if np.any(found.fixed & (found.share < 0.5)):
        note = "Single lines: no fix in most of the directions that the robot may look."
        items.append(Text(_MARGIN, top + 18, note, 3.2))
    return items
