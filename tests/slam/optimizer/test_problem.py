"""Factors and errors of the team's problem, against the same written down plainly."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from slam_problems import no_ranges, pose_edges, team_problem
from slam_scenes import inverted, matrix, product, wander

from drslamd.slam.optimizer.problem import (
    BetweenFactors,
    Calibration,
    OdometryFactors,
    Priors,
    RangeFactors,
    corrected,
    pose_errors,
    range_errors,
)
from drslamd.slam.range_model import LINKTRACK, RangeModel


def test_covariances_that_rounding_has_broken_are_inverted_all_the_same() -> None:
    """One direction a billion times better known than the others, and correlated with them."""
    lever = np.array([[1.0, 0, -1e4], [0, 1, 1e4], [0, 0, 1]])
    bad = lever @ np.diag([1e-8, 1e-8, 1.0]) @ lever.T
    edges = BetweenFactors(np.array([0]), np.array([1]), np.zeros((1, 3)), bad[None])
    information = edges.information[0]
    assert np.array_equal(information, information.T)
    scale = np.sqrt(np.diag(bad))
    assert np.linalg.eigvalsh(information * np.outer(scale, scale))[0] > 0
    np.linalg.cholesky(information * np.outer(scale, scale))


def test_ordinary_covariances_are_inverted_as_they_are() -> None:
    edges = pose_edges(np.random.default_rng(18), np.zeros((2, 3)), [(0, 1)], (0.1, 0.05, 0.02))
    assert np.allclose(edges.information[0] @ edges.covariance[0], np.eye(3), atol=1e-7)


def test_an_error_of_a_relative_pose_is_predicted_minus_measured_seen_from_the_first() -> None:
    poses = wander(np.random.default_rng(0), 3, 2.0)
    edges = pose_edges(np.random.default_rng(1), poses, [(0, 1), (2, 0)], (0.1, 0.1, 0.1))
    errors = pose_errors(poses, edges, edges.measured)
    for error, i, j, measured in zip(errors, edges.i, edges.j, edges.measured, strict=True):
        seen = product(inverted(poses[i]), poses[j])
        assert error[:2] == pytest.approx(seen[:2] - measured[:2])
        assert error[2] == pytest.approx(math.remainder(seen[2] - measured[2], 2 * math.pi))


@pytest.mark.parametrize(("seen", "measured", "error"), [(3.1, -3.1, 6.2), (-3.1, 3.1, -6.2)])
def test_an_error_of_a_heading_is_the_short_way_around(
    seen: float, measured: float, error: float
) -> None:
    edges = BetweenFactors(
        np.array([0]), np.array([1]), np.array([[0.0, 0.0, measured]]), np.eye(3)[None]
    )
    poses = np.array([[0.0, 0.0, 0.0], [0.0, 0.0, seen]])
    wrapped = error - math.copysign(2 * math.pi, error)
    assert pose_errors(poses, edges, edges.measured)[0, 2] == pytest.approx(wrapped)


def test_scale_shortens_a_link_and_yaw_rate_bends_it_over_half_of_the_way() -> None:
    """What wheels that are 10 % and 0.02 rad/m wrong count, put right again."""
    way, turn, scale, yaw = 2.0, 0.3, 0.1, 0.02
    chord = matrix((0, 0, 0.4)) @ [way, 0, 1]
    odometry = OdometryFactors(
        np.array([0, 0]),
        np.array([1, 1]),
        np.array([[*chord[:2], turn], [*chord[:2], turn]]),
        np.tile(np.eye(3), (2, 1, 1)),
        robot=np.array([0, 1]),
        by_yaw=np.tile([-way / 2 * chord[1], way / 2 * chord[0], way], (2, 1)),
    )
    known = Calibration(np.zeros(0), np.array([0.0, scale]), np.array([0.0, yaw]), np.zeros(1))
    right = corrected(odometry, known)
    assert right[0] == pytest.approx([*chord[:2], turn])
    # turned back by half of what the yaw rate added, to first order in it and in scale
    expected = matrix((0, 0, -yaw * way / 2)) @ [*(1 - scale) * chord[:2], 1]
    assert right[1, :2] == pytest.approx(expected[:2], abs=2 * scale * yaw)
    assert right[1, 2] == pytest.approx(turn - yaw * way)


@pytest.mark.parametrize("model", [LINKTRACK, RangeModel(near_reach_m=6.0)])
def test_an_error_of_a_range_is_predicted_minus_measured_with_its_biases(
    model: RangeModel,
) -> None:
    problem, _ = team_problem(2, robots=3, count=4)
    poses, r = problem.initial, problem.ranges
    bias = np.array([0.2, -0.1, 0.3])
    known = Calibration(bias, np.zeros(3), np.zeros(3), np.array([-0.25]))
    error, sight, arm_i, arm_j = range_errors(poses, r, known, model)
    for m in range(len(r)):
        i, j = (product(poses[k], (*q, 0.0)) for k, q in ((r.i[m], r.q_i[m]), (r.j[m], r.q_j[m])))
        apart = (j - i)[:2]
        near = -0.25 * math.exp(-r.measured[m] / model.near_reach_m)
        expected = math.hypot(*apart) + bias[r.pair[m]] + near - r.measured[m]
        assert error[m] == pytest.approx(expected)
        assert sight[m] == pytest.approx(complex(*apart) / math.hypot(*apart))
        assert arm_i[m] == pytest.approx(complex(*(i - poses[r.i[m]])[:2]))
        assert arm_j[m] == pytest.approx(complex(*(j - poses[r.j[m]])[:2]))


def test_some_of_the_factors_are_chosen_with_all_their_columns() -> None:
    problem, _ = team_problem(3, robots=2, count=5)
    which = np.arange(len(problem.ranges)) % 2 == 0
    few = problem.ranges.chosen(which)
    assert len(few) == 3
    for name in ("i", "j", "q_i", "q_j", "measured", "sigma", "pair"):
        assert np.array_equal(getattr(few, name), getattr(problem.ranges, name)[which])
    closures = problem.closures.chosen(np.array([False, True, False]))
    assert np.array_equal(closures.measured, problem.closures.measured[1:2])
    assert len(no_ranges().chosen(np.zeros(0, dtype=bool))) == 0
    assert isinstance(few, RangeFactors)


PRIORS = Priors(np.array([0.3]), np.array([0.03]), np.array([0.01]), np.array([0.05]))


@pytest.mark.parametrize(("value", "share"), [(0.0, 1.0), (0.3, 0.5), (0.9, 0.1)])
def test_the_hold_of_a_prior_with_heavy_tails_gives_way(value: float, share: float) -> None:
    """Half of it at one width, a tenth at three."""
    values = np.array([value])
    assert PRIORS.stiffness(values, PRIORS.bias) == pytest.approx([share / 0.09])
    gauss = replace(PRIORS, has_cauchy_tails=False)
    assert gauss.stiffness(values, PRIORS.bias) == pytest.approx([1 / 0.09])


def test_what_was_learned_adds_up() -> None:
    zero = Calibration.zero(PRIORS)
    assert [len(part) for part in (zero.bias, zero.scale, zero.yaw, zero.near_bias)] == [1] * 4
    step = Calibration(np.array([1.0]), np.array([2.0]), np.array([3.0]), np.array([4.0]))
    twice = zero.plus(step).plus(step)
    assert (twice.bias[0], twice.scale[0], twice.yaw[0], twice.near_bias[0]) == (2, 4, 6, 8)
