"""The robot: one tick is sample, estimate, decide, command, publish.

Nothing here reads the time or knows whether the world is real. What people ask for arrives as
method calls between two ticks; the runner sees to that.
"""

from __future__ import annotations

import time
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass, field
from itertools import pairwise

from polepilot.core.command import STAND, DriveCommand
from polepilot.core.control.supervisor import Limits, Supervisor, Verdict
from polepilot.core.errors import CameraError, LinkError, RefusedError
from polepilot.core.geometry import Point
from polepilot.core.link.calibration import DriveCalibration
from polepilot.core.link.messages import Features
from polepilot.core.link.protocol import HostLink, LinkState, TelemetrySample
from polepilot.core.localization.localizer import Localizer, LocalizerSettings
from polepilot.core.observation import PanReading, PoseEstimate, RangeBearing, Status
from polepilot.core.plan import Plan
from polepilot.core.robot.gaze import Gaze
from polepilot.core.robot.mission import Mission, Outcome, RunSummary
from polepilot.core.robot.pan import PanSweep, PanTrack
from polepilot.core.robot.ports import LinkPort, SensorPort, Sighting
from polepilot.core.robot.recorder import Recorder
from polepilot.core.robot.servo import Servo
from polepilot.core.robot.snapshot import Event, Level, LinkStatus, Measured, Snapshot, State
from polepilot.core.scenery import Scenery
from polepilot.core.site import Site
from polepilot.core.vehicle import RobotModel
from polepilot.core.vision.measure import to_range_bearing

STANDING_AFTER = 0.4
"""Seconds without a turning wheel after which the robot counts as standing."""
SIGHTING_PATIENCE = 0.3
"""How long a picture waits for the pan angle of its moment, seconds."""
ARMING_PATIENCE = 2.0
"""Seconds until a board that does not arm pauses the mission."""
BLOCKED_PATIENCE = 30.0
"""Seconds of standing before an obstacle; then it takes a person to go on, for what is behind the
robot is remembered only so long."""
START_TOLERANCE = 0.5
"""How far from the start of its plan a mission may begin, metres."""
EVENTS_SHOWN = 20

_LEVELS: dict[str, Level] = {
    "lost": "fault",
    "landmark_moved": "warning",
    "landmark_misread": "warning",
    "landmark_unknown": "warning",
}
"""How bad the localizer's events are; the others are for information."""

