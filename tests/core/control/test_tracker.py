from __future__ import annotations

import itertools
import math

import numpy as np
import pytest
from core.control.driving import (
    FULL_SPEED,
    VEHICLE,
    actuation,
    arc,
    drive,
    plan_of,
    rounded_square,
)
from hypothesis import given, settings
from hypothesis import strategies as st

from polepilot.core.command import STAND
from polepilot.core.control.stretches import cut
from polepilot.core.control.tracker import PathTracker
from polepilot.core.geometry import Pose2D
from polepilot.core.sim.motion import Disturbances, Motion
from polepilot.core.vehicle import PanUnit

TURN = VEHICLE.plan_turn_radius
QUARTER = math.pi / 2

SHAPES = {
    "circle": (arc((0, 0), TURN, -QUARTER, 3 * QUARTER), Pose2D(0, -TURN, 0)),
    "wide circle": (arc((0, 0), 1.0, -QUARTER, 3 * QUARTER), Pose2D(0, -1.0, 0)),
    "square": (rounded_square(3.0, TURN), Pose2D(TURN, 0, 0)),
    "square at 0.6 m": (rounded_square(3.0, 0.6), Pose2D(0.6, 0, 0)),
    "s": (
        [
            (0, 0),
            *arc((1, TURN), TURN, -QUARTER, 0),
            *arc((1 + 2 * TURN, TURN), TURN, math.pi, QUARTER)[1:],
            (3, 2 * TURN),
        ],
        Pose2D(0, 0, 0),
    ),
}


@pytest.mark.parametrize("shape", SHAPES)
@pytest.mark.parametrize("seed", [None, 1, 2])
def test_smooth_paths_are_kept_within_three_centimetres(shape: str, seed: int | None) -> None:
    path, start = SHAPES[shape]
    rng = np.random.default_rng(seed)
    disturbances = Disturbances.none() if seed is None else Disturbances.drawn(rng)
    run = drive(plan_of(path), start, disturbances=disturbances, seed=seed or 0)
    assert run.tracker.done
    assert run.deviations(np.asarray(path)).max() < 0.03
    assert math.dist(run.motion.pose.position, path[-1]) < 0.03
    assert run.motion.standing


@pytest.mark.parametrize("shape", ["circle", "s"])
def test_reverse_is_as_good_as_forward(shape: str) -> None:
    path, start = SHAPES[shape]
    backward = Pose2D(start.x, start.y, math.pi)
    run = drive(plan_of(path, [-1] * (len(path) - 1)), backward)
    assert run.tracker.done
    assert run.deviations(np.asarray(path)).max() < 0.03
    assert math.dist(run.motion.pose.position, path[-1]) < 0.03


def test_corner_taken_forward_reverse_forward() -> None:
    back = arc((1.36, -0.36), 0.36, QUARTER, math.pi)
    path = [(0.0, 0.0), (1.36, 0.0), *back[1:], (1.0, 1.5)]
    gear = [1] + [-1] * (len(back) - 1) + [1]
    run = drive(plan_of(path, gear), Pose2D(0, 0, 0))
    assert run.tracker.done
    assert run.deviations(np.asarray(path)).max() < 0.03
    reached = min(math.dist(p, (1.36, 0.0)) for p in run.positions)
    assert reached < 0.03
    assert run.motion.pose.heading == pytest.approx(QUARTER, abs=0.1)


def test_wheel_is_turned_before_the_gear_is_changed() -> None:
    back = arc((1.36, -0.36), 0.36, QUARTER, math.pi)
    plan = plan_of([(0.0, 0.0), (1.36, 0.0), *back[1:]], [1] + [-1] * (len(back) - 1))
    tracker = PathTracker(plan, VEHICLE)
    tracker.resume_at(1.35)
    pose = Pose2D(1.36, 0, 0)
    commands = [tracker.update(pose, 0.05) for _ in range(40)]
    first_back = next(i for i, command in enumerate(commands) if command.speed < 0)
    standing = [command for command in commands[:first_back] if command.speed == 0]
    # Backing with the rear to the right needs the wheel where the circle of 0.36 m puts it.
    wanted = -math.atan(VEHICLE.wheelbase / 0.36)
    assert standing[-1].steering == pytest.approx(wanted, abs=0.12)
    assert len(standing) * 0.05 >= abs(wanted) / VEHICLE.steering_rate


