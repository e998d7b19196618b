"""The robot: one tick is sample, estimate, decide, command, publish.

Nothing here reads the time or knows whether the world is real. What people ask for arrives as
method calls between two ticks; the runner sees to that.
"""

from __future__ import annotations

import time
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from itertools import pairwise

from polepilot.core.command import STAND, DriveCommand
from polepilot.core.control.supervisor import Limits, Supervisor, Verdict
from polepilot.core.errors import CameraError, RefusedError
from polepilot.core.geometry import Point
from polepilot.core.link.calibration import DriveCalibration
from polepilot.core.link.messages import Faults, Features
from polepilot.core.link.protocol import LinkState, TelemetrySample
from polepilot.core.localization.localizer import Localizer, LocalizerSettings
from polepilot.core.observation import Odometry, PanReading, PoseEstimate, RangeBearing, Status
from polepilot.core.plan import Plan
from polepilot.core.robot.gaze import Gaze
from polepilot.core.robot.inputs import Inputs
from polepilot.core.robot.journal import Journal
from polepilot.core.robot.line import Line
from polepilot.core.robot.mission import Mission, Outcome, RunSummary
from polepilot.core.robot.pan import PanSweep, PanTrack
from polepilot.core.robot.ports import LinkPort, SensorPort, Sighting
from polepilot.core.robot.readiness import require_ready
from polepilot.core.robot.recorder import Recorder
from polepilot.core.robot.servo import Servo
from polepilot.core.robot.snapshot import Level, Measured, Snapshot, State
from polepilot.core.robot.watch import Watch
from polepilot.core.scenery import Scenery
from polepilot.core.site import Site
from polepilot.core.vehicle import RobotModel
from polepilot.core.vision.measure import to_range_bearing

SIGHTING_PATIENCE = 0.3
"""How long a picture waits for the pan angle of its moment, seconds."""
BLOCKED_PATIENCE = 30.0
"""Seconds of standing before an obstacle; then it takes a person to go on, for what is behind the
robot is remembered only so long."""
SILENT_AFTER = 0.27
"""Seconds after the last telemetry from when on the wheels stand: the board's own deadline is
0.25 s, and the supervisor sends no speed without telemetry."""

_LEVELS: dict[str, Level] = {
    "lost": "fault",
    "landmark_moved": "warning",
    "landmark_misread": "warning",
    "landmark_unknown": "warning",
}
"""How bad the localizer's events are; the others are for information."""

Ranges = tuple[float | None, float | None, float | None]


@dataclass(frozen=True, slots=True)
class RobotSettings:
    """Everything about the robot that is set, not sensed."""

    model: RobotModel = field(default_factory=RobotModel)
    calibration: DriveCalibration = field(default_factory=DriveCalibration)
    localizer: LocalizerSettings = field(default_factory=LocalizerSettings)
    limits: Limits = field(default_factory=Limits)


