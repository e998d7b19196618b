from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from polepilot.core.command import STAND, DriveCommand
from polepilot.core.control.supervisor import Limits, Supervisor
from polepilot.core.errors import ConfigError
from polepilot.core.geometry import Pose2D
from polepilot.core.observation import PoseEstimate, Status
from polepilot.core.vehicle import Vehicle

VEHICLE = Vehicle()
DRIVE = DriveCommand(0.3, 0.2)


def pose(
    stamp: float = 10.0,
    status: Status = Status.TRACKING,
    *,
    sigma: float = 0.02,
    x: float = 0.0,
    reason: str = "",
) -> PoseEstimate:
    return PoseEstimate(stamp, Pose2D(x, 0.0, 0.0), np.diag([sigma**2] * 3), status, reason)


REFUSED = [
    ("bad_command", DriveCommand(math.nan, 0.0), pose(), "armed", 0.02),
    ("bad_command", DriveCommand(0.1, math.inf), pose(), "armed", 0.02),
    ("estop", DRIVE, pose(), "estop", 0.02),
    ("no_link", DRIVE, pose(), "closed", None),
    ("no_link", DRIVE, pose(), "connecting", None),
    ("link_lost", DRIVE, pose(), "link_lost", 0.02),
    ("not_armed", DRIVE, pose(), "idle", 0.02),
    ("not_armed", DRIVE, pose(), "something new", 0.02),
    ("link_silent", DRIVE, pose(), "armed", None),
    ("link_silent", DRIVE, pose(), "armed", 0.26),
    ("link_silent", DRIVE, pose(), "armed", -1.0),
    ("link_silent", DRIVE, pose(), "armed", math.nan),
    ("no_pose", DRIVE, None, "armed", 0.02),
    ("fixing", DRIVE, pose(status=Status.FIXING), "armed", 0.02),
    ("lost", DRIVE, pose(status=Status.LOST), "armed", 0.02),
    ("bad_pose", DRIVE, pose(x=math.nan), "armed", 0.02),
    ("bad_pose", DRIVE, pose(sigma=math.inf), "armed", 0.02),
    ("pose_stale", DRIVE, pose(stamp=9.4), "armed", 0.02),
    ("pose_stale", DRIVE, pose(stamp=10.2), "armed", 0.02),
    ("pose_stale", DRIVE, pose(stamp=math.nan), "armed", 0.02),
    ("pose_uncertain", DRIVE, pose(sigma=0.6), "armed", 0.02),
]


@pytest.mark.parametrize(("code", "command", "estimate", "state", "age"), REFUSED)
def test_doubt_means_standing_with_a_reason(
    code: str,
    command: DriveCommand,
    estimate: PoseEstimate | None,
    state: str,
    age: float | None,
) -> None:
    supervisor = Supervisor(Limits(), VEHICLE)
    supervisor.check(9.95, DRIVE, pose(9.95), "armed", 0.02)
    verdict = supervisor.check(10.0, command, estimate, state, age)
    assert verdict.command == STAND
    assert verdict.code == code
    assert verdict.reason


def settled(estimate: PoseEstimate, command: DriveCommand = DRIVE) -> DriveCommand:
    supervisor = Supervisor(Limits(), VEHICLE)
    for tick in range(40):
        now = 8.05 + tick * 0.05
        present = PoseEstimate(
            now, estimate.pose, estimate.covariance, estimate.status, estimate.reason
        )
        verdict = supervisor.check(now, command, present, "armed", 0.02)
    return verdict.command


def test_all_well_lets_through() -> None:
    assert settled(pose()) == DRIVE
    verdict = Supervisor(Limits(), VEHICLE).check(10.0, STAND, pose(), "armed", 0.25)
    assert (verdict.code, verdict.reason) == ("ok", "")


def test_degraded_halves_the_speed() -> None:
    command = settled(pose(status=Status.DEGRADED), DriveCommand(0.4, 0.2))
    assert command.speed == pytest.approx(0.2)
    assert command.steering == 0.2
    verdict = Supervisor(Limits(), VEHICLE).check(
        10.0, DRIVE, pose(status=Status.DEGRADED, reason="no landmark for 3 s"), "armed", 0.02
    )
    assert verdict.code == "degraded"
    assert "no landmark for 3 s" in verdict.reason


@pytest.mark.parametrize("sign", [1, -1])
def test_limits(sign: int) -> None:
    command = settled(pose(), DriveCommand(sign * 3.0, sign * 2.0))
    assert command.speed == pytest.approx(sign * 0.40)
    assert command.steering == pytest.approx(sign * VEHICLE.max_steering)


def test_start_is_gentle_and_stop_is_not() -> None:
    supervisor = Supervisor(Limits(max_acceleration=0.5), VEHICLE)
    speeds = []
    for tick in range(10):
        now = tick * 0.05
        verdict = supervisor.check(now, DriveCommand(0.4), pose(now), "armed", 0.0)
        speeds.append(verdict.command.speed)
    assert speeds == pytest.approx([0.025 * tick for tick in range(10)])
    assert supervisor.check(0.5, DriveCommand(0.05), pose(0.5), "armed", 0.0).command.speed == 0.05
    # Backward begins from standing, too.
    verdict = supervisor.check(0.55, DriveCommand(-0.4), pose(0.55), "armed", 0.0)
    assert verdict.command.speed == pytest.approx(-0.025)
    # A long tick is no licence to leap.
    verdict = supervisor.check(9.0, DriveCommand(-0.4), pose(9.0), "armed", 0.0)
    assert verdict.command.speed == pytest.approx(-0.075)


def test_after_a_refusal_the_start_is_gentle_again() -> None:
    supervisor = Supervisor(Limits(), VEHICLE)
    for tick in range(20):
        supervisor.check(tick * 0.05, DRIVE, pose(tick * 0.05), "armed", 0.0)
    supervisor.check(1.0, DRIVE, None, "armed", 0.0)
    verdict = supervisor.check(1.05, DRIVE, pose(1.05), "armed", 0.0)
    assert verdict.command.speed == pytest.approx(0.05 * 0.6)


@given(
    speed=st.floats(allow_nan=True, allow_infinity=True),
    steering=st.floats(allow_nan=True, allow_infinity=True),
    stamp=st.floats(allow_nan=True, allow_infinity=True),
    age=st.none() | st.floats(allow_nan=True, allow_infinity=True),
    state=st.sampled_from(["closed", "connecting", "idle", "armed", "link_lost", "estop"]),
    status=st.sampled_from(list(Status)),
)
def test_never_more_than_the_vehicle_may(
    speed: float,
    steering: float,
    stamp: float,
    age: float | None,
    state: str,
    status: Status,
) -> None:
    supervisor = Supervisor(Limits(), VEHICLE)
    for now in (9.95, 10.0):
        verdict = supervisor.check(
            now, DriveCommand(speed, steering), pose(stamp, status), state, age
        )
        assert abs(verdict.command.speed) <= 0.6 * 0.1
        assert abs(verdict.command.steering) <= VEHICLE.max_steering
        if verdict.code not in ("ok", "degraded"):
            assert verdict.command == STAND


def test_impossible_limits_are_refused() -> None:
    with pytest.raises(ConfigError, match="max_speed"):
        Limits(max_speed=0)
    with pytest.raises(ConfigError, match="degraded_share"):
        Limits(degraded_share=1.5)
