"""The last word on a few poses: generalised least squares under the noise of the whole window."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from drslamd.slam.lapack.routines import small_cholesky, small_cholesky_solved
from drslamd.slam.relative_pose.descent import WEAK_PRIOR
from drslamd.slam.relative_pose.range_fit import Minima, RangeFit, stepped
from drslamd.slam.relative_pose.window_noise import WindowNoise
from drslamd.slam.relative_pose.window_stack import Groups
from drslamd.slam.se2 import Array, Index

MOST_ITERATIONS = 12
SAME_SIGMAS = 0.5
"""The covariance stays as it is while no residual has moved by more sigmas ..."""
SAME_SIGHT = 0.1
"""... and no line of sight has turned by more, rad."""
SETTLED = 1e-3
"""A step below this, m and rad, is the last one ..."""
SETTLED_CHI2 = 1e-2
"""... and so is one that promises less (2 log-likelihood)."""
LONGEST = 0.5
"""m, rad: what one step may do."""

_WEAK = WEAK_PRIOR * np.eye(3)


class Refined(NamedTuple):
    """Minima under the noise of the whole window, best first.

    Attributes:
        minima: chi-squared is infinite where the covariance of the window is not one, which absurd
            odometry can bring about.
        e: (k, n) predicted minus measured ranges.
        groups: whose they are; vague windows have none.
    """

    minima: Minima
    e: Array
    groups: Groups


def refine(
    fit: RangeFit, noise: WindowNoise, centred: Array, groups: Groups, wants_vague: bool = False
) -> Refined:
    """Where the noise of their windows puts some minima (k, 2).

    Nowhere where it leaves a window vague, unless that is wanted too.
    """
    run = _Refinement(fit, noise, centred, groups, wants_vague)
    for _ in range(MOST_ITERATIONS):
        if not len(run.at):
            break
        run.step()
    return run.refined()


class _Live(NamedTuple):
    """What is known of k minima: poses, covariances, chi-squared, V^-1 rows and residuals."""

    x: Array
    covariance: Array
    chi2: Array
    weighted: Array
    e: Array


class _Refinement:
    """Of some minima, each window until none of its minima needs another step.

    Attributes:
        at: those that still go on.
    """

    def __init__(
        self, fit: RangeFit, noise: WindowNoise, x: Array, groups: Groups, wants_vague: bool
    ) -> None:
        k, n = len(x), noise.longest
        self._fit, self._noise, self._of = fit, noise, groups.of
        self._looks = not wants_vague
        self._ended = _Live(
            x.copy(), np.zeros((k, 3, 3)), np.zeros(k), np.zeros((k, n, 5)), np.zeros((k, n))
        )
        self._is_vague = np.zeros(k, dtype=bool)
        self.at = np.arange(k)
        self._x, self._factors, self._is_sound = x, [np.empty(0)] * k, np.ones(k, dtype=bool)
        self._made_at = np.full((k, n), np.inf), np.zeros((k, n), dtype=complex)
        self._attend(groups)

    def step(self) -> None:
        u, rows = self._live_fit.linear(self._x)
        self._renew_factors(rows[:, 4], u)
        weighted = small_cholesky_solved(self._factors, rows)
        normal = rows @ weighted
        covariance = np.linalg.inv(normal[:, :3, :3] + _WEAK)
        step = -(covariance @ normal[:, :3, 4:])[..., 0]
        promise = -(normal[:, 4, :3] * step).sum(axis=1)
        chi2 = np.where(self._is_sound, normal[:, 4, 4] - promise, np.inf)
        size = np.abs(step).max(axis=1)
        ends = self._groups.where_all((size < SETTLED) | (promise < SETTLED_CHI2))
        if self._looks:
            self._looks = False
            minima = self._as_they_scatter(Minima(self._x, covariance, chi2), weighted, self._of)
            self._is_vague = self._live_fit.is_vague(minima, self._groups)
            ends = ends | self._is_vague
        self._x = stepped(self._x, step * np.minimum(1.0, LONGEST / (size + 1e-12))[:, None])
        self._live = _Live(self._x, covariance, chi2, weighted, rows[:, 4])
        if ends.any():
            self._end(ends)

    def refined(self) -> Refined:
        self._end(np.ones(len(self.at), dtype=bool))
        known = np.flatnonzero(~self._is_vague)
        groups = Groups(self._of[known])
        known = known[groups.in_order(self._ended.chi2[known])]
        x, covariance, chi2, weighted, e = (values[known] for values in self._ended)
        minima = self._as_they_scatter(Minima(x, covariance, chi2), weighted, groups.of)
        return Refined(minima, e, groups)

    def _end(self, ends: NDArray[np.bool_]) -> None:
        """Some of those that still go on do no longer."""
        if len(self.at):
            for kept, now in zip(self._ended, self._live, strict=True):
                kept[self.at[ends]] = now[ends]
            self._live = _Live(*(values[~ends] for values in self._live))
        stay = ~ends
        self.at, self._x, self._is_sound = self.at[stay], self._x[stay], self._is_sound[stay]
        self._made_at = self._made_at[0][stay], self._made_at[1][stay]
        self._factors = [f for f, stays in zip(self._factors, stay.tolist(), strict=True) if stays]
        self._attend(Groups(self._of[self.at]))

    def _attend(self, groups: Groups) -> None:
        self._groups, self._live_fit = groups, self._fit.rows(groups.of)
        self._sigmas = self._noise.sigmas(groups.of)

    def _renew_factors(self, e: Array, u: Array) -> None:
        """Those of windows in which anything has moved since they were made."""
        old_e, old_u = self._made_at
        same = (np.abs(e - old_e) < SAME_SIGMAS * self._sigmas).all(axis=1)
        same &= (np.abs(u - old_u) < SAME_SIGHT).all(axis=1)
        anew = np.flatnonzero(~self._groups.where_all(same))
        if not len(anew):
            return
        of, e, u = self._groups.of[anew], e[anew], u[anew]
        old_e[anew], old_u[anew] = e, u
        weights = self._noise.weights(of, e)
        covariance = self._noise.covariance(of, u, self._x[anew, 1], weights)
        factors, self._is_sound[anew] = _factors(covariance)
        for k, factor in zip(anew.tolist(), factors, strict=True):
            self._factors[k] = factor

    def _as_they_scatter(self, minima: Minima, weighted: Array, of: Index) -> Minima:
        """Weights are those of what must be allowed for, the covariance that of what is known."""
        gain = minima.covariance @ weighted[:, :, :3].transpose(0, 2, 1)
        return minima._replace(covariance=minima.covariance + self._noise.excess(of, gain))


def _factors(covariance: Array) -> tuple[list[Array], NDArray[np.bool_]]:
    """Cholesky factors, ones where there are none, and which of them there are."""
    factors, sound = small_cholesky(covariance)
    if not sound.all():
        factors[~sound] = np.eye(factors.shape[1])
    return list(factors), sound
