"""All edges of a code at once: a square wave seen through a lens, fitted to one scale.

The strip is straightened (rolling shutter and roll lean it over), its columns are averaged with
the weight of their contrast, and the resulting column of light is compared with what a code of
that scale would give: levels of bright and dark, a blurred step at every boundary. The scale's
uncertainty comes out of the same fit.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from polepilot.core.observation import Image
from polepilot.core.vision.color import linear
from polepilot.core.vision.strips import Strip

Floats = NDArray[np.floating[Any]]

_MARGIN = 1.2
"""Segments above and below the code that take part in the fit."""
_STEEPEST = 0.2
"""Columns per row: twice what 60 degrees/s of pan and 2 degrees of roll amount to."""
_UPRIGHT = 0.25
"""Pixels from top to bottom by which a strip may lean and count as upright."""
_UPRIGHT_ROUNDS = 4
_ROUNDS = 6
_LINEAR = 6
"""Light above, bright (level and gain along the code), dark (level and gain), light below."""
_NONLINEAR = 4
"""Top, unit, blur, growth."""
_GROWTH = 0.15
"""How much bright segments may seem to grow (glare, grey levels averaged), pixels."""
_SETTLED = 0.02
"""Pixels by which boundaries still move when a fit may end."""
_RIDGE = 1e-9


@dataclass(frozen=True, slots=True, eq=False)
class Column:
    """A straightened strip: light by row, and where the strip lies."""

    rows: Floats
    """Row numbers of the profile."""
    profile: Floats
    """Linear light of the signal along the code."""
    channels: Floats
    """The same for every channel of the picture: rows x channels."""
    middle: float
    """Row for which ``left`` and ``right`` hold."""
    left: float
    right: float
    """Edges of the strip, columns; minus or plus infinity where the picture cuts it off."""
    slope: float
    """Columns per row by which the strip leans to the right going down."""
    front: float
    """Mean height of a cylinder's surface over the averaged columns, as a share of its radius."""
    edge_sigma: float
    """Standard deviation of each of the two edges, pixels."""


@dataclass(frozen=True, slots=True, eq=False)
class Scale:
    """Where the code's boundaries lie: boundary k at ``top`` + k * ``unit`` (rows)."""

    top: float
    unit: float
    blur: float
    bright: float
    dark: float
    unit_sigma: float
    noise: float
    """Rms of what the fit leaves over, as a share of bright - dark."""


def rough_code(image: Image, strip: Strip) -> str:
    """The segments as they look at whole pixels, top first."""
    segments = 2 * strip.bits + 5
    unit = (strip.bottom - strip.top) / segments
    centres = strip.top + (np.arange(segments) + 0.5) * unit
    reach = max(0.25 * unit, 0.0)
    first = np.clip(np.rint(centres - reach), 0, image.shape[0] - 1).astype(np.intp)
    last = np.clip(np.rint(centres + reach), 0, image.shape[0] - 1).astype(np.intp)
    light = linear(image[:, strip.first : strip.last + 1]).mean(axis=1)
    total = np.concatenate([[0.0], np.cumsum(light)])
    level = (total[last + 1] - total[first]) / (last + 1 - first)
    half = (level[[0, 1, -2, -1]].mean() + level.min()) / 2
    code = ["1" if value > half else "0" for value in level]
    code[:3] = "110"
    code[-3:] = "011"
    return "".join(code)


