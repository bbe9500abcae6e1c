"""Least squares on the ranges of one window, from several start poses at once.

All of it works on centred poses: where the centroid of b's points lies, seen from the centroid of
a's points in frame a, and how b is turned. A window that says little leaves a valley, and the
valley is an arc about that centroid: steps go along the line between both centroids and around it,
so that what is an arc in x and y is straight here.
"""

from __future__ import annotations

import numpy as np

from drslamd.slam.se2 import Array
from drslamd.slam.window_noise import RangeNoise

STEPS = 14
"""Of the refinement at most; what is not settled then lies in a valley without an end."""
SETTLED_CHI2 = 0.3
"""A step that promises less than this (2 log-likelihood) is not worth the next one."""
HOPELESS, HOPELESS_CHI2 = 5.0, 60.0
"""A minimum that is worse by this factor and sum cannot come back under correlated noise."""
LEAST_DAMPING, MOST_DAMPING = 1e-12, 1e6
"""Relative to the diagonal: above rounding, so that no step meets a singular matrix however
little a window says."""
PRIOR = 1e-9
"""Information, 1/m^2 and 1/rad^2, of directions of which a window says nothing at all."""
ROBUST_SIGMAS = 2.5
"""Huber's threshold: beyond it a range loses weight (bursts are 0.3 m and more)."""
AROUND_M = 1.0
"""Centroids nearer than this have no direction to speak of: steps are straight."""


class RangeFit:
    """The ranges of one window and the points between which they were measured.

    Centred poses are complex (k, 2): place x + iy in m, and heading as a unit number.
    """

    def __init__(self, a: Array, b: Array, ranges: Array) -> None:
        """Points a, b (n, 2) in the reference frames of both robots; ranges (n,) m."""
        a_points, b_points = a[:, 0] + 1j * a[:, 1], b[:, 0] + 1j * b[:, 1]
        self._a_mean, self._b_mean = a_points.mean(), b_points.mean()
        self._a, self._b = a_points - self._a_mean, b_points - self._b_mean
        self._ranges = ranges

    def centred(self, poses: Array) -> Array:
        """Centred poses of poses a_T_b (k, 3)."""
        out = np.empty((len(poses), 2), dtype=complex)
        out[:, 1] = np.exp(1j * poses[:, 2])
        out[:, 0] = poses[:, 0] + 1j * poses[:, 1] + out[:, 1] * self._b_mean - self._a_mean
        return out

    def poses(self, centred: Array) -> Array:
        """Poses a_T_b (k, 3) of centred ones."""
        place = centred[:, 0] + self._a_mean - centred[:, 1] * self._b_mean
        return np.stack([place.real, place.imag, _angle(centred[:, 1])], axis=-1)

    def by_step(self, centred: Array) -> Array:
        """Derivatives (k, 3, 3) of poses a_T_b by a step (see `stepped`)."""
        away, arm = _direction(centred[:, 0]), centred[:, 1] * self._b_mean
        m = np.zeros((len(centred), 3, 3))
        m[:, 0, 0], m[:, 0, 1], m[:, 0, 2] = away.real, -away.imag, arm.imag
        m[:, 1, 0], m[:, 1, 1], m[:, 1, 2] = away.imag, away.real, -arm.real
        m[:, 2, 2] = 1.0
        return m

    def by_arcs(self, centred: Array, covariance: Array) -> Array:
        """(k, 3, 3): what `by_step` leaves out of the covariance of poses a_T_b, because x and y
        of a step are not straight: to second order, about the pose itself.

        With the second derivatives D of x or y by a step, covariance C of a step and x, y as i, j:
        tr(D_i C D_j C) / 2 + tr(D_i C) tr(D_j C) / 4.
        """
        distance = np.abs(centred[:, 0])
        curved = _direction(centred[:, 0]) / np.maximum(distance, AROUND_M)
        curved[distance <= AROUND_M] = 0.0
        d = np.zeros((len(centred), 3, 3), dtype=complex)
        d[:, 1, 1], d[:, 2, 2] = -curved, centred[:, 1] * self._b_mean
        d[:, 0, 1] = d[:, 1, 0] = 1j * curved
        # both at once, as x + iy: E[z z] = xx - yy + 2i xy and E[z conj(z)] = xx + yy
        once = d @ covariance
        other = once.conj()
        drift = np.einsum("kaa->k", once)
        zz = (once * once.transpose(0, 2, 1)).sum(axis=(1, 2)) / 2 + drift**2 / 4
        size = (once * other.transpose(0, 2, 1)).sum(axis=(1, 2)).real / 2 + np.abs(drift) ** 2 / 4
        out = np.zeros((len(centred), 3, 3))
        out[:, 0, 0], out[:, 1, 1] = (size + zz.real) / 2, (size - zz.real) / 2
        out[:, 0, 1] = out[:, 1, 0] = zz.imag / 2
        return out

    def linear(self, centred: Array) -> tuple[Array, Array]:
        """Equation 1 about centred poses.

        Returns:
            Unit lines of sight from a to b in frame a, complex (k, n); and (k, 5, n): derivatives
            of the range by the three parts of a step (see `stepped`), by the bias, and the
            predicted range minus the measured one.
        """
        turned = centred[:, 1:] * self._b
        sight = turned - self._a
        sight += centred[:, :1]
        distance = np.maximum(np.abs(sight), 1e-6)
        u = sight / distance
        along = u * _direction(centred[:, :1]).conj()
        rows = np.empty((len(centred), 5, len(self._ranges)))
        rows[:, 0], rows[:, 1] = along.real, along.imag
        rows[:, 2] = (u * turned.conj()).imag
        rows[:, 3] = 1.0
        np.subtract(distance, self._ranges, out=rows[:, 4])
        return u, rows


