"""What is drawn: the code to scale and nothing else in it, marks around it, rulers."""

from __future__ import annotations

import math
import re
from collections import defaultdict

import cv2
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from polepilot.core.errors import InputError
from polepilot.core.landmark import SUPPORTED_BITS, LandmarkKind, decode, id_set
from polepilot.core.observation import Image
from polepilot.core.printing.drawing import Box, Ink, Item, Shape, Sheet, Stroke, Text
from polepilot.core.printing.fonts import text_width
from polepilot.core.printing.job import ORANGE, RICH_BLACK, PrintJob
from polepilot.core.printing.pages import Page
from polepilot.core.printing.paper import parse_paper
from polepilot.core.printing.tiles import MARGIN
from polepilot.core.vehicle import Camera
from polepilot.core.vision.detector import LandmarkDetector

Bounds = tuple[float, float, float, float]

JOBS = {
    "tube": PrintJob((1, 13)),
    "flat": PrintJob((1, 7, 13), LandmarkKind(shape="flat")),
    "large": PrintJob((200,), LandmarkKind(8, 0.12, 0.17)),
    "large on a roll": PrintJob((200,), LandmarkKind(8, 0.12, 0.17), parse_paper("roll-914")),
    "wide and flat": PrintJob((5,), LandmarkKind(4, 0.05, 0.35, "flat")),
    "long segments": PrintJob((21,), LandmarkKind(5, 0.5, 0.05, "flat")),
    "small": PrintJob((1, 2, 31), LandmarkKind(5, 0.01, 0.02)),
    "narrow": PrintJob((9, 10), LandmarkKind(5, 0.04, 0.03, "flat")),
    "thin": PrintJob((9, 10), LandmarkKind(4, 0.04, 0.02, "flat")),
    "thin tube": PrintJob((9, 100), LandmarkKind(8, 0.04, 0.004)),
    "strips": PrintJob((9, 200), LandmarkKind(8, 0.04, 0.008, "flat"), overlap=40.0),
    "tiny": PrintJob((1, 2, 3), LandmarkKind(4, 0.002, 0.002, "flat"), parse_paper("140x140")),
    "letter": PrintJob((1,), LandmarkKind(6), parse_paper("Letter"), overlap=5.0),
    "monochrome": PrintJob((3,), bright=Ink("#ffffff"), dark=Ink("#000000")),
}


def bounds(item: Item) -> Bounds:
    """Of everything that the item blackens, generously for words."""
    if isinstance(item, Box):
        return item.x, item.y, item.x + item.width, item.y + item.height
    if isinstance(item, Text):
        length = text_width(item.words, item.size, item.bold)
        start = {"start": 0.0, "middle": -length / 2, "end": -length}[item.anchor]
        along, up = (start, start + length), (-0.25 * item.size, 0.8 * item.size)
        if item.angle == 0:
            return item.x + along[0], item.y - up[1], item.x + along[1], item.y - up[0]
        assert item.angle == 90
        return item.x - up[1], item.y - along[1], item.x - up[0], item.y - along[0]
    half = item.width / 2 if isinstance(item, Stroke) else 0.0
    xs, ys = zip(*item.points, strict=True)
    # All of our strokes run along or across; their ends are cut off square.
    wide = half if len(set(xs)) == 1 or len(item.points) > 2 else 0.0
    tall = half if len(set(ys)) == 1 or len(item.points) > 2 else 0.0
    return min(xs) - wide, min(ys) - tall, max(xs) + wide, max(ys) + tall


def area(boxes: list[Bounds]) -> float:
    """Of boxes that do not overlap, which is checked."""
    for i, a in enumerate(boxes):
        for b in boxes[:i]:
            wide, tall = min(a[2], b[2]) - max(a[0], b[0]), min(a[3], b[3]) - max(a[1], b[1])
            assert wide < 1e-6 or tall < 1e-6
    return sum((x1 - x0) * (y1 - y0) for x0, y0, x1, y1 in boxes)


def codes(sheet: Sheet, page: Page) -> list[Bounds]:
    return [(p.x, p.y, p.x + p.tile.width, p.y + p.tile.height) for p in page.placed]


