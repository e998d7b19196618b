"""`polepilot calibrate drive`: from measured numbers, and guided with a simulated robot."""

from __future__ import annotations

import contextlib
import json
import math
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from people import BareBoard, Scripted, WorldClock

from polepilot.commands.calibrate_drive import calibrate_drive
from polepilot.commands.calibrate_drive_guide import Ended, Found, Guide
from polepilot.commands.main import run
from polepilot.commands.stage import Hall
from polepilot.core.command import DriveCommand
from polepilot.core.link.calibration import DriveCalibration
from polepilot.core.link.drive_fit import DriveRun
from polepilot.core.link.messages import BoardState, Estop
from polepilot.core.link.workbench import Workbench
from polepilot.core.sim.motion import Disturbances
from polepilot.core.vehicle import Vehicle
from polepilot.server.settings import Settings, load_settings

Captured = pytest.CaptureFixture[str]
CROOKED = Disturbances(
    speed_scale=0.12,
    wheel_difference=0.0,
    steering_offset=math.radians(2.5),
    dead_band=0.15,
    slip=0.0,
    turn_slip=0.0,
    burst_rate=0.0,
)
"""0.56 m/s under full duty, nothing below 15 %, and a front wheel that looks to the left."""
MEASURED = [
    *("--run", "35,0,1=0.123,0.001"),
    *("--run", "35,0,8=1.040,0.095"),
    *("--run", "70,0,6.1=2.138,0.414"),
    *("--run", "58,22,2.86=0.446,0.526"),
    *("--run", "58,-26,2.86=0.468,-0.517"),
]
"""The simulated robot above."""


def person(hall: Hall, *first: tuple[str, str | Callable[[], str]]) -> Scripted:
    """Somebody with a box and a tape measure."""
    return Scripted(
        [
            *first,
            ("ahead of the line", lambda: f"{hall.measured()[0] * 100:.1f}"),
            ("to the LEFT", lambda: f"{hall.measured()[1] * 100:.1f}"),
            ("Which way", "l"),
            ("farther than before", lambda: "y" if hall.world._motion._servo < 0.6 else "n"),
            ("for ten seconds", "n"),
            (".", "y"),
        ]
    )


def lead(hall: Hall, somebody: Scripted) -> Found:
    with Workbench(hall.world.link, WorldClock(hall.world)) as bench:
        return Guide(
            bench,
            somebody,
            hall.world.model.vehicle,
            DriveCalibration(),
            lift=hall.put_on_line,
            hint=hall.measured,
        ).lead()


@pytest.mark.parametrize("board", ["simulated", "host"])
def test_the_guide_finds_a_crooked_robot(board: str) -> None:
    """Through real packets: by the simulated board, and by the firmware's C code."""
    settings = Settings().with_board(board)
    hall = Hall(settings, CROOKED)
    somebody = person(hall)
    found = lead(hall, somebody)
    assert not hall.world.link._world._board.outputs.left
    outcome = calibrate_drive(found.runs, settings, trim=found.trim, servo_limit=found.servo_limit)
    drive = outcome.changes["drive"]
    assert max(one.length for one in found.runs) < 2.0, "more than the free floor"
    assert outcome.verdict.grade == "good"
    assert drive["full_speed_left_m_s"] == pytest.approx(0.56, rel=0.03)
    assert drive["full_speed_right_m_s"] == pytest.approx(0.56, rel=0.03)
    assert drive["dead_band"] == pytest.approx(0.15, abs=0.02)
    assert math.degrees(float(drive["servo_center_rad"])) == pytest.approx(-2.5, abs=0.8)  # type: ignore[arg-type]
    assert drive["servo_scale"] == pytest.approx(1.0, abs=0.1)
    assert 30 <= math.degrees(float(drive["servo_limit_rad"])) <= 45.01  # type: ignore[arg-type]
    # Each motion was asked for: every question about one comes before it.
    assert sum("May" in question for question in somebody.asked) >= 8


def test_with_the_result_the_robot_does_what_it_is_told() -> None:
    hall = Hall(Settings(), CROOKED)
    found = lead(hall, person(hall))
    outcome = calibrate_drive(
        found.runs, Settings(), trim=found.trim, servo_limit=found.servo_limit
    )
    settings = Settings().override(outcome.changes, "test")
    vehicle = settings.model.vehicle
    hall = Hall(Settings(), CROOKED)
    for speed, steering in ((0.2, 0.0), (0.3, 0.3), (0.3, -0.3)):
        left, right, servo = settings.calibration.to_drive(DriveCommand(speed, steering), vehicle)
        hall.put_on_line()
        with Workbench(hall.world.link, WorldClock(hall.world)) as bench:
            bench.connect()
            bench.drive(left, right, servo, 3.0, aim=0.6)
            bench.watch(0.5)
        made = DriveRun(0.5, 0.5, 0.0, 3.0, *hall.measured())
        assert made.length == pytest.approx(speed * 3.0, rel=0.05)
        assert math.degrees(made.angle(vehicle.wheelbase) - steering) == pytest.approx(0, abs=1.0)


def test_nothing_moves_without_a_yes() -> None:
    hall = Hall(Settings(), CROOKED)
    somebody = Scripted([(".", "n")])
    with pytest.raises(Ended, match="Ended by you"):
        lead(hall, somebody)
    assert len(somebody.asked) == 1
    assert not hall.world._board.executed  # type: ignore[union-attr]


