"""The default detector: the kernel looks, `measure` makes metres of what it saw."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple, Protocol

from polepilot.core.landmark import LandmarkKind
from polepilot.core.observation import Detection, Image
from polepilot.core.vehicle import Camera
from polepilot.core.vision.kernel import REASONS, Kernel, Strip
from polepilot.core.vision.measure import is_cut, measure, pitch_of, stands, through_pinhole
from polepilot.core.vision.paint import ORANGE, Paint

OUT_OF_PLACE = "not where a landmark can be"
RIVAL = "another reading of this place fits better"
TWICE = "this number fits better elsewhere"


class Detector(Protocol):
    """Finds landmarks in single pictures; keeps nothing from one picture to the next."""

    def detect(self, image: Image) -> list[Detection]:
        """All landmarks that could be read, from left to right."""
        ...


@dataclass(frozen=True, slots=True, eq=False)
class Found:
    """A landmark, and the strip of the picture that showed it."""

    detection: Detection
    strip: Strip


@dataclass(frozen=True, slots=True, eq=False)
class Rejected:
    """A strip that looked like a landmark for a moment, and why it is none, in words.

    Of the strip only id, bits, code and place say something, and they may be wrong.
    """

    strip: Strip
    reason: str


@dataclass(frozen=True, slots=True, eq=False)
class Look:
    """All that was thought of one picture; both from left to right."""

    found: tuple[Found, ...]
    rejected: tuple[Rejected, ...]


class _Reading(NamedTuple):
    """A strip that was read: as the picture shows it, and as a lens without distortion would."""

    seen: Strip
    ideal: Strip
    kind: LandmarkKind

    @property
    def half(self) -> float:
        """Half of its height, pixels."""
        return (self.seen.bits + 2.5) * self.seen.unit


class LandmarkDetector:
    """Reads every landmark of a picture, near and far, and measures it on linear light.

    Args:
        camera: constant, centre and lens for pictures as they are given, which are never resized.
        kinds: the ids that exist and what each looks like; anything else is not reported.
        paint: what their bright segments are painted with. Grey pictures have no colour: in them
            anything bright and dark that is shaped like a landmark is one.
    """

    def __init__(
        self, camera: Camera, kinds: Mapping[int, LandmarkKind], paint: Paint = ORANGE
    ) -> None:
        self._camera = camera
        self._bent = any(camera.distortion)
        self._kinds = dict(kinds)
        self._kernel = Kernel(self._kinds, camera.constant, paint)

    def detect(self, image: Image) -> list[Detection]:
        """All landmarks of a picture (rows x columns x 3 BGR, or grey), from left to right."""
        standing = []
        for strip in self._kernel.look(image):
            if not strip.reason:
                one = self._reading(strip)
                if self._stands(one):
                    standing.append(one)
        return self._measured(_best(standing))

    def examine(self, image: Image) -> Look:
        """The same landmarks with their strips, and what else was looked at closely."""
        rejected = []
        standing = []
        for strip in self._kernel.look(image):
            if strip.reason:
                rejected.append(Rejected(strip, REASONS[strip.reason]))
                continue
            one = self._reading(strip)
            if self._stands(one):
                standing.append(one)
            else:
                rejected.append(Rejected(strip, OUT_OF_PLACE))
        best = _best(standing)
        for one in standing:
            if not any(one is other for other in best):
                rival = any(_same_place(one, other) for other in best)
                rejected.append(Rejected(one.seen, RIVAL if rival else TWICE))
        rejected.sort(key=lambda one: one.strip.column)
        found = map(Found, self._measured(best), (one.seen for one in best))
        return Look(tuple(found), tuple(rejected))

    def _reading(self, strip: Strip) -> _Reading:
        kind = self._kinds[strip.id]
        ideal = through_pinhole(strip, kind, self._camera) if self._bent else strip
        return _Reading(strip, ideal, kind)

    def _stands(self, one: _Reading) -> bool:
        kind, camera = one.kind, self._camera
        if stands(one.ideal, kind, camera, cut=True):  # nearly all: on the floor, cut or not
            return True
        return stands(one.ideal, kind, camera) and not is_cut(one.seen, kind, camera)

    def _measured(self, best: Sequence[_Reading]) -> list[Detection]:
        if not best:
            return []
        camera = self._camera
        pitch = pitch_of([(one.ideal, one.kind) for one in best], camera)
        return [measure(one.ideal, one.kind, pitch, camera, one.seen) for one in best]


def _best(readings: list[_Reading]) -> list[_Reading]:
    """One per id and place, of rivals the one that fits best; from left to right."""
    if len(readings) < 2:
        return readings
    kept: list[_Reading] = []
    for one in sorted(readings, key=lambda reading: reading.seen.noise):
        number = one.seen.id
        for other in kept:
            if other.seen.id == number or _same_place(one, other):
                break
        else:
            kept.append(one)
    kept.sort(key=lambda reading: reading.seen.column)
    return kept


def _same_place(one: _Reading, other: _Reading) -> bool:
    """Whether one of the two would hide a part of the other."""
    return (
        abs(one.seen.column - other.seen.column) < (one.seen.width + other.seen.width) / 2
        and abs(one.seen.row - other.seen.row) <= one.half + other.half
    )
