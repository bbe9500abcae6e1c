"""How much ranges scatter, out of errors that were drawn."""

from __future__ import annotations

import math

import numpy as np
import pytest
from slam_scenes import BANDED, NOISE, group_of, small_team

from drslamd.slam.calibration import range_scatter
from drslamd.slam.calibration.range_scatter import (
    GAUSSIAN,
    LEAST_SCATTER,
    PLAIN,
    PRIOR_RANGES,
    SideBySide,
    inlier_scatter,
    scatter_ratios,
)
from drslamd.slam.se2 import Array, Index

MANY = 20_000
ONE = np.zeros(MANY, dtype=np.int64)


def ratios(errors: Array, sigmas: Array, pair: Index, pairs: int) -> Array:
    """0.10 m is configured, and errors count up to 2.5 sigmas."""
    return scatter_ratios(errors, sigmas, pair, pairs=pairs, configured=0.1, most_sigmas=2.5)


@pytest.mark.parametrize("true", [0.4, 1.0, 1.4])
def test_many_ranges_tell_how_much_they_scatter(true: float) -> None:
    errors = np.random.default_rng(0).normal(0, 0.1 * true, MANY)
    found = ratios(errors, np.full(MANY, 0.1), ONE, 1)
    # of 1.4 times the sigma, what lies beyond 2.5 counts as 2.5
    assert found == pytest.approx([true], rel=0.02 if true <= 1 else 0.08)


def test_a_few_ranges_tell_little_and_none_nothing() -> None:
    errors, sigmas = np.zeros(PRIOR_RANGES), np.full(PRIOR_RANGES, 0.1)
    found = ratios(errors, sigmas, ONE[:PRIOR_RANGES] + 1, 3)
    assert found == pytest.approx([1.0, math.sqrt(0.5), 1.0])


def test_every_pair_has_its_own() -> None:
    rng = np.random.default_rng(1)
    pair = np.arange(MANY) % 2
    errors = rng.normal(0, np.where(pair, 0.08, 0.05))
    assert ratios(errors, np.full(MANY, 0.1), pair, 2) == pytest.approx([0.5, 0.8], rel=0.03)


def test_bursts_hardly_count() -> None:
    rng = np.random.default_rng(2)
    errors = rng.normal(0, 0.06, MANY)
    errors[::100] += 3.0
    found = ratios(errors, np.full(MANY, 0.1), ONE, 1)[0]
    # 1 % at 2.5 sigmas, whatever their size
    assert found == pytest.approx(math.sqrt(0.99 * 0.6**2 + 0.01 * 2.5**2), rel=0.02)


@pytest.mark.parametrize(("times", "is_counted"), [(PLAIN * 0.999, True), (PLAIN * 1.001, False)])
def test_ranges_that_are_doubted_tell_nothing_of_the_others(times: float, is_counted: bool) -> None:
    """Short and blocked ranges carry larger sigmas, and would look better than they are."""
    sigmas = np.full(MANY, 0.1)
    sigmas[::2] *= times
    errors = np.where(np.arange(MANY) % 2, 0.1, 0.0)
    found = ratios(errors, sigmas, ONE, 1)[0]
    assert found == pytest.approx(math.sqrt(0.5) if is_counted else 1.0, rel=0.01)


@pytest.mark.parametrize("sent", [0.1, 0.15, 0.22])
def test_a_pair_that_is_doubted_always_scatters_as_it_does(sent: float) -> None:
    """Robots that stay side by side, or behind a wall: no range has the configured sigma."""
    errors = np.random.default_rng(3).normal(0, 0.1, MANY)
    found = ratios(errors, np.full(MANY, sent), ONE, 1)
    assert found == pytest.approx([1.0], rel=0.03)


@pytest.mark.parametrize("true", [0.03, 0.05, 0.07])
def test_module_3_finds_how_much_the_ranges_of_each_pair_scatter(true: float) -> None:
    """0.10 m is configured; with the odometry of a drive they are told apart."""
    team = small_team(7, count=200, range_sigma=true, noise=NOISE)
    group = group_of(team.graph)
    estimate = BANDED.job(team.graph, group, None, {})()
    assert set(estimate.scatter) == {(0, 1), (0, 2), (1, 2)}
    count, prior = 200, PRIOR_RANGES
    expected = math.sqrt((prior + count * (true / 0.10) ** 2) / (prior + count))
    assert list(estimate.scatter.values()) == pytest.approx([expected] * 3, rel=0.2)


# of ranges that are no outliers


def inlier_ratios(errors: Array, sigmas: Array, pair: Index, pairs: int) -> Array:
    return inlier_scatter(errors, sigmas, SideBySide.of(pair, pairs), sigmas_cut=2.5)


