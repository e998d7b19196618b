"""Where the robot is: from odometry and landmarks to a pose, how sure it is, and why not.

FIXING -> TRACKING <-> DEGRADED -> LOST -> (refix) -> FIXING. The filter's state lives at the last
measurement; the present pose is predicted from there through the odometry that came since, so a
picture that took 0.3 s to read is applied at the pose from which it was taken.

A pose that is given up is not forgotten at once: until another one is found, landmarks that agree
with it bring it back. So it costs little to be quick in giving up.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from itertools import groupby

from polepilot.core.geometry import Point, Pose2D
from polepilot.core.landmark import Landmark
from polepilot.core.localization.belief import Belief
from polepilot.core.localization.books import Books
from polepilot.core.localization.ekf import PoseFilter
from polepilot.core.localization.events import EventLog
from polepilot.core.localization.events import LocalizerEvent as LocalizerEvent
from polepilot.core.localization.fix import Fix
from polepilot.core.localization.given_up import GivenUp
from polepilot.core.localization.noise import NoiseModel as NoiseModel
from polepilot.core.localization.odometry import Following, OdometryHistory
from polepilot.core.localization.presence import Presence
from polepilot.core.localization.radial import RadialFilter, unfiltered
from polepilot.core.localization.repeats import Repeats
from polepilot.core.localization.search import FixSearch
from polepilot.core.localization.settings import LocalizerSettings as LocalizerSettings
from polepilot.core.localization.settings import Method as Method
from polepilot.core.localization.suspicion import Suspected, Suspicion
from polepilot.core.localization.track import Filter, Sighting, Track
from polepilot.core.observation import Odometry, PoseEstimate, RangeBearing, Status
from polepilot.core.vehicle import Vehicle

_FITTING = 0.7
"""Share of a fix's sightings that the filter must take, or the fix is not believed."""
_PROBATION = 10.0
"""Seconds that a new pose must last before what was learnt with it outlives it."""
_SURVEYED = 16
"""For so many landmarks the map's error is estimated: those that were seen last."""
_UNFOLLOWED = 5.0
"""Without a picture, a pose is carried along once it is so much older, seconds, than measurements
may come late: the odometry reaches back 15 s, and motion before that would be forgotten."""


