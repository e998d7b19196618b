from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from polepilot.core.geometry import Pose2D
from polepilot.core.landmark import Landmark
from polepilot.core.observation import PanReading, PoseEstimate, Status
from polepilot.core.robot.gaze import MARGIN, Gaze
from polepilot.core.robot.pan import PanSweep, PanTrack
from polepilot.core.scenery import Scenery
from polepilot.core.vehicle import RobotModel


def track(*readings: tuple[float, float]) -> PanTrack:
    pan = PanTrack()
    for stamp, angle in readings:
        pan.add(PanReading(stamp, angle))
    return pan


def test_interpolates_between_readings() -> None:
    pan = track((0.0, 0.0), (0.02, 0.2), (0.04, 0.1))
    assert pan.at(0.01) == pytest.approx(0.1)
    assert pan.at(0.03) == pytest.approx(0.15)
    assert pan.at(0.04) == pytest.approx(0.1)


def test_does_not_guess_outside_its_readings() -> None:
    pan = track((1.0, 0.0), (1.02, 0.2))
    assert pan.at(0.99) is None
    assert pan.at(1.03) is None
    assert PanTrack().at(0.0) is None


def test_forgets_what_is_old_and_ignores_what_goes_back() -> None:
    pan = track(*((0.02 * i, 0.001 * i) for i in range(200)))
    assert pan.at(1.0) is None
    pan.add(PanReading(0.5, 9.0))
    assert pan.latest == PanReading(0.02 * 199, 0.001 * 199)


@settings(deadline=None)
@given(st.floats(0.2, 1.0), st.floats(0.5, 3.0), st.floats(-2.0, 2.0))
def test_sweeps_between_its_ends_for_ever(duty: float, rate: float, angle: float) -> None:
    low, high = math.radians(-135), math.radians(135)
    sweep = PanSweep(low, high, duty)
    seen = set()
    for _ in range(3000):
        wanted = sweep.rate(angle)
        assert abs(wanted) == duty
        seen.add(wanted > 0)
        angle += wanted * rate * 0.02
        assert low <= angle <= high
    assert seen == {True, False}


def test_does_not_turn_blindly() -> None:
    assert PanSweep(-2.0, 2.0, 1.0).rate(None) == 0.0


MODEL = RobotModel()


def estimate(pose: Pose2D, status: Status = Status.TRACKING) -> PoseEstimate:
    return PoseEstimate(0.0, pose, np.eye(3) * 1e-4, status)


def gaze(*landmarks: Landmark, walls: Scenery | None = None) -> Gaze:
    known = {mark.id: mark for mark in landmarks}
    return Gaze(MODEL.camera, MODEL.pan, known, walls or Scenery())


def second_sweep(look: Gaze, pose: Pose2D, status: Status = Status.TRACKING) -> object:
    """What the gaze asks for once the first sweep, over the whole range, is over."""
    assert look.between(0.0, estimate(pose, status), 0) is None
    return look.between(6.0, estimate(pose, status), 1)


@pytest.mark.parametrize("status", [Status.TRACKING, Status.DEGRADED])
def test_one_landmark_in_sight_is_looked_at(status: Status) -> None:
    wall = Scenery([((-5.0, 1.0), (5.0, 1.0))])
    look = gaze(Landmark(1, 3.1, 0.0), Landmark(2, 0.0, 3.0), walls=wall)
    between = second_sweep(look, Pose2D(0, 0, 0.5), status)
    assert between == pytest.approx((-0.5 - MARGIN, -0.5 + MARGIN), abs=0.03)


def test_without_landmark_or_pose_the_whole_range_is_swept() -> None:
    assert second_sweep(gaze(), Pose2D(0, 0, 0)) is None
    look = gaze(Landmark(1, 3.1, 0.0))
    assert look.between(0.0, None, 0) is None
    assert look.between(6.0, None, 1) is None
    assert look.between(6.0, estimate(Pose2D(0, 0, 0), Status.LOST), 1) is None
    assert look.between(6.0, estimate(Pose2D(0, 0, 0)), 1) is not None


def test_a_landmark_a_little_beyond_the_range_is_in_the_picture() -> None:
    low, high = MODEL.pan.minimum, MODEL.pan.maximum
    for bearing in (high + 0.1, low - 0.1):
        mark = Landmark(1, 3 * math.cos(bearing), 3 * math.sin(bearing))
        between = second_sweep(gaze(mark), Pose2D(-MODEL.camera.forward, 0, 0))
        assert isinstance(between, tuple)
        assert low < between[0] < high or low < between[1] < high
    behind = Landmark(1, -3.0, 0.0)
    assert second_sweep(gaze(behind), Pose2D(0, 0, 0)) is None


def test_in_doubt_it_turns_back_to_what_is_in_sight_but_not_for_ever() -> None:
    look, pose = gaze(Landmark(1, 3.1, 0.0)), Pose2D(0, 0, 0)
    assert look.between(0.0, estimate(pose), 0) is None
    assert look.between(2.0, estimate(pose, Status.DEGRADED), 0) is not None
    for turn in range(1, 20):
        assert look.between(2.0 + turn, estimate(pose, Status.DEGRADED), turn) is not None
    assert any(
        look.between(26.0 + turn, estimate(pose, Status.DEGRADED), turn) is None
        for turn in (20, 21)
    )


def test_both_ends_of_the_range_are_looked_at_again_and_again() -> None:
    look, sweep = gaze(Landmark(1, 3.1, 0.0)), PanSweep(MODEL.pan.minimum, MODEL.pan.maximum, 1.0)
    angle, last = 0.0, {-1: 0.0, 1: 0.0}
    seen = longest = 0.0
    for tick in range(120 * 50):
        now = tick / 50
        between = look.between(now, estimate(Pose2D(0, 0, 0)), sweep.turns)
        angle += sweep.rate(angle, between) * MODEL.pan.rate / 50
        for side in (-1, 1):
            if side * angle > MODEL.pan.maximum - 0.1:
                last[side] = now
            assert now - last[side] < 40
        if abs(angle) < MODEL.camera.half_view:
            seen = now
        longest = max(longest, now - seen)
    # Out to an end and back again at most.
    assert longest < 2 * (MODEL.pan.maximum - MODEL.camera.half_view) / MODEL.pan.rate + 0.5
