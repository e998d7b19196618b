"""The pose from landmarks alone (paper, "two-landmark fix", Eqs. 2-3).

Eq. 3 is misprinted: its y terms have (xa + xb)/2 where (ya + yb)/2 belongs and (yb - ya) before
the root where (xb - xa) belongs; both are mended here (method.md has the check).

Deviation: only `two_landmark_fix` begins with the circles. `fix`, which the localizer uses, lays
every pair of landmarks, as ranges and bearings show them, over the map, and keeps the pose that
most landmarks agree with. In both the pose is then the weighted least squares of all ranges and
bearings at once, with the covariance that follows from their errors.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations
from typing import Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from polepilot.core.errors import InputError
from polepilot.core.geometry import Point, Pose2D, wrap_angle
from polepilot.core.landmark import Landmark
from polepilot.core.observation import RangeBearing

Array = NDArray[np.float64]

_ELSEWHERE = 0.20
"""Metres by which two poses differ that cannot both be right."""
_PLAUSIBLE = 0.5
"""Of the error that is allowed, on average, for a pose to be taken for a rival of the best one."""
_SINGULAR = 1e-13
"""Smallest against largest information; beyond it an inverse is rounding errors."""

RefusalCode = Literal["none", "one_landmark", "one_direction", "no_intersection", "contradiction"]


@dataclass(frozen=True, slots=True)
class FixRefusal:
    """Why no pose follows from these measurements; ``landmarks`` are those concerned."""

    reason: str
    code: RefusalCode
    landmarks: tuple[int, ...] = ()


@dataclass(frozen=True, slots=True, eq=False)
class Fix:
    """A pose of `base_link` solved from ``landmarks``, with its 3 x 3 covariance (m, rad)."""

    pose: Pose2D
    covariance: Array
    landmarks: tuple[int, ...]
    outliers: tuple[int, ...] = ()
    """Landmarks whose measurements contradicted the others and were left out."""


@dataclass(frozen=True, slots=True)
class FixSettings:
    """What counts as a good fix, and which errors the measurements do not know of themselves."""

    survey_sigma: float = 0.005
    """Of a landmark's mapped position, per axis, metres."""
    bearing_floor: float = math.radians(0.25)
    """Added to every bearing's error: potentiometer, camera mounting. Radians."""
    max_position_sigma: float = 0.06
    max_heading_sigma: float = math.radians(2.0)
    gate: float = 4.0
    """How many sigmas a measurement may be off before it is an outlier."""
    slack: float = 0.05
    """Metres that a landmark may be off in any case before it contradicts the others."""


DEFAULT_FIX = FixSettings()


class CircleIntersections(NamedTuple):
    """Where two circles meet. Where they do not, both points are the place nearest to both."""

    first: Point
    second: Point
    gap: float
    """0 where they meet, else by how many metres they miss each other."""


class _Cluster(NamedTuple):
    """The sightings of one landmark that agree with each other."""

    landmark: Landmark
    members: tuple[int, ...]
    local: Point
    """Where it is in the robot's frame."""
    sigma: float


class _Candidate(NamedTuple):
    """A pose that some landmarks agree with."""

    score: tuple[int, bool, int, float]
    """How many, whether they do so well, by how many sightings, and how well."""
    pose: Pose2D
    agreeing: list[_Cluster]


def circle_intersections(
    a: Point, b: Point, radius_a: float, radius_b: float
) -> CircleIntersections:
    """Eqs. 2-3, corrected: both points at ``radius_a`` from ``a`` and ``radius_b`` from ``b``.

    Circles that miss each other (noise) answer with the point of the line through both centres
    that is equally far from both circles, twice, and the gap between them.

    Raises:
        InputError: a negative or infinite radius, or both centres in one place.
    """
    dx, dy = b[0] - a[0], b[1] - a[1]
    distance = math.hypot(dx, dy)
    if distance < 1e-9:
        raise InputError("two landmarks stand in the same place: their circles have no answer.")
    if not (0 <= radius_a < math.inf and 0 <= radius_b < math.inf):
        raise InputError(f"ranges are {radius_a} and {radius_b} m: expected finite, not negative.")
    apart, inside = distance - radius_a - radius_b, abs(radius_a - radius_b) - distance
    gap = max(apart, inside, 0.0)
    if gap > 0:
        if apart >= inside:
            along = 0.5 * (radius_a + distance - radius_b)
        elif radius_a > radius_b:
            along = 0.5 * (radius_a + distance + radius_b)
        else:
            along = -0.5 * (radius_a + radius_b - distance)
        point = (a[0] + along * dx / distance, a[1] + along * dy / distance)
        return CircleIntersections(point, point, gap)
    square = distance * distance
    product = ((radius_a + radius_b) ** 2 - square) * (square - (radius_b - radius_a) ** 2)
    root = math.sqrt(max(product, 0.0)) / (2.0 * square)
    share = (radius_a**2 - radius_b**2) / (2.0 * square)
    middle_x = 0.5 * (a[0] + b[0]) + dx * share
    middle_y = 0.5 * (a[1] + b[1]) + dy * share
    return CircleIntersections(
        (middle_x + dy * root, middle_y - dx * root),
        (middle_x - dy * root, middle_y + dx * root),
        0.0,
    )


