"""Figures of docs/vision.md: how a strip is found, set upright and fitted.

Made by running the detector on pictures of the studio.
"""

from __future__ import annotations

import math

import numpy as np
from scenes.drawing import BLUE, FAINT, INK, ORANGE, RED, SOFT, Axes, Drawing
from scenes.posed import ORANGE as PAINT
from scenes.posed import camera_of, posed
from scenes.seen import (
    Floats,
    across,
    fit_code,
    fit_side,
    grey_levels,
    place_of,
    runs,
    signal,
    straightened,
    strips_of,
)
from scenes.studio_light import Lamp, Lighting
from scenes.studio_optics import Eye, Pole

from polepilot.core.landmark import LandmarkKind, encode

KIND = LandmarkKind()
WIDE = 780.0
"""Points across every figure."""
_LEFT = 60.0


def pole(number: int, away: float, bearing: float) -> Pole:
    """A landmark in plain orange."""
    return Pole(number, away, bearing, KIND, PAINT)


def search() -> Drawing:
    """One column of a picture: the signal, its runs, and the code among them."""
    eye = Eye(blur=0.5)

    def box(light: Floats) -> None:
        color = PAINT.bright * light[100:200].mean() * 3
        light[214:284, 170:232] = (color * np.array([1.0, 1.05, 1.1])).astype(light.dtype)

    image = posed([pole(13, 3.0, 0.0)], eye, 8, plain=True, behind=box)
    (strip,) = strips_of(image, camera_of(eye), KIND)
    column = round(strip.column)
    values = signal(image)[:, column]
    out = Drawing(
        WIDE,
        352,
        "The signal along one column of a picture: bright runs, and among them the inner part of a "
        "code. The lower end bar runs together with an orange box behind it.",
    )
    scale = (WIDE - 90) / image.shape[0]
    band = image[:, column - 15 : column + 16].transpose(1, 0, 2)[::-1]
    out.text(60, 24, "a piece of the picture, turned: its top is at the left", size=12, color=SOFT)
    out.pixels(band, 60, 32, scale, 2.6)
    middle = 32 + 2.6 * 15.5
    out.line([(52, middle), (60 + scale * 300 + 8, middle)], color=BLUE, dash="5 4")
    axes = Axes(out, 60, 132, scale * 300, 100, (-0.5, 299.5), (0, 200))
    axes.ticks_y([0, 50, 100, 150])
    axes.steps(np.arange(300.0), values.astype(float), ORANGE)
    axes.frame("", "signal")
    axes.ticks_x([0, 50, 100, 150, 200, 250, 299])
    half = KIND.segments / 2
    top, bottom = place_of(strip, np.array([2 - half, half - 2]))
    for place in (top, bottom):
        x = axes.at(place, 0)[0]
        out.line([(x, 118), (x, 304)], color=BLUE, dash="3 3")
    for low, high in runs(values):
        left, right = axes.at(low, 0)[0], axes.at(high, 0)[0]
        out.box(left, 262, right - left, 14, fill=ORANGE, corner=2)
    out.text(52, 273, "runs", size=12, color=SOFT, anchor="end")
    code = encode(13)
    for index in range(2, KIND.segments - 2):
        low, high = place_of(strip, np.array([index - half, index + 1 - half]))
        left, right = axes.at(low, 0)[0], axes.at(high, 0)[0]
        bit = index % 2 == 1
        out.box(left, 284, right - left, 20, fill=FAINT if bit else "none", color=SOFT, line=0.6)
        place, shade = (left + right) / 2, INK if bit else SOFT
        out.text(place, 298, code[index], size=12, anchor="middle", bold=bit, color=shade)
    out.text(52, 298, "code", size=12, color=SOFT, anchor="end")
    out.text(axes.at(top, 0)[0] - 6, 298, "end bar", size=12, color=SOFT, anchor="end")
    out.text(axes.at(bottom, 0)[0] + 6, 298, "end bar and box", size=12, color=SOFT)
    words = (
        "What is looked for is the inner part, between the end bars: it begins and ends dark.",
        "What touches the end bars from outside may have any colour.",
    )
    for index, line in enumerate(words):
        out.text(60, 328 + 16 * index, line, size=12, color=BLUE)
    return out