def test_start_beside_the_path_joins_it() -> None:
    path = [(0.0, 0.0), (3.0, 0.0)]
    run = drive(plan_of(path), Pose2D(0, 0.3, 0.0))
    assert run.tracker.done
    assert run.deviations(np.asarray(path))[-1] < 0.02


def test_missed_end_is_passed_and_not_circled() -> None:
    # The end lies 25 cm aside, inside the tightest turn: it cannot be reached forward.
    run = drive(plan_of([(0.0, 0.0), (0.2, 0.0), (-1.0, 0.0)], [1, -1]), Pose2D(0, 0.2, 0.5))
    assert run.tracker.done
    assert run.seconds < 15
    assert math.dist(run.motion.pose.position, (-1.0, 0.0)) < 0.03


def test_progress_never_falls_and_never_jumps_to_the_next_pass() -> None:
    # Three passes 30 cm apart: nearer to each other than the cursor looks ahead.
    path = [(0.0, 0.0), (4.0, 0.0), (4.0, 0.3), (0.0, 0.3), (0.0, 0.6), (4.0, 0.6)]
    run = drive(plan_of(path), Pose2D(0, 0, 0))
    steps = [b - a for a, b in itertools.pairwise(run.progress)]
    assert min(steps) >= 0
    assert max(steps) <= 0.42
    assert run.tracker.done
    # Going the whole way takes its time; a jump to a neighbouring pass would save half of it.
    assert run.seconds > 12.6 / VEHICLE.max_speed


def test_far_away_is_off_route() -> None:
    tracker = PathTracker(plan_of([(0.0, 0.0), (3.0, 0.0)]), VEHICLE)
    tracker.update(Pose2D(0.5, 0.1, 0), 0.05)
    assert not tracker.off_route
    assert tracker.deviation == pytest.approx(0.1)
    tracker.update(Pose2D(0.5, 0.6, 0), 0.05)
    assert tracker.off_route
    assert "60 cm" in tracker.off_route_reason


def test_driving_without_getting_ahead_is_off_route() -> None:
    tracker = PathTracker(plan_of([(0.0, 0.0), (3.0, 0.0)]), VEHICLE)
    for _ in range(400):
        tracker.update(Pose2D(0.5, 0.0, 0), 0.05)
    assert tracker.off_route
    assert "without getting ahead" in tracker.off_route_reason


def test_resume_takes_the_path_up_in_the_middle() -> None:
    path = [(0.0, 0.0), (2.0, 0.0), (1.0, 0.0)]
    tracker = PathTracker(plan_of(path, [1, -1]), VEHICLE)
    tracker.resume_at(2.5)
    assert tracker.progress == pytest.approx(2.5)
    assert tracker.gear == -1
    speeds = [tracker.update(Pose2D(1.5, 0, 0), 0.05).speed for _ in range(20)]
    assert speeds[-1] < -0.05
    tracker.resume_at(99)
    assert tracker.progress == pytest.approx(3.0)


def test_rejoined_against_the_direction_of_the_path_it_turns_round() -> None:
    """A detour may end beside the pass that comes back; a turn takes more than OFF_ROUTE."""
    plan = plan_of([(0.0, 0.0), (5.0, 0.0)])
    tracker = PathTracker(plan, VEHICLE)
    tracker.resume_at(1.0)
    motion = Motion(
        VEHICLE,
        PanUnit(),
        Disturbances(),
        np.random.default_rng(1),
        full_speed=FULL_SPEED,
        pose=Pose2D(1.2, 0.1, math.pi),
    )
    turned = []
    for _ in range(1200):
        command = tracker.update(motion.pose, 0.05)
        assert not tracker.off_route, tracker.off_route_reason
        turned.append(tracker.aligned)
        if tracker.done:
            break
        motion.advance(0.05, actuation(command))
    assert tracker.done
    assert not turned[0]
    assert turned[-1]
    assert motion.pose.distance_to((5.0, 0.0)) < 0.05


def test_cut_short_goes_on_with_the_next_stretch() -> None:
    tracker = PathTracker(plan_of([(0.0, 0.0), (1.0, 0.0), (0.4, 0.0)], [1, -1]), VEHICLE)
    for place in np.arange(0.0, 0.95, 0.05):
        tracker.update(Pose2D(float(place), 0, 0), 0.2)
    assert not tracker.cut_short(0.05)
    assert tracker.gear == 1
    assert tracker.cut_short(0.12)
    assert tracker.gear == -1
    assert not tracker.cut_short(10.0), "backward nothing holds it"
    speeds = [tracker.update(Pose2D(0.9, 0, 0), 0.05).speed for _ in range(40)]
    assert speeds[-1] < -0.05
    assert tracker.progress == pytest.approx(1.1, abs=0.02)


