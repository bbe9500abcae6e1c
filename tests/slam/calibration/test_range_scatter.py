"""How much ranges scatter, out of errors that were drawn."""

from __future__ import annotations

import math

import numpy as np
import pytest
from slam_scenes import BANDED, NOISE, group_of, small_team

from drslamd.slam.calibration.range_scatter import PLAIN, PRIOR_RANGES, scatter_ratios
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