def straighten(image: Image, strip: Strip, code: str, aspect: float) -> Column | None:
    """Cut the strip out and set it upright; None where there is no contrast.

    Args:
        code: the segments, top first.
        aspect: thickness of the landmark in segments.
    """
    height, width = image.shape[:2]
    segments = len(code)
    unit = (strip.bottom - strip.top) / segments
    wide = aspect * unit
    row0 = max(math.floor(strip.top - _MARGIN * unit - 1), 0)
    row1 = min(math.ceil(strip.bottom + _MARGIN * unit + 1) + 1, height)
    centre = (strip.first + strip.last) / 2
    reach = max(wide, (strip.last - strip.first + 1) / 2) + 4
    column0 = max(math.floor(centre - reach), 0)
    column1 = min(math.ceil(centre + reach) + 1, width)
    patch = image[row0:row1, column0:column1]
    light = linear(patch)
    rows = np.arange(row0, row1, dtype=np.float64)
    bright, dark = _inner_rows(rows, strip.top, unit, code)
    if bright.sum() < 2 or dark.sum() < 2:
        return None
    columns = np.arange(column0, column1, dtype=np.float64)
    middle = (strip.top + strip.bottom) / 2
    # The dark rows of a leaning strip show the background smeared into it, which hides a part of
    # the lean: what is left shows once the strip is nearly upright.
    leaning, slope = patch, 0.0
    for _ in range(_UPRIGHT_ROUNDS):
        more = _lean(light, rows, columns, bright, dark, middle, centre, wide)
        if abs(more) * (strip.bottom - strip.top) <= _UPRIGHT:
            break
        slope += more
        if abs(slope) > _STEEPEST:
            return None
        patch = _upright(leaning, slope, middle - row0)
        light = linear(patch)
    across = light[bright].mean(axis=0) - light[dark].mean(axis=0)
    across = across.astype(np.float64)
    inside = np.abs(columns - centre) <= wide * 0.75 + 2
    peak = float(across[inside].max(initial=0.0))
    if peak <= 0.002:
        return None
    spread = light[dark].std(axis=0)[inside].mean() + light[bright].std(axis=0)[inside].mean()
    left, right = _sides(across, columns, int(np.argmax(np.where(inside, across, -1))), peak)
    if column0 == 0 and left < 0:
        left = -math.inf
    if column1 == width and right > width - 1:
        right = math.inf
    weight = np.where((columns > left) & (columns < right) & (across > 0.5 * peak), across, 0.0)
    weight /= weight.sum()
    if math.isfinite(left) and math.isfinite(right):
        side = 2 * (columns - (left + right) / 2) / max(right - left, 1.0)
    elif math.isfinite(left):
        side = 2 * (columns - left) / max(wide, 1.0) - 1
    else:
        side = 2 * (columns - right) / max(wide, 1.0) + 1
    front = float(weight @ np.sqrt(np.maximum(1 - side**2, 0)))
    flat = patch.reshape(*patch.shape[:2], -1)
    channels = np.stack(
        [linear(flat[:, :, channel]) @ weight for channel in range(flat.shape[2])], axis=1
    )
    step_noise = float(spread) / peak / math.sqrt(max(min(bright.sum(), dark.sum()), 1))
    return Column(
        rows=rows,
        profile=light.astype(np.float64) @ weight,
        channels=channels,
        middle=middle,
        left=left,
        right=right,
        slope=slope,
        front=front,
        edge_sigma=step_noise,
    )


