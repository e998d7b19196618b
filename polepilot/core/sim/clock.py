"""The simulated world's clock: at the pace of the wall clock, or a multiple of it."""

from __future__ import annotations

import time
from collections.abc import Callable

from polepilot.core.errors import ConfigError
from polepilot.core.sim.world import World

LONGEST_LEAP = 0.10
"""Seconds of the world. A computer that stalls slows the simulated world down; otherwise every
hiccup of a busy laptop would look to the simulated microcontroller like a lost computer."""


class PacedClock:
    """The world goes on with the wall clock, ``factor`` times as fast.

    Args:
        monotonic: the wall clock, seconds.
        sleep: waits so many seconds of it.
    """

    def __init__(
        self,
        world: World,
        factor: float = 1.0,
        *,
        monotonic: Callable[[], float] = time.monotonic,
        sleep: Callable[[float], object] = time.sleep,
    ) -> None:
        if not 0.01 <= factor <= 1000:
            raise ConfigError(f"the speed of the simulation is {factor}: expected 0.01 to 1000.")
        self._world = world
        self._factor = factor
        self._monotonic = monotonic
        self._sleep = sleep
        self._wall = monotonic()
        self._stamp = world.now

    def now(self) -> float:
        """World time; the world has been brought up to it."""
        wanted = self._stamp + (self._monotonic() - self._wall) * self._factor
        reachable = self._world.now + LONGEST_LEAP * max(self._factor, 1.0)
        if wanted > reachable:
            self._wall, self._stamp = self._monotonic(), reachable
            wanted = reachable
        self._world.advance(wanted)
        return self._world.now

    def wait_until(self, stamp: float) -> None:
        # The world moves in whole steps: go on until it has reached the step of ``stamp``.
        while self.now() < stamp - 1e-9:
            rest = (stamp - self._stamp) / self._factor - (self._monotonic() - self._wall)
            self._sleep(max(rest, 0.0005))
