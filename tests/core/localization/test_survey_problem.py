"""The least squares of a survey: derivatives, the solver's change of variables, covariances."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from core.localization.surveying import drive

from polepilot.core.geometry import Pose2D
from polepilot.core.localization.survey_problem import DISTORTIONS, Known, Problem
from polepilot.core.localization.survey_run import SurveyRun
from polepilot.core.localization.survey_solve import covariance, solve
from polepilot.core.localization.survey_start import first_map
from polepilot.core.localization.survey_track import build_track


def small(known: Known | None = None, seconds: float = 12.0) -> tuple[Problem, np.ndarray]:
    """The first seconds of a drive, and a state that is a little wrong everywhere."""
    run = drive("room", 3).run
    pictures = tuple(p for p in run.pictures if p[0] < seconds)
    run = replace(run, pictures=pictures)
    first = first_map(run)
    track = build_track(run, np.array(sorted(first.poses)), first.cuts)
    known = known or Known(first=Pose2D(0.0, 0.0, 0.0))
    problem = Problem(run, track, sorted(first.poles), known)
    nodes = np.zeros((problem.nodes, 3))
    for index, node in enumerate(track.node_of.tolist()):
        nodes[node] = first.poses[index]
    state = problem.pack(nodes, first.poles)
    state += np.random.default_rng(1).normal(0, 0.01, problem.size)
    return problem, state


def test_derivatives_are_those_of_the_residuals() -> None:
    problem, _ = small()
    a, b, *_ = problem.poles
    problem, state = small(
        Known(
            places={a: ((1.0, 2.0), 0.01)},
            distance=(a, b, 3.0, 0.01),
            first=Pose2D(0.1, 0.2, 3.0),
        )
    )
    exact = problem.jacobian(state).toarray()
    step = 1e-6
    for column in range(problem.size):
        way = np.zeros(problem.size)
        way[column] = step
        slope = (problem.residuals(state + way) - problem.residuals(state - way)) / (2 * step)
        assert exact[:, column] == pytest.approx(slope, rel=1e-5, abs=2e-4)


def test_the_solver_ends_at_the_minimum() -> None:
    problem, state = small()
    found = solve(problem, state, "soft_l1", 3.0)
    assert found.converged
    residuals = problem.residuals(found.state)
    weight = 1 / np.sqrt(1 + (residuals / 3.0) ** 2)
    jacobian = problem.jacobian(found.state).toarray()
    slope = jacobian.T @ (weight * residuals)
    step = np.linalg.solve(jacobian.T @ (weight[:, None] * jacobian), slope)
    # What is left to go, in standard deviations.
    assert math.sqrt(slope @ step) < 0.02
    assert np.abs(step[problem.pole_columns]).max() < 1e-4
    again = solve(
        problem, state + np.random.default_rng(2).normal(0, 0.02, problem.size), "soft_l1", 3.0
    )
    assert again.cost == pytest.approx(found.cost, rel=1e-4)
    assert again.state[problem.pole_columns] == pytest.approx(
        found.state[problem.pole_columns], abs=5e-4
    )


def test_covariance_is_the_inverse_of_the_information() -> None:
    problem, state = small()
    state = solve(problem, state, "soft_l1", 3.0).state
    got = covariance(problem, state, "soft_l1", 3.0)
    residuals = problem.residuals(state)
    weight = 1 / np.sqrt(1 + (residuals / 3.0) ** 2)
    jacobian = problem.jacobian(state).toarray()
    whole = np.linalg.inv(jacobian.T @ (weight[:, None] * jacobian))
    columns = np.r_[problem.pole_columns, problem.distortion_columns]
    expected = whole[np.ix_(columns, columns)]
    scale = np.sqrt(np.outer(np.diag(expected), np.diag(expected)))
    assert got / scale == pytest.approx(expected / scale, abs=1e-3)
    assert len(got) == 2 * len(problem.poles) + DISTORTIONS


def test_rejected_sightings_pull_nothing() -> None:
    problem, state = small()
    out = np.zeros(len(problem.pole), dtype=bool)
    out[::2] = True
    kept = np.count_nonzero(problem.jacobian(state).getnnz(axis=1))
    problem.rejected = out
    jacobian = problem.jacobian(state)
    jacobian.eliminate_zeros()
    assert np.count_nonzero(jacobian.getnnz(axis=1)) == kept - 2 * int(out.sum())


def test_links_are_the_exact_arcs_of_the_odometry() -> None:
    run = drive("room", 4).run
    used = np.arange(80, 300)
    track = build_track(run, used, frozenset())
    moved, derivative = track.moved(np.array([0.05, 0.02, 0.0, 0.0]))
    for link in (0, 37, 100):
        begin, end = track.stamps[track.first[link]], track.stamps[track.first[link] + 1]
        expected = run.history.advance(Pose2D(0, 0, 0), begin, end, 1.05, 0.02)
        assert moved[link] == pytest.approx(expected, abs=1e-12)
    step = 1e-6
    for k in range(4):
        way = np.zeros(4)
        way[k] = step
        slope = (track.moved(way)[0] - track.moved(-way)[0]) / (2 * step)
        at_zero = track.moved(np.zeros(4))[1]
        assert at_zero[:, :, k] == pytest.approx(slope, abs=1e-6)
    assert derivative.shape == (len(track.first), 3, 4)


def test_pictures_while_standing_share_a_node() -> None:
    run = drive("room", 4).run
    track = build_track(run, np.arange(len(run.pictures)), frozenset())
    standing = [i for i, (stamp, _) in enumerate(run.pictures) if stamp < 6.9]
    assert set(track.node_of[standing].tolist()) == {0}
    assert len(track.first) == len(track.stamps) - 1
    cut = build_track(run, np.arange(len(run.pictures)), frozenset({40}))
    assert set(cut.node_of[standing].tolist()) == {0, 1}
    assert len(cut.first) == len(cut.stamps) - 2


def test_a_run_without_a_link_still_makes_a_track() -> None:
    run = drive("room", 4).run
    still = SurveyRun((), run.pictures[:5], run.wheelbase, run.camera_forward)
    track = build_track(still, np.arange(5), frozenset())
    assert track.node_of.tolist() == [0] * 5
    assert track.moved(np.zeros(4))[0].shape == (0, 3)
    assert math.isclose(track.stamps[0], run.pictures[0][0])
