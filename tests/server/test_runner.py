"""The robot's thread: its rate, its commands, and what it does when a tick fails."""

from __future__ import annotations

import asyncio
import threading
import time
from collections.abc import Iterator

import pytest
from server.fakes import FakeRobot

from polepilot.core.errors import RefusedError
from polepilot.core.site import Site
from polepilot.server.clock import MonotonicClock
from polepilot.server.errors import BusyError
from polepilot.server.runner import MOST_FAILURES, Published, Runner

SITE = Site(name="here", boundary=((0, 0), (1, 0), (1, 1)))


@pytest.fixture
def robot() -> FakeRobot:
    return FakeRobot()


@pytest.fixture
def runner(robot: FakeRobot) -> Iterator[Runner]:
    runner = Runner(robot, MonotonicClock(), rate=100.0)
    yield runner
    runner.stop()


def test_ticks_in_one_thread_at_its_rate(runner: Runner, robot: FakeRobot) -> None:
    published: list[Published] = []
    runner.on_published = published.append
    runner.start()
    assert runner.latest is not None
    time.sleep(1.2)
    assert runner.stop()
    assert robot.calls == ["shutdown"]
    assert robot.threads.isdisjoint({threading.get_ident()})
    assert len(robot.threads) == 1
    loop = published[-1].around.loop
    # A tick is never early and none is made up for, so the rate cannot be higher.
    assert 50 < loop.rate <= 101
    assert 0 <= loop.busy < 0.5
    assert loop.lateness_p99 >= 0
    # At most every 50 ms, however fast the ticks are.
    assert len(published) <= 1.3 / 0.05 + 2
    assert len(published) >= 8


def test_commands_are_done_between_ticks_in_order(runner: Runner, robot: FakeRobot) -> None:
    runner.start()
    runner.submit(lambda _: time.sleep(0.05))
    first = runner.submit(lambda r: r.load_site(SITE))
    second = runner.submit(lambda r: r.clear())
    urgent = runner.submit(lambda r: r.stop("now"), urgent=True)
    for future in (first, second, urgent):
        future.result(timeout=2)
    assert robot.calls[-3:] in (
        ["stop", "load_site here", "clear"],
        ["load_site here", "clear", "stop"],
    )
    assert robot.calls.index("load_site here") < robot.calls.index("clear")


def test_an_urgent_command_goes_before_those_that_wait(runner: Runner, robot: FakeRobot) -> None:
    robot.step_takes = 0.1
    runner.start()
    time.sleep(0.02)
    futures = [runner.submit(lambda r: r.clear()) for _ in range(3)]
    futures.append(runner.submit(lambda r: r.stop("now"), urgent=True))
    for future in futures:
        future.result(timeout=2)
    assert robot.calls == ["stop", "clear", "clear", "clear"]


def test_the_newest_snapshot_shows_what_a_command_did(runner: Runner, robot: FakeRobot) -> None:
    runner.start()
    for _ in range(5):
        runner.submit(lambda r: r.stop("now")).result(timeout=2)
        assert runner.latest is not None
        assert runner.latest.snapshot.state == "stopped"
        runner.submit(lambda r: r.clear()).result(timeout=2)
        assert runner.latest.snapshot.state == "idle"


def test_a_refusal_reaches_who_asked_and_nothing_stops(runner: Runner, robot: FakeRobot) -> None:
    runner.start()
    with pytest.raises(RefusedError, match="Nothing is under way"):
        runner.submit(lambda r: r.pause()).result(timeout=2)
    ticks = runner.ticks
    runner.submit(lambda _: None).result(timeout=2)
    assert runner.ticks > ticks
    assert runner.failures == 0


def test_a_failed_tick_stops_the_wheels_and_the_loop_goes_on(
    runner: Runner, robot: FakeRobot
) -> None:
    runner.start()
    robot.fail_with = ZeroDivisionError("oops")
    while not runner.failures:
        time.sleep(0.001)
    robot.fail_with = None
    assert robot.calls[0] == "stop"
    assert "oops" in robot.reason
    runner.submit(lambda _: None).result(timeout=2)
    assert not runner.failed


def test_a_loop_that_keeps_failing_ends(runner: Runner, robot: FakeRobot) -> None:
    gone = threading.Event()
    runner.on_failed = gone.set
    runner.start()
    robot.fail_with = ZeroDivisionError("oops")
    assert gone.wait(2)
    assert runner.failed
    assert runner.failures == MOST_FAILURES
    assert robot.calls[-1] == "shutdown"
    with pytest.raises(BusyError):
        runner.submit(lambda _: None).result(timeout=2)


def test_a_command_that_nobody_waits_for_any_more_is_not_done(
    runner: Runner, robot: FakeRobot, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("polepilot.server.runner.COMMAND_TIMEOUT", 0.1)
    robot.step_takes = 0.4
    runner.start()

    async def ask() -> None:
        with pytest.raises(BusyError):
            await runner.call(lambda r: r.load_site(SITE))
        # A stop is: whoever pressed it means it.
        with pytest.raises(BusyError):
            await runner.call(lambda r: r.stop("now"), urgent=True)

    asyncio.run(ask())
    robot.step_takes = 0.0
    runner.submit(lambda _: None).result(timeout=2)
    assert robot.calls == ["stop"]


def test_after_the_end_nothing_is_taken(runner: Runner) -> None:
    runner.start()
    assert runner.stop()
    with pytest.raises(BusyError, match="does not answer"):
        runner.submit(lambda _: None).result(timeout=1)
