"""The model of odometry noise: how wrong dead reckoning is, over any way that was driven.

Four sigmas describe one robot. Scale and yaw rate are wrong by constants, the rest is random and
grows with the path:

    distance' = (1 + scale) distance + N(0, translation^2 |distance|)
    turn'     = turn + yaw |distance| + N(0, yaw_random^2 |distance|)

Errors are left twists in the frame of the origin, where they add up: a yaw error at place p moves
all that follows by the twist [y, -x, 1], a translation error moves it by itself, and a wrong scale
by the way gone. So six sums along a chain (`growth`) give the covariance between any two of its
poses. Modules 1, 2 and 3 and the paper's optimisers all take it from here.

Covariances are rows here, in the order xx xy xt yy yt tt of `se2.packed`, with one column for each
way: a few operations on long rows instead of many small matrices.
"""

from __future__ import annotations

import math
from dataclasses import astuple, dataclass

import numpy as np

from drslamd.slam.se2 import Array

MOST_SCALE = 0.5
"""Largest sigma of the scale that a configuration may state."""
MOST_TRANSLATION = 1.0
"""Likewise of random translation, m per sqrt(m)."""
MOST_YAW = math.radians(20)
"""Likewise of the yaw rate, rad/m, and of random yaw, rad per sqrt(m)."""
ROUNDING = 1.001
"""Sigmas travel as 32-bit numbers."""


@dataclass(frozen=True)
class OdometryNoise:
    """Sigmas of dead reckoning.

    Attributes:
        scale: of the constant scale error, a fraction.
        yaw_rad_per_m: of the constant yaw rate.
        translation_per_sqrt_m: of random translation, m per square root of a metre.
        yaw_rad_per_sqrt_m: of random yaw.
    """

    scale: float
    yaw_rad_per_m: float
    translation_per_sqrt_m: float
    yaw_rad_per_sqrt_m: float

    def is_plausible(self) -> bool:
        """Could a configuration say this?"""
        most = (MOST_SCALE, MOST_YAW, MOST_TRANSLATION, MOST_YAW)
        return all(
            0 < value <= ROUNDING * limit for value, limit in zip(astuple(self), most, strict=True)
        )

    def random_part(self) -> OdometryNoise:
        """Without the two constants, where those are unknowns of their own."""
        return OdometryNoise(0.0, 0.0, self.translation_per_sqrt_m, self.yaw_rad_per_sqrt_m)


def growth(places: Array) -> Array:
    """Sums along a chain from which the covariance between any two of its poses follows.

    Args:
        places: (..., k, 2 or more) o_T_a of chains without holes; x and y count.

    Returns:
        (..., k, 6): path length s, then the integrals over s of y, -x, y*y, -x*y and x*x.
    """
    place = places[..., :2]
    before, after = place[..., :-1, :], place[..., 1:, :]
    sums = np.zeros((*place.shape[:-1], 6))
    np.cumsum(step_sums(after - before, (after + before) / 2), axis=-2, out=sums[..., 1:, :])
    return sums


def step_sums(way: Array, middle: Array) -> Array:
    """(..., 6) the terms of `growth` over straight steps `way` (..., 2) about `middle` (..., 2)."""
    x, y = middle[..., 0], middle[..., 1]
    length = np.hypot(way[..., 0], way[..., 1])
    terms = np.stack([np.ones_like(x), y, -x, y * y, -x * y, x * x], axis=-1)
    return np.asarray(terms * length[..., None])


def twist_covariance(noise: OdometryNoise, way: Array, sums: Array) -> Array:
    """(6, m) covariance of the twists that odometry adds over m ways, in the frame of the origin.

    The noise between two places is the same in both directions of time.

    Args:
        way: (2, m) difference of the places at both ends, m.
        sums: (6, m) difference of `growth` there.
    """
    forward = np.where(sums[:1] < 0, -sums, sums)
    covariance = random_covariance(noise, forward)
    wx, wy = noise.scale * way
    by, bx, bs = noise.yaw_rad_per_m * forward[[1, 2, 0]]
    covariance[0] += wx * wx + by * by
    covariance[1] += wx * wy + by * bx
    covariance[2] += by * bs
    covariance[3] += wy * wy + bx * bx
    covariance[4] += bx * bs
    covariance[5] += bs * bs
    return covariance


