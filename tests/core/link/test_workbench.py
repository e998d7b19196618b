"""One board in a person's hands: every motion asked for, short, and stopped by whatever happens."""

from __future__ import annotations

from collections.abc import Callable

import pytest
from people import BareBoard

from polepilot.core.errors import LinkError, RefusedError
from polepilot.core.link.messages import Arm, BoardKind, BoardState, Estop, Faults
from polepilot.core.link.report import Chunk, LinkState
from polepilot.core.link.workbench import Workbench
from polepilot.core.sim.board import Board


@pytest.fixture
def rig() -> BareBoard:
    return BareBoard()


def test_connects_and_moves_nothing_by_itself(rig: BareBoard) -> None:
    with Workbench(rig, rig) as bench:
        assert bench.connect().board is BoardKind.SIMULATED
        assert bench.state is LinkState.IDLE
        samples = bench.watch(1.0)
        assert len(samples) == pytest.approx(50, abs=2)
        assert len(bench.round_trips(10)) == 10
    assert rig.most == 0
    assert not any(isinstance(message, Arm) for message in rig.board.executed)
    assert rig.closed


def test_a_motion_is_as_long_as_was_said(rig: BareBoard) -> None:
    with Workbench(rig, rig) as bench:
        bench.connect()
        motion = bench.drive(400, 200, 1000, 1.0, aim=0.4)
        assert (motion.stopped, motion.faults) == ("", Faults.NONE)
        left, right = motion.duty_seconds()
        # 1 s, and ramps up and down of which each is as long as the other.
        assert left == pytest.approx(400, rel=0.05)
        assert right == pytest.approx(200, rel=0.05)
        first = next(s for s in motion.samples if s.telemetry.duty[0])
        assert first.telemetry.steering == 1000, "the servo goes first"
        assert rig.board.state is BoardState.IDLE, "disarmed after each motion"
    assert rig.most == 400


def test_a_long_motion_is_kept_whole(rig: BareBoard) -> None:
    with Workbench(rig, rig) as bench:
        bench.connect()
        left, _ = bench.drive(300, 300, 0, 8.0).duty_seconds()
    assert left == pytest.approx(8 * 300, rel=0.01)


def test_any_key_stops(rig: BareBoard) -> None:
    with Workbench(rig, rig) as bench:
        bench.connect()
        started = rig.now()
        motion = bench.watched_by(
            lambda: rig.now() > started + 0.5, lambda: bench.drive(500, 500, 0, 5.0)
        )
        assert motion.stopped == "stopped by you"
        assert rig.now() - started < 0.7
        assert (rig.board.state, rig.board.outputs.left) == (BoardState.ESTOP, 0)
        with pytest.raises(RefusedError, match="latched"):
            bench.drive(500, 500, 0, 1.0)
        assert bench.release()
        assert not bench.drive(500, 500, 0, 0.2).stopped


def test_ctrl_c_stops_on_its_way_out(rig: BareBoard) -> None:
    def interrupt() -> bool:
        if rig.now() > 2.0:
            raise KeyboardInterrupt
        return False

    def work() -> None:
        with Workbench(rig, rig) as bench:
            bench.connect()
            bench.watched_by(interrupt, lambda: bench.drive(500, 500, 0, 60.0))

    with pytest.raises(KeyboardInterrupt):
        work()
    assert rig.board.executed[-1] == Estop()
    assert (rig.board.state, rig.board.outputs.left) == (BoardState.ESTOP, 0)
    assert rig.closed


def test_the_stop_button_ends_a_motion(rig: BareBoard) -> None:
    rig.during = lambda rig: rig.press(rig.now() > 1.0)
    with Workbench(rig, rig) as bench:
        bench.connect()
        assert bench.drive(500, 500, 0, 5.0).stopped == "the stop button was pressed"
        assert rig.now() < 1.3
        assert not bench.release(), "the button is still pressed"


def test_a_line_that_breaks_ends_a_motion(rig: BareBoard) -> None:
    rig.during = lambda rig: setattr(rig, "deaf", rig.now() > 1.0)
    with Workbench(rig, rig) as bench:
        bench.connect()
        assert bench.drive(500, 500, 0, 5.0).stopped.startswith("the board missed us")
        assert rig.now() < 5.0
        assert rig.board.outputs.left == 0
        with pytest.raises(RefusedError, match="does not answer"):
            bench.drive(500, 500, 0, 5.0)


@pytest.mark.parametrize(
    ("data", "code"),
    [
        (lambda: b"", "link_silent"),
        (lambda: b"Grbl 1.1f ['$' for help]\r\n", "link_foreign"),
    ],
)
def test_what_is_no_board(rig: BareBoard, data: Callable[[], bytes], code: str) -> None:
    rig.deaf = True
    rig.read = lambda: [Chunk(rig.now(), data())]  # type: ignore[method-assign]
    with pytest.raises(LinkError) as told, Workbench(rig, rig) as bench:
        bench.connect(1.0)
    assert told.value.code == code
    assert rig.closed


def test_a_board_that_does_not_hear(rig: BareBoard) -> None:
    rig.deaf = True
    with pytest.raises(LinkError, match="RX") as told, Workbench(rig, rig) as bench:
        bench.connect(1.0)
    assert told.value.code == "link_deaf"


def test_another_version(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("polepilot.core.sim.board.MAJOR", 2)
    rig = BareBoard(Board())
    with (
        pytest.raises(LinkError, match="version 2 of the link protocol"),
        Workbench(rig, rig) as bench,
    ):
        bench.connect(1.0)
