"""Two ways from a window to a believed closure: what each does with the same window."""

from __future__ import annotations

import numpy as np
import pytest
from slam_scenes import NOISE, Array, curved_window, same_pose, window_of

from drslamd.conventions import GRID_US, SECOND_US
from drslamd.slam.calibration.window_calibration import PairCalibration
from drslamd.slam.closure_method import (
    AGREEMENT,
    PAPER_AGREEMENT,
    POINTS,
    ClosureMethod,
    PairWindow,
    drslamd_method,
    paper_method,
)
from drslamd.slam.graph.estimate import Learned
from drslamd.slam.range_model import RangeNoise
from drslamd.slam.relative_pose import algorithm_1, solver
from drslamd.slam.relative_pose.estimate import PairNoise, RelativePoseEstimate, Verdict
from drslamd.slam.relative_pose.window import Window

SENSORS = PairNoise(RangeNoise(0.1, 0.3), NOISE, NOISE)
UNKNOWN = PairCalibration()
KNOWN = PairCalibration(bias=Learned(0.4, 0.01))
DRSLAMD = drslamd_method(40 * SECOND_US, 0.1, uses_calibration=True)
PAPER = paper_method(tau=50, range_sigma=0.1, delta=0.1)


def window(bias: float = 0.0) -> tuple[Window, Array]:
    """Curves at 0.5 m/s for half a minute, all ranges too long by the bias; and the true pose."""
    return curved_window(np.random.default_rng(0), bias=bias)


def alone(method: ClosureMethod, seen: Window, known: PairCalibration) -> RelativePoseEstimate:
    (answer,) = method.solve([PairWindow(seen, SENSORS, known)])
    return answer


@pytest.mark.parametrize("method", [DRSLAMD, PAPER])
def test_both_find_the_pose_of_an_exact_window(method: ClosureMethod) -> None:
    seen, true = window()
    (found,) = alone(method, seen, UNKNOWN).hypotheses
    assert same_pose(found.a_T_b, true, 1e-3)


def test_ours_takes_out_what_was_learned_and_the_papers_does_not() -> None:
    seen, true = window(bias=0.4)
    (better,) = alone(DRSLAMD, seen, KNOWN).hypotheses
    assert same_pose(better.a_T_b, true, 1e-3)
    (plain,) = alone(PAPER, seen, KNOWN).hypotheses
    assert not same_pose(plain.a_T_b, true, 0.1)
    (unaware,) = alone(PAPER, seen, UNKNOWN).hypotheses
    assert np.array_equal(plain.a_T_b, unaware.a_T_b)


def test_ours_is_the_solver_of_module_1_and_the_papers_is_algorithm_1() -> None:
    seen, _ = window(bias=0.1)
    ours, theirs = (alone(m, seen, UNKNOWN).hypotheses[0] for m in (DRSLAMD, PAPER))
    assert ours.a_T_b == pytest.approx(solver.solve(seen, SENSORS, 0.1).hypotheses[0].a_T_b)
    printed = algorithm_1.solve(seen, 0.1, 0.1).hypotheses[0]
    assert np.array_equal(theirs.covariance, printed.covariance)


def test_a_window_without_motion_is_a_verdict_for_ours_and_a_pose_for_the_papers() -> None:
    still = np.tile([[0.0, 0.0, 0.0]], (60, 1))
    seen, _ = window_of(still, still + [4.0, 0, 0])
    assert alone(DRSLAMD, seen, UNKNOWN).verdict is Verdict.UNOBSERVABLE
    assert alone(PAPER, seen, UNKNOWN).verdict is Verdict.UNIQUE


@pytest.mark.parametrize(("seconds", "bin_us"), [(5, GRID_US), (6, GRID_US), (12, 2 * GRID_US)])
def test_a_window_is_thinned_to_so_many_points_but_not_beyond_the_grid(
    seconds: int, bin_us: int
) -> None:
    rule = drslamd_method(seconds * SECOND_US, 0.1, uses_calibration=True).rule
    assert rule.bin_us == bin_us
    assert rule.span_us // rule.bin_us <= POINTS


def test_the_papers_window_is_tau_samples_with_no_second_thoughts() -> None:
    assert PAPER.rule.span_us == 50 * GRID_US
    assert PAPER.rule.bin_us == GRID_US
    assert PAPER.rule.confirm_us == 0
    assert not PAPER.uses_calibration
    assert PAPER.agreement == PAPER_AGREEMENT
    assert DRSLAMD.agreement == AGREEMENT
