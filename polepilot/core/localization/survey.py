"""Map building: where all poles stand, and the path, from one recorded drive.

`survey_start` makes a first map, `survey_problem` states the least squares, `survey_solve` solves
it; here is the order of things, what is not believed, and how a hand-measured map comes in.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from polepilot.core.errors import InputError
from polepilot.core.geometry import Point, Pose2D, wrap_angle
from polepilot.core.localization import survey_problem as parts
from polepilot.core.localization.survey_align import Overlay, fit_rigid, free_covariance, overlay
from polepilot.core.localization.survey_problem import Known, Problem
from polepilot.core.localization.survey_result import Survey, SurveyedPole, Unplaced, Value
from polepilot.core.localization.survey_run import SurveyRun, Track, build_track
from polepilot.core.localization.survey_solve import covariance, solve
from polepilot.core.localization.survey_start import FirstMap, first_map

Array = NDArray[np.float64]
Progress = Callable[[str, float], None]
"""What is being done, and how much of it, 0 to 1."""

FEWEST_AGREEING = 3
"""So many poles of a hand-measured map have to agree before any other is called wrong."""
_LEAST_DRIVE = 0.5
_FEWEST_SIGHTINGS = 3
_LEAST_SHARE = 0.5
"""Of a pole's sightings that have to agree on its place."""
_BLUNDER = 5.0
"""Sightings farther off than this many sigmas are not used."""
_WIDTH = 3.0
_SAME_PLACE = 0.15
_ECHO = 0.3
"""A pole in the place of another that was seen so much more often is that one, misread."""
_LEAST_MOVE, _MOVE_SIGMAS = 0.04, 4.0
"""A pole is called wrong if it is off by more than this, in metres and in sigmas."""
_SCALES = np.round(np.arange(-0.03, 0.0301, 0.0025), 4)
_SCALE_SIGMA = 0.01
_LEARNT_RANGE = 0.02
"""How wrong all ranges may be where something else says how large the map is."""


@dataclass(frozen=True, slots=True)
class SurveyOptions:
    """What is known besides the recording. Metres.

    Raises:
        InputError: an impossible value.
    """

    hand_measured: Mapping[int, Point] = field(default_factory=dict)
    """A map to refine."""
    map_sigma: float = 0.01
    """How well it was measured, per coordinate."""
    anchors: Mapping[int, Point] = field(default_factory=dict)
    """Poles that define the coordinates; none, or two and more."""
    anchor_sigma: float = 0.002
    distance: tuple[int, int, float] | None = None
    """Two poles and how far apart they stand."""
    distance_sigma: float = 0.005
    start: Pose2D | None = None
    """Where the drive began, if coordinates refer to that; else it began at the origin."""
    range_sigma: float = 0.001
    """How wrong all ranges may be together, as a share: landmarks' size, camera constant."""

    def __post_init__(self) -> None:
        for name in ("map_sigma", "anchor_sigma", "distance_sigma", "range_sigma"):
            value = getattr(self, name)
            if not 0 < value < 10:
                raise InputError(f"{name.replace('_', '-')} is {value:g}: expected more than 0.")
        if len(self.anchors) == 1:
            raise InputError("one anchor is given: expected two or more, or none.")
        if self.anchors and self.hand_measured:
            raise InputError("anchors and a map to refine exclude each other: expected one.")
        if self.distance is not None:
            a, b, metres = self.distance
            if a == b or not 0 < metres < math.inf:
                raise InputError(
                    f"distance {a} {b} {metres:g}: expected two different poles, and metres."
                )


def survey(
    run: SurveyRun, options: SurveyOptions | None = None, progress: Progress | None = None
) -> Survey:
    """Estimate all poles and the path together.

    Raises:
        InputError: what the recording or the options lack, in words.
    """
    options = options or SurveyOptions()
    tell = progress or (lambda _text, _share: None)
    if run.sightings() == 0:
        raise InputError(f"no landmark was seen in {len(run.pictures)} pictures.")
    if run.travelled() < _LEAST_DRIVE:
        raise InputError(
            f"the robot drove {run.travelled():.2f} m: expected at least {_LEAST_DRIVE} m, better "
            "a round past all poles."
        )
    _check_known(run, options)
    first = first_map(run, lambda share: tell("first map", share))
    work = _Work(run, first, tell)
    _check_named(work, options)
    if options.hand_measured:
        return _refined(work, options)
    known, frame = work.frame(options)
    work.settle(known)
    _check_named(work, options)
    return work.result(frame, options)


