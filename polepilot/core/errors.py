"""The one error tree.

    PolepilotError
    ├── InputError                 something that was read is not as expected
    │   ├── SiteError              a drawn map
    │   ├── ConfigError            robot.toml
    │   ├── ImageError             a picture file
    │   ├── DatasetError           a recorded run
    │   └── PlanError              a job that cannot be planned on this site
    ├── RefusedError               a command that the robot does not take in its present state
    ├── DeviceError                hardware that does not answer as it should
    │   ├── CameraError
    │   └── LinkError
    └── InternalError              our own fault

Expected absence (no landmark in the picture, no pose yet) is a value, never an error.
Each error carries a stable machine-readable ``code``, a sentence for a person, and where it
helps a ``remedy``: the next step. The command line turns ``InputError`` into exit status 2, the
server turns each class into one HTTP status.
"""

from __future__ import annotations


class PolepilotError(Exception):
    """Base of all errors that Polepilot raises on purpose."""

    code = "error"

    def __init__(self, message: str, *, remedy: str = "", code: str | None = None) -> None:
        super().__init__(message)
        self.message = message
        self.remedy = remedy
        if code is not None:
            self.code = code

    def __str__(self) -> str:
        return f"{self.message} {self.remedy}".strip()


class InputError(PolepilotError):
    """What was read is not what was expected; the message names both, and where."""

    code = "bad_input"


class SiteError(InputError):
    """A site that cannot be used. ``where`` is the place on the map, if there is one."""

    code = "bad_site"

    def __init__(
        self,
        message: str,
        *,
        remedy: str = "",
        code: str | None = None,
        where: tuple[float, float] | None = None,
    ) -> None:
        super().__init__(message, remedy=remedy, code=code)
        self.where = where


class ConfigError(InputError):
    """An unknown key or an impossible value in robot.toml."""

    code = "bad_config"


class ImageError(InputError):
    """A file that is no readable picture."""

    code = "bad_image"


class DatasetError(InputError):
    """A recorded run with missing or contradictory parts."""

    code = "bad_dataset"


class PlanError(InputError):
    """A job that cannot be planned: unknown route, start outside the free space."""

    code = "cannot_plan"


class RefusedError(PolepilotError):
    """A command that is not taken now, with the reason and what to do about it."""

    code = "refused"


class DeviceError(PolepilotError):
    """Hardware that is missing, busy, forbidden or silent."""

    code = "device"


class CameraError(DeviceError):
    """The camera."""

    code = "camera"


class LinkError(DeviceError):
    """The serial line to the microcontroller."""

    code = "link"


class InternalError(PolepilotError):
    """A state that cannot happen, and did."""

    code = "internal"
