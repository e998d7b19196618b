"""Trajectories on disk and their errors."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from polepilot.core.errors import DatasetError
from polepilot.core.geometry import Pose2D
from polepilot.core.trajectory import (
    ErrorStatistics,
    Trajectory,
    format_tum,
    heading_errors,
    position_errors,
    read_tum,
    write_tum,
)


def test_a_line_is_what_the_tools_expect() -> None:
    text = format_tum([1.5], [Pose2D(2.0, -3.0, math.pi / 2)])
    assert text == "1.500000 2.000000 -3.000000 0 0 0 0.707106781 0.707106781\n"


@settings(deadline=None, max_examples=50)
@given(
    st.lists(
        st.tuples(st.floats(-1e3, 1e3), st.floats(-1e3, 1e3), st.floats(-math.pi + 1e-6, math.pi)),
        min_size=1,
        max_size=8,
    )
)
def test_what_is_written_is_read_again(
    tmp_path_factory: pytest.TempPathFactory, poses: list[tuple[float, float, float]]
) -> None:
    path = tmp_path_factory.mktemp("tum") / "a.tum"
    stamps = [0.1 * index for index in range(len(poses))]
    write_tum(path, stamps, poses)
    back = read_tum(path)
    assert back.stamps == pytest.approx(stamps, abs=1e-6)
    assert back.poses[:, :2] == pytest.approx(np.array(poses)[:, :2], abs=1e-6)
    difference = back.poses[:, 2] - np.array(poses)[:, 2]
    assert np.sin(difference / 2) == pytest.approx(np.zeros(len(poses)), abs=1e-7)


def test_errors_are_measured_at_the_times_of_the_trajectory() -> None:
    reference = Trajectory(np.array([0.0, 2.0]), np.array([[0, 0, 3.1], [2, 0, -3.1]]))
    seen = Trajectory(
        np.array([1.0, 1.5, 9.0]), np.array([[1, 0.1, math.pi], [1.5, -0.3, -3.1], [0, 0, 0]])
    )
    position = position_errors(reference, seen)
    assert position.mean == pytest.approx(0.2)
    assert position.max == pytest.approx(0.3)
    assert heading_errors(reference, seen).max == pytest.approx(0.0208, abs=1e-4)


def test_no_common_time_gives_zeros() -> None:
    empty = Trajectory(np.empty(0), np.empty((0, 3)))
    other = Trajectory(np.array([1.0]), np.zeros((1, 3)))
    assert position_errors(other, empty) == ErrorStatistics()
    assert len(empty.at([1.0]).stamps) == 0


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("0 0 0 0 0 0 0 1\n1 2 3\n", ":2: expected eight"),
        ("0 nan 0 0 0 0 0 1\n", ":1: expected eight"),
        ("0 0 0 0 0 0 0 0.99\n1 0 0 0 0 0 0 0\n", ":2: 0 0 0 0 is no rotation"),
        ("1 0 0 0 0 0 0 1\n# remark\n0 0 0 0 0 0 0 1\n", ":3: time 0.0 follows 1.0"),
    ],
)
def test_bad_lines_are_named(tmp_path: Path, text: str, expected: str) -> None:
    path = tmp_path / "bad.tum"
    path.write_text(text)
    with pytest.raises(DatasetError, match=expected):
        read_tum(path)


def test_a_missing_file_is_named(tmp_path: Path) -> None:
    with pytest.raises(DatasetError, match=r"gone\.tum"):
        read_tum(tmp_path / "gone.tum")
