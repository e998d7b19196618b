"""Draws the schematics and fills in the pin tables of docs/hardware.md.

python firmware/wiring/draw.py
"""

from __future__ import annotations

import re
import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent))

from pins import BOARDS, BRIDGE, PIC, Wiring, pic_table, table
from sheet import INK, LOGIC, MOTOR, PAPER, SENSE, SIGNAL, SOFT, STOP, Sheet

ROOT = Path(__file__).resolve().parents[2]
PAGE = ROOT / "docs" / "hardware.md"
IMAGES = ROOT / "docs" / "images"

ROW = 32.0
CHIP_LEFT, CHIP_RIGHT = 430.0, 650.0
LEFT_EDGE, RIGHT_EDGE = 310.0, 780.0
"""Where the modules' inner edges are."""


def board_sheet(board: Wiring) -> Sheet:
    """One board with everything that is wired to it."""
    height = 860.0
    sheet = Sheet(
        1080,
        height,
        f"{board.name}: what goes where",
        f"{board.about}. All grounds meet in one point, at the battery's minus.",
    )
    sheet.box(CHIP_LEFT, 96, CHIP_RIGHT - CHIP_LEFT, height - 166, fill="#eaf1f8", color="#9db8d2")
    middle = (CHIP_LEFT + CHIP_RIGHT) / 2
    sheet.text(middle, 124, board.name, size=15, anchor="middle", weight=650)
    supply = "5 V by USB" if board is not PIC else "5 V, see the table"
    sheet.text(middle, height - 88, supply, size=12, color=LOGIC, anchor="middle")
    _inputs(sheet, board)
    _outputs(sheet, board)
    _legend(sheet, height - 36)
    return sheet


def _pin(sheet: Sheet, board: Wiring, signal: str, y: float, left: bool, color: str) -> None:
    """A wire from the chip's edge to a module's, with the pin's names."""
    pin = board.pins[signal]
    number = f"pin {pin.board}" if board is PIC else pin.board
    if left:
        sheet.line((CHIP_LEFT, y), (LEFT_EDGE, y), color=color)
        sheet.text(CHIP_LEFT + 10, y + 4.5, number, weight=650)
        sheet.text(CHIP_LEFT + 62, y + 4.5, pin.chip, size=11.5, color=SOFT)
    else:
        sheet.line((CHIP_RIGHT, y), (RIGHT_EDGE, y), color=color)
        sheet.text(CHIP_RIGHT - 10, y + 4.5, number, anchor="end", weight=650)
        sheet.text(CHIP_RIGHT - 62, y + 4.5, pin.chip, size=11.5, color=SOFT, anchor="end")
    sheet.dot(CHIP_LEFT if left else CHIP_RIGHT, y, color)


def _module(sheet: Sheet, x: float, y: float, width: float, height: float, name: str) -> None:
    sheet.box(x, y, width, height)
    sheet.text(x + 14, y + 22, name, weight=600)


