"""The darkroom: pictures with known truth for a final judgement of a landmark detector.

The second of two renderers that share nothing but `scenes.truth`; a detector is not developed
on these pictures. Poles are meshes whose covered area is summed exactly (`darkroom_mesh`), light
and paint are spectra (`darkroom_light`), rooms, photographs and things stand behind
(`darkroom_rooms`, `darkroom_photos`, `darkroom_props`), and a camera with a mosaic, noise, a
tone curve and JPEG takes the picture (`darkroom_camera`, `darkroom_shot`).
"""

from __future__ import annotations

from dataclasses import replace
from math import atan, pi, radians
from typing import get_args

import numpy as np
from numpy.typing import NDArray
from scenes.darkroom_camera import OVER, Camera, Lens
from scenes.darkroom_light import draw_light
from scenes.darkroom_mesh import CENTER, CONSTANT, HEIGHT, WIDTH, Stand, View, post_mesh
from scenes.darkroom_photos import GREY_PLACES, orange, photograph, place
from scenes.darkroom_props import THINGS, TRAPS, cone, hang
from scenes.darkroom_rooms import room
from scenes.darkroom_shot import Lamp, Post, Shot
from scenes.darkroom_stage import Stage
from scenes.truth import Family, Scene, Truth
from shapely import Polygon

from polepilot.core.landmark import encode

Array = NDArray[np.float64]

_RANGES: dict[Family, tuple[float, float]] = {
    "clean": (2.0, 8.0),
    "clean-8-12": (8.0, 12.0),
    "clean-12-16": (12.5, 16.0),
    "clean-16-22": (16.0, 22.0),
    "photo": (2.0, 8.0),
    "pan": (2.0, 8.0),
    "hidden": (2.0, 8.0),
}
_LIMIT = radians(2)
"""How far the camera nods and tilts."""


def scene(family: Family, seed: int) -> Scene:
    """The picture number ``seed`` of a family; the same for the same two."""
    rng = np.random.default_rng([4_291, get_args(Family).index(family), seed])
    view = _view(rng, family)
    wild = family in ("photo", "empty") or (family == "hidden" and rng.random() < 0.5)
    light = draw_light(rng, 0.45 if wild else 0.2)
    camera, lens = _camera(rng, wild), _lens(rng, wild)
    level, mood = _level(rng, wild)
    if mood == "dim":
        camera = replace(camera, noise=camera.noise * rng.uniform(0.3, 0.7))
    rate = abs(view.pan_rate) * view.exposure
    lens = replace(lens, smear=CONSTANT * rate * 1.03 if rate else 0.0)
    paint = float(light.seen(light.orange)[2])
    bright = camera.uncurve(level) if level <= 1 else level * camera.headroom
    shot = Shot(view, light, camera, lens, bright / paint)

    stage = Stage(view)
    stands = [] if family == "empty" else arrange(rng, view, _RANGES[family])
    far = max((s.range for s in stands), default=float(rng.uniform(2, 9)))
    place_note = _backdrop(rng, stage, view, family, far, wild)
    if wild and family != "empty":
        _dress(rng, stage, view, stands)
    posts = [Post(s, lamp) for s, lamp in zip(stands, _lamps(rng, len(stands), wild), strict=True)]
    if family == "hidden":
        posts = _covered(rng, posts, view)
    if family == "empty":
        posts = _mislead(rng, stage, view)
    picture, surrounds = shot.take(stage, posts, rng)

    truths = tuple(
        Truth(s.id, s.range, s.bearing, orange_surround=orange_near, hidden=family == "hidden")
        for s, orange_near in zip(stands, surrounds, strict=False)
    )
    sensor = ("ideal", "native", "double")[camera.mosaic]
    note = (
        f"{place_note}; {mood} {level * 255:.0f}; {light.note}; {sensor} sensor, {camera.demosaic},"
        f" noise {camera.noise:.1f}, {camera.tone}, {lens.kind} {lens.size:.2f}, smear"
        f" {lens.smear:.1f}, {camera.denoise or 'no'} denoise, sharpen {camera.sharpen:.1f},"
        f" jpeg {camera.jpeg}{' 4:4:4' if camera.full_chroma else ''}"
    )
    return Scene(picture, truths, family, seed, note)


def _view(rng: np.random.Generator, family: Family) -> View:
    pitch, roll = rng.uniform(-_LIMIT, _LIMIT, 2)
    if family != "pan":
        return View(float(pitch), float(roll))
    return View(
        float(pitch),
        float(roll),
        float(radians(rng.uniform(-60, 60))),
        float(rng.uniform(0.010, 0.033)),
        float(rng.uniform(0.002, 0.012)),
    )