class _Work:
    """A survey in the making: problem, state, and the poles that are still believed in."""

    def __init__(self, run: SurveyRun, first: FirstMap, tell: Progress) -> None:
        self.run, self.tell = run, tell
        self.dropped: dict[int, str] = dict(first.apart)
        self.places = dict(first.poles)
        self._require_two()
        used = np.array(sorted(first.poses), dtype=np.intp)
        self.track: Track = build_track(run, used, first.cuts)
        nodes: list[Pose2D | None] = [None] * len(self.track.stamps)
        for index in used.tolist():
            node = int(self.track.node_of[index])
            nodes[node] = nodes[node] or first.poses[index]
        self.nodes = np.array(nodes, dtype=float)
        self.cuts = len(first.cuts)
        self.distortion = np.zeros(parts.DISTORTIONS)
        self.known = Known()
        self.problem: Problem
        self.state: Array
        self.covariance: Array
        self.misfit = 0.0
        self.notes: list[str] = []

    def frame(self, options: SurveyOptions) -> tuple[Known, str]:
        """Bring the first map into the coordinates that are asked for."""
        scale = options.range_sigma if options.distance is None else _LEARNT_RANGE
        distance = None if options.distance is None else (*options.distance, options.distance_sigma)
        if options.anchors:
            self.move(fit_rigid(self.places, options.anchors, tuple(options.anchors)))
            anchors = {k: (place, options.anchor_sigma) for k, place in options.anchors.items()}
            return Known(places=anchors, distance=distance, range_sigma=_LEARNT_RANGE), "anchors"
        start = options.start or Pose2D(0.0, 0.0, 0.0)
        here = Pose2D(*(float(v) for v in self.nodes[0]))
        self.move(start.compose(here.inverse()))
        frame = "first pose" if options.start is None else "start"
        return Known(first=start, distance=distance, range_sigma=scale), frame

    def move(self, pose: Pose2D) -> None:
        """Bring poles and nodes into the frame in which their origin is at ``pose``."""
        self.places = {k: pose.to_parent(place) for k, place in self.places.items()}
        self.nodes = np.array([pose.compose(Pose2D(*node)) for node in self.nodes.tolist()])

    def settle(self, known: Known) -> None:
        """Solve robustly, leave out what is not believed, and solve again."""
        self.known = known
        while True:
            self._solve("cauchy", None)
            ranges, bearings = self.problem.sighting_residuals(self.state)
            rejected = np.maximum(np.abs(ranges), np.abs(bearings)) > _BLUNDER
            doubtful = self._doubtful(rejected)
            if not doubtful:
                break
            self.dropped |= doubtful
            for number in doubtful:
                del self.places[number]
            self._require_two()
        self._solve("soft_l1", rejected)
        self.tell("uncertainty", 0.0)
        self.covariance = covariance(self.problem, self.state, "soft_l1", _WIDTH)
        ranges, bearings = self.problem.sighting_residuals(self.state)
        kept = np.concatenate([ranges[~rejected], bearings[~rejected]])
        # Half of them, and more where outliers are, say what the rest should look like.
        self.misfit = float(np.median(np.abs(kept))) / 0.6745
        self.covariance *= max(self.misfit, 1.0) ** 2

    def _solve(self, loss: str, rejected: NDArray[np.bool_] | None) -> None:
        label = "robust fit" if rejected is None else "final fit"
        known = self._without_dropped(self.known)
        problem = Problem(self.run, self.track, sorted(self.places), known, rejected)
        state = problem.pack(self.nodes, self.places, self.distortion)
        # Nobody knows how many steps are left: each one halves what the bar has still to go.
        found = solve(problem, state, loss, _WIDTH, lambda step: self.tell(label, 1.0 - 0.85**step))
        self.problem, self.state = problem, found.state
        nodes, poles, self.distortion = problem.unpack(found.state)
        self.nodes = nodes.copy()
        self.places = {
            k: (float(x), float(y)) for k, (x, y) in zip(problem.poles, poles, strict=True)
        }
        if not found.converged:
            self.notes.append("the fit has not converged: do not trust it.")

    def _without_dropped(self, known: Known) -> Known:
        distance = known.distance
        if distance is not None and not {distance[0], distance[1]} <= set(self.places):
            distance = None
        places = {k: place for k, place in known.places.items() if k in self.places}
        return replace(known, places=places, distance=distance)

    def _doubtful(self, rejected: NDArray[np.bool_]) -> dict[int, str]:
        """Poles whose sightings do not agree on a place of their own."""
        counts = {k: self._count(index, rejected) for index, k in enumerate(self.problem.poles)}
        found: dict[int, str] = {}
        for number, (kept, away) in counts.items():
            total = kept + away
            if kept < _FEWEST_SIGHTINGS or kept < _LEAST_SHARE * total:
                found[number] = (
                    f"{away} of {total} sightings contradict the rest: it was moved, stands "
                    "twice, or is another pole misread"
                )
                continue
            for other, (more, _) in counts.items():
                near = math.dist(self.places[number], self.places[other]) < _SAME_PLACE
                if other != number and near and kept < _ECHO * more:
                    found[number] = f"was seen only where pole {other} stands: that one, misread"
        return found

    def _count(self, index: int, rejected: NDArray[np.bool_]) -> tuple[int, int]:
        """Sightings of a pole that are used and that are not."""
        own = self.problem.pole == index
        return int(np.sum(own & ~rejected)), int(np.sum(own & rejected))

    def _require_two(self) -> None:
        if len(self.places) >= 2:
            return
        placed = ", ".join(str(k) for k in self.places) or "none"
        seen = ", ".join(f"{k} ({n}x)" for k, n in sorted(sighting_counts(self.run).items()))
        raise InputError(
            f"poles that could be placed: {placed}; expected at least two that are seen from "
            f"several places. Seen: {seen}."
        )

    def free(self) -> Array:
        """Covariance of the poles' places as far as the map's own shape goes."""
        _, poles, _ = self.problem.unpack(self.state)
        count = 2 * len(poles)
        return free_covariance(poles, self.covariance[:count, :count])

    def result(
        self, frame: str, options: SurveyOptions, wrong: frozenset[int] = frozenset()
    ) -> Survey:
        """Everything that was found."""
        _, poles, distortion = self.problem.unpack(self.state)
        tied = frame in ("anchors", "map")
        spread = self.covariance if tied else self.free()
        surveyed = []
        for index, number in enumerate(self.problem.poles):
            block = slice(2 * index, 2 * index + 2)
            kept, away = self._count(index, self.problem.rejected)
            surveyed.append(
                SurveyedPole(
                    id=number,
                    x=float(poles[index, 0]),
                    y=float(poles[index, 1]),
                    covariance=spread[block, block],
                    sightings=kept,
                    rejected=away,
                    measured=options.hand_measured.get(number),
                    wrong=number in wrong,
                )
            )
        sigma = np.sqrt(np.diag(self.covariance)[2 * len(poles) :])
        return Survey(
            poles=tuple(surveyed),
            not_placed=tuple(self._unplaced(options)),
            path=tuple(self._path()),
            frame=frame,
            distortions=_distortions(distortion, sigma),
            misfit=self.misfit,
            notes=tuple(self._all_notes(distortion, sigma)),
        )

    def _unplaced(self, options: SurveyOptions) -> list[Unplaced]:
        counts = sighting_counts(self.run)
        found = []
        for number in sorted({*counts, *options.hand_measured} - set(self.places)):
            count = counts.get(number, 0)
            reason = self.dropped.get(number) or (
                "was not seen"
                if count == 0
                else "was seen too seldom, or never at the same place: expected "
                f"{_FEWEST_SIGHTINGS} sightings that agree"
            )
            found.append(Unplaced(number, count, reason))
        return found

    def _path(self) -> list[tuple[float, Pose2D]]:
        found = []
        for (stamp, _), node in zip(self.run.pictures, self.track.node_of.tolist(), strict=True):
            if node >= 0:
                x, y, heading = self.nodes[node].tolist()
                found.append((stamp, Pose2D(x, y, wrap_angle(heading))))
        return found

    def _all_notes(self, distortion: Array, sigma: Array) -> list[str]:
        notes = list(dict.fromkeys(self.notes))
        if self.cuts:
            times = "once" if self.cuts == 1 else f"{self.cuts} times"
            notes.append(
                f"the recording falls into pieces {times} (a gap, or the robot was moved by hand)."
            )
        lost = len(self.run.pictures) - int(np.sum(self.track.node_of >= 0))
        if lost:
            notes.append(f"{lost} pictures could not be joined to the rest.")
        off = float(distortion[parts.RANGE])
        if abs(off) > max(3 * sigma[parts.RANGE], 0.004):
            way = "long" if off > 0 else "short"
            notes.append(
                f"ranges come out {100 * abs(off):.1f} % too {way}: check the camera constant and "
                "the size of the poles."
            )
        if self.misfit > 1.5:
            notes.append(
                f"sightings scatter {self.misfit:.1f} times as much as the detector says; all "
                "uncertainties were raised accordingly."
            )
        return notes