def stepped(centred: Array, step: Array) -> Array:
    """Centred poses after steps (k, 3): away from a, around a (both m), heading (rad)."""
    place = centred[:, 0]
    distance = np.abs(place)
    angles = step[:, 1:3].copy()
    angles[:, 0] /= np.maximum(distance, AROUND_M)
    out: Array = np.exp(1j * angles)
    away = distance + step[:, 0]
    arc, straight = away * out[:, 0], away + 1j * step[:, 1]
    out[:, 0] = _direction(place) * np.where(distance > AROUND_M, arc, straight)
    out[:, 1] *= centred[:, 1]
    return out


def _angle(number: Array) -> Array:
    return np.asarray(np.arctan2(number.imag, number.real))


def _direction(place: Array) -> Array:
    return np.asarray(np.exp(1j * _angle(place)))


def refine(fit: RangeFit, seeds: Array, noise: RangeNoise) -> Array:
    """Robust Levenberg-Marquardt on all seeds at once, the pair's bias a fourth unknown.

    Args:
        fit: the window.
        seeds: (k, 2) centred poses.
        noise: sigmas.

    Returns:
        (k, 2) the minima, best first, without those that are worse than the best beyond doubt.
    """
    x, bias = seeds, np.zeros(len(seeds))
    damping = np.full(len(x), 1e-3)
    cost, normal = _normal_equations(fit, x, bias, noise)
    for _ in range(STEPS):
        step, promise = _damped_step(normal, damping)
        trial, trial_bias = stepped(x, step), bias + step[:, 3]
        trial_cost, trial_normal = _normal_equations(fit, trial, trial_bias, noise)
        settled = (promise < SETTLED_CHI2) | (damping > MOST_DAMPING)
        better = trial_cost <= cost
        x = np.where(better[:, None], trial, x)
        bias = np.where(better, trial_bias, bias)
        cost = np.where(better, trial_cost, cost)
        normal = np.where(better[:, None, None], trial_normal, normal)
        damping *= np.where(better, 0.2, 8.0)
        hopeful = cost < cost.min() * HOPELESS + HOPELESS_CHI2
        if (settled | ~hopeful).all():
            break
    order = np.argsort(cost, kind="stable")
    return np.asarray(x[order[hopeful[order]]])


def _damped_step(normal: Array, damping: Array) -> tuple[Array, Array]:
    """Steps (k, 4), and (k,) what they promise to take off the cost: at most that much."""
    hessian, gradient = normal[:, :4, :4].copy(), normal[:, :4, 4:]
    diagonal = np.einsum("kii->ki", hessian)
    diagonal *= 1 + np.maximum(damping, LEAST_DAMPING)[:, None]
    step = np.linalg.solve(hessian, gradient)
    return -step[..., 0], (step * gradient).sum(axis=(1, 2))


def _normal_equations(
    fit: RangeFit, x: Array, bias: Array, noise: RangeNoise
) -> tuple[Array, Array]:
    """Huber's cost (k,), and (k, 5, 5): Gauss-Newton Hessian, gradient in the last column."""
    _, rows = fit.linear(x)
    e = rows[:, 4]
    e += bias[:, None]
    beyond = ROBUST_SIGMAS * noise.sigma
    weighted = rows * (beyond / np.maximum(np.abs(e), beyond))[:, None]
    normal = weighted @ rows.transpose(0, 2, 1)
    normal *= noise.sigma**-2.0
    # e^2 within the threshold, 2 c |e| - c^2 beyond it
    shrunk = weighted[:, 4]
    cost = 2 * normal[:, 4, 4] - np.einsum("kn,kn->k", shrunk, shrunk) * noise.sigma**-2.0
    prior = noise.bias_sigma**-2.0
    cost += bias * bias * prior
    normal[:, 3, 4] += bias * prior
    normal[:, 3, 3] += prior
    np.einsum("kii->ki", normal)[:, :4] += PRIOR
    return cost, normal
