"""Where the robot is: from odometry and landmarks to a pose, how sure it is, and why not.

FIXING -> TRACKING <-> DEGRADED -> LOST -> (refix) -> FIXING. The filter's state lives at the last
measurement; the present pose is predicted from there through the odometry that came since, so a
picture that took 0.3 s to read is applied at the pose from which it was taken.

A pose that is given up is not forgotten at once: until another one is found, landmarks that agree
with it bring it back. So it costs little to be quick in giving up.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping, Sequence
from itertools import groupby

from polepilot.core.geometry import Point, Pose2D
from polepilot.core.landmark import Landmark
from polepilot.core.localization.belief import Belief
from polepilot.core.localization.doubt import Doubt
from polepilot.core.localization.ekf import PoseFilter
from polepilot.core.localization.events import EventLog
from polepilot.core.localization.events import LocalizerEvent as LocalizerEvent
from polepilot.core.localization.fix import Fix
from polepilot.core.localization.given_up import GivenUp
from polepilot.core.localization.health import LandmarkHealth, Verdict
from polepilot.core.localization.noise import NoiseModel as NoiseModel
from polepilot.core.localization.odometry import Following, OdometryHistory
from polepilot.core.localization.presence import Presence
from polepilot.core.localization.radial import RadialFilter, unfiltered
from polepilot.core.localization.repeats import Repeats
from polepilot.core.localization.search import FixSearch
from polepilot.core.localization.settings import LocalizerSettings as LocalizerSettings
from polepilot.core.localization.settings import Method as Method
from polepilot.core.localization.suspicion import Suspected, Suspicion
from polepilot.core.localization.track import Filter, Track
from polepilot.core.localization.trial import Trial
from polepilot.core.observation import Odometry, PoseEstimate, RangeBearing, Status
from polepilot.core.vehicle import Vehicle

_FITTING = 0.7
"""Share of a fix's sightings that the filter must take, or the fix is not believed."""
_PROBATION = 10.0
"""Seconds that a new pose must last before what was learnt with it outlives it."""
_STANDS_AFTER = 0.2
"""Seconds after the last motion from when on the robot counts as standing."""
_SWEEPS = 8.0
"""Another landmark agreed with the pose recently: within the last two sweeps or so, seconds."""
_CHANCE = 0.01
"""How likely it may be that missing landmarks are just overlooked before the pose is given up."""
_SURVEYED = 16
"""For so many landmarks the map's error is estimated; for the others it counts as noise."""
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
        self._health = LandmarkHealth(self._landmarks)
        self._presence = (
            None if half_view is None else Presence(self._landmarks, camera_forward, half_view)
        )
        self._doubt = Doubt(self.settings.tolerance, self.settings.method == "paper")
        self._trial = Trial(self._landmarks, self.settings.tolerance, self.settings.fix.slack)
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
            )
        )
        """What is known of the robot's errors outlives a pose."""
        self._before: tuple[float, Filter, Following] | None = None
        self._track: Track | None = None
        self._ahead: Track | None = None
        self._given_up: GivenUp | None = None
        self._measured: tuple[float, Pose2D] | None = None
        self._predicted: tuple[float, Pose2D] | None = None
        self._last_agreed: dict[int, float] = {}
        self._events = EventLog()
        self._belief = Belief(self.settings, self._events, reason=self._search.refusal.reason)
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
        return dict(self._health.moved)

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
        covariance = ahead.filter.pose_covariance + self._trial.covariance(ahead.filter.pose)
        suspected = self._judge(ahead)
        belief = self._belief
        # Something contradicts the pose and nothing has confirmed it since, or it cannot be told.
        spread = math.hypot(self._doubt.spread, suspected.spread)
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
        if self._presence is not None and pan is not None and math.isfinite(stamp):
            self._look(stamp, pan, {m.landmark for m in measurements})

    def add_measurements(self, measurements: Sequence[RangeBearing]) -> None:
        """Landmarks seen; those of one picture share a stamp.

        Measurements that come after later ones are applied in their place; those that come too
        late for that are left out, as are unknown landmarks; both are reported. Told twice is once.
        """
        usable = [m for m in self._repeats.fresh(measurements) if self._usable(m)]
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
        if track is not None and self._belief.lost:
            self._suspicion.lost(track.stamp)
        if self._before is not None and track is not None:
            begun, tracked, following = self._before
            if track.stamp - begun < _PROBATION:
                # A pose that did not last was wrong, and so is what was learnt from it.
                self._filter = tracked
                self._history.retune(following)
                track = None
        # A pose that was never confirmed is not to be taken up again by the same two landmarks.
        keep = self._trial.over
        self._given_up = GivenUp(track, self.settings) if track is not None and keep else None
        self._track = self._ahead = self._before = None
        self._measured = self._predicted = None
        self._belief.seek(reason)
        self._search.clear()
        if len(self._landmarks) - len(self._health.moved) < 2:
            # With so few left, it is as likely that the pose was wrong.
            self._health.moved.clear()
        against = sorted({*self._trial.give_up(), *self._doubt.against}, key=lambda m: m.stamp)
        self._doubt.clear()
        self._last_agreed.clear()
        self._health.forget()
        if self._presence is not None:
            self._presence.forget()
        self._collect(against)
        if against:
            self._try_fix(against[-1].stamp)

    # ---- finding the pose --------------------------------------------------------------------

    def _usable(self, measurement: RangeBearing) -> bool:
        numbers = (measurement.stamp, measurement.bearing, measurement.bearing_sigma)
        if not all(math.isfinite(number) for number in numbers) or math.isnan(measurement.range):
            return False
        if measurement.landmark in self._landmarks:
            return True
        text = f"Landmark {measurement.landmark} is seen but is not on the map."
        self._events.report(
            LocalizerEvent(measurement.stamp, "landmark_unknown", text, measurement.landmark)
        )
        return False

    def _seek(self, stamp: float, picture: list[RangeBearing]) -> None:
        """Without a pose: a picture may lead to one, or back to the one that was given up."""
        given_up, moved = self._given_up, self._health.moved
        known = [(m, self._landmarks[m.landmark]) for m in picture if m.landmark not in moved]
        if given_up is not None and given_up.agrees(self._history, stamp, known):
            track = given_up.track
            track.moving = 0.0
            self._accept(track, stamp, {m.landmark for m in picture})
            self._measured = (stamp, track.filter.pose)
            self._events.add(LocalizerEvent(stamp, "resumed", "The landmarks agree with it again."))
            return
        self._collect(picture)
        self._try_fix(stamp)

    def _collect(self, measurements: Sequence[RangeBearing]) -> None:
        """Keep for a fix; landmarks known to have been moved would only mislead it."""
        for measurement in measurements:
            if measurement.landmark not in self._health.moved:
                self._search.add(measurement)

    def _try_fix(self, stamp: float) -> None:
        search = self._search
        search.scale, search.offset = self._filter.speed_factor, self._filter.steering_offset
        for found in search.attempts(stamp):
            if self._begin(stamp, found):
                return
        self._belief.seek(self._trial.refusal or search.refusal.reason)

    def _begin(self, stamp: float, found: Fix) -> bool:
        """Whether all that was seen fits to the fix so well that it is believed."""
        on_trial = self._trial.failed
        if len(found.landmarks) == 2 and self._trial.refusal:
            return False
        started = self._filter.copy()
        sightings = [(m, self._landmarks[m.landmark]) for m in self._search.used]
        share = started.begin(found, stamp, sightings, self._history)
        track = Track(started, stamp, self.settings.tolerance)
        if share < _FITTING or track.sigma > self.settings.degraded_sigma:
            # The stricter gate left some of them out: they do not fit together so well.
            self._search.refuse("The landmarks seen so far do not fit together well enough.")
            return False
        self._before = (stamp, self._filter, self._history.following)
        self._accept(track, stamp, found.landmarks)
        self._trial.begin(found.landmarks, self._search.used)
        if self._trial.over:
            # Of a landmark that was seen before all others the robot may have been taken away.
            since = -math.inf if on_trial else self._search.used[0].stamp
            for outside in (one for one in self._search.outside if one[1] >= since):
                self._contradicted(*outside)
        self._measured = (stamp, found.pose)
        ids = ", ".join(str(number) for number in found.landmarks)
        code = "refixed" if self._fixes else "fixed"
        self._fixes += 1
        self._events.add(LocalizerEvent(stamp, code, f"Pose fixed by landmarks {ids}."))
        return True

    def _accept(self, track: Track, stamp: float, agreed: Collection[int]) -> None:
        """Believe a pose."""
        self._filter, self._track = track.filter, track
        self._ahead = self._given_up = None
        self._belief.accept()
        self._search.clear()
        self._doubt.clear()
        self._last_agreed = dict.fromkeys(agreed, stamp)

    # ---- following it ------------------------------------------------------------------------

    def _apply(self, track: Track, stamp: float, picture: list[RangeBearing]) -> None:
        ahead, self._ahead = self._ahead, None
        if ahead is not None and track.stamp <= ahead.stamp <= stamp:
            track.adopt(ahead)
        track.predict(self._history, stamp)
        if self._belief.lost:
            for measurement in picture:
                self._doubt.add(measurement, self._doubt.gap)
            return
        predicted = track.filter.pose
        self._predicted = (stamp, predicted)
        kept = track.keep()
        taken = [m for m in picture if self._take(track, m)]
        kept += [(m, self._landmarks[m.landmark]) for m in taken]
        ranged = [m for m in taken if math.isfinite(m.range_sigma)]
        if ranged:
            best = min(ranged, key=lambda m: m.range_sigma)
            self._measured = (
                stamp,
                unfiltered(predicted, best, self._landmarks[best.landmark], self._camera_forward),
            )
        if taken:
            track.moving = 0.0
            self._doubt.clear()
            track.retune(self._history)
        self._filter = track.filter
        self._judge_doubt(track)
        self._judge(track)

    def _apply_late(self, track: Track, stamp: float, picture: list[RangeBearing]) -> None:
        """Go back, take the picture in, and come forward again."""
        undone = None
        if not self._belief.lost and stamp >= track.stamp - self.settings.late:
            undone = track.rewind(stamp, self._history)
        if undone is None:
            for measurement in picture:
                self._events.report(
                    LocalizerEvent(
                        stamp, "late", "A measurement came too late.", measurement.landmark
                    )
                )
            return
        self._ahead = None
        kept = track.keep()
        taken = [m for m in picture if self._take(track, m)]
        kept += [(m, self._landmarks[m.landmark]) for m in taken]
        if taken:
            track.moving = 0.0
        track.replay(undone, self._history)
        self._filter = track.filter

    def _take(self, track: Track, measurement: RangeBearing) -> bool:
        """Whether a measurement was fused; keeps the books on those that were not."""
        number, stamp = measurement.landmark, measurement.stamp
        mark = self._landmarks[number]
        settings, health = self.settings, self._health
        if number in health.moved:
            place = track.filter.appears(measurement)
            if place is None or math.dist(place, mark.position) > 0.5 * settings.tolerance:
                health.contradicted(number, stamp, place or (math.nan, math.nan))
            elif health.agreed(number):
                text = f"Landmark {number} stands again where the map has it."
                self._events.add(LocalizerEvent(stamp, "landmark_back", text, number))
            return False
        place = track.filter.appears(measurement) if health.suspected(number, stamp) else None
        off = 0.0 if place is None else math.dist(place, mark.position)
        if off > 0.5 * settings.tolerance:
            # A pose that has become vague since must not make room for it.
            taken, gap = False, off
        else:
            taken, gap = track.filter.take(measurement, mark, track.tolerance)
        if taken:
            self._last_agreed[number] = stamp
            health.agreed(number)
            self._trial.agrees(measurement)
            if gap < 0.5 * settings.tolerance and not self._trial.undecided:
                for verdict in health.witnessed(number):
                    self._tell(verdict, stamp)
            self._seen(track, measurement)
            return True
        place = place or track.filter.appears(measurement)
        offset = (None, None) if place is None else (place[0] - mark.x, place[1] - mark.y)
        text = f"Landmark {number} appears {100 * gap:.0f} cm from where it should be."
        self._events.report(LocalizerEvent(stamp, "rejected", text, number, *offset))
        # A number read where another landmark stands speaks against the reading, not the pose.
        misread = place is not None and health.stands_another(number, place)
        if gap > settings.tolerance and not misread:
            self._doubt.add(measurement, gap)
        if reason := "" if misread else self._trial.contradicts(measurement):
            self._belief.lose(stamp, reason)
        if place is not None and self._others_agree(number, stamp):
            aside = math.hypot(track.heading_sigma, measurement.bearing_sigma)
            sigma = math.hypot(track.sigma, measurement.range * aside, measurement.range_sigma)
            self._contradicted(number, stamp, place, sigma)
        return False

    def _contradicted(self, number: int, stamp: float, place: Point, sigma: float) -> None:
        """A landmark is not in its place though the pose is right: is it to be left out?"""
        sure = not self._trial.undecided
        verdict = self._health.contradicted(number, stamp, place, sigma, sure)
        if verdict is not None:
            self._tell(verdict, stamp)

    def _tell(self, verdict: Verdict, stamp: float) -> None:
        number = verdict.landmark
        self._events.add(
            LocalizerEvent(stamp, verdict.code, verdict.text, number, verdict.dx, verdict.dy)
        )

    def _others_agree(self, number: int, stamp: float) -> bool:
        return any(
            other != number and stamp - when < _SWEEPS for other, when in self._last_agreed.items()
        )

    def _seen(self, track: Track, measurement: RangeBearing) -> None:
        pan = measurement.pan
        if self._presence is None or pan is None or not math.isfinite(measurement.range):
            return
        number, off_axis = measurement.landmark, measurement.bearing - pan
        if self._presence.saw(number, measurement.range, off_axis, track.filter.pose):
            text = f"Landmark {number} is seen again."
            self._events.add(LocalizerEvent(measurement.stamp, "landmark_back", text, number))

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

    def _look(self, stamp: float, pan: float, seen: Collection[int]) -> None:
        """Notice what is not in a picture though it should be."""
        track, presence = self._track, self._presence
        if track is None or presence is None or self._belief.lost:
            return
        then = self._predicted_to(stamp, track)
        if then.stamp != stamp:
            return
        if self._ahead is None:
            self._ahead = then
        missing, chance, hidden = presence.look(stamp, then.filter.pose, pan, seen)
        for number in hidden:
            text = f"Landmark {number} should be seen and is not: something hides it."
            self._events.add(LocalizerEvent(stamp, "landmark_hidden", text, number))
        if chance < _CHANCE and stamp - then.moved > _STANDS_AFTER:
            ids = " and ".join(str(number) for number in missing)
            self._belief.lose(
                stamp,
                f"Landmark {ids}, seen from here before, is missing: the robot has been moved, or "
                "something stands before it.",
            )

    # ---- believing in it ---------------------------------------------------------------------

    def _judge_doubt(self, track: Track) -> None:
        """LOST when too much contradicts the pose and nothing agrees."""
        standing = track.stamp - track.moved > _STANDS_AFTER
        if judged := self._doubt.judge(track.stamp, self._last_agreed, standing):
            react = self._belief.lose if judged.status == "lost" else self._belief.doubt
            react(track.stamp, judged.reason)

    def _judge(self, track: Track) -> Suspected:
        misfit, moved = track.filter.map_misfit, self._health.moved
        suspected = self._suspicion.judge(track.stamp, len(self._landmarks), moved, misfit)
        doubted = self._doubt.spread > 0.0
        reason = suspected.reason or self._trial.doubt
        self._belief.judge(track.stamp, track.moving, track.sigma, doubted, reason)
        return suspected
