"""For tests of conversations beside a robot: people with prepared answers, clocks that jump."""

from __future__ import annotations

import contextlib
import re
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace

from polepilot.core.robot.ports import Chunk
from polepilot.core.sim.board import Board, BoardInputs
from polepilot.core.sim.world import World

Answer = str | Callable[[], str]


class Scripted:
    """Answers each question by the first pattern that fits it; keeps what was said and asked.

    Args:
        answers: pattern -> an answer, or something that gives one. An answer "STOP" is a yes, and a
            key pressed during the motion that follows.
    """

    def __init__(self, answers: Sequence[tuple[str, Answer]]) -> None:
        self.answers = list(answers)
        self.said: list[str] = []
        self.shown: list[str] = []
        self.asked: list[str] = []
        self._stop_in: int | None = None

    def say(self, text: str) -> None:
        self.said.append(text)

    def show(self, text: str) -> None:
        self.shown.append(text)

    def ask(self, question: str) -> str:
        self.asked.append(question)
        fitting = [pair for pair in self.answers if re.search(pair[0], question)]
        assert fitting, f"nobody expected {question!r}"
        answer = fitting[0][1]
        text = answer if isinstance(answer, str) else answer()
        if text == "STOP":
            self.answers.remove(fitting[0])
            self._stop_in = 10
            return "y"
        return text

    @contextlib.contextmanager
    def at_the_keys(self) -> Iterator[Callable[[], bool]]:
        left, self._stop_in = self._stop_in, None

        def pressed() -> bool:
            nonlocal left
            if left is not None:
                left -= 1
            return left is not None and left <= 0

        yield pressed


class WorldClock:
    """The simulated world's time, which passes at once when somebody waits."""

    def __init__(self, world: World) -> None:
        self._world = world

    def now(self) -> float:
        return self._world.now

    def wait_until(self, stamp: float) -> None:
        self._world.advance(stamp + 1e-9)


class BareBoard:
    """A simulated board whose pins the test holds: port and clock in one.

    ``during`` is called in each step with the time; it may change ``inputs``.
    """

    def __init__(self, board: Board | None = None, inputs: BoardInputs | None = None) -> None:
        self.board = board or Board()
        self.inputs = inputs or BoardInputs(proximity_mm=(800, 800, 800))
        self.during: Callable[[BareBoard], None] = lambda _: None
        self.generation = 1
        self.closed = False
        self.most = 0
        """The largest duty of a wheel so far."""
        self.deaf = False
        self._ticks = 0
        self._waiting: list[Chunk] = []

    def read(self) -> list[Chunk]:
        chunks, self._waiting = self._waiting, []
        return chunks

    def write(self, data: bytes) -> None:
        if not self.deaf:
            self.board.receive(data, self.now())

    def close(self) -> None:
        self.closed = True

    def now(self) -> float:
        return self._ticks * 0.002

    def wait_until(self, stamp: float) -> None:
        while self.now() < stamp:
            self._ticks += 1
            self.during(self)
            outputs = self.board.step(self.now(), self.inputs)
            self.most = max(self.most, abs(outputs.left), abs(outputs.right))
            data = self.board.transmit()
            if data:
                self._waiting.append(Chunk(self.now(), data))

    def press(self, pressed: bool) -> None:
        self.inputs = replace(self.inputs, stop_button=pressed)
