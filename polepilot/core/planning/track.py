"""The path so far of a robot that is driven through a plan, and the pose at its end."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from polepilot.core.geometry import Pose2D, angle_between, wrap_angle
from polepilot.core.planning.curves import CHANGE, STEP, Curve, Sampled, joined, sample

Points = NDArray[np.float64]
Saved = tuple[int, int, Pose2D, float, int]

PLAIN = math.radians(3.0)
"""A turn below this is left as it is where its legs are long enough."""
_BESIDE = 1e-5
"""What is so little beside the line of the heading is on it, metres."""
_CHORD = 0.12
"""What is longer than this is no chord of an arc, unless that is wide, metres."""


@dataclass(slots=True)
class Track:
    """The path so far: points, gears, and the pose at its end."""

    pose: Pose2D
    radius: float
    """Of the arcs that are appended."""
    points: list[Points] = field(default_factory=list)
    gears: list[NDArray[np.int8]] = field(default_factory=list)
    count: int = 1
    straight: float = 0.0
    """How far the robot can go straight back from here on its own track."""
    sign: int = 1
    """-1: driven the wrong way round; ``pose`` then looks out of the robot's back."""
    reserve: float = 0.0
    """How much of the leg after a corner left as it is must stay straight, metres."""

    def __post_init__(self) -> None:
        self.points.append(np.array([self.pose.position]))

    @property
    def last(self) -> int:
        """Index of the last point."""
        return self.count - 1

    def add(self, points: Points, gears: NDArray[np.int8], pose: Pose2D) -> None:
        """Appends points after the first, which is where the track ends."""
        if len(gears):
            self.points.append(points[1:])
            self.gears.append(gears * np.int8(self.sign))
            self.count += len(gears)
        self.pose = pose

    def arrays(self) -> tuple[Points, NDArray[np.int8]]:
        gears = np.concatenate(self.gears) if self.gears else np.zeros(0, np.int8)
        return np.vstack(self.points), gears

    def append(self, curve: Curve, sampled: Sampled | None = None) -> None:
        """Drives ``curve`` from the end on; ``sampled``: what ``sample`` makes of it, if known."""
        curve = joined(curve)
        if not curve:
            return
        points, gears, pose = sampled or sample(self.pose, curve, self.radius)
        straight = self.straight if curve[0][0] == "S" else 0.0
        if len(curve) == 1 and curve[0][0] == "S":
            straight = max(0.0, straight + curve[0][1])
        else:
            straight = max(0.0, curve[-1][1]) if curve[-1][0] == "S" else 0.0
        self.add(points, gears, pose)
        self.straight = straight
        self.reserve = 0.0

    def turn_round(self) -> None:
        """From here on what was forward is backward: the same curves, tail first."""
        self.sign = -self.sign
        self.pose = Pose2D(*self.pose.position, wrap_angle(self.pose.heading + math.pi))
        self.straight = self.reserve = 0.0

    def straight_to(self, corner: Points) -> None:
        """Straight to a place on the line of the present heading, forward or back."""
        way = float(np.dot(corner - np.array(self.pose.position), self.ahead()))
        if abs(way) < 1e-6:
            return
        self.append((("S", way),))
        if math.dist(self.pose.position, corner) < _BESIDE:  # no rounding adds up
            self.points[-1][-1] = corner
            self.pose = Pose2D(float(corner[0]), float(corner[1]), self.pose.heading)

    def back_out(self, distance: float) -> bool:
        """Drives back on its own track, in arcs to the next of its points; False: to its start."""
        points, gears = self.arrays()
        taken: list[Points] = [points[-1]]
        back: list[int] = []
        chord = max(_CHORD, 1.05 * STEP * self.radius)
        rest = distance
        index = len(gears) - 1
        heading = self.pose.heading + (math.pi if self.sign < 0 else 0.0)
        while rest > 1e-6 and index >= 0:
            a, b = points[index + 1], points[index]
            step = float(np.hypot(*(b - a)))
            if step > 1e-9:
                gear = -int(gears[index])
                heading = _direction((b - a) * gear)
                part = rest / step if step > chord and rest < step else 1.0
                if part == 1.0 and index > 0 and step <= chord:
                    # At a vertex of an arc the heading is between those of its two chords, or of a
                    # chord and what is straight before it.
                    before = b - points[index - 1]
                    beyond = _direction(before * int(gears[index - 1]))
                    if abs(turn := angle_between(heading, beyond)) < PLAIN + STEP:
                        length = float(np.hypot(*before))
                        share = 1.0 if length > chord else step / (step + length)
                        heading = wrap_angle(heading + turn * share)
                taken.append(a + (b - a) * part)
                back.append(gear)
            rest -= step
            index -= 1
        heading = wrap_angle(heading + (math.pi if self.sign < 0 else 0.0))
        self.add(
            np.array(taken),
            np.array(back, np.int8) * np.int8(self.sign),
            Pose2D(float(taken[-1][0]), float(taken[-1][1]), heading),
        )
        self.straight = 0.0
        return rest <= 1e-6

    def ahead(self) -> Points:
        """The direction in which the robot looks, of length 1."""
        heading = self.pose.heading
        return np.array([math.cos(heading), math.sin(heading)])

    def save(self) -> Saved:
        """What ``restore`` needs to forget all that is driven from here on."""
        return len(self.points), self.count, self.pose, self.straight, self.sign

    def restore(self, saved: Saved) -> None:
        pieces, self.count, self.pose, self.straight, self.sign = saved
        del self.points[pieces:]
        del self.gears[max(pieces - 1, 0) :]

    def cost_since(self, saved: Saved) -> float:
        """Length since then with what changes of gear cost, metres."""
        points = np.vstack([self.points[saved[0] - 1][-1:], *self.points[saved[0] :]])
        gears = [gear for block in self.gears[saved[0] - 1 :] for gear in block.tolist()]
        changes = sum(a != b for a, b in pairwise(gears))
        return float(_length(points) + CHANGE * changes)


def without_jerks(
    path: Points, gears: NDArray[np.int8], shortest: float = 0.002
) -> tuple[Points, NDArray[np.int8], NDArray[np.intp]]:
    """A path without stretches in one gear below ``shortest`` metres, on which no wheel turns.

    Also its gears, and for each point of the old path the index of the new one.
    """
    kept = np.arange(len(path))
    while len(gears) > 1:
        bounds = np.r_[0, np.flatnonzero(np.diff(gears)) + 1, len(gears)]
        marks = np.r_[0.0, np.cumsum(np.hypot(*np.diff(path[kept], axis=0).T))]
        brief = np.flatnonzero(np.diff(marks[bounds]) < shortest)
        if not len(brief) or len(bounds) == 2:
            break
        first, last = bounds[brief[0]], bounds[brief[0] + 1]
        # The stretch's end stays, but of the first stretch its beginning.
        gone = slice(first, last) if first else slice(1, last + 1)
        if first == 0 and last == len(gears):
            break
        kept = np.delete(kept, gone)
        gears = np.delete(gears, slice(first, last))
    moved = np.minimum(np.searchsorted(kept, np.arange(len(path))), len(kept) - 1)
    return path[kept], gears, moved


def _direction(step: Points) -> float:
    return math.atan2(step[1], step[0])


def _length(points: Points) -> float:
    return float(np.hypot(*np.diff(points, axis=0).T).sum()) if len(points) > 1 else 0.0
