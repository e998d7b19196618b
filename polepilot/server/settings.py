"""robot.toml: one file that says what this robot is.

Every key has a default, which is the simulated robot, so an absent file is a valid one. Names carry
their unit; everything is SI (radians, not degrees) because other programs read this file too.
What cannot be used is refused with one line: file, line number, key, what was read, what was
expected.
"""

from __future__ import annotations

import dataclasses
import tomllib
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from pydantic import ValidationError, model_validator

from polepilot.core.control.supervisor import Limits
from polepilot.core.errors import ConfigError
from polepilot.core.link.calibration import DriveCalibration
from polepilot.core.link.usb import PortAddress
from polepilot.core.localization.localizer import LocalizerSettings as Localization
from polepilot.core.robot.robot import RobotSettings
from polepilot.core.sim.motion import Disturbances
from polepilot.core.vehicle import Camera, PanUnit, Proximity, RobotModel, Vehicle
from polepilot.core.vision.devices import CameraControls
from polepilot.core.vision.paint import Paint
from polepilot.server.settings_errors import explain_syntax, explain_validation, refusal
from polepilot.server.settings_sections import (
    CameraSettings,
    DriveSettings,
    LandmarkSettings,
    LimitSettings,
    LinkSettings,
    LocalizerSettings,
    PanSettings,
    ProximitySettings,
    Section,
    ServerSettings,
    SimulationSettings,
    VehicleSettings,
)


