"""Two maps of the same poles laid over each other, though some poles may stand elsewhere."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from polepilot.core.geometry import Point, Pose2D, wrap_angle

Array = NDArray[np.float64]
Places = Mapping[int, Point]

_NEAR = 0.3
"""Two poles nearer to each other than this say nothing of a direction, metres."""


@dataclass(frozen=True, slots=True)
class Overlay:
    """How one map lies on another."""

    pose: Pose2D
    """The origin of the first map in the second."""
    agreeing: tuple[int, ...]
    """Poles that both maps have at the same place."""
    contradicted: tuple[int, ...]
    """Poles that both maps have, but not at the same place."""
    clear: bool
    """Whether no other way to lay them over each other would do as well."""


def overlay(first: Places, second: Places, tolerance: Mapping[int, float]) -> Overlay | None:
    """The rigid motion under which most poles of ``first`` fall on those of ``second``.

    Args:
        tolerance: per pole, how far apart it may come to lie, metres.

    Returns:
        None where no two poles agree.
    """
    common = sorted(set(first) & set(second))
    best: tuple[int, float] | None = None
    found: tuple[Pose2D, tuple[int, ...]] | None = None
    rivals: set[tuple[int, ...]] = set()
    for a, b in combinations(common, 2):
        apart = math.dist(first[a], first[b])
        if min(apart, math.dist(second[a], second[b])) < _NEAR:
            continue
        if abs(apart - math.dist(second[a], second[b])) > tolerance[a] + tolerance[b]:
            continue
        agreeing: tuple[int, ...] = (a, b)
        pose = fit_rigid(first, second, agreeing)
        for _ in range(5):
            within = tuple(k for k in common if _off(pose, first[k], second[k]) <= tolerance[k])
            if len(within) < 2 or within == agreeing:
                break
            agreeing, pose = within, fit_rigid(first, second, within)
        agreeing = tuple(k for k in agreeing if _off(pose, first[k], second[k]) <= tolerance[k])
        if len(agreeing) < 2:
            continue
        misfit = sum((_off(pose, first[k], second[k]) / tolerance[k]) ** 2 for k in agreeing)
        score = (-len(agreeing), misfit)
        if best is None or score[0] < best[0]:
            rivals = set()
        if best is None or score[0] <= best[0]:
            rivals.add(agreeing)
        if best is None or score < best:
            best, found = score, (pose, agreeing)
    if found is None:
        return None
    pose, agreeing = found
    contradicted = tuple(k for k in common if k not in agreeing)
    return Overlay(pose, agreeing, contradicted, len(rivals) == 1)


def fit_rigid(first: Places, second: Places, ids: tuple[int, ...]) -> Pose2D:
    """The rigid motion that brings poles ``ids`` of ``first`` nearest to those of ``second``."""
    a, b = np.array([first[k] for k in ids]), np.array([second[k] for k in ids])
    middle_a, middle_b = a.mean(axis=0), b.mean(axis=0)
    p, q = a - middle_a, b - middle_b
    angle = math.atan2(float((p[:, 0] * q[:, 1] - p[:, 1] * q[:, 0]).sum()), float((p * q).sum()))
    cos, sin = math.cos(angle), math.sin(angle)
    x = middle_b[0] - cos * middle_a[0] + sin * middle_a[1]
    y = middle_b[1] - sin * middle_a[0] - cos * middle_a[1]
    return Pose2D(float(x), float(y), wrap_angle(angle))


def free_covariance(places: Array, covariance: Array) -> Array:
    """The covariance of a map's shape: what is left when it may be shifted and turned freely.

    Args:
        places: N x 2, of the poles.
        covariance: 2N x 2N, in whatever frame.
    """
    count = len(places)
    centred = places - places.mean(axis=0)
    free = np.zeros((2 * count, 3))
    free[0::2, 0] = free[1::2, 1] = 1.0
    free[0::2, 2], free[1::2, 2] = -centred[:, 1], centred[:, 0]
    shape = np.eye(2 * count) - free @ np.linalg.pinv(free)
    result: Array = shape @ covariance @ shape.T
    return result


def _off(pose: Pose2D, place: Point, target: Point) -> float:
    return math.dist(pose.to_parent(place), target)
