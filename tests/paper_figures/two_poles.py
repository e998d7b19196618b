"""The two-landmark fix: both intersections, which one the bearings choose, and the misprints."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from polepilot.core.chart import ESTIMATED, FAINT, INK, MEASURED, SERIES, SOFT, Chart, Field
from polepilot.core.geometry import Point, Pose2D, wrap_angle
from polepilot.core.landmark import Landmark
from polepilot.core.localization.fix import Fix, FixSettings, circle_intersections, two_landmark_fix
from polepilot.core.observation import RangeBearing

A, B = Landmark(1, 0.0, 0.0), Landmark(2, 4.0, 1.0)
TRUE = Pose2D(1.5, 2.2, math.radians(-70.0))
WRONG = SERIES[1]
SIGMAS = (0.01, math.radians(0.2))
"""Of a range (metres) and a bearing."""


def as_printed(radius_a: float, radius_b: float, mended: int) -> Point:
    """Eq. 3 with none, the first (the mean of y), or both of its misprints mended."""
    (xa, ya), (xb, yb) = A.position, B.position
    square = (xb - xa) ** 2 + (yb - ya) ** 2
    product = ((radius_a + radius_b) ** 2 - square) * (square - (radius_b - radius_a) ** 2)
    root, share = math.sqrt(product) / (2 * square), (radius_a**2 - radius_b**2) / (2 * square)
    x = (xa + xb) / 2 + (xb - xa) * share - (yb - ya) * root
    mean = (ya + yb) / 2 if mended >= 1 else (xa + xb) / 2
    across = xb - xa if mended >= 2 else yb - ya
    return x, mean + (yb - ya) * share + across * root


def seen(pose: Pose2D, mark: Landmark, noise: tuple[float, float] = (0.0, 0.0)) -> RangeBearing:
    """What a camera on the rear axle would measure."""
    return RangeBearing(
        0.0,
        mark.id,
        pose.distance_to(mark.position) + noise[0],
        wrap_angle(pose.bearing_to(mark.position) + noise[1]),
        *SIGMAS,
    )


def document() -> dict[str, Any]:
    """Metres and degrees: the solutions, their directions, the misprints, and a fix with noise."""
    a, b = seen(TRUE, A), seen(TRUE, B)
    meeting = circle_intersections(A.position, B.position, a.range, b.range)
    measured = wrap_angle(b.bearing - a.bearing)
    solutions = []
    for place in (meeting.first, meeting.second):
        at = Pose2D(*place, 0.0)
        angle = wrap_angle(at.bearing_to(B.position) - at.bearing_to(A.position))
        solutions.append(
            {"x": place[0], "y": place[1], "off_deg": math.degrees(wrap_angle(angle - measured))}
        )
    return {
        "ranges": [a.range, b.range],
        "difference_of_bearings_deg": math.degrees(measured),
        "solutions": solutions,
        "misprinted": [as_printed(a.range, b.range, mended) for mended in (0, 1, 2)],
        "noisy": _with_noise(2000),
    }


def _with_noise(count: int) -> dict[str, float]:
    """Fixes from drawn errors: their mean position error, and whether their covariance holds."""
    rng = np.random.default_rng(15)
    marks = {A.id: A, B.id: B}
    exact = FixSettings(survey_sigma=0.0, bearing_floor=0.0)
    errors, squared = [], []
    for _ in range(count):
        pair = [
            seen(TRUE, mark, (rng.normal(0, SIGMAS[0]), rng.normal(0, SIGMAS[1])))
            for mark in (A, B)
        ]
        found = two_landmark_fix(pair[0], pair[1], marks, 0.0, exact)
        assert isinstance(found, Fix)
        off = np.array(found.pose) - np.array(TRUE)
        errors.append(math.hypot(off[0], off[1]))
        squared.append(off @ np.linalg.solve(found.covariance, off))
    return {"mean_cm": 100 * float(np.mean(errors)), "nees_mean": float(np.mean(squared))}


def draw() -> Chart:
    """Both circles, both places, and the directions of sight from each."""
    chart = Chart(620, 590, "Two circles meet at two places; the bearings choose one of them.")
    a, b = seen(TRUE, A), seen(TRUE, B)
    meeting = circle_intersections(A.position, B.position, a.range, b.range)
    corners = np.array([(-0.6, -4.0), (5.0, 3.6)])
    field = Field.to_scale(chart, 56, 30, 548, 516, corners)
    field.frame("x, m", "y, m")
    turn = np.linspace(0, 2 * math.pi, 181)
    for mark, away in ((A, a.range), (B, b.range)):
        ring = np.stack([mark.x + away * np.cos(turn), mark.y + away * np.sin(turn)], axis=1)
        inside = (np.abs(field.at(ring) - (330, 288)) < (274, 258)).all(axis=1)
        for piece in np.split(np.arange(181), np.flatnonzero(np.diff(inside)) + 1):
            if inside[piece[0]]:
                field.line(ring[piece], FAINT, 2.0)
    wrong = max((meeting.first, meeting.second), key=lambda p: math.dist(p, TRUE.position))
    for place, color, words in (
        (TRUE.position, ESTIMATED, "R1: both landmarks where they were seen"),
        (wrong, WRONG, "R2: landmark 2 is not at its line's end"),
    ):
        # Turned so that landmark 1 is where it was seen: then 2 fits, or it does not.
        heading = math.atan2(A.y - place[1], A.x - place[0]) - a.bearing
        for one, away in ((a, a.range), (b, b.range)):
            direction = heading + one.bearing
            end = (place[0] + away * math.cos(direction), place[1] + away * math.sin(direction))
            field.line(np.array([place, end]), color, 1.4, dashed=True)
        ((x, y),) = field.at(np.array([place]))
        chart.dot(x, y, color, 5)
        chart.text(x + 12, y + (-6 if place == TRUE.position else 18), words, color, 12)
    for mark in (A, B):
        ((x, y),) = field.at(np.array([mark.position]))
        chart.dot(x, y, INK, 4.5)
        chart.text(x - 8, y + 16, str(mark.id), INK, 12, "end")
    for number, name in ((0, "Eq. 3 as printed"), (1, "one misprint mended")):
        ((x, y),) = field.at(np.array([as_printed(a.range, b.range, number)]))
        chart.dot(x, y, MEASURED, 4, hollow=True)
        chart.text(x - 8, y + 4, name, SOFT, 11, "end")
    return chart