@pytest.mark.parametrize("true", [0.4, 0.6, 0.9])
def test_errors_of_gauss_come_out_as_they_were_drawn(true: float) -> None:
    """What the weights take off is put back, to some percent."""
    errors = np.random.default_rng(4).normal(0, 0.1 * true, MANY)
    found = inlier_ratios(errors, np.full(MANY, 0.1), ONE, 1)
    assert found == pytest.approx([true], rel=0.03)


def test_what_the_weights_take_off_is_two_thirds_of_a_variance() -> None:
    """Of z^2 with Cauchy's weight squared, for a cut at 2.5 sigmas."""
    z = np.linspace(-12, 12, 100_001)
    weights = (1 + (z / 2.5) ** 2) ** -2 * np.exp(-(z**2) / 2)
    left = float((weights * z**2).sum() / weights.sum())
    assert pytest.approx(1 / left, rel=0.05) == GAUSSIAN


@pytest.mark.parametrize(
    ("share", "metres", "trace"), [(0.05, 1.0, 0.02), (0.3, 1.0, 0.12), (0.3, 10.0, 0.01)]
)
def test_bursts_leave_hardly_a_trace(share: float, metres: float, trace: float) -> None:
    """The farther off the less, though a third of the ranges were off."""
    rng = np.random.default_rng(5)
    errors, sigmas = rng.normal(0, 0.06, MANY), np.full(MANY, 0.1)
    clean = inlier_ratios(errors, sigmas, ONE, 1)
    errors[: int(share * MANY)] += metres
    assert inlier_ratios(errors, sigmas, ONE, 1) == pytest.approx(clean, rel=trace)


@pytest.mark.parametrize(("true", "found"), [(3.0, 1.0), (1.1, 1.0), (0.05, LEAST_SCATTER)])
def test_scatter_is_never_more_than_configured_nor_less_than_a_module_can(
    true: float, found: float
) -> None:
    errors = np.random.default_rng(6).normal(0, 0.1 * true, MANY)
    assert inlier_ratios(errors, np.full(MANY, 0.1), ONE, 1) == pytest.approx([found])


@pytest.mark.parametrize(("true", "is_held"), [(0.27, True), (0.33, False)])
def test_a_module_is_believed_to_be_three_times_better_and_no_more(
    true: float, is_held: bool
) -> None:
    errors = np.random.default_rng(6).normal(0, 0.1 * true, MANY)
    found = inlier_ratios(errors, np.full(MANY, 0.1), ONE, 1)[0]
    assert bool(found == LEAST_SCATTER) is is_held


def test_each_pair_and_each_range_has_its_own_sigma() -> None:
    """Ranges that are doubted count by the sigma that they were sent with."""
    rng = np.random.default_rng(7)
    pair = np.arange(MANY) % 2
    sigmas = np.where(np.arange(MANY) % 4 < 2, 0.1, 0.3)
    errors = rng.normal(0, sigmas * np.where(pair, 0.8, 0.5))
    assert inlier_ratios(errors, sigmas, pair, 2) == pytest.approx([0.5, 0.8], rel=0.04)


def test_a_few_exact_ranges_halve_the_variance_and_none_changes_nothing() -> None:
    errors, sigmas = np.zeros(PRIOR_RANGES), np.full(PRIOR_RANGES, 0.1)
    found = inlier_ratios(errors, sigmas, ONE[:PRIOR_RANGES] + 1, 3)
    assert found == pytest.approx([1.0, math.sqrt(0.5), 1.0])
    assert inlier_ratios(np.zeros(0), np.zeros(0), ONE[:0], 2).tolist() == [1.0, 1.0]


def test_another_round_of_weighing_would_change_little(monkeypatch: pytest.MonkeyPatch) -> None:
    errors = np.random.default_rng(8).normal(0, 0.04, MANY)
    errors[::7] += 0.5
    once = inlier_ratios(errors, np.full(MANY, 0.1), ONE, 1)
    monkeypatch.setattr(range_scatter, "ROUNDS", 16)
    assert inlier_ratios(errors, np.full(MANY, 0.1), ONE, 1) == pytest.approx(once, rel=0.02)


def test_a_pair_is_weighed_as_if_it_were_alone() -> None:
    """However many ranges the others have, and in whatever order they come."""
    rng = np.random.default_rng(9)
    pair = rng.permutation(np.repeat([0, 2, 3], [5, 400, 60]))
    errors, sigmas = rng.normal(0, 0.06, len(pair)), rng.uniform(0.05, 0.2, len(pair))
    together = inlier_ratios(errors, sigmas, pair, 4)
    for name in range(4):
        mine = pair == name
        alone = inlier_ratios(errors[mine], sigmas[mine], np.zeros(mine.sum(), dtype=int), 1)
        assert together[name] == pytest.approx(alone[0], rel=1e-12)
