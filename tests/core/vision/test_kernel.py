"""The kernel's library and the pictures that Python hands to it."""

from __future__ import annotations

import ctypes
import time
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from vision_scenes import CAMERA, picture, pole

from polepilot.core.errors import InternalError
from polepilot.core.landmark import LandmarkKind
from polepilot.core.observation import Image
from polepilot.core.vision import kernel as module
from polepilot.core.vision.kernel import IDS, MOST_STRIPS, REASONS, Kernel, Strip
from polepilot.core.vision.paint import Paint

KINDS = dict.fromkeys(range(1, 16), LandmarkKind())
KERNEL = Kernel(KINDS, CAMERA.constant)
IMAGE = picture([pole(13, 3.0, 0.1), pole(6, 5.0, -0.1)])


def contents(strips: list[Strip]) -> list[tuple[object, ...]]:
    return [tuple(getattr(strip, name) for name, _ in Strip._fields_) for strip in strips]


EXPECTED = contents(KERNEL.look(IMAGE))


def read(image: Image) -> list[int]:
    return sorted(strip.id for strip in KERNEL.look(image) if not strip.reason)


def test_what_a_strip_says() -> None:
    strips = [strip for strip in KERNEL.look(IMAGE) if not strip.reason]
    assert sorted(strip.id for strip in strips) == [6, 13]
    for strip in strips:
        assert strip.bits == 4
        assert strip.code == {13: b"1101000101011", 6: b"1100010100011"}[strip.id]
        assert strip.sides == 2
        assert 0 < strip.unit_sigma < 0.01
        assert REASONS[strip.reason] == ""
    assert all(0 <= strip.reason < len(REASONS) for strip in KERNEL.look(IMAGE))


@pytest.mark.parametrize(
    "view",
    [
        lambda image: np.asfortranarray(image),
        lambda image: np.stack([image, 255 - image], axis=-1)[..., 0],
        lambda image: image[:, ::-1][:, ::-1],
        lambda image: image[::-1].copy()[::-1],
        lambda image: image[:, ::-1].copy()[:, ::-1],
        lambda image: image[..., ::-1].copy()[..., ::-1],
        lambda image: np.pad(image, ((3, 5), (7, 2), (0, 0)))[3:-5, 7:-2],
        lambda image: np.repeat(image, 2, axis=0)[::2],
        lambda image: np.repeat(image, 2, axis=1)[:, ::2],
        lambda image: np.frombuffer(image.tobytes(), np.uint8).reshape(image.shape),
    ],
)
def test_memory_may_lie_in_any_way(view: object) -> None:
    image = view(IMAGE)  # type: ignore[operator]
    assert np.array_equal(image, IMAGE)
    assert contents(KERNEL.look(image)) == EXPECTED


def test_a_cut_out_is_looked_at_alone() -> None:
    right = [strip.id for strip in KERNEL.look(IMAGE[:, 200:]) if not strip.reason]
    assert right == [6]
    assert read(IMAGE[:, :200]) == [13]
    assert read(IMAGE[:100]) == []


@pytest.mark.parametrize(
    ("paint", "channels"),
    [("#ff6600", [0, 1, 2]), ("#0066ff", [2, 1, 0]), ("#66ff00", [0, 2, 1])],
)
def test_columns_near_the_edge_are_seen_as_any_others(paint: str, channels: list[int]) -> None:
    # The kernel takes sixteen columns at once where there are as many.
    kernel = Kernel(KINDS, CAMERA.constant, Paint.parse(paint))
    image = picture([pole(13, 8.0, 0.1), pole(6, 7.0, -0.1)], seed=3)[:, :, channels]
    whole = contents(kernel.look(image))
    reasons, ids = zip(*[strip[:2] for strip in whole], strict=True)
    assert [number for reason, number in zip(reasons, ids, strict=True) if not reason]
    assert {6, 13} <= set(ids)
    right = int(max(float(str(strip[4])) for strip in whole))
    for width in range(right + 18, image.shape[1]):
        assert contents(kernel.look(image[:, :width])) == whole


def test_grey_in_two_shapes_and_as_a_channel() -> None:
    red = IMAGE[:, :, 2]
    assert not red.flags["C_CONTIGUOUS"]
    found = contents(KERNEL.look(red))
    assert read(red) == [6, 13]
    assert contents(KERNEL.look(red.copy())) == found
    assert contents(KERNEL.look(red[:, :, None])) == found


@pytest.mark.parametrize(
    "size",
    [(0, 0), (0, 5), (5, 0), (0, 400), (300, 0), (1, 1), (7, 400), (8, 1), (8, 0), (3000, 1)],
)
def test_pictures_of_nothing_hold_nothing(size: tuple[int, int]) -> None:
    for shape in (size, (*size, 1), (*size, 3)):
        for value in (0, 255):
            assert KERNEL.look(np.full(shape, value, np.uint8)) == []


