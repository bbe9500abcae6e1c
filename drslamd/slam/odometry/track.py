"""Dead reckoning: motions in, a trajectory on a 10 Hz grid out, with its uncertainty.

A track holds poses ``o_T_a`` in the odometry frame of one chain, already rounded to the
resolution in which they are sent: what a peer computes from our track is what we compute.
A sample exists only where the wheels spoke; a silence leaves a hole, and what follows it is
a new segment, because the motion across the hole is not known.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from drslamd.config import OdometrySection
from drslamd.conventions import (
    GRID_HZ,
    ROTATION_STEP_RAD,
    TRANSLATION_STEP_M,
    grid_index,
    grid_utime,
)
from drslamd.sensors.samples import Motion
from drslamd.slam.se2 import Array

STEPS = np.array([TRANSLATION_STEP_M, TRANSLATION_STEP_M, ROTATION_STEP_RAD])

OWN_TRACK_SAMPLES = 8 * 3600 * GRID_HZ
"""Eight hours of our own trajectory, for export: 7 MB."""
PEER_TRACK_SAMPLES = 180 * GRID_HZ
"""A peer's odometry is needed for one window and a little delay: 43 kB a peer."""


@dataclass(frozen=True)
class OdometryNoise:
    """Sigmas of dead reckoning; the first two are constant for a robot, the others random."""

    scale: float
    yaw_rad_per_m: float
    translation_per_sqrt_m: float
    yaw_rad_per_sqrt_m: float

    def is_plausible(self) -> bool:
        """Could a configuration say this? (A thousandth is left for rounding on the way.)"""
        most = (0.5, math.radians(20), 1.0, math.radians(20))
        sigmas = (self.scale, self.yaw_rad_per_m,
                  self.translation_per_sqrt_m, self.yaw_rad_per_sqrt_m)  # fmt: skip
        return all(0 < value <= 1.001 * limit for value, limit in zip(sigmas, most, strict=True))

    @staticmethod
    def from_config(section: OdometrySection) -> OdometryNoise:
        return OdometryNoise(
            section.scale_sigma,
            math.radians(section.yaw_sigma_deg_per_m),
            section.random_translation_per_sqrt_m,
            math.radians(section.random_yaw_deg_per_sqrt_m),
        )