def _camera(rng: np.random.Generator, wild: bool) -> Camera:
    """A camera by lot; ``wild`` ones are cheaper and save smaller files."""
    jpeg, full = 0, bool(rng.random() < 0.35)
    if wild and rng.random() < 0.65:
        jpeg = int(rng.integers(55, 96))
    elif not wild and rng.random() < 1 / 3:
        jpeg = int(rng.integers(85, 96))
    denoise = str(rng.choice(["chroma", "bilateral", "median"], p=[0.55, 0.4, 0.05]))
    return Camera(
        vignette=float(rng.uniform(0, 0.4 if wild else 0.25)),
        mosaic=int(rng.choice(3, p=[0.4, 0.1, 0.5])),
        corner=int(rng.integers(4)),
        demosaic="edge" if rng.random() < 0.5 else "bilinear",
        noise=float(rng.uniform(0.7, 3.2 if wild else 2.4)),
        pattern=float(rng.uniform(0, 0.012)),
        banding=float(rng.choice([0.0, 0.25], p=[0.7, 0.3])),
        tone=str(rng.choice(["srgb", "gamma", "shoulder", "contrast"], p=[0.4, 0.2, 0.2, 0.2])),
        denoise=denoise if rng.random() < (0.25 if wild else 0.12) else "",
        sharpen=float(rng.uniform(0.2, 0.8)) if rng.random() < 0.25 else 0.0,
        jpeg=jpeg,
        full_chroma=full,
    )


def _lens(rng: np.random.Generator, wild: bool) -> Lens:
    kind = "gauss" if rng.random() < 0.6 else "disc"
    size = rng.uniform(0.22, 0.65 if wild else 0.5) * (1.0 if kind == "gauss" else 1.7)
    stretch = rng.uniform(1.0, 1.35) if rng.random() < 0.4 else 1.0
    return Lens(kind, float(size), float(stretch), float(rng.uniform(0, pi)))


def _level(rng: np.random.Generator, wild: bool) -> tuple[float, str]:
    """How bright the fully lit paint's red comes out (1 is 255, above: overexposed)."""
    lot = rng.random()
    if wild and lot < 0.18:
        return float(rng.uniform(42, 90) / 255), "dim"
    if wild and lot < 0.38:
        return float(rng.uniform(1.2, 2.4)), "overexposed"
    return float(rng.uniform(110 if wild else 120, 245) / 255), "normal"


def _lamps(rng: np.random.Generator, count: int, wild: bool) -> list[Lamp]:
    side = rng.uniform(-1.8, 1.8) if wild else rng.uniform(-1.4, 1.4)
    ambient = rng.uniform(0.3 if wild else 0.4, 0.85)
    mirror = rng.uniform(0.02, 0.10) if rng.random() < 0.12 else 0.0
    glossy = rng.random() < (0.35 if wild else 0.25)
    width = rng.uniform(0.07, 0.25)
    return [
        Lamp(
            float(side + rng.normal(0, 0.15)),
            float(ambient),
            float(rng.uniform(0.05, 0.45 if wild else 0.25)) if glossy else 0.0,
            float(width),
            float(rng.uniform(0.8, 1.0)),
            float(rng.uniform(-0.18, 0.18)),
            float(mirror),
        )
        for _ in range(count)
    ]


def arrange(rng: np.random.Generator, view: View, ranges: tuple[float, float]) -> list[Stand]:
    """One to four landmarks, each whole in the picture and apart from the others."""
    wanted = int(rng.choice([1, 2, 3, 4], p=[0.35, 0.3, 0.2, 0.15]))
    ids = rng.choice(np.arange(1, 16), wanted, replace=False)
    room_for: list[Stand] = []
    boxes: list[tuple[float, float]] = []
    for _ in range(400):
        if len(room_for) == wanted:
            break
        distance = float(rng.uniform(*ranges))
        bearing = atan((CENTER[0] - rng.uniform(0, WIDTH - 1)) / CONSTANT)
        stand = Stand(int(ids[len(room_for)]), distance, float(bearing))
        outline = stand.outline(view)
        low, high = outline.min(axis=0), outline.max(axis=0)
        smear = CONSTANT * abs(view.pan_rate) * view.exposure / 2
        inside = low[0] > 2 + smear and low[1] > 2
        inside = inside and high[0] < WIDTH - 3 - smear and high[1] < HEIGHT - 3
        apart = all(low[0] > right + 6 or high[0] < left - 6 for left, right in boxes)
        if inside and apart:
            room_for.append(stand)
            boxes.append((float(low[0]), float(high[0])))
    return room_for


