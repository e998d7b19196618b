"""Cut a strip out of the picture and set it upright: a column of light for the fit of its edges.

Rolling shutter and roll lean a strip over. It is straightened, and its columns are averaged with
the weight of their contrast; its sides are found half-way between bright and dark.
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
