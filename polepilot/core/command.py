"""What the robot is told to do."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class DriveCommand:
    """What the wheels shall do.

    ``speed`` is that of `base_link` (m/s, backward negative), ``steering`` the angle of the virtual
    front wheel (rad, left positive).
    """

    speed: float = 0.0
    steering: float = 0.0


STAND = DriveCommand()
"""Wheels still, steering straight."""
