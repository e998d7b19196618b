"""The log of one run: an MCAP file with JSON messages, written while the robot drives.

Channels: ``robot``, ``site`` and ``plan`` once at the start, ``odometry`` per telemetry and
``sighting`` per picture (what the localizer was given, from some seconds before the start on),
``snapshot`` every tick (each computed position), ``picture`` (JPEG) once a second, ``event`` when
something happens, ``result`` at the end. A reader that streams the file gets everything up to a
power cut; `run_log` makes a recording of it that can be replayed.
"""

from __future__ import annotations

import base64
import json
import math
import os
import threading
import time
from collections.abc import Callable, Sequence
from dataclasses import asdict
from pathlib import Path
from queue import SimpleQueue
from typing import Any

import cv2
from mcap.writer import CompressionType, Writer

from polepilot.core.geometry import Pose2D
from polepilot.core.localization.localizer import LocalizerSettings
from polepilot.core.observation import Frame, Odometry, RangeBearing
from polepilot.core.plan import Plan
from polepilot.core.robot.snapshot import Event, Snapshot
from polepilot.core.site import Site
from polepilot.core.vehicle import RobotModel

CHUNK_BYTES = 32 * 1024
"""Small, so that little is lost with the last one."""
SYNC_PERIOD = 2.0
"""Seconds of robot time between two requests to put the log safely on the disk: a power cut loses
no more than this and a chunk."""
PICTURE_PERIOD = 1.0
"""Seconds between two recorded pictures."""

MOST_WAITING = 20_000
"""Messages (minutes of driving) that a stalled disk may be behind; then the log is given up."""

_Message = tuple[str, int, bytes]


