"""The model of a range, against values worked out by hand and against drawn errors."""

from __future__ import annotations

import math

import numpy as np
import pytest

from drslamd.slam.range_model import LINKTRACK, RangeModel, residuals

FAR = np.full(4, 50.0)
"""Where the bias of short ranges is none."""


def test_a_residual_is_the_predicted_range_minus_the_measured_one() -> None:
    e, u = residuals(np.array([[3 + 4j, -5j, 0j]]), np.array([4.5, 6.0, 1.0]))
    assert e[0].tolist() == pytest.approx([0.5, -1.0, -1.0], abs=1e-5)
    assert u[0, :2].tolist() == pytest.approx([0.6 + 0.8j, -1j])


def test_the_near_range_bias_fades_by_a_factor_of_e_every_three_metres() -> None:
    shape = LINKTRACK.near_range_shape(np.array([-1.0, 0.0, 3.0, 6.0]))
    assert shape.tolist() == pytest.approx([1.0, 1.0, 1 / math.e, math.e**-2])
    wider = RangeModel(near_reach_m=6.0)
    assert wider.near_range_shape(np.array([6.0])).tolist() == pytest.approx([1 / math.e])


@pytest.mark.parametrize("near_bias", [-0.3, 0.0, 0.3])
def test_what_a_near_range_bias_adds_to_a_range_is_that_at_its_distance(near_bias: float) -> None:
    distances = np.array([0.3, 1.0, 3.0, 8.0])
    near = near_bias * np.exp(-distances / 3)
    found = LINKTRACK.near_range_bias(distances + near, near_bias)
    assert found == pytest.approx(near, abs=3e-4)
    # what the range itself would say is off by up to two centimetres
    by_range = near_bias * np.exp(-(distances + near) / 3)
    assert not near_bias or np.abs(by_range - near).max() > 0.015


def test_ranges_share_a_bias_and_a_slow_part() -> None:
    t = np.array([-9.0, -8.0, -3.0, 0.0])
    rng, count = np.random.default_rng(13), 200_000
    slow = np.empty((count, 4))
    slow[:, 0] = rng.normal(size=count)
    for k, gap in enumerate(np.diff(t)):
        keep = math.exp(-gap / LINKTRACK.slow_s)
        slow[:, k + 1] = keep * slow[:, k] + math.sqrt(1 - keep**2) * rng.normal(size=count)
    white = math.sqrt(1 - LINKTRACK.slow_share**2)
    errors = 0.1 * (LINKTRACK.slow_share * slow + white * rng.normal(size=(count, 4)))
    errors += 0.3 * rng.normal(size=(count, 1))
    seen = errors.T @ errors / count
    assert np.allclose(LINKTRACK.covariance(t, FAR, 0.1, 0.3), seen, atol=1e-3)


@pytest.mark.parametrize(
    ("period_s", "ratio"), [(0.5, 2.6), (1.0, 1.90), (5.0, 1.10), (100.0, 1.0)]
)
def test_many_ranges_are_together_as_much_more_wrong_as_they_share_errors(
    period_s: float, ratio: float
) -> None:
    """The variance of a mean of a thousand over that of as many independent ones."""
    t = period_s * np.arange(1000)
    shared = LINKTRACK.correlated_covariance(t, 0.1).mean() / (0.1**2 / 1000)
    found = LINKTRACK.correlated_ratio(period_s)
    assert found == pytest.approx(math.sqrt(shared), rel=0.01)
    assert found == pytest.approx(ratio, rel=0.02)


def test_short_ranges_share_a_bias_of_their_own() -> None:
    """As LinkTrack modules were measured: 0.13 m more at 0.5 m, 0.07 m at 1.5 m, none beyond."""
    assert LINKTRACK.near_range_sigma(np.array([0.5, 1.5, 8.0])) == pytest.approx(
        [0.14, 0.07, 0.0], abs=0.01
    )
    assert LINKTRACK.near_range_sigma(-0.3) == LINKTRACK.near_range_sigma(0.0)
    t = np.array([-100.0, 0.0])
    near = LINKTRACK.covariance(t, np.array([0.5, 1.5]), 0.1, 0.3)
    far = LINKTRACK.covariance(t, FAR[:2], 0.1, 0.3)
    # at one short range as at the other, so their errors add to each other's covariance
    assert near[0, 1] - far[0, 1] == pytest.approx(0.143 * 0.074, abs=1e-3)
    assert near[1, 1] - far[1, 1] == pytest.approx(0.074**2, abs=1e-3)


@pytest.mark.parametrize(
    ("gap_db", "sigma"),
    [
        (-3.0, 0.0),
        (0.0, 0.0),
        (6.0, 0.0),
        (6.5, 0.0625),
        (8.0, 0.25),
        (9.5, 0.4375),
        (10.0, 0.5),
        (40.0, 0.5),
    ],
)
def test_sigma_grows_from_likely_line_of_sight_to_likely_none(gap_db: float, sigma: float) -> None:
    assert LINKTRACK.blocked_sigma(gap_db, 10.0) == pytest.approx(sigma)
    assert LINKTRACK.blocked_sigma(gap_db, 0.0) == 0.0


def test_a_threshold_of_ones_own_moves_both_ends() -> None:
    assert LINKTRACK.blocked_sigma(10.0, 14.0) == 0.0
    assert LINKTRACK.blocked_sigma(12.0, 14.0) == pytest.approx(LINKTRACK.blocked_sigma_m / 2)
