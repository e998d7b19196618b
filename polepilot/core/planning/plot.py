"""A plan as a drawing (SVG), in the manner of the paper's Fig. 13.

Loops are solid, bridges (a, b) and links between groups (ab) dashed; groups carry their letters,
where there is room for them also their loops: A1, A2. The loops of groups that cannot be reached
are dotted in the colour of what cannot be reached.
"""

from __future__ import annotations

import math
from html import escape

import numpy as np
import shapely
from numpy.typing import NDArray

from polepilot.core.geometry import Point
from polepilot.core.plan import Plan, PlanPart
from polepilot.core.planning.groups import Group, groups_of
from polepilot.core.site import Site

_INK, _COVERED, _BLOCKED, _MARK, _TARGET = "#1B1F23", "#56B4E9", "#D55E00", "#E69F00", "#009E73"
_WIDTH = 1000.0
_ARROWS_EVERY = 2.0
_MOST_LABELS = 12
"""With more bridges and links than this their letters would hide the drawing."""
_MOST_LOOPS = 4
_LARGEST_LETTER = 46.0


def plot_svg(site: Site, plan: Plan) -> str:
    """The site with the plan's path, what it covers and what cannot be reached, as SVG text."""
    xs = [x for x, _ in site.boundary]
    ys = [y for _, y in site.boundary]
    margin = 0.05 * max(max(xs) - min(xs), max(ys) - min(ys))
    x0, y1 = min(xs) - margin, max(ys) + margin
    width, height = max(xs) + margin - x0, y1 - min(ys) + margin
    scale = _WIDTH / width
    # One unit of the drawing is one pixel; up in `map` is up in the drawing.
    sheet = _Sheet(x0, y1, scale)
    line = max(1.0, min(2.5, 0.012 * scale))
    body = [
        f'<rect width="{_WIDTH:.0f}" height="{height * scale:.0f}" fill="#FFFFFF"/>',
        f'<path d="{sheet.ring(site.boundary)}" fill="none" stroke="{_INK}"'
        f' stroke-width="{2 * line:.2f}"/>',
    ]
    if plan.mode == "scan":
        body.append(
            f'<path d="{sheet.line(plan.path)}" fill="none" stroke="{_COVERED}"'
            f' stroke-opacity="0.25" stroke-width="{plan.tool_width * scale:.2f}"'
            ' stroke-linecap="round" stroke-linejoin="round"/>'
        )
    body += [
        f'<path d="{sheet.ring(piece.polygon)}" fill="url(#hatch)" stroke="{_BLOCKED}"'
        f' stroke-width="{line:.2f}"><title>{escape(piece.reason)}</title></path>'
        for piece in plan.unreachable
    ]
    body += [
        f'<path d="{sheet.ring(ring)}" fill="#D0D4D8" stroke="{_INK}"'
        f' stroke-width="{2 * line:.2f}"/>'
        for ring in site.islands
    ]
    body += [
        f'<path d="{sheet.line(np.array(wall))}" fill="none" stroke="{_INK}"'
        f' stroke-width="{2 * line:.2f}"/>'
        for wall in site.walls
    ]
    body += [
        f'<path d="{sheet.ring(ring)}" fill="url(#hatch)" fill-opacity="0.6" stroke="{_BLOCKED}"'
        f' stroke-width="{2 * line:.2f}" stroke-dasharray="{4 * line:.1f} {2 * line:.1f}">'
        "<title>no-go area</title></path>"
        for ring in site.no_go
    ]
    groups = groups_of(site, plan) if plan.mode == "scan" else ()
    body += _unreached(groups, sheet, line)
    body += _path(plan, sheet, line)
    body += _letters(groups, sheet, plan.tool_width * scale)
    body += _connections(groups, plan, sheet, plan.tool_width * scale)
    body += _marks(site, plan, sheet, scale)
    text = "\n".join(body)
    return (
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {_WIDTH:.0f}'
        f' {height * scale:.0f}" font-family="system-ui, sans-serif" font-size="14">\n'
        f"<title>{escape(site.name or 'Site')}: {plan.mode}</title>\n"
        '<defs><pattern id="hatch" width="8" height="8" patternUnits="userSpaceOnUse"'
        f' patternTransform="rotate(45)"><path d="M0 0V8" stroke="{_BLOCKED}" stroke-width="3"/>'
        "</pattern></defs>\n"
        f"{text}\n</svg>\n"
    )


