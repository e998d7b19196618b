"""Every board made of C against the suite that the simulated board passes.

The host program, the machine code of both AVR chips under simavr and that of the PIC under gpsim:
bytes through a pseudo-terminal, time as the test says, so that a busy computer changes nothing.
"""

from __future__ import annotations

from collections.abc import Iterator

import pytest
from core.link.conformance import Conformance, PinConformance, Senses
from firmware.boards import StepPort, avr_board, host_board, pic_board

CONVERTERS = Senses(nearest_mm=78, farthest_mm=800, error_mm=3, battery_error_mv=20)
"""Infrared rangers on a 10-bit converter, and a battery behind a divider."""
SETTLE = 0.015
"""Five channels, one in each millisecond, and the button's three samples."""


def started(port: StepPort) -> StepPort:
    """A real chip takes some microseconds until it listens."""
    port.advance(0.01)
    return port


class TestHost(Conformance, PinConformance):
    @pytest.fixture
    def port(self) -> Iterator[StepPort]:
        board = host_board()
        yield StepPort(board)
        board.close()


class TestAtmega328p(Conformance, PinConformance):
    senses = CONVERTERS

    @pytest.fixture
    def port(self) -> Iterator[StepPort]:
        board = avr_board("atmega328p")
        yield started(StepPort(board, SETTLE))
        board.close()


class TestAtmega2560(Conformance, PinConformance):
    senses = CONVERTERS

    @pytest.fixture
    def port(self) -> Iterator[StepPort]:
        board = avr_board("atmega2560")
        yield started(StepPort(board, SETTLE))
        board.close()


class TestPic18f4550(Conformance, PinConformance):
    senses = CONVERTERS

    @pytest.fixture
    def port(self) -> Iterator[StepPort]:
        board = pic_board()
        yield started(StepPort(board, SETTLE))
        board.close()
