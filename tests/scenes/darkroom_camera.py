"""The darkroom's camera: from the light that falls on a sensor to a picture in a file.

The sensor has twice the picture's pixels in either direction, or as many, or is ideal (a camera
of several megapixels, scaled down). What follows is what follows in a camera: vignetting, photon
and read noise, quantizing, demosaicing, white balance, colour matrix, tone curve, denoising,
sharpening, JPEG.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import cv2
import numpy as np
from numpy.typing import NDArray
from scenes.darkroom_light import Light

Plane = NDArray[np.float32]

OVER = 2
"""The sensor plane is so many times finer than the picture."""


@dataclass(frozen=True, slots=True)
class Lens:
    """A point's image. Sizes in pixels of the picture."""

    kind: str = "none"
    """``none``, ``gauss`` (``size`` is sigma) or ``disc`` (``size`` is the radius)."""
    size: float = 0.0
    stretch: float = 1.0
    """Longer by this factor along ``angle``."""
    angle: float = 0.0
    smear: float = 0.0
    """Length of the sideways blur of a panning camera."""

    def kernel(self, scale: int) -> Plane | None:
        """What to convolve with on a grid ``scale`` times finer than the picture."""
        if self.kind == "none" and self.smear == 0:
            return None
        fine = 5
        reach = int(np.ceil((3.2 * self.size * self.stretch) * scale)) + 1
        wide = reach + int(np.ceil(self.smear * scale / 2))
        unit = 1 / (fine * scale)
        y, x = np.mgrid[
            -(reach * fine + 2) : reach * fine + 3, -(wide * fine + 2) : wide * fine + 3
        ].astype(np.float64)
        if self.kind == "none":
            spot = ((x == 0) & (y == 0)).astype(np.float64)
        else:
            c, s = np.cos(self.angle), np.sin(self.angle)
            along = (c * x + s * y) * unit / (self.size * self.stretch)
            across = (-s * x + c * y) * unit / self.size
            far = along**2 + across**2
            soft = 0.12 / self.size
            spot = np.exp(-far / 2) if self.kind == "gauss" else _fall((1 - np.sqrt(far)) / soft)
        if self.smear:
            half = self.smear * scale * fine / 2
            steps = np.arange(-int(half) - 1, int(half) + 2)
            box = np.clip(half + 0.5 - np.abs(steps), 0, 1)
            smeared = cv2.filter2D(spot, -1, box[None], borderType=cv2.BORDER_CONSTANT)
            spot = np.asarray(smeared, np.float64)
        coarse = spot.reshape(2 * reach + 1, fine, 2 * wide + 1, fine).sum(axis=(1, 3))
        return np.asarray(coarse / coarse.sum(), np.float32)


def _fall(x: NDArray[np.float64]) -> NDArray[np.float64]:
    return np.clip(x / 2 + 0.5, 0, 1)


@dataclass(frozen=True, slots=True)
class Camera:
    """Everything between the lens and the file."""

    vignette: float = 0.0
    """Share of the light that is missing in the corners."""
    mosaic: int = 0
    """0 an ideal sensor, 1 a Bayer sensor of the picture's size, 2 one of twice the size."""
    corner: int = 0
    """Which colour the mosaic's first pixel has (0 to 3)."""
    demosaic: str = "bilinear"
    """``bilinear`` or ``edge`` (edge-aware)."""
    noise: float = 0.0
    """About what a grey surface of linear 0.2 shows, grey levels; read noise is part of it."""
    pattern: float = 0.0
    """Spread of the pixels' sensitivities."""
    banding: float = 0.0
    """Noise common to a column, as a share of the noise."""
    tone: str = "srgb"
    """``linear``, ``srgb``, ``gamma``, ``shoulder`` or ``contrast``."""
    denoise: str = ""
    """Empty, ``chroma``, ``bilateral`` or ``median``."""
    sharpen: float = 0.0
    jpeg: int = 0
    """Quality, 0 for none."""
    full_chroma: bool = False
    """JPEG 4:4:4, otherwise 4:2:0."""

    def quiet(self) -> Camera:
        """The same without what is random, lost or put in."""
        return replace(
            self, mosaic=0, noise=0.0, pattern=0.0, banding=0.0, denoise="", sharpen=0.0, jpeg=0
        )

    @property
    def headroom(self) -> float:
        """Linear value at which the sensor is full; 1 is what a plain tone curve calls white."""
        return 2.5 if self.tone == "shoulder" else 1.0

    def curve(self, linear: Plane) -> Plane:
        """Linear values (0 to the headroom) to 0 to 1."""
        if self.tone == "linear":
            return np.asarray(np.clip(linear, 0, 1), np.float32)
        if self.tone == "shoulder":
            light = np.maximum(linear, 0)
            rise = light * (1 + light / self.headroom**2)
            linear = np.asarray(rise / (1 + (0.6 + 0.4 / self.headroom) * light), np.float32)
        x = np.asarray(np.clip(linear, 0, 1), np.float32)
        if self.tone == "gamma":
            return np.asarray(np.power(x, np.float32(1 / 2.2)), np.float32)
        y = np.where(
            x < 0.0031308, 12.92 * x, 1.055 * np.power(np.maximum(x, 1e-6), 1 / 2.4) - 0.055
        )
        if self.tone == "contrast":
            y = y - 0.05 * np.sin(2 * np.pi * y)
        return np.asarray(y, np.float32)

    def uncurve(self, level: float) -> float:
        """The linear value that comes out as ``level`` (0 to 1)."""
        grid = np.linspace(0, 1, 4001, dtype=np.float32) * self.headroom
        return float(np.interp(level, self.curve(grid), grid))


