"""What goes over the wire: every body of the REST interface and of the stream.

Metres, radians, seconds; places are ``[x, y]`` in `map`; poses are those of `base_link`. Stamps are
seconds of the robot's monotonic clock, ``wall`` and every ``*_at`` are seconds since 1970 (UTC).
The page's TypeScript types are generated from these models.
"""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import BaseModel, ConfigDict, Field, FiniteFloat

Coordinate = Annotated[float, Field(allow_inf_nan=False, ge=-100_000, le=100_000)]
Place = tuple[Coordinate, Coordinate]
StartPlace = Place | tuple[Coordinate, Coordinate, Coordinate]
Coordinates = list[list[list[Place]]]
"""Of a GeoJSON MultiPolygon: polygons, each a list of rings, the first of them the outer one."""
Id = Annotated[int, Field(ge=1, le=2**53 - 1)]
StrictId = Annotated[int, Field(strict=True, ge=1, le=2**53 - 1)]
"""In a body, where a number is a number: neither "1" nor true."""
Mode = Literal["scan", "route"]


class Model(BaseModel):
    """Base of what is answered."""

    model_config = ConfigDict(frozen=True)


class Request(BaseModel):
    """Base of what is asked: unknown fields are refused."""

    model_config = ConfigDict(frozen=True, extra="forbid")


class Problem(Model):
    """RFC 9457. ``code`` is stable and for programs, ``remedy`` says what to do next."""

    type: str
    title: str
    status: int
    detail: str
    code: str
    remedy: str = ""
    where: Place | None = None
    """The place on the map that the problem is about."""


# about


class VehicleModel(Model):
    wheelbase: float
    track: float
    body_radius: float
    max_steering: float
    max_speed: float
    max_acceleration: float
    tool_width: float
    clearance: float
    min_turn_radius: float
    plan_turn_radius: float


class CameraModel(Model):
    constant: float
    width: int
    height: int
    forward: float
    mount_height: float
    rate: float
    half_view: float


class PanModel(Model):
    minimum: float
    maximum: float
    rate: float


class ProximityModel(Model):
    angles: tuple[float, float, float]
    forward: float
    max_range: float
    hard_limit: float


class RobotModel(Model):
    vehicle: VehicleModel
    camera: CameraModel
    pan: PanModel
    proximity: ProximityModel


class About(Model):
    name: str
    version: str
    board: Literal["simulated", "host", "serial"]
    simulated: bool
    site_id: int | None
    """The site that the robot works on."""
    model: RobotModel


# sites


class LandmarkDocument(Model):
    id: int
    x: float
    y: float
    bits: int = 4
    segment: float = 0.05
    diameter: float = 0.07
    shape: Literal["cylinder", "flat"] = "cylinder"


class RouteDocument(Model):
    name: str
    nodes: list[Place]
    heading: float | None = None
    """How the robot is to stand at the last node; null: as it comes."""


class SiteDocument(Model):
    """SITE.json. Only ``boundary`` is required; rings do not repeat their first point."""

    name: str = ""
    boundary: list[Place]
    islands: list[list[Place]] = []
    walls: list[list[Place]] = []
    no_go: list[list[Place]] = []
    """Floor that is not to be driven on; landmarks are seen across it."""
    landmarks: list[LandmarkDocument] = []
    routes: list[RouteDocument] = []
    start: StartPlace | None = None


class SiteSummary(Model):
    id: int
    name: str
    version: int
    updated_at: float


class SiteRecord(Model):
    id: int
    version: int
    name: str
    updated_at: float
    repairs: list[str]
    """What was mended while reading the drawing."""
    site: SiteDocument


class SiteVersion(Model):
    version: int
    updated_at: float


class SiteProblem(Model):
    message: str
    where: Place | None
    code: str


class SiteCheck(Model):
    ok: bool
    problems: list[SiteProblem]
    repairs: list[str]


# plans


class PlanRequest(Request):
    """What is not given comes from the vehicle's settings."""

    site_id: StrictId
    mode: Mode
    route: Annotated[str, Field(max_length=200)] | None = None
    """Name of the route, for mode `route`."""
    tool_width: Annotated[FiniteFloat, Field(gt=0, le=100)] | None = None
    clearance: Annotated[FiniteFloat, Field(ge=0, le=100)] | None = None
    min_turn_radius: Annotated[FiniteFloat, Field(ge=0, le=1000)] | None = None
    start: StartPlace | None = None
    end_heading: Annotated[FiniteFloat, Field(ge=-1000, le=1000)] | None = None
    """How to stand at the last node, for mode `route`; not given: as the route says."""
    order: Literal["default", "paper"] | None = None
    pending_of: StrictId | None = None
    """Plan only what this run left uncovered, from where the robot stands now."""


class PlanPart(Model):
    kind: Literal["loop", "bridge", "link", "cleanup", "route"]
    first: int
    last: int


class Unreachable(Model):
    polygon: list[Place]
    reason: str


