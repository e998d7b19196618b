"""Which pictures of a stream are old: decided by given times, not by this machine's."""

from __future__ import annotations

import threading
import time

import pytest

from polepilot.core.vision.catching_up import CatchingUp, sleeps_of_thread

pytestmark = pytest.mark.timeout(60)


def passed_over(waits: list[tuple[float, float, bool]], pause: float = 0.0) -> int:
    """How many pictures are passed over, of a stream just opened or, with ``pause``, of one that
    nobody asked for so many seconds. ``waits``: elapsed, computed, slept."""
    catching_up, now = CatchingUp(), 100.0
    if pause:
        catching_up.ask(now)
        assert not catching_up.is_old(now, now + 0.03, computed=0.0, slept=True)
        now += 0.03 + pause
    catching_up.ask(now)
    for count, (elapsed, computed, slept) in enumerate(waits):
        begin, now = now, now + elapsed
        if not catching_up.is_old(begin, now, computed=computed, slept=slept):
            return count
    return len(waits)


QUEUED, NEW = (0.001, 0.001, False), (0.030, 0.001, True)


@pytest.mark.parametrize(
    ("waits", "pause", "expected"),
    [
        pytest.param([NEW], 0.0, 0, id="nothing piled up"),
        pytest.param([QUEUED] * 100 + [NEW], 0.0, 100, id="piled up while it was opened"),
        # A processor that is taken away for 30 ms is no wait for a picture.
        pytest.param([QUEUED, (0.031, 0.001, False)] * 40 + [NEW], 0.0, 80, id="loaded"),
        # Nor is a lock that is held for a moment.
        pytest.param([(0.003, 0.001, True)] * 50 + [NEW], 0.0, 50, id="locks"),
        pytest.param([(0.040, 0.039, True)] * 40 + [NEW], 0.0, 40, id="slow decoding"),
        # Decoding is slower than the camera: old ones are better than none, after 2 s.
        pytest.param([(0.125, 0.125, False)] * 100, 0.0, 16, id="never catches up"),
        pytest.param([QUEUED], 0.5, 0, id="a short pause"),
        pytest.param([QUEUED] * 30 + [NEW], 1.5, 30, id="a long pause"),
        # The first one after a pause has waited, however long it took to come.
        pytest.param([NEW, NEW], 1.5, 1, id="a long pause, nothing piled up"),
    ],
)
def test_pictures_that_waited_are_passed_over(
    waits: list[tuple[float, float, bool]], pause: float, expected: int
) -> None:
    assert passed_over(waits, pause) == expected


def test_a_wait_is_a_sleep_of_this_thread() -> None:
    before = sleeps_of_thread()
    time.sleep(0.001)
    assert sleeps_of_thread() > before


def test_sleeps_of_another_thread_do_not_count() -> None:
    counts: list[int] = []
    other = threading.Thread(target=lambda: counts.extend((sleeps_of_thread(),) * 2))
    for _ in range(50):
        time.sleep(0.0005)
    other.start()
    other.join(10)
    assert counts[0] < 50 <= sleeps_of_thread()