_BAYER = {
    "bilinear": [
        cv2.COLOR_BayerBGGR2BGR,
        cv2.COLOR_BayerGBRG2BGR,
        cv2.COLOR_BayerGRBG2BGR,
        cv2.COLOR_BayerRGGB2BGR,
    ],
    "edge": [
        cv2.COLOR_BayerBGGR2BGR_EA,
        cv2.COLOR_BayerGBRG2BGR_EA,
        cv2.COLOR_BayerGRBG2BGR_EA,
        cv2.COLOR_BayerRGGB2BGR_EA,
    ],
}
_CELLS = [((0, 1), (1, 2)), ((1, 0), (2, 1)), ((1, 2), (0, 1)), ((2, 1), (1, 0))]
"""Which colour (blue 0, green 1, red 2) each pixel of a 2x2 cell sees, as `_BAYER` is ordered."""

_PATH = {0: 0.57, 1: 0.75, 2: 1.1}
"""Noise of one sensor pixel that leaves about 1 in the picture, by `Camera.mosaic`."""


def expose(plane: Plane, camera: Camera, light: Light, rng: np.random.Generator) -> Plane:
    """The sensor plane (already blurred) to the picture's linear blue, green and red."""
    if camera.vignette:
        plane = plane * _vignette(plane.shape[0], plane.shape[1], camera.vignette)[:, :, None]
    if camera.mosaic != OVER:
        plane = _halved(plane)
    full = camera.headroom
    if camera.mosaic:
        single = np.empty(plane.shape[:2], np.float32)
        for row, colors in enumerate(_CELLS[camera.corner]):
            for column, color in enumerate(colors):
                single[row::2, column::2] = plane[row::2, column::2, color]
        counts = _noisy(single, camera, rng) * (3700 / full) + 256
        digital = np.clip(counts + 0.5, 0, 3956).astype(np.uint16)
        code = _BAYER[camera.demosaic][camera.corner]
        plane = np.asarray(cv2.cvtColor(digital, code), np.float32) - 256
        plane *= np.float32(full / 3700)
    else:
        plane = np.minimum(_noisy(plane, camera, rng), full)
    plane = np.minimum(plane * light.gains.astype(np.float32), full)
    plane = np.asarray(cv2.transform(plane, light.correction.astype(np.float32)), np.float32)
    if camera.mosaic == OVER:
        plane = _halved(plane)
    return plane


def _halved(plane: Plane) -> Plane:
    small = cv2.resize(plane, None, fx=1 / OVER, fy=1 / OVER, interpolation=cv2.INTER_AREA)
    return np.asarray(small, np.float32)


def develop(linear: Plane, camera: Camera) -> NDArray[np.uint8]:
    """Linear blue, green and red to the picture as it comes out of its file."""
    picture = (camera.curve(linear) * 255 + 0.5).astype(np.uint8)
    if camera.denoise == "bilateral":
        picture = np.asarray(cv2.bilateralFilter(picture, 5, 14, 1.6), np.uint8)
    elif camera.denoise == "median":
        picture = np.asarray(cv2.medianBlur(picture, 3), np.uint8)
    elif camera.denoise == "chroma":
        apart = cv2.cvtColor(picture, cv2.COLOR_BGR2YCrCb)
        apart[..., 1:] = cv2.GaussianBlur(apart[..., 1:], (0, 0), 0.9)
        picture = np.asarray(cv2.cvtColor(apart, cv2.COLOR_YCrCb2BGR), np.uint8)
    if camera.sharpen:
        sharp = picture.astype(np.float32)
        sharp += camera.sharpen * (sharp - cv2.GaussianBlur(sharp, (0, 0), 0.9))
        picture = np.clip(sharp + 0.5, 0, 255).astype(np.uint8)
    if camera.jpeg:
        chroma = (
            cv2.IMWRITE_JPEG_SAMPLING_FACTOR_444
            if camera.full_chroma
            else cv2.IMWRITE_JPEG_SAMPLING_FACTOR_420
        )
        options = [cv2.IMWRITE_JPEG_QUALITY, camera.jpeg, cv2.IMWRITE_JPEG_SAMPLING_FACTOR, chroma]
        picture = np.asarray(cv2.imdecode(cv2.imencode(".jpg", picture, options)[1], 1), np.uint8)
    return picture


def _noisy(plane: Plane, camera: Camera, rng: np.random.Generator) -> Plane:
    if camera.pattern:
        gains = rng.standard_normal(plane.shape, dtype=np.float32)
        plane = plane * (1 + camera.pattern * gains)
    if camera.noise:
        # 286 grey levels per unit is the slope of the sRGB curve at linear 0.2.
        sigma = camera.noise / 286 * _PATH[camera.mosaic]
        spread = (sigma * np.sqrt(0.05 + 0.95 * np.maximum(plane, 0) / 0.2)).astype(np.float32)
        plane = plane + spread * rng.standard_normal(plane.shape, dtype=np.float32)
        if camera.banding:
            shape = (1, *plane.shape[1:])
            bands = rng.standard_normal(shape, dtype=np.float32)
            plane = plane + np.float32(sigma * camera.banding) * bands
    return np.asarray(plane, np.float32)


def _vignette(high: int, wide: int, missing: float) -> Plane:
    y, x = np.ogrid[-1:1:75j, -1:1:100j]
    across = (x**2 * wide**2 + y**2 * high**2) / (wide**2 + high**2)
    coarse = (1 / (1 + across * ((1 - missing) ** -0.5 - 1)) ** 2).astype(np.float32)
    return np.asarray(cv2.resize(coarse, (wide, high), interpolation=cv2.INTER_LINEAR), np.float32)