def test_cut_short_at_the_end_is_done() -> None:
    tracker = PathTracker(plan_of([(0.0, 0.0), (1.0, 0.0)]), VEHICLE)
    for place in np.arange(0.0, 1.0, 0.05):
        tracker.update(Pose2D(float(place), 0, 0), 0.2)
    assert tracker.cut_short(0.08)
    assert tracker.done
    assert tracker.update(Pose2D(0.95, 0, 0), 0.05) == STAND
    assert not tracker.cut_short(1.0)


def test_taken_up_again_it_begins_from_standing() -> None:
    tracker = PathTracker(plan_of([(0.0, 0.0), (3.0, 0.0)]), VEHICLE)
    for _ in range(400):
        tracker.update(Pose2D(0.5, 0.0, 0), 0.05)
    assert tracker.off_route
    tracker.take_up()
    assert not tracker.off_route
    assert tracker.update(Pose2D(0.5, 0.0, 0), 0.05).speed <= 0.1


def test_done_stands() -> None:
    tracker = PathTracker(plan_of([(0.0, 0.0), (0.5, 0.0)]), VEHICLE)
    tracker.resume_at(0.5)
    for _ in range(20):
        command = tracker.update(Pose2D(0.5, 0, 0), 0.05)
    assert tracker.done
    assert command == STAND
    assert tracker.progress == tracker.length
    assert not tracker.off_route
    assert len(tracker.path_ahead(1.0)[0]) == 0


def test_path_ahead_crosses_changes_of_gear() -> None:
    tracker = PathTracker(plan_of([(0.0, 0.0), (1.0, 0.0), (0.5, 0.0)], [1, -1]), VEHICLE)
    tracker.resume_at(0.8)
    points, along, gears = tracker.path_ahead(0.4)
    assert along[0] == pytest.approx(0.8, abs=0.02)
    assert along[-1] == pytest.approx(1.2, abs=0.02)
    assert (gears[along < 0.99] == 1).all()
    assert (gears[along > 1.01] == -1).all()
    assert points[-1] == pytest.approx((0.8, 0.0), abs=0.02)


def test_path_of_one_place_is_done_at_once() -> None:
    tracker = PathTracker(plan_of([(1.0, 1.0), (1.0, 1.0)]), VEHICLE)
    assert tracker.done
    assert tracker.update(Pose2D(0, 0, 0), 0.05) == STAND


@settings(deadline=None, max_examples=60)
@given(
    corners=st.lists(
        st.tuples(st.floats(-5, 5), st.floats(-5, 5)), min_size=2, max_size=8, unique=True
    ),
    gears=st.lists(st.sampled_from([1, -1]), min_size=7, max_size=7),
)
def test_stretches_cover_the_path(corners: list[tuple[float, float]], gears: list[int]) -> None:
    plan = plan_of(corners, gears[: len(corners) - 1])
    length = float(np.hypot(*np.diff(plan.path, axis=0).T).sum())
    stretches = cut(plan, VEHICLE)
    assert sum(s.length for s in stretches) == pytest.approx(length, abs=1e-4)
    for before, after in itertools.pairwise(stretches):
        assert before.gear != after.gear
        assert after.begin == pytest.approx(before.begin + before.length)
    for stretch in stretches:
        assert (stretch.speed <= VEHICLE.max_speed + 1e-9).all()
        assert (stretch.speed > 0).all()


@settings(deadline=None, max_examples=60)
@given(
    x=st.floats(-0.5, 3.5), y=st.floats(-0.5, 0.5), heading=st.floats(-3.2, 3.2),
    gear=st.sampled_from([1, -1]),
)  # fmt: skip
def test_commands_stay_within_what_the_vehicle_can(
    x: float, y: float, heading: float, gear: int
) -> None:
    tracker = PathTracker(plan_of([(0.0, 0.0), (3.0, 0.0)], [gear]), VEHICLE)
    for _ in range(30):
        command = tracker.update(Pose2D(x, y, heading), 0.05)
        assert abs(command.steering) <= VEHICLE.max_steering + 1e-12
        assert 0 <= gear * command.speed <= VEHICLE.max_speed
