"""Which pin of which board goes where: the one table behind the schematics and docs/hardware.md.

A test compares it with what the firmware's sources say (`hal/*/`).
"""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Pin:
    """One pin of a board, by the name printed beside it and by the chip's own."""

    board: str
    """On the board: D11, A0; on the bare chip the pin's number."""
    chip: str
    """Port and bit: PB3, RC2."""


@dataclass(frozen=True)
class Wiring:
    """One board."""

    key: str
    """Of file names."""
    name: str
    about: str
    baud: int
    pins: dict[str, Pin]


SIGNALS = {
    "left_enable": "left wheel: enable",
    "left_forward": "left wheel: forward",
    "left_backward": "left wheel: backward",
    "right_enable": "right wheel: enable",
    "right_forward": "right wheel: forward",
    "right_backward": "right wheel: backward",
    "pan_enable": "pan motor: enable",
    "pan_left": "pan motor: left",
    "pan_right": "pan motor: right",
    "servo": "steering servo: signal",
    "lamp": "lamp, lit after HELLO",
    "potentiometer": "pan potentiometer: wiper",
    "proximity_left": "proximity left",
    "proximity_centre": "proximity centre",
    "proximity_right": "proximity right",
    "battery": "battery, behind 20 kΩ / 10 kΩ",
    "stop": "stop contact, closed to ground while good",
}

BRIDGE = {
    "left_enable": "ENA",
    "left_forward": "IN1",
    "left_backward": "IN2",
    "right_enable": "ENB",
    "right_forward": "IN3",
    "right_backward": "IN4",
    "pan_enable": "ENA",
    "pan_left": "IN1",
    "pan_right": "IN2",
}
"""The L298's own names; the pan motor has a bridge of its own."""

UNO = Wiring(
    "uno",
    "Arduino Uno or Nano",
    "ATmega328P, 16 MHz",
    250_000,
    {
        "left_enable": Pin("D11", "PB3"),
        "left_forward": Pin("D4", "PD4"),
        "left_backward": Pin("D7", "PD7"),
        "right_enable": Pin("D3", "PD3"),
        "right_forward": Pin("D8", "PB0"),
        "right_backward": Pin("D10", "PB2"),
        "pan_enable": Pin("D5", "PD5"),
        "pan_left": Pin("D6", "PD6"),
        "pan_right": Pin("D12", "PB4"),
        "servo": Pin("D9", "PB1"),
        "lamp": Pin("D13", "PB5"),
        "potentiometer": Pin("A0", "PC0"),
        "proximity_left": Pin("A1", "PC1"),
        "proximity_centre": Pin("A2", "PC2"),
        "proximity_right": Pin("A3", "PC3"),
        "battery": Pin("A4", "PC4"),
        "stop": Pin("A5", "PC5"),
    },
)

MEGA = Wiring(
    "mega",
    "Arduino Mega 2560",
    "ATmega2560, 16 MHz",
    250_000,
    {
        "left_enable": Pin("D10", "PB4"),
        "left_forward": Pin("D22", "PA0"),
        "left_backward": Pin("D23", "PA1"),
        "right_enable": Pin("D9", "PH6"),
        "right_forward": Pin("D24", "PA2"),
        "right_backward": Pin("D25", "PA3"),
        "pan_enable": Pin("D4", "PG5"),
        "pan_left": Pin("D26", "PA4"),
        "pan_right": Pin("D27", "PA5"),
        "servo": Pin("D11", "PB5"),
        "lamp": Pin("D13", "PB7"),
        "potentiometer": Pin("A0", "PF0"),
        "proximity_left": Pin("A1", "PF1"),
        "proximity_centre": Pin("A2", "PF2"),
        "proximity_right": Pin("A3", "PF3"),
        "battery": Pin("A4", "PF4"),
        "stop": Pin("D28", "PA6"),
    },
)

PIC = Wiring(
    "pic",
    "PIC18F4550",
    "DIP-40, crystal of 20 MHz, 48 MHz inside",
    115_200,
    {
        "left_enable": Pin("17", "RC2"),
        "left_forward": Pin("19", "RD0"),
        "left_backward": Pin("20", "RD1"),
        "right_enable": Pin("16", "RC1"),
        "right_forward": Pin("21", "RD2"),
        "right_backward": Pin("22", "RD3"),
        "pan_enable": Pin("36", "RB3"),
        "pan_left": Pin("27", "RD4"),
        "pan_right": Pin("28", "RD5"),
        "servo": Pin("15", "RC0"),
        "lamp": Pin("30", "RD7"),
        "potentiometer": Pin("2", "RA0"),
        "proximity_left": Pin("3", "RA1"),
        "proximity_centre": Pin("4", "RA2"),
        "proximity_right": Pin("5", "RA3"),
        "battery": Pin("7", "RA5"),
        "stop": Pin("33", "RB0"),
    },
)

BOARDS = (UNO, MEGA, PIC)

PIC_BESIDES = (
    ("1", "MCLR", "10 kΩ to 5 V, 100 nF to ground, and the programmer's VPP"),
    ("13, 14", "OSC1, OSC2", "crystal of 20 MHz between them, 15 to 22 pF from each to ground"),
    ("11, 32", "VDD", "5 V, 100 nF to ground beside each"),
    ("12, 31", "VSS", "ground"),
    ("18", "VUSB", "left open"),
    ("25", "RC6/TX", "the USB-serial bridge's RXD"),
    ("26", "RC7/RX", "the USB-serial bridge's TXD"),
    ("39, 40", "RB6/PGC, RB7/PGD", "the programmer"),
)
"""What the bare chip needs that an Arduino brings along."""


def table(boards: tuple[Wiring, ...] = BOARDS) -> str:
    """All signals and boards as a Markdown table."""
    head = ["signal", "L298", *(board.name for board in boards)]
    rows = [
        [
            words,
            BRIDGE.get(signal, ""),
            *(f"{board.pins[signal].board} ({board.pins[signal].chip})" for board in boards),
        ]
        for signal, words in SIGNALS.items()
    ]
    lines = [head, ["---"] * len(head), *rows]
    return "\n".join(f"| {' | '.join(line)} |" for line in lines)


def pic_table() -> str:
    """What else the PIC's pins get, as a Markdown table."""
    lines = [("pin", "name", "goes to"), ("---", "---", "---"), *PIC_BESIDES]
    return "\n".join(f"| {' | '.join(line)} |" for line in lines)