@pytest.mark.parametrize("name", JOBS)
def test_sheets_put_together_are_the_code(name: str) -> None:
    job = JOBS[name]
    pages = job.pages()
    drawing = job.drawing(pages)
    segment, width = job.kind.segment * 1000, job.kind.diameter * 1000
    if job.kind.shape == "cylinder":
        width *= math.pi
    painted: dict[int, list[tuple[Bounds, Ink]]] = defaultdict(list)
    for page, sheet in zip(pages, drawing.sheets[1:], strict=True):
        for item in sheet.items:
            if not (isinstance(item, Box) and item.role == "code"):
                continue
            x0, y0, x1, y1 = bounds(item)
            (placed,) = (
                p
                for p in page.placed
                if p.x - 1e-6 <= x0
                and x1 <= p.x + p.tile.width + 1e-6
                and p.y - 1e-6 <= y0
                and y1 <= p.y + p.tile.height + 1e-6
            )
            dx, dy = placed.tile.left - placed.x, placed.tile.top - placed.y
            painted[placed.tile.landmark].append(((x0 + dx, y0 + dy, x1 + dx, y1 + dy), item.ink))
    assert set(painted) == set(job.ids)
    for number, boxes in painted.items():
        dark = [box for box, ink in boxes if ink == job.dark]
        bright = [box for box, ink in boxes if ink == job.bright]
        assert len(dark) + len(bright) == len(boxes)
        assert area(dark) == pytest.approx(width * segment * job.kind.segments)  # no gap
        assert min(box[0] for box in dark) == pytest.approx(0, abs=1e-6)
        assert max(box[2] for box in dark) == pytest.approx(width, abs=1e-6)
        assert min(box[1] for box in dark) == pytest.approx(0, abs=1e-6)
        assert max(box[3] for box in dark) == pytest.approx(segment * job.kind.segments, abs=1e-6)
        read = ""
        for index in range(job.kind.segments):
            top, bottom = index * segment, (index + 1) * segment
            inside = [
                (x0, max(y0, top), x1, min(y1, bottom))
                for x0, y0, x1, y1 in bright
                if min(y1, bottom) - max(y0, top) > 1e-6
            ]
            share = area(inside) / (width * segment)
            assert share == pytest.approx(round(share), abs=1e-6)  # all of a segment or nothing
            read += str(round(share))
        assert decode(read) == number


@pytest.mark.parametrize("name", JOBS)
def test_nothing_but_its_colours_is_in_the_code(name: str) -> None:
    job = JOBS[name]
    pages = job.pages()
    for page, sheet in zip(pages, job.drawing(pages).sheets[1:], strict=True):
        for item in sheet.items:
            if isinstance(item, Box) and item.role == "code":
                continue
            if isinstance(item, Box) and item.role == "bleed":
                # Painted before the code, which lies over it.
                after = sheet.items[sheet.items.index(item) :]
                assert any(isinstance(i, Box) and i.role == "code" for i in after)
                continue
            x0, y0, x1, y1 = bounds(item)
            for code in codes(sheet, page):
                inside = (
                    min(x1, code[2]) - max(x0, code[0]) > 1e-6
                    and min(y1, code[3]) - max(y0, code[1]) > 1e-6
                )
                assert not inside, item


@pytest.mark.parametrize("name", JOBS)
def test_everything_is_where_printers_reach(name: str) -> None:
    for sheet in JOBS[name].drawing().sheets:
        for item in sheet.items:
            x0, y0, x1, y1 = bounds(item)
            assert x0 >= MARGIN - 0.1, item
            assert y0 >= MARGIN - 0.1, item
            assert x1 <= sheet.width - MARGIN + 0.1, item
            assert y1 <= sheet.height - MARGIN + 0.1, item


@pytest.mark.parametrize("name", JOBS)
def test_words_do_not_run_into_each_other(name: str) -> None:
    for sheet in JOBS[name].drawing().sheets:
        words = [item for item in sheet.items if isinstance(item, Text)]
        # A line's letters proper: without the room above and below that lines share.
        tight = []
        for item in words:
            x0, y0, x1, y1 = bounds(item)
            trim = 0.25 * item.size
            tight.append((x0, y0, x1, y1 - trim) if item.angle == 0 else (x0, y0, x1 - trim, y1))
        for i, a in enumerate(tight):
            for j, b in enumerate(tight[:i]):
                apart = a[2] <= b[0] or b[2] <= a[0] or a[3] <= b[1] or b[3] <= a[1]
                assert apart, (words[i], words[j])