class Settings(Section):
    """The whole of robot.toml."""

    camera: CameraSettings = CameraSettings()
    pan: PanSettings = PanSettings()
    vehicle: VehicleSettings = VehicleSettings()
    landmark: LandmarkSettings = LandmarkSettings()
    link: LinkSettings = LinkSettings()
    drive: DriveSettings = DriveSettings()
    localizer: LocalizerSettings = LocalizerSettings()
    limits: LimitSettings = LimitSettings()
    proximity: ProximitySettings = ProximitySettings()
    simulation: SimulationSettings = SimulationSettings()
    server: ServerSettings = ServerSettings()

    @model_validator(mode="after")
    def _fits_together(self) -> Settings:
        if self.camera.source == "simulated" and self.link.board == "serial":
            raise refusal(
                "camera.source", "simulated", 'a real camera, because link.board is "serial"'
            )
        if self.camera.source != "simulated" and self.link.board != "serial":
            raise refusal(
                "camera.source",
                self.camera.source,
                f'"simulated", as long as link.board is "{self.link.board}"',
            )
        return self

    @property
    def model(self) -> RobotModel:
        """The robot's body as the core knows it."""
        return RobotModel(
            vehicle=Vehicle(
                wheelbase=self.vehicle.wheelbase_m,
                track=self.vehicle.track_m,
                body_radius=self.vehicle.body_radius_m,
                max_steering=self.vehicle.max_steering_rad,
                steering_rate=self.vehicle.steering_rate_rad_s,
                max_speed=min(self.vehicle.max_speed_m_s, self.limits.max_speed_m_s),
                max_acceleration=self.vehicle.max_acceleration_m_s2,
                tool_width=self.vehicle.tool_width_m,
                clearance=self.vehicle.clearance_m,
                turn_radius_margin=self.vehicle.turn_radius_margin,
            ),
            camera=Camera(
                constant=self.camera.constant_px,
                width=self.camera.width,
                height=self.camera.height,
                center_x=self.camera.center[0],
                center_y=self.camera.center[1],
                forward=self.camera.forward_m,
                mount_height=self.camera.height_m,
                rate=self.camera.rate_hz,
                distortion=self._distortion,
            ),
            pan=PanUnit(
                minimum=self.pan.minimum_rad,
                maximum=self.pan.maximum_rad,
                rate=self.pan.rate_rad_s,
                sweep_duty=self.pan.sweep_duty,
                adc_at_minimum=self.pan.adc_at_minimum,
                adc_at_maximum=self.pan.adc_at_maximum,
            ),
            proximity=Proximity(
                angles=self.proximity.angles_rad,
                forward=self.proximity.forward_m,
                max_range=self.proximity.max_range_m,
                hard_limit=self.proximity.hard_limit_m,
            ),
        )

    @property
    def controls(self) -> CameraControls:
        """How a camera of this machine is set."""
        return CameraControls(
            autofocus=self.camera.autofocus,
            focus=self.camera.focus,
            exposure=self.camera.exposure_s,
            white_balance=self.camera.white_balance_k,
        )

    @property
    def _distortion(self) -> tuple[float, ...]:
        """Nothing where the lens is ideal; the simulated one always is."""
        real = self.camera.source != "simulated"
        return self.camera.distortion if real and any(self.camera.distortion) else ()

    @property
    def calibration(self) -> DriveCalibration:
        """What this robot's motors and servo do."""
        return DriveCalibration(
            full_speed_left=self.drive.full_speed_left_m_s,
            full_speed_right=self.drive.full_speed_right_m_s,
            dead_band=self.drive.dead_band,
            servo_center=self.drive.servo_center_rad,
            servo_scale=self.drive.servo_scale,
            servo_limit=self.drive.servo_limit_rad,
            counts_per_metre=self.drive.counts_per_m,
        )

    @property
    def localization(self) -> Localization:
        """What the localizer tolerates."""
        return Localization(
            method=self.localizer.method,
            tolerance=self.localizer.tolerance_m,
            degraded_after=self.localizer.degraded_after_s,
            lost_after=self.localizer.lost_after_s,
            lost_sigma=self.localizer.lost_sigma_m,
        )

    @property
    def supervision(self) -> Limits:
        """What the supervisor does not let pass."""
        return Limits(
            max_speed=self.limits.max_speed_m_s,
            max_acceleration=self.vehicle.max_acceleration_m_s2,
            max_estimate_age=self.limits.max_estimate_age_s,
            max_link_age=self.limits.max_link_age_s,
            max_position_sigma=self.limits.max_position_sigma_m,
            degraded_share=self.limits.degraded_share,
        )

    @property
    def robot(self) -> RobotSettings:
        """All of the above together, as the robot takes it."""
        return RobotSettings(
            model=self.model,
            calibration=self.calibration,
            localizer=self.localization,
            limits=self.supervision,
        )

    @property
    def paint(self) -> Paint:
        """What the bright segments of landmarks are painted with."""
        return Paint.parse(self.landmark.bright)

    @property
    def port_address(self) -> PortAddress | None:
        """Where the board is plugged in; None for the simulated one."""
        return PortAddress.parse(self.link.port) if self.link.board == "serial" else None

    def disturbances(self, rng: np.random.Generator) -> Disturbances:
        """What the simulated robot does that its model does not know."""
        drawn = Disturbances.drawn(rng)
        factor = self.simulation.imperfection
        # The grip says which wheels win, not how wrong they are.
        scaled = {
            field.name: getattr(drawn, field.name) * factor
            for field in dataclasses.fields(drawn)
            if field.name != "rear_grip"
        }
        return dataclasses.replace(drawn, **scaled)

    def with_board(self, board: str) -> Settings:
        """These settings for another board, as ``serve --board`` asks for.

        A board in the simulated world comes with the simulated camera: there is no half-simulated
        world.

        Raises:
            ConfigError: the board is unknown, or "serial" without a port or a real camera.
        """
        changes: dict[str, dict[str, Any]] = {"link": {"board": board}}
        if board in ("simulated", "host"):
            changes["camera"] = {"source": "simulated"}
        return self.override(changes, "--board")

    def override(self, changes: Mapping[str, Mapping[str, Any]], source: str) -> Settings:
        """These settings with some keys changed, checked again: ``{"link": {"board": ...}}``.

        Args:
            source: where the changes come from ("--board"), for the error's sentence.

        Raises:
            ConfigError: the result cannot be used.
        """
        document = self.model_dump()
        for section, keys in changes.items():
            document[section] = {**document.get(section, {}), **keys}
        return _validated(document, source, "")


def load_settings(path: Path | None) -> Settings:
    """Read robot.toml; ``None`` gives the defaults, the simulated robot.

    Raises:
        ConfigError: the file is missing or unreadable, is no TOML, has an unknown key, or a value
            that cannot be used. One line: file, line, key, what was read, what was expected.
    """
    if path is None:
        return Settings()
    try:
        text = path.read_bytes().decode("utf-8-sig").replace("\r\n", "\n")
    except UnicodeDecodeError as error:
        raise ConfigError(
            f"{path}: byte {error.start} is no UTF-8 text: expected a TOML file."
        ) from error
    except OSError as error:
        why = error.strerror or type(error).__name__
        raise ConfigError(
            f"{path}: cannot be read ({why}): expected a robot.toml.",
            remedy="See robot.example.toml.",
        ) from error
    return parse_settings(text, str(path))


def parse_settings(text: str, source: str) -> Settings:
    """The settings in ``text``, a TOML document that came from ``source``.

    Raises:
        ConfigError: as ``load_settings``.
    """
    try:
        document = tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        raise ConfigError(explain_syntax(error, source, text)) from error
    return _validated(document, source, text)


def _validated(document: dict[str, Any], source: str, text: str) -> Settings:
    try:
        return Settings.model_validate(document)
    except ValidationError as error:
        raise ConfigError(explain_validation(error, source, text, Settings)) from error