_DISARMED: dict[LinkState, str] = {
    LinkState.CLOSED: "Stopped: the line to the microcontroller is gone. Plug it in, then Resume.",
    LinkState.CONNECTING: "Stopped: the microcontroller does not answer. Check its power, Resume.",
    LinkState.IDLE: "Stopped: the microcontroller is not armed. Resume arms it.",
    LinkState.LINK_LOST: "Stopped: the microcontroller missed the computer for a moment. Resume.",
    LinkState.ESTOP: "Stopped: the button on the robot is pressed.",
}
"""Why a mission is paused when the board is no longer armed."""

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
        self._port = link
        self._stopwatch = stopwatch
        self._host = HostLink()
        self._supervisor = Supervisor(settings.limits, settings.model.vehicle)
        pan = settings.model.pan
        self._pan = PanTrack()
        self._servo = Servo(settings.model.vehicle.steering_rate)
        self._sweep = PanSweep(pan.minimum, pan.maximum, pan.sweep_duty)

        self._site: Site | None = None
        self._localizer: Localizer | None = None
        self._gaze: Gaze | None = None
        self._mission: Mission | None = None
        self._paused: str | None = None
        self._was_fixed = False
        self._armed = False
        """Since somebody asked for it last."""
        self._asked = 0.0

        self._generation = link.generation
        self._now = 0.0
        self._last_tick: float | None = None
        self._last_moving = 0.0
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
        self._events: deque[Event] = deque(maxlen=EVENTS_SHOWN)
        self._event_seq = 0
        self._faults: dict[str, str] = {}

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
        )
        model = self.settings.model
        self._gaze = Gaze(model.camera, model.pan, landmarks, Scenery(site.segments()))
        self._estimate = None
        self._was_fixed = False
        self._waiting.clear()
        self._looks_from = self._now
        self._say("site_loaded", "info", f"Map {site.name!r} loaded; looking for landmarks.")

    def start(self, plan: Plan, run_id: int, recorder: Recorder) -> None:
        """Execute a plan on the loaded site; begins to drive once pose, link and arming allow.

        Raises:
            RefusedError: no site, too few landmarks, a mission under way, a latched stop, no link,
                or the plan starts elsewhere. The recorder stays the caller's then.
        """
        site = self._startable(plan)
        self._arm()
        self._mission = Mission(run_id, plan, site, self.settings.model, recorder, self._now)
        self._paused = None
        recorder.begin(self._now, site, plan)
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
        self._require_mission()
        self._arm()
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
        if self._mission is not None:
            self._finish("paused", "The service was stopped before it was done.", wait=True)
        self._host.disarm()
        self._host.drive(0, 0, 0)
        self._host.pan(0)
        self._host.estop()
        self._write(now)
        self._port.close()
        self._sensor.close()

    # ---- the tick ----------------------------------------------------------------------------

    def step(self, now: float) -> Snapshot:
        """One tick at robot time ``now``."""
        dt = 0.0 if self._last_tick is None else now - self._last_tick
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
            self._mission.recorder.snapshot(snapshot)
        return snapshot

    def _sample(self, now: float) -> None:
        """Bytes and pictures that have come."""
        try:
            chunks = self._port.read()
            if self._port.generation != self._generation:
                self._generation = self._port.generation
                self._host.reset(now)
            for chunk in chunks:
                self._host.receive(chunk.data, chunk.stamp)
            if self._host.ready:
                self._clear_fault("link")
        except LinkError as error:
            self._host.port_lost(now, str(error))
            self._fault("link", str(error))
        for sample in self._host.samples():
            self._take_telemetry(sample)
        for event in self._host.events():
            level: Level = "info" if event.state in (LinkState.IDLE, LinkState.ARMED) else "warning"
            self._say(f"link_{event.code}", level, event.message)
        try:
            sighting = self._sensor.read()
            self._clear_fault("camera")
        except CameraError as error:
            sighting = None
            self._fault("camera", str(error))
        if sighting is not None and sighting.stamp >= self._looks_from:
            self._sighting = sighting
            self._waiting.append(sighting)

    def _take_telemetry(self, sample: TelemetrySample) -> None:
        previous = None if self._telemetry is None else self._telemetry.telemetry
        self._telemetry = sample
        telemetry = sample.telemetry
        if self._host.features & Features.PAN:
            angle = self.settings.model.pan.angle(telemetry.pan_adc)
            self._pan.add(PanReading(sample.stamp, angle))
        odometry = self.settings.calibration.to_odometry(
            telemetry, sample.stamp, previous, self._host.features
        )
        odometry = self._servo.follow(odometry)
        if odometry.speed != 0.0:
            self._last_moving = sample.stamp
        if self._localizer is not None:
            self._localizer.add_odometry(odometry)

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
        if localizer.status is Status.LOST and self._standing(now):
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
        localizer.add_measurements(measurements)
        if self._mission is not None:
            self._mission.recorder.sighting(sighting.stamp, measurements, sighting.frame)

    def _decide(self, now: float, dt: float) -> DriveCommand:
        """What the mission wants; standing still wherever that is in doubt."""
        mission = self._mission
        self._hold = ""
        self._target = None
        if mission is None:
            return STAND
        estimate = self._estimate
        if estimate is not None and estimate.status in (Status.TRACKING, Status.DEGRADED):
            self._was_fixed = True
            mission.observe(estimate.pose)
        self._target = mission.target
        self._watch_board(now)
        if self._paused is not None or self._host.state is not LinkState.ARMED:
            return STAND
        if estimate is None or estimate.status in (Status.FIXING, Status.LOST):
            return STAND
        step = mission.drive(now, dt, estimate, self._proximity())
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

    def _watch_board(self, now: float) -> None:
        """Whatever ends the arming ends the drive: it takes a person to go on."""
        state = self._host.state
        if state is LinkState.ARMED:
            self._armed = True
        elif self._paused is None and (self._armed or now - self._asked > ARMING_PATIENCE):
            self.pause(_DISARMED[state])

    def _act(self, now: float, wanted: DriveCommand) -> None:
        """The supervisor has the last word; then bytes go out."""
        self._verdict = self._supervisor.check(
            now, wanted, self._estimate, self._host.state, self._host.telemetry_age(now)
        )
        duty = self.settings.calibration.to_drive(
            self._verdict.command, self.settings.model.vehicle
        )
        self._host.drive(*duty)
        latest = self._pan.latest
        rate = 0.0
        if self._gaze is not None:
            between = None
            if self._estimate is not None and self._estimate.status is Status.TRACKING:
                between = self._gaze.between(now, self._estimate.pose, self._sweep.turns)
            rate = self._sweep.rate(None if latest is None else latest.angle, between)
        self._host.pan(round(1000 * rate))
        self._write(now)

    def _write(self, now: float) -> None:
        try:
            data = self._host.poll(now)
            if data:
                self._port.write(data)
        except LinkError as error:
            self._host.port_lost(now, str(error))
            self._fault("link", str(error))

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
            link=self._link_status(now),
            detections=() if sighting is None else sighting.detections,
            detections_stamp=None if sighting is None else sighting.stamp,
            mission=None if self._mission is None else self._mission.status(now),
            events=tuple(self._events),
            durations=(sample, locate, decide, act, publish),
        )

    # ---- small questions ---------------------------------------------------------------------

    def _state(self) -> tuple[State, str]:
        """One word and why."""
        localizer = self._localizer
        if self._host.state is LinkState.ESTOP:
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

    def _standing(self, now: float) -> bool:
        return now - self._last_moving > STANDING_AFTER

    def _proximity(self) -> Ranges:
        if self._telemetry is None or not self._host.features & Features.PROXIMITY:
            return (None, None, None)
        return self._telemetry.telemetry.ranges

    def _link_status(self, now: float) -> LinkStatus:
        statistics = self._host.statistics
        trip = statistics.best_round_trip_ms
        return LinkStatus(
            state=self._host.state.value,
            age=self._host.telemetry_age(now),
            sent=statistics.sent,
            lost=statistics.lost,
            crc_errors=statistics.crc_errors,
            round_trip=None if trip is None else trip / 1000,
        )

    def _startable(self, plan: Plan) -> Site:
        site = self._site
        if site is None:
            raise RefusedError("No map is loaded.", remedy="Choose one.", code="no_site")
        if len(site.landmarks) < 2:
            raise RefusedError(
                f"The site has {len(site.landmarks)} landmark(s), and the robot needs two to know "
                "where it is.",
                remedy="Place at least two landmarks.",
                code="no_landmarks",
            )
        if self._mission is not None:
            raise RefusedError(
                "A mission is already under way.", remedy="End it first.", code="mission_active"
            )
        if self._host.state is LinkState.ESTOP:
            raise RefusedError(
                "The emergency stop is latched.", remedy="Release it first.", code="estop_latched"
            )
        if not self._host.ready:
            raise RefusedError(
                "The microcontroller does not answer.",
                remedy="Check the cable and its power.",
                code="link_not_ready",
            )
        estimate = self._estimate
        if estimate is not None:
            distance = estimate.pose.distance_to((float(plan.path[0][0]), float(plan.path[0][1])))
            if distance > START_TOLERANCE:
                raise RefusedError(
                    f"The plan starts {distance:.2f} m from where the robot stands.",
                    remedy="Plan again from here.",
                    code="elsewhere",
                )
        return site

    def _arm(self) -> None:
        self._host.arm()
        self._armed = False
        self._asked = self._now

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
        self._mission = None
        self._paused = None
        if self.on_run_ended is not None:
            self.on_run_ended(summary)

    def _fault(self, source: str, text: str) -> None:
        """Say a lasting trouble once, not fifty times a second."""
        if self._faults.get(source) != text:
            self._faults[source] = text
            self._say(f"{source}_fault", "fault", text)

    def _clear_fault(self, source: str) -> None:
        self._faults.pop(source, None)

    def _say(self, code: str, level: Level, text: str) -> None:
        self._event_seq += 1
        event = Event(self._event_seq, self._now, code, level, text)
        self._events.append(event)
        if self._mission is not None:
            self._mission.recorder.event(event)
