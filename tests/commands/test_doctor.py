"""`polepilot doctor --link`: what is wired to the board, before wheels touch the ground."""

from __future__ import annotations

import errno
import json
import os
import tty
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from people import BareBoard, Scripted

from polepilot.commands.doctor import _connected
from polepilot.commands.doctor_hands import try_inputs, try_outputs
from polepilot.commands.doctor_link import LinkDoctor
from polepilot.commands.main import run
from polepilot.commands.stage import Stage
from polepilot.core.link import usb
from polepilot.core.link.messages import BoardState, Estop, Faults, Features
from polepilot.core.link.report import Chunk
from polepilot.core.link.workbench import Workbench
from polepilot.core.sim.board import Board, BoardInputs, BoardSettings
from polepilot.core.vehicle import PanUnit

Captured = pytest.CaptureFixture[str]
NOTHING_NEAR = (800, 800, 800)


def examined(rig: BareBoard) -> LinkDoctor:
    with Workbench(rig, rig) as bench:
        bench.connect()
        doctor = LinkDoctor(bench, PanUnit())
        doctor.look("here")
    return doctor


def found(doctor: LinkDoctor, name: str) -> tuple[str, str]:
    """Status and words of the last check with this name."""
    check = [check for check in doctor.checks if check.name == name][-1]
    return check.status, check.text


# ---- by itself -------------------------------------------------------------------------------


def test_a_healthy_board_moves_nothing() -> None:
    rig = BareBoard()
    doctor = examined(rig)
    assert (doctor.bad, rig.most) == (0, 0)
    assert {check.status for check in doctor.checks} == {"good"}
    assert doctor.verdict == "All that was checked is well."
    document = doctor.to_json()
    assert (document["good"], document["board"], document["faults"]) == (True, "simulated", [])
    assert document["telemetry"] == {"rate": 50, "lost": 0, "spoiled": 0, "crc_errors": 0}
    assert document["round_trip_ms"]["count"] == 50
    assert rig.board.state is BoardState.IDLE, "the stop that was tried is released"
    assert Estop() in rig.board.executed


def test_faults_and_inputs_in_words() -> None:
    settings = BoardSettings()
    inputs = BoardInputs(
        pan_adc=1023, proximity_mm=(0xFFFF, 60, 800), battery_mv=9000, stop_button=True
    )
    rig = BareBoard(Board(settings, reset=Faults.WATCHDOG_RESET), inputs)
    doctor = examined(rig)
    said = " ".join(check.text for check in doctor.checks)
    assert "wire is broken" in said
    assert "battery is low" in said
    assert "restarted by the watchdog" in said
    assert "nearer to a proximity sensor" in said
    assert found(doctor, "battery") == ("warning", "9.00 V, low")
    assert found(doctor, "proximity left") == ("warning", "no sensor there")
    assert found(doctor, "proximity centre") == ("good", "6 cm")
    assert found(doctor, "potentiometer") == ("good", "1023 counts: 135° left")
    assert found(doctor, "state")[0] == "warning"
    assert found(doctor, "stop by link")[0] == "skipped"
    assert rig.board.state is BoardState.ESTOP, "somebody else's stop is not released"
    assert doctor.to_json()["faults"] == [
        "stop_button",
        "proximity_stop",
        "low_battery",
        "watchdog_reset",
    ]


def test_a_board_without_inputs() -> None:
    doctor = examined(BareBoard(Board(BoardSettings(features=Features.NONE))))
    assert found(doctor, "parts") == ("good", "none")
    for name in ("battery", "proximity", "potentiometer"):
        assert found(doctor, name)[0] == "skipped"
    assert doctor.bad == 0


