"""A survey in the making: solve, look at what does not fit, leave it out, solve again."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from polepilot.core.errors import InputError
from polepilot.core.geometry import Point, Pose2D, wrap_angle
from polepilot.core.localization import survey_problem as parts
from polepilot.core.localization.survey_align import fit_rigid, free_covariance
from polepilot.core.localization.survey_problem import Known, Problem
from polepilot.core.localization.survey_result import Survey, SurveyedPole, Unplaced, Value
from polepilot.core.localization.survey_run import SurveyOptions, SurveyRun
from polepilot.core.localization.survey_solve import covariance, solve
from polepilot.core.localization.survey_start import FirstMap
from polepilot.core.localization.survey_track import Track, build_track

Array = NDArray[np.float64]
Progress = Callable[[str, float], None]
"""What is being done, and how much of it, 0 to 1."""

LEARNT_RANGE = 0.02
"""How wrong all ranges may be where something else says how large the map is."""
_FEWEST_SIGHTINGS = 3
_LEAST_SHARE = 0.5
"""Of a pole's sightings that have to agree on its place."""
_BLUNDER = 5.0
"""Sightings farther off than this many sigmas are not used."""
_WIDTH = 3.0
_FEWEST_ELSEWHERE, _SHARE_ELSEWHERE, _NEAR_ELSEWHERE = 5, 0.08, 0.3
"""So many sightings, and such a share of them, within so many metres: a second place."""
_SAME_PLACE = 0.15
_ECHO = 0.3
"""A pole in the place of another that was seen so much more often is that one, misread."""


class Work:
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
        self.converged = True
        """Whether the last fit has."""
        self.notes: list[str] = []

    def frame(self, options: SurveyOptions) -> tuple[Known, str]:
        """Bring the first map into the coordinates that are asked for."""
        scale = options.range_sigma if options.distance is None else LEARNT_RANGE
        distance = None if options.distance is None else (*options.distance, options.distance_sigma)
        if options.anchors:
            self.move(fit_rigid(self.places, options.anchors, tuple(options.anchors)))
            anchors = {k: (place, options.anchor_sigma) for k, place in options.anchors.items()}
            return Known(places=anchors, distance=distance, range_sigma=LEARNT_RANGE), "anchors"
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
        # The better half of them says what all should look like.
        kept = ~rejected
        halves = [np.median(np.abs(bearings[kept]))]
        if np.any(kept & self.problem.ranged):
            halves.append(np.median(np.abs(ranges[kept & self.problem.ranged])))
        self.misfit = float(max(halves)) / 0.6745
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
        self.converged = found.converged

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
            if elsewhere := self._second_place(number, rejected):
                x, y = self.places[number]
                found[number] = (
                    f"was seen at two places, near ({x:.2f}, {y:.2f}) and near "
                    f"({elsewhere[0]:.2f}, {elsewhere[1]:.2f}): two poles with this number, or it "
                    "was moved on the way"
                )
                continue
            for other, (more, _) in counts.items():
                near = math.dist(self.places[number], self.places[other]) < _SAME_PLACE
                if other != number and near and kept < _ECHO * more:
                    found[number] = f"was seen only where pole {other} stands: that one, misread"
        return found

    def _second_place(self, number: int, rejected: NDArray[np.bool_]) -> Point | None:
        """Another place at which many of a pole's sightings agree, and where no pole stands."""
        own = self.problem.pole == self.problem.poles.index(number)
        spots = self.problem.projected(self.state)[own & rejected]
        spots = spots[np.isfinite(spots).all(axis=1)]
        if len(spots) < max(_FEWEST_ELSEWHERE, _SHARE_ELSEWHERE * np.count_nonzero(own)):
            return None
        middle = np.median(spots, axis=0)
        near = np.hypot(*(spots - middle).T) < _NEAR_ELSEWHERE
        if np.count_nonzero(near) < 0.5 * len(spots):
            return None
        x, y = (float(v) for v in middle)
        misread = any(math.dist((x, y), place) < _NEAR_ELSEWHERE for place in self.places.values())
        return None if misread else (x, y)

    def check_named(self, options: SurveyOptions) -> None:
        """Poles that options name have to be on the map.

        Raises:
            InputError: one is not, and why.
        """
        for number in [*options.anchors, *(options.distance[:2] if options.distance else ())]:
            if number not in self.places:
                reason = self.dropped.get(number, "was seen too seldom")
                raise InputError(f"pole {number} is named, but could not be placed: {reason}.")

    def _count(self, index: int, rejected: NDArray[np.bool_]) -> tuple[int, int]:
        """Sightings of a pole that are used and that are not."""
        own = self.problem.pole == index
        return int(np.sum(own & ~rejected)), int(np.sum(own & rejected))

    def _require_two(self) -> None:
        if len(self.places) >= 2:
            return
        placed = ", ".join(str(k) for k in self.places) or "none"
        seen = ", ".join(f"{k} ({n}x)" for k, n in sorted(self.run.sighting_counts().items()))
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
            converged=self.converged,
        )

    def _unplaced(self, options: SurveyOptions) -> list[Unplaced]:
        counts = self.run.sighting_counts()
        found = []
        for number in sorted({*counts, *options.hand_measured} - set(self.places)):
            count = counts.get(number, 0)
            found.append(Unplaced(number, count, self.dropped.get(number) or self._why(number)))
        return found

    def _why(self, number: int) -> str:
        """Why a pole is not even on the first map."""
        own = [s for _, seen in self.run.pictures for s in seen if s.landmark == number]
        if not own:
            return "was not seen"
        if not any(math.isfinite(sighting.range) for sighting in own):
            return "was never seen whole: only its direction is known"
        return f"no {_FEWEST_SIGHTINGS} sightings agree on its place"

    def _path(self) -> list[tuple[float, Pose2D]]:
        found = []
        for (stamp, _), node in zip(self.run.pictures, self.track.node_of.tolist(), strict=True):
            if node >= 0:
                x, y, heading = self.nodes[node].tolist()
                found.append((stamp, Pose2D(x, y, wrap_angle(heading))))
        return found

    def _all_notes(self, distortion: Array, sigma: Array) -> list[str]:
        notes = list(dict.fromkeys(self.notes))
        if not self.converged:
            notes.append("the fit has not converged: do not trust it.")
        if self.cuts:
            breaks = "a break" if self.cuts == 1 else f"{self.cuts} breaks"
            notes.append(f"the recording has {breaks}: a gap, or the robot was moved by hand.")
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
