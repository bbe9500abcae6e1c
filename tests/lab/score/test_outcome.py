"""Scores of a team against what can be worked out by hand."""

from __future__ import annotations

import math

import numpy as np
import pytest
from lab.recordings.recording import Array, Recording, Trail
from lab.score import metrics
from lab.score.outcome import Closure, Outcome, Path, dead_reckoning, score

TURN = np.array([3.0, -2.0, 2.5])
"""Another frame."""


def random_poses(seed: int, count: int = 40) -> Array:
    rng = np.random.default_rng(seed)
    return np.column_stack([rng.uniform(-5, 5, (count, 2)), rng.uniform(-3, 3, count)])


def recording_of(truths: dict[int, Array], odometry: dict[int, Array] | None = None) -> Recording:
    trails = {
        robot: Trail(robot, 0.1 * np.arange(len(t)), (odometry or truths)[robot], t)
        for robot, t in truths.items()
    }
    return Recording("made up", trails, np.zeros((0, 4)))


def path_of(trail: Trail, poses: Array, frame: int = 0) -> Path:
    return Path(trail.t, poses, np.full(len(poses), frame))


def test_an_exact_estimate_in_another_frame_has_no_error() -> None:
    truths = {0: random_poses(4), 7: random_poses(5)}
    recording = recording_of(truths)
    moved = {
        robot: path_of(trail, metrics.compose(TURN[None], trail.truth))
        for robot, trail in recording.trails.items()
    }
    scores = score(recording, Outcome(final=moved))
    assert set(scores["robots"]) == {"0", "7"}
    for value in scores["team"].values():
        assert value == pytest.approx(0, abs=1e-9)


def test_one_alignment_serves_the_whole_team() -> None:
    """Two robots on the same path, one shifted by 1 m: nothing but half of it each can be had."""
    truth = random_poses(6)
    truth[:, 2] = 0
    shifted = truth + [1.0, 0, 0]
    recording = recording_of({0: truth, 1: truth})
    paths = {0: path_of(recording.trails[0], truth), 1: path_of(recording.trails[1], shifted)}
    scores = score(recording, Outcome(final=paths))
    for errors in (scores["team"], scores["robots"]["0"], scores["robots"]["1"]):
        assert errors["ate_rmse_m"] == pytest.approx(0.5)
        assert errors["ate_mean_m"] == pytest.approx(0.5)
        assert errors["ate_std_m"] == pytest.approx(0, abs=1e-9)


def test_poses_of_another_frame_are_aligned_for_themselves() -> None:
    truth = random_poses(7)
    recording = recording_of({0: truth})
    poses = truth.copy()
    poses[20:] = metrics.compose(TURN[None], truth[20:])
    in_two = Path(recording.trails[0].t, poses, np.repeat([0, 1], 20))
    in_one = path_of(recording.trails[0], poses)
    assert score(recording, Outcome(live={0: in_two}))["live"]["team"][
        "ate_rmse_m"
    ] == pytest.approx(0, abs=1e-9)
    assert score(recording, Outcome(live={0: in_one}))["live"]["team"]["ate_rmse_m"] > 1.0


def test_dead_reckoning_starts_at_the_true_pose_and_is_not_aligned() -> None:
    """Odometry of a straight drive that bends by a right angle at its start."""
    truth = np.column_stack([np.arange(5.0), np.ones(5), np.full(5, 0.0)])
    odometry = np.column_stack([np.full(5, 9.0), 2 * np.arange(5.0), np.full(5, math.pi / 2)])
    recording = recording_of({0: truth}, {0: odometry})
    assert dead_reckoning(recording)[0] == pytest.approx(
        np.column_stack([2 * np.arange(5.0), np.ones(5), np.zeros(5)])
    )
    errors = score(recording, Outcome())["odometry"]["team"]
    assert errors["ate_mean_m"] == pytest.approx(2.0)
    assert errors["rot_mean_deg"] == pytest.approx(0)


def test_an_estimate_is_scored_where_it_is_and_angles_take_the_short_way() -> None:
    """It covers the second half only, at other stamps, and its heading crosses 180 degrees."""
    t = 0.1 * np.arange(41)
    truth = np.column_stack([t, np.zeros(41), 2.9 + 0.1 * t])
    recording = Recording("made up", {0: Trail(0, t, truth, truth)}, np.zeros((0, 4)))
    when = np.arange(1.95, 4.0, 0.07)
    heading = (2.9 + 0.1 * when + np.pi) % (2 * np.pi) - np.pi
    poses = np.column_stack([when, np.zeros(len(when)), heading])
    scores = score(recording, Outcome(final={0: Path(when, poses, np.zeros(len(when)))}))
    assert scores["team"]["ate_rmse_m"] == pytest.approx(0, abs=1e-9)
    assert scores["team"]["rot_mean_deg"] == pytest.approx(0, abs=1e-6)


def test_pairs_are_scored_only_where_one_pose_was_named() -> None:
    truths = {0: np.zeros((11, 3)), 1: np.tile([4.0, 0, 0.5], (11, 1))}

    def closure(verdict: str, *poses: list[float], kept: bool = False) -> Closure:
        return Closure(0.5, 0, 1, verdict, np.array(poses), np.zeros((len(poses), 3, 3)), kept)

    answers = [
        closure("unique", [4.0, 0.3, 0.5], kept=True),
        closure("unique", [4.0, -0.1, 0.5 + math.radians(6)]),
        closure("unique", [4.8, 0.0, 0.5]),
        closure("ambiguous", [9.0, 9.0, 0.0], [4.0, 0.0, 0.5]),
        closure("no fit"),
    ]
    scores = score(recording_of(truths), Outcome(closures=answers))
    assert scores["closures"] == {"seen": 4, "kept": 1}
    assert list(scores["pairs"]) == ["0-1"]
    pair = scores["pairs"]["0-1"]
    assert pair["trans_median_m"] == pytest.approx(0.3)
    assert pair["trans_mean_m"] == pytest.approx(0.4)
    assert pair["rot_median_deg"] == pytest.approx(0)
    assert pair["rot_mean_deg"] == pytest.approx(2.0)


def test_a_robot_that_was_never_localised_has_no_errors() -> None:
    recording = recording_of({0: random_poses(8), 1: random_poses(9)})
    scores = score(recording, Outcome(final={0: path_of(recording.trails[0], random_poses(8))}))
    assert set(scores["robots"]) == {"0"}
    assert score(recording, Outcome())["team"] is None
