"""One picture of the darkroom: poles and what hides them, before a stage, through a camera.

A pole is summed exactly on a window finer than the sensor. What it adds to the picture is the
difference from what is behind it; the lens blurs sums and parts alike, so that the difference is
blurred in its window and added to the blurred stage.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import cv2
import numpy as np
from numpy.typing import NDArray
from scenes.darkroom_camera import OVER, Camera, Lens, Plane, develop, expose
from scenes.darkroom_light import Light
from scenes.darkroom_mesh import (
    HEIGHT,
    WIDTH,
    Canvas,
    Mesh,
    Stand,
    View,
    code_bands,
    post_mesh,
)
from scenes.darkroom_stage import Stage

Array = NDArray[np.float64]

FINE = 4
"""The windows of the poles are so many times finer than the picture."""


@dataclass(frozen=True, slots=True)
class Lamp:
    """How the light falls on a pole. Angles from the direction to the camera, right positive."""

    side: float = 0.0
    ambient: float = 1.0
    """Share of the light that comes from everywhere."""
    gloss: float = 0.0
    """Brightness of the highlight, a white surface being 1."""
    gloss_width: float = 0.15
    strength: float = 1.0
    slope: float = 0.0
    """Brighter at the top by this share than in the middle."""
    mirror: float = 0.0
    """Share of the light that the floor reflects like a mirror."""


@dataclass(frozen=True, slots=True)
class Post:
    """A banded pole, its light, and what stands in front of it."""

    stand: Stand
    lamp: Lamp = field(default_factory=Lamp)
    heights: tuple[float, ...] = ()
    """Borders of the bands, top first; those of the landmark's code if empty."""
    bright: tuple[bool, ...] = ()
    covers: tuple[tuple[Array, Array], ...] = ()
    """Polygons (pixels of the picture) and the reflectance of each."""

    @property
    def bands(self) -> tuple[list[float], list[bool]]:
        if self.heights:
            return list(self.heights), list(self.bright)
        return code_bands(self.stand.id)