class _Sheet:
    """From `map` to the drawing."""

    def __init__(self, x0: float, y1: float, scale: float) -> None:
        self._x0, self._y1, self._scale = x0, y1, scale

    def at(self, point: Point | NDArray[np.float64]) -> Point:
        return (
            (float(point[0]) - self._x0) * self._scale,
            (self._y1 - float(point[1])) * self._scale,
        )

    def line(self, points: NDArray[np.float64]) -> str:
        return "M" + "L".join("{:.1f} {:.1f}".format(*self.at(point)) for point in points)

    def ring(self, points: tuple[Point, ...]) -> str:
        return self.line(np.array(points)) + "Z"


def _path(plan: Plan, sheet: _Sheet, line: float) -> list[str]:
    """Loops solid, bridges and links dashed, reverse dotted, with arrows every two metres."""
    drawn: list[str] = []
    for part in plan.parts:
        index = part.first
        while index < part.last:
            gear = plan.gear[index]
            end = index
            while end < part.last and plan.gear[end] == gear:
                end += 1
            dash = ""
            if gear < 0:
                dash = f' stroke-dasharray="{line:.1f} {2.5 * line:.1f}"'
            elif part.kind in ("bridge", "link"):
                dash = f' stroke-dasharray="{6 * line:.1f} {3 * line:.1f}"'
            color = _TARGET if part.kind == "cleanup" else _INK
            drawn.append(
                f'<path d="{sheet.line(plan.path[index : end + 1])}" fill="none" stroke="{color}"'
                f' stroke-opacity="0.6" stroke-width="{line:.2f}"{dash}/>'
            )
            index = end
    marks = np.r_[0.0, np.cumsum(np.hypot(*np.diff(plan.path, axis=0).T))]
    for distance in np.arange(_ARROWS_EVERY / 2, marks[-1], max(_ARROWS_EVERY, marks[-1] / 500)):
        index = int(np.clip(np.searchsorted(marks, distance) - 1, 0, len(plan.gear) - 1))
        a, b = plan.path[index], plan.path[index + 1]
        share = (distance - marks[index]) / max(marks[index + 1] - marks[index], 1e-9)
        x, y = sheet.at(a + share * (b - a))
        angle = -math.degrees(math.atan2(b[1] - a[1], b[0] - a[0]))
        size = 3 * line
        drawn.append(
            f'<path d="M{-size:.1f} {-size:.1f}L{size:.1f} 0L{-size:.1f} {size:.1f}" fill="none"'
            f' stroke="{_INK}" stroke-width="{line:.2f}"'
            f' transform="translate({x:.1f} {y:.1f}) rotate({angle:.0f})"/>'
        )
    return drawn


def _unreached(groups: tuple[Group, ...], sheet: _Sheet, line: float) -> list[str]:
    """The loops of groups that the robot does not get to, dotted."""
    return [
        f'<path d="{sheet.line(shapely.get_coordinates(ring))}" fill="none" stroke="{_BLOCKED}"'
        f' stroke-width="{line:.2f}" stroke-dasharray="{line:.1f} {3 * line:.1f}"/>'
        for group in groups
        if not group.reached
        for loop in group.loops
        for ring in shapely.get_parts(loop).tolist()
    ]