def sighting_counts(run: SurveyRun) -> dict[int, int]:
    """How often each pole was seen."""
    counts: dict[int, int] = {}
    for _, seen in run.pictures:
        for sighting in seen:
            counts[sighting.landmark] = counts.get(sighting.landmark, 0) + 1
    return counts


def _refined(work: _Work, options: SurveyOptions) -> Survey:
    """A hand-measured map put right: first without it, then with all of it that agrees."""
    hand = options.hand_measured
    free, _ = work.frame(replace(options, hand_measured={}))
    work.settle(free)
    _check_named(work, options)
    laid, scale = _lay_over(work, options)
    _check_agreement(laid)
    work.move(laid.pose)
    work.places = {
        k: (laid.pose.x + scale * (x - laid.pose.x), laid.pose.y + scale * (y - laid.pose.y))
        for k, (x, y) in work.places.items()
    }
    agreeing, wrong = set(laid.agreeing), frozenset(laid.contradicted)
    while True:
        places = {k: (hand[k], options.map_sigma) for k in agreeing}
        work.settle(replace(free, first=None, places=places, range_sigma=_LEARNT_RANGE))
        # With the map's own scale, some that looked wrong may turn out right after all.
        wrong = frozenset(k for k in wrong if k in work.places and _is_wrong(work, k, options))
        back = set(laid.contradicted) & set(work.places) - wrong - agreeing
        if not back:
            break
        agreeing |= back
    if not laid.clear and wrong:
        work.notes.append(
            "which poles are wrong is not certain: others may be wrong in place of these."
        )
    return work.result("map", options, wrong)


