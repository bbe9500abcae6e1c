"""What figures are drawn from."""

from __future__ import annotations

import numpy as np
import pytest
from lab.recordings import world
from lab.score import metrics, panels
from lab.score.outcome import Outcome, Path

RECORDING = world.simulate(world.Scene(robots=2, seconds=5.0, odometry_hz=10, range_hz=10), 2)
ELSEWHERE = np.array([[4.0, -7.0, 2.0]])


def found(robot: int, off_m: float = 0.0) -> Path:
    trail = RECORDING.trails[robot]
    poses = metrics.compose(ELSEWHERE, trail.truth)
    poses[: len(poses) // 2, 0] += off_m
    return Path(trail.t, poses, np.zeros(len(trail.t)))


def test_paths_are_moved_onto_the_truth_as_one_team() -> None:
    result = Outcome(final={0: found(0), 1: found(1)})
    for robot, poses in panels.aligned(RECORDING, result).items():
        assert poses[:, :2] == pytest.approx(RECORDING.trails[robot].truth[:, :2], abs=1e-9)


def test_a_robot_without_a_path_is_left_out_and_a_team_without_any_is_empty() -> None:
    nothing = Path(np.zeros(0), np.zeros((0, 3)), np.zeros(0))
    assert set(panels.aligned(RECORDING, Outcome(final={0: found(0), 1: nothing}))) == {0}
    assert panels.aligned(RECORDING, Outcome()) == {}


def test_errors_over_time_are_distances_and_turns() -> None:
    trail = RECORDING.trails[1]
    poses = trail.truth + [0.3, -0.4, 2 * np.pi - 0.1]
    ((t, metres, degrees),) = panels.errors_over_time(RECORDING, {1: (trail.t, poses)}).values()
    assert t is trail.t
    assert metres == pytest.approx(np.full(len(t), 0.5))
    assert degrees == pytest.approx(np.full(len(t), np.degrees(0.1)))


def test_more_robots_than_colours_begin_again() -> None:
    assert panels.colour(0) == panels.colour(len(panels.COLOURS))
    assert len(set(panels.COLOURS)) == len(panels.COLOURS)
