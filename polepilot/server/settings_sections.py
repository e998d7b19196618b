"""The sections of robot.toml: every key with its default, range, unit and meaning.

Defaults come from the core's own, which describe the simulated robot. The documentation's table and
robot.example.toml are held against these classes by tests.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Annotated, Any, Literal

from pydantic import BaseModel, ConfigDict, Field, model_validator

from polepilot.core.control.supervisor import Limits
from polepilot.core.errors import ConfigError, InputError
from polepilot.core.link.calibration import DriveCalibration
from polepilot.core.link.usb import PortAddress
from polepilot.core.localization.localizer import LocalizerSettings as Localization
from polepilot.core.vehicle import Camera, PanUnit, Proximity, Vehicle
from polepilot.core.vision.lens import Lens
from polepilot.core.vision.paint import COLOURS, EXPECTED, ORANGE, Paint
from polepilot.server.settings_errors import refusal

_VEHICLE, _CAMERA, _PAN, _PROXIMITY = Vehicle(), Camera(), PanUnit(), Proximity()
_LOCALIZER = Localization()
_DRIVE, _LIMITS = DriveCalibration(), Limits()
_MOST_DISTORTION = 100.0
"""A coefficient beyond this belongs to no lens."""

Pair = Annotated[tuple[float, float], Field(strict=False)]
Quintuple = Annotated[tuple[float, float, float, float, float], Field(strict=False)]
Triple = Annotated[tuple[float, float, float], Field(strict=False)]


class Section(BaseModel):
    """One table of the file: strict types (no "400" for 400), no unknown key, no inf or nan."""

    model_config = ConfigDict(extra="forbid", frozen=True, strict=True, allow_inf_nan=False)


class CameraSettings(Section):
    """Where pictures come from, and the lens."""

    source: int | str = Field(
        default="simulated",
        description='"simulated", a device (0 or "/dev/video0"), an rtsp:// or http:// address, '
        "a video file or a folder of pictures",
    )
    constant_px: float = Field(
        default=_CAMERA.constant,
        gt=1,
        description="camera constant for width x height pictures, pixels",
    )
    width: int = Field(default=_CAMERA.width, ge=32, le=8192, description="columns of a picture")
    height: int = Field(default=_CAMERA.height, ge=32, le=8192, description="rows of a picture")
    center: Pair = Field(
        default=(_CAMERA.center_x, _CAMERA.center_y),
        description="column and row of the optical axis; without it the middle of the picture",
    )
    distortion: Quintuple = Field(
        default=(0.0, 0.0, 0.0, 0.0, 0.0),
        description="of the lens, from calibration: k1, k2, p1, p2, k3 in OpenCV's order; the "
        "simulated camera has an ideal lens",
    )
    forward_m: float = Field(
        default=_CAMERA.forward,
        ge=-10,
        le=10,
        description="pan axis ahead of the rear axle, metres",
    )
    height_m: float = Field(
        default=_CAMERA.mount_height, gt=0, le=10, description="lens above the floor, metres"
    )
    rate_hz: float = Field(
        default=_CAMERA.rate, gt=0, le=240, description="pictures per second asked for"
    )
    capture_width: int = Field(
        default=1600,
        ge=32,
        le=8192,
        description="columns asked of a device; the picture is averaged down from these",
    )
    capture_height: int = Field(default=1200, ge=32, le=8192, description="rows asked of a device")
    latency_s: float = Field(
        default=0.02,
        ge=-0.1,
        le=5,
        description="from mid exposure to the picture's time stamp, seconds; a device's driver "
        "stamps it, from elsewhere it is stamped when it arrives",
    )
    autofocus: bool = Field(
        default=False, description="of a device; moves the lens, and the camera constant with it"
    )
    focus: int = Field(
        default=-1,
        ge=-1,
        le=65535,
        description="where a device's lens stands, in its driver's units; -1 leaves it",
    )
    exposure_s: float = Field(
        default=0.0, ge=0, le=1, description="of a device, seconds; 0 is automatic"
    )
    white_balance_k: int = Field(
        default=0, ge=0, le=20000, description="of a device, kelvin; 0 is automatic"
    )

    @model_validator(mode="before")
    @classmethod
    def _center_follows_size(cls, data: Any) -> Any:
        if isinstance(data, Mapping) and "center" not in data:
            width = data.get("width", _CAMERA.width)
            height = data.get("height", _CAMERA.height)
            if isinstance(width, int) and isinstance(height, int):
                return {**data, "center": ((width - 1) / 2, (height - 1) / 2)}
        return data

    @model_validator(mode="after")
    def _fits_together(self) -> CameraSettings:
        if not (0 <= self.center[0] < self.width and 0 <= self.center[1] < self.height):
            raise refusal(
                "center", list(self.center), f"a place inside {self.width}x{self.height} pixels"
            )
        if max(map(abs, self.distortion)) > _MOST_DISTORTION or not self._lens_covers_picture():
            raise refusal(
                "distortion",
                list(self.distortion),
                "a lens that shows each direction once; see docs/calibration.md",
            )
        if isinstance(self.source, int) and self.source < 0:
            raise refusal("source", self.source, "a device number of 0 or more")
        if self.autofocus and self.focus >= 0:
            raise refusal("focus", self.focus, "-1, because camera.autofocus moves the lens")
        if self.source == "":
            raise refusal("source", self.source, '"simulated", a device, an address or a file')
        return self

    def _lens_covers_picture(self) -> bool:
        camera = Camera(
            constant=self.constant_px,
            width=self.width,
            height=self.height,
            center_x=self.center[0],
            center_y=self.center[1],
        )
        return Lens(*self.distortion).covers(camera)


class PanSettings(Section):
    """The motor that turns the camera, and its potentiometer."""

    minimum_rad: float = Field(
        default=_PAN.minimum, ge=-math.tau, le=math.tau, description="end at the right, radians"
    )
    maximum_rad: float = Field(
        default=_PAN.maximum, ge=-math.tau, le=math.tau, description="end at the left, radians"
    )
    rate_rad_s: float = Field(
        default=_PAN.rate, gt=0, le=100, description="rate at full duty, radians per second"
    )
    sweep_duty: float = Field(
        default=_PAN.sweep_duty, gt=0, le=1, description="share of the full duty while sweeping"
    )
    adc_at_minimum: int = Field(
        default=_PAN.adc_at_minimum,
        ge=0,
        le=65535,
        description="potentiometer counts at minimum_rad",
    )
    adc_at_maximum: int = Field(
        default=_PAN.adc_at_maximum,
        ge=0,
        le=65535,
        description="potentiometer counts at maximum_rad",
    )

    @model_validator(mode="after")
    def _fits_together(self) -> PanSettings:
        if self.minimum_rad >= self.maximum_rad:
            raise refusal(
                "minimum_rad", self.minimum_rad, f"less than maximum_rad ({self.maximum_rad})"
            )
        if self.adc_at_minimum == self.adc_at_maximum:
            raise refusal(
                "adc_at_maximum", self.adc_at_maximum, "another number than adc_at_minimum"
            )
        return self


class VehicleSettings(Section):
    """Wheels and body, and what plans use where nobody says otherwise."""

    wheelbase_m: float = Field(
        default=_VEHICLE.wheelbase, gt=0, le=10, description="rear axle to front axle, metres"
    )
    track_m: float = Field(
        default=_VEHICLE.track, gt=0, le=10, description="between the rear wheels, metres"
    )
    body_radius_m: float = Field(
        default=_VEHICLE.body_radius,
        gt=0,
        le=20,
        description="disc around the middle of the rear axle that holds the whole body, metres",
    )
    max_steering_rad: float = Field(
        default=_VEHICLE.max_steering,
        gt=0,
        lt=math.pi / 2,
        description="of the virtual front wheel to either side, radians",
    )
    steering_rate_rad_s: float = Field(
        default=_VEHICLE.steering_rate,
        gt=0,
        description="how fast the servo turns, radians per second",
    )
    max_speed_m_s: float = Field(
        default=_VEHICLE.max_speed, gt=0, le=10, description="metres per second, at most"
    )
    max_acceleration_m_s2: float = Field(
        default=_VEHICLE.max_acceleration,
        gt=0,
        le=50,
        description="metres per second squared, at most",
    )
    tool_width_m: float = Field(
        default=_VEHICLE.tool_width,
        gt=0,
        le=20,
        description="width of the strip that one pass covers",
    )
    clearance_m: float = Field(
        default=_VEHICLE.clearance,
        ge=0,
        le=20,
        description="how near the path may come to a wall, metres",
    )
    turn_radius_margin: float = Field(
        default=_VEHICLE.turn_radius_margin,
        ge=1,
        le=20,
        description="plans turn no tighter than this times the tightest turn",
    )

    @model_validator(mode="after")
    def _fits_together(self) -> VehicleSettings:
        if self.clearance_m < self.body_radius_m:
            raise refusal(
                "clearance_m",
                self.clearance_m,
                f"at least body_radius_m ({self.body_radius_m}), or the body touches walls",
            )
        return self


class LandmarkSettings(Section):
    """How landmarks are read in pictures. Their ids, places and sizes belong to each site."""

    detector: Literal["default", "paper"] = Field(
        default="default", description='"default", or "paper" for the source paper\'s method'
    )
    bright: str = Field(
        default="orange",
        description="colour of the bright segments, with black between them: a name "
        f'({", ".join(COLOURS)}) or "#rrggbb"; "white" for cameras that see no colour',
    )

    @model_validator(mode="after")
    def _fits_together(self) -> LandmarkSettings:
        try:
            paint = Paint.parse(self.bright)
        except InputError as error:
            raise refusal("bright", self.bright, EXPECTED) from error
        if self.detector == "paper" and paint != ORANGE:
            raise refusal("bright", self.bright, '"orange", because landmark.detector is "paper"')
        return self


class LinkSettings(Section):
    """The line to the microcontroller."""

    board: Literal["simulated", "host", "serial"] = Field(
        default="simulated",
        description='"simulated", "serial" for a board on USB, or "host": simulated, but with the '
        "firmware's C code as its microcontroller",
    )
    port: str = Field(
        default="",
        description='"/dev/polepilot" or another path, or VID:PID[:SERIAL] in hexadecimal such as '
        '"0403:6001"',
    )
    baud_rate: int = Field(default=115200, ge=1200, le=4_000_000, description="bits per second")

    @model_validator(mode="after")
    def _fits_together(self) -> LinkSettings:
        if self.board == "serial" and not self.port:
            raise refusal("port", self.port, 'a serial port, because link.board is "serial"')
        if self.port:
            try:
                PortAddress.parse(self.port)
            except ConfigError:
                raise refusal(
                    "port", self.port, 'a path such as "/dev/polepilot", or VID:PID in hexadecimal'
                ) from None
        return self


class DriveSettings(Section):
    """How duty becomes speed and servo angle becomes steering: this robot's calibration."""

    full_speed_left_m_s: float = Field(
        default=_DRIVE.full_speed_left,
        gt=0,
        le=20,
        description="speed of the left wheel at full duty, metres per second",
    )
    full_speed_right_m_s: float = Field(
        default=_DRIVE.full_speed_right,
        gt=0,
        le=20,
        description="the same for the right wheel; a difference is the trim",
    )
    dead_band: float = Field(
        default=_DRIVE.dead_band,
        ge=0,
        lt=1,
        description="share of the full duty below which the wheels stand",
    )
    servo_center_rad: float = Field(
        default=_DRIVE.servo_center,
        ge=-1.5,
        le=1.5,
        description="servo angle that drives straight, radians",
    )
    servo_scale: float = Field(
        default=_DRIVE.servo_scale,
        ge=-10,
        le=10,
        description="servo angle per steering angle; negative where the servo is mirrored",
    )
    servo_limit_rad: float = Field(
        default=_DRIVE.servo_limit,
        gt=0,
        lt=math.pi / 2,
        description="largest servo angle to either side, radians",
    )
    counts_per_m: float = Field(
        default=_DRIVE.counts_per_metre,
        ge=0,
        description="wheel encoder counts per metre; 0 without encoders",
    )

    @model_validator(mode="after")
    def _fits_together(self) -> DriveSettings:
        if abs(self.servo_center_rad) >= self.servo_limit_rad:
            raise refusal(
                "servo_center_rad",
                self.servo_center_rad,
                f"within servo_limit_rad ({self.servo_limit_rad})",
            )
        if self.servo_scale == 0:
            raise refusal("servo_scale", self.servo_scale, "another number than 0")
        return self


