"""The model of odometry noise: how wrong dead reckoning is, over any way that was driven.

Four sigmas describe one robot. Scale and yaw rate are wrong by constants, the rest is random and
grows with the path:

    distance' = (1 + scale) distance + N(0, translation^2 |distance|)
    turn'     = turn + yaw |distance| + N(0, yaw_random^2 |distance|)

Where a gyro gives the turn, it errs by time (`gyro_noise`), with t the seconds in motion:

    turn'     = turn + rate t + N(0, rate_random^2 t)

Errors are left twists in the frame of the origin, where they add up: a yaw error at place p moves
all that follows by the twist [y, -x, 1], a translation error moves it by itself, and a wrong scale
by the way gone. So six sums along a chain for each source of the heading, and the path length, give
the covariance between any two of its poses (`growth`). Modules 1, 2 and 3 and the paper's
optimisers all take it from here.

Covariances are rows here, in the order xx xy xt yy yt tt of `se2.packed`, with one column for each
way: a few operations on long rows instead of many small matrices.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from drslamd.slam.odometry.gyro_noise import GyroNoise
from drslamd.slam.se2 import Array

MOST_SCALE = 0.5
"""Largest sigma of the scale that a configuration may state."""
MOST_TRANSLATION = 1.0
"""Likewise of random translation, m per sqrt(m)."""
MOST_YAW = math.radians(20)
"""Likewise of the yaw rate, rad/m, and of random yaw, rad per sqrt(m)."""
ROUNDING = 1.001
"""Sigmas travel as 32-bit numbers."""
OTHER_PATH_M, OTHER_S = 10.0, 60.0
"""Over so much one yaw rate counts as random that is not the one which module 3 learns."""
ACROSS = 0.3
"""Random translation across a way over that along it: wheels roll, and hardly slip sideways. It
counts where a gyro gives the heading; that of wheels is uncertain by more than this takes away."""
LEAST_PATH_M = 1e-9
"""Of a way that has a direction."""

WHEELS, GYRO, PATH, SUMS = slice(0, 6), slice(6, 12), 12, 13
"""Which of the sums of `growth` are those of the heading by wheels and by gyro and the length of
the path, and how many there are."""

MIRRORED_SUMS = np.array([*(1, -1, 1, 1, -1, 1) * 2, 1.0])
"""Times these sums, those of the mirror image of a way in the axis of x."""


@dataclass(frozen=True)
class OdometryNoise:
    """Sigmas of dead reckoning.

    Attributes:
        scale: of the constant scale error, a fraction.
        yaw_rad_per_m: of the constant yaw rate.
        translation_per_sqrt_m: of random translation, m per square root of a metre.
        yaw_rad_per_sqrt_m: of random yaw.
        gyro: of the heading where a gyro gave it; None where none ever did.
    """

    scale: float
    yaw_rad_per_m: float
    translation_per_sqrt_m: float
    yaw_rad_per_sqrt_m: float
    gyro: GyroNoise | None = None

    @property
    def by_wheels(self) -> tuple[float, float, float, float]:
        """The four sigmas."""
        turn = self.yaw_rad_per_sqrt_m
        return self.scale, self.yaw_rad_per_m, self.translation_per_sqrt_m, turn

    @property
    def gyro_span(self) -> tuple[int, int] | None:
        """Samples whose heading a gyro gave."""
        return None if self.gyro is None else self.gyro.span

    @property
    def learns_gyro(self) -> bool:
        """Is the constant yaw rate that module 3 learns that of a gyro, in rad/s?"""
        return self.gyro is not None and self.gyro.is_in_use

    def is_plausible(self) -> bool:
        """Could a configuration say this?"""
        most = (MOST_SCALE, MOST_YAW, MOST_TRANSLATION, MOST_YAW)
        is_gyro_plausible = self.gyro is None or self.gyro.is_plausible()
        return is_gyro_plausible and all(
            0 < value <= ROUNDING * limit for value, limit in zip(self.by_wheels, most, strict=True)
        )

    def random_part(self) -> OdometryNoise:
        """Without the two constants, where those are unknowns of their own."""
        turn, gyro = self.yaw_rad_per_sqrt_m, self.gyro
        if gyro is not None and gyro.is_in_use:
            turn = math.hypot(turn, self.yaw_rad_per_m * math.sqrt(OTHER_PATH_M))
            gyro = replace(gyro, yaw_rad_per_s=0.0)
        elif gyro is not None:
            random = math.hypot(gyro.yaw_rad_per_sqrt_s, gyro.yaw_rad_per_s * math.sqrt(OTHER_S))
            gyro = replace(gyro, yaw_rad_per_s=0.0, yaw_rad_per_sqrt_s=random)
        return OdometryNoise(0.0, 0.0, self.translation_per_sqrt_m, turn, gyro)


def growth(places: Array, seconds: Array | None = None) -> Array:
    """Sums along a chain from which the covariance between any two of its poses follows.

    Args:
        places: (..., k, 2 or more) o_T_a of chains without holes; x and y count.
        seconds: (..., k - 1) in motion under a gyro, None where wheels gave all the heading.

    Returns:
        (..., k, 13): the integrals over s of 1, y, -x, y*y, -x*y and x*x where the wheels gave the
        heading, those over t where a gyro did, and the path length s.
    """
    place = places[..., :2]
    before, after = place[..., :-1, :], place[..., 1:, :]
    sums = np.zeros((*place.shape[:-1], SUMS))
    terms = step_sums(after - before, (after + before) / 2, seconds)
    np.cumsum(terms, axis=-2, out=sums[..., 1:, :])
    return sums


def step_sums(way: Array, middle: Array, seconds: Array | None = None) -> Array:
    """(..., 13) the terms of `growth` over straight steps `way` (..., 2) about `middle` (..., 2).

    Args:
        seconds: (...) see `growth`.
    """
    x, y = middle[..., 0], middle[..., 1]
    length = np.hypot(way[..., 0], way[..., 1])
    out = np.zeros((*length.shape, SUMS))
    out[..., PATH] = length
    terms = (1.0, y, -x, y * y, -x * y, x * x)
    by_wheels = length if seconds is None else np.where(seconds > 0, 0.0, length)
    for column, term in enumerate(terms, WHEELS.start):
        out[..., column] = term * by_wheels
    if seconds is not None:
        for column, term in enumerate(terms, GYRO.start):
            out[..., column] = term * seconds
    return out


def twist_covariance(noise: OdometryNoise, way: Array, sums: Array) -> Array:
    """(6, m) covariance of the twists that odometry adds over m ways, in the frame of the origin.

    The noise between two places is the same in both directions of time.

    Args:
        way: (2, m) difference of the places at both ends, m.
        sums: (13, m) difference of `growth` there.
    """
    return np.array(_twist_rows(noise, way, forwards(sums)))


def _twist_rows(
    noise: OdometryNoise, way: Sequence[Any] | Array, forward: Sequence[Any] | Array
) -> list[Any]:
    """The six rows of `twist_covariance`, of sums that lead forwards; of one way, numbers."""
    rows = _random_rows(noise, forward)
    wx, wy = noise.scale * way[0], noise.scale * way[1]
    rates = [_turning(noise.yaw_rad_per_m, forward, WHEELS)]
    if noise.gyro is not None:
        rates.append(_turning(noise.gyro.yaw_rad_per_s, forward, GYRO))
    rows[0] += wx * wx + sum(by * by for by, _, _ in rates)
    rows[1] += wx * wy + sum(by * bx for by, bx, _ in rates)
    rows[2] += sum(by * bs for by, _, bs in rates)
    rows[3] += wy * wy + sum(bx * bx for _, bx, _ in rates)
    rows[4] += sum(bx * bs for _, bx, bs in rates)
    rows[5] += sum(bs * bs for _, _, bs in rates)
    return rows


def _turning(rate: float, sums: Sequence[Any] | Array, which: slice) -> tuple[Any, Any, Any]:
    """How a constant yaw rate moves places by x and y, and what it turns."""
    first = which.start
    return rate * sums[first + 1], rate * sums[first + 2], rate * sums[first]


def forwards(sums: Array) -> Array:
    """Sums (13, m) of ways that may go back in time, as of the same ways forwards."""
    return np.asarray(np.where(sums[PATH] + sums[GYRO.start] < 0, -sums, sums))


def random_covariance(noise: OdometryNoise, sums: Array) -> Array:
    """(6, m): the part of `twist_covariance` that is not constant for a robot, of sums (13, m)."""
    return np.array(_random_rows(noise, sums))


def _random_rows(noise: OdometryNoise, sums: Sequence[Any] | Array) -> list[Any]:
    """The six rows of `random_covariance`; of one way, numbers."""
    s, y, x_neg, yy, xy_neg, xx = sums[WHEELS]
    turn, shift = noise.yaw_rad_per_sqrt_m**2, noise.translation_per_sqrt_m**2
    drawn = shift * sums[PATH]
    rows = [turn * yy + drawn, turn * xy_neg, turn * y, turn * xx + drawn, turn * x_neg, turn * s]
    if noise.gyro is None:
        return rows
    random = noise.gyro.yaw_rad_per_sqrt_s**2
    s, y, x_neg, yy, xy_neg, xx = sums[GYRO]
    return [
        row + random * by_time
        for row, by_time in zip(rows, (yy, xy_neg, y, xx, x_neg, s), strict=True)
    ]


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
    if way.ndim == 1:
        # of one way: plain numbers are faster than arrays of one
        sum_of_one = difference.tolist()
        if sum_of_one[PATH] + sum_of_one[GYRO.start] < 0:
            sum_of_one = [-value for value in sum_of_one]
        xx, xy, xt, yy, yt, tt = _twist_rows(noise, way.tolist(), sum_of_one)
        return np.array([[xx, xy, xt], [xy, yy, yt], [xt, yt, tt]])
    return _matrices(
        twist_covariance(noise, np.moveaxis(way, -1, 0), np.moveaxis(difference, -1, 0))
    )


def link_covariance(noise: OdometryNoise, i_T_j: Array, sums: Array) -> Array:
    """(m, 3, 3): the same for links (m, 3) by themselves, in their frames i.

    Sums over a whole trajectory would lose the last digits of a short link far from the origin, and
    they do not know where a way leads across which wheels hold (`ACROSS`).

    Args:
        sums: (m, 13) of `growth` over the way that was driven from i to j, in frame i.
    """
    way = i_T_j[:, :2].T
    rows = twist_covariance(noise, way, sums.T)
    if noise.learns_gyro:
        rows[[0, 1, 3]] -= _held_across(noise, way, sums[:, PATH])
    return _matrices(rows)


def _held_across(noise: OdometryNoise, way: Array, path: Array) -> Array:
    """(3, m) xx, xy, yy of the random translation that is not there, across ways (2, m).

    Of an arc of length s about an angle a the part (1 + sin(a) / a) / 2 leads along its chord, and
    the chord is 2 s / a sin(a / 2). By the first terms of both series that part is
    2 chord / s - 1. Of a way that leads back nothing is taken, and along the chord nothing ever.
    """
    path, chord = np.abs(path), np.hypot(*way)
    straight = np.clip(2 * chord / np.maximum(path, LEAST_PATH_M) - 1, 0.0, 1.0)
    held = noise.translation_per_sqrt_m**2 * path * straight * (1 - ACROSS**2)
    across = np.array([-way[1], way[0]]) / np.maximum(chord, LEAST_PATH_M)
    return np.asarray(held * across[[0, 0, 1]] * across[[0, 1, 1]])


def seen_from(sums: Array, a_T_b: Array) -> Array:
    """(m, 13) sums of `growth` over ways in frames b, as frames a have them.

    Args:
        sums: (m, 13) in b; a_T_b: (m, 3).
    """
    out: Array = sums.copy()
    for which in (WHEELS, GYRO):
        out[:, which] = _seen_from(sums[:, which], a_T_b)
    return out


def _seen_from(sums: Array, a_T_b: Array) -> Array:
    """(m, 6) of (m, 6)."""
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


def by_yaw_rate(sums: Array, end: Array, noise: OdometryNoise | None = None) -> Array:
    """(m, 3) how a relative pose moves with the constant yaw rate, per rad/m or, of a robot whose
    gyro's rate is learned, per rad/s.

    Args:
        sums: (m, 13) of `growth` over the way from i to j, in frame i.
        end: (m, 2) where the way, or a point that moves with its end, is in frame i.
        noise: of the robot's odometry.
    """
    first = GYRO.start if noise is not None and noise.learns_gyro else WHEELS.start
    s, y, x_neg = sums[:, first], sums[:, first + 1], sums[:, first + 2]
    return np.stack([y - s * end[:, 1], x_neg + s * end[:, 0], s], axis=-1)


def _matrices(rows: Array) -> Array:
    """(..., 3, 3) of packed rows (6, ...)."""
    return np.moveaxis(rows[[[0, 1, 2], [1, 3, 4], [2, 4, 5]]], (0, 1), (-2, -1))
