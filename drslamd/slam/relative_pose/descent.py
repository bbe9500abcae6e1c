"""Nonlinear least squares on the ranges of one window, from several start poses at once."""

from __future__ import annotations

import numpy as np

from drslamd.slam import headway
from drslamd.slam.range_model import LINKTRACK, RangeModel, RangeNoise
from drslamd.slam.relative_pose.range_fit import Minima, RangeFit, stepped
from drslamd.slam.se2 import Array

FIRST_ITERATIONS = 3
"""Until a first look, when most seeds are settled."""
ITERATIONS = 14
"""In all; what is not settled then lies in a valley without an end."""
SETTLED_CHI2 = 0.3
"""A step that promises less than this (2 log-likelihood) is not worth the next one."""
HOPELESS = 5.0
"""A minimum that is worse than the best by this factor and `HOPELESS_CHI2` cannot come back when
ranges count as correlated."""
HOPELESS_CHI2 = 60.0
"""See `HOPELESS`."""
LEAST_DAMPING = 1e-12
"""Relative to the diagonal: above rounding, so that no step meets a singular matrix however little
a window says."""
MOST_DAMPING = 1e6
"""Where even this does not lower the cost, no step does."""
WEAK_PRIOR = 1e-9
"""Information, 1/m^2 and 1/rad^2, of directions of which a window says nothing at all."""


class Descent:
    """Robust Levenberg-Marquardt from all seeds at once, the pair's bias a fourth unknown."""

    def __init__(
        self, fit: RangeFit, seeds: Array, noise: RangeNoise, model: RangeModel = LINKTRACK
    ) -> None:
        """From centred poses (k, 2)."""
        self._fit, self._noise, self._huber = fit, noise, model.huber_sigmas
        self._x, self._bias = seeds, np.zeros(len(seeds))
        self._damping = np.full(len(seeds), 1e-3)
        self._cost, self._normal = _normal_equations(fit, seeds, self._bias, noise, self._huber)
        self._is_settled = False

    def run(self, steps: int) -> None:
        """At most so many steps, until all that may still count are settled."""
        for _ in range(steps):
            if self._is_settled:
                break
            headway.mark()
            step, promise = _damped_step(self._normal, self._damping)
            x, bias = stepped(self._x, step), self._bias + step[:, 3]
            cost, normal = _normal_equations(self._fit, x, bias, self._noise, self._huber)
            settled = (promise < SETTLED_CHI2) | (self._damping > MOST_DAMPING)
            better = cost <= self._cost
            self._x = np.where(better[:, None], x, self._x)
            self._bias = np.where(better, bias, self._bias)
            self._cost = np.where(better, cost, self._cost)
            self._normal = np.where(better[:, None, None], normal, self._normal)
            self._damping *= np.where(better, 0.2, 8.0)
            self._is_settled = bool((settled | ~self._may_count()).all())

    def minima(self) -> Minima:
        """Best first, without those that are worse than the best beyond doubt.

        What ranges scatter counts as white and never as more than was allowed for, which flatters.
        """
        order = np.argsort(self._cost, kind="stable")
        order = order[self._may_count()[order]]
        covariance = np.linalg.inv(self._normal[order, :4, :4])[:, :3, :3]
        covariance *= min(1.0, self._noise.scatter) ** 2
        return Minima(self._x[order], covariance, self._cost[order])

    def _may_count(self) -> Array:
        return np.asarray(self._cost < self._cost.min() * HOPELESS + HOPELESS_CHI2)


def _damped_step(normal: Array, damping: Array) -> tuple[Array, Array]:
    """Steps (k, 4), and (k,) what they promise to take off the cost: at most that much."""
    hessian, gradient = normal[:, :4, :4].copy(), normal[:, :4, 4:]
    diagonal = np.einsum("kii->ki", hessian)
    diagonal *= 1 + np.maximum(damping, LEAST_DAMPING)[:, None]
    step = np.linalg.solve(hessian, gradient)[..., 0]
    return -step, (step * gradient[..., 0]).sum(axis=1)


def _normal_equations(
    fit: RangeFit, x: Array, bias: Array, noise: RangeNoise, huber_sigmas: float
) -> tuple[Array, Array]:
    """Huber's cost (k,), and (k, 5, 5): Gauss-Newton Hessian, gradient in the last column."""
    _, rows = fit.linear(x)
    e = rows[:, 4]
    e += bias[:, None]
    beyond = huber_sigmas * noise.sigma
    weighted = rows * (huber_sigmas / noise.sigma / np.maximum(np.abs(e), beyond))[:, None]
    normal = weighted @ rows.transpose(0, 2, 1)
    # e^2 within the threshold, 2 c |e| - c^2 beyond it
    shrunk = weighted[:, 4]
    cost = 2 * normal[:, 4, 4] - np.einsum("kn,kn->k", shrunk, shrunk) * noise.sigma**2
    prior = noise.bias_sigma**-2.0
    cost += bias * bias * prior
    normal[:, 3, 4] += bias * prior
    normal[:, 3, 3] += prior
    np.einsum("kii->ki", normal)[:, :4] += WEAK_PRIOR
    return cost, normal