def two_landmark_fix(
    first: RangeBearing,
    second: RangeBearing,
    landmarks: Mapping[int, Landmark],
    camera_forward: float,
    settings: FixSettings = DEFAULT_FIX,
) -> Fix | FixRefusal:
    """The paper's fix: circles, the right intersection by the bearings, then least squares."""
    if first.landmark == second.landmark:
        return _one_landmark(first.landmark)
    pair = (first.landmark, second.landmark)
    try:
        a, b = landmarks[first.landmark], landmarks[second.landmark]
    except KeyError as error:
        return FixRefusal(f"Landmark {error.args[0]} is not on the map.", "none", pair)
    if a.position == b.position:
        return FixRefusal(
            f"Landmarks {a.id} and {b.id} are mapped at the same place.", "contradiction", pair
        )
    meeting = circle_intersections(a.position, b.position, first.range, second.range)
    allowed = settings.slack + settings.gate * math.hypot(first.range_sigma, second.range_sigma)
    if meeting.gap > allowed:
        return FixRefusal(
            f"The distances to landmarks {a.id} and {b.id} do not fit the map: their circles miss "
            f"each other by {100 * meeting.gap:.0f} cm.",
            "no_intersection",
            pair,
        )
    # The right point sees both landmarks under the measured difference of bearing.
    measured = second.bearing - first.bearing
    camera: Point = min(
        (meeting.first, meeting.second),
        key=lambda p: abs(wrap_angle(_direction(p, b) - _direction(p, a) - measured)),
    )
    heading = _mean_angle(
        _direction(camera, a) - first.bearing, _direction(camera, b) - second.bearing
    )
    base = Pose2D(*camera, heading).compose(Pose2D(-camera_forward, 0.0, 0.0))
    mount = Pose2D(camera_forward, 0.0, 0.0)
    return _finish(base, [first, second], [mount, mount], landmarks, settings)


def fix(
    measurements: Sequence[RangeBearing],
    landmarks: Mapping[int, Landmark],
    camera_forward: float,
    settings: FixSettings = DEFAULT_FIX,
    mounts: Sequence[Pose2D] | None = None,
) -> Fix | FixRefusal:
    """The pose of `base_link` from all ``measurements``, outliers left out.

    A robot that moved between the measurements gives ``mounts``: for each measurement the pose of
    the camera's axis (looking straight ahead) in the frame of the wanted `base_link`. Without them
    it stood still. Measurements of unknown landmarks are ignored.
    """
    if mounts is None:
        mounts = [Pose2D(camera_forward, 0.0, 0.0)] * len(measurements)
    clusters = _clusters(measurements, landmarks, mounts, settings)
    if not clusters:
        return FixRefusal("No landmark of the map has been seen.", "none")
    if len(clusters) == 1:
        return _one_landmark(clusters[0].landmark.id)
    best = _consensus(clusters, settings)
    if best is None:
        ids = tuple(sorted(cluster.landmark.id for cluster in clusters))
        return FixRefusal(
            f"Landmarks {_listed(ids)} contradict each other: what was measured does not fit "
            "where the map has them.",
            "contradiction",
            ids,
        )
    pose, agreeing = best
    outliers = {cluster.landmark.id for cluster in clusters if cluster not in agreeing}
    chosen = [index for cluster in agreeing for index in cluster.members]
    answer = _finish(
        pose,
        [measurements[i] for i in chosen],
        [mounts[i] for i in chosen],
        landmarks,
        settings,
    )
    if isinstance(answer, FixRefusal):
        return answer
    return Fix(answer.pose, answer.covariance, answer.landmarks, tuple(sorted(outliers)))