def _letters(groups: tuple[Group, ...], sheet: _Sheet, tool: float) -> list[str]:
    """``A`` in the middle of a group; ``A1``, ``A2`` on its loops where they are few."""
    drawn: list[str] = []
    for group in groups:
        color = _INK if group.reached else _BLOCKED
        middle = group.region.representative_point()
        if len(group.loops) > 1:
            middle = shapely.get_point(shapely.maximum_inscribed_circle(group.region, 0.05), 0)
        size = min(_LARGEST_LETTER, max(11.0, 0.6 * tool))
        drawn.append(_words(sheet.at((middle.x, middle.y)), group.name, size, color))
        if not 1 < len(group.loops) <= _MOST_LOOPS or 0.3 * tool < 9:
            continue
        x0, _, x1, y1 = group.region.bounds
        ray = shapely.LineString([(middle.x, middle.y), ((x0 + middle.x) / 2 - (x1 - x0), y1 + 1)])
        for number, loop in enumerate(group.loops, start=1):
            places = shapely.get_coordinates(ray.intersection(loop))
            if len(places):
                spot = (float(places[0, 0]), float(places[0, 1]))
                name = f"{group.name}{number}"
                drawn.append(_words(sheet.at(spot), name, min(20.0, 0.3 * tool), color))
    return drawn


def _connections(groups: tuple[Group, ...], plan: Plan, sheet: _Sheet, tool: float) -> list[str]:
    """``a`` at a bridge inside A, ``ab`` at a link from A to B."""
    joints = [part for part in plan.parts if part.kind in ("bridge", "link")]
    if len(joints) > _MOST_LABELS or 0.3 * tool < 9:
        return []
    drawn: list[str] = []
    for index, part in enumerate(plan.parts):
        if part not in joints or index in (0, len(plan.parts) - 1):
            continue
        near = [_group_of(groups, plan, plan.parts[other]) for other in (index - 1, index + 1)]
        name = near[0] if near[0] == near[1] else "".join(near)
        middle = plan.path[(part.first + part.last) // 2 : (part.first + part.last) // 2 + 2]
        x, y = sheet.at(middle.mean(axis=0))
        size = min(18.0, 0.28 * tool)
        drawn.append(_words((x, y - 0.6 * size), name.lower(), size, _TARGET))
    return drawn


def _group_of(groups: tuple[Group, ...], plan: Plan, part: PlanPart) -> str:
    """The group in which most of a part's points lie; empty where there is none."""
    points = [tuple(spot) for spot in plan.path[part.first : part.last + 1]]
    inside = [(sum(map(group.holds, points)), group.name) for group in groups]
    count, name = max(inside, default=(0, ""), key=lambda entry: entry[0])
    return name if count else ""


def _words(at: Point, words: str, size: float, color: str) -> str:
    """Letters in the middle of a place, with a white rim that keeps them legible."""
    return (
        f'<text x="{at[0]:.1f}" y="{at[1] + 0.35 * size:.1f}" font-size="{size:.1f}"'
        f' font-weight="600" text-anchor="middle" fill="{color}" stroke="#FFFFFF"'
        f' stroke-width="{0.2 * size:.1f}" paint-order="stroke">{escape(words)}</text>'
    )


def _marks(site: Site, plan: Plan, sheet: _Sheet, scale: float) -> list[str]:
    drawn: list[str] = []
    for mark in site.landmarks:
        x, y = sheet.at(mark.position)
        radius = max(5.0, mark.kind.diameter / 2 * scale)
        drawn.append(
            f'<circle cx="{x:.1f}" cy="{y:.1f}" r="{radius:.1f}" fill="{_MARK}" stroke="{_INK}"'
            f' stroke-width="2"/><text x="{x + radius + 3:.1f}" y="{y - radius:.1f}">{mark.id}'
            "</text>"
        )
    for number, node in enumerate(plan.nodes, start=1):
        x, y = sheet.at(node)
        drawn.append(
            f'<path d="M{x - 6:.1f} {y:.1f}h12M{x:.1f} {y - 6:.1f}v12" stroke="{_TARGET}"'
            f' stroke-width="3"/><text x="{x + 8:.1f}" y="{y - 8:.1f}">{number}</text>'
        )
    x, y = sheet.at(plan.path[0])
    drawn.append(
        f'<circle cx="{x:.1f}" cy="{y:.1f}" r="6" fill="none" stroke="{_INK}" stroke-width="2"/>'
    )
    return drawn
