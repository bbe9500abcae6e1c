"""The ranges of a window as a function of the pose that they are to explain.

All of it works on centred poses: where the centroid of b's points lies, seen from the centroid of
a's points in frame a, and how b is turned. A window that says little leaves a valley, and the
valley is an arc about that centroid. Steps go along the line between both centroids and around it,
so that what is an arc in x and y is straight here.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from drslamd.slam.range_model import residuals
from drslamd.slam.relative_pose.window_stack import Groups, WindowStack
from drslamd.slam.se2 import Array, Index

AROUND_M = 1.0
"""Centroids nearer than this have no direction to speak of: steps are straight."""
MAX_SIGMA_M = 1.5
"""A position known worse than this helps nobody."""
MAX_SIGMA_RAD = 0.5
"""Likewise a heading."""
VAGUE = 1.5
"""A minimum this many times vaguer than allowed hardly ever becomes known by further steps: one
usable window in forty is lost to the first looks, and only among short ones. The time of all short
ones is halved."""
SURELY_CHI2 = 10.0
"""A minimum that is no worse than the best by more than this is hardly ever excluded later."""
POOR_FIT = 4.0
"""Chi-squared per degree of freedom beyond which the model does not explain the window."""
_NOWHERE = 1e-300
"""Added to a place, changes none but the origin."""


class Minima(NamedTuple):
    """k minima, of one window or of several.

    Attributes:
        centred: (k, 2).
        covariance: (k, 3, 3) in parts of a step (see `stepped`).
        chi2: (k,) 2 log-likelihood.
    """

    centred: Array
    covariance: Array
    chi2: Array


class RangeFit:
    """The ranges of windows and the points between which they were measured.

    Centred poses are complex (k, 2): place x + iy in m, and heading as a unit number. Pose k is
    held against the ranges of row k, or all against those of the only one.
    """

    def __init__(
        self, a: Array, b: Array, ranges: Array, held: NDArray[np.bool_] | None = None
    ) -> None:
        """
        Args:
            a, b: (w, n) points in the reference frames of both robots, x + iy, m.
            ranges: (w, n) m.
            held: (w, n) which places hold a measurement, where not all do.
        """
        n = a.shape[1] if held is None else held.sum(axis=1)
        self._a_mean, self._b_mean = a.sum(axis=1) / n, b.sum(axis=1) / n
        self._a, self._b = a - self._a_mean[:, None], b - self._b_mean[:, None]
        self._ranges, self._held = ranges, held

    @staticmethod
    def of(stack: WindowStack) -> RangeFit:
        return RangeFit(stack.points[0], stack.points[1], stack.ranges, stack.held)

    @property
    def counts(self) -> Index:
        """(w,) measurements of each row."""
        if self._held is None:
            return np.full(len(self._ranges), self._ranges.shape[1])
        return np.asarray(self._held.sum(axis=1))

    def rows(self, of: Index) -> RangeFit:
        """Those of windows `of` (k,); the only window stands for as many as are asked."""
        if len(self._ranges) == 1:
            return self
        chosen: RangeFit = object.__new__(RangeFit)
        chosen._a_mean, chosen._b_mean = self._a_mean[of], self._b_mean[of]
        chosen._a, chosen._b, chosen._ranges = self._a[of], self._b[of], self._ranges[of]
        chosen._held = None if self._held is None else self._held[of]
        return chosen

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

    def covariances(self, minima: Minima) -> Array:
        """(k, 3, 3) of x, y, theta in frame a."""
        return self._as_if_straight(minima) + self.by_arcs(minima.centred, minima.covariance)

    def is_vague(self, minima: Minima, groups: Groups) -> NDArray[np.bool_]:
        """(k,) whether the best of the same window fits, and one that counts is far from known."""
        limits = np.array([MAX_SIGMA_M, MAX_SIGMA_M, MAX_SIGMA_RAD]) * VAGUE
        far = np.einsum("kii->ki", self._as_if_straight(minima)) > limits**2
        best = groups.least(minima.chi2)
        counts = minima.chi2 < best + SURELY_CHI2
        fits = best <= POOR_FIT * (self.counts - 3)
        return np.asarray(fits & ~groups.where_all(~(far.any(axis=1) & counts)))

    def _as_if_straight(self, minima: Minima) -> Array:
        m = self.by_step(minima.centred)
        return np.asarray(m @ minima.covariance @ m.transpose(0, 2, 1))

    def other_side(self, centred: Array) -> Array:
        """The same poses with b on the other side of a at the shortest range."""
        ranges = self._ranges if self._held is None else np.where(self._held, self._ranges, np.inf)
        at = np.arange(len(ranges)), ranges.argmin(axis=1)
        out: Array = centred.copy()
        out[:, 0] -= 2 * (centred[:, 0] + centred[:, 1] * self._b[at] - self._a[at])
        return out

    def linear(self, centred: Array, bias: Array | None = None) -> tuple[Array, Array]:
        """Equation (1) about centred poses.

        Args:
            bias: (k,) that predicted ranges are longer by, m.

        Returns:
            Unit lines of sight from a to b in frame a, complex (k, n); and (k, 5, n): derivatives
            of the range by the three parts of a step (see `stepped`), by the bias, and the
            predicted range minus the measured one. All are zero where there is no measurement.
        """
        turned = centred[:, 1:] * self._b
        sight = turned - self._a
        sight += centred[:, :1]
        e, u = residuals(sight, self._ranges)  # eq. (1)
        along = u * _direction(centred[:, :1]).conj()
        rows = np.empty((len(centred), 5, self._ranges.shape[1]))
        rows[:, 0], rows[:, 1] = along.real, along.imag
        np.multiply(turned, u.conj(), out=turned)
        rows[:, 2] = -turned.imag
        rows[:, 3] = 1.0
        rows[:, 4] = e if bias is None else e + bias[:, None]
        if self._held is not None:
            rows *= self._held[:, None]
            u *= self._held
        return u, rows


def stepped(centred: Array, step: Array) -> Array:
    """Centred poses after steps (k, 3): away from a, around a (both m), heading (rad)."""
    place = centred[:, 0]
    distance = np.abs(place)
    angles = step[:, 1:3].copy()
    angles[:, 0] /= np.maximum(distance, AROUND_M)
    out: Array = np.exp(1j * angles)
    away = distance + step[:, 0]
    out[:, 0] *= away
    near = distance <= AROUND_M
    if near.any():
        out[near, 0] = away[near] + 1j * step[near, 1]
    out[:, 0] *= _direction(place)
    out[:, 1] *= centred[:, 1]
    return out


def _angle(number: Array) -> Array:
    return np.asarray(np.arctan2(number.imag, number.real))


def _direction(place: Array) -> Array:
    # nowhere is straight ahead
    place = place + _NOWHERE
    return np.asarray(place / np.abs(place))
