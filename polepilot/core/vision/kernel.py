"""The eye's kernel (native/*.c) as Python sees it: one call per picture, without the GIL.

The library is built while Polepilot is installed (`python hatch_build.py --kernel` by hand).
Everything here is in pixels and linear light; `measure` makes metres and radians of it.
"""

from __future__ import annotations

import ctypes
import math
import struct
from collections.abc import Mapping
from pathlib import Path

import numpy as np

from polepilot.core.errors import InternalError
from polepilot.core.landmark import LandmarkKind
from polepilot.core.observation import Image
from polepilot.core.vision.paint import ORANGE, Paint

VERSION = 4
IDS = 256
MOST_STRIPS = 32
_LIBRARY = Path(__file__).with_name("_kernel.so")
_BYTE = np.dtype(np.uint8)
_SHAPES = ((), (1,), (3,))
"""Channels of a picture: grey in two ways, and blue-green-red."""

REASONS = (
    "",
    "no contrast",
    "leans too far",
    "no scale fits",
    "the edges do not fit",
    "bright segments have the wrong colour",
    "dark segments are not dark",
    "end bars differ",
    "a segment looks like neither colour",
    "no legal code",
    "no landmark of this site",
    "wrong width",
    "cut off",
    "something covers a part",
    "an end bar is what lies behind it",
    "it goes on beyond its end",
)
"""What `Strip.reason` means, in words; the first is a strip that was read."""


class _Kind(ctypes.Structure):
    _fields_ = [
        ("bits", ctypes.c_int32),
        ("flat", ctypes.c_int32),
        ("aspect", ctypes.c_double),
        ("segment", ctypes.c_double),
    ]


class _Task(ctypes.Structure):
    _fields_ = [
        ("high", ctypes.c_int32),
        ("low", ctypes.c_int32),
        ("weights", ctypes.c_int32 * 3),
        ("least_other", ctypes.c_double),
        ("most_other", ctypes.c_double),
        ("constant", ctypes.c_double),
        ("kinds", _Kind * IDS),
    ]


class Strip(ctypes.Structure):
    """A strip that was looked at closely; ``eye_strip`` of native/eye.h, pixels throughout."""

    reason: int
    """0: read; else `REASONS` says why not, and only id, code and place are meaningful."""
    id: int
    bits: int
    sides: int
    """2: both sides are in the picture; 1: one."""
    column: float
    row: float
    """The strip's middle."""
    unit: float
    """Rows per segment there."""
    sag: float
    """By what share rows per segment shrink from segment to segment, going down."""
    lean: float
    """Columns per row, to the right going down."""
    width: float
    front: float
    """Mean height of the surface that was measured, as a share of the radius."""
    aside: float
    """How far to the right of its middle that was, likewise: the picture may cut off a side."""
    blur: float
    noise: float
    """What the fit of the edges leaves over, as a share of bright minus dark."""
    side_noise: float
    """What the fit across the strip leaves over, as a share of its peak."""
    tint: float
    """The paint's darkest channel over its brightest, black taken off."""
    unit_sigma: float
    """Standard deviation of ``unit`` as a share of it."""
    sag_sigma: float
    column_sigma: float
    code: bytes

    _fields_ = [
        ("reason", ctypes.c_int32),
        ("id", ctypes.c_int32),
        ("bits", ctypes.c_int32),
        ("sides", ctypes.c_int32),
        ("column", ctypes.c_double),
        ("row", ctypes.c_double),
        ("unit", ctypes.c_double),
        ("sag", ctypes.c_double),
        ("lean", ctypes.c_double),
        ("width", ctypes.c_double),
        ("front", ctypes.c_double),
        ("aside", ctypes.c_double),
        ("blur", ctypes.c_double),
        ("noise", ctypes.c_double),
        ("side_noise", ctypes.c_double),
        ("tint", ctypes.c_double),
        ("unit_sigma", ctypes.c_double),
        ("sag_sigma", ctypes.c_double),
        ("column_sigma", ctypes.c_double),
        ("code", ctypes.c_char * 24),
    ]