def random_covariance(noise: OdometryNoise, sums: Array) -> Array:
    """(6, m): the part of `twist_covariance` that is not constant for a robot, of sums (6, m)."""
    s, y, x_neg, yy, xy_neg, xx = sums
    turn, shift = noise.yaw_rad_per_sqrt_m**2, noise.translation_per_sqrt_m**2
    drawn = shift * s
    out = np.empty(sums.shape)
    out[0] = turn * yy + drawn
    out[1] = turn * xy_neg
    out[2] = turn * y
    out[3] = turn * xx + drawn
    out[4] = turn * x_neg
    out[5] = turn * s
    return out


def covariance_between(
    noise: OdometryNoise, poses: Array, sums: Array, i: Array | int, k: Array | int
) -> Array:
    """(..., 3, 3) covariance of the left twist that odometry adds between poses i and k.

    Args:
        noise: sigmas of this robot.
        poses: (m, 3) o_T_a.
        sums: `growth(poses)`.
        i, k: indices (broadcast together).
    """
    way, difference = poses[k, :2] - poses[i, :2], sums[k] - sums[i]
    return _matrices(
        twist_covariance(noise, np.moveaxis(way, -1, 0), np.moveaxis(difference, -1, 0))
    )


def link_covariance(noise: OdometryNoise, i_T_j: Array, sums: Array) -> Array:
    """(m, 3, 3): the same for links (m, 3) by themselves, in their frames i.

    Sums over a whole trajectory would lose the last digits of a short link far from the origin.

    Args:
        sums: (m, 6) of `growth` over the way that was driven from i to j, in frame i.
    """
    return _matrices(twist_covariance(noise, i_T_j[:, :2].T, sums.T))


def seen_from(sums: Array, a_T_b: Array) -> Array:
    """(m, 6) sums of `growth` over ways in frames b, as frames a have them.

    Args:
        sums: (m, 6) in b; a_T_b: (m, 3).
    """
    s, by, bx, yy, xy, xx = sums[:, 0], sums[:, 1], -sums[:, 2], sums[:, 3], -sums[:, 4], sums[:, 5]
    x0, y0, theta = a_T_b.T
    cos, sin = np.cos(theta), np.sin(theta)
    # turned ...
    x, y = cos * bx - sin * by, sin * bx + cos * by
    twice = 2 * cos * sin * xy
    txx, tyy = cos * cos * xx - twice + sin * sin * yy, sin * sin * xx + twice + cos * cos * yy
    txy = cos * sin * (xx - yy) + (cos * cos - sin * sin) * xy
    # ... and moved
    columns = [
        s,
        y + s * y0,
        -(x + s * x0),
        tyy + y0 * (2 * y + s * y0),
        -(txy + x0 * y + y0 * x + s * x0 * y0),
        txx + x0 * (2 * x + s * x0),
    ]
    return np.stack(columns, axis=-1)


def by_yaw_rate(sums: Array, end: Array) -> Array:
    """(m, 3) how a relative pose moves with the constant yaw rate, per rad/m.

    Args:
        sums: (m, 6) of `growth` over the way from i to j, in frame i.
        end: (m, 2) where the way, or a point that moves with its end, is in frame i.
    """
    s, y, x_neg = sums[:, 0], sums[:, 1], sums[:, 2]
    return np.stack([y - s * end[:, 1], x_neg + s * end[:, 0], s], axis=-1)


def _matrices(rows: Array) -> Array:
    """(..., 3, 3) of packed rows (6, ...)."""
    return np.moveaxis(rows[[[0, 1, 2], [1, 3, 4], [2, 4, 5]]], (0, 1), (-2, -1))