def _clusters(
    measurements: Sequence[RangeBearing],
    landmarks: Mapping[int, Landmark],
    mounts: Sequence[Pose2D],
    settings: FixSettings,
) -> list[_Cluster]:
    """Per landmark the largest set of sightings that agree; a wrong id stays in the minority."""
    seen: dict[int, list[int]] = {}
    places: list[Point] = []
    for index, (measurement, mount) in enumerate(zip(measurements, mounts, strict=True)):
        known = measurement.landmark in landmarks and math.isfinite(measurement.range_sigma)
        if known and math.isfinite(measurement.range) and math.isfinite(measurement.bearing):
            seen.setdefault(measurement.landmark, []).append(index)
            bearing = measurement.bearing
            local = (measurement.range * math.cos(bearing), measurement.range * math.sin(bearing))
            places.append(mount.to_parent(local))
        else:
            places.append((math.nan, math.nan))
    clusters = []
    for number, indices in seen.items():
        points = np.array([places[i] for i in indices])
        sigmas = np.array([_place_sigma(measurements[i], settings) for i in indices])
        apart = np.hypot(*(points[:, None] - points[None]).transpose(2, 0, 1))
        allowed = settings.slack + settings.gate * np.maximum(sigmas[:, None], sigmas[None])
        agree = apart <= allowed
        # Of equally large sets the one around the newest sighting: the robot may have been moved.
        votes = agree.sum(axis=1)
        centre = len(indices) - 1 - int(np.argmax(votes[::-1]))
        members = np.flatnonzero(agree[centre])
        middle = np.median(points[members], axis=0)
        clusters.append(
            _Cluster(
                landmarks[number],
                tuple(indices[i] for i in members),
                (float(middle[0]), float(middle[1])),
                float(np.median(sigmas[members])),
            )
        )
    return clusters


def _consensus(
    clusters: list[_Cluster], settings: FixSettings
) -> tuple[Pose2D, list[_Cluster]] | None:
    """The pose that most landmarks agree with; None where not even two do, or it is a draw."""
    found: list[_Candidate] = []
    for first, second in combinations(clusters, 2):
        pose = _align(first, second, settings)
        if pose is None:
            continue
        agreeing, cost = [], 0.0
        for cluster in clusters:
            place = pose.to_parent(cluster.local)
            error = math.dist(place, cluster.landmark.position)
            allowed = settings.slack + settings.gate * cluster.sigma
            if error <= allowed:
                agreeing.append(cluster)
                cost += error / allowed
        if len(agreeing) >= 2:
            plausible = cost <= _PLAUSIBLE * len(agreeing)
            sightings = sum(len(c.members) for c in agreeing)
            score = (len(agreeing), plausible, sightings, -cost)
            found.append(_Candidate(score, pose, agreeing))
    if not found:
        return None
    best = max(found, key=lambda one: one.score)
    ids = {cluster.landmark.id for cluster in best.agreeing}
    for rival in found:
        others = {cluster.landmark.id for cluster in rival.agreeing}
        if rival.score[:2] < best.score[:2] or others == ids:
            continue
        # As many landmarks for a pose somewhere else: who is right?
        apart = math.dist(best.pose.position, rival.pose.position)
        if not ids & others or apart > _ELSEWHERE:
            return None
    return best.pose, best.agreeing


def _align(first: _Cluster, second: _Cluster, settings: FixSettings) -> Pose2D | None:
    """The pose that puts two landmarks of the robot's frame on their mapped places."""
    (ax, ay), (bx, by) = first.local, second.local
    (mx, my), (nx, ny) = first.landmark.position, second.landmark.position
    seen, mapped = math.hypot(bx - ax, by - ay), math.hypot(nx - mx, ny - my)
    allowed = settings.slack + settings.gate * math.hypot(first.sigma, second.sigma)
    if min(seen, mapped) < 0.05 or abs(seen - mapped) > allowed:
        return None
    heading = wrap_angle(math.atan2(ny - my, nx - mx) - math.atan2(by - ay, bx - ax))
    turned = Pose2D(0.0, 0.0, heading)
    middle = turned.to_parent((0.5 * (ax + bx), 0.5 * (ay + by)))
    return Pose2D(0.5 * (mx + nx) - middle[0], 0.5 * (my + ny) - middle[1], heading)


