"""A board that is a program of its own, in step with the simulated world.

The firmware's C core as a Linux program, or its machine code in an emulator: bytes of the link
travel through a pseudo-terminal, pins and time through the program's standard input and output
(``firmware/sim/steps.h`` has the lines). Nothing depends on how fast the computer is.
"""

from __future__ import annotations

import contextlib
import os
import select
import subprocess
import tempfile
from collections.abc import Sequence
from pathlib import Path
from typing import IO

from polepilot.core.errors import LinkError
from polepilot.core.sim.board_pins import BoardInputs, BoardOutputs, BoardSettings

LINK = "{link}"
"""Stands in a command for the path at which the program puts its serial line."""
_PATIENCE = 20.0
"""Seconds of the computer until a program that does not answer is given up."""


class BoardProcess:
    """A board like `polepilot.core.sim.board.Board`, behind a serial line.

    Args:
        command: the program with its options; one of its words holds ``{link}``.

    Raises:
        LinkError: it does not start, or later: it has ended or does not answer.
    """

    def __init__(self, command: Sequence[str]) -> None:
        self.outputs = BoardOutputs()
        """As of the last step."""
        self.starts = 0
        """How often the board has started, itself and by its watchdog."""
        self._closed = False
        self._sent = self._read = 0
        self._descriptor = -1
        self._folder = tempfile.TemporaryDirectory(prefix="polepilot-board-")
        link = Path(self._folder.name) / "line"
        self._complaints = Path(self._folder.name) / "complaints"
        words = [word.replace(LINK, str(link)) for word in command]
        try:
            with self._complaints.open("wb") as complaints:
                self._program = subprocess.Popen(
                    words, stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=complaints
                )
        except OSError as error:
            self._folder.cleanup()
            raise LinkError(f"{words[0]}: cannot be started ({error.strerror}).") from error
        try:
            # Once it answers, the line is there; what it said before was heard by nobody.
            self._read = self._announced = self._step(0, BoardInputs())
            self._descriptor = os.open(link, os.O_RDWR | os.O_NOCTTY | os.O_NONBLOCK)
        except BaseException:
            self.close()
            raise

    @classmethod
    def host(cls, program: Path, settings: BoardSettings) -> BoardProcess:
        """The C core as a Linux program, with ``settings`` in place of what is compiled in."""
        limits = ",".join(str(limit) for limit in settings.hard_limits_mm)
        options = [
            *("--link", LINK, "--in-step", "--features", str(int(settings.features))),
            *("--hard-limits", limits, "--max-steering", str(settings.max_steering)),
            *("--pan-ends", f"{settings.pan_low},{settings.pan_high}"),
        ]
        if not settings.pan_rising:
            options.append("--pan-falling")
        return cls([str(program), *options])

    def receive(self, data: bytes, now: float) -> None:  # noqa: ARG002
        """Bytes from the host; the board reads them at the beginning of its next step.

        ``now`` is not needed: it is the time of the last step.
        """
        rest = data
        while rest and not self._closed:
            try:
                written = os.write(self._descriptor, rest)
            except BlockingIOError:
                _wait(self._descriptor, self._program, reading=False)
                continue
            rest = rest[written:]
            self._sent += written

    def step(self, now: float, inputs: BoardInputs) -> BoardOutputs:
        """Let it run until ``now``, seconds of the world, with these pins."""
        if not self._closed:
            self._announced = self._step(round(now * 1e6), inputs)
        return self.outputs

    def transmit(self) -> bytes:
        """Bytes for the host since the last call."""
        chunks = []
        while self._read < self._announced and not self._closed:
            try:
                chunk = os.read(self._descriptor, 4096)
            except BlockingIOError:
                _wait(self._descriptor, self._program, reading=True)
                continue
            self._read += len(chunk)
            chunks.append(chunk)
        return b"".join(chunks)

    def hang(self) -> None:
        """From now on its main loop does nothing."""
        self._announced = self._ask("hang")

    def power_cycle(self) -> None:
        """Cut its power for a moment."""
        self._announced = self._ask("power")

    def close(self) -> None:
        """End the program; afterwards it does and says nothing. Twice is no error."""
        if self._closed:
            return
        self._closed = True
        self.outputs = BoardOutputs()
        if self._descriptor >= 0:
            os.close(self._descriptor)
        streams: list[IO[bytes] | None] = [self._program.stdin, self._program.stdout]
        for stream in streams:
            if stream is not None:
                with contextlib.suppress(OSError):
                    stream.close()
        try:
            self._program.wait(1.0)
        except subprocess.TimeoutExpired:
            self._program.kill()
            self._program.wait()
        self._folder.cleanup()

    def _step(self, t_us: int, inputs: BoardInputs) -> int:
        left, center, right = inputs.proximity_mm
        return self._ask(
            f"step {t_us} {self._sent} {inputs.stop_button:d} {inputs.pan_adc} {left} {center} "
            f"{right} {inputs.battery_mv} {inputs.odometer[0]} {inputs.odometer[1]}"
        )

    def _ask(self, line: str) -> int:
        """One line to the program and its answer; returns how many bytes it has sent so far."""
        assert self._program.stdin is not None
        assert self._program.stdout is not None
        try:
            self._program.stdin.write(line.encode("ascii") + b"\n")
            self._program.stdin.flush()
        except OSError:
            raise self._ended() from None
        _wait(self._program.stdout.fileno(), self._program, reading=True)
        answer = self._program.stdout.readline().split()
        if len(answer) != 6:
            raise self._ended()
        sent, duty_left, duty_right, steering, pan, self.starts = map(int, answer)
        self.outputs = BoardOutputs(duty_left, duty_right, steering, pan)
        return sent

    def _ended(self) -> LinkError:
        with contextlib.suppress(subprocess.TimeoutExpired):
            self._program.wait(1.0)
        said = self._complaints.read_text("utf-8", "replace").strip()
        reason = said or f"status {self._program.returncode}"
        return LinkError(f"the board's program has ended ({reason}).", remedy="Start again.")


def _wait(descriptor: int, program: subprocess.Popen[bytes], *, reading: bool) -> None:
    """Until the descriptor is ready.

    Raises:
        LinkError: it never is.
    """
    wanted = [descriptor]
    ready = select.select(wanted if reading else [], [] if reading else wanted, [], _PATIENCE)
    if not any(ready):
        raise LinkError(
            f"the board's program ({program.args!r}) does not answer.", remedy="Start again."
        )