@pytest.mark.parametrize("name", JOBS)
def test_each_sheet_says_what_it_is(name: str) -> None:
    job = JOBS[name]
    pages = job.pages()
    drawing = job.drawing(pages)
    assert len(drawing.sheets) == len(pages) + 1
    for number, sheet in enumerate(drawing.sheets, start=1):
        words = [item.words for item in sheet.items if isinstance(item, Text)]
        assert f"sheet {number} of {len(drawing.sheets)}" in words
        (ruler,) = (i for i in sheet.items if isinstance(i, Stroke) and i.role == "ruler")
        (x0, y0), (x1, y1) = ruler.points
        assert x0 == x1
        assert abs(y1 - y0) == pytest.approx(100.0, abs=1e-9)
        assert any("must be 100 mm" in text for text in words)
    for page, sheet in zip(pages, drawing.sheets[1:], strict=True):
        words = [item.words for item in sheet.items if isinstance(item, Text)]
        for placed in page.placed:
            tile = placed.tile
            assert any(str(tile.landmark) in text for text in words)
            if tile.parts > 1:
                wanted = rf"part {tile.number} of {tile.parts}\b|: {tile.number}/{tile.parts}$"
                assert any(re.search(wanted, text) for text in words)


def test_seams_meet_at_whole_diamonds() -> None:
    """Half diamonds of the same letter lie at the seam, equally far from the code's edge."""
    job = JOBS["tube"]
    pages = job.pages()
    halves: dict[str, list[tuple[float, float]]] = defaultdict(list)
    for page, sheet in zip(pages, job.drawing(pages).sheets[1:], strict=True):
        (placed,) = page.placed
        if placed.tile.landmark != 13:
            continue
        letters = [i for i in sheet.items if isinstance(i, Text) and i.words in ("A", "B", "C")]
        for letter in letters:
            triangle = min(
                (i for i in sheet.items if isinstance(i, Shape) and len(i.points) == 3),
                key=lambda i: math.dist(i.points[2], (letter.x, letter.y)),
            )
            base = triangle.points[0][1]
            assert triangle.points[1][1] == base
            seam = base - placed.y + placed.tile.top
            halves[letter.words].append((letter.x - placed.x, seam))
    assert sorted(halves) == ["A", "B", "C"]
    for places in halves.values():
        assert len(places) == 4
        assert len({round(x, 6) for x, _ in places}) == 2
        assert len({round(y, 6) for _, y in places}) == 1


def test_colours_go_on_under_the_flap_of_a_tube_and_nowhere_else() -> None:
    def bleed(job: PrintJob) -> list[Box]:
        return [
            item
            for sheet in job.drawing().sheets
            for item in sheet.items
            if isinstance(item, Box) and item.role == "bleed"
        ]

    assert bleed(JOBS["flat"]) == []
    job = JOBS["tube"]
    assert {round(box.width, 6) for box in bleed(job)} == {5.0}  # 1 mm of it below the code
    for page, sheet in zip(job.pages(), job.drawing().sheets[1:], strict=True):
        (placed,) = page.placed
        painted: dict[str, list[tuple[float, float, Ink]]] = defaultdict(list)
        for item in sheet.items:
            if isinstance(item, Box) and item.role:
                painted[item.role].append((item.y, item.height, item.ink))
                if item.role == "bleed":
                    assert item.x + item.width == pytest.approx(placed.x + placed.tile.width + 4)
        assert painted["bleed"] == painted["code"]


@settings(max_examples=40)
@given(
    st.sampled_from(SUPPORTED_BITS).flatmap(
        lambda bits: st.tuples(
            st.just(bits), st.sets(st.integers(1, 2**bits - 1), min_size=1, max_size=130)
        )
    ),
    st.sampled_from(["A5", "A4", "Letter", "A3", "A0", "roll-610", "140x140", "140x900"]),
    st.sampled_from(["cylinder", "flat"]),
    st.floats(0.002, 0.03),
)
def test_instructions_fit_their_sheet(
    ids: tuple[int, set[int]], paper: str, shape: str, segment: float
) -> None:
    bits, chosen = ids
    kind = LandmarkKind(bits, segment, 0.03, "flat" if shape == "flat" else "cylinder")
    job = PrintJob(tuple(sorted(chosen)), kind, parse_paper(paper))
    sheet = job.drawing().sheets[0]
    for item in sheet.items:
        x0, y0, x1, y1 = bounds(item)
        assert MARGIN - 0.1 <= x0 < x1 <= sheet.width - MARGIN + 0.1, item
        assert MARGIN - 0.1 <= y0 < y1 <= sheet.height - MARGIN + 0.1, item
    words = " ".join(item.words for item in sheet.items if isinstance(item, Text))
    assert "100 %" in words
    if len(chosen) > 1:
        near = any((a ^ b).bit_count() == 1 for a in chosen for b in chosen)
        assert ("differ in one segment only" in words) == near


