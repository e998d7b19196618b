"""Trajectories compared: errors that are known, alignment that is exact, honesty that is drawn."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from polepilot.core.errors import DatasetError
from polepilot.core.evaluation import (
    INSIDE_95,
    Comparison,
    Covariances,
    compare,
    covariances_of,
    read_covariances,
)
from polepilot.core.trajectory import Trajectory


def drive(count: int = 200) -> Trajectory:
    """A figure of eight whose heading runs through the full turn."""
    t = np.linspace(0.0, 20.0, count)
    x, y = 3 * np.sin(t / 3), 2 * np.sin(2 * t / 3)
    heading = np.arctan2(np.gradient(y), np.gradient(x))
    return Trajectory(t, np.stack([x, y, heading], axis=1))


def found(comparison: Comparison | None) -> Comparison:
    assert comparison is not None
    return comparison


def test_errors_that_are_known() -> None:
    truth = Trajectory(np.array([0.0, 1.0]), np.array([[0.0, 0.0, 3.1], [1.0, 0.0, -3.1]]))
    stamps = np.array([0.0, 0.25, 0.5, 1.0])
    offsets = np.array([0.03, -0.04, 0.0, 0.05])
    poses = np.array([[t, off, math.pi] for t, off in zip(stamps, offsets, strict=True)])
    one = found(compare(truth, Trajectory(stamps, poses), longest_gap=2.0))
    document = one.to_json()
    assert document["position"]["mean"] == pytest.approx(0.03)
    assert document["position"]["rmse"] == pytest.approx(math.sqrt(0.0050 / 4))
    assert document["position"]["max"] == pytest.approx(0.05)
    assert document["position"]["p95"] == pytest.approx(np.percentile(np.abs(offsets), 95))
    # The short way round: from 3.1 to -3.1 is 0.083, not 6.2.
    assert document["heading"]["max"] == pytest.approx(math.pi - 3.1)
    assert document["compared"] == 4
    assert document["aligned"] is document["nees"] is None
    assert document["longest_gap"] == 0.5


def test_nothing_is_made_up_where_the_truth_has_a_gap() -> None:
    truth = Trajectory(np.array([1.0, 1.1, 5.0, 5.1]), np.zeros((4, 3)))
    stamps = np.array([0.5, 1.0, 1.05, 1.1, 3.0, 5.0, 5.05, 5.2])
    one = found(compare(truth, Trajectory(stamps, np.ones((8, 3))), longest_gap=0.5))
    assert list(one.stamps) == [1.0, 1.05, 1.1, 5.0, 5.05]
    assert one.to_json()["left_out"] == 3
    assert compare(truth, Trajectory(np.array([9.0]), np.zeros((1, 3)))) is None
    assert compare(Trajectory(np.empty(0), np.empty((0, 3))), truth) is None


@settings(deadline=None, max_examples=60)
@given(
    st.floats(-5, 5),
    st.floats(-5, 5),
    st.floats(-3.1, 3.1),
)
def test_alignment_undoes_any_rigid_motion(dx: float, dy: float, turn: float) -> None:
    truth = drive()
    cos, sin = math.cos(turn), math.sin(turn)
    x, y, heading = truth.poses.T
    moved = np.stack([cos * x - sin * y + dx, sin * x + cos * y + dy, heading + turn], axis=1)
    one = found(compare(truth, Trajectory(truth.stamps, moved), align="se2"))
    assert one.aligned_offsets is not None
    assert np.abs(one.aligned_offsets).max() < 1e-9
    assert one.shift is not None
    assert math.sin(one.shift.rotation + turn) == pytest.approx(0, abs=1e-9)
    # What is not aligned says so: the errors are still those of the estimate as it is.
    assert one.distances.max() >= math.hypot(dx, dy) * (abs(turn) < 1e-12)
    plain = found(compare(truth, Trajectory(truth.stamps, moved)))
    assert plain.distances == pytest.approx(one.distances)


def test_alignment_is_the_best_there_is() -> None:
    rng = np.random.default_rng(4)
    truth = drive()
    seen = Trajectory(truth.stamps, truth.poses + rng.normal(0, 0.05, truth.poses.shape) + 0.1)
    one = found(compare(truth, seen, align="se2"))
    assert one.aligned_offsets is not None
    assert one.shift is not None

    def left(shift: tuple[float, float, float]) -> float:
        cos, sin = math.cos(shift[2]), math.sin(shift[2])
        x, y, _ = seen.poses.T
        dx = cos * x - sin * y + shift[0] - truth.poses[:, 0]
        return float(np.sum(dx**2 + (sin * x + cos * y + shift[1] - truth.poses[:, 1]) ** 2))

    best = (one.shift.x, one.shift.y, one.shift.rotation)
    for axis in range(3):
        for step in (1e-3, -1e-3):
            other = list(best)
            other[axis] += step
            assert left((other[0], other[1], other[2])) > left(best)


def test_a_standing_robot_can_be_aligned() -> None:
    truth = Trajectory(np.arange(5.0), np.zeros((5, 3)))
    seen = Trajectory(np.arange(5.0), np.full((5, 3), 0.2))
    one = found(compare(truth, seen, align="se2", longest_gap=1.0))
    assert one.shift is not None
    assert one.shift.rotation == 0.0
    assert one.to_json()["aligned"]["position"]["max"] == pytest.approx(0, abs=1e-12)


@pytest.mark.parametrize(("boast", "mean", "inside"), [(1.0, 3.0, 0.95), (0.5, 12.0, 0.42)])
def test_nees_of_errors_that_were_drawn(boast: float, mean: float, inside: float) -> None:
    """Errors drawn from their covariance are honest; one of half the sigma boasts."""
    rng = np.random.default_rng(9)
    truth = drive(4000)
    shape = np.array([[4e-4, 1e-4, 2e-5], [1e-4, 2e-4, -1e-5], [2e-5, -1e-5, 1e-4]])
    errors = rng.multivariate_normal(np.zeros(3), shape, 4000)
    claimed = Covariances(truth.stamps, np.tile(boast**2 * shape, (4000, 1, 1)))
    one = found(compare(truth, Trajectory(truth.stamps, truth.poses + errors), claimed))
    assert one.consistency is not None
    assert one.consistency.mean == pytest.approx(mean, rel=0.05)
    assert one.consistency.inside == pytest.approx(inside, abs=0.03)
    assert one.consistency.poses == 4000


def test_the_bound_holds_95_percent() -> None:
    rng = np.random.default_rng(1)
    squared = (rng.normal(size=(400_000, 3)) ** 2).sum(axis=1)
    assert np.mean(squared <= INSIDE_95) == pytest.approx(0.95, abs=0.002)


def test_only_poses_with_a_covariance_count() -> None:
    truth = drive(50)
    some = Covariances(truth.stamps[10:20] + 2e-4, np.tile(np.eye(3), (10, 1, 1)))
    one = found(compare(truth, truth, some))
    assert one.consistency is not None
    assert one.consistency.poses == 10
    elsewhere = Covariances(np.array([99.0]), np.eye(3)[None])
    assert found(compare(truth, truth, elsewhere)).consistency is None
    empty = covariances_of(np.empty(0), np.empty((0, 6)))
    assert found(compare(truth, truth, empty)).consistency is None


def test_covariances_are_read_as_they_are_written(tmp_path: Path) -> None:
    path = tmp_path / "a.cov"
    path.write_text("# t pxx pxy pxh pyy pyh phh\n\n1.5 4e-4 1e-4 2e-5 2e-4 -1e-5 1e-4\n")
    read = read_covariances(path)
    assert read.stamps.tolist() == [1.5]
    assert read.matrices[0, 0, 2] == read.matrices[0, 2, 0] == 2e-5
    assert read.matrices[0, 1, 1] == 2e-4
    assert read.matrices[0, 1, 2] == -1e-5


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("1 2 3\n", ":1: expected seven"),
        ("1 1 0 0 1 0 nan\n", ":1: expected seven"),
        ("# a\n1 1 0 0 1 0 x\n", ":2: expected seven"),
        ("1 1 0 0 1 0 1\n0 1 0 0 1 0 1\n", ":2: time 0.0 follows 1.0"),
        ("1 1 2 0 1 0 1\n", ":1: is no covariance"),
        ("1 1 0 0 0 0 1\n", ":1: is no covariance"),
        ("1 -1 0 0 1 0 1\n", ":1: is no covariance"),
    ],
)
def test_bad_covariances_are_named(tmp_path: Path, text: str, expected: str) -> None:
    path = tmp_path / "a.cov"
    path.write_text(text)
    with pytest.raises(DatasetError, match=expected):
        read_covariances(path)
    with pytest.raises(DatasetError, match=r"gone\.cov"):
        read_covariances(tmp_path / "gone.cov")