def _backdrop(
    rng: np.random.Generator, stage: Stage, view: View, family: Family, far: float, wild: bool
) -> str:
    lot = rng.random()
    if not wild:
        if far < 9 and lot < 0.15:
            picture, name = place(rng, View(view.pitch, view.roll), GREY_PLACES)
            stage.fill(picture)
            return name
        return room(rng, stage, far, warm=False)
    if lot < 0.45:
        picture, name = photograph(rng)
        stage.fill(picture)
    elif lot < 0.77:
        picture, name = place(rng, view)
        stage.fill(picture)
    else:
        name = room(rng, stage, far, warm=True)
    if rng.random() < 0.5:
        for _ in range(int(rng.integers(1, 4))):
            column = rng.uniform(0, WIDTH)
            distance = far + rng.uniform(0.3, 3.0)
            _put(rng, stage, view, column, distance)
    return name


def _put(
    rng: np.random.Generator, stage: Stage, view: View, column: float, distance: float
) -> None:
    """Some orange thing on the floor, its foot ``distance`` away below ``column``."""
    y = distance * (CENTER[0] - column) / CONSTANT
    foot = stage.pixels(np.array([distance, y, 0.0]))
    foot[0] = (column + 0.5) * OVER - 0.5
    kind = THINGS[int(rng.integers(len(THINGS)))]
    (hang if rng.random() < 0.12 else kind)(rng, stage, foot, OVER * CONSTANT / distance)


def _dress(rng: np.random.Generator, stage: Stage, view: View, stands: list[Stand]) -> None:
    """Orange things right behind or beside some of the landmarks, farthest first."""
    for stand in sorted(stands, key=lambda s: -s.range):
        if rng.random() > 0.12:
            continue
        outline = stand.outline(view)
        middle, width = float(outline[:, 0].mean()), float(np.ptp(outline[:, 0]))
        for _ in range(int(rng.integers(1, 3))):
            distance = stand.range + rng.uniform(0.1, 0.8)
            reach = width / 2 + rng.uniform(0, 0.25) * CONSTANT / distance
            column = middle + reach * rng.choice([-1.0, 0.0, 1.0]) * rng.random()
            _put(rng, stage, view, column, distance)


Box = tuple[float, float, float, float]
"""Left, top, right and bottom, pixels."""


def _box(points: Array) -> Box:
    low, high = points.min(axis=0), points.max(axis=0)
    return float(low[0]), float(low[1]), float(high[0]), float(high[1])


def _meet(a: Box, b: Box, gap: float = 6.0) -> bool:
    across = a[0] < b[2] + gap and b[0] < a[2] + gap
    return across and a[1] < b[3] + gap and b[1] < a[3] + gap


def _covered(rng: np.random.Generator, posts: list[Post], view: View) -> list[Post]:
    """The same posts, each with something before it that touches no other."""
    boxes = [_box(post.stand.outline(view)) for post in posts]
    done = []
    for k, post in enumerate(posts):
        polygon = _cover(rng, post.stand, view, boxes[:k] + boxes[k + 1 :])
        boxes.append(_box(polygon))
        done.append(replace(post, covers=((polygon, _cover_color(rng)),)))
    return done


def _cover(rng: np.random.Generator, stand: Stand, view: View, others: list[Box]) -> Array:
    """Something in front of a landmark that hides a third of a segment at least, not all.

    It keeps away from what stands in the boxes ``others``.
    """
    outline = stand.outline(view)
    low, high = outline.min(axis=0), outline.max(axis=0)
    segment = (high[1] - low[1]) / 13
    whole = Polygon(outline)
    for turn in range(10_000):
        polygon = _cover_shape(rng, low, high, segment, patch=turn > 40)
        if any(_meet(_box(polygon), other) for other in others):
            continue
        hidden = whole.intersection(Polygon(polygon)).area / whole.area
        if 1 / 3 < 13 * hidden < 10:
            return polygon
    raise AssertionError("nothing fits before this landmark")


