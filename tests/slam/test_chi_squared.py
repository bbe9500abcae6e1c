"""Three degrees of freedom, against scipy.stats."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.stats import chi2, invgamma

from drslamd.slam.chi_squared import LEVEL_FREEDOM, cdf3, evidence, quantile3


@pytest.mark.parametrize("x", [1e-6, 0.1, 1.0, 2.366, 6.2514, 7.8147, 14.16, 40.0, 200.0])
def test_the_distribution_is_that_of_scipy(x: float) -> None:
    assert cdf3(x) == pytest.approx(float(chi2.cdf(x, 3)), rel=1e-9, abs=1e-12)


@pytest.mark.parametrize("p", [1e-6, 0.05, 0.5, 0.9, 0.95, 0.99, 0.9973, 1 - 1e-9])
def test_the_quantile_is_that_of_scipy(p: float) -> None:
    assert quantile3(p) == pytest.approx(float(chi2.ppf(p, 3)), rel=1e-6)
    assert cdf3(quantile3(p)) == pytest.approx(p, abs=1e-9)


@pytest.mark.parametrize("x", [0.0, -1.0])
def test_nothing_is_shorter_than_nothing(x: float) -> None:
    assert cdf3(x) == 0.0


def test_the_ends_of_the_scale_are_numbers_too() -> None:
    assert quantile3(0.0) == pytest.approx(0.0, abs=1e-9)
    assert 70 < quantile3(1 - 1e-16) < 100


@pytest.mark.parametrize(("best", "worse"), [(3.0, 4.0), (20.0, 4.0), (20.0, 40.0), (8.0, -4.0)])
@pytest.mark.parametrize("freedom", [6, 25])
def test_evidence_is_what_any_level_of_noise_leaves_of_a_difference(
    best: float, worse: float, freedom: int
) -> None:
    """Gauss's likelihood of both, integrated over a variance that is likely the configured one."""
    prior = invgamma(LEVEL_FREEDOM / 2, scale=LEVEL_FREEDOM / 2)

    def marginal(chi_squared: float) -> float:
        def likelihood(variance: float) -> float:
            gauss = variance ** (-freedom / 2) * np.exp(-chi_squared / 2 / variance)
            return float(gauss * prior.pdf(variance))

        return float(quad(likelihood, 0, np.inf, epsabs=0, limit=200)[0])

    expected = 2 * np.log(marginal(best) / marginal(best + worse))
    assert evidence(worse, best, freedom) == pytest.approx(expected, rel=1e-5)


def test_what_does_not_fit_at_all_is_excluded_and_what_fits_much_better_is_no_error() -> None:
    assert evidence(float("inf"), 3.0, 10) == float("inf")
    assert np.isfinite(evidence(-9.9, 10.0, 10))