class Localizer:
    """Estimates the pose of `base_link` in `map`. Not thread-safe; one thread owns the robot."""

    def __init__(
        self,
        landmarks: Mapping[int, Landmark],
        vehicle: Vehicle,
        camera_forward: float,
        settings: LocalizerSettings | None = None,
        half_view: float | None = None,
    ) -> None:
        """``half_view``: half of the camera's horizontal angle of view (rad).

        Where it is known, `add_picture` tells landmarks that are missing.
        """
        self.settings = settings or LocalizerSettings()
        self._landmarks = dict(landmarks)
        self._camera_forward = camera_forward
        self._history = OdometryHistory(
            vehicle.wheelbase,
            steering_lag=self.settings.steering_lag,
            speed_lag=self.settings.speed_lag,
            steering_slowness=self.settings.steering_slowness,
        )
        self._search = FixSearch(self._landmarks, self._history, camera_forward, self.settings.fix)
        self._events = EventLog()
        self._belief = Belief(self.settings, self._events, reason=self._search.refusal.reason)
        presence = (
            None if half_view is None else Presence(self._landmarks, camera_forward, half_view)
        )
        self._books = Books(self._landmarks, self.settings, self._events, self._belief, presence)
        self._suspicion = Suspicion(self.settings.tolerance)
        self._filter: Filter = (
            RadialFilter(vehicle.wheelbase, camera_forward)
            if self.settings.method == "paper"
            else PoseFilter(
                vehicle.wheelbase,
                camera_forward,
                self.settings.noise,
                self.settings.gate,
                tuple(self._landmarks)[:_SURVEYED],
                shared=len(self._landmarks) > _SURVEYED,
            )
        )
        """What is known of the robot's errors outlives a pose."""
        self._before: tuple[float, Filter, Following] | None = None
        self._track: Track | None = None
        self._ahead: Track | None = None
        self._given_up: GivenUp | None = None
        self._measured: tuple[float, Pose2D] | None = None
        self._predicted: tuple[float, Pose2D] | None = None
        self._fixes = 0
        self._repeats = Repeats()

    # ---- what is known -----------------------------------------------------------------------

    @property
    def status(self) -> Status:
        return self._belief.status

    @property
    def reason(self) -> str:
        """Why the status is not TRACKING, for a person; empty while tracking."""
        return self._belief.reason

    @property
    def measured(self) -> tuple[float, Pose2D] | None:
        """Stamp and pose from the last measurement before filtering: the paper's R_2^2.

        The position is the prediction moved along the line to the landmark until the range agrees,
        the heading follows from the bearing. After a fix it is the fix.
        """
        return self._measured

    @property
    def predicted(self) -> tuple[float, Pose2D] | None:
        """Stamp and pose just before the last measurement was taken in: the paper's R_2^1."""
        return self._predicted

    @property
    def moved_landmarks(self) -> dict[int, Point]:
        """Landmarks that do not stand where the map has them, and by how much (dx, dy)."""
        return dict(self._books.health.moved)

    @property
    def history(self) -> OdometryHistory:
        """The odometry of the last seconds, for dead reckoning between poses."""
        return self._history

    def events(self) -> list[LocalizerEvent]:
        """What happened since the last call."""
        return self._events.drain()

    def estimate(self, now: float) -> PoseEstimate | None:
        """The pose at ``now``; None until the first fix. Before the last measurement: that one."""
        track = self._track
        if track is None:
            return None
        ahead = self._ahead = self._predicted_to(now, track)
        covariance = ahead.filter.pose_covariance + self._books.trial.covariance(ahead.filter.pose)
        suspected = self._judge(ahead)
        belief = self._belief
        # Something contradicts the pose and nothing has confirmed it since, or it cannot be told.
        spread = math.hypot(self._books.doubt.spread, suspected.spread)
        if spread:
            covariance[0, 0] += spread**2
            covariance[1, 1] += spread**2
            covariance[2, 2] += (spread / 3.0) ** 2
        return PoseEstimate(
            ahead.stamp, ahead.filter.pose, covariance, belief.status, belief.reason
        )

    # ---- what happens ------------------------------------------------------------------------

    def add_odometry(self, odometry: Odometry) -> None:
        """How the robot moves from ``odometry.stamp`` on."""
        self._follow(odometry.stamp)
        self._history.add(odometry)
        if self._ahead is not None and odometry.stamp < self._ahead.stamp:
            self._ahead = None

    def add_picture(
        self, stamp: float, pan: float | None, measurements: Sequence[RangeBearing]
    ) -> None:
        """A picture taken at ``stamp`` with the camera turned by ``pan``, and all it showed.

        Tells more than `add_measurements`: a picture without a landmark that should be in it
        speaks against the pose.
        """
        self.add_measurements(measurements)
        track = self._track
        if track is None or self._belief.lost or pan is None or not math.isfinite(stamp):
            return
        then = self._predicted_to(stamp, track)
        if then.stamp == stamp:
            self._ahead = self._ahead or then
            self._books.look(then, pan, {m.landmark for m in measurements})

    def add_measurements(self, measurements: Sequence[RangeBearing]) -> None:
        """Landmarks seen; those of one picture share a stamp.

        Measurements that come after later ones are applied in their place; those that come too
        late for that are left out, as are unknown landmarks; both are reported. Told twice is once.
        """
        if not measurements:
            return
        usable = [m for m in self._repeats.fresh(measurements) if self._books.usable(m)]
        usable.sort(key=lambda m: m.stamp)
        for stamp, group in groupby(usable, key=lambda m: m.stamp):
            picture = list(group)
            if self._track is None:
                self._seek(stamp, picture)
            elif stamp < self._track.stamp - 1e-9:
                self._apply_late(self._track, stamp, picture)
            else:
                self._apply(self._track, stamp, picture)

    def refix(self, reason: str) -> None:
        """Give up the pose and look for it anew; what contradicted the old one is kept."""
        track = self._track
        if not self._belief.lost:
            # It is not the program itself that asks for it.
            self._books.trial.forgive()
        elif track is not None:
            self._suspicion.lost(track.stamp)
        if self._before is not None and track is not None:
            begun, tracked, following = self._before
            if track.stamp - begun < _PROBATION:
                # A pose that did not last was wrong, and so is what was learnt from it.
                self._filter = tracked
                self._history.retune(following)
                track = None
        # A pose that was never confirmed is not to be taken up again by the same two landmarks.
        keep = self._books.trial.over
        self._given_up = GivenUp(track, self.settings) if track is not None and keep else None
        self._track = self._ahead = self._before = None
        self._measured = self._predicted = None
        self._belief.seek(reason)
        self._search.clear()
        against = self._books.close()
        self._collect(against)
        if against:
            self._try_fix(against[-1].stamp)

    # ---- finding the pose --------------------------------------------------------------------

    def _seek(self, stamp: float, picture: list[RangeBearing]) -> None:
        """Without a pose: a picture may lead to one, or back to the one that was given up."""
        given_up, moved = self._given_up, self._books.health.moved
        known = [(m, self._landmarks[m.landmark]) for m in picture if m.landmark not in moved]
        if given_up is not None and given_up.agrees(self._history, stamp, known):
            track = given_up.track
            track.moving = 0.0
            self._accept(track)
            self._books.reopen(stamp, {m.landmark for m in picture})
            self._measured = (stamp, track.filter.pose)
            self._events.add(LocalizerEvent(stamp, "resumed", "The landmarks agree with it again."))
            return
        self._collect(picture)
        self._try_fix(stamp)

    def _collect(self, measurements: Sequence[RangeBearing]) -> None:
        """Keep for a fix; landmarks known to have been moved would only mislead it."""
        for measurement in measurements:
            if measurement.landmark not in self._books.health.moved:
                self._search.add(measurement)

    def _try_fix(self, stamp: float) -> None:
        search = self._search
        search.scale, search.offset = self._filter.speed_factor, self._filter.steering_offset
        for found in search.attempts(stamp):
            if self._begin(stamp, found):
                return
        self._belief.seek(self._books.trial.refusal(stamp) or search.refusal.reason)

    def _begin(self, stamp: float, found: Fix) -> bool:
        """Whether all that was seen fits to the fix so well that it is believed."""
        books, trial = self._books, self._books.trial
        on_trial = trial.failed
        if len(found.landmarks) == 2 and trial.refusal(stamp):
            return False
        started, refused = self._started(stamp, found)
        track = Track(started, stamp, self.settings.tolerance)
        taken = [m for m in self._search.used if m not in refused]
        fitting = len(taken) >= _FITTING * len(self._search.used) and self._search.confirmed(taken)
        if not fitting or track.sigma > self.settings.degraded_sigma:
            # The stricter gate left some of them out: they do not fit together so well.
            self._search.refuse("The landmarks seen so far do not fit together well enough.")
            return False
        self._before = (stamp, self._filter, self._history.following)
        # One that the filter would not take was no part of it.
        agreed = [n for n in found.landmarks if not _mostly(n, refused, self._search.used)]
        if len(agreed) < 2:
            agreed = list(found.landmarks)
        trial.begin(agreed, self._search.of(agreed))
        # Of a landmark that was seen before all others the robot may have been taken away.
        since = -math.inf if on_trial else taken[0].stamp
        outsiders = [
            ((m, self._landmarks[m.landmark]), place, sigma)
            for m, place, sigma in self._search.appearing(found, stamp, agreed)
            if m.stamp >= since
        ]
        before, agreeing = self._filter, self._marked(taken)
        self._accept(track)
        books.open(stamp, agreed)
        displaced = {
            seen.landmark
            for seen, place, sigma in track.supposed.start(
                before, found, stamp, agreeing, outsiders, self._history
            )
            if books.displaced(seen, place, sigma)
        }
        track.supposed.keep(displaced)
        self._measured = (stamp, found.pose)
        ids = ", ".join(str(number) for number in found.landmarks)
        code = "refixed" if self._fixes else "fixed"
        self._fixes += 1
        self._events.add(LocalizerEvent(stamp, code, f"Pose fixed by landmarks {ids}."))
        return True

    def _started(self, stamp: float, found: Fix) -> tuple[Filter, list[RangeBearing]]:
        """A filter that begins with a fix, and which of the sightings behind that it refuses.

        A filter believes what it is told first. Where it refuses too much of what follows, the
        first pictures may be those that were wrong: the robot was still in somebody's hands. So
        they are left out one by one, as long as enough are left.
        """
        used = self._search.used
        most = (1.0 - _FITTING) * len(used)
        first = 0
        while True:
            started = self._filter.copy()
            against = started.begin(found, stamp, self._marked(used[first:]), self._history)
            refused = [*used[:first], *against]
            begun = used[first].stamp
            while first < len(used) and used[first].stamp == begun:
                first += 1
            if len(refused) <= most or first > most:
                return started, refused

    def _accept(self, track: Track) -> None:
        """Believe a pose."""
        self._filter, self._track = track.filter, track
        self._ahead = self._given_up = None
        self._belief.accept(self._books.trial.unconfirmed)
        self._search.clear()

    def _marked(self, measurements: Iterable[RangeBearing]) -> list[Sighting]:
        return [(m, self._landmarks[m.landmark]) for m in measurements]

    # ---- following it ------------------------------------------------------------------------

    def _apply(self, track: Track, stamp: float, picture: list[RangeBearing]) -> None:
        ahead, self._ahead = self._ahead, None
        if ahead is not None and track.stamp <= ahead.stamp <= stamp:
            track.adopt(ahead)
        track.predict(self._history, stamp)
        books, doubt = self._books, self._books.doubt
        if self._belief.lost:
            for measurement in picture:
                doubt.add(measurement, doubt.gap)
            return
        predicted = track.filter.pose
        self._predicted = (stamp, predicted)
        kept = track.keep()
        taken = [m for m in picture if books.take(track, m)]
        kept += self._marked(taken)
        if track.supposed:
            rest = self._marked(m for m in picture if m not in taken)
            track.supposed.follow(self._history, stamp, kept, rest, track.tolerance)
        ranged = [m for m in taken if math.isfinite(m.range_sigma)]
        if ranged:
            best = min(ranged, key=lambda m: m.range_sigma)
            self._measured = (
                stamp,
                unfiltered(predicted, best, self._landmarks[best.landmark], self._camera_forward),
            )
        if taken:
            track.moving = 0.0
            doubt.clear()
            track.retune(self._history)
        self._filter = track.filter
        books.judge(track)
        self._judge(track)

    def _apply_late(self, track: Track, stamp: float, picture: list[RangeBearing]) -> None:
        """Go back, take the picture in, and come forward again."""
        undone = None
        if not self._belief.lost and stamp >= track.stamp - self.settings.late:
            undone = track.rewind(stamp, self._history)
        if undone is None:
            self._books.late(picture)
            return
        self._ahead = None
        kept = track.keep()
        taken = [m for m in picture if self._books.take(track, m)]
        kept += [(m, self._landmarks[m.landmark]) for m in taken]
        if taken:
            track.moving = 0.0
        track.replay(undone, self._history)
        self._filter = track.filter

    def _follow(self, now: float) -> None:
        """Carry a pose along that has not been corrected for long, before its odometry goes."""
        until = now - self.settings.late if math.isfinite(now) else -math.inf
        given_up = self._given_up
        for track in (self._track, None if given_up is None else given_up.track):
            if track is not None and track.stamp < until - _UNFOLLOWED:
                track.predict(self._history, until)
                track.keep()

    def _predicted_to(self, stamp: float, track: Track) -> Track:
        """The track at ``stamp``, or at its last measurement where that came later."""
        ahead = self._ahead
        if ahead is None or ahead.stamp > stamp or ahead.stamp < track.stamp:
            ahead = track.fork()
        ahead.predict(self._history, stamp)
        return ahead

    # ---- believing in it ---------------------------------------------------------------------

    def _judge(self, track: Track) -> Suspected:
        misfit, books = track.filter.map_misfit, self._books
        moved, trial = books.health.moved, books.trial
        agreeing = books.agreeing if moved else None
        count = len(self._landmarks)
        suspected = self._suspicion.judge(track.stamp, count, moved, misfit, agreeing)
        doubted = books.doubt.spread > 0.0
        reason = suspected.reason or trial.doubt
        belief, known = self._belief, (track.moving, track.sigma)
        belief.judge(track.stamp, *known, doubted, reason, trial.unconfirmed)
        return suspected


def _mostly(number: int, refused: Sequence[RangeBearing], used: Sequence[RangeBearing]) -> bool:
    """Whether most of a landmark's sightings were refused."""
    return 2 * sum(m.landmark == number for m in refused) > sum(m.landmark == number for m in used)
