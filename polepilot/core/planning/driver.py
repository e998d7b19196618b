"""Runs made followable by a steered front wheel that turns no tighter than a given radius.

A run's straight pieces are kept. Each corner becomes the cheapest of the curves that fit into the
free space: rounded where the cut stays under 5 cm, else driven up to and then turned with changes
of gear (a curve of Reeds and Shepp between the two legs, before, at, or beyond the corner). Runs
are connected the same way; where nothing fits, the robot backs out along its own track first,
which is always possible. What cannot be connected at all is left out, and said.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator, Sequence

import numpy as np
import shapely
from numpy.typing import NDArray

from polepilot.core import geometry
from polepilot.core.geometry import Pose2D, angle_between
from polepilot.core.planning.curves import (
    CHANGE,
    KIND,
    Curve,
    best_curves,
    changes,
    curve_cost,
    curve_length,
    joined,
    sample,
    spots,
)
from polepilot.core.planning.space import STRIDE, FreeSpace
from polepilot.core.planning.track import PLAIN, Track
from polepilot.core.planning.turns import Turn, prepare, turns_round
from polepilot.core.planning.ways import way_to_line

Points = NDArray[np.float64]

CUT = 0.05
"""A corner may be cut by this much, metres."""
_RADIUS_MARGIN = 1.02
"""Arcs are this much wider than asked for, so that their chords keep the radius."""
_PATIENCE = 12
"""How often backing out may fail before it is no longer tried."""
_MOST_TURNS = 80
"""So many ways round one corner are tried, the cheapest first."""
_SHORT = 0.15
"""A leg shorter than this is not worth a manoeuvre of its own, metres."""
_BRIEF = 0.45
"""Nor is one shorter than this worth backing out for, if the next one is got onto from here."""
_MOST_TRIES = 10
_MOST_ZIGZAGS = 2
"""To so many legs a way to and fro is looked for from one place: who gets to none is stuck."""
_SOME = 12
_AT_ONCE = 24
"""So many ways round a corner, and so many curves, are looked at at once."""
_CURVES = 6
"""So many curves to a pose are looked at."""
_ALONG = (1.45, 1.6, 2.0, 3.0)
"""So far ahead of the robot a loop may be entered, in turning radii."""
_AHEAD = (0.0, -0.6, 1.0, 1.6, 2.4)
"""How far beyond a place its line may be joined, to drive back to it, in turning radii."""
_BACK_OUT = (0.25, 0.5, 0.8, 1.2, 1.8, 2.6, 3.8, 5.5, 8.0, 12.0, 20.0, 40.0)
"""How far to back out along the track where nothing fits, metres."""


class Driver:
    """Drives runs one after the other, inside the free space, no tighter than ``radius``."""

    def __init__(self, space: FreeSpace, radius: float, pose: Pose2D) -> None:
        self._space = space
        self._radius = radius * _RADIUS_MARGIN
        self.track = Track(pose, self._radius)
        self._patience = _PATIENCE
        self._thorough = True
        """Whether unusual ways round corners are looked at as well."""
        self._stuck: Pose2D | None = None
        """Where no way to a leg was found."""

    def follow(self, points: Points, cut: float = CUT) -> None:
        """Drives along ``points``, on whose first leg the track already stands.

        What does not fit is left out.
        """
        points = _tidy(points)
        prepare(_wide_turns(points, self._radius, cut), self._radius)
        index = 1
        while index < len(points):
            corner = points[index]
            if index == len(points) - 1:
                self.track.straight_to(corner)
                return
            after = points[index + 1] - corner
            heading = math.atan2(after[1], after[0])
            if self._round(points, index, heading, cut):
                index += 1
                continue
            # Nothing fits at this corner: go there, then find a way to what follows.
            self.track.straight_to(corner)
            resumed = self._resume(points, index)
            if resumed is None:
                return
            index = resumed

    def enter(self, points: Points, closed: bool = False) -> Points | None:
        """Goes to the first leg of ``points``, or else to a later one; what is left to follow.

        ``closed``: they are a loop, which may begin anywhere: where it is got to with least effort.
        """
        if closed and (loop := self._join(points)) is not None:
            return loop
        step = points[1] - points[0]
        place = (float(points[0, 0]), float(points[0, 1]))
        if self.connect(place, math.atan2(step[1], step[0])):
            return points
        points = _tidy(points)
        leg = self._resume(points, 0)
        return None if leg is None else points[leg - 1 :]

    def _join(self, loop: Points) -> Points | None:
        """Gets onto a loop by one curve; the loop from there on. None, and nothing is driven, if it
        is best entered where it begins."""
        here = self.track.pose.position
        if math.dist(here, loop[0]) < 1e-6:
            return None
        entries = [loop]
        marks = np.r_[0.0, np.cumsum(np.hypot(*np.diff(loop, axis=0).T))]
        beside = float(shapely.LineString(loop).project(shapely.Point(here)))
        for share in _ALONG:
            begun = _begun_at(loop, marks, (beside + share * self._radius) % marks[-1])
            if math.dist(begun[0], begun[1]) < self._radius:
                continue  # a corner that follows needs its room
            if math.dist(here, begun[0]) <= 4 * self._radius:
                entries.append(begun)
        found = self._direct([_begin(entry, 0) for entry in entries])
        if found is None or found[0] == 0:
            return None
        self.track.append(found[2])
        return entries[found[0]]

    def head_for(self, place: geometry.Point) -> bool:
        """Goes to ``place``, looking wherever: one curve and straight on, or what is cheaper.

        False, and the track as before, where no way is found.
        """
        if math.dist(self.track.pose.position, place) < 1e-6:
            return True
        saved = self.track.save()
        aimed = self._aim(place)
        if aimed is not None and curve_length(aimed) < 1.5 * self._radius + math.dist(
            self.track.pose.position, place
        ):
            self.track.append(aimed)
            return True
        if self.connect(place, None):
            if aimed is None or self.track.cost_since(saved) <= curve_cost(aimed):
                return True
            self.track.restore(saved)
        if aimed is not None:
            self.track.append(aimed)
            return True
        self.track.restore(saved)
        return False

    def _aim(self, place: geometry.Point) -> Curve | None:
        """The shorter arc to where ``place`` lies straight ahead, and then straight to it."""
        pose = self.track.pose
        found: list[Curve] = []
        for side, kind in ((1.0, "L"), (-1.0, "R")):
            # Where the place lies as seen from the middle of the circle to that side.
            x, y = pose.to_local(place)
            y = side * y - self._radius
            distance = math.hypot(x, y)
            if distance <= self._radius:
                continue
            rest = math.sqrt(distance**2 - self._radius**2)
            turn = (math.atan2(y, x) + math.atan2(self._radius, rest)) % math.tau
            turn = 0.0 if turn > math.tau - 1e-9 else turn
            found.append(((kind, turn * self._radius), ("S", rest)))
        found.sort(key=curve_length)
        return next((curve for curve in found if self._fits(pose, joined(curve))), None)

    def connect(self, place: geometry.Point, heading: float | None, back_out: bool = True) -> bool:
        """Goes to ``place`` and stands there with ``heading`` (None: any); False: no way found.

        Straight over where possible, else along the shortest path, else after backing out.
        """
        if math.dist(self.track.pose.position, place) < 1e-6 and (
            heading is None or abs(angle_between(self.track.pose.heading, heading)) < 1e-6
        ):
            return True
        if self.track.sign < 0:
            saved = self.track.save()
            self.track.turn_round()
            if self._connect_here(place, heading):
                return True
            self.track.restore(saved)
        if self._connect_here(place, heading):
            return True
        if not back_out or self._patience <= 0:
            return False
        self._patience -= 1
        saved = self.track.save()
        self._thorough = False
        for distance in _BACK_OUT:
            # From the same place each time: backing out twice would lead in again.
            enough = self.track.back_out(distance)
            found = self._connect_here(place, heading)
            if found:
                self._patience = min(self._patience + 1, _PATIENCE)
                break
            self.track.restore(saved)
            if not enough:
                break
        self._thorough = True
        return found

    def _connect_here(self, place: geometry.Point, heading: float | None) -> bool:
        """The cheaper of one curve and the shortest path with its corners turned."""
        pose = self.track.pose
        direct = None
        if heading is not None and math.dist(pose.position, place) < 8 * self._radius:
            direct = self._direct([(place, heading)])
        far = math.dist(pose.position, place) > 4 * self._radius or heading is None
        if direct is not None and not far:
            self.track.append(direct[2])
            return True
        saved = self.track.save()
        if self._along_path(place, heading) and (
            direct is None or self.track.cost_since(saved) <= direct[1]
        ):
            return True
        self.track.restore(saved)  # it may have got half-way
        if direct is None:
            return False
        self.track.append(direct[2])
        return True

    def _direct(
        self, goals: Sequence[tuple[geometry.Point, float]]
    ) -> tuple[int, float, Curve] | None:
        """To which of some places and headings the cheapest curve leads, perhaps from some way back
        or by way of a point ahead; what it costs; and the curve."""
        pose = self.track.pose
        ends = np.array([(*place, heading) for place, heading in goals])
        backs = [0.0, *(b for b in (0.5 * self._radius, self._radius) if b <= self.track.straight)]
        ways = np.array(list(itertools.product(range(len(ends)), backs, _AHEAD)))
        of, back, beyond = ways[:, 0].astype(np.intp), ways[:, 1], ways[:, 2] * self._radius
        starts = _ahead(np.array([pose]), -back)
        found = best_curves(starts, _ahead(ends[of], beyond), self._radius, CHANGE, _CURVES)
        nothing = np.zeros(len(found.of))
        sides = np.column_stack([nothing, found.sides, nothing])
        lengths = np.column_stack([-back[found.of], found.lengths, -beyond[found.of]])
        cost = np.abs(lengths).sum(axis=1) + CHANGE * changes(lengths)
        order = np.argsort(np.round(cost, 9), kind="stable")
        for row in self._likely(pose, sides[order], lengths[order]):
            kinds = zip(sides[order[row]].tolist(), lengths[order[row]].tolist(), strict=True)
            curve = joined(tuple((KIND[side], length) for side, length in kinds))
            if self._fits(pose, curve):
                return int(of[found.of[order[row]]]), float(cost[order[row]]), curve
        return None

    def _likely(self, pose: Pose2D, sides: Points, lengths: Points) -> Iterator[int]:
        """Those of some curves of which some points are free, which is soon looked at."""
        for first in range(0, len(sides), _AT_ONCE):
            some = slice(first, first + _AT_ONCE)
            points = spots(np.array([pose]), sides[some], lengths[some], self._radius)
            yield from (first + np.flatnonzero(self._space.holds_rows(points))).tolist()

    def _along_path(self, place: geometry.Point, heading: float | None) -> bool:
        """Along the shortest path, all of its corners turned; leaves the track half-way if not."""
        path = self._space.shortest_path(self.track.pose.position, place)
        if path is None:
            return False
        points = _tidy(np.array(path))
        if len(points) < 2:
            return False
        first = points[1] - points[0]
        legs = [self._leg(first, float(np.hypot(*first)))]
        for index in range(1, len(points) - 1):
            step = points[index + 1] - points[index]
            legs.append(self._leg(step, float(np.hypot(*step))))
        if not self._turn_here(legs[0][0], legs[0][1], math.inf):
            return False
        for index, (_, length) in enumerate(legs):
            corner = points[index + 1]
            if index + 1 < len(legs):
                turn, room = legs[index + 1]
            elif heading is not None:
                turn, room = heading, 0.0
            else:
                self.track.straight_to(corner)
                return True
            before = float(np.hypot(*(corner - np.array(self.track.pose.position))))
            if not self._turn_at(corner, turn, before, room, math.inf):
                return False
            if length < 1e-9:
                return False
        if heading is not None:
            self.track.straight_to(points[-1])
        return True

    @staticmethod
    def _leg(step: Points, length: float) -> tuple[float, float]:
        return math.atan2(step[1], step[0]), length

    def _round(self, points: Points, index: int, heading: float, cut: float) -> bool:
        """Passes the corner ``points[index]``: plain, rounded, or turned."""
        corner = points[index]
        here = np.array(self.track.pose.position)
        before = float(np.dot(corner - here, self.track.ahead()))
        after = float(np.hypot(*(points[index + 1] - corner)))
        turn = angle_between(self.track.pose.heading, heading)
        if abs(turn) < PLAIN and abs(turn) * self._radius < 0.7 * min(max(before, 0.0), after):
            self.track.straight_to(corner)
            self.track.pose = Pose2D(*self.track.pose.position, heading)
            self.track.reserve = abs(turn) * self._radius
            return True
        room = after
        if index + 2 < len(points):
            # The corner after this one needs its share of the leg between them.
            following = points[index + 2] - points[index + 1]
            other = abs(angle_between(heading, math.atan2(following[1], following[0])))
            mine = math.tan(min(abs(turn), 3.0) / 2)
            theirs = math.tan(min(other, 3.0) / 2)
            if self._radius * (1 / math.cos(min(other, 3.0) / 2) - 1) <= cut:
                room = after * mine / max(mine + theirs, 1e-9)
        tangent = self._radius * math.tan(min(abs(turn), 3.1) / 2)
        width = self._radius * (1 / math.cos(min(abs(turn), 3.1) / 2) - 1)
        if width <= cut and tangent <= min(before - self.track.reserve, room) + 1e-9:
            arc: Curve = (("L" if turn > 0 else "R", abs(turn) * self._radius),)
            whole = joined((("S", before - tangent), *arc))
            sampled = sample(self.track.pose, whole, self._radius)
            if self._space.holds_points(sampled[0]):
                self.track.append(whole, sampled)
                self.track.straight = 0.0
                return True
        return self._turn_at(corner, heading, before, after, cut)

    def _turn_here(self, heading: float, room: float, cut: float) -> bool:
        """Turns to ``heading`` about the place where the track ends."""
        return self._turn_at(np.array(self.track.pose.position), heading, 0.0, room, cut)

    def _turn_at(
        self, corner: Points, heading: float, before: float, after: float, cut: float
    ) -> bool:
        """Turns at a corner ``before`` metres straight ahead; cuts it by more only if it must."""
        pose = self.track.pose
        turn = angle_between(pose.heading, heading)
        if abs(turn) < 1e-6:
            self.track.straight_to(corner)
            return True
        room_before = before + self.track.straight
        cos, sin = math.cos(pose.heading), math.sin(pose.heading)
        turned = np.array([[cos, sin], [-sin, cos]])
        start = np.array(pose.position)
        corner_here = start + before * turned[0]
        for every in (False, True) if self._thorough else (False,):
            options = [
                way
                for way in turns_round(turn, self._radius, every)
                if -way.lead <= room_before + 1e-9
                and way.stop <= after + 1e-9
                and (way.visit or not 0 <= before + way.lead < self.track.reserve)
                and (every or way.cut <= cut)
            ]
            if math.isinf(cut):
                options.sort(key=lambda way: way.cost - 20 * min(way.cut, 0.5) ** 2)
            else:
                options.sort(key=lambda way: (way.cut > cut, way.cost))
            for way in self._free(options[:_MOST_TURNS], start, corner_here, turned):
                self.track.append(way.after(before))
                self.track.pose = Pose2D(*self.track.pose.position, heading)
                return True
        return False

    def _free(
        self, ways: list[Turn], start: Points, corner: Points, turned: Points
    ) -> Iterator[Turn]:
        """Those of some ways round a corner that stay in the free space; ``turned``: the direction
        of the way in, and what is to the left of it."""
        for first in range(0, len(ways), _SOME):
            some = ways[first : first + _SOME]
            few = [way.points[::STRIDE] for way in some]
            ends = np.cumsum([len(points) for points in few])
            free = self._space.holds_each(np.concatenate(few) @ turned + corner)
            for way, last, points in zip(some, ends.tolist(), few, strict=True):
                if free[last - len(points) : last].all():
                    line = np.vstack([start, way.points @ turned + corner])
                    if self._space.holds_points(line):
                        yield way

    def _resume(self, points: Points, index: int) -> int | None:
        """Gets back onto ``points`` at the corner ``index`` or later; which corner comes next.

        Where a leg cannot be entered forward, it is driven backward, and so is what follows.
        """
        tries = zigzags = 0
        if self.track.pose == self._stuck:
            zigzags = _MOST_ZIGZAGS
        for leg in range(index, len(points) - 1):
            length = math.dist(points[leg], points[leg + 1])
            if length < _SHORT and leg + 2 < len(points):
                continue
            tries += 1
            if self._onto(points, leg):
                return leg + 1
            if zigzags < _MOST_ZIGZAGS:
                zigzags += 1
                if self._zigzag(points[leg], points[leg + 1]):
                    return leg + 1
            if length < _BRIEF and leg + 2 < len(points) and self._onto(points, leg + 1):
                return leg + 2
            if self.connect(*_begin(points, leg)):
                return leg + 1
            if tries >= _MOST_TRIES:
                break
        self._stuck = self.track.pose
        return None

    def _onto(self, points: Points, leg: int) -> bool:
        """Gets onto a leg at its beginning from here, whichever way round."""
        if self._connect_here(*_begin(points, leg)):
            return True
        saved = self.track.save()
        self.track.turn_round()
        if self._connect_here(*_begin(points, leg)):
            return True
        self.track.restore(saved)
        return False

    def _zigzag(self, first: Points, last: Points) -> bool:
        """Gets onto a leg at its beginning in short pieces to and fro, whichever way round."""
        pose = np.array([self.track.pose])
        begin, end = ((float(x), float(y)) for x, y in (first, last))
        found = way_to_line(self._space, pose, self._radius, begin, end)
        if found is None:
            return False
        self.track.append(found[1])
        heading = math.atan2(end[1] - begin[1], end[0] - begin[0])
        if abs(angle_between(self.track.pose.heading, heading)) > math.pi / 2:
            self.track.turn_round()
        self.track.pose = Pose2D(*self.track.pose.position, heading)
        return True

    def _fits(self, pose: Pose2D, curve: Curve) -> bool:
        return self._space.holds_points(sample(pose, curve, self._radius)[0])


def _wide_turns(points: Points, radius: float, cut: float) -> Iterator[float]:
    """The turns at corners of a line that are no mere bends for a wheel of ``radius``."""
    steps = np.diff(points, axis=0)
    lengths = np.hypot(*steps.T)
    turns = np.abs((np.diff(np.arctan2(steps[:, 1], steps[:, 0])) + math.pi) % math.tau - math.pi)
    half = np.minimum(turns, 3.0) / 2
    room = np.minimum(lengths[:-1], lengths[1:]) / 2
    wide = (radius * np.tan(half) > room) | (radius * (1 / np.cos(half) - 1) > cut)
    yield from turns[wide].tolist()


def _begun_at(loop: Points, marks: Points, first: float) -> Points:
    """A closed line, with the lengths along it, from one of these lengths on around."""
    if first <= 0 or first >= marks[-1]:
        return loop
    index = int(np.searchsorted(marks, first, side="right"))
    share = (first - marks[index - 1]) / (marks[index] - marks[index - 1])
    place = loop[index - 1] + share * (loop[index] - loop[index - 1])
    return np.vstack([place, loop[index:], loop[1:index], place])


def _ahead(poses: Points, distances: Points) -> Points:
    """Poses, N x 3, moved straight ahead."""
    x, y, heading = np.broadcast_to(poses, (len(distances), 3)).T
    return np.stack(
        [x + distances * np.cos(heading), y + distances * np.sin(heading), heading], axis=1
    )


def _begin(points: Points, leg: int) -> tuple[geometry.Point, float]:
    """Where a leg of a line begins, and its heading."""
    step = points[leg + 1] - points[leg]
    return (float(points[leg, 0]), float(points[leg, 1])), math.atan2(step[1], step[0])


def _tidy(points: Points) -> Points:
    """Without repeated points."""
    steps = np.hypot(*np.diff(points, axis=0).T)
    return points[np.r_[True, steps > 1e-6]]
