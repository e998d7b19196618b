"""The pose of the camera without a known pan angle: from three landmarks on (paper, "other case").

All bearings count from one unknown direction: those of one picture, or of a sweep with a
potentiometer that nobody has calibrated. The ranges and the differences of bearing tell where the
pan axis stands, and where that direction points; only the robot's own heading stays unknown, until
somebody says how the direction lies to it. Where ranges are missing too, the differences of bearing
alone are enough: each pair of landmarks is seen under the same angle from one circle, and three
landmarks' circles meet in one point.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from polepilot.core.geometry import Point, Pose2D, wrap_angle
from polepilot.core.landmark import Landmark
from polepilot.core.localization.fix import (
    DEFAULT_FIX,
    FixRefusal,
    FixSettings,
    covariance_of,
    fix,
)
from polepilot.core.observation import RangeBearing

Array = NDArray[np.float64]

_LEAST = 3
_ROUNDS = 12
_STRAIGHT = 1e-9


@dataclass(frozen=True, slots=True, eq=False)
class Resection:
    """Where the pan axis stands in `map`; the heading is where bearing 0 points."""

    camera: Pose2D
    covariance: Array
    """3 x 3, m and rad."""
    landmarks: tuple[int, ...]
    outliers: tuple[int, ...] = ()

    def base(self, zero: float, camera_forward: float) -> Pose2D:
        """The pose of `base_link`, once it is known that bearing 0 lies ``zero`` rad to its left.

        Args:
            camera_forward: of the pan axis ahead of `base_link`, metres.
        """
        heading = wrap_angle(self.camera.heading - zero)
        turned = Pose2D(self.camera.x, self.camera.y, heading)
        return turned.compose(Pose2D(-camera_forward, 0.0, 0.0))


def resect(
    measurements: Sequence[RangeBearing],
    landmarks: Mapping[int, Landmark],
    settings: FixSettings = DEFAULT_FIX,
) -> Resection | FixRefusal:
    """From measurements of a standing camera whose bearings count from an unknown direction.

    Measurements of unknown landmarks, or without a finite bearing, are ignored. Ranges are used
    where at least two landmarks have one.
    """
    usable = [m for m in measurements if m.landmark in landmarks and math.isfinite(m.bearing)]
    ids = tuple(sorted({m.landmark for m in usable}))
    if len(ids) < _LEAST:
        what = "No landmark of the map has been seen"
        if ids:
            many = "s" if len(ids) > 1 else ""
            what = f"Only landmark{many} {' and '.join(map(str, ids))} has been seen"
            what = what.replace(" has ", " have ") if many else what
        reason = f"{what}: without a known pan angle a fix needs three."
        return FixRefusal(reason, "one_landmark" if ids else "none", ids)
    ranged = [m for m in usable if math.isfinite(m.range) and math.isfinite(m.range_sigma)]
    if len({m.landmark for m in ranged}) >= _LEAST:
        # Without an arm between camera and robot the heading takes the unknown direction in.
        answer = fix(ranged, landmarks, 0.0, settings)
        if isinstance(answer, FixRefusal):
            return answer
        if len(answer.landmarks) < _LEAST:
            return _contradiction(ids)
        return Resection(answer.pose, answer.covariance, answer.landmarks, answer.outliers)
    return _by_bearings(usable, landmarks, settings)


def three_bearings(places: Sequence[Point], bearings: Sequence[float]) -> Point | None:
    """Where three places are seen under these bearings, counted from anywhere.

    None where they do not tell: the point lies on the circle through the three places, or the
    places are in one line with it. (Pierlot and Van Droogenbroeck, "A new three object
    triangulation algorithm for mobile robot positioning", 2014.)
    """
    (x1, y1), (x2, y2), (x3, y3) = places
    x1, y1, x3, y3 = x1 - x2, y1 - y2, x3 - x2, y3 - y2
    sines = [
        math.sin(bearings[1] - bearings[0]),
        math.sin(bearings[2] - bearings[1]),
        math.sin(bearings[0] - bearings[2]),
    ]
    if min(map(abs, sines)) < _STRAIGHT:
        return None
    t12 = math.cos(bearings[1] - bearings[0]) / sines[0]
    t23 = math.cos(bearings[2] - bearings[1]) / sines[1]
    if abs(t12 + t23) < _STRAIGHT:
        return None
    t31 = (1.0 - t12 * t23) / (t12 + t23)
    # Centres of the three circles, doubled.
    cx12, cy12 = x1 + t12 * y1, y1 - t12 * x1
    cx23, cy23 = x3 - t23 * y3, y3 + t23 * x3
    cx31, cy31 = x3 + x1 + t31 * (y3 - y1), y3 + y1 - t31 * (x3 - x1)
    k31 = x1 * x3 + y1 * y3 + t31 * (x1 * y3 - x3 * y1)
    divisor = (cx12 - cx23) * (cy23 - cy31) - (cy12 - cy23) * (cx23 - cx31)
    if abs(divisor) < _STRAIGHT:
        return None
    return (x2 + k31 * (cy12 - cy23) / divisor, y2 + k31 * (cx23 - cx12) / divisor)


def _by_bearings(
    measurements: Sequence[RangeBearing], landmarks: Mapping[int, Landmark], settings: FixSettings
) -> Resection | FixRefusal:
    """The camera that most landmarks agree with, then least squares on those."""
    bearings: dict[int, float] = {}
    sigmas: dict[int, float] = {}
    for number in sorted({m.landmark for m in measurements}):
        own = [m for m in measurements if m.landmark == number]
        # Of several sightings the median, told from the first so that nothing wraps.
        away = [wrap_angle(m.bearing - own[0].bearing) for m in own]
        bearings[number] = own[0].bearing + float(np.median(away))
        sigmas[number] = math.hypot(own[0].bearing_sigma, settings.bearing_floor)
    best: tuple[int, float, Pose2D, tuple[int, ...]] | None = None
    for three in combinations(bearings, 3):
        places = [landmarks[n].position for n in three]
        point = three_bearings(places, [bearings[n] for n in three])
        if point is None:
            continue
        zeros = [_azimuth(point, landmarks[n]) - bearings[n] for n in three]
        zero = wrap_angle(zeros[0])
        if max(abs(wrap_angle(z - zero)) for z in zeros) > 0.01:
            continue  # The circles meet where one of the three would be seen behind.
        camera = Pose2D(*point, zero)
        errors = {n: abs(_error(camera, landmarks[n], bearings[n])) for n in bearings}
        agreeing = tuple(
            n
            for n, e in errors.items()
            if e <= settings.gate * _sigma(camera, n, landmarks, sigmas)
        )
        score = (len(agreeing), -sum(errors[n] for n in agreeing))
        if best is None or score > best[:2]:
            best = (*score, camera, agreeing)
    if best is None:
        return _no_tell(tuple(bearings))
    count, _, camera, agreeing = best
    if 2 * count <= len(bearings) and len(bearings) > _LEAST:
        return _contradiction(tuple(bearings))
    state = np.array(camera)
    information = np.zeros((3, 3))
    for _ in range(_ROUNDS):
        information, gradient = np.zeros((3, 3)), np.zeros(3)
        camera = Pose2D(*state.tolist())
        for number in agreeing:
            mark = landmarks[number]
            dx, dy = mark.x - camera.x, mark.y - camera.y
            square = max(dx * dx + dy * dy, 1e-9)
            row = np.array((dy / square, -dx / square, -1.0))
            weight = 1.0 / _sigma(camera, number, landmarks, sigmas) ** 2
            information += weight * np.outer(row, row)
            gradient += weight * row * _error(camera, mark, bearings[number])
        try:
            step = np.linalg.solve(information, gradient)
        except np.linalg.LinAlgError:
            return _no_tell(agreeing)
        state = state + step
        if float(np.abs(step).max()) < 1e-9:
            break
    covariance = covariance_of(information)
    if covariance is None:
        return _no_tell(agreeing)
    largest = math.sqrt(float(np.linalg.eigvalsh(covariance[:2, :2])[-1]))
    if not largest <= settings.max_position_sigma:
        return _no_tell(agreeing)
    x, y, zero = state.tolist()
    outliers = tuple(n for n in bearings if n not in agreeing)
    return Resection(Pose2D(x, y, wrap_angle(zero)), covariance, agreeing, outliers)


def _azimuth(point: Point, mark: Landmark) -> float:
    return math.atan2(mark.y - point[1], mark.x - point[0])


def _error(camera: Pose2D, mark: Landmark, bearing: float) -> float:
    return wrap_angle(bearing - _azimuth(camera.position, mark) + camera.heading)


def _sigma(
    camera: Pose2D, number: int, landmarks: Mapping[int, Landmark], sigmas: Mapping[int, float]
) -> float:
    """Of a bearing, with what 5 mm of the map do to it from here."""
    distance = max(camera.distance_to(landmarks[number].position), 0.1)
    return math.hypot(sigmas[number], DEFAULT_FIX.survey_sigma / distance)


def _no_tell(ids: tuple[int, ...]) -> FixRefusal:
    names = ", ".join(map(str, ids))
    return FixRefusal(
        f"Landmarks {names} stand with the robot near one circle or line: their bearings do not "
        "tell the place.",
        "one_direction",
        ids,
    )


def _contradiction(ids: tuple[int, ...]) -> FixRefusal:
    names = ", ".join(map(str, ids))
    return FixRefusal(
        f"Landmarks {names} contradict each other: no place sees them as they were measured.",
        "contradiction",
        ids,
    )
