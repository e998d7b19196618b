"""A survey as a drawing: poles with their uncertainty, where they were measured, and the path."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from polepilot.core.chart import ESTIMATED, FAINT, INK, MEASURED, SOFT, Chart, Field
from polepilot.core.localization.survey_result import Survey, SurveyedPole
from polepilot.core.site import Site

Array = NDArray[np.float64]

_WIDTH, _MARGIN, _FOOT = 900.0, 56.0, 64.0
_WRONG = "#d55e00"
_INSIDE = math.sqrt(5.991)
"""An ellipse of so many sigmas holds 95 % of a plane normal distribution."""
_SHOWN = 0.025
"""The largest ellipse becomes about this share of the drawing, by a round factor."""


def plot_survey(survey: Survey, site: Site | None = None) -> Chart:
    """Draw a survey; ``site``, if its coordinates are the survey's, behind it."""
    places = np.array([pole.position for pole in survey.poles])
    path = np.array([pose.position for _, pose in survey.path]).reshape(-1, 2)
    points = [places, path]
    if site is not None:
        points.append(np.array(site.boundary))
    everything = np.concatenate(points)
    low, high = everything.min(axis=0) - 0.4, everything.max(axis=0) + 0.4
    span = high - low
    inner = _WIDTH - 2 * _MARGIN
    height = float(np.clip(inner * span[1] / span[0], 200.0, 1200.0))
    chart = Chart(_WIDTH, height + _MARGIN + _FOOT, f"Survey: {len(survey.poles)} poles")
    sheet = Field.to_scale(chart, _MARGIN, _MARGIN / 2, inner, height, np.array([low, high]))
    sheet.frame("x, m", "y, m")
    if site is not None:
        _draw_site(sheet, site)
    for stretch in _stretches(path):
        sheet.line(stretch, ESTIMATED, 1.4)
    factor = _factor(survey, float(span.max()))
    for pole in survey.poles:
        _draw_pole(chart, sheet, pole, factor)
    enlarged = f", drawn {factor} times as large" if factor > 1 else ""
    measured = any(pole.measured is not None for pole in survey.poles)
    rings = " Rings: where poles were measured." if measured else ""
    chart.text(
        _MARGIN,
        height + _MARGIN / 2 + 46,
        f"Ellipses hold a pole with 95 %{enlarged}. Blue: the path of the robot." + rings,
        SOFT,
        12,
    )
    return chart


def ellipse(pole: SurveyedPole, factor: float = 1.0, count: int = 49) -> Array:
    """The closed outline (``count`` x 2, metres) that holds the pole with 95 %."""
    root = np.linalg.cholesky(pole.covariance + 1e-12 * np.eye(2))
    angle = np.linspace(0.0, math.tau, count)
    circle = np.stack([np.cos(angle), np.sin(angle)])
    outline: Array = (factor * _INSIDE * root @ circle).T + np.array(pole.position)
    return outline


def _draw_site(sheet: Field, site: Site) -> None:
    for ring in (site.boundary, *site.islands):
        sheet.line(np.array([*ring, ring[0]]), FAINT, 3.0)
    for wall in site.walls:
        sheet.line(np.array(wall), FAINT, 3.0)


def _draw_pole(chart: Chart, sheet: Field, pole: SurveyedPole, factor: int) -> None:
    color = _WRONG if pole.wrong else INK
    sheet.line(ellipse(pole, factor), color, 1.2)
    x, y = sheet.at(np.array(pole.position))[0].tolist()
    if pole.measured is not None:
        there_x, there_y = sheet.at(np.array(pole.measured))[0].tolist()
        chart.dot(there_x, there_y, MEASURED, 5.0, hollow=True)
        if pole.wrong:
            chart.line(np.array([(there_x, there_y), (x, y)]), _WRONG, 1.6, dashed=True)
    chart.dot(x, y, color, 3.0)
    chart.text(x + 12, y - 12, str(pole.id), color, 13)


def _stretches(path: Array) -> list[Array]:
    """The path, cut where the robot was taken elsewhere."""
    if len(path) < 2:
        return []
    jumps = np.flatnonzero(np.hypot(*np.diff(path, axis=0).T) > 0.5) + 1
    return [stretch for stretch in np.split(path, jumps) if len(stretch) > 1]


def _factor(survey: Survey, span: float) -> int:
    """1, 2, 5, 10, ...: how much ellipses are enlarged to be seen."""
    largest = _INSIDE * max(pole.sigma for pole in survey.poles)
    wanted = _SHOWN * span / max(largest, 1e-6)
    steps = [factor for factor in (1, 2, 5, 10, 20, 50, 100) if factor <= wanted]
    return steps[-1] if steps else 1
