"""The end of a window: where it lies off the rest, and where only the far part does."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from slam_scenes import NOISE, Array, curved_window, same_pose
from window_scenes import fit_of, noise_of

from drslamd.slam import se2
from drslamd.slam.odometry.correction import Correction
from drslamd.slam.range_model import RangeNoise
from drslamd.slam.relative_pose import window_end
from drslamd.slam.relative_pose.estimate import PairNoise, Verdict
from drslamd.slam.relative_pose.gls import Refined, refine
from drslamd.slam.relative_pose.solver import solve
from drslamd.slam.relative_pose.window import Window
from drslamd.slam.relative_pose.window_end import NEWEST, OFF_SIGMAS, end_is_off, surprise
from drslamd.slam.relative_pose.window_noise import WindowNoise
from drslamd.slam.relative_pose.window_stack import Groups

RANGES = RangeNoise(0.10, 0.30)


def bent() -> tuple[Window, Array]:
    """A scale of 6 % too much, two sigmas of what is configured, and the true a_T_b."""
    window, true = curved_window(np.random.default_rng(3), 9.0)
    split = window.before
    whole = np.concatenate([window.a_poses[:split], np.zeros((1, 3)), window.a_poses[split:]])
    path = Correction(scale=-0.06).path(whole)
    seen = se2.between(path[split], path)
    return replace(window, a_poses=np.concatenate([seen[:split], seen[split + 1 :]])), true


def longer_at_the_end(window: Window, by: float) -> Window:
    ranges = window.ranges.copy()
    ranges[-NEWEST:] += by
    return replace(window, ranges=ranges)


def refined(window: Window, start: Array) -> tuple[WindowNoise, Refined]:
    """The minimum next to a pose."""
    fit, noise = fit_of(window), noise_of(window, RANGES, NOISE, NOISE)
    groups = Groups(np.zeros(1, dtype=np.int64))
    return noise, refine(fit, noise, fit.centred(start[None]), groups)


def off_the_middle(found: Refined) -> float:
    return float(np.median(np.abs(found.e[0, -NEWEST:] - np.median(found.e[0]))))


def test_an_end_is_right_where_odometry_has_bent_the_far_part_and_wrong_where_ranges_jump() -> None:
    window, true = bent()
    assert off_the_middle(refined(window, true)[1]) > 1.2 * OFF_SIGMAS * RANGES.sigma
    found = solve(window, PairNoise(RANGES, NOISE, NOISE), 0.1)
    assert found.verdict is Verdict.UNIQUE
    assert same_pose(found.hypotheses[0].a_T_b, true, 0.1)
    jumped = longer_at_the_end(window, 0.8)
    assert solve(jumped, PairNoise(RANGES, NOISE, NOISE), 0.1).verdict is Verdict.POOR_FIT


@pytest.mark.parametrize("by", [0.3, 0.9])
def test_what_is_left_open_of_an_end_is_what_the_precision_of_the_whole_window_says(
    by: float,
) -> None:
    """The conditional of a Gaussian by the inverse of the whole covariance, in which the end counts
    however far it is off."""
    window, true = bent()
    window = longer_at_the_end(window, by)
    fit, (noise, found) = fit_of(window), refined(window, true)
    of, x = found.groups.of, found.minima.centred
    u, rows = fit.linear(x)
    weights = noise.weights(of, rows[:, 4])
    weights[:, -NEWEST:] = 1.0
    lower = noise.covariance(of, u, x[:, 1], weights)[0]
    precision = np.linalg.inv(np.tril(lower) + np.tril(lower, -1).T)
    left = np.linalg.inv(precision[-NEWEST:, -NEWEST:])
    e = rows[0, 4]
    off = e[-NEWEST:] + left @ precision[-NEWEST:, :-NEWEST] @ e[:-NEWEST]
    known = np.median(np.abs(off) / np.sqrt(np.diag(left)))
    assert surprise(fit, noise, found, np.zeros(1, dtype=np.int64)) == pytest.approx(known)


@pytest.mark.parametrize("by", [-0.01, 0.01])
def test_an_end_is_off_just_above_the_least_surprise(
    by: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    window, true = bent()
    window = longer_at_the_end(window, 0.5)
    fit, (noise, found) = fit_of(window), refined(window, true)
    least = surprise(fit, noise, found, np.zeros(1, dtype=np.int64)) - by
    monkeypatch.setattr(window_end, "SURPRISE", least)
    monkeypatch.setattr(window_end, "OFF_SIGMAS", 0.0)
    assert end_is_off(fit, noise, found).tolist() == [by > 0]


@pytest.mark.parametrize("by", [-0.001, 0.001])
def test_who_is_near_the_middle_of_all_is_not_asked(
    by: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    window, true = bent()
    fit, (noise, found) = fit_of(window), refined(window, true)
    monkeypatch.setattr(window_end, "SURPRISE", 0.0)
    monkeypatch.setattr(window_end, "OFF_SIGMAS", off_the_middle(found) / RANGES.sigma - by)
    assert end_is_off(fit, noise, found).tolist() == [by > 0]