def strip() -> Drawing:
    """A strip set upright, its light by row, and the code fitted to it."""
    eye = Eye(blur=0.6, roll=math.radians(1.8), pitch=math.radians(0.7))
    image = posed([pole(13, 5.0, 0.12)], eye, 3, plain=True)
    (seen,) = strips_of(image, camera_of(eye), KIND)
    upright = straightened(image, seen, 8)
    inner = 0.35 * seen.width
    offsets = np.arange(-8, 10)[: upright.shape[1]]
    share = np.clip(inner + 0.5 - np.abs(offsets), 0, 1)
    light = (upright * share[None, :, None]).sum(axis=1)[:, 2] / share.sum()
    fit = fit_code(light, seen)
    low, high = fit.rows[0] - 2, fit.rows[-1] + 2
    out = Drawing(
        WIDE,
        420,
        "A strip set upright, its light by row with the fitted model, and what the fit leaves.",
    )
    wide = WIDE - 90
    scale = wide / (high - low)
    rows = slice(math.ceil(low), math.floor(high) + 1)
    crop = grey_levels(upright[rows]).transpose(1, 0, 2)[::-1]
    out.text(60, 24, "the strip, upright and turned", size=12, color=SOFT)
    out.pixels(crop, 60 + scale * (math.ceil(low) - 0.5 - low), 32, scale, 4.2)
    tall = 4.2 * crop.shape[0]
    middle = 32 + tall / 2
    for side in (-1, 1):
        y = middle + side * 4.2 * (inner + 0.5)
        out.line([(52, y), (68 + wide, y)], color="#ffffff", width=2.2)
        out.line([(52, y), (68 + wide, y)], color=BLUE, dash="5 4")
    most = float(np.ceil(20 * fit.light.max()) / 20)
    axes = Axes(out, 60, 54 + tall, wide, 180, (low, high), (0, most))
    axes.ticks_y([0.2 * step for step in range(int(5 * most + 1e-6) + 1)])
    half = KIND.segments / 2
    code = "0" + encode(13) + "0"
    for index in range(KIND.segments + 1):
        if code[index] != code[index + 1]:
            x = axes.at(float(place_of(seen, np.array(index - half))), 0)[0]
            out.line([(x, axes.top - 8), (x, axes.top + axes.height)], color=SOFT, dash="2 3")
    axes.curve(fit.rows, fit.model, BLUE, width=2)
    axes.dots(fit.rows, fit.light, ORANGE, 2.8)
    axes.frame("", "linear light, red")
    rest = Axes(out, 60, axes.top + 206, wide, 46, (low, high), (-0.05 * most, 0.05 * most))
    rest.ticks_y([-0.05 * most, 0, 0.05 * most], ["-5 %", "0", "5 %"])
    for row, value in zip(fit.rows, fit.light - fit.model, strict=True):
        out.line([rest.at(row, 0), rest.at(row, float(value))], color=ORANGE, width=2.2)
    rest.frame("row of the picture")
    rest.ticks_x([v for v in range(0, 300, 10) if low <= v <= high])
    words = (
        f"{seen.unit:.3f} ± {seen.unit * seen.unit_sigma:.3f} rows per segment; "
        f"left over: {100 * fit.rest:.1f} % of bright minus dark"
    )
    out.text(60 + wide, 24, words, size=12, color=BLUE, anchor="end")
    return out


def side() -> Drawing:
    """Light across a strip that is lit from the left, and the cylinder fitted to it."""
    eye = Eye(blur=0.5)
    lamp = Lamp(np.array([-0.70, 0.68, 0.2]), np.array([1.0, 0.96, 0.9]))
    light = Lighting((lamp,), np.array([0.35, 0.35, 0.35]), np.array([0.0, 0.2]))
    stands = pole(13, 4.0, -0.05)
    image = posed([stands], eye, 5, lighting=light, plain=True)
    (seen,) = strips_of(image, camera_of(eye), KIND)
    fit = fit_side(*across(image, seen, 0.5 * seen.width + 5), seen)
    # Where the strip's middle row is: the axis, seen through a level camera.
    truth = eye.center[0] - eye.constant * math.tan(stands.bearing)
    title = "Light across a strip lit from one side, and the cylinder fitted to it."
    out = Drawing(WIDE, 344, title)
    peak = float(fit.model.max())
    ends = fit.columns[0] - 0.5, fit.columns[-1] + 0.5
    axes = Axes(out, 60, 52, WIDE - 90, 200, ends, (0, 1.1 * peak))
    axes.ticks_y([0, 0.5 * peak, peak], ["0", "½", "1"])
    axes.steps(fit.columns, np.maximum(fit.light, 0), ORANGE)
    axes.curve(fit.fine, np.maximum(fit.surface, 0), SOFT, dash="4 3")
    axes.curve(fit.fine, fit.model, BLUE, width=2)
    axes.frame("column of the picture", "bright minus dark")
    axes.ticks_x([v for v in range(0, 400, 5) if fit.columns[0] <= v <= fit.columns[-1]])
    halves = _halves(fit.fine, fit.model)
    for x in halves:
        out.dot(*axes.at(x, 0.5 * peak), RED, 4)
    naive = sum(halves) / 2
    words = f"between the half-way points: {naive - truth:+.2f} columns off"
    marks = (
        (naive, RED, words, "end", -6),
        (seen.column, BLUE, f"fitted: {seen.column - truth:+.2f} columns off", "start", 6),
    )
    for column, color, words, anchor, aside in marks:
        x = axes.at(column, 0)[0]
        out.line([(x, 26), (x, axes.top + axes.height)], color=color, dash="4 3", width=1.4)
        out.text(x + aside, 34, words, size=12, color=color, anchor=anchor)
    y = axes.top + axes.height + 62
    out.line([(60, y - 4), (84, y - 4)], color=SOFT, dash="4 3", width=1.6)
    out.text(92, y, "light on the cylinder itself, a + b u + c √(1 - u²)", size=12, color=SOFT)
    out.line([(420, y - 4), (444, y - 4)], color=BLUE, width=2)
    out.text(452, y, "the same through lens and pixels", size=12, color=BLUE)
    return out


def _halves(x: Floats, y: Floats) -> list[float]:
    """Where a hill passes half of its height, upwards and downwards."""
    level = y.max() / 2
    lit = np.flatnonzero(y > level)
    first, last = int(lit[0]), int(lit[-1])
    up = np.interp(level, [y[first - 1], y[first]], [x[first - 1], x[first]])
    down = np.interp(-level, [-y[last], -y[last + 1]], [x[last], x[last + 1]])
    return [float(up), float(down)]