def fit_scale(column: Column, code: str, top: float, unit: float) -> Scale | None:
    """Gauss-Newton fit of the whole code; None where it does not settle near the first guess."""
    rows, light = column.rows, column.profile
    segments = len(code)
    values = np.array([int(c) for c in code])
    changes = np.flatnonzero(np.diff(values)) + 1
    edges = np.concatenate([[0], changes, [segments]]).astype(np.float64)
    sign = np.ones(len(edges))
    sign[1::2] = -1
    # Photon noise: the variance of light grows with the light, in all channels that take part.
    trust = 1 / np.sqrt(np.abs(column.channels[:, [0, -1]]).sum(axis=1) + 0.02)
    guess = np.array([top, unit, 0.5, 0.0])
    limit = np.array([0.6 * unit, 0.08 * unit, 0.25, 0.3])
    jacobian = np.zeros((len(rows) + 1, _LINEAR + _NONLINEAR))
    wanted = np.zeros(len(rows) + 1)
    level: Floats | None = None
    for _ in range(_ROUNDS):
        basis, slopes, spreads, shift = _model(rows, guess, edges, sign, segments)
        if level is None:
            level = _solve(basis * trust[:, None], light * trust)
            if level is None:
                return None
        above, bright, gain, dark, tilt, below = level
        jump = sign * ((bright - dark) + (gain - tilt) * shift)[:, None]
        jump[:, 0] = bright + gain * shift - above
        jump[:, -1] = below - bright - gain * shift
        move = -jump * slopes
        jacobian[:-1, :_LINEAR] = basis
        jacobian[:-1, -4] = move.sum(axis=1)
        jacobian[:-1, -3] = move @ edges
        jacobian[:-1, -2] = (jump * spreads).sum(axis=1)
        jacobian[:-1, -1] = -(move @ sign)
        jacobian[:-1] *= trust[:, None]
        rest = (light - basis @ level) * trust
        wanted[:-1] = rest
        # A weak prior holds the growth of bright segments near nought where a code cannot tell.
        pull = math.sqrt(float(rest @ rest) / max(len(rows) - _LINEAR - _NONLINEAR, 1)) / _GROWTH
        jacobian[-1, -1] = pull
        wanted[-1] = -pull * guess[3]
        change = _solve(jacobian, wanted)
        if change is None:
            return None
        level = level + change[:_LINEAR]
        delta = np.minimum(np.maximum(change[_LINEAR:], -limit), limit)
        guess = guess + delta
        guess[2] = min(max(guess[2], 0.2), 0.25 * guess[1] + 1.2)
        if abs(guess[0] - top) > unit + 1 or abs(guess[1] / unit - 1) > 0.2:
            return None
        # The step after this one would be the square of it, about.
        if abs(delta[0]) < _SETTLED and abs(delta[1]) * segments < _SETTLED:
            break
    contrast = bright - dark
    if contrast <= 0:
        return None
    free = max(len(rows) - _LINEAR - _NONLINEAR, 1)
    variance = float(rest @ rest) / free
    normal = jacobian.T @ jacobian
    normal.flat[:: len(normal) + 1] *= 1 + _RIDGE
    spread = np.linalg.inv(normal)[-3, -3] * variance
    return Scale(
        top=float(guess[0]),
        unit=float(guess[1]),
        blur=float(guess[2]),
        bright=float(bright),
        dark=float(dark),
        unit_sigma=math.sqrt(max(float(spread), 0.0)),
        noise=float(np.sqrt(np.mean((rest / trust) ** 2))) / float(contrast),
    )


def segment_levels(column: Column, scale: Scale, segments: int) -> Floats | None:
    """Light of every segment with its neighbours' blur taken out: segments x channels."""
    edges = scale.top + scale.unit * np.arange(segments + 1)
    steps, _, _ = _step(column.rows, edges, scale.blur)
    basis = np.column_stack([1 - steps[:, 0], steps[:, :-1] - steps[:, 1:], steps[:, -1]])
    normal = basis.T @ basis
    normal.flat[:: len(normal) + 1] += 1e-3
    levels: Floats = np.linalg.solve(normal, basis.T @ column.channels)
    return levels[1:-1]


def _model(
    rows: Floats, guess: Floats, edges: Floats, sign: Floats, segments: int
) -> tuple[Floats, Floats, Floats, Floats]:
    """What levels are multiplied by (rows x 6), how steps change with place and blur, and how
    far up or down the code each row lies (-1 to 1)."""
    # Bright segments have grown by guess[3] at either end.
    places = guess[0] + guess[1] * edges - guess[3] * sign
    steps, slopes, spreads = _step(rows, places, float(guess[2]))
    bright = steps @ sign
    inside = steps[:, 0] - steps[:, -1]
    dark = inside - bright
    shift = 2 * (rows - guess[0]) / (guess[1] * segments) - 1
    basis = np.stack(
        [1 - steps[:, 0], bright, bright * shift, dark, dark * shift, steps[:, -1]], axis=1
    )
    return basis, slopes, spreads, shift


def _step(rows: Floats, places: Floats, blur: float) -> tuple[Floats, Floats, Floats]:
    """Steps at ``places`` seen by consecutive rows, and their derivatives by row and by blur.

    A pixel averages over its area what the lens has blurred: the step is the mean of the normal
    distribution's cumulative function over one pixel. All results are rows x places.
    """
    borders = np.arange(len(rows) + 1) + (rows[0] - 0.5)
    z = (borders[:, None] - places) / blur
    curve, bell = _cumulative(z), np.exp(-0.5 * z * z) * (1 / math.sqrt(math.tau))
    area = z * curve + bell
    return blur * (area[1:] - area[:-1]), curve[1:] - curve[:-1], bell[1:] - bell[:-1]


