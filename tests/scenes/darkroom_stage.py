"""The darkroom's stage: what stands behind the landmarks, as reflectance seen by the sensor's grid.

Colours are reflectances, blue, green, red, linear, 0 to 1. Drawing happens on a plane twice as
fine as the picture, back to front.
"""

from __future__ import annotations

from collections.abc import Sequence

import cv2
import numpy as np
from numpy.typing import NDArray
from scenes.darkroom_camera import OVER, Plane
from scenes.darkroom_mesh import CAMERA_HEIGHT, CENTER, CONSTANT, HEIGHT, WIDTH, View

Array = NDArray[np.float64]
Color = Sequence[float] | NDArray[np.float64]
Vector = Sequence[float] | NDArray[np.float64]


def grain(rng: np.random.Generator, shape: tuple[int, int], cells: tuple[float, float]) -> Plane:
    """Smooth noise of mean 0 and spread about 1, ``cells`` (down, across) blobs over ``shape``."""
    small = rng.standard_normal(
        (max(2, int(cells[0]) + 2), max(2, int(cells[1]) + 2)), dtype=np.float32
    )
    big = cv2.resize(small, (shape[1], shape[0]), interpolation=cv2.INTER_CUBIC)
    return np.asarray(big * np.float32(1.3))


class Stage:
    """The plane that is drawn on."""

    def __init__(self, view: View):
        self.still = View(view.pitch, view.roll)
        self.shape = (HEIGHT * OVER, WIDTH * OVER)
        self.plane: Plane = np.full((*self.shape, 3), 0.3, np.float32)
        self._turn = self.still.rotation().T

    def fill(self, picture: Plane) -> None:
        """Cover everything."""
        self.plane = np.ascontiguousarray(
            cv2.resize(picture, self.shape[::-1], interpolation=cv2.INTER_LINEAR), np.float32
        )

    def pixels(self, points: Array) -> Array:
        """World points to positions on the plane."""
        return (self.still.project(np.asarray(points, float)) + 0.5) * OVER - 0.5

    def spot(self, pixels: Array, color: Color, soft: float = 0.0) -> None:
        """A polygon of positions on the plane; ``soft`` blurs its border (plane pixels)."""
        mask = self.mask(pixels, soft)
        if mask is None:
            return
        (x0, y0, x1, y1), cover = mask
        part = self.plane[y0:y1, x0:x1]
        part += (np.asarray(color, np.float32) - part) * cover[:, :, None]

    def mask(
        self, pixels: Array, soft: float = 0.0
    ) -> tuple[tuple[int, int, int, int], Plane] | None:
        """The box (x0, y0, x1, y1) of a polygon that is on the plane, and the cover in it."""
        margin = int(3 * soft) + 2
        low = np.floor(pixels.min(axis=0)).astype(int) - margin
        high = np.ceil(pixels.max(axis=0)).astype(int) + margin + 1
        x0, y0 = np.maximum(low, 0)
        x1, y1 = np.minimum(high, self.shape[::-1])
        if x1 <= x0 or y1 <= y0:
            return None
        cover = np.zeros((y1 - y0, x1 - x0), np.uint8)
        moved = np.clip((pixels - np.array([x0, y0])) * 16, -(2**28), 2**28)
        cv2.fillPoly(cover, [np.round(moved).astype(np.int32)], 255, cv2.LINE_AA, 4)
        smooth: Plane = np.asarray(cover, np.float32) / np.float32(255)
        if soft:
            smooth = np.asarray(cv2.GaussianBlur(smooth, (0, 0), soft), np.float32)
        return (int(x0), int(y0), int(x1), int(y1)), smooth

    def face(self, corners: Array, color: Color) -> None:
        """A plane polygon of world points in one colour."""
        clipped = self._in_front(np.asarray(corners, float))
        if len(clipped) >= 3:
            self.spot(self.pixels(clipped), color)

    def panel(self, corner: Vector, along: Vector, below: Vector, texture: Plane) -> None:
        """A texture on the parallelogram from ``corner`` to the right and down (metres)."""
        origin, right, down = (np.asarray(v, np.float64) for v in (corner, along, below))
        corners = np.array([origin, origin + right, origin + right + down, origin + down])
        clipped = self._in_front(corners)
        if len(clipped) < 3:
            return
        high, wide = texture.shape[:2]
        frame = np.column_stack(
            [right / wide, down / high, origin - np.array([0, 0, CAMERA_HEIGHT])]
        )
        to_pixel = np.array(
            [[CENTER[0], -CONSTANT, 0.0], [CENTER[1], 0.0, -CONSTANT], [1.0, 0.0, 0.0]]
        )
        to_plane = np.array([[OVER, 0, (OVER - 1) / 2], [0, OVER, (OVER - 1) / 2], [0, 0, 1.0]])
        homography = to_plane @ to_pixel @ self._turn @ frame
        mask = self.mask(self.pixels(clipped))
        if mask is None:
            return
        (x0, y0, x1, y1), cover = mask
        shift = np.array([[1, 0, -x0], [0, 1, -y0], [0, 0, 1.0]])
        seen = cv2.warpPerspective(
            texture, shift @ homography, (x1 - x0, y1 - y0), borderMode=cv2.BORDER_REFLECT_101
        )
        part = self.plane[y0:y1, x0:x1]
        part += (seen - part) * cover[:, :, None]

    def shade(self, field: Plane) -> None:
        """Multiply everything by a field that is stretched over the picture."""
        if field.shape != self.shape:
            field = np.asarray(
                cv2.resize(field, self.shape[::-1], interpolation=cv2.INTER_CUBIC), np.float32
            )
        self.plane *= field[:, :, None]

    def darken(self, pixels: Array, amount: float, soft: float) -> None:
        """A soft shadow over a polygon of positions on the plane."""
        mask = self.mask(pixels, soft)
        if mask is not None:
            (x0, y0, x1, y1), cover = mask
            self.plane[y0:y1, x0:x1] *= 1 - np.float32(amount) * cover[:, :, None]

    def lit_ellipse(
        self, center: Color, radii: Color, color: Color, light: float, glossy: float = 0.0
    ) -> None:
        """An ellipsoid (plane positions and pixels) lit from the side, left negative."""
        cx, cy = float(center[0]), float(center[1])
        rx, ry = max(float(radii[0]), 0.5), max(float(radii[1]), 0.5)
        x0, x1 = max(int(cx - rx) - 1, 0), min(int(cx + rx) + 3, self.shape[1])
        y0, y1 = max(int(cy - ry) - 1, 0), min(int(cy + ry) + 3, self.shape[0])
        if x1 <= x0 or y1 <= y0:
            return
        y, x = np.ogrid[y0:y1, x0:x1]
        u, v = (x - cx) / rx, (y - cy) / ry
        far = u * u + v * v
        cover = np.clip((1 - np.sqrt(far)) * min(rx, ry) + 0.5, 0, 1)
        depth = np.sqrt(np.clip(1 - far, 0, 1))
        bright = 0.35 + 0.65 * np.clip((light * u - 0.5 * v + 0.8 * depth) / 1.25, 0, 1)
        shine = glossy * np.clip(light * u * 0.5 - 0.35 * v + 0.85 * depth, 0, 1) ** 40
        shown = bright[..., None] * np.asarray(color) + shine[..., None]
        part = self.plane[y0:y1, x0:x1]
        part += ((shown - part) * cover[..., None]).astype(np.float32)

    def shear(self, view: View) -> None:
        """Lean everything as the rolling shutter of a panning camera does."""
        if view.pan_rate * view.readout == 0:
            return
        high, wide = self.shape
        rows = (np.arange(high) + 0.5) / OVER - 0.5
        shift = OVER * CONSTANT * np.tan(view.yaw(rows))
        slope = float((shift[-1] - shift[0]) / (high - 1))
        matrix = np.array([[1, slope, shift[0]], [0, 1, 0]])
        self.plane = np.asarray(
            cv2.warpAffine(self.plane, matrix, (wide, high), borderMode=cv2.BORDER_REFLECT_101)
        )

    def _in_front(self, corners: Array, near: float = 0.25) -> Array:
        """The part of a polygon that lies at least ``near`` before the camera."""
        depth = (corners - [0, 0, CAMERA_HEIGHT]) @ self._turn[0] - near
        kept: list[Array] = []
        for i in range(len(corners)):
            j = (i + 1) % len(corners)
            if depth[i] >= 0:
                kept.append(corners[i])
            if (depth[i] >= 0) != (depth[j] >= 0):
                t = depth[i] / (depth[i] - depth[j])
                kept.append(corners[i] + t * (corners[j] - corners[i]))
        return np.array(kept)