@pytest.mark.parametrize("refused", range(2, 10))
def test_whoever_says_no_later_ends_it_with_a_standing_robot(refused: int) -> None:
    hall = Hall(Settings(), CROOKED)
    somebody = person(hall)
    answers = somebody.ask

    def until(question: str) -> str:
        if "may" in question.lower() and sum("ay" in q for q in somebody.asked) >= refused:
            somebody.asked.append(question)
            return "no"
        return answers(question)

    somebody.ask = until  # type: ignore[method-assign]
    with contextlib.suppress(Ended):
        lead(hall, somebody)
    assert hall.world._board.outputs.left == 0
    assert hall.world._board.state is BoardState.IDLE  # type: ignore[union-attr]


def test_a_key_stops_and_the_run_is_done_again() -> None:
    hall = Hall(Settings(), CROOKED)
    somebody = person(hall, ("straight on again", "STOP"), ("left rear wheel", "STOP"))
    found = lead(hall, somebody)
    assert len(found.runs) == 5
    stops = [m for m in hall.world._board.executed if isinstance(m, Estop)]  # type: ignore[union-attr]
    assert len(stops) == 2
    assert sum("stopped by you" in text for text in somebody.said) == 2
    assert sum("straight on again" in question for question in somebody.asked) == 2


def test_a_wheel_that_turns_backward_ends_it_with_advice() -> None:
    hall = Hall(Settings(), CROOKED)
    with pytest.raises(Ended, match="right wheel is wired otherwise") as told:
        lead(hall, person(hall, ("Did the right wheel", "o")))
    assert "Swap the two wires" in told.value.remedy


def test_a_mirrored_servo_and_counted_turns() -> None:
    """The person says right when it was sent left; the curves are sent the other way."""
    hall = Hall(Settings(), CROOKED)
    turns = iter(("20", "19"))
    found = lead(
        hall,
        person(
            hall,
            ("Which way", "r"),
            ("for ten seconds", "y"),
            ("Turns of", lambda: next(turns)),
        ),
    )
    assert found.trim == pytest.approx(0.95)
    assert found.runs[3].steering < 0 < found.runs[4].steering


def test_a_low_battery_and_a_latched_stop_are_told_first() -> None:
    rig = BareBoard()
    rig.board.receive(Estop().to_packet(1).encode(), 0.0)
    somebody = Scripted([("box", "y"), ("shall the stop end", "n")])
    with Workbench(rig, rig) as bench, pytest.raises(Ended):
        Guide(bench, somebody, Vehicle(), DriveCalibration()).lead()
    assert rig.board.state is BoardState.ESTOP


# ---- from measured numbers -------------------------------------------------------------------


def answer(words: list[str], capsys: Captured) -> dict[str, Any]:
    assert run(["calibrate", "drive", *words, "--json"]) == 0
    out = capsys.readouterr().out
    assert out.count("\n") == 1
    document: dict[str, Any] = json.loads(out)
    return document


def test_measured_runs_go_to_robot_toml(tmp_path: Path, capsys: Captured) -> None:
    toml = tmp_path / "robot.toml"
    old = "[drive]\nfull_speed_left_m_s = 0.4  # guessed\n\n[vehicle]\nwheelbase_m = 0.2\n"
    toml.write_text(old)
    words = [*MEASURED, "--turns", "20,19.5", "--servo-range", "30"]
    found = answer([*words, "--config", str(toml), "--write"], capsys)
    assert found["verdict"]["grade"] in ("good", "fair")
    assert len(found["runs"]) == 5
    calibration = load_settings(toml).calibration
    drive = found["settings"]["drive"]
    assert calibration.full_speed_left == drive["full_speed_left_m_s"]
    assert calibration.full_speed_right / calibration.full_speed_left == pytest.approx(0.975, 1e-3)
    assert calibration.servo_limit == pytest.approx(math.radians(30), abs=1e-4)
    assert "# guessed" in toml.read_text()
    assert (tmp_path / "robot.toml.1").read_text() == old
    # A servo that reaches less than plans assume: they are told.
    assert load_settings(toml).vehicle.max_steering_rad < Settings().vehicle.max_steering_rad


def test_in_words(capsys: Captured) -> None:
    assert run(["calibrate", "drive", *MEASURED]) == 0
    out = capsys.readouterr().out
    assert "full duty drives 0.5" in out
    assert "straight on is" in out
    assert "[drive]\nfull_speed_left_m_s = 0.5" in out


def test_a_poor_result_is_not_written(tmp_path: Path, capsys: Captured) -> None:
    toml = tmp_path / "robot.toml"
    toml.write_text("")
    wrong = [word.replace("=2.138,", "=3.138,") for word in MEASURED]
    assert run(["calibrate", "drive", *wrong, "--config", str(toml), "--write"]) == 2
    assert "Measure run 3 again" in capsys.readouterr().err
    assert toml.read_text() == ""


@pytest.mark.parametrize(
    ("words", "expected"),
    [
        ([], "There is no terminal"),
        (["--run", "40,0=1,0"], "--run is '40,0=1,0': expected DUTY%"),
        (["--run", "140,0,4=1,0"], "--run 140,0,4=1,0: duty is 1.4"),
        (["--run", "40,0,4=1,0", "/dev/ttyUSB0"], "expected one of the two"),
        (["--turns", "1,1"], "--turns and --servo-range go with --run"),
        (["--run", "40,0,4=1,0", "--turns", "1"], "--turns is '1'"),
        (["--run", "40,0,4=1,0", "--write"], "--write is given without --config"),
    ],
)
def test_mistakes_are_one_line(words: list[str], expected: str, capsys: Captured) -> None:
    assert run(["calibrate", "drive", *words]) == 2
    captured = capsys.readouterr()
    assert captured.out == ""
    assert captured.err.count("\n") == 1
    assert expected in captured.err
