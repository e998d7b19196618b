"""Figures of docs/vision.md: the camera's pitch, and what more pixels give."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from scenes.drawing import BLUE, ORANGE, SOFT, Axes, Drawing
from scenes.figures_seeing import KIND, WIDE, pole
from scenes.posed import camera_of, posed
from scenes.seen import place_of, strips_of
from scenes.studio_optics import Eye

from polepilot.core.vision.measure import PITCH_PRIOR, Pitch, measure, pitch_of

_MARKS = (0.001, 0.002, 0.005, 0.01, 0.02, 0.05, 0.1, 0.2, 0.5, 1, 2, 5, 10, 20, 50, 100, 200)


def pitch() -> Drawing:
    """How a camera that nods crowds the segments, and what that does to the range."""
    out = Drawing(
        WIDE,
        372,
        "Left: rows that each segment covers when the camera looks up, level, down. Right: error "
        "of the range against the pitch, with and without the pitch that the picture tells.",
    )
    left = Axes(out, 64, 44, 290, 240, (0.5, 13.5), (15.0, 15.6))
    left.ticks_y([15.0, 15.2, 15.4, 15.6])
    left.ticks_x([1, 4, 7, 10, 13])
    left.frame("segment, from the top", "rows per segment")
    half = KIND.segments / 2
    tilts = (
        (2.0, ORANGE, "looks up by 2°"),
        (0.0, SOFT, "level"),
        (-2.0, BLUE, "looks down by 2°"),
    )
    for index, (degrees, color, words) in enumerate(tilts):
        eye = Eye(blur=0.5, pitch=math.radians(degrees))
        stands = pole(13, 2.0, 0.0)
        heights = KIND.height - np.arange(KIND.segments + 1) * KIND.segment
        (seen,) = strips_of(posed([stands], eye, 2, plain=True), camera_of(eye), KIND)
        # Where the surface stands out as far as that which was measured does on the average.
        aside = np.full(len(heights), math.sqrt(1 - seen.front**2))
        truth = np.diff(eye.project(stands.surface(aside, heights))[:, 1])
        number = np.arange(1.0, KIND.segments + 1)
        left.dots(number, truth, color, 3)
        rows = np.diff(place_of(seen, np.arange(KIND.segments + 1) - half))
        left.curve(number, rows, color, width=1.6)
        y = left.top + left.height + 58 + 17 * index
        out.dot(80, y - 4, color, 3)
        out.line([(70, y - 4), (90, y - 4)], color=color, width=1.6)
        out.text(98, y, words, size=12, color=color)
    out.text(64, 26, "a landmark at 2 m: dots the truth, lines the fit", size=12, color=SOFT)
    out.height = left.top + left.height + 58 + 17 * 3
    right = Axes(out, 456, 44, 290, 240, (-2.2, 2.2), (-0.45, 0.25))
    right.ticks_y([-0.4, -0.2, 0, 0.2], ["-0.4 %", "-0.2 %", "0", "0.2 %"])
    right.ticks_x([-2, -1, 0, 1, 2], ["-2°", "-1°", "0", "1°", "2°"])
    right.frame("pitch, looking up is positive")
    out.text(456, 26, "error of the range, landmarks at 2.2 m", size=12, color=SOFT)
    for degrees in np.linspace(-2, 2, 13):
        for seed in range(3):
            eye = Eye(blur=0.5, pitch=math.radians(degrees))
            stands = pole(13, 2.2, 0.1 * (seed - 1))
            camera = camera_of(eye)
            (seen,) = strips_of(posed([stands], eye, 10 + seed, plain=True), camera, KIND)
            told = pitch_of([(seen, KIND)], camera)
            for guess, color in ((Pitch(0.0, PITCH_PRIOR), SOFT), (told, BLUE)):
                error = 100 * (measure(seen, KIND, guess, camera).range / stands.range - 1)
                out.dot(*right.at(float(degrees), error), color, 3)
    for index, (color, words) in enumerate(
        ((SOFT, "taken for level"), (BLUE, "with the pitch that the picture itself tells"))
    ):
        y = left.top + left.height + 58 + 17 * index
        out.dot(464, y - 4, color, 3)
        out.text(476, y, words, size=12, color=color)
    return out


def resolution(rows: Sequence[Mapping[str, Any]]) -> Drawing:
    """Mean range error and time against the width of the picture (`scenes.resolution`)."""
    out = Drawing(WIDE, 356, "Mean range error and time against the width of the picture.")
    widths = sorted({row["width"] for row in rows})
    ends = widths[0] / 1.12, widths[-1] * 1.12
    fields = (
        ("range_mean_percent", "mean error of the range", " %", 64.0),
        ("milliseconds", "time per picture, one thread", " ms", 456.0),
    )
    for key, title, unit, left in fields:
        values = [row[key] for row in rows if key in row]
        lowest = max(mark for mark in _MARKS if mark <= min(values))
        highest = min(mark for mark in _MARKS if mark >= max(values))
        marks = [mark for mark in _MARKS if lowest <= mark <= highest]
        span = (marks[0], marks[-1])
        axes = Axes(out, left, 44, 290, 240, ends, span, logarithmic=True)
        axes.ticks_y(marks, [f"{mark:g}{unit}" for mark in marks])
        axes.ticks_x(widths)
        axes.frame("columns of the picture")
        out.text(left, 26, title, size=12, color=SOFT)
        for band, color in (("2-8 m", ORANGE), ("8-16 m", BLUE)):
            points = [
                (row["width"], row[key]) for row in rows if row["band"] == band and key in row
            ]
            if points:
                across, up = zip(*points, strict=True)
                axes.curve(across, up, color)
                axes.dots(across, up, color, 3.5)
    for index, (band, color) in enumerate((("2-8 m", ORANGE), ("8-16 m", BLUE))):
        out.dot(72 + 160 * index, 340, color, 3.5)
        out.text(82 + 160 * index, 344, f"landmarks at {band}", size=12, color=color)
    return out