def _cover_shape(
    rng: np.random.Generator, low: Array, high: Array, segment: float, patch: bool
) -> Array:
    width, middle = high[0] - low[0], (low[0] + high[0]) / 2
    kind = 5 if patch else int(rng.integers(6))
    y = rng.uniform(low[1], high[1])
    left, right = middle - width * rng.uniform(0.8, 6), middle + width * rng.uniform(0.8, 6)
    thick = segment * rng.uniform(0.4, 4)
    lean = rng.uniform(-0.2, 0.2) * (right - left)
    if kind == 0:  # stands on the floor before it
        y0, y1 = high[1] - segment * rng.uniform(0.4, 8), high[1] + segment * rng.uniform(0.5, 4)
        return np.array([[left, y0], [right, y0], [right, y1], [left, y1]])
    if kind == 1:  # hangs down before it
        y0, y1 = low[1] - segment * rng.uniform(1, 6), low[1] + segment * rng.uniform(0.4, 8)
        return np.array([[left, y0], [right, y0], [right, y1], [left, y1]])
    if kind == 2:  # a bar, a cable, an edge of a table
        return np.array(
            [[left, y], [right, y + lean], [right, y + thick + lean], [left, y + thick]]
        )
    if kind == 3:  # a leg, an arm, a broomstick
        slope = rng.uniform(0.2, 1.5) * rng.choice([-1, 1])
        reach = 3 * width
        across = max(thick, width)
        return np.array(
            [
                [middle - reach, y - reach / slope],
                [middle + reach, y + reach / slope],
                [middle + reach, y + across + reach / slope],
                [middle - reach, y + across - reach / slope],
            ]
        )
    if kind == 4:  # a ball, a bunch of leaves
        angle = np.linspace(0, 2 * pi, 20, endpoint=False)
        wobble = rng.uniform(0.8, 1.2, 20)
        across, down = width * rng.uniform(0.6, 2.5), thick
        x = middle + width * rng.uniform(-0.4, 0.4)
        return np.stack([x + across * wobble * np.cos(angle), y + down * wobble * np.sin(angle)], 1)
    # a patch on it: paper, tape, dirt
    x0, x1 = middle - width * rng.uniform(0.4, 0.62), middle + width * rng.uniform(0.4, 0.62)
    tall = segment * rng.uniform(0.45, 2.5)
    return np.array([[x0, y], [x1, y], [x1, y + tall], [x0, y + tall]])


def _cover_color(rng: np.random.Generator) -> Array:
    lot = rng.random()
    if lot < 0.22:
        return np.full(3, rng.uniform(0.01, 0.06))
    if lot < 0.44:
        return orange(rng, 0.8)
    if lot < 0.62:
        return np.full(3, rng.uniform(0.1, 0.9))
    if lot < 0.74:
        skin = rng.uniform(0.2, 0.6)
        return np.array([skin * 0.45, skin * 0.6, skin])
    return rng.uniform(0.03, 0.6, 3)


def _mislead(rng: np.random.Generator, stage: Stage, view: View) -> list[Post]:
    """Whatever might be taken for a landmark: stripes, ladders, cones, banded posts."""
    lot = rng.random()
    if lot < 0.35:
        return []
    for _ in range(int(rng.integers(1, 4))):
        TRAPS[int(rng.integers(len(TRAPS)))](rng, stage)
    if rng.random() < 0.3:
        distance = float(rng.uniform(1.5, 6))
        foot = np.array([rng.uniform(0, WIDTH) * OVER, rng.uniform(0.5, 1.0) * HEIGHT * OVER])
        cone(rng, stage, foot, OVER * CONSTANT / distance)
    if rng.random() < 0.5:
        return []
    posts: list[Post] = []
    boxes: list[Box] = []
    for lamp in _lamps(rng, int(rng.integers(1, 4)), wild=True):
        post = _impostor(rng, lamp)
        box = _box(post_mesh(post.stand, view, *post.bands).corners.reshape(-1, 2))
        if not any(_meet(box, other) for other in boxes):
            posts.append(post)
            boxes.append(box)
    return posts


def _impostor(rng: np.random.Generator, lamp: Lamp) -> Post:
    """A post with orange and black bands that spell no landmark's code."""
    while True:
        count = int(rng.integers(2, 16))
        lengths = np.full(count, 0.05) if rng.random() < 0.35 else rng.uniform(0.03, 0.2, count)
        first = bool(rng.random() < 0.7)
        bright = [first ^ bool(k % 2) for k in range(count)]
        if not spells(lengths, bright):
            break
    heights = float(lengths.sum()) - np.concatenate([[0.0], np.cumsum(lengths)])
    stand = Stand(1, float(rng.uniform(2, 10)), float(rng.uniform(-0.3, 0.3)))
    return Post(stand, lamp, tuple(float(h) for h in heights), tuple(bright))


def spells(lengths: Array, bright: list[bool]) -> bool:
    """Whether a run of the bands is like a landmark's code to half a segment."""
    for number in range(1, 16):
        code = encode(number)
        cuts = np.array([i for i in range(14) if i in (0, 13) or code[i] != code[i - 1]])
        bands = len(cuts) - 1
        for k in range(len(lengths) - bands + 1):
            if not bright[k]:
                continue
            borders = np.concatenate([[0.0], np.cumsum(lengths[k : k + bands])])
            if np.all(np.abs(borders * 13 / borders[-1] - cuts) < 0.5):
                return True
    return False