def _inputs(sheet: Sheet, board: Wiring) -> None:
    x, width = 40.0, LEFT_EDGE - 40
    if board is PIC:
        _module(sheet, x, 110, width, 98, "USB-serial bridge")
        sheet.text(x + 14, 154, "FT232 or CP2102,", size=12, color=SOFT)
        sheet.text(x + 14, 171, "USB to the computer", size=12, color=SOFT)
        for y, its, number, port, color in (
            (156.0, "RXD", "25", "RC6", SIGNAL),
            (188.0, "TXD", "26", "RC7", SENSE),
        ):
            sheet.line((CHIP_LEFT, y), (LEFT_EDGE, y), color=color)
            sheet.dot(CHIP_LEFT, y, color)
            sheet.text(LEFT_EDGE - 12, y + 4.5, its, size=12, anchor="end")
            sheet.text(CHIP_LEFT + 10, y + 4.5, f"pin {number}", weight=650)
            sheet.text(CHIP_LEFT + 62, y + 4.5, port, size=11.5, color=SOFT)
    else:
        _module(sheet, x, 110, width, 66, "USB to the computer")
        sheet.text(
            x + 14, 156, f"{board.baud:,} bits per second".replace(",", " "), size=12, color=SOFT
        )
        sheet.line((CHIP_LEFT, 143), (LEFT_EDGE, 143), color=INK, width=4)
        sheet.tag((CHIP_LEFT + LEFT_EDGE) / 2, 143, "USB cable", INK)

    top = 226.0
    _module(sheet, x, top, width, 96, "Pan potentiometer")
    sheet.text(x + 14, top + 44, "10 kΩ linear, on the camera's", size=12, color=SOFT)
    sheet.text(x + 14, top + 61, "axis", size=12, color=SOFT)
    y = top + 56
    sheet.supply(250, y - 16, "5 V", LOGIC)
    sheet.resistor(250, y)
    sheet.line((250, y + 16), (250, y + 26))
    sheet.ground(250, y + 26)
    sheet.line((LEFT_EDGE, y), (258, y), color=SENSE)
    sheet.line((264, y - 4), (257, y), (264, y + 4), color=SENSE)
    _pin(sheet, board, "potentiometer", y, True, SENSE)

    top = 340.0
    _module(sheet, x, top, width, 144, "Proximity, three GP2Y0A21YK")
    sheet.text(x + 14, top + 42, "5 V, ground, signal; 10 µF beside each", size=12, color=SOFT)
    for index, (signal, name) in enumerate(
        (
            ("proximity_left", "left, 45° out"),
            ("proximity_centre", "centre"),
            ("proximity_right", "right, 45° out"),
        )
    ):
        y = top + 66 + index * ROW
        sheet.text(LEFT_EDGE - 12, y + 4.5, name, size=12, anchor="end")
        _pin(sheet, board, signal, y, True, SENSE)
        sheet.tag((CHIP_LEFT + LEFT_EDGE) / 2 - 2, y, "100 kΩ to ground")

    top = 502.0
    _module(sheet, x, top, width, 130, "Battery divider")
    sheet.text(x + 14, top + 44, "100 nF from the", size=12, color=SOFT)
    sheet.text(x + 14, top + 61, "middle to ground", size=12, color=SOFT)
    y = top + 74
    sheet.supply(230, y - 38, "12 V", INK)
    sheet.resistor(230, y - 22, "20 kΩ")
    sheet.line((230, y - 6), (230, y + 6))
    sheet.resistor(230, y + 22, "10 kΩ")
    sheet.ground(230, y + 38)
    sheet.dot(230, y, SENSE)
    sheet.line((230, y), (LEFT_EDGE, y), color=SENSE)
    _pin(sheet, board, "battery", y, True, SENSE)

    top = 650.0
    _module(sheet, x, top, width, 112, "Stop button, second contact")
    sheet.text(x + 14, top + 84, "Closed while all is well: pressed,", size=12, color=SOFT)
    sheet.text(x + 14, top + 100, "or a broken wire, is a stop.", size=12, color=SOFT)
    y = top + 48
    sheet.ground(110, y + 10)
    sheet.line((110, y + 10), (110, y), (190, y), color=STOP)
    sheet.opener(210, y)
    sheet.line((230, y), (LEFT_EDGE, y), color=STOP)
    _pin(sheet, board, "stop", y, True, STOP)


def _outputs(sheet: Sheet, board: Wiring) -> None:
    width = 150.0
    top = 110.0
    sheet.box(RIGHT_EDGE, top, width, 250)
    sheet.text(RIGHT_EDGE + 14, top + 22, "L298 number 1", weight=600)
    sheet.text(RIGHT_EDGE + 14, top + 240, "12 V behind K1, 5 V", size=11.5, color=MOTOR)
    rows = (
        "left_enable",
        "left_forward",
        "left_backward",
        "right_enable",
        "right_forward",
        "right_backward",
    )
    for index, signal in enumerate(rows):
        _driven(sheet, board, signal, top + 46 + index * ROW)
    for name, middle in (("left wheel", top + 46 + ROW), ("right wheel", top + 46 + 4 * ROW)):
        _motor(sheet, middle, name)

    top = 380.0
    sheet.box(RIGHT_EDGE, top, width, 156)
    sheet.text(RIGHT_EDGE + 14, top + 22, "L298 number 2", weight=600)
    sheet.text(RIGHT_EDGE + 14, top + 146, "12 V behind K1, 5 V", size=11.5, color=MOTOR)
    for index, signal in enumerate(("pan_enable", "pan_left", "pan_right")):
        _driven(sheet, board, signal, top + 46 + index * ROW)
    _motor(sheet, top + 46 + ROW, "camera")

    top = 556.0
    sheet.box(RIGHT_EDGE, top, width, 76)
    sheet.text(RIGHT_EDGE + 14, top + 22, "Steering servo", weight=600)
    sheet.text(RIGHT_EDGE + 14, top + 44, "signal", size=12)
    sheet.text(RIGHT_EDGE + 14, top + 64, "6 V behind K1", size=11.5, color=MOTOR)
    _pin(sheet, board, "servo", top + 40, False, SIGNAL)
    sheet.tag((CHIP_RIGHT + RIGHT_EDGE) / 2, top + 40, "470 Ω")

    top = 652.0
    sheet.box(RIGHT_EDGE, top, width, 76)
    sheet.text(RIGHT_EDGE + 14, top + 22, "Lamp", weight=600)
    where = "470 Ω, LED to ground" if board is PIC else "on the board: “L”"
    sheet.text(RIGHT_EDGE + 14, top + 44, where, size=12, color=SOFT)
    sheet.text(RIGHT_EDGE + 14, top + 62, "lit after HELLO", size=12, color=SOFT)
    _pin(sheet, board, "lamp", top + 38, False, SIGNAL)


