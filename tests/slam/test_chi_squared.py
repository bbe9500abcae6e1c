"""Three degrees of freedom, against scipy.stats."""

from __future__ import annotations

import pytest
from scipy.stats import chi2

from drslamd.slam.chi_squared import cdf3, quantile3


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
