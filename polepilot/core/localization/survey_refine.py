"""A hand-measured map put right, and which of its poles was measured wrongly."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from polepilot.core.errors import InputError
from polepilot.core.localization.survey_align import Overlay, overlay
from polepilot.core.localization.survey_result import Survey
from polepilot.core.localization.survey_run import SurveyOptions
from polepilot.core.localization.survey_work import LEARNT_RANGE, Work

FEWEST_AGREEING = 3
"""So many poles of a hand-measured map have to agree before any other is called wrong."""
_LEAST_MOVE, _MOVE_SIGMAS = 0.04, 4.0
"""A pole is called wrong if it is off by more than this, in metres and in sigmas."""
_SCALES = np.round(np.arange(-0.03, 0.0301, 0.0025), 4)
_SCALE_SIGMA = 0.01


def refine(work: Work, options: SurveyOptions) -> Survey:
    """A hand-measured map put right: first without it, then with all of it that agrees."""
    hand = options.hand_measured
    free, _ = work.frame(replace(options, hand_measured={}))
    work.settle(free)
    work.check_named(options)
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
        work.settle(replace(free, first=None, places=places, range_sigma=LEARNT_RANGE))
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


def _lay_over(work: Work, options: SurveyOptions) -> tuple[Overlay, float]:
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


def _is_wrong(work: Work, number: int, options: SurveyOptions) -> bool:
    """Whether a pole that was left free in the fit stands elsewhere than it was measured."""
    index = work.problem.poles.index(number)
    block = work.covariance[2 * index : 2 * index + 2, 2 * index : 2 * index + 2]
    x, y = work.places[number]
    off = np.array([x, y]) - np.array(options.hand_measured[number])
    spread = block + np.eye(2) * options.map_sigma**2
    return bool(
        np.hypot(*off) > _LEAST_MOVE and off @ np.linalg.solve(spread, off) > _MOVE_SIGMAS**2
    )