class Track:
    """Samples ``n0 .. n0 + len - 1`` of one chain; poses in steps, NaN where there is a hole."""

    def __init__(self, capacity: int) -> None:
        self._capacity = capacity
        self._poses = np.empty((64, 3))
        self._length = 0
        self.n0 = 0
        self.segment_start = 0
        """First sample after the last hole."""

    def __len__(self) -> int:
        return self._length

    @property
    def end(self) -> int:
        """One past the last sample."""
        return self.n0 + self._length

    @property
    def poses(self) -> Array:
        """(len, 3) o_T_a in metres and radians; theta counts on."""
        return np.asarray(self._poses[: self._length] * STEPS)

    def steps(self, n: int, count: int) -> Array:
        """Samples n .. n + count - 1 as whole numbers of steps (floats without fraction)."""
        return self._poses[n - self.n0 : n - self.n0 + count]

    def covers(self, first: int, last: int) -> bool:
        """Is every sample first .. last there, without a hole?"""
        return max(self.n0, self.segment_start) <= first and last < self.end

    def at(self, n: int) -> Array:
        """o_T_a at sample n, (3,)."""
        return np.asarray(self._poses[n - self.n0] * STEPS)

    def at_time(self, n: Array) -> Array:
        """o_T_a at fractional samples n (k,), linear between neighbours, (k, 3)."""
        n = np.clip(n, self.n0, self.end - 1)
        left = np.floor(n).astype(int)
        right = np.minimum(left + 1, self.end - 1)
        before, after = self._poses[left - self.n0], self._poses[right - self.n0]
        return np.asarray((before + (after - before) * (n - left)[:, None]) * STEPS)

    def append(self, n: int, steps: Array) -> None:
        """Add sample n; what lies between it and the last one is a hole.

        Args:
            n: after the last sample.
            steps: (3,) pose in whole steps.
        """
        if not self._length:
            self.n0 = self.segment_start = n
        hole = n - self.end
        if hole < 0:
            raise ValueError(f"sample {n} is before the end {self.end} of the track")
        if hole >= self._capacity:
            self._length, self.n0, self.segment_start, hole = 0, n, n, 0
        elif hole:
            self.segment_start = n
        self._reserve(hole + 1)
        self._poses[self._length : self._length + hole] = np.nan
        self._poses[self._length + hole] = steps
        self._length += hole + 1

    def _reserve(self, extra: int) -> None:
        if self._length + extra <= len(self._poses):
            return
        drop = max(0, self._length + extra - self._capacity)
        keep = self._poses[drop : self._length]
        room = min(self._capacity + self._capacity // 4 + extra, 2 * (len(keep) + extra) + 64)
        self._poses = np.empty((room, 3))
        self._poses[: len(keep)] = keep
        self._length = len(keep)
        self.n0 += drop


class DeadReckoning:
    """Adds up motions and puts a sample on the track at every tenth of a second."""

    def __init__(self) -> None:
        self.track = Track(OWN_TRACK_SAMPLES)
        self.path_m = 0.0
        self._utime: int | None = None
        self._pose = np.zeros(3)
        self._not_before = 0

    def add(self, motion: Motion) -> None:
        """Take one motion; motions must come in the order of their time."""
        since, before = self._utime, self._pose
        if since is not None and motion.utime <= since:
            return
        turn, distance = motion.turn_rad, motion.distance_m
        # the chord of the arc that both wheels drew, seen from half the turn
        chord = distance * float(np.sinc(turn / (2 * np.pi)))
        middle = before[2] + turn / 2
        self._pose = before + [chord * math.cos(middle), chord * math.sin(middle), turn]
        self._utime = motion.utime
        self.path_m += abs(distance)
        if since is None or motion.gap:
            # nothing is known of the time before; one sample at least stays empty, however short
            # the silence was, because the way across it is lost
            self._not_before = self.track.end + 1 if len(self.track) else grid_index(motion.utime)
            since = motion.utime - 1
        self._sample(since, before)

    def _sample(self, since: int, before: Array) -> None:
        """Put on the track what lies on the grid after `since`, where we were at `before`."""
        assert self._utime is not None
        step = self._pose - before
        for n in range(max(grid_index(since) + 1, self._not_before), grid_index(self._utime) + 1):
            share = (grid_utime(n) - since) / (self._utime - since)
            self.track.append(n, np.round((before + share * step) / STEPS))


# ---- how the uncertainty of a track grows ------------------------------------------------------


def growth(poses: Array) -> Array:
    """Sums along a chain from which the covariance between any two of its poses follows.

    Args:
        poses: (..., k, 3) o_T_a, chains without holes.

    Returns:
        (..., k, 6): path length s, then the integrals over s of y, -x, y*y, -x*y and x*x.
    """
    place = poses[..., :2]
    before, after = place[..., :-1, :], place[..., 1:, :]
    sums = np.zeros((*place.shape[:-1], 6))
    np.cumsum(_integrals(after - before, (after + before) / 2), axis=-2, out=sums[..., 1:, :])
    return sums


def _integrals(way: Array, middle: Array) -> Array:
    """(..., 6) the terms of `growth` over straight steps `way` (..., 2) about `middle` (..., 2)."""
    x, y = middle[..., 0], middle[..., 1]
    length = np.hypot(way[..., 0], way[..., 1])
    terms = np.stack([np.ones_like(x), y, -x, y * y, -x * y, x * x], axis=-1)
    return np.asarray(terms * length[..., None])


def covariance_between(
    noise: OdometryNoise, poses: Array, sums: Array, i: Array | int, k: Array | int
) -> Array:
    """Covariance of the left twist that odometry adds between poses i and k, in frame o.

    Left perturbations in the frame of the origin add up: a yaw error at place p moves all that
    follows by the twist [y, -x, 1], a translation error by itself, a scale error by the way gone.

    Args:
        noise: sigmas of this robot.
        poses: (m, 3) o_T_a.
        sums: `growth(poses)`.
        i, k: indices (broadcast together).

    Returns:
        (..., 3, 3).
    """
    way, sum_ = poses[k, :2] - poses[i, :2], sums[k] - sums[i]
    # the noise between two places is the same in both directions
    return _twist_covariance(noise, way, sum_ * np.where(sum_[..., :1] < 0, -1.0, 1.0))


def link_covariance(noise: OdometryNoise, i_T_j: Array) -> Array:
    """The same for straight links (m, 3) by themselves, in their frames i: (m, 3, 3).

    Sums over a whole trajectory would lose the last digits of a short link far from the origin.
    """
    way = i_T_j[:, :2]
    return _twist_covariance(noise, way, _integrals(way, way / 2))


def _twist_covariance(noise: OdometryNoise, way: Array, sums: Array) -> Array:
    """(..., 3, 3) for ways (..., 2) with the differences (..., 6) of `growth` along them."""
    s, y, x_neg, yy, xy_neg, xx = np.moveaxis(sums, -1, 0)
    turn = noise.yaw_rad_per_sqrt_m**2
    shift = noise.translation_per_sqrt_m**2
    rows = [
        [turn * yy + shift * s, turn * xy_neg, turn * y],
        [turn * xy_neg, turn * xx + shift * s, turn * x_neg],
        [turn * y, turn * x_neg, turn * s],
    ]
    random = np.stack([np.stack(row, axis=-1) for row in rows], axis=-2)
    stretch = np.concatenate([way, np.zeros_like(way[..., :1])], axis=-1) * noise.scale
    bend = np.stack([y, x_neg, s], axis=-1) * noise.yaw_rad_per_m
    return np.asarray(
        random
        + stretch[..., :, None] * stretch[..., None, :]
        + bend[..., :, None] * bend[..., None, :]
    )
