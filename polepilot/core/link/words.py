"""States, fault bits and features of a board in plain words, and what to do about them."""

from __future__ import annotations

from polepilot.core.link.messages import BoardKind, Faults, Features
from polepilot.core.link.report import LinkState

BOARDS = {
    BoardKind.PIC18F4550: "PIC18F4550",
    BoardKind.ATMEGA328P: "ATmega328P (Arduino Uno, Nano)",
    BoardKind.ATMEGA2560: "ATmega2560 (Arduino Mega)",
    BoardKind.HOST: "the firmware as a program of this computer",
    BoardKind.SIMULATED: "the simulated board",
}

STATES = {
    LinkState.CLOSED: "no line to it",
    LinkState.CONNECTING: "does not answer",
    LinkState.IDLE: "ready, motors off",
    LinkState.ARMED: "armed: its motors may run",
    LinkState.LINK_LOST: "missed us and stopped; it wants to be armed again",
    LinkState.ESTOP: "stopped until somebody releases it",
}

FAULTS = {
    Faults.STOP_BUTTON: "The stop button is pressed, or its wire is broken: it closes to ground "
    "while all is well.",
    Faults.PROXIMITY_STOP: "Something is nearer to a proximity sensor than its hard limit: nothing "
    "turns forward.",
    Faults.LOW_BATTERY: "The battery is low: charge it.",
    Faults.PAN_STUCK: "The camera does not turn: something holds it, or its potentiometer is "
    "disconnected.",
    Faults.WATCHDOG_RESET: "Its program hung and was restarted by the watchdog.",
    Faults.BROWN_OUT_RESET: "Its supply broke down and it restarted: check battery and wiring.",
    Faults.RECEIVE_OVERFLOW: "It was sent more bytes than it could take.",
}

FEATURES = {
    Features.ENCODERS: "wheel encoders",
    Features.PROXIMITY: "proximity sensors",
    Features.BATTERY: "battery voltage",
    Features.PAN: "pan motor",
}


def faults_in_words(faults: Faults) -> list[str]:
    """One sentence for each bit that is set."""
    return [words for bit, words in FAULTS.items() if bit in faults]


def features_in_words(features: Features) -> str:
    """``proximity sensors, battery voltage, pan motor``."""
    return ", ".join(words for bit, words in FEATURES.items() if bit in features) or "none"