class LocalizerSettings(Section):
    """How the pose is found."""

    method: Literal["ekf", "paper"] = Field(default="ekf", description='"ekf", or "paper"')
    tolerance_m: float = Field(
        default=_LOCALIZER.tolerance,
        gt=0,
        le=10,
        description="a contradiction beyond this stops the robot to fix its pose anew, metres",
    )
    degraded_after_s: float = Field(
        default=_LOCALIZER.degraded_after,
        gt=0,
        le=600,
        description="driving this long without a correction: the pose counts as degraded, seconds",
    )
    lost_after_s: float = Field(
        default=_LOCALIZER.lost_after,
        gt=0,
        le=600,
        description="driving this long without a correction: the pose counts as lost, seconds",
    )
    lost_sigma_m: float = Field(
        default=_LOCALIZER.lost_sigma,
        gt=0,
        le=10,
        description="position known no better than this (standard deviation): lost, metres",
    )

    @model_validator(mode="after")
    def _fits_together(self) -> LocalizerSettings:
        if self.lost_after_s < self.degraded_after_s:
            raise refusal(
                "lost_after_s",
                self.lost_after_s,
                f"at least degraded_after_s ({self.degraded_after_s})",
            )
        return self


class LimitSettings(Section):
    """What the supervisor does not let pass, whoever asks for it."""

    max_speed_m_s: float = Field(
        default=_LIMITS.max_speed, gt=0, le=10, description="metres per second, at most"
    )
    max_estimate_age_s: float = Field(
        default=_LIMITS.max_estimate_age,
        gt=0,
        le=10,
        description="stand when the pose estimate is older, seconds",
    )
    max_link_age_s: float = Field(
        default=_LIMITS.max_link_age,
        gt=0,
        le=5,
        description="stand when the last telemetry is older, seconds",
    )
    max_position_sigma_m: float = Field(
        default=_LIMITS.max_position_sigma,
        gt=0,
        le=10,
        description="stand when the position is known no better (standard deviation), metres",
    )
    degraded_share: float = Field(
        default=_LIMITS.degraded_share,
        gt=0,
        le=1,
        description="share of the speed that is left while the pose is degraded",
    )


