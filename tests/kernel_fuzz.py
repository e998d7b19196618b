"""Throws nonsense at the eye's kernel: ``python kernel_fuzz.py LIBRARY SEED COUNT``.

For a library built by ``hatch_build.py --kernel --sanitize``, in a process that has preloaded the
sanitizer's runtime: a wrong access or an undefined operation ends the process with a report. Each
case follows from its number alone; the last number on standard output is that of the case that
failed.
"""

from __future__ import annotations

import math
import os
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import numpy.typing as npt
from numpy.random import Generator

from polepilot.core.landmark import SUPPORTED_BITS, LandmarkKind, Shape, encode
from polepilot.core.observation import Image
from polepilot.core.vision import kernel
from polepilot.core.vision.kernel import Kernel, Strip
from polepilot.core.vision.paint import COLOURS, Paint

Canvas = npt.NDArray[np.float64]
"""A picture that is being drawn: rows x columns x 3, grey levels."""
THIN = ((1, 10_000), (10_000, 1), (1, 1), (7, 400), (8, 1), (8, 8), (10_000, 2), (3_000, 5))
"""Rows and columns of pictures that are none."""
MEASURES = (
    *("reason", "id", "bits", "sides", "column", "row", "unit", "sag", "lean", "width", "front"),
    *("aside", "blur", "noise", "side_noise", "tint", "unit_sigma", "sag_sigma", "column_sigma"),
)


def fuzz(library: Path, runtime: Path, seed: int, count: int) -> None:
    """Cases 0 to ``count`` in a process of their own, with the sanitizer's ``runtime``.

    Raises:
        AssertionError: one of them failed; the message names it and has the report.
    """
    done = subprocess.run(
        [sys.executable, __file__, str(library), str(seed), str(count)],
        env={**os.environ, "LD_PRELOAD": str(runtime), "ASAN_OPTIONS": "detect_leaks=0"},
        capture_output=True,
        text=True,
        check=False,
    )
    last = (done.stdout.split() or ["none"])[-1]
    assert (done.returncode, last) == (0, "done"), (
        f"seed {seed}, case {last}:\n{done.stderr[:6000]}"
    )


def case(seed: int, number: int) -> None:
    """One kernel looks at one picture.

    Raises:
        AssertionError: the answer makes no sense.
    """
    rng = np.random.default_rng((seed, number))
    kinds = kinds_of(rng)
    paint = Paint.parse(list(COLOURS)[rng.integers(len(COLOURS))])
    constant = float(rng.choice([600.0, 10 ** rng.uniform(1, 4), 10 ** rng.uniform(-3, 9)]))
    image = stored(rng, picture(rng, kinds, paint))
    before = image.copy()
    check(Kernel(kinds, constant, paint).look(image), kinds)
    assert np.array_equal(image, before)


def giant() -> None:
    """A code of twelve million rows, of a landmark a thousand times as thick as it is long."""
    code = np.frombuffer(encode(13).encode(), np.uint8) == ord("1")
    column = np.repeat(np.pad(code, 2), 700_000)[:, None] * np.uint8(255)
    kinds = {13: LandmarkKind(segment=0.002, diameter=10)}
    check(Kernel(kinds, 600.0).look(column), kinds)


def kinds_of(rng: Generator) -> dict[int, LandmarkKind]:
    """Landmarks of one number of bits, of several, or none; of any size that is allowed."""
    usual = rng.random() < 0.5
    kinds = {}
    for bits in rng.permutation(SUPPORTED_BITS)[: rng.integers(0, 4) + usual]:
        segment, diameter = (0.05, 0.07) if usual else 10 ** rng.uniform(-2.6, 1, 2)
        shape: Shape = "flat" if rng.random() < 0.3 else "cylinder"
        kind = LandmarkKind(int(bits), float(segment), float(diameter), shape)
        some = rng.permutation(np.arange(1, 2**bits))[: rng.integers(1, 2**bits)]
        kinds.update({int(number): kind for number in some if number not in kinds})
    return kinds


