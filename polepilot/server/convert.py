"""Between the core's nouns and the documents of the interface."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import shapely
from shapely import MultiPolygon, Polygon

from polepilot.core.geometry import Pose2D
from polepilot.core.plan import Plan, PlanPart, Prediction, Unreachable
from polepilot.core.robot.snapshot import Snapshot
from polepilot.core.vehicle import RobotModel
from polepilot.server.store import PlanRow, RunRow


@dataclass(frozen=True, slots=True)
class Job:
    """What the server knows of the mission that the robot is on."""

    run_id: int
    plan_id: int
    site_id: int
    route: str | None


@dataclass(frozen=True, slots=True)
class Loop:
    """How well the robot's thread keeps its time."""

    rate: float = 0.0
    lateness_p99: float = 0.0
    busy: float = 0.0


@dataclass(frozen=True, slots=True)
class Surroundings:
    """What a snapshot's document holds besides the robot's own view."""

    wall: float
    loop: Loop = Loop()
    real: Pose2D | None = None
    obstacles: tuple[tuple[float, float, float], ...] = ()
    site_id: int | None = None
    job: Job | None = None


def snapshot_document(snapshot: Snapshot, around: Surroundings) -> dict[str, Any]:
    """The stream's message (schemas.Snapshot)."""
    real = around.real
    return {
        "type": "snapshot",
        "seq": snapshot.seq,
        "stamp": round(snapshot.stamp, 4),
        "wall": round(around.wall, 3),
        "state": snapshot.state.value,
        "reason": snapshot.reason,
        "pose": _pose(snapshot),
        "measured": _measured(snapshot),
        "target": None if snapshot.target is None else [_r(v) for v in snapshot.target],
        "real": None
        if real is None
        else {"x": _r(real.x), "y": _r(real.y), "heading": _r(real.heading)},
        "command": {
            "speed": _r(snapshot.command.speed),
            "steering": _r(snapshot.command.steering),
        },
        "pan": _maybe(snapshot.pan),
        "proximity": [_maybe(value) for value in snapshot.proximity],
        "battery": _maybe(snapshot.battery),
        "link": {
            "state": snapshot.link.state,
            "age": _maybe(snapshot.link.age),
            "sent": snapshot.link.sent,
            "lost": snapshot.link.lost,
            "crc_errors": snapshot.link.crc_errors,
            "round_trip": _maybe(snapshot.link.round_trip),
        },
        "detections": [
            {
                "id": d.id,
                "range": _r(d.range),
                "bearing": _r(d.bearing),
                "column": _r(d.column),
                "top": _r(d.top),
                "bottom": _r(d.bottom),
            }
            for d in snapshot.detections
        ],
        "detections_stamp": _maybe(snapshot.detections_stamp),
        "mission": _mission(snapshot, around.job),
        "site_id": around.site_id,
        "loop": {
            "rate": round(around.loop.rate, 2),
            "lateness_p99": round(around.loop.lateness_p99, 5),
            "busy": round(around.loop.busy, 4),
        },
        "obstacles": [{"x": _r(x), "y": _r(y), "radius": _r(r)} for x, y, r in around.obstacles],
        "events": [
            {
                "seq": event.seq,
                "stamp": _r(event.stamp),
                "code": event.code,
                "level": event.level,
                "text": event.text,
            }
            for event in snapshot.events
        ],
    }


def model_document(model: RobotModel) -> dict[str, Any]:
    """The vehicle as the page needs to know it (schemas.RobotModel)."""
    vehicle, camera, pan, proximity = model.vehicle, model.camera, model.pan, model.proximity
    return {
        "vehicle": {
            "wheelbase": vehicle.wheelbase,
            "track": vehicle.track,
            "body_radius": vehicle.body_radius,
            "max_steering": vehicle.max_steering,
            "max_speed": vehicle.max_speed,
            "max_acceleration": vehicle.max_acceleration,
            "tool_width": vehicle.tool_width,
            "clearance": vehicle.clearance,
            "min_turn_radius": vehicle.min_turn_radius,
            "plan_turn_radius": vehicle.plan_turn_radius,
        },
        "camera": {
            "constant": camera.constant,
            "width": camera.width,
            "height": camera.height,
            "forward": camera.forward,
            "mount_height": camera.mount_height,
            "rate": camera.rate,
            "half_view": camera.half_view,
        },
        "pan": {"minimum": pan.minimum, "maximum": pan.maximum, "rate": pan.rate},
        "proximity": {
            "angles": list(proximity.angles),
            "forward": proximity.forward,
            "max_range": proximity.max_range,
            "hard_limit": proximity.hard_limit,
        },
    }


def plan_document(plan: Plan) -> dict[str, Any]:
    """What is kept of a plan; ``plan_of`` reads it."""
    return {
        "tool_width": plan.tool_width,
        "clearance": plan.clearance,
        "min_turn_radius": plan.min_turn_radius,
        "area": coordinates_of(plan.area),
        **plan.to_json(),
    }


