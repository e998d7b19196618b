"""A conversation with whoever stands beside the robot: questions, answers, and any key for STOP."""

from __future__ import annotations

import contextlib
import os
import select
import sys
import termios
import tty
from collections.abc import Callable, Iterator
from typing import Protocol

from polepilot.core.errors import InputError


class Person(Protocol):
    """Somebody who can be asked; a test may be one."""

    def say(self, text: str) -> None: ...

    def show(self, text: str) -> None:
        """Something that changes, in one line; an empty text ends it."""
        ...

    def ask(self, question: str) -> str:
        """The answer, without spaces around it.

        Raises:
            InputError: nobody answers any more.
        """
        ...

    def at_the_keys(self) -> contextlib.AbstractContextManager[Callable[[], bool]]:
        """While something moves: a function that says whether any key was pressed."""
        ...


class Terminal:
    """The person at this terminal. Talks on standard error: standard output is for results."""

    @staticmethod
    def present() -> bool:
        """Whether there is somebody to ask."""
        return sys.stdin.isatty() and sys.stderr.isatty()

    def say(self, text: str) -> None:
        sys.stderr.write(text + "\n")
        sys.stderr.flush()

    def show(self, text: str) -> None:
        sys.stderr.write(f"\r\x1b[K{text}")
        sys.stderr.flush()

    def ask(self, question: str) -> str:
        sys.stderr.write(f"{question} ")
        sys.stderr.flush()
        answer = sys.stdin.readline()
        if not answer:
            raise InputError("Nobody answers any more: standard input has ended.")
        return answer.strip()

    @contextlib.contextmanager
    def at_the_keys(self) -> Iterator[Callable[[], bool]]:
        if not sys.stdin.isatty():
            yield lambda: False
            return
        descriptor = sys.stdin.fileno()
        before = termios.tcgetattr(descriptor)
        pressed = False

        def any_key() -> bool:
            nonlocal pressed
            if not pressed and select.select([descriptor], [], [], 0)[0]:
                os.read(descriptor, 64)
                pressed = True
            return pressed

        # What was typed ahead is no STOP.
        tty.setcbreak(descriptor, termios.TCSAFLUSH)
        try:
            yield any_key
        finally:
            termios.tcsetattr(descriptor, termios.TCSAFLUSH, before)


def agrees(person: Person, question: str) -> bool:
    """A yes; everything else is a no."""
    return person.ask(f"{question} [y/N]").lower() in ("y", "yes")


def choice(person: Person, question: str, answers: str) -> str:
    """One letter of ``answers``, asked until it is one."""
    while True:
        answer = person.ask(f"{question} [{'/'.join(answers)}]").lower()[:1]
        if answer and answer in answers:
            return answer
        person.say(f"  One of {', '.join(answers)}, please.")


def number(person: Person, question: str, low: float, high: float) -> float:
    """A number between two others, asked until it is one; a comma will do as a point."""
    while True:
        answer = person.ask(question).replace(",", ".")
        try:
            value = float(answer)
        except ValueError:
            person.say(f"  {answer!r} is no number.")
            continue
        if low <= value <= high:
            return value
        person.say(f"  Expected a number from {low:g} to {high:g}.")
