"""What `polepilot doctor --link` finds out by itself: line, versions, faults, inputs, the stop."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from statistics import median
from typing import Any, Literal

import numpy as np

from polepilot.core.link.messages import NO_SENSOR, Faults, Features, Telemetry
from polepilot.core.link.report import LinkState
from polepilot.core.link.words import BOARDS, STATES, faults_in_words, features_in_words
from polepilot.core.link.workbench import Workbench
from polepilot.core.vehicle import PanUnit

Status = Literal["good", "warning", "bad", "skipped"]
_MARKS: dict[Status, str] = {"good": "ok  ", "warning": "look", "bad": "BAD ", "skipped": "-   "}
PINGS = 50
_LISTEN = 2.0
"""Seconds of telemetry that are judged."""
SENSORS = ("left", "centre", "right")


@dataclass(frozen=True, slots=True)
class Check:
    """One thing that was looked at."""

    name: str
    status: Status
    text: str


class LinkDoctor:
    """Looks at one board and keeps what it found.

    Args:
        pan: what the potentiometer's counts mean.
        say: gets a line for each check; None where nobody reads along.
    """

    def __init__(
        self, bench: Workbench, pan: PanUnit, say: Callable[[str], None] | None = None
    ) -> None:
        self.bench = bench
        self.pan = pan
        self.checks: list[Check] = []
        self._say = say
        self._figures: dict[str, Any] = {}

    @property
    def bad(self) -> int:
        """How many checks have failed."""
        return sum(check.status == "bad" for check in self.checks)

    @property
    def verdict(self) -> str:
        if self.bad:
            wrong = ", ".join(check.name for check in self.checks if check.status == "bad")
            return f"Not ready to drive: {wrong}."
        left_out = sum(check.status == "skipped" for check in self.checks)
        warnings = sum(check.status == "warning" for check in self.checks)
        rest = f"; {warnings} to look at" if warnings else ""
        rest += f"; {left_out} not tried" if left_out else ""
        return f"All that was checked is well{rest}."

    def note(self, name: str, status: Status, text: str) -> None:
        """Keep a finding, and say it."""
        self.checks.append(Check(name, status, text))
        if self._say is not None:
            self._say(f"{_MARKS[status]} {name}: {text}")

    def to_json(self) -> dict[str, Any]:
        """The ``--json`` document."""
        return {
            "good": self.bad == 0,
            "checks": [
                {"name": check.name, "status": check.status, "text": check.text}
                for check in self.checks
            ],
            **self._figures,
        }

    @property
    def telemetry(self) -> Telemetry:
        return self.bench.latest.telemetry

    @property
    def stopped(self) -> bool:
        """A stop is latched."""
        return self.bench.state is LinkState.ESTOP

    # ---- without touching anything -----------------------------------------------------------

    def look(self, where: str) -> None:
        """Everything that moves nothing and needs nobody. ``where`` names the port."""
        board = self.bench.board
        self._figures["board"] = board.board.name.lower()
        self._figures["firmware"] = f"{board.firmware_major}.{board.firmware_minor}"
        self.note("port", "good", where)
        self.note(
            "handshake",
            "good",
            f"{BOARDS[board.board]}, firmware {board.firmware_major}.{board.firmware_minor}, "
            f"protocol {board.major}.{board.minor}",
        )
        self.note("parts", "good", features_in_words(board.features))
        self._look_at_state()
        self._look_at_line()
        self._look_at_inputs()
        self._try_stop()

    def _look_at_state(self) -> None:
        state, faults = self.bench.state, self.telemetry.faults
        self.note(
            "state",
            "good" if state is LinkState.IDLE else "warning",
            f"{state.value}: {STATES[state]}",
        )
        self._figures["state"] = state.value
        self._figures["faults"] = [bit.name.lower() for bit in Faults if bit in faults and bit.name]
        for words in faults_in_words(faults):
            self.note("fault", "warning", words)
        if not faults:
            self.note("faults", "good", "none")

    def _look_at_line(self) -> None:
        board, before = self.bench.board, self.bench.statistics
        samples = self.bench.watch(_LISTEN)
        trips = self.bench.round_trips(PINGS)
        after = self.bench.statistics
        expected = _LISTEN * 1000 / board.telemetry_period_ms
        lost = after.lost - before.lost
        spoiled = after.rejected - before.rejected + after.board_rejected - before.board_rejected
        rate = len(samples) / _LISTEN
        well = abs(len(samples) - expected) <= 0.1 * expected and not lost and not spoiled
        self.note(
            "telemetry",
            "good" if well else "warning",
            f"{rate:.0f} a second, {lost} lost, {spoiled} spoiled on the way",
        )
        self._figures["telemetry"] = {
            "rate": rate,
            "lost": lost,
            "spoiled": spoiled,
            "crc_errors": after.crc_errors - before.crc_errors,
        }
        if len(trips) < PINGS:
            self.note("round trip", "bad", f"{len(trips)} of {PINGS} pings were answered")
            return
        middle, worst = median(trips), max(trips)
        p99 = float(np.percentile(trips, 99))
        self._figures["round_trip_ms"] = {
            "median": middle,
            "p99": p99,
            "worst": worst,
            "count": len(trips),
        }
        self.note(
            "round trip",
            "good" if p99 < 60 else "warning",
            f"{middle:.1f} ms in the middle, {p99:.1f} ms at 99 %, {worst:.1f} ms at worst, "
            f"of {len(trips)}",
        )

    def _look_at_inputs(self) -> None:
        told, features = self.telemetry, self.bench.board.features
        inputs: dict[str, Any] = {}
        if Features.BATTERY in features:
            low = Faults.LOW_BATTERY in told.faults
            inputs["battery_mv"] = told.battery_mv
            words = f"{told.battery_mv / 1000:.2f} V" + (", low" if low else "")
            self.note("battery", "warning" if low else "good", words)
        else:
            self.note("battery", "skipped", "this board does not measure it")
        if Features.PROXIMITY in features:
            inputs["proximity_mm"] = [
                None if reading == NO_SENSOR else reading for reading in told.proximity_mm
            ]
            for name, reading in zip(SENSORS, told.proximity_mm, strict=True):
                missing = reading == NO_SENSOR
                words = "no sensor there" if missing else f"{reading / 10:.0f} cm"
                self.note(f"proximity {name}", "warning" if missing else "good", words)
        else:
            self.note("proximity", "skipped", "this board has no such sensors")
        if Features.PAN in features:
            inputs["pan_adc"] = told.pan_adc
            self.note("potentiometer", "good", self.pan_in_words(told.pan_adc))
        else:
            self.note("potentiometer", "skipped", "this board has no pan motor")
        pressed = Faults.STOP_BUTTON in told.faults
        inputs["stop_button"] = pressed
        words = "pressed, or its wire is broken" if pressed else "released, its wire is whole"
        self.note("stop button", "warning" if pressed else "good", words)
        self._figures["inputs"] = inputs

    def pan_in_words(self, adc: int) -> str:
        """``512 counts: 0 degrees``."""
        angle = math.degrees(self.pan.angle(adc))
        side = "left" if angle > 0.5 else "right" if angle < -0.5 else "straight ahead"
        return f"{adc} counts: {abs(angle):.0f}° {side}"

    def _try_stop(self) -> None:
        """ESTOP is taken, is latched, and CLEAR ends it; nothing turns by that."""
        if self.bench.state is not LinkState.IDLE or Faults.STOP_BUTTON in self.telemetry.faults:
            self.note("stop by link", "skipped", "somebody has stopped the board already")
            return
        if not self.bench.stop():
            self.note("stop by link", "bad", "the board does not acknowledge ESTOP")
            return
        self.bench.watch(0.1)
        if not self.stopped:
            self.note("stop by link", "bad", "the board does not stay stopped after ESTOP")
            return
        released = self.bench.release()
        self.note(
            "stop by link",
            "good" if released else "bad",
            "ESTOP stops and stays until it is released"
            if released
            else "ESTOP stops, but CLEAR does not release it",
        )
