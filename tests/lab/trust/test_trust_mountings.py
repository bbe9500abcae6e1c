"""What counters say of wheels that are wired, mounted or broken in each way."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from lab.play.playback import Wiring
from lab.recordings import world
from lab.recordings.recording import Array, Recording
from lab.trust import mountings
from lab.trust.mountings import HEALTHY, Mounting

from drslamd.sensors.wheels.wheel_input import WheelInput

T = np.arange(0.0, 20.0, 0.5)
LEFT, RIGHT = 0.4 * T, 0.5 * T
STRAIGHT = world.Scene(
    robots=3,
    seconds=30.0,
    odometry_hz=10,
    range_hz=10,
    odometry=world.OdometryModel(0.0, 0.0, 0.0, 0.0),
)


def straight(speed: float = 0.5) -> Recording:
    """Three robots that drive side by side, for half a minute, straight ahead."""
    t = np.arange(round(STRAIGHT.seconds / world.STEP_S)) * world.STEP_S
    truths = [np.column_stack([speed * t, np.full(len(t), 2.0 * k), 0 * t]) for k in range(3)]
    return world.recorded("straight", np.random.default_rng(0), STRAIGHT, truths)


@pytest.mark.parametrize(
    ("wiring", "left", "right"),
    [
        (mountings.both_reversed, -LEFT, -RIGHT),
        (mountings.swapped, RIGHT, LEFT),
        (mountings.left_reversed, -LEFT, RIGHT),
        (mountings.scaled(0.5), 0.2 * T, 0.25 * T),
        (mountings.turning(1.3), 0.385 * T, 0.515 * T),
        (mountings.turning(0.7), 0.415 * T, 0.485 * T),
    ],
)
def test_counters_of_a_mounting_say(wiring: Wiring, left: Array, right: Array) -> None:
    found = wiring(T, LEFT, RIGHT)
    assert found[0] == pytest.approx(left)
    assert found[1] == pytest.approx(right)


def test_counters_that_stick_stand_and_then_go_on_from_there() -> None:
    left, _ = mountings.standing(5.0, 10.0)(T, LEFT, RIGHT)
    assert left[T <= 5] == pytest.approx(LEFT[T <= 5])
    assert left[(T >= 5) & (T <= 10)] == pytest.approx(0.4 * 5)
    assert left[T >= 10] == pytest.approx(0.4 * (T[T >= 10] - 5))


def test_counters_that_freeze_stand_for_ever() -> None:
    left, right = mountings.standing(5.0)(T, LEFT, RIGHT)
    assert left[T >= 5] == pytest.approx(0.4 * 5)
    assert right[T >= 5] == pytest.approx(0.5 * 5)
    assert right[T <= 5] == pytest.approx(RIGHT[T <= 5])


def test_wheels_that_spin_turn_faster_for_a_while() -> None:
    left, right = mountings.spinning(5.0, 15.0, 0.5)(T, LEFT, RIGHT)
    for found, way in ((left, LEFT), (right, RIGHT)):
        assert found[T <= 5] == pytest.approx(way[T <= 5])
        assert np.diff((found - way)[(T >= 5) & (T <= 15)]) == pytest.approx(0.25)
        assert found[T >= 15] == pytest.approx(way[T >= 15] + 5.0)


def test_one_wheel_that_spins_has_the_other_count_as_ever() -> None:
    left, right = mountings.left_spinning(5.0, 10.0, 0.5)(T, LEFT, RIGHT)
    assert right == pytest.approx(RIGHT)
    assert left[T <= 5] == pytest.approx(LEFT[T <= 5])
    assert left[T == 8] == pytest.approx(LEFT[T == 8] + 1.5)
    assert left[T >= 10] == pytest.approx(LEFT[T >= 10] + 2.5)


def motions(mounting: Mounting, seed: int, robot: int) -> Array:
    """(k, 2) forward m and turned rad that a daemon reads off the wheels of a robot."""
    recording = world.simulate(replace(STRAIGHT, seconds=15.0), 5)
    device = mounting.hardware(recording, seed)[robot]
    from lab.play.playback import robot_config

    config = robot_config(device)
    wheels = WheelInput(config.wheels)
    found = [
        motion
        for chunk in device.wheel_chunks()
        for motion in wheels.feed(chunk.printed(), round(chunk.t * 1e6) + 10**9)
    ]
    return np.array([[motion.distance_m, motion.turn_rad] for motion in found])


@pytest.mark.parametrize(
    ("wiring", "forward", "turn"),
    [
        (mountings.both_reversed, -1, -1),
        (mountings.swapped, 1, -1),
        (mountings.turning(1.3), 1, 1.3),
    ],
)
def test_a_daemon_reads_what_the_wiring_made_of_the_wheels_of_the_robot_at_fault(
    wiring: Wiring, forward: float, turn: float
) -> None:
    ill, well = motions(Mounting(wiring), 4, 1), motions(HEALTHY, 4, 1)
    assert ill[:, 0] == pytest.approx(forward * well[:, 0], abs=2e-4)
    assert ill[:, 1] == pytest.approx(turn * well[:, 1], abs=2e-3)
    assert motions(Mounting(wiring), 4, 2) == pytest.approx(motions(HEALTHY, 4, 2))


def test_one_robot_is_at_fault_and_another_one_with_the_next_seed() -> None:
    one = Mounting(mountings.swapped)
    assert [one.robots(seed, 3) for seed in (300, 301, 302, 303)] == [{0}, {1}, {2}, {0}]
    assert Mounting(antennas=((0.3, 0.0),) * 3).robots(5, 3) == {0, 1, 2}
    assert Mounting(antennas=((0.3, 0.0),) * 3).robots(5, 2) == {0, 1}
    assert HEALTHY.robots(5, 3) == frozenset()


def test_antennas_that_nobody_configured_lengthen_ranges_and_leave_the_configuration() -> None:
    recording = straight()
    ahead = Mounting(antennas=((0.5, 0.0),))
    moved = ahead.fault(4, 3)(np.random.default_rng(0), recording)
    assert moved.antennas == {}
    extra = moved.ranges[:, 3] - recording.ranges[:, 3]
    ends = recording.ranges[:, 1:3]
    beside = np.sort(ends, axis=1).tolist()
    # robot 1 is at fault: its antenna is half a metre ahead of two that are 2 m to its sides
    there = np.array([1 in pair for pair in beside])
    assert extra[~there] == pytest.approx(0.0, abs=1e-12)
    assert extra[there] == pytest.approx(math.hypot(2.0, 0.5) - 2.0, abs=1e-9)


def test_a_fault_is_evident_once_the_wheels_are_a_quarter_of_a_metre_wrong() -> None:
    frozen = Mounting(mountings.standing(20.0), onset_s=20.0)
    assert frozen.evident_s(straight(0.5), 0) == pytest.approx(20.6, abs=0.11)
    assert frozen.evident_s(straight(0.1), 0) == pytest.approx(22.6, abs=0.11)
    assert frozen.evident_s(straight(0.0), 0) == float("inf")


def test_a_fault_is_evident_once_the_wheels_are_ten_degrees_wrong() -> None:
    recording = straight()
    turning = {
        robot: replace(trail, odometry=trail.odometry * [0, 0, 1] + np.outer(trail.t, [0, 0, 0.1]))
        for robot, trail in recording.trails.items()
    }
    frozen = Mounting(mountings.standing(10.0), onset_s=10.0)
    found = frozen.evident_s(replace(recording, trails=turning), 0)
    assert found == pytest.approx(10.0 + math.radians(10) / 0.1, abs=0.2)


def test_a_mounting_is_wrong_from_the_start() -> None:
    assert Mounting(mountings.swapped).evident_s(straight(0.0), 0) == 0.0
    assert Mounting(antennas=((0.3, 0.0),)).evident_s(straight(0.0), 0) == 0.0
