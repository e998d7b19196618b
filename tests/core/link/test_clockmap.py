"""Board time on the host's clock."""

from __future__ import annotations

import numpy as np
import pytest

from polepilot.core.link.clockmap import ClockMap


def test_stamps_have_the_regularity_of_the_board() -> None:
    """Reports arrive 4 to 30 ms late, the clock runs 50 ppm fast: the stamps are even."""
    rng = np.random.default_rng(3)
    clock = ClockMap()
    errors = []
    for index in range(3000):
        true = 500.0 + index * 0.02
        t_ms = round((true - 500.0) * 1000 * 1.00005)
        stamp = clock.to_host(t_ms, true + 0.004 + rng.uniform(0, 0.026))
        errors.append(stamp - true)
    late = np.array(errors[500:])
    assert late.min() > 0.003
    assert late.max() < 0.007


def test_wrapping_is_no_step_back() -> None:
    clock = ClockMap()
    top = 1 << 32
    assert not clock.went_back(5)
    clock.to_host(top - 20, 10.0)
    assert not clock.went_back(0)
    assert clock.to_host(0, 10.02) == pytest.approx(10.02)
    assert clock.to_host(20, 10.10) == pytest.approx(10.04)
    assert clock.went_back(10)
    clock.forget()
    assert not clock.went_back(10)
    assert clock.to_host(10, 11.0) == pytest.approx(11.0)


def test_an_old_quick_arrival_is_forgotten() -> None:
    """A clock that runs slow moves the difference up; the window follows."""
    clock = ClockMap(window=5.0)
    clock.to_host(0, 0.0)
    for t in range(1, 10):
        stamp = clock.to_host(t * 1000, t + 0.1)
    assert stamp == pytest.approx(9.1)
