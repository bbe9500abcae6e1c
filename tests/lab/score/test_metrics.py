"""Scores against what can be worked out by hand or by scipy."""

from __future__ import annotations

import math

import numpy as np
import pytest
from lab.recordings.recording import Array, Recording, Trail
from lab.score import metrics
from lab.score.outcome import Closure, Outcome, Path, dead_reckoning, score
from scipy.optimize import least_squares
from scipy.spatial.transform import Rotation

TURN = np.array([3.0, -2.0, 2.5])
"""Another frame."""


def as_matrix(pose: Array) -> Array:
    x, y, theta = pose
    return np.array([[math.cos(theta), -math.sin(theta), x],
                     [math.sin(theta), math.cos(theta), y], [0, 0, 1]])  # fmt: skip


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


def test_poses_compose_and_divide_like_matrices() -> None:
    a, b = random_poses(1), random_poses(2)
    for one, other, product, ratio in zip(
        a, b, metrics.compose(a, b), metrics.relative(a, b), strict=True
    ):
        assert as_matrix(product) == pytest.approx(as_matrix(one) @ as_matrix(other))
        assert as_matrix(ratio) == pytest.approx(np.linalg.inv(as_matrix(one)) @ as_matrix(other))
        assert -math.pi <= ratio[2] <= math.pi


def test_the_alignment_of_noisy_positions_is_that_of_a_general_solver() -> None:
    rng = np.random.default_rng(3)
    truth = random_poses(3)[:, :2]
    estimate = truth @ as_matrix(TURN)[:2, :2].T + TURN[:2] + rng.normal(0, 0.3, truth.shape)

    def residuals(x: Array) -> Array:
        return np.asarray((estimate @ as_matrix(x)[:2, :2].T + x[:2] - truth).ravel())

    ours = metrics.alignment(estimate, truth)
    theirs = least_squares(residuals, ours + [0.5, -0.4, 0.3]).x
    assert as_matrix(ours) == pytest.approx(as_matrix(theirs), abs=1e-6)
    flat = [np.column_stack([p - p.mean(axis=0), np.zeros(len(p))]) for p in (truth, estimate)]
    kabsch = Rotation.align_vectors(*flat)[0].as_rotvec()[2]
    assert math.remainder(ours[2] - kabsch, 2 * math.pi) == pytest.approx(0, abs=1e-9)


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


def test_errors_are_those_of_the_definition() -> None:
    truth = np.zeros((4, 3))
    estimate = np.array(
        [[3, 4, math.radians(10)], [0, 1, math.radians(12)], [0, 0, math.radians(10)],
         [0, 2, math.radians(-1)]]
    )  # fmt: skip
    errors = metrics.errors({0: estimate}, {0: truth}, 0)
    assert errors["ate_rmse_m"] == pytest.approx(math.sqrt((25 + 1 + 0 + 4) / 4))
    assert errors["ate_mean_m"] == pytest.approx(2.0)
    assert errors["ate_std_m"] == pytest.approx(math.sqrt((9 + 1 + 4 + 0) / 4))
    assert errors["rot_mean_deg"] == pytest.approx(33 / 4)
    assert errors["rot_std_deg"] == pytest.approx(float(np.std([10, 12, 10, 1])))
    # the median turn is 10 degrees
    assert errors["rot_mean_centred_deg"] == pytest.approx((0 + 2 + 0 + 11) / 4)


def test_one_constant_turn_is_removed_from_each_robot() -> None:
    truths = {0: np.zeros((5, 3)), 1: np.zeros((5, 3))}
    turned = {0: truths[0] + [0, 0, 0.1], 1: truths[1] - [0, 0, 3.1]}
    errors = metrics.errors(turned, truths, None)
    assert errors["rot_mean_deg"] == pytest.approx(math.degrees(1.6))
    assert errors["rot_mean_centred_deg"] == pytest.approx(0, abs=1e-9)


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