@dataclass(frozen=True, slots=True, eq=False)
class Shot:
    """What all of one picture has in common."""

    view: View
    light: Light
    camera: Camera
    lens: Lens
    exposure: float = 1.0
    """What the lamp's light is multiplied by."""

    def take(
        self, stage: Stage, posts: Sequence[Post], rng: np.random.Generator
    ) -> tuple[NDArray[np.uint8], list[bool]]:
        """The picture, and for each post whether something like its paint touches its outline."""
        stage.shear(self.view)
        for post in posts:
            self._shadow(stage, post)
        sensor = (self.light.matrix * self.exposure).astype(np.float32)
        behind: Plane = np.asarray(cv2.transform(stage.plane, sensor), np.float32)
        for post in posts:
            if post.lamp.mirror:
                self._reflect(behind, post)
        plane = self._blur(behind, OVER)
        surrounds = [False] * len(posts)
        if posts:
            quiet = self.camera.quiet()
            empty = develop(expose(plane, quiet, self.light, rng), quiet)
            surrounds = [self._surrounded(empty, post) for post in posts]
            plane = plane.copy()
            for post in posts:
                self._add(plane, behind, post)
        return develop(expose(plane, self.camera, self.light, rng), self.camera), surrounds

    def _blur(self, plane: Plane, scale: int) -> Plane:
        kernel = self.lens.kernel(scale)
        if kernel is None:
            return plane
        border = cv2.BORDER_REFLECT_101 if scale == OVER else cv2.BORDER_REPLICATE
        return np.asarray(cv2.filter2D(plane, -1, kernel, borderType=border))

    def _colors(self, mesh: Mesh, lamp: Lamp) -> Array:
        """(rows, facets, 4): what the sensor gets from each quad, and 1 for the cover."""
        shade = _shade(mesh.facing, lamp)
        paint = np.where(mesh.bright[:, None], self.light.orange, self.light.black)
        shine = lamp.gloss * np.exp(-(((mesh.facing - lamp.side / 2) / lamp.gloss_width) ** 2))
        lit = paint[:, None, :] * shade[None, :, None] + self.light.white * shine[None, :, None]
        return np.concatenate(
            [lit * (self.exposure * lamp.strength), np.ones((*lit.shape[:2], 1))], axis=2
        )

    def _window(self, points: Array, margin: int) -> Canvas | None:
        """A canvas around positions of the picture, cut at the picture's border."""
        low = np.maximum(np.floor(points.min(axis=0)).astype(int) - margin, 0)
        high = np.minimum(np.ceil(points.max(axis=0)).astype(int) + margin, [WIDTH, HEIGHT])
        if np.any(high <= low):
            return None
        wide, tall = high - low
        return Canvas(int(low[0]), int(low[1]), int(wide), int(tall), FINE)

    def _add(self, plane: Plane, behind: Plane, post: Post) -> None:
        """Put a post, and what covers it, onto the blurred plane."""
        mesh = post_mesh(post.stand, self.view, *post.bands)
        margin = 4 + int(self.lens.smear / 2 + 4 * self.lens.size * self.lens.stretch)
        points = np.concatenate([mesh.corners.reshape(-1, 2), *(p for p, _ in post.covers)])
        canvas = self._window(points, margin)
        if canvas is None:
            return
        canvas.add_mesh(mesh.corners, self._colors(mesh, post.lamp))
        drawn = canvas.image()
        top, bottom = mesh.corners[..., 1].min(), mesh.corners[..., 1].max()
        rows = canvas.row - 0.5 + (np.arange(drawn.shape[0]) + 0.5) / FINE
        ramp = 1 + post.lamp.slope * (1 - 2 * (rows - top) / (bottom - top))
        drawn[..., :3] *= ramp.astype(np.float32)[:, None, None]
        for polygon, reflectance in post.covers:
            tall, wide = (n // FINE for n in canvas.shape)
            front = Canvas(canvas.column, canvas.row, wide, tall, FINE)
            seen = self.light.matrix @ reflectance * (self.exposure * post.lamp.strength)
            front.add_polygon(polygon, np.append(seen, 1.0))
            cover = front.image()
            drawn = drawn * (1 - cover[..., 3:]) + cover
        x0, y0 = canvas.column * OVER, canvas.row * OVER
        y1, x1 = y0 + drawn.shape[0] * OVER // FINE, x0 + drawn.shape[1] * OVER // FINE
        back = cv2.resize(behind[y0:y1, x0:x1], drawn.shape[1::-1], interpolation=cv2.INTER_LINEAR)
        change = self._blur(drawn[..., :3] - drawn[..., 3:] * back, FINE)
        plane[y0:y1, x0:x1] += cv2.resize(change, (x1 - x0, y1 - y0), interpolation=cv2.INTER_AREA)

    def _reflect(self, behind: Plane, post: Post) -> None:
        """Add the post's mirror image in a floor that shines a little."""
        heights, bright = post.bands
        mesh = post_mesh(post.stand, self.view, [-h for h in heights[::-1]], bright[::-1])
        canvas = self._window(mesh.corners.reshape(-1, 2), 6)
        if canvas is None:
            return
        canvas.add_mesh(mesh.corners, self._colors(mesh, post.lamp) * post.lamp.mirror)
        soft = cv2.GaussianBlur(canvas.image()[..., :3], (0, 0), 3.0)
        x0, y0 = canvas.column * OVER, canvas.row * OVER
        size = (soft.shape[1] * OVER // FINE, soft.shape[0] * OVER // FINE)
        behind[y0 : y0 + size[1], x0 : x0 + size[0]] += cv2.resize(
            soft, size, interpolation=cv2.INTER_AREA
        )

    def _shadow(self, stage: Stage, post: Post) -> None:
        """The dark patch at a pole's foot and the shadow that it throws."""
        x, y = post.stand.foot
        scale = OVER * 600 / post.stand.range
        angle = np.linspace(0, 2 * np.pi, 16, endpoint=False)
        foot = np.stack([x + 0.055 * np.cos(angle), y + 0.055 * np.sin(angle), 0 * angle], axis=-1)
        stage.darken((self.view.project(foot) + 0.5) * OVER - 0.5, 0.6, max(0.012 * scale, 0.6))
        lamp = post.lamp
        # The light comes from `side`, so the shadow points away from there.
        away = np.arctan2(-y, -x) + lamp.side + np.pi
        along = np.array([np.cos(away), np.sin(away), 0]) * 0.5
        across = np.array([-np.sin(away), np.cos(away), 0]) * 0.035
        base = np.array([x, y, 0.0])
        cast = np.array(
            [base + across, base + along + across, base + along - across, base - across]
        )
        if np.all(cast[:, 0] > 0.5):
            stage.darken(
                (self.view.project(cast) + 0.5) * OVER - 0.5,
                0.55 * (1 - lamp.ambient),
                max(0.02 * scale, 0.7),
            )

    def _surrounded(self, empty: NDArray[np.uint8], post: Post) -> bool:
        """Whether over 15 % of a 3 pixel band round the code looks like its paint in this light."""
        mask = np.zeros(empty.shape[:2], np.uint8)
        outline = np.round(post.stand.outline(self.view) * 16).astype(np.int32)
        cv2.fillPoly(mask, [outline], 255, cv2.LINE_8, 4)
        disc = cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (7, 7))
        band = (cv2.dilate(mask, disc) > 0) & (mask == 0)
        paint = self.light.orange * (0.75 * self.exposure * post.lamp.strength)
        level = self.camera.curve(self.light.seen(paint).astype(np.float32)[None, None])
        hue, saturation, value = (
            float(v) for v in cv2.cvtColor(level.astype(np.float32), cv2.COLOR_BGR2HSV)[0, 0]
        )
        around = cv2.cvtColor(
            empty[band].reshape(1, -1, 3).astype(np.float32) / 255, cv2.COLOR_BGR2HSV
        )[0]
        turned = np.abs((around[:, 0] - hue + 180) % 360 - 180)
        alike = (turned < 14) & (around[:, 1] > 0.55 * saturation) & (around[:, 2] > 0.3 * value)
        return bool(np.mean(alike) > 0.15)


def _shade(facing: Array, lamp: Lamp) -> Array:
    """Relative brightness of surfaces that face so; the brightest that can be is 1."""
    direct = np.maximum(np.cos(facing - lamp.side), 0)
    return np.asarray(lamp.ambient + (1 - lamp.ambient) * direct)