def _finish(
    pose: Pose2D,
    measurements: list[RangeBearing],
    mounts: list[Pose2D],
    landmarks: Mapping[int, Landmark],
    settings: FixSettings,
) -> Fix | FixRefusal:
    """Gauss-Newton on all ranges and bearings from a first guess, and the verdict on it."""
    ids = tuple(sorted({measurement.landmark for measurement in measurements}))
    counts = {i: sum(m.landmark == i for m in measurements) for i in ids}
    state = np.array(pose)
    information = np.zeros((3, 3))
    worst, culprit = 0.0, ids[0]
    for _ in range(8):
        information = np.zeros((3, 3))
        gradient = np.zeros(3)
        worst = 0.0
        for measurement, mount in zip(measurements, mounts, strict=True):
            mark = landmarks[measurement.landmark]
            cos, sin = math.cos(state[2]), math.sin(state[2])
            arm_x, arm_y = cos * mount.x - sin * mount.y, sin * mount.x + cos * mount.y
            dx, dy = mark.x - state[0] - arm_x, mark.y - state[1] - arm_y
            distance = max(math.hypot(dx, dy), 1e-6)
            ux, uy = dx / distance, dy / distance
            residual = np.array(
                [
                    measurement.range - distance,
                    wrap_angle(measurement.bearing - math.atan2(dy, dx) + state[2] + mount.heading),
                ]
            )
            jacobian = np.array(
                [
                    [-ux, -uy, ux * arm_y - uy * arm_x],
                    [uy / distance, -ux / distance, -(uy * arm_y + ux * arm_x) / distance - 1.0],
                ]
            )
            # Errors of the map and of the potentiometer repeat in every sighting of a landmark:
            # many sightings must not average them away, so each carries its share of them.
            share = counts[measurement.landmark]
            range_sigma = math.sqrt(measurement.range_sigma**2 + share * settings.survey_sigma**2)
            floor = settings.bearing_floor**2 + (settings.survey_sigma / distance) ** 2
            bearing_sigma = math.sqrt(measurement.bearing_sigma**2 + share * floor)
            weight = np.array([1.0 / range_sigma**2, 1.0 / bearing_sigma**2])
            information += (jacobian.T * weight) @ jacobian
            gradient += (jacobian.T * weight) @ residual
            alone = math.hypot(measurement.range_sigma, settings.survey_sigma)
            turned = math.hypot(measurement.bearing_sigma, math.sqrt(floor))
            excess = max(
                abs(residual[0]) / (settings.slack + settings.gate * alone),
                distance * abs(residual[1]) / (settings.slack + settings.gate * distance * turned),
            )
            if excess > worst:
                worst, culprit = float(excess), measurement.landmark
        try:
            step = np.linalg.solve(information, gradient)
        except np.linalg.LinAlgError:
            return _one_direction(ids)
        state = state + step
        if float(np.abs(step).max()) < 1e-6:
            break
    if worst > 1.0:
        return FixRefusal(
            f"Landmark {culprit} contradicts the map: no pose fits all that was measured.",
            "contradiction",
            (culprit,),
        )
    covariance = covariance_of(information)
    if covariance is None:
        return _one_direction(ids)
    largest = math.sqrt(float(np.linalg.eigvalsh(covariance[:2, :2])[-1]))
    if largest > settings.max_position_sigma or covariance[2, 2] > settings.max_heading_sigma**2:
        return _one_direction(ids)
    solved = Pose2D(float(state[0]), float(state[1]), wrap_angle(float(state[2])))
    return Fix(solved, covariance, ids)


def covariance_of(information: Array) -> Array | None:
    """The inverse of an information matrix; None where that does not tell all of the state.

    Rounding makes of a matrix that is singular but for the last digits one that has an inverse,
    with variances below zero.
    """
    values = np.linalg.eigvalsh(information)
    if not values[0] > _SINGULAR * values[-1]:
        return None
    inverse = np.linalg.inv(information)
    return np.asarray(0.5 * (inverse + inverse.T), dtype=np.float64)


def _place_sigma(measurement: RangeBearing, settings: FixSettings) -> float:
    """How far off, in metres, the place of a landmark in the robot's frame may be (1 sigma)."""
    turned = math.hypot(measurement.bearing_sigma, settings.bearing_floor)
    return math.hypot(
        measurement.range_sigma, measurement.range * turned, math.sqrt(2) * settings.survey_sigma
    )


def _one_landmark(number: int) -> FixRefusal:
    return FixRefusal(
        f"Only landmark {number} has been seen: a fix needs two.", "one_landmark", (number,)
    )


def _one_direction(ids: tuple[int, ...]) -> FixRefusal:
    return FixRefusal(
        f"Landmarks {_listed(ids)} stand too much in one direction to tell the pose from them.",
        "one_direction",
        ids,
    )


def _direction(point: Point, landmark: Landmark) -> float:
    return math.atan2(landmark.y - point[1], landmark.x - point[0])


def _mean_angle(a: float, b: float) -> float:
    return math.atan2(math.sin(a) + math.sin(b), math.cos(a) + math.cos(b))


def _listed(ids: tuple[int, ...]) -> str:
    words = [str(number) for number in ids]
    return words[0] if len(words) == 1 else f"{', '.join(words[:-1])} and {words[-1]}"
