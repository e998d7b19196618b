"""Landmarks of any bright colour: what is accepted, and that the eye reads them."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from vision_scenes import CAMERA, jpeg, picture, pole

from polepilot.core.errors import InputError
from polepilot.core.landmark import SUPPORTED_BITS, LandmarkKind
from polepilot.core.observation import Image
from polepilot.core.sim.render import Look
from polepilot.core.vision.detector import LandmarkDetector
from polepilot.core.vision.paint import COLOURS, ORANGE, Paint

ALL = dict.fromkeys(range(1, 16), LandmarkKind())
GREY = Look(bright=(0.6, 0.6, 0.6))
WARM, COLD = (0.42, 0.78, 1.3), (1.3, 1.0, 0.85)


def check(detector: LandmarkDetector, image: Image, number: int, away: float) -> None:
    found = detector.detect(image)
    assert [one.id for one in found] == [number]
    assert found[0].range == pytest.approx(away, rel=0.01)


@pytest.mark.parametrize("name", COLOURS)
def test_every_colour_is_read(name: str) -> None:
    paint = Paint.parse(name)
    detector = LandmarkDetector(CAMERA, ALL, paint)
    for number, away in ((6, 3.0), (13, 6.0), (9, 9.0), (2, 9.0)):
        for bearing in (-0.2, 0.1):
            mark = pole(number, away, bearing)
            check(detector, picture([mark], seed=number, look=Look.painted(paint)), number, away)


@pytest.mark.parametrize("name", ["red", "yellow", "green", "blue", "magenta", "white"])
@pytest.mark.parametrize("light", [WARM, COLD])
@pytest.mark.parametrize("exposure", [0.15, 1.0])
def test_colours_survive_light(
    name: str, light: tuple[float, float, float], exposure: float
) -> None:
    paint = Paint.parse(name)
    bright = Look.painted(paint).bright
    look = Look(bright=bright, light=light, exposure=exposure)
    image = picture([pole(11, 4.5, 0.15)], seed=3, look=look)
    check(LandmarkDetector(CAMERA, ALL, paint), image, 11, 4.5)


@pytest.mark.parametrize("name", ["red", "yellow", "green", "blue", "magenta", "white"])
def test_colours_survive_jpeg(name: str) -> None:
    paint = Paint.parse(name)
    image = jpeg(picture([pole(5, 3.0, -0.1)], seed=2, look=Look.painted(paint)))
    check(LandmarkDetector(CAMERA, ALL, paint), image, 5, 3.0)


@pytest.mark.parametrize("bits", [bits for bits in SUPPORTED_BITS if bits > 4])
@pytest.mark.parametrize("name", ["green", "blue", "white"])
def test_longer_codes(bits: int, name: str) -> None:
    paint = Paint.parse(name)
    kind = LandmarkKind(bits=bits)
    detector = LandmarkDetector(CAMERA, dict.fromkeys(range(1, 2**bits), kind), paint)
    for number in (1, 0b10110 % 2**bits, 2**bits - 1):
        mark = pole(number, 4.5, 0.1, kind)
        check(detector, picture([mark], seed=bits, look=Look.painted(paint)), number, 4.5)


@pytest.mark.parametrize("name", COLOURS)
def test_a_monochrome_picture_has_no_colour(name: str) -> None:
    detector = LandmarkDetector(CAMERA, ALL, Paint.parse(name))
    for number, away in ((6, 3.0), (13, 6.0), (9, 9.0)):
        seen = picture([pole(number, away, 0.1)], seed=number, look=GREY)
        check(detector, np.ascontiguousarray(seen[:, :, 1]), number, away)


@pytest.mark.parametrize("name", [name for name in COLOURS if name != "white"])
def test_a_grey_ladder_is_no_landmark_of_a_colour(name: str) -> None:
    detector = LandmarkDetector(CAMERA, ALL, Paint.parse(name))
    # White balance is good to about this; grey in the light of a candle is orange.
    for light in ((1.0, 1.0, 1.0), (0.85, 1.0, 1.15), (1.15, 1.0, 0.85)):
        for away in (3.0, 6.0):
            look = Look(bright=(0.6, 0.6, 0.6), light=light)
            assert detector.detect(picture([pole(13, away, 0.0)], look=look)) == []


def test_colours_are_told_apart() -> None:
    poles = [pole(13, 3.0, 0.0)]
    pairs = (("green", "orange"), ("orange", "green"), ("blue", "red"), ("orange", "magenta"))
    for other, wanted in pairs:
        image = picture(poles, look=Look.painted(Paint.parse(other)))
        assert LandmarkDetector(CAMERA, ALL, Paint.parse(wanted)).detect(image) == []


@pytest.mark.parametrize("colour", ["#ffff00", "#00ffff", "#ff00ff", "cyan"])
@pytest.mark.parametrize("light", [(1.0, 1.0, 1.0), (0.6, 0.9, 1.2), (1.2, 1.0, 0.85)])
def test_two_bright_channels(colour: str, light: tuple[float, float, float]) -> None:
    paint = Paint.parse(colour)
    look = Look(bright=Look.painted(paint).bright, light=light)
    image = picture([pole(11, 4.5, 0.15)], seed=3, look=look)
    check(LandmarkDetector(CAMERA, ALL, paint), image, 11, 4.5)


def test_orange_is_what_it_was() -> None:
    assert ORANGE == Paint.parse(" Orange ") == Paint.parse("#FF6600")
    assert ORANGE.channels == (2, 0)
    assert ORANGE.weights == (29, 150, 77)
    assert Look.painted(ORANGE) == Look()


def test_names_and_numbers() -> None:
    assert str(Paint.parse("#00a040")) == "green"
    assert str(Paint.parse("#00a041")) == "#00a041"
    assert Paint.parse("#10c020").channels[0] == 1
    assert Paint.parse("blue").channels[0] == 0
    assert Paint.parse("magenta").channels == (2, 1)
    assert Paint.parse("white").channels == (1, None)
    assert Paint.parse("#c8c8c8").channels == (1, None)
    assert not Paint.parse("white").coloured


@pytest.mark.parametrize(
    "text", ["", "beige", "#12", "00a040", "#00a04g", "#d0a0a0", "#101010", "#400000", "black"]
)
def test_what_is_no_bright_colour(text: str) -> None:
    with pytest.raises(InputError, match=r"bright is .*: expected a bright colour .*or white"):
        Paint.parse(text)


@settings(deadline=None)
@given(st.tuples(*[st.integers(0, 255)] * 3))
def test_every_paint_stands_out(colour: tuple[int, int, int]) -> None:
    try:
        paint = Paint(*colour)
    except InputError:
        return
    assert sum(paint.weights) == 256
    assert min(paint.weights) >= 0
    high, low = paint.channels
    assert high != low
    assert paint.coloured == (low is not None)
    if low is not None:
        assert paint.bgr[high] == max(paint.bgr)
        assert paint.reflectance[low] <= 0.4 * paint.reflectance[high]
    seen = sum(w * grey for w, grey in zip(paint.weights, paint.bgr, strict=True)) / 256
    assert seen >= 0.49 * max(paint.bgr)
