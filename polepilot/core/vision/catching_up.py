"""Old pictures of a stream: those that piled up on the way, told by the time they took to come."""

from __future__ import annotations

import resource

_AWAY = 1.0
"""Seconds without a picture after which those that come next may have waited somewhere."""
_WAITED = 0.005
"""Seconds; a picture that took less to come had been waiting."""
_CATCH_UP = 2.0
"""Seconds after which a picture is taken as it is: decoding is slower than the camera."""


class CatchingUp:
    """Tells pictures that had been waiting in a queue from those that are new.

    One that is new has to be waited for. All times are seconds on one clock.
    """

    def __init__(self) -> None:
        self._last: float | None = None
        self._since = 0.0
        self._behind = True

    def ask(self, now: float) -> None:
        """Somebody wants a new picture. Nobody knows yet what waits in a stream just opened."""
        self._since = now
        self._behind = self._last is None

    def is_old(self, begin: float, end: float, *, computed: float, slept: bool) -> bool:
        """Whether to pass over the picture that was asked for at ``begin`` and came at ``end``.

        Args:
            begin: when the stream was asked.
            end: when it gave the picture.
            computed: how long this thread had the processor meanwhile: it was decoding.
            slept: whether this thread gave up the processor by itself. Otherwise another program
                took it away, and nobody waited for a picture.
        """
        away = self._last is not None and end - self._last > _AWAY
        self._last = end
        if away:
            self._behind = True
        elif slept and end - begin - computed >= _WAITED:
            self._behind = False
        return self._behind and end - self._since <= _CATCH_UP


def sleeps_of_thread() -> int:
    """How often this thread gave up the processor by itself, to wait for something."""
    return resource.getrusage(resource.RUSAGE_THREAD).ru_nvcsw
