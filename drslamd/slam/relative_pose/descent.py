"""Nonlinear least squares on the ranges of windows, from several start poses of each at once."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from drslamd.slam import headway
from drslamd.slam.range_model import LINKTRACK, RangeModel, RangeNoise
from drslamd.slam.relative_pose.range_fit import Minima, RangeFit, stepped
from drslamd.slam.relative_pose.window_stack import Groups
from drslamd.slam.se2 import Array, Index

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
FIRST_DAMPING = 1e-3
LEAST_DAMPING = 1e-12
"""Relative to the diagonal: above rounding, so that no step meets a singular matrix however little
a window says."""
MOST_DAMPING = 1e6
"""Where even this does not lower the cost, no step does."""
WEAK_PRIOR = 1e-9
"""Information, 1/m^2 and 1/rad^2, of directions of which a window says nothing at all."""


class _Weights(NamedTuple):
    """How ranges weigh, for each of k windows or seeds.

    Attributes:
        variance: (k,) of a range, m^2.
        beyond: (k, 1) where Huber's cost leaves the square, m; slope: of the cost there, over that.
        prior: (k,) information of the bias, 1/m^2.
        flattery: (k, 1, 1) factor of covariances: what ranges scatter never counts as more than was
            allowed for.
    """

    variance: Array
    beyond: Array
    slope: Array
    prior: Array
    flattery: Array

    @staticmethod
    def of(noises: Sequence[RangeNoise], huber_sigmas: float) -> _Weights:
        rows = np.array([(n.sigma, n.bias_sigma, min(1.0, n.scatter)) for n in noises])
        sigma, bias, scatter = rows.T
        sigmas = sigma[:, None]
        slope = huber_sigmas / sigmas
        return _Weights(
            sigma * sigma, huber_sigmas * sigmas, slope, bias**-2.0, scatter[:, None, None] ** 2
        )

    def rows(self, of: Index | NDArray[np.bool_]) -> _Weights:
        """Those of windows or seeds `of` (k,); the only ones stand for as many as are asked."""
        if len(self.variance) == 1:
            return self
        return _Weights(*(values[of] for values in self))


class _State(NamedTuple):
    """Of k seeds: centred poses (k, 2), normal equations (k, 5, 5), else (k,)."""

    x: Array
    bias: Array
    damping: Array
    cost: Array
    normal: Array


class Descent:
    """Robust Levenberg-Marquardt from all seeds at once, the pair's bias a fourth unknown.

    The seeds of one window go on until none of them needs another step; those of another window
    make no difference to them.
    """

    def __init__(
        self,
        fit: RangeFit,
        seeds: Array,
        noises: Sequence[RangeNoise],
        of: Index | None = None,
        model: RangeModel = LINKTRACK,
    ) -> None:
        """
        Args:
            fit: of all windows.
            seeds: (k, 2) centred poses, those of one window beside each other.
            noises: of the ranges of each window.
            of: (k,) the window of each seed, ascending; where there is only one nobody need say so.
        """
        k = len(seeds)
        self._of = np.zeros(k, dtype=np.int64) if of is None else of
        self._fit = fit
        self._all_weights = _Weights.of(noises, model.huber_sigmas).rows(self._of)
        self._at = np.arange(k)
        self._attend()
        bias = np.zeros(k)
        cost, normal = _normal_equations(self._live_fit, seeds, bias, self._weights)
        self._live = self._all = _State(seeds, bias, np.zeros(k) + FIRST_DAMPING, cost, normal)

    def run(self, steps: int) -> None:
        """At most so many steps, until all that may still count are settled."""
        for _ in range(steps):
            if not len(self._at):
                break
            headway.mark()
            self._advance()

    def leave(self, windows: NDArray[np.bool_]) -> None:
        """Of these windows (w,) nothing more is wanted."""
        self._keep()
        stay = ~windows[self._of]
        goes_on = np.zeros(len(self._of), dtype=bool)
        goes_on[self._at] = True
        self._of, self._all_weights = self._of[stay], self._all_weights.rows(stay)
        self._all = _State(*(values[stay] for values in self._all))
        self._at = np.flatnonzero(goes_on[stay])
        self._live = _State(*(values[self._at] for values in self._all))
        self._attend()

    def minima(self) -> tuple[Minima, Groups]:
        """Best first for each window, without those that are worse than its best beyond doubt.

        What ranges scatter counts as white and never as more than was allowed for, which flatters.
        """
        self._keep()
        groups = Groups(self._of)
        order = groups.in_order(self._all.cost)
        order = order[_may_count(self._all.cost, groups)[order]]
        covariance = np.linalg.inv(self._all.normal[order, :4, :4])[:, :3, :3]
        covariance *= self._all_weights.rows(order).flattery
        found = Minima(self._all.x[order], covariance, self._all.cost[order])
        return found, Groups(self._of[order])

    def _advance(self) -> None:
        before = self._live
        step, promise = _damped_step(before.normal, before.damping)
        x, bias = stepped(before.x, step), before.bias + step[:, 3]
        cost, normal = _normal_equations(self._live_fit, x, bias, self._weights)
        settled = (promise < SETTLED_CHI2) | (before.damping > MOST_DAMPING)
        better = cost <= before.cost
        if not better.all():
            x = np.where(better[:, None], x, before.x)
            bias, cost = np.where(better, bias, before.bias), np.where(better, cost, before.cost)
            normal = np.where(better[:, None, None], normal, before.normal)
        damping = before.damping * np.where(better, 0.2, 8.0)
        self._live = _State(x, bias, damping, cost, normal)
        if not settled.any():
            return  # nor is the best of any window
        done = self._groups.where_all(settled | ~_may_count(cost, self._groups))
        if done.any():
            self._keep()
            self._at = self._at[~done]
            self._live = _State(*(values[~done] for values in self._live))
            self._attend()

    def _keep(self) -> None:
        """Let what is known of all seeds be what is known of those that still go on."""
        if len(self._at) == len(self._of):
            self._all = self._live
        elif len(self._at):
            self._all = _State(*(values.copy() for values in self._all))
            for known, now in zip(self._all, self._live, strict=True):
                known[self._at] = now

    def _attend(self) -> None:
        """To the seeds that still go on."""
        of = self._of[self._at]
        self._groups, self._live_fit = Groups(of), self._fit.rows(of)
        self._weights = self._all_weights.rows(self._at)


def _may_count(cost: Array, groups: Groups) -> NDArray[np.bool_]:
    return np.asarray(cost < groups.least(cost) * HOPELESS + HOPELESS_CHI2)


def _damped_step(normal: Array, damping: Array) -> tuple[Array, Array]:
    """Steps (k, 4), and (k,) what they promise to take off the cost: at most that much."""
    hessian, gradient = normal[:, :4, :4].copy(), normal[:, :4, 4:]
    hessian.reshape(-1, 16)[:, ::5] *= 1 + np.maximum(damping, LEAST_DAMPING)[:, None]
    step = np.linalg.solve(hessian, gradient)
    return -step[..., 0], (step.transpose(0, 2, 1) @ gradient)[:, 0, 0]


def _normal_equations(
    fit: RangeFit, x: Array, bias: Array, weights: _Weights
) -> tuple[Array, Array]:
    """Huber's cost (k,), and (k, 5, 5): Gauss-Newton Hessian, gradient in the last column."""
    _, rows = fit.linear(x, bias)
    weight = np.abs(rows[:, 4])
    np.maximum(weight, weights.beyond, out=weight)
    np.divide(weights.slope, weight, out=weight)
    weighted = rows * weight[:, None]
    normal = weighted @ rows.transpose(0, 2, 1)
    # e^2 within the threshold, 2 c |e| - c^2 beyond it
    shrunk = weighted[:, 4:]
    square = (shrunk @ shrunk.transpose(0, 2, 1))[:, 0, 0]
    cost = 2 * normal[:, 4, 4] - square * weights.variance
    cost += bias * bias * weights.prior
    normal[:, 3, 4] += bias * weights.prior
    normal[:, 3, 3] += weights.prior
    normal.reshape(-1, 25)[:, :24:6] += WEAK_PRIOR
    return cost, normal
