"""Picture files of many kinds, whole and damaged, for the tests of reading them."""

from __future__ import annotations

import io
import struct
import zlib
from collections.abc import Iterator
from typing import Any

import cv2
import numpy as np
from PIL import Image as Pillow

from polepilot.core.observation import Image


def zoo(image: Image) -> dict[str, bytes]:
    """``image`` (BGR) as files, by name; an 8-bit grey or colour picture comes back from each."""
    grey = np.ascontiguousarray(image[:, :, 1])
    deep = image.astype(np.uint16) * 257
    files = {f"colour{kind}": _cv(kind, image) for kind in (".png", ".jpg", ".bmp", ".ppm")}
    files |= {f"grey{kind}": _cv(kind, grey) for kind in (".png", ".jpg", ".bmp", ".tiff", ".pgm")}
    files |= {f"deep{kind}": _cv(kind, deep) for kind in (".png", ".tiff", ".ppm")}
    files |= {f"deep-grey{kind}": _cv(kind, deep[:, :, 1]) for kind in (".png", ".tiff")}
    clear = np.dstack([image, grey])
    files |= {f"clear{kind}": _cv(kind, clear) for kind in (".png", ".webp", ".tiff", ".bmp")}
    files["deep-clear.png"] = _cv(".png", np.dstack([deep, deep[:, :, 1]]))
    files["progressive.jpg"] = _cv(".jpg", image, [cv2.IMWRITE_JPEG_PROGRESSIVE, 1])
    files["restarts.jpg"] = _cv(".jpg", image, [cv2.IMWRITE_JPEG_RST_INTERVAL, 4])
    files["words.ppm"] = _cv(".ppm", image, [cv2.IMWRITE_PXM_BINARY, 0])
    files["bits.pbm"] = _cv(".pbm", np.where(grey > 99, 255, 0).astype(np.uint8))

    picture = Pillow.fromarray(image[:, :, ::-1])
    turned = Pillow.Exif()
    turned[0x0112] = 6  # Orientation: "turn by 90 degrees"
    files["cmyk.jpg"] = _pillow(picture.convert("CMYK"), "JPEG")
    for kind in ("JPEG", "PNG", "WEBP", "TIFF"):
        files[f"turned.{kind.lower()}"] = _pillow(picture, kind, exif=turned)
    few = picture.quantize(32)
    for kind in ("PNG", "BMP", "TIFF", "GIF"):
        files[f"palette.{kind.lower()}"] = _pillow(few, kind)
        if kind != "GIF":
            files[f"bits.{kind.lower()}"] = _pillow(picture.convert("1"), kind)
    files["palette-clear.png"] = _pillow(few, "PNG", transparency=3)
    files["grey-clear.png"] = _pillow(picture.convert("LA"), "PNG")
    files["lossless.webp"] = _pillow(picture, "WEBP", lossless=True)
    for packing in ("raw", "tiff_lzw", "tiff_deflate", "packbits", "jpeg"):
        files[f"{packing}.tiff"] = _pillow(picture, "TIFF", compression=packing)
    more = [Pillow.fromarray(np.roll(image[:, :, ::-1], 9 * i, 1)) for i in (1, 2)]
    for kind in ("GIF", "WEBP", "PNG", "TIFF"):
        files[f"several.{kind.lower()}"] = _pillow(picture, kind, save_all=True, append_images=more)
    return files


def refused(image: Image) -> dict[str, bytes]:
    """Files that are sound and yet not read: formats and kinds of numbers that nobody needs."""
    light = image.astype(np.float32) / 255
    files = {f"light{kind}": _cv(kind, light) for kind in (".tiff", ".hdr", ".pfm")}
    files["double.tiff"] = _cv(".tiff", image.astype(np.float64))
    files["long.tiff"] = _pillow(Pillow.fromarray(image[:, :, 1].astype(np.int32)), "TIFF")
    files["colour.jp2"] = _cv(".jp2", image)
    files["text.png"] = b"no picture at all\n" * 40
    return files


def damaged(data: bytes, rng: np.random.Generator, count: int) -> Iterator[bytes]:
    """``count`` versions of ``data``: bits flipped, bytes replaced, left out; often at the head."""
    for number in range(count):
        reach = len(data) if number % 2 else min(len(data), 120)
        changed = bytearray(data)
        if number % 4 < 2:
            for at in rng.integers(0, reach, int(rng.integers(1, 9))):
                changed[at] ^= 1 << int(rng.integers(0, 8))
        else:
            at, length = int(rng.integers(0, reach)), int(rng.integers(1, 6))
            fillings = (b"\xff" * length, bytes(length), rng.bytes(length), b"")
            changed[at : at + length] = fillings[int(rng.integers(0, 4))]
        yield bytes(changed)


def bomb(width: int, height: int) -> bytes:
    """A PNG of a few kilobytes that says it has ``width`` x ``height`` pixels."""
    head = struct.pack(">IIBBBBB", width, height, 8, 2, 0, 0, 0)
    body = zlib.compress(bytes(3 * width + 1), 9)
    chunks = ((b"IHDR", head), (b"IDAT", body), (b"IEND", b""))
    return b"\x89PNG\r\n\x1a\n" + b"".join(
        struct.pack(">I", len(data)) + name + data + struct.pack(">I", zlib.crc32(name + data))
        for name, data in chunks
    )


def _cv(kind: str, image: Any, settings: list[int] | None = None) -> bytes:
    done, data = cv2.imencode(kind, image, settings or [])
    assert done
    return bytes(data.tobytes())


def _pillow(picture: Pillow.Image, kind: str, **settings: Any) -> bytes:
    file = io.BytesIO()
    picture.save(file, kind, **settings)
    return file.getvalue()