def test_a_board_that_ignores_estop_is_bad(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(Board, "_handle_estop", lambda *_: None)
    doctor = examined(BareBoard())
    assert found(doctor, "stop by link")[0] == "bad"
    assert doctor.verdict == "Not ready to drive: stop by link."


def test_a_spoiled_line_is_told() -> None:
    rig = BareBoard()
    clean = rig.read
    rig.read = lambda: _spoil(clean(), rig.now())  # type: ignore[method-assign]
    doctor = examined(rig)
    status, words = found(doctor, "telemetry")
    assert status == "warning"
    assert ", 0 spoiled" not in words


def _spoil(chunks: list[Any], now: float) -> list[Any]:
    """Every tenth of a second one byte is another."""
    if int(now * 1000) % 100 >= 20:
        return chunks
    return [
        chunk._replace(data=chunk.data[:5] + bytes([chunk.data[5] ^ 0x20]) + chunk.data[6:])
        if len(chunk.data) > 20
        else chunk
        for chunk in chunks
    ]


# ---- with hands ------------------------------------------------------------------------------


class Hands:
    """Somebody who does to the pins what is asked for."""

    def __init__(self, rig: BareBoard, *, good: bool = True) -> None:
        self.rig, self.good = rig, good
        self.task = ""
        self.camera = 512.0
        rig.during = self.work

    def work(self, rig: BareBoard) -> None:
        inputs = rig.inputs
        if "stop button" in self.task:
            rig.inputs = replace(inputs, stop_button=self.good)
        elif "Turn the camera" in self.task:
            rig.inputs = replace(
                inputs, pan_adc=300 + int(rig.now() * 100) % 400 if self.good else 500
            )
        elif "Hold your hand" in self.task:
            near = [800, 800, 800]
            for index, name in enumerate(("left", "centre", "right")):
                if f"the {name} sensor" in self.task and self.good:
                    near[index] = 150
            rig.inputs = replace(inputs, proximity_mm=(near[0], near[1], near[2]))
        else:
            if self.good:  # 45 degrees a second under full duty
                self.camera += rig.board.outputs.pan / 1000 * 170 * 0.002
            rig.inputs = replace(
                inputs, stop_button=False, proximity_mm=NOTHING_NEAR, pan_adc=round(self.camera)
            )

    def __call__(self, question: str) -> str:
        self.task = question if "[Enter/s]" in question else ""
        self.work(self.rig)
        return "" if "[Enter/s]" in question else "y"


class Helper(Scripted):
    """Answers by a function of the question."""

    def __init__(self, hands: Hands) -> None:
        super().__init__([])
        self._hands = hands

    def ask(self, question: str) -> str:
        self.asked.append(question)
        return self._hands(question)


@pytest.mark.parametrize("good", [True, False])
def test_inputs_are_tried_by_hand(good: bool) -> None:
    rig = BareBoard()
    somebody = Helper(Hands(rig, good=good))
    with Workbench(rig, rig) as bench:
        bench.connect()
        doctor = LinkDoctor(bench, PanUnit())
        try_inputs(doctor, somebody)
    names = [
        "stop button",
        "potentiometer",
        *(f"proximity {n}" for n in ("left", "centre", "right")),
    ]
    for name in names:
        assert found(doctor, name)[0] == ("good" if good else "bad"), name
    assert rig.most == 0
    assert any("so far from" in text for text in somebody.shown)
    if good:
        assert found(doctor, "release") == ("good", "the stop has ended")


def test_outputs_twitch_only_after_a_yes_for_each() -> None:
    rig = BareBoard()
    somebody = Helper(Hands(rig))
    with Workbench(rig, rig) as bench:
        bench.connect()
        doctor = LinkDoctor(bench, PanUnit())
        try_outputs(doctor, somebody)
    twitches = [question for question in somebody.asked if "Twitch" in question]
    assert len(twitches) == 8
    assert doctor.bad == 0
    assert found(doctor, "left wheel forward") == ("good", "driven and seen")
    assert found(doctor, "potentiometer")[1].startswith("followed")
    assert rig.most == 300
    assert rig.now() < 40, "each is short"


def test_no_wheels_in_the_air_no_twitch() -> None:
    rig = BareBoard()
    somebody = Scripted([(".", "n")])
    with Workbench(rig, rig) as bench:
        bench.connect()
        doctor = LinkDoctor(bench, PanUnit())
        try_outputs(doctor, somebody)
        assert len(somebody.asked) == 1
        somebody.answers = [("in the air", "y"), ("Twitch", "n")]
        try_outputs(doctor, somebody)
    assert rig.most == 0
    assert rig.board.outputs.pan == 0
    assert doctor.bad == 0


def test_what_was_seen_and_what_was_not() -> None:
    rig = BareBoard()
    somebody = Scripted(
        [
            ("right wheel forward", "STOP"),
            ("Did it do that", "o"),
            (".", "y"),
        ]
    )
    with Workbench(rig, rig) as bench:
        bench.connect()
        doctor = LinkDoctor(bench, PanUnit())
        try_outputs(doctor, somebody)
    assert found(doctor, "left wheel forward")[1].endswith("swap the wires")
    assert found(doctor, "right wheel forward") == ("skipped", "stopped by you")
    assert "did not follow" in found(doctor, "potentiometer")[1]
    assert found(doctor, "right wheel backward")[0] == "bad", "released after a yes, and tried"


# ---- as a command ----------------------------------------------------------------------------


@pytest.fixture
def tty_path(tmp_path: Path) -> Iterator[Path]:
    """A terminal with nobody behind it."""
    master, slave = os.openpty()
    tty.setraw(slave)
    path = tmp_path / "ttyBoard"
    path.symlink_to(os.ttyname(slave))
    yield path
    os.close(master)
    os.close(slave)


def complaint(words: list[str], capsys: Captured, status: int) -> str:
    assert run(["doctor", *words]) == status
    captured = capsys.readouterr()
    assert captured.out == ""
    *before, said = captured.err.splitlines()
    assert not before or ["handshake" in line for line in before] == [True]
    return said


def test_the_simulated_board_as_json(capsys: Captured) -> None:
    assert run(["doctor", "--link", "--board", "simulated", "--json"]) == 0
    out = capsys.readouterr().out
    assert out.count("\n") == 1
    document = json.loads(out)
    assert document["good"]
    assert {"handshake", "battery", "stop by link"} <= {one["name"] for one in document["checks"]}


@pytest.mark.parametrize(
    ("words", "expected"),
    [
        ([], "expected --link"),
        (["--link", "ttyUSB0"], 'Serial port "ttyUSB0": expected a path'),
        (["--link", "--board", "paper"], "--board is 'paper'"),
        (["--link", "/dev/ttyUSB0", "--board", "host"], "--board host has no port"),
    ],
)
def test_mistakes(words: list[str], expected: str, capsys: Captured) -> None:
    assert expected in complaint(words, capsys, 2)


def test_no_such_port(tmp_path: Path, capsys: Captured) -> None:
    said = complaint(["--link", str(tmp_path / "ttyUSB7")], capsys, 1)
    assert "There is no serial device" in said
    assert "Check the cable" in said


@pytest.mark.parametrize(
    ("code", "expected"),
    [(errno.EACCES, "dialout"), (errno.EBUSY, "in use by another program")],
)
def test_forbidden_and_busy(
    tty_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: Captured, code: int, expected: str
) -> None:
    def refuse(*_args: object, **_kwargs: object) -> None:
        raise usb.serial.SerialException(code, "refused")

    monkeypatch.setattr(usb.serial, "Serial", refuse)
    assert expected in complaint(["--link", str(tty_path)], capsys, 1)


def test_which_port(monkeypatch: pytest.MonkeyPatch, capsys: Captured) -> None:
    class Found:
        def __init__(self, device: str) -> None:
            self.device, self.vid, self.pid, self.serial_number = device, 1, 2, None

    ports = [Found("/dev/ttyUSB7"), Found("/dev/ttyACM7")]
    monkeypatch.setattr(usb.list_ports, "comports", lambda: ports)
    monkeypatch.setattr("polepilot.commands.stage._STEADY_NAME", Path("/nowhere"))
    assert "/dev/ttyACM7, /dev/ttyUSB7" in complaint(["--link"], capsys, 2)
    ports.clear()
    assert "No serial device is plugged in" in complaint(["--link"], capsys, 2)


def test_something_else_is_plugged_in(
    tty_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: Captured
) -> None:
    """All usual baud rates are tried, and what the first one told is said."""
    monkeypatch.setattr(Workbench, "connect", _hasty(Workbench.connect))
    assert "no firmware of ours" in complaint(["--link", str(tty_path)], capsys, 1)


def _hasty(connect: Any) -> Any:
    def in_a_moment(self: Workbench, patience: float = 5.0) -> object:
        return connect(self, min(patience, 0.3))

    return in_a_moment


def test_another_baud_rate_is_found(capsys: Captured) -> None:
    """At the wrong rate a talking board is noise; the usual other one is tried."""
    rig, asked = BareBoard(), []
    noise = BareBoard()
    noise.read = lambda: [Chunk(rig.now(), b"\xf7\x1e\x00\xe6")]  # type: ignore[method-assign]
    noise.deaf = True

    def again(rate: int) -> BareBoard:
        asked.append(rate)
        return rig

    stage, bench = _connected(Stage(noise, rig, "ttyUSB0", None, again), 115_200)
    with bench:
        assert asked == [250_000]
        assert bench.board.ok
        assert "250000 baud: set link.baud_rate = 250000" in stage.name
    assert noise.closed
    assert "the front wheel may turn" in capsys.readouterr().err