def picture(rng: Generator, kinds: dict[int, LandmarkKind], paint: Paint) -> Image:
    """Noise, stripes or a plain ground, and on most of them codes, anywhere."""
    rows, columns = (int(10 ** rng.uniform(1.3, 2.6)) for _ in range(2))
    match int(rng.integers(8)):
        case 0:
            rows, columns = THIN[rng.integers(len(THIN))]
        case 1:
            rows, columns = int(rng.integers(1000, 4000)), int(rng.integers(1, 400))
    image: Canvas
    match int(rng.integers(4)):
        case 0:
            image = rng.uniform(0, 256, (rows, columns, 3))
        case 1:  # stripes, as dense as they can be, or wide
            period = 10 ** rng.uniform(0.3, 2)
            bright = np.arange(rows) % period < period * rng.uniform(0.2, 0.8)
            image = np.where(bright[:, None, None], paint.bgr, 0) * np.ones((1, columns, 1))
        case _:
            image = np.full((rows, columns, 3), rng.uniform(0, 256, 3))
    for number in rng.permutation(list(kinds) or [0])[: rng.integers(0, 6)]:
        if number:
            draw(rng, image, encode(int(number), kinds[number].bits), kinds[number], paint)
    wild = rng.random() < 0.3
    image += rng.normal(0, 10 ** rng.uniform(-1, 1.5 if wild else 0.7), image.shape)
    image *= rng.uniform(0.1, 3 if wild else 1.0)
    return image.clip(0, 255).astype(np.uint8)


def draw(rng: Generator, image: Canvas, code: str, kind: LandmarkKind, paint: Paint) -> None:
    """A code of any size and lean, anywhere, partly outside too."""
    rows, columns = image.shape[:2]
    unit = max(rows / len(code) * 10 ** rng.uniform(-1.2, 0.2), 0.5)
    width = min(unit * kind.diameter / kind.segment, 2.0 * columns) + rng.choice([0, 3])
    top = rng.uniform(-3 * unit, max(rows - len(code) * unit + 3 * unit, 0))
    column, lean = rng.uniform(-width / 2, columns + width / 2), rng.normal(0, 0.05)
    bright = np.array(paint.bgr) * rng.uniform(0.4, 1.2)
    for y in range(max(math.ceil(top), 0), min(math.ceil(top + len(code) * unit), rows)):
        middle = column + lean * (y - top)
        left, right = (max(round(middle + side * width / 2), 0) for side in (-1, 1))
        lit = code[min(int((y - top) / unit), len(code) - 1)] == "1"
        image[y, left : max(right, left + 1)] = bright if lit else 12


def stored(rng: Generator, image: Image) -> Image:
    """The picture as it may lie in memory: grey, cut out of a larger one, upside down, ..."""
    match int(rng.integers(7)):
        case 0:
            return np.ascontiguousarray(image[..., 1])
        case 1:
            return np.ascontiguousarray(image[..., :1])
        case 2:
            return np.pad(image, ((1, 2), (3, 4), (0, 0)))[1:-2, 3:-4]
        case 3:
            return image[::-1]
        case 4:
            return image[:, ::-1]
        case 5:
            return np.asfortranarray(image)
        case _:
            return image


def check(strips: list[Strip], kinds: dict[int, LandmarkKind]) -> None:
    for strip in strips:
        values = [getattr(strip, name) for name in MEASURES]
        assert all(map(math.isfinite, values)), dict(zip(MEASURES, values, strict=True))
        assert 0 <= strip.reason < len(kernel.REASONS)
        if strip.reason == 0:
            kind = kinds[strip.id]
            assert strip.bits == kind.bits
            assert strip.code.decode() == encode(strip.id, kind.bits)
            assert strip.unit > 0
            assert min(strip.unit_sigma, strip.column_sigma, strip.sag_sigma) > 0


def numbers(text: str) -> Iterator[int]:
    """``200`` means cases 0 to 199; ``=17`` means case 17 alone."""
    yield from [int(text[1:])] if text.startswith("=") else range(int(text))


if __name__ == "__main__":
    kernel._LIBRARY = Path(sys.argv[1])
    giant()
    for number in numbers(sys.argv[3]):
        print(number, flush=True)
        case(int(sys.argv[2]), number)
    print("done")
