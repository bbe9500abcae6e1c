"""The noise of one window: how wrong the residuals of module 1 may be, all of them together.

Ranges of one pair share a constant bias and a slowly varying part; what odometry got wrong on the
way bends all earlier positions at once. With the covariance of the whole residual vector the pose
is a generalised least-squares problem in three unknowns, its covariance is honest, and a longer
window is never worse than a shorter one, because old measurements lose weight by themselves.

What odometry adds up between the reference time and a measurement is a twist, and the nearer of two
measurements shares all of its twist with the farther one. So the covariance of two residuals is a
product of one vector of the farther and one of the nearer: the lower triangle of all of it is one
matrix product of rank fourteen.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from drslamd.conventions import GRID_HZ
from drslamd.slam.odometry.gyro_noise import GyroNoise, turned_seconds
from drslamd.slam.odometry.noise import GYRO, OdometryNoise, forwards, growth, random_covariance
from drslamd.slam.relative_pose.estimate import PairNoise
from drslamd.slam.relative_pose.window_stack import WindowStack, middle
from drslamd.slam.se2 import Array, Index

_MATRIX = [[0, 1, 2], [1, 3, 4], [2, 4, 5]]
"""Where a packed covariance has the elements of its matrix."""


def way_twists(
    poses: Array,
    noises: Sequence[OdometryNoise],
    before: Index,
    antenna_sigma: float = 0.0,
    seconds: Array | None = None,
) -> Array:
    """What the noise of odometry adds up to between measurements and reference time.

    Args:
        poses: (m, n, 3) of m robots, each in its body frame at the reference time; between them,
            and between them and the origin, the noise arises.
        noises: sigmas of each robot.
        before: (m,) how many measurements lie before the reference time.
        antenna_sigma: how far the point that ranges are measured from may be beside the antenna, m.
        seconds: (m, n) in motion under a gyro, of the n steps between measurements and reference.

    Returns:
        (m, 7, 3, n): covariance (3, 3) of the random part of the twist [x, y, theta], the twist of
        one sigma of the yaw rate, that of one sigma of the scale, and those of the antenna by x and
        y. (A twist is the same from one end to the other as back, but for its sign.)
    """
    m, n = poses.shape[:2]
    paths, heading = poses[:, :, :2], poses[:, :, 2]
    robot, there = np.arange(m)[:, None], np.arange(n) + (np.arange(n) >= before[:, None])
    track = np.zeros((m, n + 1, 2))
    track[robot, there] = paths
    sums = growth(track, seconds)
    way = np.moveaxis(sums[robot, there] - sums[robot, before[:, None]], -1, 0)
    # the sigmas of all robots as those of one, whose numbers are columns
    scale, yaw, shift, turn = np.array([noise.by_wheels for noise in noises]).T[..., None]
    gyro = None if seconds is None else _gyros(noises)
    noise = OdometryNoise(scale, yaw, shift, turn, gyro)
    out = np.zeros((m, 7, 3, n))
    cos, sin = antenna_sigma * np.cos(heading), antenna_sigma * np.sin(heading)
    out[:, 5, 0], out[:, 5, 1], out[:, 6, 0], out[:, 6, 1] = cos, sin, -sin, cos
    random = random_covariance(noise, forwards(way))
    out[:, :3] = random[_MATRIX].transpose(2, 0, 1, 3)
    out[:, 3] = (noise.yaw_rad_per_m * way[[1, 2, 0]]).swapaxes(0, 1)
    if noise.gyro is not None:  # (as if both constants went together: a little too careful)
        for column, place in enumerate((1, 2, 0)):
            out[:, 3, column] += noise.gyro.yaw_rad_per_s * way[GYRO][place]
    out[:, 4, :2] = (noise.scale * paths.transpose(2, 0, 1)).swapaxes(0, 1)
    return out


def _gyros(noises: Sequence[OdometryNoise]) -> GyroNoise:
    """Of all robots as one, whose sigmas are columns; 0 of those without."""
    told = [noise.gyro for noise in noises]
    sigmas = [(g.yaw_rad_per_sqrt_s, g.yaw_rad_per_s) if g else (0.0, 0.0) for g in told]
    random, rate = np.array(sigmas).T[..., None]
    return GyroNoise(random, rate, since=0)


def gyro_seconds(stack: WindowStack) -> Array:
    """(2 w, n) in motion under a gyro, s, of the robots a and then b, see `way_twists`."""
    w, n = stack.t.shape
    row, there = np.arange(w)[:, None], np.arange(n) + (np.arange(n) >= stack.before[:, None])
    samples, poses = np.zeros((w, n + 1)), np.zeros((2, w, n + 1, 3))
    samples[row, there] = stack.t * GRID_HZ
    poses[:, row, there] = stack.poses
    since, until = np.moveaxis(stack.gyros * GRID_HZ, -1, 0)[..., None]
    seconds = turned_seconds(np.stack([samples, samples]), poses, (since, until))
    return seconds.reshape(2 * w, n)


def moments(points: Array, directions: Array) -> Array:
    """(..., 3, n): how a twist [x, y, theta] moves points along directions (complex, (..., n))."""
    turned = (points.conj() * directions).imag
    return np.stack([directions.real, directions.imag, turned], axis=-2)


def odometry_covariance(twist: Array, moment: Array, before: Index) -> Array:
    """(k, n, n): what odometry noise does to the residuals; only the lower triangles are meant.

    Args:
        twist: (k or 1, m, 7, 3, n) `way_twists` of m robots.
        moment: (k, m, 3, n) `moments` of the antennas along the lines of sight.
        before: (k,) how many measurements lie before the reference time.
    """
    k, n = len(moment), moment.shape[-1]
    far = twist[:, :, :, 0] * moment[:, :, None, 0]
    far += twist[:, :, :, 1] * moment[:, :, None, 1]
    far += twist[:, :, :, 2] * moment[:, :, None, 2]
    constant = far[:, :, 3:].reshape(k, -1, n)
    near = far.copy()
    # of two measurements before the reference time the first is the farther one; after it the
    # noise is another, and the last is
    splits = _where_split(before)
    for split, rows in splits:
        near[rows, :, :3, :split] = moment[rows, ..., :split]
        far[rows, :, :3, split:] = moment[rows, ..., split:]
    lower = far.reshape(k, -1, n).transpose(0, 2, 1) @ near.reshape(k, -1, n)
    for split, rows in splits:
        if split < n:
            beyond, here = constant[rows, :, split:], constant[rows, :, :split]
            lower[rows, split:, :split] = beyond.transpose(0, 2, 1) @ here
    return np.asarray(lower)


def _where_split(before: Index) -> list[tuple[int, slice | Index]]:
    """The values of `before` (k,), and which rows have each."""
    if (before == before[0]).all():
        return [(int(before[0]), slice(None))]
    return [(split, np.flatnonzero(before == split)) for split in np.unique(before).tolist()]


class WindowNoise:
    """The covariances of the residuals of windows, for any relative poses.

    Attributes:
        counts: (w,) measurements of each window; longest: to which all are filled up.
    """

    def __init__(self, stack: WindowStack, noises: Sequence[PairNoise]) -> None:
        """
        Args:
            noises: of the sensors of each window, all of one range model.

        Raises:
            ValueError: they are of several.
        """
        model = noises[0].model
        if any(noise.model is not model and noise.model != model for noise in noises):
            raise ValueError("windows of several range models")
        self.counts, self.longest = stack.counts, stack.t.shape[1]
        self._huber_sigmas = model.huber_sigmas
        self._t, self._model, self._held = stack.t, model, stack.held
        ranges = [(n.ranges.sigma, n.ranges.bias_sigma, n.ranges.scatter) for n in noises]
        sigma, bias, scatter = np.array(ranges).T
        self._sigma, self._excess = sigma, scatter**2 - 1
        self._beyond = np.array([n.ranges.bias_beyond for n in noises]) ** 2
        self._before = stack.before
        self._points = stack.points.transpose(1, 0, 2)
        robots = [noise.a for noise in noises] + [noise.b for noise in noises]
        poses = stack.poses.reshape(-1, self.longest, 3)
        seconds = gyro_seconds(stack) if any(robot.gyro for robot in robots) else None
        before = np.tile(stack.before, 2)
        twists = way_twists(poses, robots, before, model.antenna_sigma_m, seconds)
        self._twists = twists.reshape(2, -1, 7, 3, self.longest).swapaxes(0, 1)
        self._ranges = model.covariance(stack.t, stack.ranges, sigma, bias)
        if self._held is not None:
            # what fills a window up has a noise of its own, and none in common with the rest
            self._twists *= self._held[:, None, None, None]
            self._ranges *= self._held[:, None]
            self._ranges *= self._held[:, :, None]
            np.einsum("wnn->wn", self._ranges)[:] += ~self._held

    def sigmas(self, of: Index) -> Array:
        """(k, 1) of single ranges of windows `of` (k,)."""
        return np.asarray(self._sigma[of, None])

    def weights(self, of: Index, e: Array) -> Array:
        """(k, n): ranges lose weight that are far from the middle of all.

        Args:
            of: (k,) windows; e: (k, n) residuals.
        """
        beyond = self._huber_sigmas * self.sigmas(of)
        off = np.abs(e - middle(e, self.counts[of])[:, None])
        return np.asarray((beyond / np.maximum(off, beyond)) ** 2)

    def covariance(self, of: Index, u: Array, heading: Array, weights: Array) -> Array:
        """(k, n, n), of which only the lower triangles are meant.

        Args:
            of: (k,) windows.
            u: (k, n) unit lines of sight in frame a, complex, 0 where there is no measurement.
            heading: (k,) of b in frame a, complex.
            weights: (k, n) in (0, 1], thin out outliers.
        """
        rows = self._rows(of)
        directions = np.stack([u, u * heading[:, None].conj()], axis=1)
        moment = moments(self._points[rows], directions)
        covariance = odometry_covariance(self._twists[rows], moment, self._before[of])
        covariance += self._ranges[rows]
        diagonal = covariance.reshape(len(u), -1)[:, :: self.longest + 1]
        diagonal += self.sigmas(of) ** 2 * (1 / weights - 1)
        return covariance

    def excess(self, of: Index, gain: Array) -> Array:
        """(k, 3, 3) what ranges that scatter otherwise than allowed for, and biases that are less
        known than held, add to a covariance.

        Args:
            of: (k,) windows.
            gain: (k, 3, n) how the estimate follows the residuals, gain G: with true noise V' in
                the place of V the covariance G V G' becomes G V' G' (a sandwich).
        """
        added = np.zeros((len(gain), 3, 3))
        if self._excess[of].any():
            rows = self._rows(of)
            scatter = self._model.correlated_covariance(self._t[rows], self._sigma[rows])
            scattered = gain @ scatter @ gain.transpose(0, 2, 1)
            added += self._excess[of, None, None] * scattered
        if self._beyond[of].any():
            by_bias = gain.sum(axis=2)
            added += self._beyond[of, None, None] * by_bias[:, :, None] * by_bias[:, None, :]
        return added

    def _rows(self, of: Index) -> Index | slice:
        """The only window stands for as many as are asked."""
        return slice(None) if len(self._t) == 1 else of