class Recorder:
    """Writes a run's messages from a thread of its own, so that a slow disk never stops a tick."""

    def __init__(
        self,
        path: Path,
        *,
        wall_start: float = 0.0,
        stamp_start: float = 0.0,
        witness: Callable[[], Pose2D] | None = None,
        patient: bool = False,
    ) -> None:
        """Open ``path`` for a run that began at unix time ``wall_start``, robot time
        ``stamp_start``; robot stamps are kept in the messages' ``t``.

        ``witness`` tells the true pose, in simulation; the robot itself never sees it.
        ``patient``: whoever writes may be kept waiting by a slow disk, and power is of no concern,
        as in a simulation that runs faster than time; otherwise the log is given up first.
        """
        self._patient = patient
        self._path = path
        self._witness = witness
        self._offset = wall_start - stamp_start
        self._queue: SimpleQueue[_Message | None] = SimpleQueue()
        self._next_picture = -1.0
        self.error: Exception | None = None
        """Why the log is incomplete, once writing has failed (a full disk, say)."""
        path.parent.mkdir(parents=True, exist_ok=True)
        self._thread = threading.Thread(target=self._write_all, name="recorder", daemon=True)
        self._thread.start()

    def begin(
        self,
        stamp: float,
        site: Site,
        plan: Plan,
        model: RobotModel | None = None,
        localizer: LocalizerSettings | None = None,
    ) -> None:
        """What the run is about: map, plan, and the robot with what its localizer tolerates."""
        if model is not None:
            document = {name: asdict(getattr(model, name)) for name in ("vehicle", "camera", "pan")}
            document["localizer"] = asdict(localizer or LocalizerSettings())
            self._put("robot", stamp, document)
        self._put("site", stamp, site.to_json())
        self._put("plan", stamp, {"mode": plan.mode, **plan.to_json()})

    def snapshot(self, snapshot: Snapshot) -> None:
        """One tick."""
        truth = None if self._witness is None else self._witness()
        estimate, measured = snapshot.estimate, snapshot.measured
        mission = snapshot.mission
        self._put(
            "snapshot",
            snapshot.stamp,
            {
                "t": _round(snapshot.stamp),
                "state": snapshot.state,
                "reason": snapshot.reason,
                "estimated": None
                if estimate is None
                else [*_pose(estimate.pose), _round(estimate.position_sigma)],
                "covariance": None
                if estimate is None
                else [float(f"{value:.4g}") for value in estimate.covariance[_UPPER]],
                "measured": None
                if measured is None
                else [_round(measured.stamp), *_pose(measured.pose)],
                "target": None if snapshot.target is None else [_round(v) for v in snapshot.target],
                "real": None if truth is None else _pose(truth),
                "command": [_round(snapshot.command.speed), _round(snapshot.command.steering)],
                "pan": None if snapshot.pan is None else _round(snapshot.pan),
                "proximity": snapshot.proximity,
                "progress": None if mission is None else _round(mission.progress),
                "coverage": None if mission is None else mission.coverage,
            },
        )

    def odometry(self, odometry: Odometry, pan: float | None) -> None:
        """How the robot moves from ``odometry.stamp`` on, as the localizer was told; the pan angle
        of that moment where it is known."""
        document = {
            "t": _fine(odometry.stamp),
            "speed": _fine(odometry.speed),
            "steering": _fine(odometry.steering),
            "pan": None if pan is None else _fine(pan),
        }
        self._put("odometry", odometry.stamp, document)

    def sighting(
        self,
        stamp: float,
        measurements: Sequence[RangeBearing],
        frame: Frame | None,
        pan: float | None = None,
    ) -> None:
        """What one picture gave, nothing included, and now and then the picture itself.

        ``pan``: where the camera pointed; it tells what was not seen, too.
        """
        document = {
            "t": _fine(stamp),
            "pan": None if pan is None else _fine(pan),
            "measurements": [_measured(m) for m in measurements],
        }
        self._put("sighting", stamp, document)
        if frame is not None:
            self.picture(frame)

    def picture(self, frame: Frame) -> None:
        """A picture, unless one was kept a moment ago."""
        if frame.stamp < self._next_picture:
            return
        self._next_picture = frame.stamp + PICTURE_PERIOD
        done, jpeg = cv2.imencode(".jpg", frame.image, [cv2.IMWRITE_JPEG_QUALITY, 80])
        if done:
            data = base64.b64encode(jpeg.tobytes()).decode("ascii")
            document = {"t": _round(frame.stamp), "format": "jpeg", "data": data}
            self._put("picture", frame.stamp, document)

    def event(self, event: Event) -> None:
        """Something that happened."""
        document = {
            "t": _round(event.stamp),
            "code": event.code,
            "level": event.level,
            "text": event.text,
        }
        self._put("event", event.stamp, document)

    def result(self, stamp: float, document: dict[str, Any]) -> None:
        """How the run ended."""
        self._put("result", stamp, document)

    def close(self, *, wait: bool = True) -> None:
        """Write what is still queued and finish the file, in the background if not ``wait``."""
        self._queue.put(None)
        if wait:
            self._thread.join()

    def _put(self, channel: str, stamp: float, document: dict[str, Any]) -> None:
        while self._patient and self.error is None and self._queue.qsize() > MOST_WAITING:
            time.sleep(0.01)
        if self._queue.qsize() > MOST_WAITING:
            self.error = self.error or OSError("the disk does not keep up")
        if self.error is None:
            data = json.dumps(document, separators=(",", ":")).encode()
            self._queue.put((channel, max(0, int((stamp + self._offset) * 1e9)), data))

    def _write_all(self) -> None:
        try:
            with self._path.open("wb") as file:
                writer = Writer(file, chunk_size=CHUNK_BYTES, compression=CompressionType.ZSTD)
                writer.start(profile="", library="polepilot")
                channels: dict[str, int] = {}
                synced = 0
                while (message := self._queue.get()) is not None:
                    name, nanoseconds, data = message
                    if name not in channels:
                        schema = writer.register_schema(name, "jsonschema", b'{"type":"object"}')
                        channels[name] = writer.register_channel(name, "json", schema)
                    writer.add_message(channels[name], nanoseconds, data, nanoseconds)
                    if not self._patient and nanoseconds - synced > SYNC_PERIOD * 1e9:
                        synced = nanoseconds
                        file.flush()
                        os.fdatasync(file.fileno())
                writer.finish()  # type: ignore[no-untyped-call]
        except Exception as error:  # noqa: BLE001 - the robot drives on, and says so
            self.error = error


_UPPER = ([0, 0, 0, 1, 1, 2], [0, 1, 2, 1, 2, 2])


def _measured(measurement: RangeBearing) -> dict[str, Any]:
    """JSON has no infinity: a range that is not known is null."""
    ranged = math.isfinite(measurement.range) and math.isfinite(measurement.range_sigma)
    return {
        "landmark": measurement.landmark,
        "range": _fine(measurement.range) if ranged else None,
        "bearing": _fine(measurement.bearing),
        "range_sigma": float(f"{measurement.range_sigma:.4g}") if ranged else None,
        "bearing_sigma": float(f"{measurement.bearing_sigma:.4g}"),
        "pan": None if measurement.pan is None else _fine(measurement.pan),
    }


def _fine(value: float) -> float:
    """What a replay begins from is kept to a millionth."""
    return round(float(value), 6)


def _round(value: float) -> float:
    return round(float(value), 4)


def _pose(pose: Pose2D) -> list[float]:
    return [_round(pose.x), _round(pose.y), _round(pose.heading)]