class ProximitySettings(Section):
    """The three range sensors at the front."""

    angles_rad: Triple = Field(
        default=_PROXIMITY.angles, description="directions of left, centre, right sensor, radians"
    )
    forward_m: float = Field(
        default=_PROXIMITY.forward,
        ge=-10,
        le=10,
        description="sensors ahead of the rear axle, metres",
    )
    max_range_m: float = Field(
        default=_PROXIMITY.max_range, gt=0, le=50, description="farthest reading, metres"
    )
    hard_limit_m: float = Field(
        default=_PROXIMITY.hard_limit,
        ge=0,
        le=5,
        description="nearer than this the firmware stops forward motion by itself, metres",
    )

    @model_validator(mode="after")
    def _fits_together(self) -> ProximitySettings:
        if self.hard_limit_m >= self.max_range_m:
            raise refusal(
                "hard_limit_m", self.hard_limit_m, f"less than max_range_m ({self.max_range_m})"
            )
        left, centre, right = self.angles_rad
        if not math.pi >= left > centre > right >= -math.pi:
            raise refusal(
                "angles_rad", list(self.angles_rad), "left, centre, right: falling, within one turn"
            )
        return self


class SimulationSettings(Section):
    """How imperfect the simulated robot is. Nothing here touches real hardware."""

    seed: int = Field(default=1, ge=0, le=2**32 - 1, description="of all chance in the simulation")
    sensing: Literal["rendered", "measured"] = Field(
        default="rendered",
        description='"rendered" pictures go through the detector; "measured" draws range and '
        "bearing from its error model",
    )
    imperfection: float = Field(
        default=1.0,
        ge=0,
        le=5,
        description="factor on speed and steering errors, slip and lag; 0 is a robot that does "
        "exactly what it is told",
    )


class ServerSettings(Section):
    """The web service. It listens on 127.0.0.1 alone."""

    port: int = Field(default=8000, ge=0, le=65535, description="TCP port; 0 takes a free one")
    data: str = Field(
        default="",
        description='folder for sites, plans and logs; "" is the usual place of the system',
    )
    panel: bool = Field(default=True, description="serve the 3D panel under /viser/")