class Robot:
    """Owns the sensors' and the link's ports; lives in one thread."""

    def __init__(
        self,
        settings: RobotSettings,
        sensor: SensorPort,
        link: LinkPort,
        *,
        stopwatch: Callable[[], float] = time.perf_counter,
    ) -> None:
        self.settings = settings
        self.on_run_ended: Callable[[RunSummary], None] | None = None
        """Called in the robot's thread when a mission is over."""
        self._sensor = sensor
        self._stopwatch = stopwatch
        self._journal = Journal()
        self._line = Line(link, self._journal)
        self._host = self._line.host
        self._supervisor = Supervisor(settings.limits, settings.model.vehicle)
        pan = settings.model.pan
        self._pan = PanTrack()
        self._inputs = Inputs()
        self._servo = Servo(settings.model.vehicle.steering_rate)
        self._sweep = PanSweep(pan.minimum, pan.maximum, pan.sweep_duty)

        self._site: Site | None = None
        self._localizer: Localizer | None = None
        self._gaze: Gaze | None = None
        self._mission: Mission | None = None
        self._paused: str | None = None
        self._was_fixed = False
        self._watch = Watch()

        self._now = 0.0
        self._last_tick: float | None = None
        self._odometry = Odometry(0.0, 0.0, 0.0)
        self._waiting: deque[Sighting] = deque(maxlen=8)
        self._looks_from = 0.0
        """Pictures from before the present map was loaded are not looked at."""
        self._sighting: Sighting | None = None
        self._telemetry: TelemetrySample | None = None
        self._estimate: PoseEstimate | None = None
        self._verdict = Verdict(STAND, "", "idle")
        self._hold = ""
        self._target: Point | None = None
        self._seq = 0

    # ---- what people ask for -----------------------------------------------------------------

    @property
    def site(self) -> Site | None:
        """The map that the robot believes in."""
        return self._site

    @property
    def sighting(self) -> Sighting | None:
        """The newest sighting, with its picture where there is one."""
        return self._sighting

    @property
    def mission(self) -> Mission | None:
        """What is being executed, paused or not."""
        return self._mission

    def load_site(self, site: Site) -> None:
        """Believe in another map: the pose has to be found anew.

        Raises:
            RefusedError: a mission is under way.
        """
        if self._mission is not None:
            raise RefusedError(
                "A mission is under way on the present map.",
                remedy="End the run first.",
                code="mission_active",
            )
        self._site = site
        landmarks = site.landmarks_by_id()
        self._sensor.expect({number: mark.kind for number, mark in landmarks.items()})
        self._localizer = Localizer(
            landmarks,
            self.settings.model.vehicle,
            self.settings.model.camera.forward,
            self.settings.localizer,
            self.settings.model.camera.half_view,
        )
        model = self.settings.model
        self._gaze = Gaze(model.camera, model.pan, landmarks, Scenery(site.segments()))
        self._estimate = None
        self._was_fixed = False
        self._waiting.clear()
        self._inputs.clear()
        self._looks_from = self._now
        self._say("site_loaded", "info", f"Map {site.name!r} loaded; looking for landmarks.")

    def start(self, plan: Plan, run_id: int, recorder: Recorder) -> None:
        """Execute a plan on the loaded site; begins to drive once pose, link and arming allow.

        Raises:
            RefusedError: no site, too few landmarks, a mission under way, a latched stop, no link,
                or the plan starts elsewhere. The recorder stays the caller's then.
        """
        site = require_ready(
            plan, self._site, self._mission is not None, self._host, self._estimate
        )
        mission = Mission(run_id, plan, site, self.settings.model, recorder, self._now)
        recorder.begin(self._now, site, plan, self.settings.model, self.settings.localizer)
        self._inputs.record(recorder)
        self._arm()
        self._mission = mission
        self._journal.on_event = recorder.event
        self._paused = None
        what = "Scanning the area" if plan.mode == "scan" else "Tracking the route"
        self._say("mission_started", "info", f"{what}: {plan.predicted.length:.1f} m.")

    def pause(self, reason: str = "Paused.") -> None:
        """Stand still and keep the mission.

        Raises:
            RefusedError: nothing is under way.
        """
        self._require_mission()
        if self._paused is None:
            self._paused = reason
            self._say("mission_paused", "info", reason)

    def resume(self) -> None:
        """Go on with a paused mission.

        Raises:
            RefusedError: nothing is under way, a latched stop, or no link.
        """
        mission = self._require_mission()
        self._arm()
        mission.take_up()
        self._paused = None
        self._say("mission_resumed", "info", "Going on.")

    def end(self) -> None:
        """Give the mission up; what it did stays recorded.

        Raises:
            RefusedError: nothing is under way.
        """
        self._require_mission()
        self._finish("paused", "Ended by hand before it was done.")

    def stop(self, reason: str = "Emergency stop.") -> None:
        """Stop now and stay stopped until :meth:`clear`; always works. The mission is kept."""
        self._host.estop()
        if self._mission is not None:
            self._paused = reason
        self._say("emergency_stop", "fault", reason)

    def clear(self) -> None:
        """Release a latched stop. Nothing moves until somebody resumes.

        Raises:
            RefusedError: the board does not answer.
        """
        self._host.clear()

    def shutdown(self, now: float) -> None:
        """Wheels still, log closed, ports closed. The last call."""
        self._now = now
        # No ESTOP: that would be latched in the board until somebody released it after the next
        # start. Disarmed, or no longer spoken to for 250 ms, its motors are off all the same.
        self._host.disarm()
        self._line.write(now)
        try:
            if self._mission is not None:
                # A slow disk may take its time now that the wheels stand.
                self._finish("paused", "The service was stopped before it was done.", wait=True)
        finally:
            self._line.close()
            self._sensor.close()

    # ---- the tick ----------------------------------------------------------------------------

    def step(self, now: float) -> Snapshot:
        """One tick at robot time ``now``.

        Whatever goes wrong in it, the wheels do not wait for the next one: the stop is on its way
        before the error is.
        """
        try:
            return self._tick(now)
        except Exception:
            self._host.estop()
            self._line.write(now)
            raise

    def _tick(self, now: float) -> Snapshot:
        dt = 0.0 if self._last_tick is None else max(0.0, now - self._last_tick)
        self._now = self._last_tick = now
        marks = [self._stopwatch()]
        self._sample(now)
        marks.append(self._stopwatch())
        self._locate(now)
        marks.append(self._stopwatch())
        wanted = self._decide(now, dt)
        marks.append(self._stopwatch())
        self._act(now, wanted)
        marks.append(self._stopwatch())
        snapshot = self._publish(now, marks)
        if self._mission is not None:
            recorder = self._mission.recorder
            recorder.snapshot(snapshot)
            if recorder.error is not None:
                self._trouble("log", f"The log of this run is incomplete: {recorder.error}.")
        return snapshot

    def _sample(self, now: float) -> None:
        """Bytes and pictures that have come."""
        for sample in self._line.read(now):
            self._take_telemetry(sample)
        self._notice_silence(now)
        try:
            sighting = self._sensor.read()
        except CameraError as error:
            sighting = None
            self._trouble("camera", str(error))
        if sighting is None:
            return
        self._journal.over("camera")
        if sighting.stamp >= self._looks_from:
            self._sighting = sighting
            self._waiting.append(sighting)

    def _take_telemetry(self, sample: TelemetrySample) -> None:
        previous = None if self._telemetry is None else self._telemetry.telemetry
        self._telemetry = sample
        telemetry, angle = sample.telemetry, None
        if self._host.features & Features.PAN:
            angle = self.settings.model.pan.angle(telemetry.pan_adc)
            self._pan.add(PanReading(sample.stamp, angle))
        odometry = self.settings.calibration.to_odometry(
            telemetry, sample.stamp, previous, self._host.features
        )
        self._move(self._servo.follow(odometry), angle)
        self._journal.board_faults(self._now, telemetry.faults)

    def _notice_silence(self, now: float) -> None:
        """What the board said last does not hold for ever: without the line the wheels stand."""
        age = self._host.telemetry_age(now)
        if self._odometry.speed == 0.0 or age is None or age < SILENT_AFTER:
            return
        stamp = self._odometry.stamp + SILENT_AFTER
        self._move(replace(self._odometry, stamp=stamp, speed=0.0))

    def _move(self, odometry: Odometry, pan: float | None = None) -> None:
        self._odometry = odometry
        if odometry.speed != 0.0:
            self._watch.moved(odometry.stamp)
        if self._localizer is not None:
            self._localizer.add_odometry(odometry)
            self._inputs.add_odometry(odometry, pan)

    def _locate(self, now: float) -> None:
        """The pose from everything sensed until now."""
        localizer = self._localizer
        if localizer is None:
            return
        while self._waiting:
            sighting = self._waiting[0]
            angle = self._pan.at(sighting.stamp)
            if angle is None and now - sighting.stamp < SIGHTING_PATIENCE:
                break
            self._waiting.popleft()
            if angle is not None:
                self._use(sighting, angle, localizer)
        if localizer.status is Status.LOST and self._watch.standing(now):
            localizer.refix(localizer.reason)
        self._estimate = localizer.estimate(now)
        for event in localizer.events():
            if event.code == "refixed" and self._mission is not None:
                self._mission.forget_obstacles()
            self._say(event.code, _LEVELS.get(event.code, "info"), event.text)

    def _use(self, sighting: Sighting, angle: float, localizer: Localizer) -> None:
        measurements: list[RangeBearing] = [
            to_range_bearing(detection, sighting.stamp, angle) for detection in sighting.detections
        ]
        localizer.add_picture(sighting.stamp, angle, measurements)
        self._inputs.add_sighting(sighting.stamp, measurements, sighting.frame, angle)

    def _decide(self, now: float, dt: float) -> DriveCommand:
        """What the mission wants; standing still wherever that is in doubt."""
        mission = self._mission
        kept_by = self._state()[1]
        self._hold = ""
        self._target = None
        estimate = self._estimate
        known = estimate is not None and estimate.status in (Status.TRACKING, Status.DEGRADED)
        self._was_fixed = self._was_fixed or known
        if mission is None:
            return STAND
        if estimate is not None and known:
            mission.observe(estimate.pose)
        self._target = mission.target
        if self._paused is None:
            objection = self._watch.objection(now, self._host.state, kept_by)
            if objection is not None:
                self.pause(objection)
        if self._paused is not None or self._host.state is not LinkState.ARMED:
            return STAND
        if estimate is None or estimate.status in (Status.FIXING, Status.LOST):
            return STAND
        step = mission.drive(now, dt, estimate, self._proximity(), self._held())
        self._target, self._hold = step.target, step.hold
        if mission.done:
            self._finish("done", "The whole path was driven.")
            return STAND
        if mission.blocked_for(now) > BLOCKED_PATIENCE:
            self.pause(f"{step.hold} Clear the way, then Resume.")
            return STAND
        if mission.off_route:
            self.pause(
                f"Stopped: {mission.off_route_reason}. End the run, then plan again from here."
            )
            return STAND
        return step.command

    def _act(self, now: float, wanted: DriveCommand) -> None:
        """The supervisor has the last word; then bytes go out."""
        self._verdict = self._supervisor.check(
            now, wanted, self._estimate, self._host.state, self._host.telemetry_age(now)
        )
        command, vehicle = self._verdict.command, self.settings.model.vehicle
        self._host.drive(*self.settings.calibration.to_drive(command, vehicle))
        latest = self._pan.latest
        rate = 0.0
        if self._gaze is not None:
            between = self._gaze.between(now, self._estimate, self._sweep.turns)
            rate = self._sweep.rate(None if latest is None else latest.angle, between)
        self._host.pan(round(1000 * rate))
        self._line.write(now)

    def _publish(self, now: float, marks: list[float]) -> Snapshot:
        self._seq += 1
        sighting, telemetry = self._sighting, self._telemetry
        measured = None if self._localizer is None else self._localizer.measured
        latest = self._pan.latest
        state, reason = self._state()
        battery = None
        if telemetry is not None and self._host.features & Features.BATTERY:
            battery = telemetry.telemetry.battery_mv / 1000
        marks.append(self._stopwatch())
        sample, locate, decide, act, publish = (b - a for a, b in pairwise(marks))
        return Snapshot(
            seq=self._seq,
            stamp=now,
            state=state,
            reason=reason,
            estimate=self._estimate,
            measured=None if measured is None else Measured(*measured),
            target=self._target,
            command=self._verdict.command,
            pan=None if latest is None else latest.angle,
            proximity=self._proximity(),
            battery=battery,
            link=self._line.status(now),
            detections=() if sighting is None else sighting.detections,
            detections_stamp=None if sighting is None else sighting.stamp,
            mission=None if self._mission is None else self._mission.status(now),
            events=self._journal.events,
            durations=(sample, locate, decide, act, publish),
        )

    # ---- small questions ---------------------------------------------------------------------

    def _state(self) -> tuple[State, str]:
        """One word and why."""
        localizer = self._localizer
        if self._line.stopped:
            return State.STOPPED, self._paused or "Emergency stop. Release it to go on."
        if localizer is None:
            return State.IDLE, "No map is loaded."
        if self._paused is not None:
            return State.PAUSED, self._paused
        if localizer.status in (Status.FIXING, Status.LOST):
            return (State.LOST if self._was_fixed else State.FIXING), localizer.reason
        if self._mission is None:
            return State.READY, localizer.reason
        return State.RUNNING, self._hold or self._verdict.reason

    def _proximity(self) -> Ranges:
        if self._telemetry is None or not self._host.features & Features.PROXIMITY:
            return (None, None, None)
        return self._telemetry.telemetry.ranges

    def _held(self) -> bool:
        """Whether the board lets no wheel turn forward: something is too close ahead."""
        sample = self._telemetry
        return sample is not None and Faults.PROXIMITY_STOP in sample.telemetry.faults

    def _arm(self) -> None:
        self._host.arm()
        self._watch.asked(self._now)

    def _require_mission(self) -> Mission:
        if self._mission is None:
            raise RefusedError(
                "Nothing is under way.", remedy="Start a plan first.", code="no_mission"
            )
        return self._mission

    def _finish(self, outcome: Outcome, reason: str, *, wait: bool = False) -> None:
        mission = self._require_mission()
        summary = mission.summary(self._now, outcome, reason)
        level: Level = "info" if outcome == "done" else "warning"
        self._say("mission_ended", level, reason)
        mission.recorder.result(self._now, summary.to_json())
        mission.recorder.close(wait=wait)
        self._journal.on_event = lambda _: None
        self._inputs.end()
        self._mission = None
        self._paused = None
        if self.on_run_ended is not None:
            self.on_run_ended(summary)

    def _trouble(self, source: str, text: str) -> None:
        self._journal.trouble(self._now, source, text)

    def _say(self, code: str, level: Level, text: str) -> None:
        self._journal.say(self._now, code, level, text)