@pytest.mark.parametrize(
    "image",
    [
        np.zeros((30, 40, 4), np.uint8),
        np.zeros((30, 40, 2), np.uint8),
        np.zeros((30, 40, 0), np.uint8),
        np.zeros((30, 40, 3), np.uint16),
        np.zeros((30, 40), np.float32),
        np.zeros((30, 40), np.bool_),
        np.zeros(40, np.uint8),
        np.zeros((1, 30, 40, 3), np.uint8),
        np.zeros((), np.uint8),
    ],
)
def test_what_is_no_picture_is_refused(image: Image) -> None:
    with pytest.raises(InternalError, match="expected uint8, rows x columns x 3"):
        KERNEL.look(image)


def test_a_picture_is_not_written_to() -> None:
    image = IMAGE.copy()
    image.setflags(write=False)
    assert contents(KERNEL.look(image)) == EXPECTED
    assert np.array_equal(image, IMAGE)


def test_noise_fills_no_more_than_there_is_room_for() -> None:
    rng = np.random.default_rng(3)
    stripes = np.tile(np.repeat(rng.integers(0, 2, (75, 1)), 4, axis=0) * 255, (1, 400))
    colour = np.zeros((300, 400, 3), np.uint8)
    colour[..., 2] = stripes
    for image in (rng.integers(0, 256, (300, 400, 3), np.uint8), colour, stripes.astype(np.uint8)):
        assert len(KERNEL.look(image)) <= MOST_STRIPS


def test_a_picture_speckled_with_faint_colour_takes_no_long_time() -> None:
    """Every short stretch of faint colour may be a far landmark; laying codes along all of these
    took a second, and takes a hundredth of that."""
    kinds = {
        number: LandmarkKind(bits)
        for bits in (8, 6, 5, 4)  # the lower ids are those of the shorter codes
        for number in range(1, 2**bits)
    }
    rows = np.random.default_rng(5).normal(110, 8, (1200, 1, 1)) * np.ones((1, 1600, 3))
    rows[np.arange(1200) % 28 < 6] += (-14, 0, 14)
    image = rows.clip(0, 255).astype(np.uint8)
    eye = Kernel(kinds, CAMERA.constant)
    begin = time.thread_time()
    eye.look(image)
    assert time.thread_time() - begin < 0.4


def test_no_landmark_is_looked_for() -> None:
    assert [strip for strip in Kernel({}, 600.0).look(IMAGE) if not strip.reason] == []


def test_the_structures_are_those_of_the_library() -> None:
    source = Path(module.__file__).with_name("native") / "eye.h"
    text = source.read_text("utf-8")
    assert f"#define EYE_VERSION {module.VERSION}\n" in text
    assert f"#define EYE_IDS {IDS}\n" in text
    reasons = text[text.index("enum eye_reason {") : text.index("};")]
    assert reasons.count("EYE_") == len(REASONS)
    strip = text[text.index("/* A strip that was looked at closely. */") :]
    strip = strip[: strip.index("} eye_strip;")]
    places = [strip.index(f" {name}") for name, _ in Strip._fields_]
    assert places == sorted(places)


class TestLibrary:
    """Loaded once; missing and foreign ones are said to be so."""

    @pytest.fixture(autouse=True)
    def not_loaded(self, monkeypatch: pytest.MonkeyPatch) -> None:
        monkeypatch.setattr(module, "_loaded", None)

    def test_missing(self, monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
        monkeypatch.setattr(module, "_LIBRARY", tmp_path / "_kernel.so")
        with pytest.raises(InternalError, match=r"_kernel\.so cannot be loaded .*hatch_build\.py"):
            Kernel(KINDS, 600.0)

    def test_no_library(self, monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
        (tmp_path / "_kernel.so").write_text("no library")
        monkeypatch.setattr(module, "_LIBRARY", tmp_path / "_kernel.so")
        with pytest.raises(InternalError, match="cannot be loaded"):
            Kernel(KINDS, 600.0)

    def test_another_version(self, monkeypatch: pytest.MonkeyPatch) -> None:
        other = SimpleNamespace(eye_version=lambda: 99)
        monkeypatch.setattr(ctypes, "CDLL", lambda _: other)
        expected = rf"is of version 99, expected {module.VERSION}: .*hatch_build\.py"
        with pytest.raises(InternalError, match=expected):
            Kernel(KINDS, 600.0)

    def test_no_memory(self, monkeypatch: pytest.MonkeyPatch) -> None:
        def full(*given: object) -> int:
            assert given[-1] == MOST_STRIPS
            return -1

        library = SimpleNamespace(eye_version=lambda: module.VERSION, eye_look=full)
        monkeypatch.setattr(ctypes, "CDLL", lambda _: library)
        with pytest.raises(MemoryError):
            Kernel(KINDS, 600.0).look(IMAGE)

    def test_loaded_once(self, monkeypatch: pytest.MonkeyPatch) -> None:
        calls = []
        load = ctypes.CDLL
        monkeypatch.setattr(ctypes, "CDLL", lambda path: calls.append(path) or load(path))
        Kernel(KINDS, 600.0)
        Kernel(KINDS, 300.0)
        assert len(calls) == 1