def plan_of(row: PlanRow) -> Plan:
    """The plan that was kept, to be driven."""
    document = row.document
    return Plan(
        mode=row.mode,
        path=np.array(document["path"], dtype=np.float64),
        gear=np.array(document["gear"], dtype=np.int8),
        parts=tuple(PlanPart(**part) for part in document["parts"]),
        unreachable=tuple(
            Unreachable(tuple((x, y) for x, y in entry["polygon"]), entry["reason"])
            for entry in document["unreachable"]
        ),
        predicted=Prediction(**document["predicted"]),
        tool_width=document["tool_width"],
        clearance=document["clearance"],
        min_turn_radius=document["min_turn_radius"],
        area=multipolygon_of(document["area"]),
        nodes=tuple((x, y) for x, y in document["nodes"]),
        notes=tuple(document["notes"]),
        runtime=document["runtime"],
    )


def plan_record(row: PlanRow) -> dict[str, Any]:
    """The answer about a plan (schemas.PlanRecord)."""
    return {
        "id": row.id,
        "site_id": row.site_id,
        "site_version": row.site_version,
        "mode": row.mode,
        "route": row.route,
        "pending_of": row.pending_of,
        "created_at": row.created_at,
        **row.document,
    }


def run_record(row: RunRow) -> dict[str, Any]:
    """The answer about a run (schemas.RunRecord)."""
    return {
        "id": row.id,
        "site_id": row.site_id,
        "plan_id": row.plan_id,
        "mode": row.mode,
        "route": row.route,
        "started_at": row.started_at,
        "ended_at": row.ended_at,
        "outcome": row.outcome,
        "reason": row.reason,
        "coverage": row.coverage,
        "travelled": row.travelled,
        "duration": row.duration,
    }


def coordinates_of(area: MultiPolygon) -> list[Any]:
    """GeoJSON coordinates of an area, to a tenth of a millimetre."""
    return [
        [
            [[_r(x), _r(y)] for x, y in np.asarray(ring.coords)[:, :2].tolist()]
            for ring in (polygon.exterior, *polygon.interiors)
        ]
        for polygon in area.geoms
    ]


def multipolygon_of(coordinates: Sequence[Any]) -> MultiPolygon:
    """The area of GeoJSON coordinates; what rounding has made invalid is mended."""
    polygons = [Polygon(rings[0], rings[1:]) for rings in coordinates]
    area = MultiPolygon(polygons)
    if area.is_valid:
        return area
    mended = shapely.union_all([shapely.make_valid(polygon) for polygon in polygons])
    parts = shapely.get_parts(shapely.get_parts(mended))
    return MultiPolygon([part for part in parts if isinstance(part, Polygon)])


def _pose(snapshot: Snapshot) -> dict[str, Any] | None:
    estimate = snapshot.estimate
    if estimate is None:
        return None
    c = estimate.covariance
    if not (np.isfinite(c).all() and all(map(math.isfinite, estimate.pose))):
        return None
    return {
        "x": _r(estimate.pose.x),
        "y": _r(estimate.pose.y),
        "heading": _r(estimate.pose.heading),
        "stamp": _r(estimate.stamp),
        "covariance": [
            _significant(v) for v in (c[0, 0], c[0, 1], c[0, 2], c[1, 1], c[1, 2], c[2, 2])
        ],
        "position_sigma": _significant(estimate.position_sigma),
        "heading_sigma": _significant(estimate.heading_sigma),
        "status": estimate.status.value,
        "reason": estimate.reason,
    }


def _measured(snapshot: Snapshot) -> dict[str, Any] | None:
    measured = snapshot.measured
    if measured is None:
        return None
    pose = measured.pose
    return {
        "stamp": _r(measured.stamp),
        "x": _r(pose.x),
        "y": _r(pose.y),
        "heading": _r(pose.heading),
    }


def _mission(snapshot: Snapshot, job: Job | None) -> dict[str, Any] | None:
    mission = snapshot.mission
    if mission is None or job is None or job.run_id != mission.run_id:
        return None
    return {
        "run_id": mission.run_id,
        "plan_id": job.plan_id,
        "site_id": job.site_id,
        "mode": mission.mode,
        "route": job.route,
        "progress": _r(mission.progress),
        "travelled": _r(mission.travelled),
        "length": _r(mission.length),
        "coverage": _maybe(mission.coverage),
        "swept_area": _maybe(mission.swept_area),
        "missed_area": _maybe(mission.missed_area),
        "eta": _maybe(mission.eta),
        "elapsed": _r(mission.elapsed),
        "pausing_reason": snapshot.reason if snapshot.state.value != "running" else "",
    }


def _r(value: float) -> float:
    """To a tenth of a millimetre; JSON knows no infinity, so what is not finite becomes 0."""
    value = float(value)
    return round(value, 4) if math.isfinite(value) else 0.0


def _maybe(value: float | None) -> float | None:
    return None if value is None or not math.isfinite(value) else round(float(value), 4)


def _significant(value: float) -> float:
    value = float(value)
    return float(f"{value:.4g}") if math.isfinite(value) else 0.0
