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

from drslamd.slam.odometry.noise import OdometryNoise, growth, random_covariance
from drslamd.slam.range_model import LINKTRACK, RangeModel, RangeNoise
from drslamd.slam.relative_pose.window import Window
from drslamd.slam.se2 import Array

_MATRIX = [[0, 1, 2], [1, 3, 4], [2, 4, 5]]
"""Where a packed covariance has the elements of its matrix."""


def way_twists(
    poses: Array, noises: Sequence[OdometryNoise], before: int, antenna_sigma: float = 0.0
) -> Array:
    """What the noise of odometry adds up to between measurements and reference time.

    Args:
        poses: (m, n, 3) of m robots, each in its body frame at the reference time; between them,
            and between them and the origin, the noise arises.
        noises: sigmas of each robot.
        before: how many measurements lie before the reference time.
        antenna_sigma: how far the point that ranges are measured from may be beside the antenna, m.

    Returns:
        (m, 7, 3, n): covariance (3, 3) of the random part of the twist [x, y, theta], the twist of
        one sigma of the yaw rate, that of one sigma of the scale, and those of the antenna by x and
        y. (A twist is the same from one end to the other as back, but for its sign.)
    """
    m, n = poses.shape[:2]
    paths, heading = poses[:, :, :2], poses[:, :, 2]
    track, there = np.zeros((m, n + 1, 2)), np.arange(n)
    there[before:] += 1
    track[:, there] = paths
    sums = growth(track)
    sums = (sums[:, there] - sums[:, before, None]).transpose(0, 2, 1)
    out = np.zeros((m, 7, 3, n))
    cos, sin = antenna_sigma * np.cos(heading), antenna_sigma * np.sin(heading)
    out[:, 5, 0], out[:, 5, 1], out[:, 6, 0], out[:, 6, 1] = cos, sin, -sin, cos
    for robot, noise in enumerate(noises):
        way = sums[robot]
        out[robot, :3] = random_covariance(noise, np.where(way[0] < 0, -way, way))[_MATRIX]
        out[robot, 3] = noise.yaw_rad_per_m * way[[1, 2, 0]]
        out[robot, 4, :2] = noise.scale * paths[robot].T
    return out


def moments(points: Array, directions: Array) -> Array:
    """(..., 3, n): how a twist [x, y, theta] moves points along directions (complex, (..., n))."""
    turned = (points.conj() * directions).imag
    return np.stack([directions.real, directions.imag, turned], axis=-2)


def odometry_covariance(twist: Array, moment: Array, before: int) -> Array:
    """(k, n, n): what odometry noise does to the residuals; only the lower triangles are meant.

    Args:
        twist: (m, 7, 3, n) `way_twists` of m robots.
        moment: (k, m, 3, n) `moments` of the antennas along the lines of sight.
        before: how many measurements lie before the reference time.
    """
    k, n = len(moment), moment.shape[-1]
    far = (twist * moment[:, :, None]).sum(axis=3)
    near = far.copy()
    # of two measurements before the reference time the first is the farther one; after it the
    # noise is another, and the last is
    near[:, :, :3, :before] = moment[..., :before]
    constant = far[:, :, 3:].reshape(k, -1, n)
    far[:, :, :3, before:] = moment[..., before:]
    lower = far.reshape(k, -1, n).transpose(0, 2, 1) @ near.reshape(k, -1, n)
    across = constant[:, :, before:].transpose(0, 2, 1) @ constant[:, :, :before]
    lower[:, before:, :before] = across
    return np.asarray(lower)


class WindowNoise:
    """The covariance of the residuals of one window, for any relative pose."""

    def __init__(
        self,
        window: Window,
        a_points: Array,
        b_points: Array,
        ranges: RangeNoise,
        a: OdometryNoise,
        b: OdometryNoise,
        model: RangeModel = LINKTRACK,
    ) -> None:
        """Noise of a window with antennas at a_points, b_points (n, 2), of its sensors."""
        self.sigma = ranges.sigma
        self.huber_sigmas = model.huber_sigmas
        self._before = window.before
        self._ranges = model.covariance(window.t, window.ranges, ranges)
        self._t, self._model = window.t, model
        self._excess = ranges.scatter**2 - 1
        self._points = np.stack([_complex(a_points), _complex(b_points)])
        poses = np.stack([window.a_poses, window.b_poses])
        self._twists = way_twists(poses, (a, b), self._before, model.antenna_sigma_m)

    def covariance(self, u: Array, heading: Array, weights: Array) -> Array:
        """(k, n, n), of which only the lower triangles are meant.

        Args:
            u: (k, n) unit lines of sight in frame a, complex.
            heading: (k,) of b in frame a, complex.
            weights: (k, n) in (0, 1], thin out outliers.
        """
        directions = np.stack([u, u * heading[:, None].conj()], axis=1)
        moment = moments(self._points, directions)
        covariance = odometry_covariance(self._twists, moment, self._before)
        covariance += self._ranges
        np.einsum("kii->ki", covariance)[:] += self.sigma**2 * (1 / weights - 1)
        return covariance

    def excess(self, gain: Array) -> Array:
        """(k, 3, 3) what ranges that scatter otherwise than allowed for add to a covariance.

        Args:
            gain: (k, 3, n) how the estimate follows the residuals, gain G: with true noise V' in
                the place of V the covariance G V G' becomes G V' G' (a sandwich).
        """
        if not self._excess:
            return np.zeros((len(gain), 3, 3))
        scatter = self._model.correlated_covariance(self._t, self.sigma)
        return np.asarray(self._excess * (gain @ scatter @ gain.transpose(0, 2, 1)))


def _complex(points: Array) -> Array:
    return np.asarray(points[:, 0] + 1j * points[:, 1])
