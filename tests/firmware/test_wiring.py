"""The page about hardware says what the firmware does: pins, pictures, commands."""

from __future__ import annotations

import importlib.util
import re
import sys
from pathlib import Path
from types import ModuleType
from xml.etree import ElementTree

import pytest

ROOT = Path(__file__).parents[2]
FIRMWARE = ROOT / "firmware"
PAGE = (ROOT / "docs" / "hardware.md").read_text("utf-8")


def load(name: str) -> ModuleType:
    """A module of firmware/wiring, which is no package."""
    spec = importlib.util.spec_from_file_location(name, FIRMWARE / "wiring" / f"{name}.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules[name] = module
    spec.loader.exec_module(module)
    return module


pins = load("pins")
draw = load("draw")
BOARDS = {board.key: board for board in draw.BOARDS}

AVR = {
    "LEFT_PWM": "left_enable",
    "LEFT_FORWARD": "left_forward",
    "LEFT_BACKWARD": "left_backward",
    "RIGHT_PWM": "right_enable",
    "RIGHT_FORWARD": "right_forward",
    "RIGHT_BACKWARD": "right_backward",
    "PAN_PWM": "pan_enable",
    "PAN_LEFT": "pan_left",
    "PAN_RIGHT": "pan_right",
    "SERVO": "servo",
    "STOP": "stop",
    "LAMP": "lamp",
}
ANALOG = ("potentiometer", "proximity_left", "proximity_centre", "proximity_right", "battery")

UNO_NAMES = {
    **{f"D{n}": f"PD{n}" for n in range(8)},
    **{f"D{n}": f"PB{n - 8}" for n in range(8, 14)},
    **{f"A{n}": f"PC{n}" for n in range(6)},
}
MEGA_NAMES = {
    **{f"D{n}": f"PA{n - 22}" for n in range(22, 30)},
    **{"D4": "PG5", "D9": "PH6", "D10": "PB4", "D11": "PB5", "D12": "PB6", "D13": "PB7"},
    **{f"A{n}": f"PF{n}" for n in range(8)},
}
"""What Arduino prints beside the holes."""
PIC_NAMES = {
    **{str(2 + n): f"RA{n}" for n in range(4)},
    **{"7": "RA5"},
    **{str(33 + n): f"RB{n}" for n in range(8)},
    **{"15": "RC0", "16": "RC1", "17": "RC2", "25": "RC6", "26": "RC7"},
    **{str(19 + n): f"RD{n}" for n in range(4)},
    **{str(27 + n): f"RD{4 + n}" for n in range(4)},
}
"""The DIP-40's pins (data sheet DS39632E, pin diagram)."""


def chip_pins(key: str) -> dict[str, str]:
    return {signal: pin.chip for signal, pin in BOARDS[key].pins.items()}


@pytest.mark.parametrize(("key", "chip"), [("uno", "ATmega328P"), ("mega", "ATmega2560")])
def test_arduino_pins_are_those_of_the_firmware(key: str, chip: str) -> None:
    source = (FIRMWARE / "hal" / "avr" / "pins.h").read_text()
    part = re.search(rf"defined\(__AVR_{chip}__\)(.*?)#el", source, re.DOTALL)
    assert part is not None
    told = dict(re.findall(r"#define (\w+) ([A-L], \d)", part[1]))
    expected = {signal: "P" + told[name].replace(", ", "") for name, signal in AVR.items()}
    first = {"uno": "PC", "mega": "PF"}[key]
    numbers = dict(re.findall(r"#define ADC_(\w+) (\d)u", source))
    assert (numbers["PAN"], numbers["PROXIMITY"], numbers["BATTERY"]) == ("0", "1", "4")
    expected |= {signal: f"{first}{channel}" for channel, signal in enumerate(ANALOG)}
    assert chip_pins(key) == expected


def test_pic_pins_are_those_of_the_firmware() -> None:
    source = (FIRMWARE / "hal" / "pic18f4550" / "main.c").read_text()
    ports = re.split(r"/\* Port ([A-E])\b", source.split("/* PIR1, PIE1, IPR1 */")[0])[1:]
    told: dict[str, str] = {}
    for port, lines in zip(ports[::2], ports[1::2], strict=True):
        for name, mask in re.findall(r"#define (\w+) 0x([0-9A-F]{2})u", lines):
            bit = int(mask, 16).bit_length() - 1
            assert 1 << bit == int(mask, 16)
            told[name] = f"R{port}{bit}"
    names = {name.replace("_PWM", "_ENABLE"): signal for name, signal in AVR.items()}
    assert told.keys() == names.keys()
    expected = {names[name]: pin for name, pin in told.items()}
    numbers = dict(re.findall(r"#define ADC_(\w+) (\d)u", source))
    assert (numbers["PAN"], numbers["PROXIMITY"], numbers["BATTERY"]) == ("0", "1", "4")
    # AN0 to AN3 are RA0 to RA3, AN4 is RA5.
    expected |= dict(zip(ANALOG, ("RA0", "RA1", "RA2", "RA3", "RA5"), strict=True))
    assert chip_pins("pic") == expected


@pytest.mark.parametrize(
    ("key", "names"), [("uno", UNO_NAMES), ("mega", MEGA_NAMES), ("pic", PIC_NAMES)]
)
def test_names_on_the_board_are_those_of_the_chip(key: str, names: dict[str, str]) -> None:
    board = BOARDS[key]
    assert set(board.pins) == set(pins.SIGNALS)
    for signal, pin in board.pins.items():
        assert names[pin.board] == pin.chip, signal
    assert len({pin.chip for pin in board.pins.values()}) == len(board.pins), "a pin used twice"
    serial = {"uno": ("PD0", "PD1"), "mega": ("PE0", "PE1"), "pic": ("RC6", "RC7")}[key]
    assert not set(serial) & {pin.chip for pin in board.pins.values()}


@pytest.mark.parametrize(
    ("key", "name"),
    [("uno", "BAUD"), ("mega", "BAUD"), ("pic", "PIC_BAUD")],
)
def test_baud_rates_are_those_of_the_firmware(key: str, name: str) -> None:
    makefile = (FIRMWARE / "Makefile").read_text()
    told = dict(re.findall(r"^(\w*BAUD) \?= (\d+)$", makefile, re.MULTILINE))
    assert BOARDS[key].baud == int(told[name])


def test_tables_and_pictures_are_up_to_date() -> None:
    again = "run python firmware/wiring/draw.py"
    assert draw.filled(PAGE) == PAGE, again
    assert pins.table() in PAGE
    assert pins.pic_table() in PAGE
    for name, svg in draw.pictures().items():
        path = ROOT / "docs" / "images" / name
        assert path.read_text("utf-8") == svg, again
        assert f"images/{name}" in PAGE


@pytest.mark.parametrize("key", ["uno", "mega", "pic"])
def test_a_picture_shows_each_pin_and_writes_nothing_beyond_its_edge(key: str) -> None:
    board = BOARDS[key]
    root = ElementTree.fromstring(draw.pictures()[f"wiring-{key}.svg"])
    texts = root.findall("{http://www.w3.org/2000/svg}text")
    words = {text.text for text in texts}
    for pin in board.pins.values():
        assert (f"pin {pin.board}" if key == "pic" else pin.board) in words
        assert pin.chip in words
    width, height = (float(root.attrib[name]) for name in ("width", "height"))
    for text in texts:
        length = len(text.text or "") * float(text.attrib["font-size"]) * 0.62
        shift = {"start": 0, "middle": 0.5, "end": 1}[text.attrib["text-anchor"]]
        left = float(text.attrib["x"]) - shift * length
        assert left >= 0, text.text
        assert left + length <= width, text.text
        assert 0 < float(text.attrib["y"]) < height


@pytest.mark.parametrize(
    ("chip", "tool", "options"),
    [
        ("atmega328p", "avrdude", ("-p atmega328p -c arduino", "-U flash:w:")),
        ("atmega2560", "avrdude", ("-p atmega2560 -c wiring -D", "-U flash:w:")),
        ("pic18f4550", "pk2cmd", ("-PPIC18F4550", "-M -R")),
    ],
)
def test_flashing_is_as_the_makefile_does_it(
    chip: str, tool: str, options: tuple[str, ...]
) -> None:
    makefile = (FIRMWARE / "Makefile").read_text()
    assert f"flash-{chip}:" in makefile
    assert f"make -C firmware flash-{chip}" in PAGE
    for words in (tool, *options):
        assert words in makefile, words
        assert words in PAGE, words


def test_links_lead_somewhere() -> None:
    for link in re.findall(r"\]\((?!http)([^)#]+)", PAGE):
        assert (ROOT / "docs" / link).exists(), link
