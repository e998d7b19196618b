"""A survey as least squares: residuals in standard deviations, and their sparse derivatives.

Unknown are the nodes of the drive (x, y, heading), the poles (x, y) and what distorts
measurements: errors of speed, steering, servo lag, motor lag, the common error of all ranges, and
Legendre coefficients of the potentiometer's error over the pan range.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from polepilot.core.geometry import Point, Pose2D
from polepilot.core.localization.survey_run import SurveyRun
from polepilot.core.localization.survey_track import Track

Array = NDArray[np.float64]
Ints = NDArray[np.intp]

SPEED, STEERING, SERVO_LAG, MOTOR_LAG, RANGE, PAN = 0, 1, 2, 3, 4, 5
PAN_TERMS = 6
DISTORTIONS = PAN + PAN_TERMS
_PAN_PRIORS = tuple(math.radians(v) for v in (1.0, 1.5, 0.8, 1.0, 0.4, 0.4))
_PRIORS = np.array([0.1, math.radians(3.0), 0.08, 0.06, math.nan, *_PAN_PRIORS])
_GAUGE = np.array([1e-4, 1e-4, 1e-5])
"""How firmly the first node is held where only it says where the map is: metres, radians."""
_RANGE_FLOOR, _BEARING_FLOOR = 0.002, math.radians(0.06)
"""What errors of a single sighting are added to those that the detector names."""
_SHARED_RANGE, _SHARED_BEARING = 0.0005, math.radians(0.06)
"""What repeats in every sighting of one pole from one place, as a share of the range and rad."""


@dataclass(frozen=True, slots=True)
class Known:
    """What is known besides the recording."""

    places: Mapping[int, tuple[Point, float]] = field(default_factory=dict)
    """Poles that somebody measured, with the standard deviation of x and of y, metres."""
    distance: tuple[int, int, float, float] | None = None
    """Two poles, how far apart they are, and the standard deviation of that."""
    first: Pose2D | None = None
    """The pose of the first node, where no measured poles say where the map is."""
    range_sigma: float = 0.001
    """Of the common error of all ranges, as a share."""


class Problem:
    """The residuals of one recording; the state is nodes, then poles, then distortions."""

    def __init__(
        self,
        run: SurveyRun,
        track: Track,
        poles: Sequence[int],
        known: Known,
        rejected: NDArray[np.bool_] | None = None,
    ) -> None:
        self.track = track
        self.poles = tuple(poles)
        self.nodes = len(track.stamps)
        self.size = 3 * self.nodes + 2 * len(self.poles) + DISTORTIONS
        self._known = known
        self._forward = run.camera_forward
        self._gather(run)
        self.rejected = np.zeros(len(self.pole), dtype=bool) if rejected is None else rejected
        self._weigh()
        priors = _PRIORS.copy()
        priors[RANGE] = known.range_sigma
        self._prior = 1.0 / priors

    @property
    def pole_columns(self) -> slice:
        return slice(3 * self.nodes, 3 * self.nodes + 2 * len(self.poles))

    @property
    def distortion_columns(self) -> slice:
        return slice(self.size - DISTORTIONS, self.size)

    def pack(
        self, nodes: Array, places: Mapping[int, Point], distortion: Array | None = None
    ) -> Array:
        """A state from nodes (N x 3) and places."""
        state = np.zeros(self.size)
        state[: 3 * self.nodes] = nodes.ravel()
        state[self.pole_columns] = np.array([places[k] for k in self.poles]).ravel()
        if distortion is not None:
            state[self.distortion_columns] = distortion
        return state

    def unpack(self, state: Array) -> tuple[Array, Array, Array]:
        """Nodes (N x 3), poles (M x 2), distortions."""
        return (
            state[: 3 * self.nodes].reshape(-1, 3),
            state[self.pole_columns].reshape(-1, 2),
            state[self.distortion_columns],
        )

    def residuals(self, state: Array) -> Array:
        """All residuals, each over its standard deviation."""
        return np.concatenate([part for part, _ in self._parts(state, False)])

    def jacobian(self, state: Array) -> sparse.csr_matrix:
        """Their derivatives."""
        rows, columns, values, offset = [], [], [], 0
        for part, derivatives in self._parts(state, True):
            for row, column, value in derivatives:
                rows.append(np.broadcast_to(row + offset, value.shape).ravel())
                columns.append(np.broadcast_to(column, value.shape).ravel())
                values.append(value.ravel())
            offset += len(part)
        triplets = np.concatenate(values), (np.concatenate(rows), np.concatenate(columns))
        return sparse.csr_matrix(triplets, shape=(offset, self.size))

    def sighting_residuals(self, state: Array) -> tuple[Array, Array]:
        """Of every sighting, range and bearing over their own sigmas, rejected ones as well."""
        ranges, bearings, _ = self._sighted(state)
        return ranges / self._range_sigma, bearings / self._bearing_sigma

    def projected(self, state: Array) -> Array:
        """Where each sighting puts its pole (N x 2), NaN where it has no range."""
        nodes, _, distortion = self.unpack(state)
        at = nodes[self.node]
        away = np.where(self.ranged, self._range, np.nan) / (1.0 + distortion[RANGE])
        seen = self._bearing - self._bend @ distortion[PAN:] + at[:, 2]
        arm = self._forward
        x = at[:, 0] + arm * np.cos(at[:, 2]) + away * np.cos(seen)
        return np.column_stack([x, at[:, 1] + arm * np.sin(at[:, 2]) + away * np.sin(seen)])

    def _gather(self, run: SurveyRun) -> None:
        slot = {number: index for index, number in enumerate(self.poles)}
        rows = [
            (
                node,
                slot[s.landmark],
                s.range,
                s.bearing,
                s.range_sigma,
                s.bearing_sigma,
                s.bearing if s.pan is None else s.pan,
                index,
            )
            for index, (node, (_, seen)) in enumerate(
                zip(self.track.node_of.tolist(), run.pictures, strict=True)
            )
            for s in seen
            if node >= 0 and s.landmark in slot
        ]
        table = np.array(rows).reshape(-1, 8)
        self.node, self.pole = table[:, 0].astype(np.intp), table[:, 1].astype(np.intp)
        self.picture = table[:, 7].astype(np.intp)
        self.ranged = np.isfinite(table[:, 2]) & np.isfinite(table[:, 4])
        self._range = np.where(self.ranged, table[:, 2], 1.0)
        self._bearing = table[:, 3]
        self._own_range = np.where(self.ranged, table[:, 4], 1.0)
        self._own_bearing = table[:, 5]
        unit = np.clip(table[:, 6] / run.pan_range, -1.0, 1.0)
        self._bend = np.polynomial.legendre.legvander(unit, PAN_TERMS - 1)

    def _weigh(self) -> None:
        """Sigmas; sightings of one pole from one place share errors, and are worth less."""
        kept = ~self.rejected
        groups = self.node * max(len(self.poles), 1) + self.pole
        counts = np.bincount(groups, kept, minlength=self.nodes * max(len(self.poles), 1))
        count = np.maximum(counts[groups], 1.0)
        self._range_sigma = np.sqrt(
            self._own_range**2 + _RANGE_FLOOR**2 + count * (_SHARED_RANGE * self._range) ** 2
        )
        self._bearing_sigma = np.sqrt(
            self._own_bearing**2 + _BEARING_FLOOR**2 + count * _SHARED_BEARING**2
        )

    def _sighted(self, state: Array) -> tuple[Array, Array, tuple[Array, ...]]:
        """Measured minus expected ranges and bearings (raw), and the geometry behind them."""
        nodes, poles, distortion = self.unpack(state)
        at = nodes[self.node]
        arm_x, arm_y = self._forward * np.cos(at[:, 2]), self._forward * np.sin(at[:, 2])
        away_x = poles[self.pole, 0] - at[:, 0] - arm_x
        away_y = poles[self.pole, 1] - at[:, 1] - arm_y
        distance = np.maximum(np.hypot(away_x, away_y), 1e-3)
        ux, uy = away_x / distance, away_y / distance
        ranges = np.where(self.ranged, self._range - distance * (1.0 + distortion[RANGE]), 0.0)
        seen = self._bearing - self._bend @ distortion[PAN:]
        bearings = _wrapped(seen - np.arctan2(uy, ux) + at[:, 2])
        return ranges, bearings, (distance, ux, uy, arm_x, arm_y)

    def _parts(self, state: Array, derive: bool) -> list[tuple[Array, list[_Derivative]]]:
        parts = [
            self._link_part(state, derive),
            *self._sighting_parts(state, derive),
            self._prior_part(state),
        ]
        if self._known.first is not None:
            parts.append(self._gauge_part(state, self._known.first))
        if self._known.places:
            parts.append(self._place_part(state))
        if self._known.distance is not None:
            parts.append(self._distance_part(state, self._known.distance))
        return parts

    def _link_part(self, state: Array, derive: bool) -> tuple[Array, list[_Derivative]]:
        nodes, _, distortion = self.unpack(state)
        track, first = self.track, self.track.first
        before, after = nodes[first], nodes[first + 1]
        cos, sin = np.cos(before[:, 2]), np.sin(before[:, 2])
        dx, dy = after[:, 0] - before[:, 0], after[:, 1] - before[:, 1]
        ahead, left = cos * dx + sin * dy, cos * dy - sin * dx
        moved, by_distortion = track.moved(distortion[:RANGE])
        gap = np.column_stack([ahead, left, after[:, 2] - before[:, 2]]) - moved
        gap[:, 2] = _wrapped(gap[:, 2])
        whole = np.einsum("nij,nj->ni", track.whitening, gap).ravel()
        if not derive:
            return whole, []
        count = len(first)
        of_before, of_after = np.zeros((count, 3, 3)), np.zeros((count, 3, 3))
        of_after[:, 0, 0], of_after[:, 0, 1] = cos, sin
        of_after[:, 1, 0], of_after[:, 1, 1] = -sin, cos
        of_before[:, :2, :2] = -of_after[:, :2, :2]
        of_before[:, 0, 2], of_before[:, 1, 2] = left, -ahead
        of_before[:, 2, 2], of_after[:, 2, 2] = -1.0, 1.0
        row = np.arange(3 * count).reshape(count, 3, 1)
        three = np.arange(3)
        begin = 3 * self.nodes + 2 * len(self.poles)
        return whole, [
            (row, (3 * first[:, None] + three)[:, None, :], track.whitening @ of_before),
            (row, (3 * first[:, None] + 3 + three)[:, None, :], track.whitening @ of_after),
            (row, begin + np.arange(RANGE), track.whitening @ -by_distortion),
        ]

    def _sighting_parts(self, state: Array, derive: bool) -> list[tuple[Array, list[_Derivative]]]:
        ranges, bearings, geometry = self._sighted(state)
        kept = ~self.rejected
        by_range = np.where(kept & self.ranged, 1.0 / self._range_sigma, 0.0)
        by_bearing = np.where(kept, 1.0 / self._bearing_sigma, 0.0)
        if not derive:
            return [(ranges * by_range, []), (bearings * by_bearing, [])]
        distance, ux, uy, arm_x, arm_y = geometry
        _, _, distortion = self.unpack(state)
        scale = 1.0 + distortion[RANGE]
        row = np.arange(len(ranges))[:, None]
        node = 3 * self.node[:, None] + np.arange(3)
        pole = 3 * self.nodes + 2 * self.pole[:, None] + np.arange(2)
        begin = self.size - DISTORTIONS
        # The camera goes round with the heading: its velocity is (-arm_y, arm_x).
        turned = uy * arm_x - ux * arm_y
        range_node = np.column_stack([ux, uy, turned]) * scale
        range_pole = np.column_stack([-ux, -uy]) * scale
        across = (ux * arm_x + uy * arm_y) / distance
        bearing_node = np.column_stack([-uy / distance, ux / distance, 1.0 + across])
        bearing_pole = np.column_stack([uy, -ux]) / distance[:, None]
        w, v = by_range[:, None], by_bearing[:, None]
        return [
            (
                ranges * by_range,
                [
                    (row, node, range_node * w),
                    (row, pole, range_pole * w),
                    (row, np.array([begin + RANGE]), -distance[:, None] * w),
                ],
            ),
            (
                bearings * by_bearing,
                [
                    (row, node, bearing_node * v),
                    (row, pole, bearing_pole * v),
                    (row, begin + PAN + np.arange(PAN_TERMS), -self._bend * v),
                ],
            ),
        ]

    def _prior_part(self, state: Array) -> tuple[Array, list[_Derivative]]:
        index = np.arange(DISTORTIONS)
        columns = self.size - DISTORTIONS + index
        return state[self.distortion_columns] * self._prior, [(index, columns, self._prior)]

    def _gauge_part(self, state: Array, first: Pose2D) -> tuple[Array, list[_Derivative]]:
        gap = state[:3] - np.array(first)
        gap[2] = _wrapped(gap[2])
        return gap / _GAUGE, [(np.arange(3), np.arange(3), 1.0 / _GAUGE)]

    def _place_part(self, state: Array) -> tuple[Array, list[_Derivative]]:
        measured = [k for k in self.poles if k in self._known.places]
        slots = np.array([self.poles.index(k) for k in measured], dtype=np.intp)
        columns = (3 * self.nodes + 2 * slots[:, None] + np.arange(2)).ravel()
        target = np.array([self._known.places[k][0] for k in measured]).reshape(-1)
        weight = np.repeat([1.0 / self._known.places[k][1] for k in measured], 2)
        return (state[columns] - target) * weight, [(np.arange(len(columns)), columns, weight)]

    def _distance_part(
        self, state: Array, distance: tuple[int, int, float, float]
    ) -> tuple[Array, list[_Derivative]]:
        a, b = (3 * self.nodes + 2 * self.poles.index(k) for k in distance[:2])
        way = state[b : b + 2] - state[a : a + 2]
        length = max(float(np.hypot(*way)), 1e-6)
        unit = way / length / distance[3]
        none = np.zeros(2, dtype=np.intp)
        return np.array([(length - distance[2]) / distance[3]]), [
            (none, a + np.arange(2), -unit),
            (none, b + np.arange(2), unit),
        ]


_Derivative = tuple[Ints, Ints, Array]
"""Rows, columns and values, which broadcast to the values' shape."""
Progress = Callable[[float], None]


def _wrapped(angle: Array) -> Array:
    result: Array = np.mod(angle + np.pi, math.tau) - np.pi
    return result