_Strips = Strip * MOST_STRIPS
_PICTURE = struct.Struct("P3in")
"""``eye_picture``: where its first pixel is, rows, columns, channels and stride."""


class Kernel:
    """Looks for one set of landmarks with one camera constant; keeps nothing between pictures.

    Args:
        kinds: the ids that exist (1 to 255) and what each looks like.
        constant: camera constant, pixels.
        paint: what their bright segments are painted with; grey pictures show any of them.

    Raises:
        InternalError: the library is missing or belongs to another version; an id or the constant
            makes no sense.
    """

    def __init__(
        self,
        kinds: Mapping[int, LandmarkKind],
        constant: float,
        paint: Paint = ORANGE,
    ) -> None:
        if not (0 < constant < math.inf and all(0 < number < IDS for number in kinds)):
            raise InternalError(
                f"a camera constant of {constant} and the ids {sorted(kinds)}: expected more than "
                f"0 pixels, and ids from 1 to {IDS - 1}."
            )
        self._look = _library().eye_look
        high, low = paint.channels
        task = _Task(high=high, low=-1 if low is None else low)
        task.weights[:] = paint.weights
        task.least_other, task.most_other = paint.third
        task.constant = constant
        for number, kind in kinds.items():
            task.kinds[number] = _Kind(
                kind.bits, kind.shape == "flat", kind.diameter / kind.segment, kind.segment
            )
        self._task = task
        self._task_at = ctypes.byref(task)

    def look(self, image: Image) -> list[Strip]:
        """All strips of a picture (rows x columns x 3 BGR, or grey) that were worth a closer look,
        read and rejected ones, the widest first. A picture of three equal channels is a grey one.

        Raises:
            InternalError: not such a picture.
            MemoryError: there is no memory for the search.
        """
        shape = image.shape
        if image.dtype != _BYTE or len(shape) not in (2, 3) or shape[2:] not in _SHAPES:
            raise InternalError(
                f"a picture of {image.dtype}, {shape}: expected uint8, rows x columns x 3, "
                "or rows x columns."
            )
        channels = image.shape[2] if image.ndim == 3 else 1
        strides = image.strides
        if strides[-1] != 1 or strides[1] != channels:
            image = np.ascontiguousarray(image)
            strides = image.strides
        picture = _PICTURE.pack(_address_of(image), shape[0], shape[1], channels, strides[0])
        strips = _Strips()
        count = self._look(picture, self._task_at, strips, MOST_STRIPS)
        if count < 0:
            raise MemoryError("no memory to look at a picture")
        return strips[:count]


def _address_of(image: Image) -> int:
    """Where the first pixel is; nearly always in a third of the time that numpy takes to say so."""
    try:
        return ctypes.addressof(ctypes.c_char.from_buffer(image.data))
    except (TypeError, ValueError):  # not to be written to, empty, or a part of another picture
        return image.ctypes.data


def _library() -> ctypes.CDLL:
    global _loaded
    if _loaded is None:
        try:
            library = ctypes.CDLL(str(_LIBRARY))
        except OSError as error:
            raise InternalError(
                f"the eye's kernel {_LIBRARY.name} cannot be loaded ({error}): "
                "run `python hatch_build.py --kernel`, or install Polepilot anew."
            ) from None
        if library.eye_version() != VERSION:
            raise InternalError(
                f"the eye's kernel is of version {library.eye_version()}, expected {VERSION}: "
                "run `python hatch_build.py --kernel`, or install Polepilot anew."
            )
        library.eye_look.restype = ctypes.c_int32
        library.eye_look.argtypes = [
            ctypes.c_void_p,
            ctypes.c_void_p,
            ctypes.c_void_p,
            ctypes.c_int32,
        ]
        _loaded = library
    return _loaded


_loaded: ctypes.CDLL | None = None
