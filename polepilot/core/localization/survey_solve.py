"""Large sparse least squares, made easy for scipy's trust region by a change of variables.

An odometry chain is badly conditioned: a small turn at its beginning moves its end by metres, and
the iterative solver inside ``least_squares`` would need thousands of steps. The information matrix
of a start is factored once, A = L D Lᵀ, and the variables become z with x = x0 + D^-1/2 L^-T z: in
them one unit is one standard deviation in every direction, and a few steps are enough.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import sparse
from scipy.optimize import OptimizeResult, least_squares
from scipy.sparse.linalg import LinearOperator, SuperLU, splu, spsolve_triangular

from polepilot.core.errors import InternalError
from polepilot.core.localization.survey_problem import Problem

Array = NDArray[np.float64]

_ROUNDS = 8
_STEPS = 12
_REACH = 300.0
"""The first step may be so many standard deviations long."""
_CLOSE = 1e-3
"""Converged when a step is shorter than this many standard deviations."""


@dataclass(frozen=True, slots=True)
class Solution:
    """Where least squares ended."""

    state: Array
    cost: float
    steps: int
    converged: bool


def solve(
    problem: Problem,
    state: Array,
    loss: str,
    width: float,
    progress: Callable[[int], None] | None = None,
) -> Solution:
    """Minimize the problem's residuals from ``state`` on.

    Args:
        loss: scipy's name of a robust loss; beyond ``width`` standard deviations it sets in.
        progress: told the number of steps so far.
    """
    before_round = steps = 0

    def count(intermediate_result: OptimizeResult) -> None:
        nonlocal steps
        steps = before_round + int(intermediate_result.nit)
        if progress is not None:
            progress(steps)

    cost, converged = math.inf, False
    for _ in range(_ROUNDS):
        before_round = steps
        change = _Change(problem, state, loss, width)
        # A start of this length makes it scipy's first reach, and the measure of its tolerance.
        begin = np.full(problem.size, _REACH / math.sqrt(problem.size))
        found = least_squares(
            lambda z, c=change, b=begin: problem.residuals(c.state(z - b)),
            begin,
            jac=lambda z, c=change, b=begin: c.derivative(z - b),
            method="trf",
            tr_solver="lsmr",
            tr_options={"atol": 1e-5, "btol": 1e-5, "maxiter": 200},
            loss=loss,
            f_scale=width,
            xtol=_CLOSE / _REACH,
            ftol=1e-8,
            gtol=1e-9,
            max_nfev=_STEPS,
            callback=count,
        )
        state = change.state(found.x - begin)
        before, cost = cost, float(found.cost)
        moved = float(np.linalg.norm(found.x - begin))
        if moved < 1.0 or (found.status > 0 and before - cost < 1e-6 * max(cost, 1.0)):
            converged = True
            break
    return Solution(state, cost, steps, converged)


def covariance(problem: Problem, state: Array, loss: str, width: float) -> Array:
    """Of poles and distortions (in this order) at the minimum, with all the rest unknown."""
    factor = splu(_information(problem, state, loss, width).tocsc())
    columns = np.r_[problem.pole_columns, problem.distortion_columns]
    unit = np.zeros((problem.size, len(columns)))
    unit[columns, np.arange(len(columns))] = 1.0
    result: Array = factor.solve(unit)[columns]
    return 0.5 * (result + result.T)


class _Change:
    """x = x0 + P^T L^-T D^-1/2 z, from the information matrix P^T L D Lᵀ P at x0."""

    def __init__(self, problem: Problem, state: Array, loss: str, width: float) -> None:
        self._problem = problem
        self._origin = state
        factor: SuperLU = splu(
            _information(problem, state, loss, width).tocsc(),
            permc_spec="MMD_AT_PLUS_A",
            diag_pivot_thresh=0.0,
            options={"SymmetricMode": True},
        )
        if not np.array_equal(factor.perm_r, factor.perm_c):
            raise InternalError("the survey's information matrix is not positive definite.")
        self._place = factor.perm_c
        self._lower = factor.L.tocsr()
        self._upper = self._lower.T.tocsr()
        self._scale = 1.0 / np.sqrt(factor.U.diagonal())

    def state(self, z: Array) -> Array:
        return self._origin + self._forth(z)

    def derivative(self, z: Array) -> LinearOperator:
        jacobian = self._problem.jacobian(self.state(z))
        transposed = jacobian.T.tocsr()
        return LinearOperator(
            jacobian.shape,
            matvec=lambda v: jacobian @ self._forth(v),
            rmatvec=lambda v: self._back(transposed @ v),
            dtype=np.float64,
        )

    def _forth(self, z: Array) -> Array:
        solved: Array = spsolve_triangular(
            self._upper, self._scale * z.ravel(), lower=False, unit_diagonal=True
        )
        placed: Array = solved[self._place]
        return placed

    def _back(self, x: Array) -> Array:
        placed = np.empty_like(x)
        placed[self._place] = x.ravel()
        solved = spsolve_triangular(self._lower, placed, lower=True, unit_diagonal=True)
        scaled: Array = self._scale * solved
        return scaled


def _information(problem: Problem, state: Array, loss: str, width: float) -> Any:
    """Jᵀ W J with the weights that the loss gives the residuals."""
    residuals = problem.residuals(state)
    square = (residuals / width) ** 2
    if loss == "cauchy":
        weight = 1.0 / (1.0 + square)
    elif loss == "soft_l1":
        weight = 1.0 / np.sqrt(1.0 + square)
    else:
        raise InternalError(f"no weights are known for the loss {loss!r}.")
    jacobian = problem.jacobian(state)
    weighted = sparse.diags(np.maximum(weight, 1e-4)) @ jacobian
    return jacobian.T @ weighted