def _lay_over(work: _Work, options: SurveyOptions) -> tuple[Overlay, float]:
    """The free map laid over the hand-measured one, which also says how large it is."""
    spread = work.free()
    reach = {
        k: max(
            _LEAST_MOVE,
            _MOVE_SIGMAS * math.hypot(options.map_sigma, math.sqrt(spread[2 * i, 2 * i])),
        )
        for i, k in enumerate(work.problem.poles)
    }
    best: tuple[tuple[float, float], Overlay, float] | None = None
    for off in _SCALES.tolist():
        larger = {k: ((1 + off) * x, (1 + off) * y) for k, (x, y) in work.places.items()}
        laid = overlay(larger, options.hand_measured, reach)
        if laid is None:
            continue
        misfit = sum(
            (math.dist(laid.pose.to_parent(larger[k]), options.hand_measured[k]) / reach[k]) ** 2
            for k in laid.agreeing
        )
        rank = (-float(len(laid.agreeing)), misfit + (off / _SCALE_SIGMA) ** 2)
        if best is None or rank < best[0]:
            best = rank, laid, 1 + off
    if best is None:
        raise InputError(
            "the map and the recording have no two poles in common whose distance agrees: is it "
            "the right map?"
        )
    return best[1], best[2]


def _check_agreement(laid: Overlay) -> None:
    common = len(laid.agreeing) + len(laid.contradicted)
    if common < FEWEST_AGREEING:
        raise InputError(
            f"the map and the recording have {common} poles in common: expected at least "
            f"{FEWEST_AGREEING} to refine a map."
        )
    if len(laid.agreeing) < FEWEST_AGREEING or 2 * len(laid.agreeing) <= common:
        raise InputError(
            f"only {len(laid.agreeing)} of {common} poles of the map agree with the recording: "
            "it cannot be told which ones are wrong. Measure again, or survey without the map."
        )


def _is_wrong(work: _Work, number: int, options: SurveyOptions) -> bool:
    """Whether a pole that was left free in the fit stands elsewhere than it was measured."""
    index = work.problem.poles.index(number)
    block = work.covariance[2 * index : 2 * index + 2, 2 * index : 2 * index + 2]
    x, y = work.places[number]
    off = np.array([x, y]) - np.array(options.hand_measured[number])
    spread = block + np.eye(2) * options.map_sigma**2
    return bool(
        np.hypot(*off) > _LEAST_MOVE and off @ np.linalg.solve(spread, off) > _MOVE_SIGMAS**2
    )


def _check_known(run: SurveyRun, options: SurveyOptions) -> None:
    """Poles that options name have to be in the recording."""
    counts = sighting_counts(run)
    named = [*options.anchors, *(options.distance[:2] if options.distance else ())]
    missing = [k for k in named if k not in counts]
    if missing:
        seen = ", ".join(str(k) for k in sorted(counts))
        raise InputError(f"pole {missing[0]} was never seen; the recording shows {seen}.")


def _check_named(work: _Work, options: SurveyOptions) -> None:
    """Poles that options name have to be on the map."""
    for number in [*options.anchors, *(options.distance[:2] if options.distance else ())]:
        if number not in work.places:
            reason = work.dropped.get(number, "was seen too seldom")
            raise InputError(f"pole {number} is named, but could not be placed: {reason}.")


def _distortions(distortion: Array, sigma: Array) -> dict[str, Value]:
    names: Sequence[tuple[str, int, float]] = (
        ("speed_scale", parts.SPEED, 1.0),
        ("steering_offset", parts.STEERING, 0.0),
        ("servo_lag", parts.SERVO_LAG, 0.0),
        ("motor_lag", parts.MOTOR_LAG, 0.0),
        ("range_scale", parts.RANGE, 1.0),
        ("pan_offset", parts.PAN, 0.0),
        ("pan_scale", parts.PAN + 1, 0.0),
        ("pan_bow", parts.PAN + 2, 0.0),
    )
    return {name: Value(base + float(distortion[k]), float(sigma[k])) for name, k, base in names}