def _cumulative(z: Floats) -> Floats:
    """The normal distribution's cumulative function, to 2e-4 (no scipy needed)."""
    curve: Floats = 0.5 + 0.5 * np.tanh(0.7978845608 * z * (1 + 0.044715 * z * z))
    return curve


def _solve(matrix: Floats, target: Floats) -> Floats | None:
    """Least squares by normal equations; a column without influence gets about zero."""
    normal = matrix.T @ matrix
    diagonal = normal.flat[:: len(normal) + 1]
    normal.flat[:: len(normal) + 1] = diagonal + _RIDGE * (diagonal.max() + 1e-12)
    try:
        solution: Floats = np.linalg.solve(normal, matrix.T @ target)
    except np.linalg.LinAlgError:
        return None
    return solution if np.isfinite(solution).all() else None


def _inner_rows(
    rows: Floats, top: float, unit: float, code: str
) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
    """Rows well inside bright and inside dark runs (edges may be a pixel off)."""
    values = np.array([2, *(int(c) for c in code), 2])
    # However the rows fall, at least one per segment is left.
    trim = min(max(0.5 * unit - 0.52, 0.0), 0.8)

    def at(place: Floats) -> NDArray[np.intp]:
        index = np.floor((place - top) / unit).astype(np.intp) + 1
        picked: NDArray[np.intp] = values[np.clip(index, 0, len(values) - 1)]
        return picked

    before, after = at(rows - trim), at(rows + trim)
    return (before == 1) & (after == 1), (before == 0) & (after == 0)


def _upright(patch: Image, slope: float, middle: float) -> Image:
    """Move every row back to the left by ``slope`` * (row - ``middle``)."""
    matrix = np.array([[1.0, slope, -slope * middle], [0.0, 1.0, 0.0]])
    size = (patch.shape[1], patch.shape[0])
    flags = cv2.INTER_LINEAR | cv2.WARP_INVERSE_MAP
    moved = cv2.warpAffine(patch, matrix, size, flags=flags, borderMode=cv2.BORDER_REPLICATE)
    return np.asarray(moved, np.uint8)


def _lean(
    light: NDArray[np.float32],
    rows: Floats,
    columns: Floats,
    bright: NDArray[np.bool_],
    dark: NDArray[np.bool_],
    middle: float,
    centre: float,
    wide: float,
) -> float:
    """Columns per row by which the bright rows' middles move."""
    near = np.abs(columns - centre) <= wide + 3
    signal = light[np.ix_(bright, near)].astype(np.float64)
    # What the dark rows show beside the strip is background: take it away.
    signal -= light[np.ix_(dark, near)].mean(axis=0)
    signal = np.maximum(signal - 0.3 * signal.max(axis=1, keepdims=True), 0)
    mass = signal.sum(axis=1)
    if mass.max() <= 0:
        return 0.0
    place = signal @ (columns[near] - centre) / np.maximum(mass, 1e-9)
    offset = rows[bright] - middle
    weight = mass / mass.sum()
    offset = offset - weight @ offset
    spread = weight @ (offset * offset)
    return float(weight @ (offset * place) / spread) if spread > 0 else 0.0


def _sides(across: Floats, columns: Floats, peak_at: int, peak: float) -> tuple[float, float]:
    """Where the strip begins and ends: half of the contrast, between pixels."""
    half = 0.5 * peak
    low = across < half
    before = np.flatnonzero(low[:peak_at])
    after = np.flatnonzero(low[peak_at:])
    left, right = columns[0] - 1.0, columns[-1] + 1.0
    if len(before):
        at = before[-1]
        left = columns[at] + (half - across[at]) / (across[at + 1] - across[at])
    if len(after):
        at = after[0] + peak_at
        right = columns[at] - (half - across[at]) / (across[at - 1] - across[at])
    return float(left), float(right)