def test_instructions_name_all_ids() -> None:
    chosen = id_set(6)
    sheet = PrintJob(chosen, LandmarkKind(6)).drawing().sheets[0]
    words = " ".join(item.words for item in sheet.items if isinstance(item, Text))
    for number in chosen:
        assert f" {number}," in words or f" {number}." in words or f" {number} " in words


@pytest.mark.parametrize("number", [1, 6, 13, 15])
def test_the_detector_reads_what_is_printed(number: int) -> None:
    """The sheets glued together, seen from three metres by a camera with C = 600."""
    job = PrintJob((number,), LandmarkKind(shape="flat"))
    pages = job.pages()
    fine, scale = 8, 8 * 600 / 3000  # pixels of the fine picture per millimetre
    height, width = 300, 400
    picture = np.full((height * fine, width * fine, 3), 150, np.uint8)
    left, top = (width / 2 + 20) * fine, height * fine / 2 - 325 * scale
    for page, sheet in zip(pages, job.drawing(pages).sheets[1:], strict=True):
        for placed in page.placed:
            for item in sheet.items:
                x0, y0, x1, y1 = bounds(item)
                if not (isinstance(item, Box) and item.role == "code"):
                    continue
                if not placed.x - 1 < x0 < x1 < placed.x + placed.tile.width + 1:
                    continue
                dx, dy = placed.tile.left - placed.x, placed.tile.top - placed.y
                columns = [round(left + (x + dx) * scale) for x in (x0, x1)]
                rows = [round(top + (y + dy) * scale) for y in (y0, y1)]
                color = [round(255 * channel) for channel in reversed(item.ink.channels)]
                picture[slice(*rows), slice(*columns)] = color
    image: Image = np.asarray(
        cv2.resize(picture, (width, height), interpolation=cv2.INTER_AREA), np.uint8
    )
    camera = Camera(constant=600, width=width, height=height, center_x=199.5, center_y=149.5)
    (found,) = LandmarkDetector(camera, dict.fromkeys(range(1, 16), job.kind)).detect(image)
    assert found.id == number
    assert found.range == pytest.approx(3.0, rel=0.01)


@pytest.mark.parametrize(
    ("fields", "expected"),
    [
        ({"ids": ()}, "at least one"),
        ({"ids": (1, 1)}, "each once"),
        ({"ids": (16,)}, "expected 1 to 15"),
        ({"ids": (1,), "overlap": 4.0}, "expected 5 to 40 mm"),
        ({"ids": (1,), "overlap": math.nan}, "expected 5 to 40 mm"),
        ({"ids": (1,), "bright": RICH_BLACK, "dark": ORANGE}, "much brighter"),
        ({"ids": (1,), "bright": Ink("#202020")}, "much brighter"),
        ({"ids": (1,), "bright": Ink("#ff6600"), "dark": Ink("#ff0000")}, "much brighter"),
        ({"ids": (1,), "bright": Ink("#1040e0"), "dark": Ink("#00a000")}, "much brighter"),
    ],
)
def test_impossible_jobs_are_refused(fields: dict[str, object], expected: str) -> None:
    with pytest.raises(InputError, match=expected):
        PrintJob(**fields)  # type: ignore[arg-type]


@pytest.mark.parametrize("color", ["red", "#12", "#gggggg", "ff6600", "#ff66001", ""])
def test_colours_are_six_digits(color: str) -> None:
    with pytest.raises(InputError, match="expected #rrggbb"):
        Ink(color)


def test_a_light_code_ends_against_dark_paper() -> None:
    """White on white would hide where the code begins: there it would be measured too long."""
    job = JOBS["monochrome"]
    for page, sheet in zip(job.pages(), job.drawing().sheets[1:], strict=True):
        (placed,) = page.placed
        tile = placed.tile
        ends = [i for i in sheet.items if isinstance(i, Box) and i.ink == job.dark]
        for wanted, y in (
            (tile.first_row, placed.y - 1),
            (tile.last_row, placed.y + tile.height + 1),
        ):
            assert any(box.y < y < box.y + box.height for box in ends) == wanted
    orange = JOBS["tube"]
    for page, sheet in zip(orange.pages(), orange.drawing().sheets[1:], strict=True):
        for item in sheet.items:
            if isinstance(item, Box):
                assert item.y >= page.placed[0].y - 1e-6


def test_instructions_speak_of_the_colours_there_are() -> None:
    for name, orange in (("tube", True), ("monochrome", False)):
        sheet = JOBS[name].drawing().sheets[0]
        words = " ".join(item.words for item in sheet.items if isinstance(item, Text))
        assert ("orange" in words) == orange