def _driven(sheet: Sheet, board: Wiring, signal: str, y: float) -> None:
    _pin(sheet, board, signal, y, False, SIGNAL)
    sheet.text(RIGHT_EDGE + 14, y + 4.5, BRIDGE[signal], size=12)
    if signal.endswith("enable"):
        sheet.tag((CHIP_RIGHT + RIGHT_EDGE) / 2, y, "10 kΩ to ground")


def _motor(sheet: Sheet, y: float, name: str) -> None:
    edge, x = RIGHT_EDGE + 150, 1000.0
    for half in (-10, 10):
        sheet.line((edge, y + half), (x - 14, y + half), color=MOTOR)
    sheet.motor(x, y, name)


def _legend(sheet: Sheet, y: float) -> None:
    x = 40.0
    for color, words in (
        (SIGNAL, "the chip drives it"),
        (SENSE, "the chip reads it"),
        (STOP, "stops the robot"),
        (MOTOR, "motor supply, cut by the stop button"),
        (LOGIC, "5 V"),
    ):
        sheet.line((x, y), (x + 26, y), color=color, width=2.4)
        sheet.text(x + 34, y + 4.5, words, size=12, color=SOFT)
        x += 34 + 6.4 * len(words) + 34


def power_sheet() -> Sheet:
    """Battery, the stop that no program can overrule, and who gets which voltage."""
    sheet = Sheet(
        1080,
        640,
        "Power, and the stop that no program can overrule",
        "Pressed, S2 takes the coil's current: K1 drops, and motors and servo are without supply. "
        "The computer and the board stay awake.",
    )
    rail, motors, low = 180.0, 180.0, 560.0
    # Battery, fuse, main switch.
    x = 100.0
    sheet.line((x, rail + 90), (x, rail), (150, rail), color=INK, width=2.4)
    sheet.line((x - 22, rail + 90), (x + 22, rail + 90), width=2)
    sheet.line((x - 11, rail + 102), (x + 11, rail + 102), width=4)
    sheet.line((x - 22, rail + 114), (x + 22, rail + 114), width=2)
    sheet.line((x - 11, rail + 126), (x + 11, rail + 126), width=4)
    sheet.line((x, rail + 128), (x, low), width=2.4)
    sheet.text(x + 32, rail + 104, "battery", weight=600)
    sheet.text(x + 32, rail + 122, "12 V, lead, or 3S lithium", size=12, color=SOFT)
    sheet.text(x + 32, rail + 138, "with a protection board", size=12, color=SOFT)
    sheet.box(150, rail - 9, 52, 18, fill=PAPER, color=INK, radius=2)
    sheet.line((150, rail), (202, rail), color=INK, width=2)
    sheet.text(176, rail - 20, "F1 7.5 A", size=12, anchor="middle", weight=600)
    sheet.text(176, rail + 28, "at the battery", size=11, color=SOFT, anchor="middle")
    sheet.line((202, rail), (270, rail), color=INK, width=2.4)
    sheet.closer(290, rail)
    sheet.text(290, rail - 26, "S1 main switch", size=12, anchor="middle", weight=600)
    sheet.line((310, rail), (640, rail), color=INK, width=2.4)

    # Ground.
    sheet.line((x, low), (1020, low), width=2.4)
    sheet.dot(x, low)
    sheet.ground(x, low + 10)
    sheet.line((x, low), (x, low + 10), width=2.4)
    sheet.text(1020, low + 22, "ground", size=12, color=SOFT, anchor="end")

    # Logic: before the stop.
    sheet.dot(370, rail)
    sheet.line((370, rail), (370, 300), color=INK, width=2)
    sheet.box(320, 300, 100, 62)
    sheet.text(370, 326, "5 V, 3 A", anchor="middle", weight=600)
    sheet.text(370, 344, "step-down", size=12, color=SOFT, anchor="middle")
    sheet.line((370, 362), (370, 410), color=LOGIC, width=2)
    sheet.box(310, 410, 120, 84, color=LOGIC)
    sheet.text(370, 434, "board, sensors,", size=12, anchor="middle")
    sheet.text(370, 451, "L298 logic, and a", size=12, anchor="middle")
    sheet.text(370, 468, "small computer", size=12, anchor="middle")
    sheet.line((370, 494), (370, low))
    sheet.dot(370, low)

    # The coil of K1 through the first contact of S2.
    sheet.dot(530, rail)
    sheet.line((530, rail), (530, 250), color=STOP, width=2)
    sheet.line((530, 250), (530, 264), (552, 264), color=STOP, width=2)
    sheet.opener(572, 264)
    sheet.line((592, 264), (614, 264), (614, 372), color=STOP, width=2)
    sheet.mushroom(572, 248)
    sheet.text(488, 246, "S2 stop", size=12.5, anchor="middle", weight=650, color=STOP)
    sheet.text(488, 263, "first contact", size=11.5, anchor="middle", color=SOFT)
    sheet.box(592, 372, 44, 34, fill=PAPER, color=INK, radius=2)
    sheet.line((592, 406), (636, 372), color=INK)
    sheet.text(580, 380, "K1", anchor="end", weight=650)
    sheet.line((614, 406), (614, low))
    sheet.dot(614, low)
    sheet.dot(614, 350, STOP)
    sheet.line((614, 350), (670, 350), (670, 378), color=INK)
    sheet.diode(670, 389)
    sheet.line((670, 396), (670, 430), (614, 430), color=INK)
    sheet.dot(614, 430)
    sheet.text(684, 393, "1N4007", size=11.5, color=SOFT)

    # Its contact in the motors' supply.
    sheet.closer(660, motors, STOP)
    sheet.line(
        (660, motors - 6), (660, 130), (436, 130), (436, 389), (590, 389), dashed=True, color=SOFT
    )
    sheet.text(660, motors + 26, "K1, 30 A", size=12, anchor="middle", weight=600)
    sheet.line((680, motors), (1020, motors), color=MOTOR, width=2.4)
    sheet.text(
        1020,
        motors - 14,
        "12 V for motors, behind K1",
        size=12,
        color=MOTOR,
        anchor="end",
        weight=600,
    )

    sheet.dot(740, motors, MOTOR)
    sheet.line((740, motors), (740, 250), color=MOTOR, width=2)
    sheet.line((724, 250), (756, 250), width=2)
    sheet.line((724, 258), (756, 258), width=2)
    sheet.line((740, 258), (740, 300))
    sheet.ground(740, 300)
    sheet.text(764, 258, "1000 µF", size=11.5, color=SOFT)

    sheet.dot(860, motors, MOTOR)
    sheet.line((860, motors), (860, 300), color=MOTOR, width=2)
    sheet.box(800, 300, 116, 84, color=MOTOR)
    sheet.text(858, 326, "two L298", anchor="middle", weight=600)
    sheet.text(858, 345, "two wheels,", size=12, color=SOFT, anchor="middle")
    sheet.text(858, 362, "the camera", size=12, color=SOFT, anchor="middle")
    sheet.line((860, 384), (860, low))
    sheet.dot(860, low)

    sheet.dot(986, motors, MOTOR)
    sheet.line((986, motors), (986, 300), color=MOTOR, width=2)
    sheet.box(932, 300, 108, 62)
    sheet.text(986, 326, "6 V, 3 A", anchor="middle", weight=600)
    sheet.text(986, 344, "step-down", size=12, color=SOFT, anchor="middle")
    sheet.line((986, 362), (986, 410), color=MOTOR, width=2)
    sheet.box(932, 410, 108, 44, color=MOTOR)
    sheet.text(986, 437, "steering servo", size=12, anchor="middle")
    sheet.line((986, 454), (986, low))
    sheet.dot(986, low)

    # The second contact tells the board.
    sheet.box(690, 466, 152, 70, fill=PAPER, color=STOP)
    sheet.text(766, 490, "S2, second contact", size=12, anchor="middle", weight=600, color=STOP)
    sheet.text(766, 510, "ground to the board's", size=11.5, color=SOFT, anchor="middle")
    sheet.text(766, 525, "stop input", size=11.5, color=SOFT, anchor="middle")
    sheet.text(
        40,
        612,
        "Shown with the main switch open and the stop button not pressed. A broken wire at S2 or "
        "at the coil drops K1 as well.",
        size=12.5,
        color=SOFT,
    )
    return sheet


def pictures() -> dict[str, str]:
    """File name -> SVG."""
    sheets = {"wiring-power.svg": power_sheet()}
    sheets |= {f"wiring-{board.key}.svg": board_sheet(board) for board in BOARDS}
    return {name: sheet.svg() for name, sheet in sheets.items()}


def filled(page: str) -> str:
    """docs/hardware.md with its tables as they are now."""
    for name, text in (("pins", table()), ("pic", pic_table())):
        page = re.sub(
            rf"(<!-- {name} -->\n).*?(<!-- end -->)",
            lambda found, text=text: f"{found[1]}{text}\n{found[2]}",
            page,
            flags=re.DOTALL,
        )
    return page


def main() -> None:
    """Write everything."""
    for name, svg in pictures().items():
        (IMAGES / name).write_text(svg, "utf-8")
    if PAGE.exists():
        PAGE.write_text(filled(PAGE.read_text("utf-8")), "utf-8")


if __name__ == "__main__":
    main()