class Prediction(Model):
    coverage: float
    length: float
    duration: float
    reversals: int
    overlap: float = 0.0
    """Share of the strip under the tool that falls on floor which was swept before."""


class PlanRecord(Model):
    id: int
    site_id: int
    site_version: int
    mode: Mode
    route: str | None
    pending_of: int | None
    created_at: float
    tool_width: float
    clearance: float
    min_turn_radius: float
    area: Coordinates
    """What this plan is to sweep (scan mode)."""
    path: list[Place]
    gear: list[Literal[1, -1]]
    parts: list[PlanPart]
    unreachable: list[Unreachable]
    predicted: Prediction
    nodes: list[Place]
    notes: list[str]
    runtime: float


# missions and runs


class MissionRequest(Request):
    plan_id: StrictId


class RunRecord(Model):
    id: int
    site_id: int
    plan_id: int
    mode: Mode
    route: str | None
    started_at: float
    ended_at: float | None
    outcome: str | None
    """None while it runs; then done, paused (ended by hand), failed, or interrupted."""
    reason: str
    coverage: float | None
    travelled: float
    duration: float


class RunDetail(RunRecord):
    site_version: int
    missed: Coordinates
    """What is still to be swept."""
    plan: PlanRecord


Level = Literal["info", "warning", "fault"]


class TrackEvent(Model):
    t: float
    code: str
    level: Level
    text: str


class Track(Model):
    """A run's positions, thinned to at most 5,000 moments; lists of equal length share ``t``."""

    t: list[float]
    real: list[tuple[float, float, float] | None]
    """x, y, heading; simulation only."""
    estimated: list[tuple[float, float, float, float] | None]
    """x, y, heading, standard deviation of the position."""
    measured: list[tuple[float, float, float]]
    """t, x, y: as often as there was a measurement."""
    target: list[Place | None]
    events: list[TrackEvent]


# robot


class PoseModel(Model):
    x: float
    y: float
    heading: float
    stamp: float
    covariance: tuple[float, float, float, float, float, float]
    """xx, xy, xh, yy, yh, hh."""
    position_sigma: float
    heading_sigma: float
    status: Literal["fixing", "tracking", "degraded", "lost"]
    reason: str


class MeasuredModel(Model):
    stamp: float
    x: float
    y: float
    heading: float


class RealModel(Model):
    x: float
    y: float
    heading: float


class CommandModel(Model):
    speed: float
    steering: float


class LinkModel(Model):
    state: Literal["closed", "connecting", "idle", "armed", "link_lost", "estop"]
    age: float | None
    sent: int
    lost: int
    crc_errors: int
    round_trip: float | None


class DetectionModel(Model):
    id: int
    range: float
    bearing: float
    """From the optical axis, left positive."""
    column: float
    top: float
    bottom: float


class MissionModel(Model):
    run_id: int
    plan_id: int
    site_id: int
    mode: Mode
    route: str | None
    progress: float
    travelled: float
    length: float
    coverage: float | None
    swept_area: float | None
    missed_area: float | None
    eta: float | None
    elapsed: float
    pausing_reason: str


class LoopModel(Model):
    rate: float
    """Ticks per second."""
    lateness_p99: float
    """How much later than it should a tick begins, seconds, 99th percentile."""
    busy: float
    """Share of the time that the robot's thread works."""


class Disc(Model):
    x: float
    y: float
    radius: float


class EventModel(Model):
    seq: int
    stamp: float
    code: str
    level: Level
    text: str


class Snapshot(Model):
    """One message of the stream."""

    type: Literal["snapshot"]
    seq: int
    stamp: float
    wall: float
    state: Literal["idle", "fixing", "ready", "running", "paused", "stopped", "lost"]
    reason: str
    pose: PoseModel | None
    measured: MeasuredModel | None
    target: Place | None
    real: RealModel | None
    command: CommandModel
    pan: float | None
    proximity: tuple[float | None, float | None, float | None]
    battery: float | None
    link: LinkModel
    detections: list[DetectionModel]
    detections_stamp: float | None
    mission: MissionModel | None
    site_id: int | None
    loop: LoopModel
    obstacles: list[Disc]
    events: list[EventModel]


class SiteChoice(Request):
    site_id: StrictId


# simulation


class DiscRequest(Request):
    x: Coordinate
    y: Coordinate
    radius: Annotated[FiniteFloat, Field(gt=0, le=10)]


class SimulationRequest(Request):
    obstacles: Annotated[list[DiscRequest], Field(max_length=200)]


class Simulation(Model):
    obstacles: list[Disc]


class PlaceRequest(Request):
    x: Coordinate
    y: Coordinate
    heading: Annotated[FiniteFloat, Field(ge=-10, le=10)] = 0.0


class FeatureCollection(Model):
    """GeoJSON in local metres; the property ``role`` says what each feature is."""

    type: Literal["FeatureCollection"]
    name: str = ""
    features: list[dict[str, Any]]
